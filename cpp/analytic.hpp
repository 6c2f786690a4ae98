// The closed form of one arm, solved and verified in one go.
#pragma once

#include "closed_form_spec.hpp"
#include "verify.hpp"

namespace kinverse {

class Analytic {
 public:
  Analytic(OwnedChain chain, const ClosedFormSpec& spec) : chain_(std::move(chain)), spec_(spec) {}

  const OwnedChain& chain() const { return chain_; }
  const ClosedFormSpec& spec() const { return spec_; }

  // T (poses, 16), checked; choice.all_windings is not for this path.
  Table solve(const double* T, long poses, const Seeds& seeds, const Choice& choice) const;
  // The branches unverified, as they come.
  Candidates propose(const double* T, long poses, const Seeds& seeds, const Choice& choice) const;

 private:
  OwnedChain chain_;
  ClosedFormSpec spec_;
};

}  // namespace kinverse
