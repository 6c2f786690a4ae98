// Poses spread over the threads, the tables of the parts joined in order.
#pragma once

#include <utility>
#include <vector>

#include "dispatch.hpp"
#include "table.hpp"

namespace kinverse {

// work(table, first, last) fills the table of poses first..last-1; about `expected` solutions each.
template <class Work>
Table in_parts(int dof, long poses, long least_part, long expected, Work work) {
  std::vector<Table> parts;
  const long count = parts_of(poses, least_part);
  for (long part = 0; part < count; ++part) parts.emplace_back(dof, 0, 0);
  run_parts(poses, count, [&](long first, long last, long part) {
    Table& table = parts[static_cast<size_t>(part)];
    table = Table(dof, last - first, (last - first) * expected);
    work(table, first, last);
  });
  for (size_t part = 1; part < parts.size(); ++part) parts[0].append(parts[part]);
  return std::move(parts[0]);
}

}  // namespace kinverse
