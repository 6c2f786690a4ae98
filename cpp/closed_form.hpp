// Closed forms of the families in closed_form_spec.hpp, all branches, on packs or on intervals.
//
// Each family is a start and up to three stages; a stage takes one sign (the root of one quadratic
// equation) and knows what the stages before it found. With constant signs the lanes hold poses, with
// signs in the lanes they hold the branches of one pose: the same formulas, hence the same bits.
// Equations: thesis of Jha (2015) chapter 4 as corrected in the project's errata, generalised to any
// angle between neighbouring axes; Pieper (1968) for the four ways two of the first axes simplify.
#pragma once

#include "closed_form_spec.hpp"
#include "subproblems.hpp"

namespace kinverse::KINVERSE_ISA {

template <class P>
struct Elements {
  Vec3<P> point, x, z;  // of the canonical target: origin, first and third column
};

template <class P>
KINVERSE_INLINE Vec3<P> back_z(Vec3<P> v, Angle<P> t) {
  return turn_z(v, t.c, -t.s);
}
template <class P>
KINVERSE_INLINE Vec3<P> back_x(Vec3<P> v, const ClosedFormSpec& spec, int i) {
  return turn_x(v, P(spec.cos_alpha[i]), P(-spec.sin_alpha[i]));
}
// through joint i and its link's twist, towards the tool
template <class P>
KINVERSE_INLINE Vec3<P> past_joint(Vec3<P> v, const ClosedFormSpec& spec, int i, Angle<P> t) {
  return back_x(back_z(v, t), spec, i);
}

template <class P>
KINVERSE_INLINE Elements<P> canonical_target(const ClosedFormSpec& spec, const Frame<P>& target) {
  Frame<P> t = compose(spec.base_inverse, spec.reversed ? inverse(target) : target);
  t = compose(t, spec.tool_inverse);
  return {t.p, t.x, t.z};
}

// ---- three joints that place a point ------------------------------------------------------------

template <class P>
struct Shoulder {
  Angle<P> t[3];
  P theta[3];
  Vec3<P> w;  // the point where the second stage needs it
};

// Joint 1 when axes 2 and 3 (and 4) are parallel: the point keeps the distance `along` along them.
// Leaves w in frame 1.
template <class P, class Context>
KINVERSE_INLINE void solve_shoulder(const ClosedFormSpec& spec, Context& context, Vec3<P> w, double along, P sign,
                                    Shoulder<P>& arm) {
  const double sa = spec.sin_alpha[0], ca = spec.cos_alpha[0];
  P y = P(ca / sa) * w.z - P(along / sa);
  P rho;
  arm.t[0] = solve_linear(context, w.y, -w.x, y, sign, P(spec.size * spec.size), 0, rho);
  arm.theta[0] = context.angle(arm.t[0].s, arm.t[0].c);
  arm.w = {rho - P(spec.a[0]), P(ca) * y + P(sa) * w.z, P(along)};
}

// The point (a3, -d4 sin alpha3, d3 + d4 cos alpha3): the wrist in frame 2 while joint 3 stands at 0.
struct Forearm {
  double x, y, z;
};
KINVERSE_INLINE Forearm forearm(const ClosedFormSpec& spec) {
  return {spec.a[2], -spec.d[3] * spec.sin_alpha[2], spec.d[2] + spec.d[3] * spec.cos_alpha[2]};
}

template <class P, class Context>
KINVERSE_INLINE void place_first(const ClosedFormSpec& spec, Context& context, Vec3<P> w, P sign, Shoulder<P>& arm) {
  const Forearm f = forearm(spec);
  const double f2 = f.x * f.x + f.y * f.y + f.z * f.z;
  const double a1 = spec.a[0], a2 = spec.a[1], d2 = spec.d[1];
  const double c1 = spec.cos_alpha[0], s1 = spec.sin_alpha[0], c2 = spec.cos_alpha[1], s2 = spec.sin_alpha[1];
  const P size2(spec.size * spec.size);
  P root;
  switch (spec.regional) {
    case Regional::parallel_23:
      solve_shoulder(spec, context, w, d2 + f.z, sign, arm);
      break;
    case Regional::parallel_12:
      // the height over the shoulder plane depends on joint 3 alone
      arm.t[2] = solve_linear(context, P(s2 * f.y), P(s2 * f.x), w.z - P(d2 + c2 * f.z), sign, size2, 2, root);
      break;
    case Regional::intersecting_12: {
      // so does the distance from the point where axes 1 and 2 meet
      P k = (dot(w, w) - P(a2 * a2 + f2 + d2 * d2 + 2.0 * d2 * c2 * f.z)) * P(0.5);
      arm.t[2] = solve_linear(context, P(a2 * f.x + d2 * s2 * f.y), P(d2 * s2 * f.x - a2 * f.y), k, sign,
                              P(size2 * size2), 2, root);
      break;
    }
    case Regional::intersecting_23: {
      // the distance from the point where axes 2 and 3 meet depends on joint 1 alone:
      // |w - (a1, 0, 0) - d2 (axis 2)|^2 with axis 2 = (0, -s1, c1) seen from frame 0 turned by joint 1
      P k = (dot(w, w) + P(a1 * a1 + d2 * d2 - f2) - P(2.0 * d2 * c1) * w.z) * P(0.5);
      arm.t[0] = solve_linear(context, P(a1) * w.x - P(d2 * s1) * w.y, P(a1) * w.y + P(d2 * s1) * w.x, k, sign,
                              P(size2 * size2), 0, root);
      break;
    }
  }
  if (spec.regional == Regional::parallel_12 || spec.regional == Regional::intersecting_12) {
    arm.theta[2] = context.angle(arm.t[2].s, arm.t[2].c);
    // the wrist in frame 1 while joint 2 stands at 0
    Vec3<P> v = turn_z(Vec3<P>{P(f.x), P(f.y), P(f.z)}, arm.t[2].c, arm.t[2].s);
    v = turn_x(v, P(c2), P(s2));
    arm.w = {v.x + P(a2), v.y, v.z + P(d2)};
  } else if (spec.regional == Regional::intersecting_23) {
    arm.theta[0] = context.angle(arm.t[0].s, arm.t[0].c);
    Vec3<P> v = back_z(w, arm.t[0]);
    v = back_x(Vec3<P>{v.x - P(a1), v.y, v.z}, spec, 0);
    arm.w = {v.x, v.y, v.z - P(d2)};
  }
}

// Overwrites what the other sign left, and nothing that place_first found.
template <class P, class Context>
KINVERSE_INLINE void place_second(const ClosedFormSpec& spec, Context& context, Vec3<P> w, P sign, Shoulder<P>& arm) {
  const Forearm f = forearm(spec);
  const double c1 = spec.cos_alpha[0], s1 = spec.sin_alpha[0], c2 = spec.cos_alpha[1], s2 = spec.sin_alpha[1];
  const P size2(spec.size * spec.size);
  switch (spec.regional) {
    case Regional::parallel_23: {
      double reach = __builtin_sqrt(f.x * f.x + f.y * f.y);
      Angle<P> elbow;
      two_link(context, arm.w.x, arm.w.y, P(spec.a[1]), P(reach), sign, size2, 1, arm.t[1], elbow);
      // from the line elbow-wrist back to x of frame 3
      P cp(f.x / reach), sp(f.y / reach);
      arm.t[2] = {elbow.c * cp + elbow.s * sp, elbow.s * cp - elbow.c * sp};
      arm.theta[1] = context.angle(arm.t[1].s, arm.t[1].c);
      arm.theta[2] = context.angle(arm.t[2].s, arm.t[2].c);
      break;
    }
    case Regional::parallel_12: {
      P reach2 = squared(arm.w.x) + squared(arm.w.y);
      P reach = context.root(reach2, size2);
      Angle<P> elbow;
      two_link(context, w.x, w.y, P(spec.a[0]), reach, sign, size2, 0, arm.t[0], elbow);
      P ec = elbow.c * arm.w.x + elbow.s * arm.w.y, es = elbow.s * arm.w.x - elbow.c * arm.w.y;
      context.direction(ec, es, size2, 1);
      arm.t[1] = {ec, es};
      arm.theta[0] = context.angle(arm.t[0].s, arm.t[0].c);
      arm.theta[1] = context.angle(arm.t[1].s, arm.t[1].c);
      break;
    }
    case Regional::intersecting_12: {
      // height: s1 g_y + c1 g_z = w_z, where g = Rz(theta2) arm.w is the wrist in frame 1
      P gy = (w.z - P(c1) * arm.w.z) * P(1.0 / s1);
      P gx;
      arm.t[1] = solve_linear(context, arm.w.y, arm.w.x, gy, sign, size2, 1, gx);
      // solve_linear's root is  a sin t - b cos t = -g_x
      P x = -gx, y = P(c1) * gy - P(s1) * arm.w.z;
      P fc = w.x * x + w.y * y, fs = w.y * x - w.x * y;
      context.direction(fc, fs, size2 * (squared(x) + squared(y)), 0);
      arm.t[0] = {fc, fs};
      arm.theta[0] = context.angle(arm.t[0].s, arm.t[0].c);
      arm.theta[1] = context.angle(arm.t[1].s, arm.t[1].c);
      break;
    }
    case Regional::intersecting_23: {
      // height along axis 2: s2 h_y + c2 h_z = w_z, where h = Rz(theta3) forearm
      P hy = (arm.w.z - P(c2 * f.z)) * P(1.0 / s2);
      P hx;
      arm.t[2] = solve_linear(context, P(f.y), P(f.x), hy, sign, size2, 2, hx);
      P x = -hx, y = P(c2) * hy - P(s2 * f.z);
      P fc = arm.w.x * x + arm.w.y * y, fs = arm.w.y * x - arm.w.x * y;
      context.direction(fc, fs, size2 * (squared(x) + squared(y)), 1);
      arm.t[1] = {fc, fs};
      arm.theta[1] = context.angle(arm.t[1].s, arm.t[1].c);
      arm.theta[2] = context.angle(arm.t[2].s, arm.t[2].c);
      break;
    }
  }
}

// ---- three joints that turn a hand --------------------------------------------------------------

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

// ---- the families -------------------------------------------------------------------------------

// Each stage overwrites what it left for the other sign, and nothing that an earlier stage found.
template <class P>
struct State {
  Shoulder<P> arm;
  Wrist<P> wrist;
  Vec3<P> x, z;
  P theta[6];
};

struct SphericalWristModel {
  static constexpr int stages = 3;
  template <class P, class Context>
  static KINVERSE_INLINE void first(const ClosedFormSpec& spec, Context& context, const Elements<P>& e, P sign,
                                    State<P>& s) {
    place_first(spec, context, e.point, sign, s.arm);
  }
  template <class P, class Context>
  static KINVERSE_INLINE void second(const ClosedFormSpec& spec, Context& context, const Elements<P>& e, P sign,
                                     State<P>& s) {
    place_second(spec, context, e.point, sign, s.arm);
    s.x = e.x;
    s.z = e.z;
    for (int i = 0; i < 3; ++i) {
      s.x = past_joint(s.x, spec, i, s.arm.t[i]);
      s.z = past_joint(s.z, spec, i, s.arm.t[i]);
      s.theta[i] = s.arm.theta[i];
    }
  }
  template <class P, class Context>
  static KINVERSE_INLINE void third(const ClosedFormSpec& spec, Context& context, P sign, State<P>& s) {
    s.wrist = solve_wrist(spec, context, 3, s.x, s.z, sign);
    for (int i = 0; i < 3; ++i) s.theta[3 + i] = s.wrist.theta[i];
  }
};

struct TwoAxisWristModel {
  static constexpr int stages = 2;
  template <class P, class Context>
  static KINVERSE_INLINE void first(const ClosedFormSpec& spec, Context& context, const Elements<P>& e, P sign,
                                    State<P>& s) {
    place_first(spec, context, e.point, sign, s.arm);
  }
  template <class P, class Context>
  static KINVERSE_INLINE void second(const ClosedFormSpec& spec, Context& context, const Elements<P>& e, P sign,
                                     State<P>& s) {
    SphericalWristModel::second(spec, context, e, sign, s);
    s.wrist = solve_short_wrist(spec, context, 3, s.x, s.z);
    s.theta[3] = s.wrist.theta[0];
    s.theta[4] = s.wrist.theta[1];
  }
};

// Joint 1 from the point on axes 5 and 6, then the columns seen from frame 1.
template <class P, class Context>
KINVERSE_INLINE void parallel_first(const ClosedFormSpec& spec, Context& context, const Elements<P>& e, P sign,
                                    double along, State<P>& s) {
  solve_shoulder(spec, context, e.point, along, sign, s.arm);
  s.x = past_joint(e.x, spec, 0, s.arm.t[0]);
  s.z = past_joint(e.z, spec, 0, s.arm.t[0]);
  s.theta[0] = s.arm.theta[0];
}

// Joints 2, 3, 4 from the sum of their angles (in s.wrist) and the point (a4, -d5 sin alpha4) on axis 5.
template <class P, class Context>
KINVERSE_INLINE void parallel_elbow(const ClosedFormSpec& spec, Context& context, P sign, double d5, State<P>& s) {
  P a4(spec.a[3]), y(d5 * spec.sin_alpha[3]);
  P c = s.wrist.first.c, n = s.wrist.first.s;
  P u = s.arm.w.x - (c * a4 + n * y), v = s.arm.w.y - (n * a4 - c * y);
  Angle<P> t2, t3;
  two_link(context, u, v, P(spec.a[1]), P(spec.a[2]), sign, P(spec.size * spec.size), 1, t2, t3);
  s.theta[1] = context.angle(t2.s, t2.c);
  s.theta[2] = context.angle(t3.s, t3.c);
  s.theta[3] = s.wrist.theta[0] - s.theta[1] - s.theta[2];
}

struct ThreeParallelModel {
  static constexpr int stages = 3;
  template <class P, class Context>
  static KINVERSE_INLINE void first(const ClosedFormSpec& spec, Context& context, const Elements<P>& e, P sign,
                                    State<P>& s) {
    parallel_first(spec, context, e, sign, spec.d[1] + spec.d[2] + spec.d[3] + spec.d[4] * spec.cos_alpha[3], s);
  }
  // the sign of the wrist comes before that of the elbow
  template <class P, class Context>
  static KINVERSE_INLINE void second(const ClosedFormSpec& spec, Context& context, const Elements<P>&, P sign,
                                     State<P>& s) {
    s.wrist = solve_wrist(spec, context, 3, s.x, s.z, sign);
    s.theta[4] = s.wrist.theta[1];
    s.theta[5] = s.wrist.theta[2];
  }
  template <class P, class Context>
  static KINVERSE_INLINE void third(const ClosedFormSpec& spec, Context& context, P sign, State<P>& s) {
    parallel_elbow(spec, context, sign, spec.d[4], s);
  }
};

struct ThreeParallelShortModel {
  static constexpr int stages = 2;
  template <class P, class Context>
  static KINVERSE_INLINE void first(const ClosedFormSpec& spec, Context& context, const Elements<P>& e, P sign,
                                    State<P>& s) {
    parallel_first(spec, context, e, sign, spec.d[1] + spec.d[2] + spec.d[3], s);
  }
  template <class P, class Context>
  static KINVERSE_INLINE void second(const ClosedFormSpec& spec, Context& context, const Elements<P>&, P sign,
                                     State<P>& s) {
    s.wrist = solve_short_wrist(spec, context, 3, s.x, s.z);
    s.theta[4] = s.wrist.theta[1];
    parallel_elbow(spec, context, sign, 0.0, s);
  }
};

struct ScaraModel {
  static constexpr int stages = 1;
  template <class P, class Context>
  static KINVERSE_INLINE void first(const ClosedFormSpec& spec, Context& context, const Elements<P>& e, P sign,
                                    State<P>& s) {
    context.equation(e.z.z, 1.0);
    if (spec.dof == 3) context.equation(e.point.z, 0.0);
    Angle<P> t1, t2;
    two_link(context, e.point.x, e.point.y, P(spec.a[0]), P(spec.a[1]), sign, P(spec.size * spec.size), 0, t1, t2);
    s.theta[0] = context.angle(t1.s, t1.c);
    s.theta[1] = context.angle(t2.s, t2.c);
    s.theta[2] = context.angle(e.x.y, e.x.x) - s.theta[0] - s.theta[1];
    s.theta[3] = e.point.z;
  }
};

// What a stage's sign means, as a bit of the branch number: shoulder 4, elbow 2, wrist 1.
template <class Model>
constexpr int branch_number(int first, int second, int third) {
  if constexpr (Model::stages == 1) return first;
  if constexpr (Model::stages == 2) return 2 * first + second;
  if constexpr (__is_same(Model, ThreeParallelModel)) return 4 * first + 2 * third + second;
  return 4 * first + 2 * second + third;
}

// Every branch for the poses in the lanes (or for one interval of poses): visit(number, theta).
template <class Model, class P, class Context, class Visit>
KINVERSE_INLINE void visit_branches(const ClosedFormSpec& spec, Context& context, const Frame<P>& target, Visit visit) {
  const Elements<P> e = canonical_target(spec, target);
  const double signs[2] = {1.0, -1.0};
  State<P> s;
  for (int i = 0; i < 2; ++i) {
    Model::first(spec, context, e, P(signs[i]), s);
    if constexpr (Model::stages == 1) {
      visit(branch_number<Model>(i, 0, 0), s.theta);
    } else {
      for (int j = 0; j < 2; ++j) {
        Model::second(spec, context, e, P(signs[j]), s);
        if constexpr (Model::stages == 2) {
          visit(branch_number<Model>(i, j, 0), s.theta);
        } else {
          for (int k = 0; k < 2; ++k) {
            Model::third(spec, context, P(signs[k]), s);
            visit(branch_number<Model>(i, j, k), s.theta);
          }
        }
      }
    }
  }
}

// signs[stage][number]
template <class Model>
struct SignTable {
  double signs[3][MAX_BRANCHES] = {};
  constexpr SignTable() {
    for (int i = 0; i < 2; ++i)
      for (int j = 0; j < 2; ++j)
        for (int k = 0; k < 2; ++k) {
          int number = branch_number<Model>(i, j, k);
          signs[0][number] = i ? -1.0 : 1.0;
          signs[1][number] = j ? -1.0 : 1.0;
          signs[2][number] = k ? -1.0 : 1.0;
        }
  }
};

// The branches from first_number on, one a lane, of the one pose that all lanes hold.
template <class Model, int W>
KINVERSE_INLINE void numbered_branches(const ClosedFormSpec& spec, LaneContext<W>& context,
                                       const Frame<Pack<W>>& target, int first_number, Pack<W>* theta) {
  static constexpr SignTable<Model> table;
  auto sign = [&](int stage) { return load<W>(table.signs[stage] + first_number); };
  const Elements<Pack<W>> e = canonical_target(spec, target);
  State<Pack<W>> s;
  Model::first(spec, context, e, sign(0), s);
  if constexpr (Model::stages >= 2) Model::second(spec, context, e, sign(1), s);
  if constexpr (Model::stages >= 3) Model::third(spec, context, sign(2), s);
  for (int i = 0; i < spec.dof; ++i) theta[i] = s.theta[i];
}

template <class Call>
KINVERSE_INLINE void with_model(Family family, Call call) {
  switch (family) {
    case Family::spherical_wrist: return call(SphericalWristModel{});
    case Family::three_parallel: return call(ThreeParallelModel{});
    case Family::two_axis_wrist: return call(TwoAxisWristModel{});
    case Family::three_parallel_short: return call(ThreeParallelShortModel{});
    case Family::scara: return call(ScaraModel{});
  }
}

}  // namespace kinverse::KINVERSE_ISA
