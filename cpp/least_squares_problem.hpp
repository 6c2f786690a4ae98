// What the least-squares kernel is given and gives back: plain structures that cross the border
// between the instruction sets.
#pragma once

#include "chain.hpp"

namespace kinverse {

enum class Method : int { levenberg_marquardt, newton_raphson, gauss_newton, damped_least_squares };

// Why a start ended; what is reported belongs to the start whose joint values are.
enum class Stop : std::uint8_t { residual, step, gradient, stalled, iterations, diverged, limits };

// One joint of a chain made cheap to move along: the fixed transform in front of it is a shift and a
// turn about x alone, because its turns about z are absorbed by the joints on both sides.
struct Link {
  double shift[3];
  double cosine, sine;  // of the turn about x
  double multiplier, offset;
  double turn_cosine, turn_sine;  // the constant turn about z of a prismatic joint
  int source;
  bool prismatic;
};

// Lengths are in units of `unit_length`, which makes position and rotation comparable: a power of two
// near half the arm's reach, so that scaling is exact, times the weights' ratio. Box and tolerances below
// are in these units; q and poses come and go in metres.
struct LeastSquaresProblem {
  Task task;
  Method method;
  int joints, dof;
  bool plain;  // revolute joints only, each driven by its own free joint
  const Link* links;  // joints + 1; the last leads to the tool
  const double* base;  // 3x4
  double tool_cosine, tool_sine;  // a last turn about z, moved to the target
  double unit_length;
  const double* unit;  // dof: unit_length of a prismatic joint, else 1
  const std::uint8_t* turns;  // dof: whole turns of the joint move nothing
  const double* lower;  // dof, infinite where limits are ignored
  const double* upper;
  const double* start_middle;  // dof: further starts lie within start_width about the middle
  const double* start_width;
  const double* start_step;  // dof: the R_n sequence
  bool clamp;  // hold the box in every step; else only at the end
  bool centre_on_seed;  // further starts about the seed
  double tol_position, tol_rotation;
  double max_distance;  // of each joint from the seed, infinite if free
  double damping, step_tolerance, gradient_tolerance;
  int max_starts, max_iterations;
};

struct LeastSquaresInput {
  const double* T;  // (count, 16)
  const double* q_seed;  // where start 0 begins, a row every `seed_stride`; or null
  long seed_stride;
  const double* q_centre;  // (dof): what max_distance counts from, or null for q_seed
  std::uint64_t seed;
  bool eager;  // idle lanes run further starts before the first has failed: no other answer, only sooner
};

struct LeastSquaresOutput {
  double* q;  // (count, dof)
  std::uint8_t* found;
  std::int64_t* evaluations;
  std::int64_t* iterations;
  std::int64_t* starts;
  std::uint8_t* stop;
  int* work;  // lanes * max_starts
};

}  // namespace kinverse
