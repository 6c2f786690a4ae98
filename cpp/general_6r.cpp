#include "general_6r.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <memory>
#include <numeric>
#include <utility>

#include "dispatch.hpp"

namespace kinverse {
namespace {

constexpr double PI = 3.14159265358979323846;
constexpr double TWO_PI = 2.0 * PI;
constexpr double SAME_SOLUTION = 1e-6, VERY_CLOSE = 2e-5, CLOSE = 1e-3;
constexpr double ROUNDING = 2.5e-15, UNFINISHED = 1e-12;  // errors in sizes and radians

// Where the evidence of an elimination is too weak to stand alone.
constexpr double LEAST_OFF_CIRCLE = 1e-3;  // a pair of roots this near the unit circle may be real
constexpr double LEAST_GAP = 1e-5;         // two real roots this close may be one, or three
constexpr double MOST_NOISE = 1e-6;
constexpr double MOST_BLUR = 1e-6;
// UNREACHABLE is said if in one elimination every root is farther off the unit circle than this and
// than what the tolerances and the disturbance can move a double root, and nothing contradicts it.
constexpr double MARGIN = 0.02;

using Joints = std::array<double, 6>;

struct Root {
  Joints q;
  double position_error, rotation_error;
  bool exact, verified, inside, singular;
};

// One pose: the union of what several eliminations find.
class Pose {
 public:
  Pose(const Chain& chain, double size) : chain_(chain), size_(size) {}

  void clear() {
    count_ = 0;
    moved_ = false;
    best_error_ = 1e300;
  }
  int count() const { return count_; }
  const Root& operator[](int i) const { return root_[i]; }
  const Root& best() const { return best_; }
  bool has_best() const { return best_error_ < 1e300; }
  int exact() const {
    return static_cast<int>(std::count_if(root_, root_ + count_, [](const Root& r) { return r.exact; }));
  }

  double distance(const double* a, const double* b) const {
    double largest = 0.0;
    for (int i = 0; i < 6; ++i) {
      const int j = chain_.source[i];
      double d = std::fabs(a[j] - b[j]);
      if (chain_.prismatic[i])
        d /= size_;
      else if (d > PI)
        d = std::fabs(std::remainder(d, TWO_PI));
      largest = std::max(largest, d);
    }
    return largest;
  }

  void merge(const RootBlock& block) {
    for (int k = 0; k < block.candidates; ++k) {
      Root r;
      for (size_t j = 0; j < 6; ++j) r.q[j] = block.value[j][k];
      r.position_error = block.value[6][k];
      r.rotation_error = block.value[7][k];
      const double error = std::max(r.position_error, r.rotation_error);
      if (!(error < 1e300)) continue;
      r.exact = block.exact >> k & 1u;
      r.verified = block.verified >> k & 1u;
      r.inside = block.inside >> k & 1u;
      r.singular = block.singular >> k & 1u;
      if (error < best_error_) {
        best_error_ = error;
        best_ = r;
      }
      if (!r.verified) continue;
      int same = 0;
      while (same < count_ && !are_same(root_[same], r)) ++same;
      if (same < count_) {
        const Root& held = root_[same];
        if (error < std::max(held.position_error, held.rotation_error)) {
          root_[same] = r;
          moved_ = true;
        }
      } else if (count_ < MOST) {
        root_[count_++] = r;
      }
    }
  }

  // Branches are numbered by the angle of joint `first`, then by the others. A root that just misses
  // counts only for a pose that has no exact one.
  void finish(int first) {
    if (exact())
      count_ = static_cast<int>(std::remove_if(root_, root_ + count_, [](const Root& r) { return !r.exact; }) - root_);
    if (moved_) unite();
    auto key = [&](const Root& r, int k) {
      const int i = k == 0 ? first : k - 1, j = chain_.source[i];
      return chain_.prismatic[i] ? r.q[static_cast<size_t>(j)] : std::remainder(r.q[static_cast<size_t>(j)], TWO_PI);
    };
    std::sort(root_, root_ + count_, [&](const Root& a, const Root& b) {
      for (int k = 0; k < 7; ++k)
        if (key(a, k) != key(b, k)) return key(a, k) < key(b, k);
      return false;
    });
    count_ = std::min(count_, MAX_ROOTS);
  }

 private:
  // A root that a better one replaced may have come to lie on another.
  void unite() {
    std::sort(root_, root_ + count_, [](const Root& a, const Root& b) {
      return std::max(a.position_error, a.rotation_error) < std::max(b.position_error, b.rotation_error);
    });
    int kept = 0;
    for (int k = 0; k < count_; ++k) {
      int same = 0;
      while (same < kept && !are_same(root_[same], root_[k])) ++same;
      if (same == kept) root_[kept++] = root_[k];
    }
    count_ = kept;
  }

  // Near a double root the error hardly changes, and the iteration ends anywhere in some stretch. A
  // root that is one of its own is left with rounding only; what is not belongs to the one close by.
  bool are_same(const Root& a, const Root& b) const {
    const double d = distance(a.q.data(), b.q.data());
    if (d < SAME_SOLUTION || d > CLOSE) return d < SAME_SOLUTION;
    const double left = std::max(std::max(a.position_error, b.position_error) / size_,
                                 std::max(a.rotation_error, b.rotation_error));
    return left > (d < VERY_CLOSE ? ROUNDING : UNFINISHED);
  }

  static constexpr int MOST = 64;  // a pose on a continuum has any number of solutions
  const Chain& chain_;
  double size_;
  Root root_[MOST], best_{};
  double best_error_ = 1e300;
  int count_ = 0;
  bool moved_ = false;
};

// A disturbance moves double roots by its square root.
bool is_weak(const Elimination& e, const RootBlock& block, int distinct) {
  const double off_circle = std::max(LEAST_OFF_CIRCLE, 2.0 * std::sqrt(e.disturbance));
  return block.real != distinct || (block.real & 1) || block.strayed || block.off_circle < off_circle || block.gap < LEAST_GAP ||
         !(block.noise < MOST_NOISE) || !(block.blur < MOST_BLUR);
}

class Random {
 public:
  explicit Random(std::uint64_t seed) : state_(seed) {}
  double uniform(double low, double high) {
    std::uint64_t z = (state_ += 0x9e3779b97f4a7c15ULL);
    z = (z ^ (z >> 30)) * 0xbf58476d1ce4e5b9ULL;
    z = (z ^ (z >> 27)) * 0x94d049bb133111ebULL;
    z ^= z >> 31;
    return low + (high - low) * static_cast<double>(z >> 11) * 0x1p-53;
  }

 private:
  std::uint64_t state_;
};

// The straight length of the links behind the first joint; without end where a joint slides.
double arm_reach(const Chain& chain) {
  double reach = 0.0;
  for (int i = 1; i <= 6; ++i) {
    const double* m = chain.frames + 12 * i;
    reach += std::sqrt(m[3] * m[3] + m[7] * m[7] + m[11] * m[11]);
  }
  for (int i = 0; i < 6; ++i)
    if (chain.prismatic[i]) reach = std::numeric_limits<double>::infinity();
  return reach;
}

// Joint values for trials and starts: any angle, slides in their limits.
void random_joints(const Chain& chain, Random& random, double* q) {
  for (int i = 0; i < 6; ++i) {
    const int j = chain.source[i];
    q[j] = chain.prismatic[i] ? random.uniform(chain.lower[j], chain.upper[j]) : random.uniform(-PI, PI);
  }
}

class Pass {
 public:
  Pass(const Chain& chain, const General6R& arm, double exact, const Choice& choice)
      : chain_(chain),
        arm_(arm),
        choice_(choice),
        tolerances_{choice.tol_position, choice.tol_rotation, std::min(exact, choice.tol_position),
                    std::min(exact, choice.tol_rotation), choice.hold_limits},
        kernels_(active_kernels()),
        middle_(winding_reference(chain, nullptr, true)),
        reach_(arm_reach(chain)),
        pose_(chain_, arm.size) {}
  Pass(const Pass&) = delete;

  // All solutions of one pose; returns what an empty answer means. The evidence is that of the
  // elimination that was trusted (that showed there is nothing), or of the first if none was.
  Status find(const double* T, const double* seed, Evidence& evidence) {
    const double* reference = middle_.data();
    if (seed) {
      storage_ = winding_reference(chain_, seed, choice_.hold_limits);
      reference = storage_.data();
    }
    pose_.clear();
    polished_ = 0;
    evidence = Evidence{};
    if (is_beyond_reach(T)) {
      evidence.method = Ground::bounds;
      evidence.weak = false;
      return Status::unreachable;
    }
    evidence.method = arm_.eliminations ? Ground::elimination : Ground::search;
    bool shown = false;
    for (int k = 0; k < arm_.eliminations; ++k) {
      RootBlock block;
      kernels_.general_6r_pose(chain_, arm_, k, tolerances_, T, reference, block);
      pose_.merge(block);
      polished_ += block.candidates;
      const bool weak = is_weak(arm_.elimination[k], block, pose_.exact());
      const double moved = std::max(tolerances_.position / arm_.size, tolerances_.rotation);
      const double margin = std::max({MARGIN, 20.0 * std::sqrt(moved), 100.0 * std::sqrt(arm_.elimination[k].disturbance)});
      const bool shows = !weak && !block.real && block.off_circle > margin && block.blur < 0.1 * margin;
      if (k == 0 || (evidence.weak && !weak) || (shows && !shown)) {
        evidence.root_gap = block.gap;
        evidence.root_margin = block.complex ? block.off_circle : std::numeric_limits<double>::infinity();
        evidence.real_roots = block.real;
        evidence.complex_roots = block.complex;
        evidence.weak = weak;
      }
      shown = shown || shows;
      // that there is nothing at all is not left to one elimination
      if (!weak && (pose_.count() || k > 0)) break;
    }
    if (evidence.weak || !pose_.exact()) polished_ += search(T, reference);
    pose_.finish(arm_.eliminations ? arm_.elimination[0].joint[C] : 0);
    if (shown && !pose_.count()) return Status::unreachable;
    evidence.weak = evidence.weak || !pose_.count();
    return Status::not_found;
  }
  // starts of the Newton iteration for the last pose
  int polished() const { return polished_; }

  const Pose& pose() const { return pose_; }

  void run(const double* T, long poses, const Seeds& seeds, Table& table) {
    for (long i = 0; i < poses; ++i) {
      const double* seed = seeds.of(i, 6);
      Evidence evidence;
      const Status unsolved = find(T + 16 * i, seed, evidence);
      write(seed, unsolved, table);
      table.evaluations.push(polished_);
      table.evidence.push(evidence);
    }
  }

 private:
  // Farther from the first joint than all links in a straight line.
  bool is_beyond_reach(const double* T) const {
    double d2 = 0.0;
    for (int k = 0; k < 3; ++k) {
      const double d = T[4 * k + 3] - chain_.frames[4 * k + 3];
      d2 += d * d;
    }
    return d2 > std::pow(reach_ * (1.0 + 1e-12) + tolerances_.position, 2);
  }

  // Starts around what is there, for solutions close together, and random ones. Adds, never takes.
  int search(const double* T, const double* reference) {
    constexpr int ROUNDS = 4, MORE_ROUNDS = 8;
    constexpr double WIDTHS[] = {0.001, 0.01, 0.03, 0.1};
    Random random(0xada);
    int round = 0;
    for (; round < ROUNDS || (round < MORE_ROUNDS && pose_.count() && !pose_.exact()); ++round) {
      double starts[MAX_ROOTS][6];
      const int held = pose_.count();
      for (auto& start : starts) random_joints(chain_, random, start);
      if (round != 1 && round != 3 && held)
        for (int k = 0; k < MAX_ROOTS; ++k) {
          const double width = WIDTHS[(k / held + round) % 4];
          for (int i = 0; i < 6; ++i) {
            const int j = chain_.source[i];
            starts[k][j] = pose_[k % held].q[static_cast<size_t>(j)] +
                           random.uniform(-width, width) * (chain_.prismatic[i] ? arm_.size : 1.0);
          }
        }
      RootBlock block;
      kernels_.general_6r_polish(chain_, arm_.size, tolerances_, T, reference, starts[0], MAX_ROOTS, block);
      pose_.merge(block);
    }
    return round * MAX_ROOTS;
  }

  void write(const double* seed, Status unsolved, Table& table) {
    int order[MAX_ROOTS], count = 0;
    double key[MAX_ROOTS];
    bool singular = false;
    for (int b = 0; b < pose_.count(); ++b) {
      const Root& r = pose_[b];
      unsolved = Status::out_of_limits;
      if (choice_.hold_limits && !r.inside) continue;
      singular = singular || r.singular;
      double largest = 0.0;
      if (seed)
        for (size_t j = 0; j < 6; ++j) largest = std::max(largest, std::fabs(r.q[j] - seed[j]));
      int at = count++;
      for (; at > 0 && key[at - 1] > largest; --at) {
        key[at] = key[at - 1];
        order[at] = order[at - 1];
      }
      key[at] = largest;
      order[at] = b;
    }
    for (int k = 0; k < count; ++k) {
      const Root& r = pose_[order[k]];
      table.add({r.q.data(), r.position_error, r.rotation_error, order[k], 1});
    }
    if (!count && pose_.has_best()) {
      const Root& r = pose_.best();
      table.add_best({r.q.data(), r.position_error, r.rotation_error, -1, 1});
    }
    table.end_pose(unsolved, singular);
  }

  const Chain chain_;
  const General6R& arm_;
  const Choice& choice_;
  const Tolerances tolerances_;
  const Kernels& kernels_;
  const std::vector<double> middle_;
  std::vector<double> storage_;
  const double reach_;
  int polished_ = 0;
  Pose pose_;
};

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
    Pose found;  // by any elimination
  };

  void attempt(Entry& entry, Trial& trial) {
    const Elimination& e = entry.elimination;
    const General6R arm{1, size_, &e, &trig_tables()};
    RootBlock block;
    kernels_.general_6r_pose(chain_, arm, 0, tolerances_, trial.T, middle_, block);
    trial.found.merge(block);
    Pose own(chain_, size_);
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

General6RSolver::General6RSolver(OwnedChain chain, double exact)
    : chain_(std::move(chain)), exact_(exact), size_(arm_size(chain_.view())) {
  choose();
}

void General6RSolver::choose() {
  constexpr double DISTURBANCES[] = {0.0, 1e-6, 1e-5};
  // trials with all eliminations, with the best of each loop, and with the best few of these
  constexpr int FIRST = 3, SECOND = 6, THIRD = 16;
  constexpr size_t KEPT = 3, FINALISTS = 4;
  const Chain chain = chain_.view();
  Trials trials(chain, size_, exact_);
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
  for (const auto& entry : trials.entries()) {
    if (eliminations_.empty()) recall_ = trials.recall(*entry);
    eliminations_.push_back(entry->elimination);
    kept_.emplace_back(entry->loop, entry->disturbance);
  }
}

Table General6RSolver::solve(const double* T, long poses, const Seeds& seeds, const Choice& choice) const {
  std::vector<Table> parts;
  const long most_parts = parts_of(poses, 16);
  for (long p = 0; p < most_parts; ++p) parts.emplace_back(6, 0, 0);
  const General6R arm{static_cast<int>(eliminations_.size()), size_, eliminations_.data(), &trig_tables()};
  run_parts(poses, most_parts, [&](long first, long last, long part) {
    Table& table = parts[static_cast<size_t>(part)];
    table = Table(6, last - first, (last - first) * 8);
    Pass(chain_.view(), arm, exact_, choice).run(T + 16 * first, last - first, seeds.from(first, 6), table);
  });
  for (size_t p = 1; p < parts.size(); ++p) parts[0].append(parts[p]);
  return std::move(parts[0]);
}

Candidates General6RSolver::propose(const double* T, long poses, const Seeds& seeds, const Choice& choice) const {
  const General6R arm{static_cast<int>(eliminations_.size()), size_, eliminations_.data(), &trig_tables()};
  Pass pass(chain_.view(), arm, exact_, choice);
  Candidates all;
  for (long i = 0; i < poses; ++i) {
    Evidence& evidence = all.evidence.emplace_back();
    all.hint.push_back(static_cast<std::uint8_t>(pass.find(T + 16 * i, seeds.of(i, 6), evidence)));
    const Pose& found = pass.pose();
    auto add = [&](const Root& r, int branch) {
      all.q.insert(all.q.end(), r.q.begin(), r.q.end());
      all.pose_index.push_back(i);
      all.branch.push_back(branch);
    };
    bool singular = false;
    for (int b = 0; b < found.count(); ++b) {
      add(found[b], b);
      singular = singular || found[b].singular;
    }
    if (!found.count() && found.has_best()) add(found.best(), -1);
    all.singular.push_back(singular);
  }
  return all;
}

}  // namespace kinverse
