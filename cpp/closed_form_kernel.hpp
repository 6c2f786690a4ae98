// Closed forms for packs of poses, for one pose, and the proof that a pose is out of reach.
#pragma once

#include "candidate.hpp"
#include "closed_form.hpp"
#include "kernels.hpp"

namespace kinverse::KINVERSE_ISA {

template <int W>
struct StoredBranch {
  unsigned exact, verified, inside;
};

// theta of one branch -> joint values with their errors, stored from lane first_lane on
template <int W, class Reach>
KINVERSE_INLINE StoredBranch<W> store_branch(const Chain& chain, const ClosedFormSpec& spec, const Tolerances& tolerances,
                                        const Frame<Pack<W>>& target, const Pack<W>* theta, const Pack<W>* reference,
                                        double (*value)[WIDEST], int first_lane, Reach& reach) {
  using P = Pack<W>;
  P q[6];
  for (int i = 0; i < spec.dof; ++i) {
    int j = spec.joint[i];
    P v = P(spec.sign[i]) * (theta[i] - P(spec.offset[i]));
    q[j] = chain.prismatic[j] ? v : wind(v, reference[j], P(chain.lower[j]), P(chain.upper[j]), tolerances.hold_limits);
  }
  Checked<W> checked = check(chain, Task::pose, target, q, tolerances.position, tolerances.rotation,
                             [&](const P* at) { return reach(at); });
  store_checked(checked, q, spec.dof, value, first_lane);
  const Mask<W> exact = checked.within(tolerances.exact_position, tolerances.exact_rotation);
  return {lane_bits(exact), lane_bits(checked.verified), lane_bits(checked.inside)};
}

template <class Model>
void solve_poses(const Chain& chain, const ClosedFormSpec& spec, const Tolerances& tolerances, const double* const* T,
                 const double* const* reference_rows, const FreeDirections* free, BranchBlock& block) {
  constexpr int W = LANES;
  using P = Pack<W>;
  LaneContext<W> context;
  context.take(free);
  const Frame<P> target = gather_frames<W>(T);
  P reference[6];
  gather_rows<W>(reference_rows, spec.dof, reference);
  P theta[MAX_BRANCHES][6];
  visit_branches<Model>(spec, context, target, [&](int number, const P* t) {
    for (int i = 0; i < spec.dof; ++i) theta[number][i] = t[i];
  });
  SharedForward<W, 6> reach{chain};
  for (int b = 0; b < spec.branches; ++b) {
    const auto stored = store_branch<W>(chain, spec, tolerances, target, theta[b], reference, block.value[b], 0, reach);
    block.exact[b] = stored.exact;
    block.verified[b] = stored.verified;
    block.inside[b] = stored.inside;
  }
  block.near = lane_bits(context.near);
  block.weak = lane_bits(context.weak);
  for (int slot = 0; slot < FREE_SLOTS; ++slot) block.free_slot[slot] = lane_bits(context.free_slot[slot]);
}

template <class Model>
void solve_pose(const Chain& chain, const ClosedFormSpec& spec, const Tolerances& tolerances, const double* T,
                const double* reference_row, BranchBlock& block) {
  constexpr int W = LANES;
  using P = Pack<W>;
  const Frame<P> target = constant_frame<P>(T);
  P reference[6];
  for (int j = 0; j < spec.dof; ++j) reference[j] = P(reference_row[j]);
  block.exact[0] = block.verified[0] = block.inside[0] = block.near = block.weak = 0;
  for (unsigned& slot : block.free_slot) slot = 0;
  for (int first = 0; first < spec.branches; first += W) {
    LaneContext<W> context;
    SharedForward<W, 6> reach{chain};
    P theta[6];
    numbered_branches<Model>(spec, context, target, first, theta);
    const auto stored = store_branch<W>(chain, spec, tolerances, target, theta, reference, block.value[0], first, reach);
    // an arm with fewer branches than lanes repeats them
    const unsigned used = spec.branches - first < W ? (1u << (spec.branches - first)) - 1u : ~0u;
    block.exact[0] |= (stored.exact & used) << first;
    block.verified[0] |= (stored.verified & used) << first;
    block.inside[0] |= (stored.inside & used) << first;
    block.near |= lane_bits(context.near) & used;
    block.weak |= lane_bits(context.weak) & used;
    for (int slot = 0; slot < FREE_SLOTS; ++slot) block.free_slot[slot] |= lane_bits(context.free_slot[slot]) & used;
  }
}

inline void closed_form_poses(const Chain& chain, const ClosedFormSpec& spec, const Tolerances& tolerances,
                              const double* const* T, const double* const* reference, const FreeDirections* free,
                              BranchBlock& block) {
  with_model(spec.family, [&]<class Model>(Model) { solve_poses<Model>(chain, spec, tolerances, T, reference, free, block); });
}

inline void closed_form_pose(const Chain& chain, const ClosedFormSpec& spec, const Tolerances& tolerances, const double* T,
                             const double* reference, BranchBlock& block) {
  with_model(spec.family, [&]<class Model>(Model) { solve_pose<Model>(chain, spec, tolerances, T, reference, block); });
}

// Whether one branch may have joint values for a pose in the interval; an undetermined direction is
// bisected down to arcs of FINEST.
template <class Model>
bool branch_possible(const ClosedFormSpec& spec, const Elements<Interval>& e, const double* signs, int slot, double from,
                     double to) {
  constexpr double FINEST = TWO_PI / 131072.0;
  IntervalContext context;
  context.open_slot = slot;
  context.arc_set = slot >= 0;
  context.arc_from = from;
  context.arc_to = to;
  State<Interval> s;
  Model::first(spec, context, e, Interval(signs[0]), s);
  if constexpr (Model::stages >= 2) Model::second(spec, context, e, Interval(signs[1]), s);
  if constexpr (Model::stages >= 3) Model::third(spec, context, Interval(signs[2]), s);
  if (!context.possible) return false;
  if (slot < 0) {
    if (context.open_slot < 0) return true;
    for (int quarter = 0; quarter < 4; ++quarter)
      if (branch_possible<Model>(spec, e, signs, context.open_slot, quarter * HALF_PI, (quarter + 1) * HALF_PI)) return true;
    return false;
  }
  if (to - from < FINEST) return true;
  const double middle = 0.5 * (from + to);
  return branch_possible<Model>(spec, e, signs, slot, from, middle) ||
         branch_possible<Model>(spec, e, signs, slot, middle, to);
}

// Runs every branch on the interval of all poses within the tolerances of T. A branch whose
// discriminant is negative, or whose condition fails, everywhere in it has no joint values; when all
// branches are such, no joint values exist.
inline bool closed_form_unreachable(const ClosedFormSpec& spec, const Tolerances& tolerances, const double* T) {
  // the equations are those of an arm that may differ from the chain by a little
  const Frame<Interval> target = poses_near(T, tolerances.position + spec.position_deviation,
                                            tolerances.rotation + spec.rotation_deviation);
  bool possible = false;
  with_model(spec.family, [&]<class Model>(Model) {
    const Elements<Interval> e = canonical_target(spec, target);
    const double signs[2] = {1.0, -1.0};
    for (double i : signs)
      for (double j : signs)
        for (double k : signs) {
          const double branch[3] = {i, j, k};
          possible = possible || branch_possible<Model>(spec, e, branch, -1, 0.0, 0.0);
        }
  });
  return !possible;
}

}  // namespace kinverse::KINVERSE_ISA
