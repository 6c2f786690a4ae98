// Six joints of any kind: every solution by elimination, with evidence of completeness.
#pragma once

#include "general_6r_trials.hpp"
#include "verify.hpp"

namespace kinverse {

class General6RSolver {
 public:
  // Tries every elimination on configurations of this arm and keeps the best.
  // `exact`: the error [m, rad] that rounding explains.
  General6RSolver(OwnedChain chain, double exact);

  const OwnedChain& chain() const { return chain_; }
  // how many of the solutions of the trial poses the first elimination found, 0..1
  double recall() const { return chosen_.recall; }
  // which eliminations were kept: loop and disturbance
  const std::vector<std::pair<int, double>>& kept() const { return chosen_.kept; }

  // T (poses, 16), checked; choice.all_windings is not for this path.
  Table solve(const double* T, long poses, const Seeds& seeds, const Choice& choice) const;
  // The solutions unverified; of a pose without any, the nearest miss.
  Candidates propose(const double* T, long poses, const Seeds& seeds, const Choice& choice) const;

 private:
  General6R arm() const;

  OwnedChain chain_;
  double exact_, size_;
  ChosenEliminations chosen_;
};

}  // namespace kinverse
