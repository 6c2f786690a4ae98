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

int slides(const Chain& chain) {
  return static_cast<int>(std::count_if(chain.prismatic, chain.prismatic + 6, [](std::uint8_t p) { return p != 0; }));
}

// Eliminations of one arm, tried on random poses of it.
class Trials {
 public:
  struct Entry {
    Elimination elimination;
    SlidePair pair;
    int loop;
    double disturbance;
    std::vector<int> held;  // solutions found of each pose
    double weak = 0.0, cost = 0.0;
  };

  Trials(const Chain& chain, double size, double exact)
      : chain_(chain),
        size_(size),
        is_pair_(slides(chain) == 2),
        tolerances_{1e-6, 1e-6, exact, exact, false},
        kernels_(active_kernels()) {}

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
  void enter(const SlidePair& pair) {
    auto entry = std::make_unique<Entry>();
    entry->pair = pair;
    entry->loop = pair.joint[0];
    entry->disturbance = 0.0;
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
      double J[36];
      kernels_.jacobian(chain_, q, 1, J);
      is_deficient_ = is_deficient_ && has_lost_rank(J);
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
  // no pose was regular
  bool is_deficient() const { return is_deficient_; }
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

  // By elimination with the largest pivot left: its last one is zero but for rounding.
  bool has_lost_rank(double* J) const {
    constexpr double LOST = 1e-9;
    auto at = [&](int r, int c) -> double& { return J[6 * r + c]; };
    for (int r = 0; r < 6; ++r)
      for (int i = 0; i < 6; ++i)
        at(r, chain_.source[i]) *= (r < 3 ? 1.0 / size_ : 1.0) * (chain_.prismatic[i] ? size_ : 1.0);
    double first = 0.0;
    for (int k = 0; k < 6; ++k) {
      int row = k, column = k;
      for (int r = k; r < 6; ++r)
        for (int c = k; c < 6; ++c)
          if (std::fabs(at(r, c)) > std::fabs(at(row, column))) row = r, column = c;
      for (int c = 0; c < 6; ++c) std::swap(at(k, c), at(row, c));
      for (int r = 0; r < 6; ++r) std::swap(at(r, k), at(r, column));
      const double pivot = at(k, k);
      if (k == 0) first = std::fabs(pivot);
      if (!(std::fabs(pivot) > LOST * first)) return true;
      for (int r = k + 1; r < 6; ++r) {
        const double factor = at(r, k) / pivot;
        for (int c = k; c < 6; ++c) at(r, c) -= factor * at(k, c);
      }
    }
    return false;
  }

  void attempt(Entry& entry, Trial& trial) {
    const General6R arm{1, false, size_, &entry.elimination, is_pair_ ? &entry.pair : nullptr, &trig_tables()};
    RootBlock block;
    kernels_.general_6r_pose(chain_, arm, 0, tolerances_, trial.T, middle_, block);
    trial.found.merge(block);
    RootSet own(chain_, size_);
    own.clear();
    own.merge(block);
    entry.held.push_back(own.exact());
    entry.weak += is_weak(entry.disturbance, block, own.exact());
    // all else equal: little disturbance, little noise, roots well apart, one pack of them
    entry.cost += (entry.disturbance > 0.0 ? 0.02 : 0.0) + std::sqrt(entry.disturbance) +
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
  const bool is_pair_;
  bool is_deficient_ = true;
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
  const bool is_pair = slides(chain) == 2;
  if (is_pair)
    for (const SlidePair& pair : make_slide_pairs(chain, size)) trials.enter(pair);
  else
    for (int loop = 0; loop < LOOPS; ++loop) trials.enter(loop, DISTURBANCES[0], 0);
  trials.run(FIRST);
  if (!is_pair && trials.sound() < KEPT)
    for (unsigned k = 1; k < std::size(DISTURBANCES); ++k)
      for (int loop = 0; loop < LOOPS; ++loop) trials.enter(loop, DISTURBANCES[k], k);
  trials.keep_best_of_loops();
  trials.run(SECOND);
  trials.keep_best(FINALISTS);
  trials.run(THIRD);
  trials.keep_best(KEPT);
  ChosenEliminations chosen;
  chosen.is_deficient = trials.is_deficient();
  if (chosen.is_deficient) return chosen;
  for (const auto& entry : trials.entries()) {
    if (chosen.kept.empty()) chosen.recall = trials.recall(*entry);
    if (is_pair)
      chosen.pairs.push_back(entry->pair);
    else
      chosen.eliminations.push_back(entry->elimination);
    chosen.kept.emplace_back(entry->loop, entry->disturbance);
  }
  return chosen;
}

}  // namespace kinverse
