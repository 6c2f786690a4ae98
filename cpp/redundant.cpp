#include "redundant.hpp"

#include <algorithm>

#include "redundant_sweep.hpp"
#include "table_parts.hpp"

namespace kinverse {
namespace {

constexpr int DOF = RedundantSample::DOF;

// All branches of pairs of a pose and a value.
class AtValues {
 public:
  AtValues(const RedundantCall& call, Table& table)
      : call_(call), at_(call), middle_(winding_reference(call.chain, nullptr, true)), table_(table) {}

  void run(const double* T, const double* value, long poses, const Seeds& seeds) {
    const int lanes = call_.kernels.lanes;
    std::vector<double> clamped[WIDEST];
    RedundantBlock block;
    for (long first = 0; first < poses; first += lanes) {
      const double *rows[WIDEST], *references[WIDEST];
      alignas(64) double held[WIDEST];
      for (int l = 0; l < lanes; ++l) {
        const long pose = std::min(first + l, poses - 1);
        const double* seed = seeds.of(pose, DOF);
        rows[l] = T + 16 * pose;
        held[l] = value[pose];
        if (seed) clamped[l] = winding_reference(call_.chain, seed, call_.choice.hold_limits);
        references[l] = seed ? clamped[l].data() : middle_.data();
      }
      call_.kernels.redundant(call_.chain, call_.spec, call_.tolerances, rows, held, references, nullptr, block);
      for (int l = 0; l < lanes && first + l < poses; ++l) {
        const double* seed = seeds.of(first + l, DOF);
        unsigned usable = 0;
        for (int b = 0; b < MAX_BRANCHES; ++b)
          usable |= ((call_.choice.hold_limits ? block.exact[b] & block.inside[b] : block.exact[b]) >> l & 1u) << b;
        const bool plain = !((block.near | block.singular) >> l & 1u);
        if (usable && plain) {
          table_.add_nearest_first(usable, seed, [&](int b) -> Solution {
            const auto& value = block.value[b];
            return {&value[0][l], value[DOF][l], value[DOF + 1][l], b, WIDEST};
          });
          table_.end_pose(Status::solved, false);
        } else {
          slow(rows[l], held[l], seed, {references[l], references[l] + DOF}, block, l);
        }
      }
    }
  }

 private:
  void slow(const double* T, double value, const double* seed, const std::vector<double>& reference,
            const RedundantBlock& block, int lane) {
    std::vector<Candidate> candidates;
    bool singular = (block.singular >> lane & 1u) != 0;
    if (singular) {
      at_.aim(T, seed, reference);
      const unsigned slots = at_.block(value).singular_slots;  // those of this pair alone
      candidates = at_.continuum(value, slots);
    } else {
      for (int b = 0; b < MAX_BRANCHES; ++b) candidates.push_back(candidate_from(block, DOF, b, lane));
    }
    const bool any = std::any_of(candidates.begin(), candidates.end(), [](const Candidate& c) { return c.verified; });
    Status unsolved = Status::not_found;
    if (!any && call_.kernels.redundant_unreachable(call_.spec, call_.tolerances, T)) unsolved = Status::unreachable;
    const bool free = singular;
    singular = singular || (block.stretched >> lane & 1u) != 0;
    finish_pose(call_.chain, call_.choice, candidates, {T, seed, unsolved, singular && any, free}, table_);
  }

  const RedundantCall& call_;
  RedundantSampler at_;
  const std::vector<double> middle_;
  Table& table_;
};

}  // namespace

Table Redundant::solve(const double* T, long poses, const Seeds& seeds, const Choice& choice) const {
  Table table = in_parts(DOF, poses, 4, MAX_BRANCHES, [&](Table& part, long first, long last) {
    const RedundantCall call(chain_.view(), spec_, exact_, choice);
    RedundantSweep sweep(call, part);
    for (long pose = first; pose < last; ++pose) sweep.run(T + 16 * pose, seeds.of(pose, DOF));
  });
  table.method = Ground::sweep;
  return table;
}

Table Redundant::solve_at(const double* T, const double* value, long poses, const Seeds& seeds,
                          const Choice& choice) const {
  Table table = in_parts(DOF, poses, 512, MAX_BRANCHES, [&](Table& part, long first, long last) {
    const RedundantCall call(chain_.view(), spec_, exact_, choice);
    AtValues(call, part).run(T + 16 * first, value + first, last - first, seeds.from(first, DOF));
  });
  table.evaluations_each = MAX_BRANCHES;
  table.method = Ground::closed_form;
  return table;
}

}  // namespace kinverse
