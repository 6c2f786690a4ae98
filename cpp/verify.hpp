// Candidates in, verified solutions out: for every solver the same.
#pragma once

#include <vector>

#include "kernels.hpp"
#include "owned_chain.hpp"
#include "table.hpp"

namespace kinverse {

// How the answers of a pose are chosen.
struct Choice {
  Task task = Task::pose;
  double tol_position = 1e-6, tol_rotation = 1e-6;
  bool all_windings = false;
  bool hold_limits = true;
  // Error [m, rad] that rounding explains, for methods that are exact: a candidate with more only just
  // misses the pose, and counts only if no exact one does. Others: no bound.
  double exact = __builtin_inf();
};

// What the kernels hold candidates against; `exact`: the error that rounding explains.
Tolerances tolerances_of(const Choice& choice, double exact);

// Joint values to be near to: none, one row for all poses, or one row a pose.
struct Seeds {
  const double* rows = nullptr;
  bool shared = false;
  const double* of(long pose, int dof) const { return rows ? rows + (shared ? 0 : pose * dof) : nullptr; }
  Seeds from(long pose, int dof) const { return {of(pose, dof), shared}; }
};

struct Candidate {
  std::vector<double> q;
  double position_error, rotation_error;
  int branch;
  bool inside, verified;
  bool may_repeat = true;  // may be the same solution as an earlier candidate
  bool exact = false;      // no more off than rounding explains
};

// What else is known of a pose when its candidates are judged.
struct PoseFacts {
  const double* T;  // 16
  const double* seed = nullptr;
  Status unsolved = Status::not_found;  // without a verified candidate
  bool singular = false;
  // The candidates stand for more solutions than they are (a continuum, or close to one): that none of
  // them lies inside the limits shows nothing.
  bool representative = false;
};

// Rows q with the pose and branch of each; hint, singular and evidence per pose.
struct Candidates {
  std::vector<double> q;
  std::vector<std::int64_t> pose_index;
  std::vector<std::int32_t> branch;
  std::vector<std::uint8_t> hint, singular;
  std::vector<Evidence> evidence;

  void add(std::int64_t pose, const double* row, int dof, int of_branch) {
    q.insert(q.end(), row, row + dof);
    pose_index.push_back(pose);
    branch.push_back(of_branch);
  }
};

// Which free joints may be turned by whole turns without moving the arm.
std::vector<bool> turning_joints(const Chain& chain);

// The winding of a turning joint nearest to `reference`, a turn aside if only that is inside the limits.
double wind(double q, double reference, double low, double high, bool hold_limits);

// What windings are nearest to: the seed, inside the limits if these hold, else their middle.
std::vector<double> winding_reference(const Chain& chain, const double* seed, bool hold_limits);

// Keeps the verified candidates of one pose that lie inside the limits (only the exact ones, if there
// are such), one of each set closer than 1e-6, ordered by the largest joint distance to the seed (else
// by branch), and ends the pose. Where all verified candidates lie outside the limits, they are moved
// onto them: one that still holds is a solution, and only if all are clearly wrong there, the pose is
// out of limits.
void finish_pose(const Chain& chain, const Choice& choice, std::vector<Candidate>& candidates, const PoseFacts& facts,
                 Table& table);

// T (poses, 16); candidates q (count, dof) for the poses in pose_index; branch (count); hint and singular (poses;
// singular may be null).
Table verify(const Chain& chain, const Choice& choice, const double* T, long poses, const double* q,
             const std::int64_t* pose_index, const std::int32_t* branch, long count, const std::uint8_t* hint,
             const Seeds& seeds, const std::uint8_t* singular);

// Copies of the poses with rotations brought to the nearest rotation where they need it; empty if all
// are usable as they stand. `bad` is the first pose that cannot be used, or -1.
std::vector<double> usable_poses(const double* T, long count, long& bad);

}  // namespace kinverse
