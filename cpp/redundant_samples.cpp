#include "redundant_samples.hpp"

#include <algorithm>
#include <cmath>

namespace kinverse {

constexpr int DOF = RedundantSample::DOF;

void RedundantSampler::samples(const double* values, int count, RedundantSample* out) {
  for (int first = 0; first < count; first += call_.kernels.lanes) {
    run(values + first, std::min(call_.kernels.lanes, count - first), nullptr);
    for (int l = 0; l < call_.kernels.lanes && first + l < count; ++l) read(values[first + l], l, out[first + l]);
  }
}

const RedundantBlock& RedundantSampler::block(double value, const FreeDirections* free) {
  run(&value, 1, free);
  return block_;
}

Candidate RedundantSampler::last(int branch) const { return candidate_from(block_, DOF, branch, 0); }

Candidate RedundantSampler::candidate(double value, int branch) {
  return candidate_from(block(value), DOF, branch, 0);
}

std::vector<Candidate> RedundantSampler::continuum(double value, unsigned slots) {
  auto evaluate = [&](const FreeDirections& free, int used, std::vector<Candidate>* of_lane) {
    block(value, &free);
    for (int l = 0; l < used; ++l) {
      of_lane[l].clear();
      for (int b = 0; b < MAX_BRANCHES; ++b) of_lane[l].push_back(candidate_from(block_, DOF, b, l));
    }
  };
  return representatives({call_.chain, call_.kernels.lanes, MAX_BRANCHES, call_.tolerances.hold_limits, evaluate},
                         {reference_, reference_ + DOF}, slots);
}

void RedundantSampler::run(const double* values, int count, const FreeDirections* free) {
  const double *rows[WIDEST], *references[WIDEST];
  alignas(64) double held[WIDEST];
  for (int l = 0; l < WIDEST; ++l) {
    rows[l] = T_;
    references[l] = reference_;
    held[l] = values[std::min(l, count - 1)];
  }
  call_.kernels.redundant(call_.chain, call_.spec, call_.tolerances, rows, held, references, free, block_);
  evaluations += MAX_BRANCHES * count;
}

void RedundantSampler::read(double value, int lane, RedundantSample& s) const {
  s = {value, 0, 0, 0, (block_.singular >> lane & 1u) != 0, (block_.stretched >> lane & 1u) != 0, {}, {}, {}};
  for (int b = 0; b < MAX_BRANCHES; ++b) {
    s.exact |= (block_.exact[b] >> lane & 1u) << b;
    s.verified |= (block_.verified[b] >> lane & 1u) << b;
    s.inside |= (block_.inside[b] >> lane & 1u) << b;
    s.margin[b] = block_.margin[b][lane];
    for (int j = 0; j < DOF; ++j) s.q[b][j] = block_.value[b][j][lane];
    if (!seed_) continue;
    for (int j = 0; j < DOF; ++j)
      s.distance[b] = std::max(s.distance[b], std::fabs(s.q[b][j] - seed_[j]));
  }
}

}  // namespace kinverse
