#include "general_6r_trials.hpp"

#include <algorithm>
#include <cmath>
#include <memory>
#include <numeric>

#include "dispatch.hpp"
#include "general_6r_roots.hpp"
#include "random.hpp"

namespace kinverse {
namespace {

// Eliminations of one arm, tried on random poses of it.
class Trials {
 public:
  struct Entry {
    Elimination elimination;
    int loop;
    double disturbance;
    std::vector<int> held;  // solutions found of each pose
    double weak = 0.0, cost = 0.0;
  };

  Trials(const Chain& chain, double size, double exact)
      : chain_(chain), size_(size), tolerances_{1e-6, 1e-6, exact, exact, false}, kernels_(active_kernels()) {}

  // best first, once some were kept
  const std::vector<std::unique_ptr<Entry>>& entries() const { return entries_; }

  // One elimination more, if the arm has it; it catches up on the poses tried.
  void enter(int loop, double disturbance, unsigned level) {
    auto entry = std::make_unique<Entry>();
    entry->loop = loop;
    entry->disturbance = disturbance;
    if (!make_elimination(chain_, size_, loop, disturbance, level * LOOPS + static_cast<unsigned>(loop) + 1, entry->elimination))
      return;
    for (Trial& trial : trials_) attempt(*entry, trial);
    entries_.push_back(std::move(entry));
  }
  void run(int count) {
    for (int t = 0; t < count; ++t) {
      double q[6];
      random_joints(chain_, random_, q);
      trials_.emplace_back(chain_, size_);
      Trial& trial = trials_.back();
      kernels_.forward(chain_, q, 1, trial.T);
      // the one solution that is known: no elimination may miss it
      RootBlock block;
      kernels_.general_6r_polish(chain_, size_, tolerances_, trial.T, middle_, q, 1, block);
      trial.found.merge(block);
      for (auto& entry : entries_) attempt(*entry, trial);
    }
  }
  // How many eliminations found everything, and could tell.
  size_t sound() const {
    return static_cast<size_t>(std::count_if(entries_.begin(), entries_.end(),
                                             [&](const auto& entry) { return entry->weak == 0.0 && missed(*entry) == 0; }));
  }
  void keep_best(size_t most) {
    std::stable_sort(entries_.begin(), entries_.end(),
                     [&](const auto& a, const auto& b) { return score(*a) < score(*b); });
    if (entries_.size() > most) entries_.resize(most);
  }
  void keep_best_of_loops() {
    keep_best(entries_.size());
    bool seen[LOOPS] = {};
    std::erase_if(entries_, [&](const auto& entry) { return std::exchange(seen[entry->loop], true); });
  }
  double recall(const Entry& entry) const {
    const int found = std::accumulate(entry.held.begin(), entry.held.end(), 0);
    return found / std::max(1.0, static_cast<double>(found + missed(entry)));
  }

 private:
  struct Trial {
    Trial(const Chain& chain, double size) : found(chain, size) { found.clear(); }
    double T[16];
    RootSet found;  // by any elimination
  };

  void attempt(Entry& entry, Trial& trial) {
    const Elimination& e = entry.elimination;
    const General6R arm{1, size_, &e, &trig_tables()};
    RootBlock block;
    kernels_.general_6r_pose(chain_, arm, 0, tolerances_, trial.T, middle_, block);
    trial.found.merge(block);
    RootSet own(chain_, size_);
    own.clear();
    own.merge(block);
    entry.held.push_back(own.exact());
    entry.weak += is_weak(e, block, own.exact());
    // all else equal: little disturbance, little noise, roots well apart, one pack of them
    entry.cost += (e.disturbance > 0.0 ? 0.02 : 0.0) + std::sqrt(e.disturbance) +
                  0.01 * std::max(0.0, std::log10(block.noise + 1e-17) + 10.0) + 0.002 * (block.candidates > 8) +
                  0.05 * std::max(0.0, -2.0 - std::log10(std::min(block.gap, block.off_circle) + 1e-9));
  }
  int missed(const Entry& entry) const {
    int sum = 0;
    for (size_t t = 0; t < entry.held.size(); ++t) sum += std::max(0, trials_[t].found.exact() - entry.held[t]);
    return sum;
  }
  double score(const Entry& entry) const { return missed(entry) + 0.3 * entry.weak + entry.cost; }

  const Chain& chain_;
  double size_;
  const Tolerances tolerances_;
  const Kernels& kernels_;
  const double middle_[6] = {};
  Random random_{0x6a};
  std::vector<Trial> trials_;
  std::vector<std::unique_ptr<Entry>> entries_;
};

}  // namespace

ChosenEliminations choose_eliminations(const Chain& chain, double size, double exact) {
  constexpr double DISTURBANCES[] = {0.0, 1e-6, 1e-5};
  // trials with all eliminations, with the best of each loop, and with the best few of these
  constexpr int FIRST = 3, SECOND = 6, THIRD = 16;
  constexpr size_t KEPT = 3, FINALISTS = 4;
  Trials trials(chain, size, exact);
  for (int loop = 0; loop < LOOPS; ++loop) trials.enter(loop, DISTURBANCES[0], 0);
  trials.run(FIRST);
  if (trials.sound() < KEPT)
    for (unsigned k = 1; k < std::size(DISTURBANCES); ++k)
      for (int loop = 0; loop < LOOPS; ++loop) trials.enter(loop, DISTURBANCES[k], k);
  trials.keep_best_of_loops();
  trials.run(SECOND);
  trials.keep_best(FINALISTS);
  trials.run(THIRD);
  trials.keep_best(KEPT);
  ChosenEliminations chosen;
  for (const auto& entry : trials.entries()) {
    if (chosen.eliminations.empty()) chosen.recall = trials.recall(*entry);
    chosen.eliminations.push_back(entry->elimination);
    chosen.kept.emplace_back(entry->loop, entry->disturbance);
  }
  return chosen;
}

}  // namespace kinverse
