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
  // Of a continuum: some that are well apart, inside the limits if there are such, near `reference` first.
  void represent(const double* reference);
  // Branches are numbered by the angle of joint `first`, then by the others. A root that just misses
  // counts only for a pose that has no exact one.
  void finish(int first);

  int count() const { return count_; }
  int exact() const;
  bool any_inside() const;
  bool any_singular() const;
  const Root& operator[](int i) const { return root_[i]; }
  // the nearest miss or the best solution of all that was merged
  const Root& best() const { return best_; }
  bool has_best() const { return best_error_ < 1e300; }

 private:
  double distance(const double* a, const double* b) const;
  bool are_same(const Root& a, const Root& b) const;
  void drop_misses();
  void unite();

  static constexpr int MOST = 64;  // a pose on a continuum has any number of solutions
  const Chain& chain_;
  double size_;
  Root root_[MOST], best_{};
  double best_error_ = 1e300;
  int count_ = 0;
  bool moved_ = false;
};

// Whether what one elimination says of a pose is too weak to stand alone; `distinct` exact roots are known.
bool is_weak(double disturbance, const RootBlock& block, int distinct);

}  // namespace kinverse
