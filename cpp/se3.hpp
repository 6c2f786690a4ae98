// Rigid transforms in packs: rows of [R | p], one pose per lane.
#pragma once

#include "simd.hpp"

namespace kinverse::KINVERSE_ISA {

template <class P>
struct Vec3 {
  P x, y, z;
  friend KINVERSE_INLINE Vec3 operator+(Vec3 a, Vec3 b) { return {a.x + b.x, a.y + b.y, a.z + b.z}; }
  friend KINVERSE_INLINE Vec3 operator-(Vec3 a, Vec3 b) { return {a.x - b.x, a.y - b.y, a.z - b.z}; }
};

template <class P>
KINVERSE_INLINE P dot(Vec3<P> a, Vec3<P> b) {
  return a.x * b.x + (a.y * b.y + a.z * b.z);
}
template <class P>
KINVERSE_INLINE Vec3<P> cross(Vec3<P> a, Vec3<P> b) {
  return {a.y * b.z - a.z * b.y, a.z * b.x - a.x * b.z, a.x * b.y - a.y * b.x};
}
template <class P>
KINVERSE_INLINE Vec3<P> scaled(P k, Vec3<P> a) {
  return {k * a.x, k * a.y, k * a.z};
}

// Turn a vector about z by the angle with cosine c and sine s; negative s turns back.
template <class P>
KINVERSE_INLINE Vec3<P> turn_z(Vec3<P> a, P c, P s) {
  return {c * a.x - s * a.y, s * a.x + c * a.y, a.z};
}
template <class P>
KINVERSE_INLINE Vec3<P> turn_x(Vec3<P> a, P c, P s) {
  return {a.x, c * a.y - s * a.z, s * a.y + c * a.z};
}

// x, y, z are the columns of the rotation, p the origin, all in the base frame.
template <class P>
struct Frame {
  Vec3<P> x, y, z, p;
};

// frame * fixed, where fixed is a 3x4 block of constants
template <class P>
KINVERSE_INLINE Frame<P> compose(const Frame<P>& f, const double* fixed) {
  auto column = [&](int j) -> Vec3<P> {
    P a(fixed[j]), b(fixed[4 + j]), c(fixed[8 + j]);
    return {a * f.x.x + (b * f.y.x + c * f.z.x), a * f.x.y + (b * f.y.y + c * f.z.y),
            a * f.x.z + (b * f.y.z + c * f.z.z)};
  };
  return {column(0), column(1), column(2), f.p + column(3)};
}

// fixed * frame
template <class P>
KINVERSE_INLINE Frame<P> compose(const double* fixed, const Frame<P>& f) {
  auto turned = [&](Vec3<P> v) -> Vec3<P> {
    return {P(fixed[0]) * v.x + (P(fixed[1]) * v.y + P(fixed[2]) * v.z),
            P(fixed[4]) * v.x + (P(fixed[5]) * v.y + P(fixed[6]) * v.z),
            P(fixed[8]) * v.x + (P(fixed[9]) * v.y + P(fixed[10]) * v.z)};
  };
  Vec3<P> p = turned(f.p);
  return {turned(f.x), turned(f.y), turned(f.z), {p.x + P(fixed[3]), p.y + P(fixed[7]), p.z + P(fixed[11])}};
}

template <class P>
KINVERSE_INLINE Frame<P> inverse(const Frame<P>& f) {
  return {{f.x.x, f.y.x, f.z.x},
          {f.x.y, f.y.y, f.z.y},
          {f.x.z, f.y.z, f.z.z},
          {-dot(f.x, f.p), -dot(f.y, f.p), -dot(f.z, f.p)}};
}

template <class P>
KINVERSE_INLINE Frame<P> constant_frame(const double* m) {
  return {{P(m[0]), P(m[4]), P(m[8])}, {P(m[1]), P(m[5]), P(m[9])}, {P(m[2]), P(m[6]), P(m[10])}, {P(m[3]), P(m[7]), P(m[11])}};
}

// W poses of 16 doubles each, lane l from rows[l]
template <int W>
KINVERSE_INLINE Frame<Pack<W>> gather_frames(const double* const* rows) {
  alignas(64) double t[12][W];
  for (int l = 0; l < W; ++l)
    for (int k = 0; k < 12; ++k) t[k][l] = rows[l][k];
  auto at = [&](int k) { return load<W>(t[k]); };
  return {{at(0), at(4), at(8)}, {at(1), at(5), at(9)}, {at(2), at(6), at(10)}, {at(3), at(7), at(11)}};
}

// Column j of W rows in out[j], lane l from rows[l].
template <int W>
KINVERSE_INLINE void gather_rows(const double* const* rows, int columns, Pack<W>* out) {
  for (int j = 0; j < columns; ++j) {
    alignas(64) double t[W];
    for (int l = 0; l < W; ++l) t[l] = rows[l][j];
    out[j] = load<W>(t);
  }
}

// Angle of the rotation between two frames, by the chord |R - S|_F = 2 sqrt(2) sin(angle / 2): exact
// for small angles, where the arc cosine of the trace loses half the digits. Beyond 90 degrees of
// half angle the chord saturates at pi.
template <class P>
KINVERSE_INLINE P rotation_distance(const Frame<P>& a, const Frame<P>& b) {
  Vec3<P> dx = a.x - b.x, dy = a.y - b.y, dz = a.z - b.z;
  P chord2 = (dot(dx, dx) + dot(dy, dy) + dot(dz, dz)) * P(0.125);
  P s = sqrt(min(chord2, P(1.0)));
  P c = sqrt(max(P(1.0) - chord2, P(0.0)));
  return P(2.0) * atan2(s, c);
}

template <class P>
KINVERSE_INLINE P length(Vec3<P> a) {
  return sqrt(dot(a, a));
}

}  // namespace kinverse::KINVERSE_ISA
