// An arm with seven joints: all branches at a value of its free parameter, or the ranges of the
// parameter in which a branch exists inside the limits.
#pragma once

#include "closed_form_spec.hpp"
#include "verify.hpp"

namespace kinverse {

class Redundant {
 public:
  // `exact`: the error [m, rad] that rounding, and the fit of the closed form to the chain, explain.
  Redundant(OwnedChain chain, const RedundantSpec& spec, double exact)
      : chain_(std::move(chain)), spec_(spec), exact_(exact) {}

  const OwnedChain& chain() const { return chain_; }

  // T (poses, 16), checked. Per pose every interval of every branch, and one solution of each: the
  // nearest to the seed, else the middle.
  Table solve(const double* T, long poses, const Seeds& seeds, const Choice& choice) const;
  // All branches of pose i at value[i].
  Table solve_at(const double* T, const double* value, long poses, const Seeds& seeds, const Choice& choice) const;

 private:
  OwnedChain chain_;
  RedundantSpec spec_;
  double exact_;
};

}  // namespace kinverse
