#include "table.hpp"

#include <limits>

namespace kinverse {

Best best_of(const Table& table) {
  const size_t poses = static_cast<size_t>(table.poses()), dof = static_cast<size_t>(table.dof());
  const double none = std::numeric_limits<double>::quiet_NaN();
  Best best{std::vector(poses * dof, none), std::vector(poses, none), std::vector(poses, none)};
  auto offer = [&](std::int64_t pose, const double* q, double position, double rotation) {
    const size_t at = static_cast<size_t>(pose);
    double& held = best.position_error[at];
    if (!std::isnan(held) && std::fmax(held, best.rotation_error[at]) <= std::fmax(position, rotation)) return;
    held = position;
    best.rotation_error[at] = rotation;
    std::copy(q, q + dof, best.q.data() + at * dof);
  };
  for (long k = 0; k < table.solutions(); ++k)
    offer(table.pose_index[k], table.q.data() + k * table.dof(), table.position_error[k], table.rotation_error[k]);
  for (long k = 0; k < table.best_pose.size(); ++k)
    offer(table.best_pose[k], table.best_q.data() + k * table.dof(), table.best_position_error[k],
          table.best_rotation_error[k]);
  return best;
}

std::vector<Evidence> evidence_of(const Table& table) {
  if (table.evidence.size()) return {table.evidence.data(), table.evidence.data() + table.poses()};
  std::vector<Evidence> rows(static_cast<size_t>(table.poses()));
  for (size_t i = 0; i < rows.size(); ++i) {
    const Status status = static_cast<Status>(table.status[static_cast<long>(i)]);
    rows[i].method = status == Status::unreachable ? Ground::bounds : table.method;
    rows[i].weak = rows[i].method < Ground::closed_form || status == Status::not_found;
  }
  return rows;
}

}  // namespace kinverse
