// Compiled once per instruction set; everything here lives in a namespace named by it.
#include "kernels.hpp"

#include "closed_form_kernel.hpp"
#include "general_6r_kernel.hpp"
#include "joint_steps.hpp"
#include "pose_cost.hpp"

namespace kinverse::KINVERSE_ISA {

// least_squares.cpp
void least_squares_lanes(const LeastSquaresProblem& problem, const LeastSquaresInput& in, long count,
                         const LeastSquaresOutput& out);

// redundant_kernel.cpp
void redundant_lanes(const Chain& chain, const RedundantSpec& spec, const Tolerances& tolerances, const double* const* T,
                     const double* parameter, const double* const* reference, const FreeDirections* free,
                     RedundantBlock& block);
bool redundant_unreachable(const RedundantSpec& spec, const Tolerances& tolerances, const double* T);

namespace {

template <int W>
void forward_batch(const Chain& chain, const double* q, long count, double* T) {
  for (long first = 0; first < count; first += W) {
    Pack<W> joints[MAX_JOINTS];
    gather_joints<W>(q, chain.dof, first, count, joints);
    Frame<Pack<W>> f = forward<W>(chain, joints);
    alignas(64) double t[12][W];
    const Vec3<Pack<W>> columns[4] = {f.x, f.y, f.z, f.p};
    for (int k = 0; k < 4; ++k) {
      store(t[k], columns[k].x);
      store(t[4 + k], columns[k].y);
      store(t[8 + k], columns[k].z);
    }
    long lanes = count - first < W ? count - first : W;
    for (long l = 0; l < lanes; ++l) {
      double* row = T + 16 * (first + l);
      for (int k = 0; k < 12; ++k) row[k] = t[k][l];
      row[12] = row[13] = row[14] = 0.0;
      row[15] = 1.0;
    }
  }
}

template <int W>
void jacobian_batch(const Chain& chain, const double* q, long count, double* J) {
  for (long first = 0; first < count; first += W) {
    Pack<W> joints[MAX_JOINTS], columns[MAX_JOINTS][6];
    gather_joints<W>(q, chain.dof, first, count, joints);
    forward<W>(chain, joints, columns);
    long lanes = count - first < W ? count - first : W;
    for (int j = 0; j < chain.dof; ++j)
      for (int k = 0; k < 6; ++k) {
        alignas(64) double t[W];
        store(t, columns[j][k]);
        for (long l = 0; l < lanes; ++l) J[((first + l) * 6 + k) * chain.dof + j] = t[l];
      }
  }
}

// T must be finite, its rotation orthonormal to 1e-5 (six-digit files pass; a hair more than what
// Python takes, so that nothing it took is refused here) and right handed; what is off by more than
// rounding is brought to the nearest rotation later.
void inspect_poses(const double* T, long count, PoseVerdict* verdict) {
  constexpr int W = LANES;
  using P = Pack<W>;
  for (long first = 0; first < count; first += W) {
    const double* rows[W];
    for (int l = 0; l < W; ++l) rows[l] = T + 16 * (first + l < count ? first + l : count - 1);
    const Frame<P> f = gather_frames<W>(rows);
    P deviation = max(max(abs(dot(f.x, f.x) - P(1.0)), abs(dot(f.y, f.y) - P(1.0))), abs(dot(f.z, f.z) - P(1.0)));
    deviation = max(deviation, max(max(abs(dot(f.x, f.y)), abs(dot(f.y, f.z))), abs(dot(f.z, f.x))));
    const unsigned rigid = lane_bits((deviation <= P(1.0001e-5)) & (dot(cross(f.x, f.y), f.z) > P(0.0)));
    const unsigned exact = lane_bits(deviation <= P(1e-12));
    const unsigned placed = lane_bits(abs(f.p.x) + abs(f.p.y) + abs(f.p.z) < P(1e200));
    for (int l = 0; l < W && first + l < count; ++l) {
      const double* row = rows[l];
      PoseVerdict& v = verdict[first + l];
      v = exact >> l & 1u ? PoseVerdict::exact : PoseVerdict::inexact;
      if (!(rigid >> l & 1u)) {
        v = PoseVerdict::not_rigid;
        for (int k = 0; k < 16; ++k)
          if (!(row[k] - row[k] == 0.0)) v = PoseVerdict::not_finite;
      }
      if (!(placed >> l & 1u)) v = PoseVerdict::not_finite;
      if (row[12] != 0.0 || row[13] != 0.0 || row[14] != 0.0 || row[15] != 1.0) v = PoseVerdict::bad_last_row;
    }
  }
}

void measure(const Chain& chain, Task task, const double* T, const std::int64_t* pose_index, double* q, long count,
             double* position_error, double* rotation_error) {
  constexpr int W = LANES;
  for (long first = 0; first < count; first += W) {
    const double* rows[W];
    for (int l = 0; l < W; ++l) rows[l] = T + 16 * pose_index[first + l < count ? first + l : count - 1];
    Pack<W> joints[MAX_JOINTS];
    gather_joints<W>(q, chain.dof, first, count, joints);
    Checked<W> checked = check<W>(chain, task, gather_frames<W>(rows), joints, 0.0, 0.0);
    alignas(64) double t[W], position[W], rotation[W];
    store(position, checked.position_error);
    store(rotation, checked.rotation_error);
    for (int j = 0; j < chain.dof; ++j) {
      store(t, joints[j]);
      for (int l = 0; l < W && first + l < count; ++l) q[(first + l) * chain.dof + j] = t[l];
    }
    for (int l = 0; l < W && first + l < count; ++l) {
      position_error[first + l] = position[l];
      rotation_error[first + l] = rotation[l];
    }
  }
}

void pose_costs(const Chain& chain, const CostSpec& spec, const double* T, const double* weight, const double* q,
                long poses, long each, double* cost) {
  constexpr int W = LANES;
  const long count = poses * each;
  for (long first = 0; first < count; first += W) {
    const double* rows[W];
    alignas(64) double weights[W], costs[W];
    for (int l = 0; l < W; ++l) {
      const long pose = (first + l < count ? first + l : count - 1) / each;
      rows[l] = T + 16 * pose;
      weights[l] = weight[pose];
    }
    Pack<W> joints[MAX_JOINTS];
    gather_joints<W>(q, chain.dof, first, count, joints);
    const Frame<Pack<W>> target = rows[0] == rows[W - 1] ? constant_frame<Pack<W>>(rows[0]) : gather_frames<W>(rows);
    store(costs, pose_cost<W>(spec, target, forward<W>(chain, joints), load<W>(weights)));
    for (int l = 0; l < W && first + l < count; ++l) cost[first + l] = costs[l];
  }
}

}  // namespace

#define KINVERSE_TEXT_OF(x) #x
#define KINVERSE_TEXT(x) KINVERSE_TEXT_OF(x)

const Kernels KERNELS = {
    KINVERSE_TEXT(KINVERSE_ISA), LANES, forward_batch<LANES>, forward_batch<1>, jacobian_batch<LANES>,
    inspect_poses, measure, pose_costs, closed_form_poses, closed_form_pose, closed_form_unreachable,
    general_6r_pose, general_6r_polish, redundant_lanes, redundant_unreachable, least_squares_lanes,
    joint_steps<LANES>,
};

}  // namespace kinverse::KINVERSE_ISA
