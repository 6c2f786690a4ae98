// Solutions of singular poses: a vector that fixes an angle vanishes, so the angle is free and the
// solutions form a continuum, or, when other conditions remain, a few points of one.
#pragma once

#include <functional>
#include <vector>

#include "kernels.hpp"
#include "verify.hpp"

namespace kinverse {

// One pose whose branches depend on free directions.
struct ContinuumProblem {
  Chain chain;
  int lanes, branches;
  bool hold_limits;
  // all branches of lane 0..used-1, each with its own directions
  std::function<void(const FreeDirections& free, int used, std::vector<Candidate>* of_lane)> evaluate;
};

// Branch `branch` in lane `lane` of a block with poses in its lanes.
template <class Block>
Candidate candidate_from(const Block& block, int dof, int branch, int lane) {
  auto bit = [&](const unsigned* bits) { return (bits[branch] >> lane & 1u) != 0; };
  Candidate c{{}, block.value[branch][dof][lane], block.value[branch][dof + 1][lane], branch, bit(block.inside),
              bit(block.verified), true, bit(block.exact)};
  for (int j = 0; j < dof; ++j) c.q.push_back(block.value[branch][j][lane]);
  return c;
}

// For every branch the member of the continuum that is verified, lies inside the limits if any does,
// and is nearest to the reference; where no member of a coarse round is verified, every point to which
// the error descends. `slots` has a bit for each free angle.
std::vector<Candidate> representatives(const ContinuumProblem& problem, const std::vector<double>& reference,
                                       unsigned slots);

}  // namespace kinverse
