// One pose of an arm with seven joints at many values of its free parameter.
#pragma once

#include <vector>

#include "continuum.hpp"
#include "dispatch.hpp"
#include "verify.hpp"

namespace kinverse {

// What all poses of a call have in common.
struct RedundantCall {
  RedundantCall(const Chain& chain, const RedundantSpec& spec, double exact, const Choice& choice)
      : chain(chain), spec(spec), choice(choice), tolerances(tolerances_of(choice, exact)), kernels(active_kernels()) {}

  const Chain chain;
  const RedundantSpec& spec;
  const Choice& choice;
  const Tolerances tolerances;
  const Kernels& kernels;
};

// Every branch at one value; a bit for each branch.
struct RedundantSample {
  static constexpr int DOF = 7;
  double value;
  unsigned exact, verified, inside;
  bool singular, stretched;
  double margin[MAX_BRANCHES], distance[MAX_BRANCHES];  // from the limits (RedundantBlock), from the seed
  double q[MAX_BRANCHES][DOF];
};

class RedundantSampler {
 public:
  explicit RedundantSampler(const RedundantCall& call) : call_(call) {}

  // The pose, and what its windings are nearest to.
  void aim(const double* T, const double* seed, const std::vector<double>& reference) {
    T_ = T;
    seed_ = seed;
    reference_ = reference.data();
    evaluations = 0;
  }

  // The tail of a pack repeats the last value.
  void samples(const double* values, int count, RedundantSample* out);
  // The branches of one value, all lanes alike.
  const RedundantBlock& block(double value, const FreeDirections* free = nullptr);
  // A branch of the first of the last samples.
  Candidate last(int branch) const;
  Candidate candidate(double value, int branch);
  // Representatives of the continua at a value where the slots' directions are free.
  std::vector<Candidate> continuum(double value, unsigned slots);

  std::int64_t evaluations = 0;

 private:
  void run(const double* values, int count, const FreeDirections* free);
  void read(double value, int lane, RedundantSample& s) const;

  const RedundantCall& call_;
  const double* T_ = nullptr;
  const double* seed_ = nullptr;
  const double* reference_ = nullptr;
  RedundantBlock block_;
};

}  // namespace kinverse
