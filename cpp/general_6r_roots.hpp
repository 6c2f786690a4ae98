// The solutions of one pose of a six-joint arm: what several eliminations and searches find, united.
#pragma once

#include <array>

#include "kernels.hpp"
#include "table.hpp"

namespace kinverse {

struct Root {
  std::array<double, 6> q;
  double position_error, rotation_error;
  bool exact, verified, inside, singular;

  double error() const { return std::max(position_error, rotation_error); }
  Solution solution(int branch) const { return {q.data(), position_error, rotation_error, branch, 1}; }
};

class RootSet {
 public:
  // `size`: of the arm, what lengths are compared in
  RootSet(const Chain& chain, double size) : chain_(chain), size_(size) {}

  void clear();
  void merge(const RootBlock& block);
  // Branches are numbered by the angle of joint `first`, then by the others. A root that just misses
  // counts only for a pose that has no exact one.
  void finish(int first);

  int count() const { return count_; }
  int exact() const;
  const Root& operator[](int i) const { return root_[i]; }
  // the nearest miss or the best solution of all that was merged
  const Root& best() const { return best_; }
  bool has_best() const { return best_error_ < 1e300; }

 private:
  double distance(const double* a, const double* b) const;
  bool are_same(const Root& a, const Root& b) const;
  void unite();

  static constexpr int MOST = 64;  // a pose on a continuum has any number of solutions
  const Chain& chain_;
  double size_;
  Root root_[MOST], best_{};
  double best_error_ = 1e300;
  int count_ = 0;
  bool moved_ = false;
};

// Whether the evidence of an elimination that found `distinct` exact roots is too weak to stand alone.
bool is_weak(const Elimination& e, const RootBlock& block, int distinct);

}  // namespace kinverse
