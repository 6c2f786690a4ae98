// Seven joints at given values of the free parameter: every branch, verified, with its distance to
// the limits. Compiled once per instruction set.
//
// The arm angle after Shimizu, Kakuya, Yoon, Kitagaki and Kosuge, "Analytical inverse kinematic
// computation for 7-DOF redundant manipulators with joint limits" (IEEE Trans. Robotics 24(5), 2008),
// generalised to any angle between neighbouring axes and any elbow.
#include "candidate.hpp"
#include "closed_form.hpp"
#include "kernels.hpp"

namespace kinverse::KINVERSE_ISA {
namespace {

constexpr int DOF = 7;
// What a branch that misses the pose has for a margin: this, less its error.
constexpr double MISSED = -10.0;

// ---- an end joint held --------------------------------------------------------------------------

// What the other six joints have to reach.
template <class P>
KINVERSE_INLINE Frame<P> remaining_target(const RedundantSpec& spec, const Frame<P>& target, P c, P s) {
  if (spec.parameter == FreeParameter::last_joint) {
    Frame<P> f = compose(target, spec.behind_inverse);
    f = {scaled(c, f.x) - scaled(s, f.y), scaled(s, f.x) + scaled(c, f.y), f.z, f.p};
    return compose(f, spec.before_inverse);
  }
  Frame<P> f = compose(spec.before_inverse, target);
  f = {turn_z(f.x, c, -s), turn_z(f.y, c, -s), turn_z(f.z, c, -s), turn_z(f.p, c, -s)};
  return compose(spec.behind_inverse, f);
}

// ---- the arm angle ------------------------------------------------------------------------------

// visit(branch, theta) for shoulder and hand solved apart: the elbow depends on the distance from
// shoulder to wrist alone, the shoulder then turns the arm to the wrist and round by the angle.
template <int W, class Visit>
KINVERSE_INLINE void visit_arm_angle(const RedundantSpec& redundant, LaneContext<W>& context,
                                     const Frame<Pack<W>>& target, Pack<W> cos_angle, Pack<W> sin_angle,
                                     Mask<W>& stretched, Visit visit) {
  using P = Pack<W>;
  using V = Vec3<P>;
  const ClosedFormSpec& spec = redundant.form;
  const Elements<P> e = canonical_target(spec, target);
  const P tiny(1e-14 * spec.size);
  // the plane of axis 1 and the line from shoulder to wrist: x towards axis 1, z along the line
  const P across = sqrt(squared(e.point.x) + squared(e.point.y)), distance = length(e.point);
  const Mask<W> on_axis = !(across > tiny), no_line = !(distance > tiny);
  const P cx = select(on_axis, P(1.0), e.point.x / across), sx = select(on_axis, P(0.0), e.point.y / across);
  const P h = select(no_line, P(0.0), across / distance), nz = select(no_line, P(1.0), e.point.z / distance);
  const V line{h * cx, h * sx, nz}, up{-nz * cx, -nz * sx, h}, level{sx, -cx, P(0.0)};
  const V bx = scaled(cos_angle, up) + scaled(sin_angle, level), by = scaled(cos_angle, level) - scaled(sin_angle, up);

  const double sa = spec.sin_alpha[3], ca = spec.cos_alpha[3], s2 = spec.sin_alpha[2], c2 = spec.cos_alpha[2];
  const double fx = spec.a[3], fy = -spec.d[4] * sa, fz = spec.d[3] + spec.d[4] * ca;
  const double gx = spec.a[2], gy = spec.d[2] * s2, gz = spec.d[2] * c2;
  const double fixed = gx * gx + gy * gy + gz * gz + fx * fx + fy * fy + fz * fz + 2.0 * gz * fz;
  const P size2(spec.size * spec.size);
  for (int j = 0; j < 2; ++j) {
    const P sign(j ? -1.0 : 1.0);
    P root;
    const Mask<W> near_before = context.near;
    context.near = Mask<W>::all(false);
    Angle<P> elbow = solve_linear(context, P(gx * fx + gy * fy), P(gy * fx - gx * fy),
                                  P((dot(e.point, e.point) - P(fixed)) * P(0.5)), sign, P(size2 * size2), 2, root);
    stretched = stretched | context.near;
    context.near = context.near | near_before;
    // the wrist and axis 4 as the shoulder's last joint sees them
    V v = turn_z(V{P(fx), P(fy), P(fz)}, elbow.c, elbow.s);
    v = turn_x(v, P(c2), P(s2));
    v = {v.x + P(spec.a[2]), v.y, v.z + P(spec.d[2])};
    const P reach = length(v);
    const Mask<W> folded = !(reach > tiny);
    const V az = {select(folded, P(0.0), v.x / reach), select(folded, P(0.0), v.y / reach),
                  select(folded, P(1.0), v.z / reach)};
    const V axis{P(0.0), P(-s2), P(c2)};
    V ay = axis - scaled(dot(axis, az), az);
    const P side = sign * P(redundant.elbow_side) / length(ay);
    ay = scaled(side, ay);
    const V ax = cross(ay, az);
    // columns x and z of the shoulder's rotation
    const V x = scaled(ax.x, bx) + scaled(ay.x, by) + scaled(az.x, line);
    const V z = scaled(ax.z, bx) + scaled(ay.z, by) + scaled(az.z, line);
    // the target's columns as the hand sees them
    auto in_hand = [&](V t) {
      const P u = dot(bx, t), w = dot(by, t), l = dot(line, t);
      V r = scaled(u, ax) + scaled(w, ay) + scaled(l, az);
      return past_joint(back_x(r, spec, 2), spec, 3, elbow);
    };
    const V hand_x = in_hand(e.x), hand_z = in_hand(e.z);
    const P theta4 = atan2(elbow.s, elbow.c);
    Wrist<P> shoulder[2], hand[2];
    for (int i = 0; i < 2; ++i) {
      const P s(i ? -1.0 : 1.0);
      shoulder[i] = solve_wrist(spec, context, 0, x, z, s, redundant.perpendicular_shoulder, 0);
      hand[i] = solve_wrist(spec, context, 4, hand_x, hand_z, s, spec.perpendicular_wrist, 3);
    }
    for (int i = 0; i < 2; ++i)
      for (int k = 0; k < 2; ++k) {
        const P theta[DOF] = {shoulder[i].theta[0], shoulder[i].theta[1], shoulder[i].theta[2], theta4,
                              hand[k].theta[0],     hand[k].theta[1],     hand[k].theta[2]};
        visit(4 * i + 2 * j + k, theta);
      }
  }
}

// ---- both ---------------------------------------------------------------------------------------

// How far inside its limits the worst joint is, in the winding that suits it best.
template <int W>
KINVERSE_INLINE Pack<W> limit_margin(const Chain& chain, const Pack<W>* q, int without) {
  using P = Pack<W>;
  P least(1e3);
  for (int j = 0; j < DOF; ++j) {
    if (j == without) continue;
    P d = q[j] - P(0.5 * (chain.lower[j] + chain.upper[j]));
    d = d - round<W>(d * P(1.0 / TWO_PI)) * P(TWO_PI);
    least = min(least, P(0.5 * (chain.upper[j] - chain.lower[j])) - abs(d));
  }
  return least;
}

template <class VisitAll>
KINVERSE_INLINE void solve_lanes(const Chain& chain, const RedundantSpec& spec, const Tolerances& tolerances,
                                 const double* const* T, const double* parameter, const double* const* reference_rows,
                                 const FreeDirections* free, RedundantBlock& block, VisitAll visit_all) {
  constexpr int W = LANES;
  using P = Pack<W>;
  LaneContext<W> context;
  context.take(free);
  const Frame<P> target = gather_frames<W>(T);
  const P held = load<W>(parameter);
  const int locked = spec.parameter == FreeParameter::arm_angle ? -1 : spec.parameter == FreeParameter::first_joint ? 0 : DOF - 1;
  P reference[DOF];
  gather_rows<W>(reference_rows, DOF, reference);
  Mask<W> stretched = Mask<W>::all(false);
  P theta[MAX_BRANCHES][DOF];
  visit_all(context, target, held, stretched, theta);
  for (int b = 0; b < MAX_BRANCHES; ++b) {
    P q[DOF];
    for (int i = 0; i < spec.form.dof; ++i) {
      const int j = spec.form.joint[i];
      q[j] = P(spec.form.sign[i]) * (theta[b][i] - P(spec.form.offset[i]));
    }
    if (locked >= 0) q[locked] = held;
    for (int j = 0; j < DOF; ++j)
      q[j] = wind(q[j], reference[j], P(chain.lower[j]), P(chain.upper[j]), tolerances.hold_limits);
    Checked<W> checked = check(chain, Task::pose, target, q, tolerances.position, tolerances.rotation);
    store_checked(checked, q, DOF, block.value[b], 0);
    const Mask<W> exact = checked.within(tolerances.exact_position, tolerances.exact_rotation);
    const P error = checked.position_error + checked.rotation_error;
    const P missed = P(MISSED) - select(error < P(1e3), error, P(1e3));
    store(block.margin[b], select(exact, limit_margin<W>(chain, q, locked), missed));
    block.exact[b] = lane_bits(exact);
    block.verified[b] = lane_bits(checked.verified);
    block.inside[b] = lane_bits(checked.inside);
  }
  block.near = lane_bits(context.near);
  block.stretched = lane_bits(stretched);
  block.singular = block.singular_slots = 0;
  for (int slot = 0; slot < FREE_SLOTS; ++slot) {
    const unsigned free = lane_bits(context.free_slot[slot]);
    block.singular |= free;
    if (free) block.singular_slots |= 1u << slot;
  }
}

template <class Model>
void end_joint_held(const Chain& chain, const RedundantSpec& spec, const Tolerances& tolerances, const double* const* T,
                    const double* parameter, const double* const* reference, const FreeDirections* free,
                    RedundantBlock& block) {
  using P = Pack<LANES>;
  solve_lanes(chain, spec, tolerances, T, parameter, reference, free, block,
              [&](auto& context, const Frame<P>& target, P held, auto&, P (*theta)[DOF]) {
                P c, s;
                sincos(held, s, c);
                visit_branches<Model>(spec.form, context, remaining_target(spec, target, c, s),
                                      [&](int number, const P* t) {
                                        for (int i = 0; i < 6; ++i) theta[number][i] = t[i];
                                      });
              });
}

void arm_angle_held(const Chain& chain, const RedundantSpec& spec, const Tolerances& tolerances, const double* const* T,
                    const double* parameter, const double* const* reference, const FreeDirections* free,
                    RedundantBlock& block) {
  using P = Pack<LANES>;
  solve_lanes(chain, spec, tolerances, T, parameter, reference, free, block,
              [&](auto& context, const Frame<P>& target, P held, auto& stretched, P (*theta)[DOF]) {
                P c, s;
                sincos(held, s, c);
                visit_arm_angle<LANES>(spec, context, target, c, s, stretched, [&](int number, const P* t) {
                  for (int i = 0; i < DOF; ++i) theta[number][i] = t[i];
                });
              });
}

// ---- out of reach -------------------------------------------------------------------------------

// cosine over [middle - half, middle + half], by its slope
Interval cosine_near(double middle, double half) {
  const double c = __builtin_cos(middle);
  return {c - half > -1.0 ? c - half : -1.0, c + half < 1.0 ? c + half : 1.0};
}

template <class Model>
bool end_joint_possible(const RedundantSpec& spec, const Frame<Interval>& target, double middle, double half) {
  const Interval c = cosine_near(middle, half), s = cosine_near(middle - HALF_PI, half);
  const Elements<Interval> e = canonical_target(spec.form, remaining_target(spec, target, c, s));
  for (int number = 0; number < 8; ++number) {
    IntervalContext context;
    State<Interval> state;
    auto sign = [&](int bit) { return Interval(number >> bit & 1 ? -1.0 : 1.0); };
    Model::first(spec.form, context, e, sign(2), state);
    if (!context.possible) continue;
    Model::second(spec.form, context, e, sign(1), state);
    if (!context.possible) continue;
    Model::third(spec.form, context, sign(0), state);
    if (context.possible) return true;
  }
  return false;
}

// The parameter's circle in ever smaller pieces, each shown to be impossible, within a budget.
template <class Possible>
bool impossible_everywhere(Possible possible) {
  constexpr int DEEPEST = 12;
  int budget = 600;
  struct Piece {
    double middle, half;
    int depth;
  } stack[4 * DEEPEST];
  int top = 0;
  stack[top++] = {0.0, PI + 1e-9, 0};
  while (top) {
    const Piece piece = stack[--top];
    if (piece.depth >= 3 && !possible(piece.middle, piece.half)) continue;
    if (piece.depth == DEEPEST || --budget < 0) return false;
    const double half = 0.5 * piece.half;
    stack[top++] = {piece.middle - half, half + 1e-12, piece.depth + 1};
    stack[top++] = {piece.middle + half, half + 1e-12, piece.depth + 1};
  }
  return true;
}

bool elbow_possible(const ClosedFormSpec& spec, const Frame<Interval>& target) {
  const Elements<Interval> e = canonical_target(spec, target);
  const double sa = spec.sin_alpha[3], ca = spec.cos_alpha[3], s2 = spec.sin_alpha[2], c2 = spec.cos_alpha[2];
  const double fx = spec.a[3], fy = -spec.d[4] * sa, fz = spec.d[3] + spec.d[4] * ca;
  const double gx = spec.a[2], gy = spec.d[2] * s2, gz = spec.d[2] * c2;
  const double fixed = gx * gx + gy * gy + gz * gz + fx * fx + fy * fy + fz * fz + 2.0 * gz * fz;
  const double bend = (gx * fx + gy * fy) * (gx * fx + gy * fy) + (gy * fx - gx * fy) * (gy * fx - gx * fy);
  // squares, not products of an interval with itself: those would count the sign of each factor apart
  const Interval distance2 = squared(e.point.x) + squared(e.point.y) + squared(e.point.z);
  const Interval k = (distance2 - Interval(fixed)) * Interval(0.5);
  return squared(k).lo <= bend * (1.0 + 1e-12);
}

}  // namespace

void redundant_lanes(const Chain& chain, const RedundantSpec& spec, const Tolerances& tolerances, const double* const* T,
                     const double* parameter, const double* const* reference, const FreeDirections* free,
                     RedundantBlock& block) {
  auto solve = spec.parameter == FreeParameter::arm_angle         ? arm_angle_held
               : spec.form.family == Family::three_parallel       ? end_joint_held<ThreeParallelModel>
                                                                  : end_joint_held<SphericalWristModel>;
  solve(chain, spec, tolerances, T, parameter, reference, free, block);
}

bool redundant_unreachable(const RedundantSpec& spec, const Tolerances& tolerances, const double* T) {
  // the equations are those of an arm that may differ from the chain by what counts as exact
  const Frame<Interval> target = poses_near(T, tolerances.position + tolerances.exact_position,
                                            tolerances.rotation + tolerances.exact_rotation);
  if (spec.parameter == FreeParameter::arm_angle) return !elbow_possible(spec.form, target);
  if (spec.form.family == Family::three_parallel)
    return impossible_everywhere([&](double middle, double half) {
      return end_joint_possible<ThreeParallelModel>(spec, target, middle, half);
    });
  return impossible_everywhere([&](double middle, double half) {
    return end_joint_possible<SphericalWristModel>(spec, target, middle, half);
  });
}

}  // namespace kinverse::KINVERSE_ISA
