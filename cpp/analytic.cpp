#include "analytic.hpp"

#include <algorithm>
#include <cmath>

#include "continuum.hpp"
#include "table_parts.hpp"

namespace kinverse {
namespace {

// A bit for each branch of one pose.
struct Found {
  unsigned exact = 0, verified = 0, inside = 0;
  unsigned free_slots = 0;  // a bit for each direction that is free
  bool near = false, weak = false;
};

Found found_in(const BranchBlock& block) {
  Found found{block.exact[0], block.verified[0], block.inside[0], 0, block.near != 0, block.weak != 0};
  for (int slot = 0; slot < FREE_SLOTS; ++slot) found.free_slots |= (block.free_slot[slot] ? 1u : 0u) << slot;
  return found;
}

// One pass over a part of the poses.
class Pass {
 public:
  Pass(const Chain& chain, const ClosedFormSpec& spec, const Choice& choice, Table& table)
      : chain_(chain),
        spec_(spec),
        choice_(choice),
        tolerances_(tolerances_of(choice, choice.exact)),
        kernels_(active_kernels()),
        middle_(winding_reference(chain, nullptr, true)),
        table_(table) {}

  void run(const double* T, long poses, const Seeds& seeds) {
    const int lanes = kernels_.lanes;
    std::vector<std::vector<double>> clamped(static_cast<size_t>(lanes));
    BranchBlock block;
    long pose = 0;
    for (; pose + lanes <= poses; pose += lanes) {
      const double *rows[WIDEST], *references[WIDEST];
      for (int l = 0; l < lanes; ++l) {
        rows[l] = T + 16 * (pose + l);
        references[l] = reference(seeds.of(pose + l, chain_.dof), clamped[static_cast<size_t>(l)]);
      }
      kernels_.closed_form_poses(chain_, spec_, tolerances_, rows, references, nullptr, block);
      for (int l = 0; l < lanes; ++l) {
        Found found{};
        for (int b = 0; b < spec_.branches; ++b) {
          found.exact |= (block.exact[b] >> l & 1u) << b;
          found.verified |= (block.verified[b] >> l & 1u) << b;
          found.inside |= (block.inside[b] >> l & 1u) << b;
        }
        found.near = (block.near >> l & 1u) != 0;
        found.weak = (block.weak >> l & 1u) != 0;
        for (int slot = 0; slot < FREE_SLOTS; ++slot) found.free_slots |= (block.free_slot[slot] >> l & 1u) << slot;
        finish(rows[l], seeds.of(pose + l, chain_.dof), &block.value[0][0][l], 8 * WIDEST, found);
      }
    }
    for (; pose < poses; ++pose) {
      const double* row = T + 16 * pose;
      const double* seed = seeds.of(pose, chain_.dof);
      kernels_.closed_form_pose(chain_, spec_, tolerances_, row, reference(seed, clamped[0]), block);
      finish(row, seed, &block.value[0][0][0], 1, found_in(block));
    }
  }

  // all branches of one pose, as they are
  std::vector<Candidate> propose(const double* T, const double* seed, bool& singular) const {
    BranchBlock block;
    std::vector<double> storage;
    kernels_.closed_form_pose(chain_, spec_, tolerances_, T, reference(seed, storage), block);
    const Found found = found_in(block);
    singular = found.free_slots != 0;
    return all_branches(T, seed, &block.value[0][0][0], 1, found);
  }
  bool is_unreachable(const double* T) const { return kernels_.closed_form_unreachable(spec_, tolerances_, T); }

 private:
  const double* reference(const double* seed, std::vector<double>& storage) const {
    if (!seed) return middle_.data();
    storage = winding_reference(chain_, seed, choice_.hold_limits);
    return storage.data();
  }

  // value[k * WIDEST + branch * step]: joint k, then the two errors
  Solution solution(const double* value, long step, int branch) const {
    const double* q = value + branch * step;
    return {q, q[chain_.dof * WIDEST], q[(chain_.dof + 1) * WIDEST], branch, WIDEST};
  }

  void finish(const double* T, const double* seed, const double* value, long step, const Found& found) {
    const unsigned usable = choice_.hold_limits ? found.exact & found.inside : found.exact;
    if (usable && !found.near && !found.free_slots) {
      if (seed)
        table_.add_nearest_first(usable, seed, [&](int b) { return solution(value, step, b); });
      else
        table_.add_branches<WIDEST>(value, step, usable);
      table_.end_pose(Status::solved, false);
      return;
    }
    std::vector<Candidate> candidates = all_branches(T, seed, value, step, found);
    const bool any = std::any_of(candidates.begin(), candidates.end(), [](const Candidate& c) { return c.verified; });
    PoseFacts facts{T, seed};
    if (!any && is_unreachable(T)) facts.unsolved = Status::unreachable;
    facts.singular = found.free_slots && any;
    facts.representative = found.free_slots || found.weak;
    finish_pose(chain_, choice_, candidates, facts, table_);
  }

  std::vector<Candidate> all_branches(const double* T, const double* seed, const double* value, long step,
                                      const Found& found) const {
    if (found.free_slots)
      return continuum(T, winding_reference(chain_, seed, choice_.hold_limits), found.free_slots);
    std::vector<Candidate> candidates;
    for (int b = 0; b < spec_.branches; ++b) {
      const Solution s = solution(value, step, b);
      auto has = [&](unsigned bits) { return (bits >> b & 1u) != 0; };
      candidates.push_back({{}, s.position_error, s.rotation_error, b, has(found.inside), has(found.verified)});
      for (int j = 0; j < chain_.dof; ++j) candidates.back().q.push_back(s.q[j * s.stride]);
    }
    return candidates;
  }

  std::vector<Candidate> continuum(const double* T, const std::vector<double>& reference, unsigned slots) const {
    auto evaluate = [&](const FreeDirections& free, int used, std::vector<Candidate>* of_lane) {
      const double *rows[WIDEST], *references[WIDEST];
      std::fill_n(rows, WIDEST, T);
      std::fill_n(references, WIDEST, reference.data());
      BranchBlock block;
      kernels_.closed_form_poses(chain_, spec_, tolerances_, rows, references, &free, block);
      for (int l = 0; l < used; ++l) {
        of_lane[l].clear();
        for (int b = 0; b < spec_.branches; ++b) of_lane[l].push_back(candidate_from(block, chain_.dof, b, l));
      }
    };
    return representatives({chain_, kernels_.lanes, spec_.branches, choice_.hold_limits, evaluate}, reference, slots);
  }

  const Chain chain_;
  const ClosedFormSpec& spec_;
  const Choice& choice_;
  const Tolerances tolerances_;
  const Kernels& kernels_;
  const std::vector<double> middle_;
  Table& table_;
};

}  // namespace

Table Analytic::solve(const double* T, long poses, const Seeds& seeds, const Choice& choice) const {
  const int dof = spec_.dof;
  Table table = in_parts(dof, poses, 512, spec_.branches, [&](Table& part, long first, long last) {
    Pass(chain_.view(), spec_, choice, part).run(T + 16 * first, last - first, seeds.from(first, dof));
  });
  table.evaluations_each = spec_.branches;
  table.method = Ground::closed_form;
  return table;
}

Candidates Analytic::propose(const double* T, long poses, const Seeds& seeds, const Choice& choice) const {
  Table unused(spec_.dof, 0, 0);
  const Pass pass(chain_.view(), spec_, choice, unused);
  Candidates all;
  for (long pose = 0; pose < poses; ++pose) {
    const double* row = T + 16 * pose;
    bool singular = false;
    for (const Candidate& c : pass.propose(row, seeds.of(pose, spec_.dof), singular))
      all.add(pose, c.q.data(), spec_.dof, c.branch);
    const bool unreachable = pass.is_unreachable(row);
    all.hint.push_back(static_cast<std::uint8_t>(unreachable ? Status::unreachable : Status::not_found));
    Evidence& evidence = all.evidence.emplace_back();
    evidence.method = unreachable ? Ground::bounds : Ground::closed_form;
    evidence.weak = false;
    all.singular.push_back(singular);
  }
  return all;
}

}  // namespace kinverse
