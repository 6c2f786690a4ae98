// Every range of the free parameter in which a branch of a seven-joint arm exists inside the limits.
#pragma once

#include "redundant_samples.hpp"

namespace kinverse {

class RedundantSweep {
 public:
  RedundantSweep(const RedundantCall& call, Table& table) : call_(call), at_(call), table_(table) {}

  // One pose after another: its ranges, and a solution of each.
  void run(const double* T, const double* seed);

 private:
  struct Range {
    int branch;
    double low, high;
  };
  struct Point {
    double value;
    bool ok;
  };

  bool feasible(const RedundantSample& s, int branch) const;
  template <class Predicate>
  bool any(Predicate holds) const {
    return std::any_of(line_.begin(), line_.end(), holds);
  }

  void sample_all(int per_turn);
  void fill(const RedundantSample& from, const RedundantSample& to, double step);
  double value_of(int k, int steps) const;

  void find_ranges(bool thorough);
  bool hidden(int b, size_t k, bool thorough, Point& found);
  void collect(int b, const std::vector<Point>& points);
  double end(int b, double outside, double inside);

  void represent(const Range& range, bool& singular);
  double nearest(const Range& range);
  void find_singular();
  void explain(Status& unsolved);

  const RedundantCall& call_;
  RedundantSampler at_;
  Table& table_;
  const double* seed_ = nullptr;
  double nearest_yet_ = 1e300;
  bool only_verified_ = false, found_singular_ = false;
  std::vector<RedundantSample> line_;
  std::vector<Range> ranges_;
  std::vector<Candidate> candidates_;
};

}  // namespace kinverse
