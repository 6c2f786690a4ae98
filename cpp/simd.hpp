// Packs of 1, 2, 4 or 8 doubles and the elementary functions on them.
//
// A product of two packs stays unevaluated until it meets a sum, where it becomes one fused
// multiply-add. With the compiler's own contraction switched off this makes every formula round the
// same way wherever it is inlined and however wide the pack is: the reason why a pose gives the same
// bits alone and in a batch.
#pragma once

#include <cstdint>

#if defined(__x86_64__)
#include <immintrin.h>
#endif

#ifndef KINVERSE_ISA
#error "compile with -DKINVERSE_ISA=<name of the instruction set>"
#endif

#define KINVERSE_INLINE inline __attribute__((always_inline))

namespace kinverse::KINVERSE_ISA {

#if defined(__AVX512F__)
constexpr int LANES = 8;
#elif defined(__AVX2__)
constexpr int LANES = 4;
#else
constexpr int LANES = 2;
#endif

constexpr double PI = 3.14159265358979323846;
constexpr double HALF_PI = 1.57079632679489661923;
constexpr double TWO_PI = 6.28318530717958647693;

template <int W>
struct Storage {
  typedef double Real __attribute__((vector_size(8 * W)));
  typedef long long Bits __attribute__((vector_size(8 * W)));
};
template <>
struct Storage<1> {
  using Real = double;
  using Bits = long long;
};

template <int W>
struct Mask {
  using Bits = typename Storage<W>::Bits;
  Bits m;
  friend KINVERSE_INLINE Mask operator&(Mask a, Mask b) { return {a.m & b.m}; }
  friend KINVERSE_INLINE Mask operator|(Mask a, Mask b) { return {a.m | b.m}; }
  friend KINVERSE_INLINE Mask operator!(Mask a) { return {~a.m}; }
  static KINVERSE_INLINE Mask all(bool value) { return {Bits{} - (value ? 1 : 0)}; }
};

// Bit l of the result is lane l.
template <int W>
KINVERSE_INLINE unsigned lane_bits(Mask<W> mask) {
#if defined(__AVX512DQ__)
  if constexpr (W == 8) return _mm512_movepi64_mask((__m512i)mask.m);
#endif
#if defined(__AVX2__)
  if constexpr (W == 4) return (unsigned)_mm256_movemask_pd((__m256d)mask.m);
#endif
  unsigned bits = 0;
  if constexpr (W == 1) {
    bits = mask.m ? 1u : 0u;
  } else {
    for (int l = 0; l < W; ++l) bits |= (mask.m[l] ? 1u : 0u) << l;
  }
  return bits;
}

// The mask whose lane l is bit l.
template <int W>
KINVERSE_INLINE Mask<W> lane_mask(unsigned bits) {
  Mask<W> mask;
  if constexpr (W == 1) {
    mask.m = (bits & 1u) ? -1 : 0;
  } else {
    for (int l = 0; l < W; ++l) mask.m[l] = (bits >> l & 1u) ? -1 : 0;
  }
  return mask;
}

template <class P>
struct Product;

template <int W>
struct Pack {
  using Real = typename Storage<W>::Real;
  using Bits = typename Storage<W>::Bits;
  static constexpr int width = W;
  Real v;

  Pack() = default;
  // x - 0 and not x + 0: it keeps the sign of -0, and compilers know that it is x
  KINVERSE_INLINE Pack(double x) : v(x - Real{}) {}
  KINVERSE_INLINE Pack(Product<Pack> p) : v(p.a * p.b) {}
  static KINVERSE_INLINE Pack raw(Real x) {
    Pack p;
    p.v = x;
    return p;
  }
  KINVERSE_INLINE double operator[](int lane) const {
    if constexpr (W == 1)
      return v;
    else
      return v[lane];
  }

  friend KINVERSE_INLINE Product<Pack> operator*(Pack a, Pack b) { return {a.v, b.v}; }
  friend KINVERSE_INLINE Pack operator/(Pack a, Pack b) { return raw(a.v / b.v); }
  friend KINVERSE_INLINE Pack operator+(Pack a, Pack b) { return raw(a.v + b.v); }
  friend KINVERSE_INLINE Pack operator-(Pack a, Pack b) { return raw(a.v - b.v); }
  friend KINVERSE_INLINE Pack operator+(Product<Pack> p, Pack c) { return fused(p.a, p.b, c.v); }
  friend KINVERSE_INLINE Pack operator+(Pack c, Product<Pack> p) { return fused(p.a, p.b, c.v); }
  friend KINVERSE_INLINE Pack operator+(Product<Pack> p, Product<Pack> r) { return p + Pack(r); }
  friend KINVERSE_INLINE Pack operator-(Product<Pack> p, Pack c) { return fused(p.a, p.b, -c.v); }
  friend KINVERSE_INLINE Pack operator-(Pack c, Product<Pack> p) { return fused(-p.a, p.b, c.v); }
  friend KINVERSE_INLINE Pack operator-(Product<Pack> p, Product<Pack> r) { return p - Pack(r); }
  friend KINVERSE_INLINE Pack operator-(Pack a) { return raw(-a.v); }
  friend KINVERSE_INLINE Product<Pack> operator-(Product<Pack> p) { return {-p.a, p.b}; }
  friend KINVERSE_INLINE Mask<W> operator<(Pack a, Pack b) { return compare(a.v < b.v); }
  friend KINVERSE_INLINE Mask<W> operator>(Pack a, Pack b) { return compare(a.v > b.v); }
  friend KINVERSE_INLINE Mask<W> operator<=(Pack a, Pack b) { return compare(a.v <= b.v); }
  friend KINVERSE_INLINE Mask<W> operator>=(Pack a, Pack b) { return compare(a.v >= b.v); }

  friend KINVERSE_INLINE Pack select(Mask<W> mask, Pack a, Pack b) { return raw(mask.m ? a.v : b.v); }
  friend KINVERSE_INLINE Pack min(Pack a, Pack b) { return raw(a.v < b.v ? a.v : b.v); }
  friend KINVERSE_INLINE Pack max(Pack a, Pack b) { return raw(a.v > b.v ? a.v : b.v); }
  friend KINVERSE_INLINE Pack abs(Pack a) { return a.with_bits([](Bits x) { return x & 0x7fffffffffffffffLL; }); }

  friend KINVERSE_INLINE Pack sqrt(Pack a) {
#if defined(__AVX512F__)
    if constexpr (W == 8) return raw((Real)_mm512_sqrt_pd((__m512d)a.v));
#endif
#if defined(__AVX2__)
    if constexpr (W == 4) return raw((Real)_mm256_sqrt_pd((__m256d)a.v));
#endif
#if defined(__SSE2__)
    if constexpr (W == 2) return raw((Real)_mm_sqrt_pd((__m128d)a.v));
#endif
    Pack r;
    if constexpr (W == 1)
      r.v = __builtin_sqrt(a.v);
    else
      for (int l = 0; l < W; ++l) r.v[l] = __builtin_sqrt(a.v[l]);
    return r;
  }

  template <class F>
  KINVERSE_INLINE Pack with_bits(F f) const {
    if constexpr (W == 1) {
      return raw(__builtin_bit_cast(double, f(__builtin_bit_cast(long long, v))));
    } else {
      return raw((Real)f((Bits)v));
    }
  }
  KINVERSE_INLINE Bits to_bits() const {
    if constexpr (W == 1)
      return __builtin_bit_cast(long long, v);
    else
      return (Bits)v;
  }

 private:
  template <class C>
  static KINVERSE_INLINE Mask<W> compare(C c) {
    if constexpr (W == 1)
      return {c ? -1LL : 0LL};
    else
      return {(typename Mask<W>::Bits)c};
  }
  // a*b + c, in one rounding where the processor has it
  static KINVERSE_INLINE Pack fused(Real a, Real b, Real c) {
#if defined(__AVX512F__)
    if constexpr (W == 8) return raw((Real)_mm512_fmadd_pd((__m512d)a, (__m512d)b, (__m512d)c));
#endif
#if defined(__FMA__)
    if constexpr (W == 4) return raw((Real)_mm256_fmadd_pd((__m256d)a, (__m256d)b, (__m256d)c));
    if constexpr (W == 2) return raw((Real)_mm_fmadd_pd((__m128d)a, (__m128d)b, (__m128d)c));
#endif
#if defined(__FMA__) || defined(__ARM_FEATURE_FMA)
    if constexpr (W == 1) {
      return raw(__builtin_fma(a, b, c));
    } else {
      Real r;
      for (int l = 0; l < W; ++l) r[l] = __builtin_fma(a[l], b[l], c[l]);
      return raw(r);
    }
#else
    return raw(a * b + c);
#endif
  }
};

template <int W>
struct Product<Pack<W>> {
  typename Pack<W>::Real a, b;
};

template <int W>
KINVERSE_INLINE Pack<W> load(const double* from) {
  Pack<W> p;
  __builtin_memcpy(&p.v, from, 8 * W);
  return p;
}
template <int W>
KINVERSE_INLINE void store(double* to, Pack<W> p) {
  __builtin_memcpy(to, &p.v, 8 * W);
}
template <int W>
KINVERSE_INLINE Pack<W> set_lane(Pack<W> p, int lane, double x) {
  if constexpr (W == 1)
    p.v = x;
  else
    p.v[lane] = x;
  return p;
}
template <int W>
KINVERSE_INLINE bool any(Mask<W> mask) {
  return lane_bits(mask) != 0;
}

template <int W>
KINVERSE_INLINE bool same_bits(Pack<W> a, Pack<W> b) {
  Mask<W> equal;
  equal.m = (typename Mask<W>::Bits)(a.to_bits() == b.to_bits());
  if constexpr (W == 1) return a.to_bits() == b.to_bits();
  return lane_bits(equal) == (1u << W) - 1u;
}

// Nearest integer (ties to even) for |x| < 2^51: the sum with 1.5 * 2^52 rounds in the last place.
constexpr double ROUND_MAGIC = 6755399441055744.0;
template <int W>
KINVERSE_INLINE Pack<W> round(Pack<W> x) {
  return (x + Pack<W>(ROUND_MAGIC)) - Pack<W>(ROUND_MAGIC);
}

template <int W>
KINVERSE_INLINE Pack<W> flip_sign(Pack<W> x, typename Pack<W>::Bits sign_bit) {
  return x.with_bits([&](typename Pack<W>::Bits b) { return b ^ sign_bit; });
}

// Beyond this the three-part reduction below loses digits; such lanes go to the C library.
constexpr double SINCOS_LIMIT = 1.0e5;

// sin and cos together: Cody-Waite reduction by pi/2 in three parts of 33 bits, then the minimax
// polynomials of fdlibm (k_sin.c, k_cos.c) on [-pi/4, pi/4].
template <int W>
KINVERSE_INLINE void sincos(Pack<W> x, Pack<W>& s, Pack<W>& c) {
  using P = Pack<W>;
  using Bits = typename P::Bits;
  P shifted = x * P(0.63661977236758134308) + P(ROUND_MAGIC);
  P k = shifted - P(ROUND_MAGIC);
  P r = x - k * P(1.57079632673412561417e+00);
  r = r - k * P(6.07710050630396597660e-11);
  r = r - k * P(2.02226624871116645580e-21);
  P z = r * r;
  P ps = z * P(1.58969099521155010221e-10) + P(-2.50507602534068634195e-08);
  ps = ps * z + P(2.75573137070700676789e-06);
  ps = ps * z + P(-1.98412698298579493134e-04);
  ps = ps * z + P(8.33333333332248946124e-03);
  ps = ps * z + P(-1.66666666666666324348e-01);
  P pc = z * P(-1.13596475577881948265e-11) + P(2.08757232129817482790e-09);
  pc = pc * z + P(-2.75573143513906633035e-07);
  pc = pc * z + P(2.48015872894767294178e-05);
  pc = pc * z + P(-1.38888888888741095749e-03);
  pc = pc * z + P(4.16666666666666019037e-02);
  P sr = P(r * z) * ps + r;
  P cr = P(z * z) * pc + (P(1.0) - P(0.5) * z);
  Bits quadrant = shifted.to_bits();
  Mask<W> odd;
  if constexpr (W == 1)
    odd.m = -(quadrant & 1);
  else
    odd.m = (quadrant & 1) != 0;
  s = flip_sign(select(odd, cr, sr), (Bits)((quadrant & 2) << 62));
  c = flip_sign(select(odd, sr, cr), (Bits)(((quadrant + 1) & 2) << 62));
  unsigned far = lane_bits(!(abs(x) <= P(SINCOS_LIMIT)));
  if (__builtin_expect(far != 0, 0)) {
    for (int l = 0; l < W; ++l)
      if (far >> l & 1u) {
        s = set_lane(s, l, __builtin_sin(x[l]));
        c = set_lane(c, l, __builtin_cos(x[l]));
      }
  }
}

// atan2(y, x) with one division: reduction of |y|/|x| to [0, tan(pi/8)], an odd polynomial of degree
// 23 fitted by least squares at Chebyshev points. atan2(+-0, +x) = +-0, atan2(0, 0) = 0.
template <int W>
KINVERSE_INLINE Pack<W> atan2(Pack<W> y, Pack<W> x) {
  using P = Pack<W>;
  using Bits = typename P::Bits;
  P ax = abs(x), ay = abs(y);
  P small = min(ax, ay), large = max(ax, ay);
  Mask<W> reduce = small > P(0.41421356237309503) * large;
  P t = select(reduce, small - large, small) / select(reduce, small + large, large);
  t = select(large > P(0.0), t, P(0.0));
  P z = t * t, z2 = z * z, z4 = z2 * z2;
  P p0 = (z * P(0.199999999999955165) + P(-0.333333333333333302)) +
         z2 * (z * P(0.111111110151870187) + P(-0.142857142846656808));
  P p1 = (z * P(0.0769218312537689209) + P(-0.0909090457530648908)) +
         z2 * (z * P(0.0585814090486632828) + P(-0.066645105255089366));
  P p2 = (z * P(0.0392304477847930952) + P(-0.0508540783458948426)) + z2 * P(-0.0191754047111049337);
  P a = P(t * z) * (p0 + z4 * (p1 + z4 * p2)) + t;
  a = select(reduce, a + P(0.78539816339744830962), a);
  a = select(ay > ax, P(HALF_PI) - a, a);
  a = select(x < P(0.0), P(PI) - a, a);
  Bits sign = y.to_bits() & (Bits)(Bits{} + (long long)0x8000000000000000ULL);
  return a.with_bits([&](Bits b) { return b | sign; });
}

}  // namespace kinverse::KINVERSE_ISA
