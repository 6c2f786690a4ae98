// Wrists: two or three joints that turn a hand, on axes that meet in one point.
#pragma once

#include "closed_form_spec.hpp"
#include "subproblems.hpp"

namespace kinverse::KINVERSE_ISA {

template <class P>
struct Wrist {
  Angle<P> first;
  P theta[3];
};

// cos and sin of the middle angle of  Rz Rx(alpha) Rz(middle) Rx(beta) Rz  whose third column has the
// height z and the distance `across` from the z axis. The half-angle form keeps full precision where
// the arc cosine would lose half of it.
template <int W>
KINVERSE_INLINE Angle<Pack<W>> inclined_middle(LaneContext<W>& context, const ClosedFormSpec& spec, int i,
                                               Pack<W> across, Pack<W> z, Pack<W> sign) {
  using P = Pack<W>;
  const double a = spec.alpha[i], b = spec.alpha[i + 1], product = spec.sin_alpha[i] * spec.sin_alpha[i + 1];
  P polar = atan2(across, z);
  auto sine_of_half = [&](P x) {
    P s, c;
    sincos(P(P(0.5) * x), s, c);
    return s;
  };
  const double orientation = product < 0 ? -2.0 : 2.0;
  P n = P(orientation) * (sine_of_half(P(a + b) - polar) * sine_of_half(P(a + b) + polar));
  P m = P(orientation) * (sine_of_half(polar - P(a - b)) * sine_of_half(polar + P(a - b)));
  const double inverse = 0.5 / (product < 0 ? -product : product);
  P s = sign * context.root(P(n * m), P(product * product)) * P(2.0 * inverse);
  P c = context.cosine((m - n) * P(inverse));
  return {c, s};
}
inline Angle<Interval> inclined_middle(IntervalContext& context, const ClosedFormSpec& spec, int i, Interval, Interval z,
                                       Interval sign) {
  const double product = spec.sin_alpha[i] * spec.sin_alpha[i + 1];
  Interval c = context.cosine((Interval(spec.cos_alpha[i] * spec.cos_alpha[i + 1]) - z) * Interval(1.0 / product));
  return {c, sign * root_of(Interval(1.0) - squared(c))};
}

template <int W>
KINVERSE_INLINE Pack<W> half_turn_if_negative(Pack<W> sign) {
  return select(sign < Pack<W>(0.0), Pack<W>(PI), Pack<W>(0.0));
}
inline Interval half_turn_if_negative(Interval) { return Interval(0.0); }

// x and z columns of  Rz(t0) Rx(alpha_i) Rz(t1) Rx(alpha_i+1) Rz(t2)  ->  the three angles. The last
// one is what remains after the first two as found, so that rounding near the singular pose (where
// only t0 + t2 or t0 - t2 is determined) does not show in the result.
template <class P, class Context>
KINVERSE_INLINE Wrist<P> solve_wrist(const ClosedFormSpec& spec, Context& context, int i, Vec3<P> x, Vec3<P> z, P sign,
                                     bool perpendicular, int slot) {
  const double sb = spec.sin_alpha[i + 1], ca = spec.cos_alpha[i], sa = spec.sin_alpha[i];
  const P across2 = squared(z.x) + squared(z.y);
  const P across = context.root(across2, P(0.0));
  Angle<P> middle;
  P flip(1.0);
  if (perpendicular) {
    // the second root is the first one turned by half a turn: computed once, flipped at the end
    middle = {z.z * P(-1.0 / (sa * sb)), across};
    flip = sign;
  } else {
    middle = inclined_middle(context, spec, i, across, z.z, sign);
  }
  // third column as seen from behind the first joint
  P ix = P(sb) * middle.s, iy = P(-ca * sb) * middle.c - P(sa * spec.cos_alpha[i + 1]);
  P c = z.x * ix + z.y * iy, s = z.y * ix - z.x * iy;
  context.direction(c, s, across2, slot);
  Vec3<P> rest = turn_x(turn_z(x, c, -s), P(ca), P(-sa));
  rest = turn_x(turn_z(rest, middle.c, -middle.s), P(spec.cos_alpha[i + 1]), P(-sb));
  P half_turn = half_turn_if_negative(flip);
  return {{flip * c, flip * s},
          {context.angle(s, c) + half_turn, flip * context.angle(middle.s, middle.c),
           context.angle(rest.y, rest.x) + half_turn}};
}

template <class P, class Context>
KINVERSE_INLINE Wrist<P> solve_wrist(const ClosedFormSpec& spec, Context& context, int i, Vec3<P> x, Vec3<P> z, P sign) {
  return solve_wrist(spec, context, i, x, z, sign, spec.perpendicular_wrist, 3);
}

// Two joints that turn a hand: z column from the first, x column from the second.
template <class P, class Context>
KINVERSE_INLINE Wrist<P> solve_short_wrist(const ClosedFormSpec& spec, Context& context, int i, Vec3<P> x, Vec3<P> z) {
  const double ca = spec.cos_alpha[i], sa = spec.sin_alpha[i];
  context.equation(z.z, ca);
  const double orientation = sa < 0 ? -1.0 : 1.0;
  P c = P(-orientation) * z.y, s = P(orientation) * z.x;
  context.direction(c, s, P(1.0), 3);
  Vec3<P> rest = turn_x(turn_z(x, c, -s), P(ca), P(-sa));
  return {{c, s}, {context.angle(s, c), context.angle(rest.y, rest.x), P(0.0)}};
}

}  // namespace kinverse::KINVERSE_ISA
