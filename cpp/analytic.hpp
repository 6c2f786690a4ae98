// The closed form of one arm, solved and verified in one go.
#pragma once

#include "closed_form_spec.hpp"
#include "verify.hpp"

namespace kinverse {

class Analytic {
 public:
  // `exact`: the error [m, rad] that rounding, and the fit of the closed form to the chain, explain.
  Analytic(OwnedChain chain, const ClosedFormSpec& spec, double exact)
      : chain_(std::move(chain)), spec_(spec), exact_(exact) {}

  const OwnedChain& chain() const { return chain_; }
  const ClosedFormSpec& spec() const { return spec_; }

  // T (poses, 16), checked; choice.all_windings is not for this path.
  Table solve(const double* T, long poses, const Seeds& seeds, const Choice& choice) const;
  // The branches unverified, as they come.
  Candidates propose(const double* T, long poses, const Seeds& seeds, const Choice& choice) const;

 private:
  OwnedChain chain_;
  ClosedFormSpec spec_;
  double exact_;
};

}  // namespace kinverse
