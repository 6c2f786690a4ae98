// Solutions of singular poses: a vector that fixes an angle vanishes, so the angle is free and the
// solutions form a continuum, or, when other conditions remain, a few points of one.
#pragma once

#include <vector>

#include "kernels.hpp"
#include "verify.hpp"

namespace kinverse {

struct ClosedFormCall {
  Chain chain;
  const ClosedFormSpec& spec;
  Tolerances tolerances;
  const Kernels& kernels;
};

// For every branch the member of the continuum that is verified, lies inside the limits if any does,
// and is nearest to the reference; where no member of a coarse round is verified, every point to which
// the error descends. `slots` has a bit for each free angle.
std::vector<Candidate> representatives(const ClosedFormCall& call, const double* T, const std::vector<double>& reference,
                                       unsigned slots);

}  // namespace kinverse
