// The table of functions that each instruction set compiles for itself (kernels.cpp).
#pragma once

#include "chain.hpp"
#include "closed_form_spec.hpp"
#include "general_6r_spec.hpp"
#include "least_squares_problem.hpp"

namespace kinverse {

constexpr int WIDEST = 8;      // lanes of the widest instruction set
constexpr int FREE_SLOTS = 4;  // vectors of a closed form that may vanish

// What a pose matrix was found to be.
enum class PoseVerdict : std::uint8_t { exact, inexact, not_finite, not_rigid, bad_last_row };

// A closed form is exact to rounding, so a branch whose error is far above that (`exact`) is one that
// just misses: it counts only for a pose that has no exact branch.
struct Tolerances {
  double position, rotation;
  double exact_position, exact_rotation;
  bool hold_limits;
};

// The branches of some poses as the lanes leave them. Poses in the lanes: value[branch][k][lane] and
// a bit per lane; branches in the lanes: value[0][k][branch] and a bit per branch in [0]. k runs over
// the joints, then the position error and the rotation error.
struct BranchBlock {
  alignas(64) double value[MAX_BRANCHES][8][WIDEST];
  unsigned exact[MAX_BRANCHES];
  unsigned verified[MAX_BRANCHES];
  unsigned inside[MAX_BRANCHES];
  unsigned near;                  // two branches may be one solution
  unsigned weak;                  // a direction is hardly determined
  unsigned free_slot[FREE_SLOTS]; // a free direction was chosen in this slot
};

// Seven joints, the lanes hold pairs of a pose and a value of the free parameter. `margin` [rad] is how
// far inside the limits a branch is; far below zero, and the lower the worse, where it misses the pose.
struct RedundantBlock {
  alignas(64) double value[MAX_BRANCHES][9][WIDEST];
  alignas(64) double margin[MAX_BRANCHES][WIDEST];
  unsigned exact[MAX_BRANCHES];
  unsigned verified[MAX_BRANCHES];
  unsigned inside[MAX_BRANCHES];
  unsigned near, stretched, singular, singular_slots;  // stretched: the elbow's two branches are one
};

// Directions for the vectors that vanish in a singular pose, one set per lane.
struct FreeDirections {
  alignas(64) double cosine[FREE_SLOTS][WIDEST], sine[FREE_SLOTS][WIDEST];
};

// How a population method weighs a pose that is missed. quaternion: the angle of the rotation that is
// missing; rotation_vector and euler: the norm of its vector, or of the differences of roll, pitch, yaw.
enum class Norm : int { l2, l1, squared };
enum class Orientation : int { quaternion, rotation_vector, euler };
struct CostSpec {
  Task task;
  Norm norm;
  Orientation orientation;
};

// What a step between joint values costs, and how long it may be: limit, weight and turns have `dof`
// entries. `squares`: the root of the sum of squares of the weighted joint steps; else the largest.
struct StepSpec {
  int dof;
  bool squares;
  const double* limit;
  const double* weight;
  const std::uint8_t* turns;  // a whole turn changes nothing
};

struct Kernels {
  const char* name;
  int lanes;
  // q (count, dof) -> T (count, 16)
  void (*forward)(const Chain& chain, const double* q, long count, double* T);
  // the same, one configuration at a time: what the lanes are measured against
  void (*forward_one_lane)(const Chain& chain, const double* q, long count, double* T);
  // q (count, dof) -> J (count, 6, dof)
  void (*jacobian)(const Chain& chain, const double* q, long count, double* J);
  void (*inspect_poses)(const double* T, long count, PoseVerdict* verdict);
  // errors of q[k] against T[pose_index[k]]; q is moved onto limits it misses by rounding
  void (*measure)(const Chain& chain, Task task, const double* T, const std::int64_t* pose_index, double* q, long count,
                  double* position_error, double* rotation_error);
  // q (poses, each, dof) -> cost (poses, each) against T (poses, 16), weight (poses)
  void (*pose_costs)(const Chain& chain, const CostSpec& spec, const double* T, const double* weight, const double* q,
                     long poses, long each, double* cost);
  // `lanes` poses at once; reference[lane] points to the joint values that windings are nearest to
  void (*closed_form_poses)(const Chain& chain, const ClosedFormSpec& spec, const Tolerances& tolerances,
                            const double* const* T, const double* const* reference, const FreeDirections* free,
                            BranchBlock& block);
  // one pose, its branches in the lanes
  void (*closed_form_pose)(const Chain& chain, const ClosedFormSpec& spec, const Tolerances& tolerances, const double* T,
                           const double* reference, BranchBlock& block);
  // whether no joint values at all meet the tolerances, shown by interval arithmetic
  bool (*closed_form_unreachable)(const ClosedFormSpec& spec, const Tolerances& tolerances, const double* T);
  // one pose of a six-joint arm by one of its eliminations, the roots in the lanes
  void (*general_6r_pose)(const Chain& chain, const General6R& arm, int which, const Tolerances& tolerances,
                          const double* T, const double* reference, RootBlock& block);
  // the same from up to MAX_ROOTS given starts (count, 6); lengths in units of `size`
  void (*general_6r_polish)(const Chain& chain, double size, const Tolerances& tolerances, const double* T,
                            const double* reference, const double* starts, int count, RootBlock& block);
  // `lanes` pairs of a pose and a parameter at once, for an arm with seven joints
  void (*redundant)(const Chain& chain, const RedundantSpec& spec, const Tolerances& tolerances, const double* const* T,
                    const double* parameter, const double* const* reference, const FreeDirections* free,
                    RedundantBlock& block);
  // whether no joint values at all meet the tolerances, whatever the parameter
  bool (*redundant_unreachable)(const RedundantSpec& spec, const Tolerances& tolerances, const double* T);
  // `count` poses by nonlinear least squares (least_squares.hpp)
  void (*least_squares)(const LeastSquaresProblem& problem, const LeastSquaresInput& in, long count,
                        const LeastSquaresOutput& out);
  // from (dof, stride), of which `count` columns are read; to (tos, dof) -> step (tos, stride)
  void (*joint_steps)(const StepSpec& spec, const double* from, long count, long stride, const double* to, long tos,
                      double* step);
};

namespace baseline {
extern const Kernels KERNELS;
}
namespace avx2 {
extern const Kernels KERNELS;
}
namespace avx512 {
extern const Kernels KERNELS;
}

}  // namespace kinverse
