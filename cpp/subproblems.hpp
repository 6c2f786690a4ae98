// The small trigonometric equations that closed forms are made of, on packs or on intervals.
//
// A context answers three questions in the way that fits its numbers: the root of a discriminant, the
// direction of a vector that may vanish, and a condition that must hold. On packs a negative
// discriminant counts as zero (the nearest the arm can come; verification judges the result), a
// vanishing vector takes a free direction (a singular pose); on intervals both show what is possible.
#pragma once

#include "interval.hpp"
#include "kernels.hpp"
#include "se3.hpp"

namespace kinverse::KINVERSE_ISA {

// Two roots closer than this (squared sine) may be one solution: duplicates are looked for.
constexpr double NEAR_ROOT = 1e-11;
// A discriminant below minus this is no root at all: nothing verified can come of it.
constexpr double LOST_ROOT = 1e-6;
// A vector shorter than this times the size of the arm has no direction.
constexpr double NO_LENGTH = 1e-10;
// One shorter than this hardly has one: the tolerances leave it a range.
constexpr double WEAK_LENGTH = 1e-4;

template <int W>
struct LaneContext {
  using P = Pack<W>;
  Mask<W> near = Mask<W>::all(false);
  Mask<W> weak = Mask<W>::all(false);
  Mask<W> free_slot[FREE_SLOTS] = {Mask<W>::all(false), Mask<W>::all(false), Mask<W>::all(false), Mask<W>::all(false)};
  P free_cos[FREE_SLOTS] = {P(1.0), P(1.0), P(1.0), P(1.0)};
  P free_sin[FREE_SLOTS] = {P(0.0), P(0.0), P(0.0), P(0.0)};

  // What vectors that vanish point along; null leaves them at angle 0.
  KINVERSE_INLINE void take(const FreeDirections* free) {
    if (!free) return;
    for (int slot = 0; slot < FREE_SLOTS; ++slot) {
      free_cos[slot] = load<W>(free->cosine[slot]);
      free_sin[slot] = load<W>(free->sine[slot]);
    }
  }
  KINVERSE_INLINE P root(P discriminant, P scale) {
    near = near | ((discriminant < P(NEAR_ROOT) * scale) & (discriminant > P(-LOST_ROOT) * scale));
    return sqrt(max(discriminant, P(0.0)));
  }
  // (c, s) to unit length; shorter than NO_LENGTH * sqrt(scale2) it has no direction
  KINVERSE_INLINE void direction(P& c, P& s, P scale2, int slot) {
    P n2 = c * c + s * s;
    Mask<W> none = !(n2 > P(NO_LENGTH * NO_LENGTH) * scale2);
    P k = P(1.0) / sqrt(n2);
    c = select(none, free_cos[slot], c * k);
    s = select(none, free_sin[slot], s * k);
    weak = weak | !(n2 > P(WEAK_LENGTH * WEAK_LENGTH) * scale2);
    free_slot[slot] = free_slot[slot] | none;
  }
  KINVERSE_INLINE P cosine(P c) { return max(min(c, P(1.0)), P(-1.0)); }
  KINVERSE_INLINE void equation(P, double) {}
  KINVERSE_INLINE P angle(P s, P c) { return atan2(s, c); }
};

struct IntervalContext {
  using P = Interval;
  bool possible = true;

  Interval root(Interval discriminant, Interval) {
    if (discriminant.hi < 0.0) possible = false;
    return root_of(discriminant);
  }
  // A direction that the inputs hardly determine (near a singular pose) is looked at arc by arc: the
  // first such slot is named in `open_slot`, and holds only inside [arc_from, arc_to] once set.
  int open_slot = -1;
  bool arc_set = false;
  double arc_from = 0.0, arc_to = 0.0;

  void direction(Interval& c, Interval& s, Interval, int slot) {
    Interval n = root_of(squared(c) + squared(s));
    auto within_one = [](Interval x) { return Interval(x.lo > -1.0 ? x.lo : -1.0, x.hi < 1.0 ? x.hi : 1.0); };
    c = n.lo > 0.0 ? within_one(quotient(c, n)) : Interval(-1.0, 1.0);
    s = n.lo > 0.0 ? within_one(quotient(s, n)) : Interval(-1.0, 1.0);
    constexpr double WIDE = 1e-4;
    if (open_slot < 0 && !arc_set && (c.hi - c.lo > WIDE || s.hi - s.lo > WIDE)) open_slot = slot;
    if (!arc_set || slot != open_slot) return;
    // no arc crosses a multiple of pi/2 inside, so sine and cosine are monotone on it
    auto meet = [&](Interval& x, double f, double g) {
      constexpr double ROUNDING = 1e-15;
      const double low = (f < g ? f : g) - ROUNDING, high = (f < g ? g : f) + ROUNDING;
      if (low > x.lo) x.lo = low;
      if (high < x.hi) x.hi = high;
      if (x.lo > x.hi) possible = false;
    };
    meet(c, __builtin_cos(arc_from), __builtin_cos(arc_to));
    meet(s, __builtin_sin(arc_from), __builtin_sin(arc_to));
  }
  Interval cosine(Interval c) {
    if (c.lo > 1.0 || c.hi < -1.0) possible = false;
    auto clamped = [](double x) { return x > 1.0 ? 1.0 : x < -1.0 ? -1.0 : x; };
    return {clamped(c.lo), clamped(c.hi)};
  }
  void equation(Interval value, double expected) {
    if (!value.contains(expected)) possible = false;
  }
  Interval angle(Interval, Interval) { return Interval(0.0); }
};

template <class P>
struct Angle {
  P c, s;
};

// a cos t + b sin t = k: the root with the given sign; `root` is  a sin t - b cos t . a and b are of
// the order of sqrt(size2).
template <class P, class Context>
KINVERSE_INLINE Angle<P> solve_linear(Context& context, P a, P b, P k, P sign, P size2, int slot, P& root) {
  P n2 = squared(a) + squared(b);
  root = sign * context.root(n2 - squared(k), n2);
  P c = a * k - b * root, s = b * k + a * root;
  context.direction(c, s, n2 * size2, slot);
  return {c, s};
}

// Rz(first) [ (a, 0) + Rz(second) (b, 0) ] = (u, v)
template <class P, class Context>
KINVERSE_INLINE void two_link(Context& context, P u, P v, P a, P b, P sign, P size2, int slot, Angle<P>& first,
                              Angle<P>& second) {
  P r2 = squared(u) + squared(v);
  P c = quotient(r2 - squared(a) - squared(b), P(P(2.0) * a * b));
  P s = sign * context.root((P(1.0) - c) * (P(1.0) + c), P(1.0));
  c = context.cosine(c);  // out of reach: the arm stretched or folded towards the target
  P x = a + b * c, y = b * s;
  P fc = u * x + v * y, fs = v * x - u * y;
  context.direction(fc, fs, r2 * size2, slot);
  first = {fc, fs};
  second = {c, s};
}

}  // namespace kinverse::KINVERSE_ISA
