// Closed forms of the families in closed_form_spec.hpp, all branches, on packs or on intervals.
//
// Each family is a start and up to three stages; a stage takes one sign (the root of one quadratic
// equation) and knows what the stages before it found. With constant signs the lanes hold poses, with
// signs in the lanes they hold the branches of one pose: the same formulas, hence the same bits.
// Equations: thesis of Jha (2015) chapter 4 as corrected in the project's errata, generalised to any
// angle between neighbouring axes; Pieper (1968) for the four ways two of the first axes simplify.
#pragma once

#include "regional.hpp"
#include "wrist.hpp"

namespace kinverse::KINVERSE_ISA {

template <class P>
struct Elements {
  Vec3<P> point, x, z;  // of the canonical target: origin, first and third column
};

template <class P>
KINVERSE_INLINE Elements<P> canonical_target(const ClosedFormSpec& spec, const Frame<P>& target) {
  Frame<P> t = compose(spec.base_inverse, spec.reversed ? inverse(target) : target);
  t = compose(t, spec.tool_inverse);
  return {t.p, t.x, t.z};
}

// Each stage overwrites what it left for the other sign, and nothing that an earlier stage found.
template <class P>
struct State {
  Shoulder<P> arm;
  Wrist<P> wrist;
  Vec3<P> x, z;
  P theta[6];
};

// Three joints place the wrist; the hand is seen from behind them.
struct PlacedWrist {
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
};

struct SphericalWristModel : PlacedWrist {
  static constexpr int stages = 3;
  template <class P, class Context>
  static KINVERSE_INLINE void third(const ClosedFormSpec& spec, Context& context, P sign, State<P>& s) {
    s.wrist = solve_wrist(spec, context, 3, s.x, s.z, sign);
    for (int i = 0; i < 3; ++i) s.theta[3 + i] = s.wrist.theta[i];
  }
};

struct TwoAxisWristModel : PlacedWrist {
  static constexpr int stages = 2;
  template <class P, class Context>
  static KINVERSE_INLINE void second(const ClosedFormSpec& spec, Context& context, const Elements<P>& e, P sign,
                                     State<P>& s) {
    PlacedWrist::second(spec, context, e, sign, s);
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
