#include "general_6r.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include "general_6r_roots.hpp"
#include "random.hpp"
#include "table_parts.hpp"

namespace kinverse {
namespace {

// UNREACHABLE is said if in one elimination every root is farther off the unit circle than this and
// than what the tolerances and the disturbance can move a double root, and nothing contradicts it.
constexpr double MARGIN = 0.02;

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

// One pose after another.
class Pass {
 public:
  Pass(const Chain& chain, const General6R& arm, double exact, const Choice& choice)
      : chain_(chain),
        arm_(arm),
        choice_(choice),
        tolerances_(tolerances_of(choice, exact)),
        kernels_(active_kernels()),
        middle_(winding_reference(chain, nullptr, true)),
        reach_(arm_reach(chain)),
        found_(chain_, arm.size) {}
  Pass(const Pass&) = delete;

  // All solutions of one pose; returns what an empty answer means. The evidence is that of the
  // elimination that was trusted (that showed there is nothing), or of the first if none was.
  Status find(const double* T, const double* seed, Evidence& evidence) {
    const double* reference = middle_.data();
    if (seed) {
      storage_ = winding_reference(chain_, seed, choice_.hold_limits);
      reference = storage_.data();
    }
    found_.clear();
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
      found_.merge(block);
      polished_ += block.candidates;
      const double disturbance = arm_.disturbance(k);
      const bool weak = is_weak(disturbance, block, found_.exact());
      const double moved = std::max(tolerances_.position / arm_.size, tolerances_.rotation);
      const double margin = std::max({MARGIN, 20.0 * std::sqrt(moved), 100.0 * std::sqrt(disturbance), 200.0 * std::sqrt(block.noise)});
      const bool shows = !weak && !block.real && block.off_circle > margin && block.blur < 0.1 * margin;
      // what was said before holds only if it still counts what is found by now
      const bool stands = !evidence.weak && evidence.real_roots == found_.exact();
      if (k == 0 || (!stands && !weak) || (shows && !shown)) {
        evidence.root_gap = block.gap;
        evidence.root_margin = block.complex ? block.off_circle : std::numeric_limits<double>::infinity();
        evidence.real_roots = block.real;
        evidence.complex_roots = block.complex;
        evidence.weak = weak;
      }
      shown = shown || shows;
      // that there is nothing at all is not left to one elimination
      if (!weak && (found_.count() || k > 0)) break;
    }
    const auto is_contradicted = [&] { return arm_.eliminations && evidence.real_roots != found_.exact(); };
    if (evidence.weak || is_contradicted() || !found_.exact()) search(T, reference);
    evidence.weak = evidence.weak || is_contradicted();
    if (choice_.hold_limits && found_.count() && !found_.any_inside() && (evidence.weak || is_singular()))
      search_inside(T, reference);
    if (arm_.is_deficient || found_.count() > MAX_ROOTS) found_.represent(reference);
    found_.finish(arm_.first_joint());
    if (shown && !found_.count()) return Status::unreachable;
    evidence.weak = evidence.weak || !found_.count();
    return Status::not_found;
  }
  // starts of the Newton iteration for the last pose
  int polished() const { return polished_; }

  const RootSet& found() const { return found_; }
  // whether the last pose's solutions stand for more than they are
  bool is_singular() const { return found_.count() && (arm_.is_deficient || found_.any_singular()); }

  void run(const double* T, long poses, const Seeds& seeds, Table& table) {
    for (long i = 0; i < poses; ++i) {
      const double* seed = seeds.of(i, 6);
      Evidence evidence;
      const Status unsolved = find(T + 16 * i, seed, evidence);
      write(T + 16 * i, seed, unsolved, evidence, table);
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

  void polish(const double* T, const double* reference, const double (*starts)[6], RootBlock& block) {
    kernels_.general_6r_polish(chain_, arm_.size, tolerances_, T, reference, starts[0], MAX_ROOTS, block);
    found_.merge(block);
    polished_ += MAX_ROOTS;
  }

  // Starts around what is there, for solutions close together, and random ones. Adds, never takes.
  void search(const double* T, const double* reference) {
    constexpr int ROUNDS = 4, MORE_ROUNDS = 8;
    constexpr double WIDTHS[] = {0.001, 0.01, 0.03, 0.1};
    Random random(0xada);
    for (int round = 0; round < ROUNDS || (round < MORE_ROUNDS && found_.count() && !found_.exact()); ++round) {
      double starts[MAX_ROOTS][6];
      const int held = found_.count();
      for (auto& start : starts) random_joints(chain_, random, start);
      // of a continuum, what is near the seed, then what is inside the limits
      if (arm_.is_deficient)
        for (int k = 0; k < MAX_ROOTS; ++k) random_inside(random, reference, k ? 1.0 : 0.0, starts[k]);
      else if (round != 1 && round != 3 && held)
        for (int k = 0; k < MAX_ROOTS; ++k) {
          const double width = WIDTHS[(k / held + round) % 4];
          for (int i = 0; i < 6; ++i) {
            const int j = chain_.source[i];
            starts[k][j] = found_[k % held].q[static_cast<size_t>(j)] +
                           random.uniform(-width, width) * (chain_.prismatic[i] ? arm_.size : 1.0);
          }
        }
      RootBlock block;
      polish(T, reference, starts, block);
    }
  }

  // Where solutions stand for others: from the limits onto the pose and back, until one holds inside them.
  void search_inside(const double* T, const double* reference) {
    constexpr int ROUNDS = 8;
    Random random(0xadb);
    double starts[MAX_ROOTS][6];
    for (int k = 0; k < MAX_ROOTS; ++k) {
      random_inside(random, reference, 1.0, starts[k]);
      if (k < found_.count())
        for (int j = 0; j < 6; ++j)
          starts[k][j] = std::clamp(found_[k].q[static_cast<size_t>(j)], chain_.lower[j], chain_.upper[j]);
    }
    for (int round = 0; round < ROUNDS && !found_.any_inside(); ++round) {
      RootBlock block;
      polish(T, reference, starts, block);
      for (int k = 0; k < MAX_ROOTS; ++k)
        for (int j = 0; j < 6; ++j) starts[k][j] = std::clamp(block.value[j][k], chain_.lower[j], chain_.upper[j]);
    }
  }

  // Joint values between `reference` and anywhere inside the limits.
  void random_inside(Random& random, const double* reference, double share, double* q) const {
    for (int j = 0; j < 6; ++j)
      q[j] = reference[j] + share * (random.uniform(chain_.lower[j], chain_.upper[j]) - reference[j]);
  }

  // Solutions that all lie outside the limits show nothing where others may be missing or where they
  // stand for a continuum; and a double root that misses a limit by what it is uncertain may hold on it.
  void write_outside(const double* T, const double* seed, const Evidence& evidence, Table& table) {
    std::vector<Candidate> candidates;
    for (int b = 0; b < found_.count(); ++b) {
      const Root& r = found_[b];
      candidates.push_back({{r.q.begin(), r.q.end()}, r.position_error, r.rotation_error, b, false, true});
    }
    const bool singular = is_singular();
    finish_pose(chain_, choice_, candidates, {T, seed, Status::not_found, singular, singular || evidence.weak}, table);
  }

  // Not by finish_pose: which roots are one solution is told by how well each is known (RootSet), and its
  // number is that of all solutions, also of those outside the limits.
  void write(const double* T, const double* seed, Status unsolved, const Evidence& evidence, Table& table) {
    unsigned usable = 0;
    bool singular = arm_.is_deficient && found_.count();
    for (int b = 0; b < found_.count(); ++b) {
      if (choice_.hold_limits && !found_[b].inside) continue;
      usable |= 1u << b;
      singular = singular || found_[b].singular;
    }
    if (!usable && found_.count()) return write_outside(T, seed, evidence, table);
    table.add_nearest_first(usable, seed, [&](int b) { return found_[b].solution(b); });
    if (!usable && found_.has_best()) table.add_best(found_.best().solution(-1));
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
  RootSet found_;
};

}  // namespace

General6RSolver::General6RSolver(OwnedChain chain, double exact)
    : chain_(std::move(chain)),
      exact_(exact),
      size_(arm_size(chain_.view())),
      chosen_(choose_eliminations(chain_.view(), size_, exact)) {}

General6R General6RSolver::arm() const {
  const SlidePair* pair = chosen_.pairs.empty() ? nullptr : chosen_.pairs.data();
  return {static_cast<int>(chosen_.kept.size()), chosen_.is_deficient, size_, chosen_.eliminations.data(), pair, &trig_tables()};
}

Table General6RSolver::solve(const double* T, long poses, const Seeds& seeds, const Choice& choice) const {
  const General6R arm = this->arm();
  return in_parts(6, poses, 16, 8, [&](Table& table, long first, long last) {
    Pass(chain_.view(), arm, exact_, choice).run(T + 16 * first, last - first, seeds.from(first, 6), table);
  });
}

Candidates General6RSolver::propose(const double* T, long poses, const Seeds& seeds, const Choice& choice) const {
  const General6R arm = this->arm();
  Pass pass(chain_.view(), arm, exact_, choice);
  Candidates all;
  for (long i = 0; i < poses; ++i) {
    Evidence& evidence = all.evidence.emplace_back();
    all.hint.push_back(static_cast<std::uint8_t>(pass.find(T + 16 * i, seeds.of(i, 6), evidence)));
    const RootSet& found = pass.found();
    for (int b = 0; b < found.count(); ++b) all.add(i, found[b].q.data(), 6, b);
    if (!found.count() && found.has_best()) all.add(i, found.best().q.data(), 6, -1);
    all.singular.push_back(pass.is_singular());
  }
  return all;
}

}  // namespace kinverse
