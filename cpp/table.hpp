// The verified answer for N poses: flat arrays, M solutions in all. The only thing solvers return.
#pragma once

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <cstdlib>
#include <cstring>
#include <new>
#include <string>
#include <utility>
#include <vector>

#include "chain.hpp"
#include "evidence.hpp"

namespace kinverse {

// A growing array that is not cleared when it grows.
template <class T>
class Buffer {
 public:
  Buffer() = default;
  Buffer(Buffer&& other) noexcept { swap(other); }
  Buffer& operator=(Buffer&& other) noexcept {
    swap(other);
    return *this;
  }
  ~Buffer() { std::free(data_); }

  const T* data() const { return data_; }
  long size() const { return size_; }
  const T& operator[](long i) const { return data_[i]; }
  // room for `more` entries at the end; commit what was written
  T* reserve(long more) {
    if (size_ + more > capacity_) grow(size_ + more);
    return data_ + size_;
  }
  void commit(long more) { size_ += more; }
  void push(T value) {
    *reserve(1) = value;
    ++size_;
  }
  void append(const T* from, long count) {
    if (count) std::memcpy(reserve(count), from, sizeof(T) * static_cast<size_t>(count));
    size_ += count;
  }

 private:
  void swap(Buffer& other) {
    std::swap(data_, other.data_);
    std::swap(size_, other.size_);
    std::swap(capacity_, other.capacity_);
  }
  void grow(long least) {
    long wanted = capacity_ * 2 > least ? capacity_ * 2 : least;
    void* grown = std::realloc(data_, sizeof(T) * static_cast<size_t>(wanted));
    if (!grown) throw std::bad_alloc();
    data_ = static_cast<T*>(grown);
    capacity_ = wanted;
  }
  T* data_ = nullptr;
  long size_ = 0, capacity_ = 0;
};

struct Solution {
  const double* q;
  double position_error, rotation_error;
  int branch;
  long stride;  // between the joint values
};

class Table {
 public:
  Table(int dof, long poses, long expected_solutions) : dof_(dof) {
    status.reserve(poses);
    count.reserve(poses);
    singular.reserve(poses);
    q.reserve(expected_solutions * dof);
    pose_index.reserve(expected_solutions);
    position_error.reserve(expected_solutions);
    rotation_error.reserve(expected_solutions);
    branch.reserve(expected_solutions);
  }

  int dof() const { return dof_; }
  long poses() const { return status.size(); }
  long solutions() const { return branch.size(); }

  // Poses come one after another: their solutions, then the end of the pose.
  void add(const Solution& s) {
    double* to = q.reserve(dof_);
    for (int j = 0; j < dof_; ++j) to[j] = s.q[j * s.stride];
    q.commit(dof_);
    pose_index.push(status.size());
    position_error.push(s.position_error);
    rotation_error.push(s.rotation_error);
    branch.push(s.branch);
    ++open_;
  }
  // Several branches of one pose at once: branch b at value + b * step, joint k (then the two errors) at
  // k * stride from there; those in `branches`, in order.
  template <int STRIDE>
  void add_branches(const double* value, long step, unsigned branches) {
    if (dof_ == 6)
      add_branches_of<6, STRIDE>(value, step, branches);
    else
      add_branches_of<0, STRIDE>(value, step, branches);
  }
  // Those in `branches` by their largest joint distance to the seed; equal ones, and without a seed all,
  // in order. solution(b) is branch b's.
  template <class SolutionOf>
  void add_nearest_first(unsigned branches, const double* seed, SolutionOf solution) {
    int order[32], count = 0;
    double distance[32];
    for (; branches; branches &= branches - 1u) {
      const int b = __builtin_ctz(branches);
      const Solution s = solution(b);
      double largest = 0.0;
      for (int j = 0; seed && j < dof_; ++j) largest = std::max(largest, std::fabs(s.q[j * s.stride] - seed[j]));
      int at = count++;
      for (; at > 0 && distance[at - 1] > largest; --at) {
        distance[at] = distance[at - 1];
        order[at] = order[at - 1];
      }
      distance[at] = largest;
      order[at] = b;
    }
    for (int k = 0; k < count; ++k) add(solution(order[k]));
  }
  void end_pose(Status unsolved, bool is_singular) {
    if (!open_ && unsolved == Status::not_found) ++not_found;
    status.push(static_cast<std::uint8_t>(open_ ? Status::solved : unsolved));
    count.push(open_);
    singular.push(is_singular);
    open_ = 0;
  }
  // the nearest miss of a pose without solutions, before its end
  void add_best(const Solution& s) {
    best_pose.push(status.size());
    double* to = best_q.reserve(dof_);
    for (int j = 0; j < dof_; ++j) to[j] = s.q[j * s.stride];
    best_q.commit(dof_);
    best_position_error.push(s.position_error);
    best_rotation_error.push(s.rotation_error);
  }
  // a range of the free parameter of the pose that is open
  void add_interval(int of_branch, double low, double high) {
    interval_pose.push(status.size());
    interval_branch.push(of_branch);
    interval_low.push(low);
    interval_high.push(high);
  }
  // Another table's poses behind these.
  void append(const Table& other) {
    for (long k = 0; k < other.pose_index.size(); ++k) pose_index.push(other.pose_index[k] + poses());
    for (long k = 0; k < other.best_pose.size(); ++k) best_pose.push(other.best_pose[k] + poses());
    for (long k = 0; k < other.interval_pose.size(); ++k) interval_pose.push(other.interval_pose[k] + poses());
    auto join = [](auto& to, const auto& from) { to.append(from.data(), from.size()); };
    join(q, other.q);
    join(position_error, other.position_error);
    join(rotation_error, other.rotation_error);
    join(branch, other.branch);
    join(count, other.count);
    join(interval_branch, other.interval_branch);
    join(interval_low, other.interval_low);
    join(interval_high, other.interval_high);
    join(best_q, other.best_q);
    join(best_position_error, other.best_position_error);
    join(best_rotation_error, other.best_rotation_error);
    join(singular, other.singular);
    join(evaluations, other.evaluations);
    join(status, other.status);
    not_found += other.not_found;
    for (size_t c = 0; c < columns.size(); ++c) join(columns[c].second, other.columns[c].second);
    join(evidence, other.evidence);
  }

  Buffer<double> q, position_error, rotation_error, best_q, best_position_error, best_rotation_error;
  Buffer<double> interval_low, interval_high;
  Buffer<std::int64_t> pose_index, count, best_pose, interval_pose;
  Buffer<std::int64_t> evaluations;  // per pose; empty: evaluations_each for every pose
  Buffer<std::int32_t> branch, interval_branch;
  Buffer<std::uint8_t> status, singular;
  Buffer<Evidence> evidence;  // per pose; empty: as `method` and status say
  Ground method = Ground::search;
  std::vector<std::pair<std::string, Buffer<std::int64_t>>> columns;  // what a method counts besides
  std::int64_t evaluations_each = 0;
  std::int64_t not_found = 0;  // how many poses have this status

 private:
  template <int DOF, int STRIDE>
  void add_branches_of(const double* value, long step, unsigned branches) {
    const int dof = DOF ? DOF : dof_;
    const long count = __builtin_popcount(branches);
    double *to = q.reserve(count * dof), *position = position_error.reserve(count), *rotation = rotation_error.reserve(count);
    std::int64_t* pose = pose_index.reserve(count);
    std::int32_t* number = branch.reserve(count);
    const std::int64_t index = status.size();
    for (; branches; branches &= branches - 1u) {
      const int b = __builtin_ctz(branches);
      const double* from = value + b * step;
      for (int j = 0; j < dof; ++j) to[j] = from[j * STRIDE];
      to += dof;
      *position++ = from[dof * STRIDE];
      *rotation++ = from[(dof + 1) * STRIDE];
      *pose++ = index;
      *number++ = b;
    }
    q.commit(count * dof);
    position_error.commit(count);
    rotation_error.commit(count);
    pose_index.commit(count);
    branch.commit(count);
    open_ += count;
  }

  int dof_;
  std::int64_t open_ = 0;
};

// The nearest miss of each pose; of a solved pose, its solution with the least error. Not a number where
// there is neither.
struct Best {
  std::vector<double> q, position_error, rotation_error;
};
Best best_of(const Table& table);

// What each pose's answer rests on.
std::vector<Evidence> evidence_of(const Table& table);

}  // namespace kinverse
