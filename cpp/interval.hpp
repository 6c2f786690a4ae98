// Intervals with the arithmetic of packs: running a closed form on them shows that no joint values
// can exist. Rounding of the bounds is covered by the width the inputs are given (1e-6 by default,
// ten orders above it).
#pragma once

#include "se3.hpp"

namespace kinverse::KINVERSE_ISA {

struct Interval {
  double lo, hi;
  Interval() = default;
  KINVERSE_INLINE Interval(double x) : lo(x), hi(x) {}
  KINVERSE_INLINE Interval(double low, double high) : lo(low), hi(high) {}

  KINVERSE_INLINE bool contains(double x) const { return lo <= x && x <= hi; }

  friend KINVERSE_INLINE Interval operator+(Interval a, Interval b) { return {a.lo + b.lo, a.hi + b.hi}; }
  friend KINVERSE_INLINE Interval operator-(Interval a, Interval b) { return {a.lo - b.hi, a.hi - b.lo}; }
  friend KINVERSE_INLINE Interval operator-(Interval a) { return {-a.hi, -a.lo}; }
  friend inline Interval operator*(Interval a, Interval b) {
    double p[4] = {a.lo * b.lo, a.lo * b.hi, a.hi * b.lo, a.hi * b.hi};
    Interval r(p[0], p[0]);
    for (double x : p) {
      if (x < r.lo) r.lo = x;
      if (x > r.hi) r.hi = x;
    }
    return r;
  }
};

constexpr double UNBOUNDED = 1e300;

inline Interval squared(Interval a) {
  double l = a.lo * a.lo, h = a.hi * a.hi;
  double top = l > h ? l : h;
  return a.contains(0.0) ? Interval(0.0, top) : Interval(l < h ? l : h, top);
}

// square root of the part that is not negative
inline Interval root_of(Interval a) {
  double l = a.lo > 0 ? a.lo : 0.0, h = a.hi > 0 ? a.hi : 0.0;
  return {__builtin_sqrt(l), __builtin_sqrt(h)};
}

inline Interval quotient(Interval a, Interval b) {
  if (b.contains(0.0)) return {-UNBOUNDED, UNBOUNDED};
  return a * Interval(1.0 / b.hi, 1.0 / b.lo);
}

// All poses within these errors of T, and what rounding adds.
inline Frame<Interval> poses_near(const double* T, double position, double rotation) {
  auto around = [](double x, double width) {
    width += 1e-12 * (1.0 + __builtin_fabs(x));
    return Interval(x - width, x + width);
  };
  Frame<Interval> f;
  Vec3<Interval>* columns[3] = {&f.x, &f.y, &f.z};
  for (int j = 0; j < 3; ++j)
    *columns[j] = {around(T[j], rotation), around(T[4 + j], rotation), around(T[8 + j], rotation)};
  f.p = {around(T[3], position), around(T[7], position), around(T[11], position)};
  return f;
}

template <int W>
KINVERSE_INLINE Pack<W> squared(Pack<W> a) {
  return a * a;
}
template <int W>
KINVERSE_INLINE Pack<W> quotient(Pack<W> a, Pack<W> b) {
  return a / b;
}

}  // namespace kinverse::KINVERSE_ISA
