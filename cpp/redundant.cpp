#include "redundant.hpp"

#include <algorithm>
#include <cmath>

#include "continuum.hpp"
#include "dispatch.hpp"

namespace kinverse {
namespace {

constexpr double PI = 3.14159265358979323846, TWO_PI = 2.0 * PI;
constexpr int DOF = 7, SECTION = 8;
// Samples per turn of the parameter: at first, and for a pose where these found nothing.
constexpr int COARSE = 256, FINE = 2048;
// How exactly the ends of intervals are found [rad].
constexpr double END_TOLERANCE = 1e-9;
// Between samples no joint may move further than this [rad], else more are taken, down to this step.
constexpr double SWING = 0.35, LEAST_STEP = 1e-6;
constexpr size_t MOST_SAMPLES = 8192;
// Limits missed by more than this everywhere on the fine sweep count as shown to be missed [rad].
constexpr double CLEAR_MISS = 0.02;
// A round of sections leaves 2/9 of a bracket: from a coarse step to the last digits of an optimum.
constexpr int PEAK_ROUNDS = 12, ROUGH_ROUNDS = 3;
constexpr double MISSED = -9.0;  // a margin below this: the branch misses the pose

// A bit for each branch.
struct Sample {
  double value;
  unsigned exact, verified, inside;
  bool singular, stretched;
  double margin[MAX_BRANCHES], distance[MAX_BRANCHES];
  double q[MAX_BRANCHES][DOF];
};

struct Interval {
  int branch;
  double low, high;
};

// One pose at many values of the parameter.
class Evaluator {
 public:
  Evaluator(const Chain& chain, const RedundantSpec& spec, const Tolerances& tolerances, const Kernels& kernels)
      : chain_(chain), spec_(spec), tolerances_(tolerances), kernels_(kernels) {}

  void aim(const double* T, const double* seed, const std::vector<double>& reference) {
    T_ = T;
    seed_ = seed;
    reference_ = reference.data();
    evaluations = 0;
  }

  // Fills SECTION samples at most; the tail of a pack repeats the last value.
  void samples(const double* values, int count, Sample* out) {
    for (int first = 0; first < count; first += kernels_.lanes) {
      run(values + first, std::min(kernels_.lanes, count - first), nullptr);
      for (int l = 0; l < kernels_.lanes && first + l < count; ++l) read(values[first + l], l, out[first + l]);
    }
  }
  // The branches of one value, all lanes alike.
  const RedundantBlock& block(double value, const FreeDirections* free = nullptr) {
    run(&value, 1, free);
    return block_;
  }
  // A branch of the first of the last samples.
  Candidate last(int branch) const { return candidate_from(block_, DOF, branch, 0); }
  Candidate candidate(double value, int branch) { return candidate_from(block(value), DOF, branch, 0); }

  std::vector<Candidate> continuum(double value, unsigned slots) {
    auto evaluate = [&](const FreeDirections& free, int used, std::vector<Candidate>* of_lane) {
      block(value, &free);
      for (int l = 0; l < used; ++l) {
        of_lane[l].clear();
        for (int b = 0; b < MAX_BRANCHES; ++b) of_lane[l].push_back(candidate_from(block_, DOF, b, l));
      }
    };
    return representatives({chain_, kernels_.lanes, MAX_BRANCHES, tolerances_.hold_limits, evaluate},
                           {reference_, reference_ + DOF}, slots);
  }

  std::int64_t evaluations = 0;

 private:
  void run(const double* values, int count, const FreeDirections* free) {
    const double *rows[WIDEST], *references[WIDEST];
    alignas(64) double held[WIDEST];
    for (int l = 0; l < WIDEST; ++l) {
      rows[l] = T_;
      references[l] = reference_;
      held[l] = values[std::min(l, count - 1)];
    }
    kernels_.redundant(chain_, spec_, tolerances_, rows, held, references, free, block_);
    evaluations += MAX_BRANCHES * count;
  }
  void read(double value, int lane, Sample& s) const {
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

  const Chain& chain_;
  const RedundantSpec& spec_;
  const Tolerances& tolerances_;
  const Kernels& kernels_;
  const double* T_ = nullptr;
  const double* seed_ = nullptr;
  const double* reference_ = nullptr;
  RedundantBlock block_;
};

// The sweep of one pose after another.
class Sweep {
 public:
  Sweep(const Chain& chain, const RedundantSpec& spec, double exact, const Choice& choice, Table& table)
      : chain_(chain),
        spec_(spec),
        choice_(choice),
        tolerances_{choice.tol_position, choice.tol_rotation, std::min(exact, choice.tol_position),
                    std::min(exact, choice.tol_rotation), choice.hold_limits},
        kernels_(active_kernels()),
        at_(chain_, spec_, tolerances_, kernels_),
        table_(table) {}

  void run(const double* T, const double* seed) {
    const std::vector<double> reference = winding_reference(chain_, seed, choice_.hold_limits);
    seed_ = seed;
    at_.aim(T, seed, reference);
    intervals_.clear();
    candidates_.clear();
    nearest_yet_ = 1e300;
    only_verified_ = found_singular_ = false;
    Status unsolved = Status::not_found;
    sample_all(COARSE);
    if (!any_solves() && kernels_.redundant_unreachable(spec_, tolerances_, T)) {
      unsolved = Status::unreachable;
    } else {
      find_intervals(false);
      if (intervals_.empty() && any([](const Sample& s) { return s.singular; })) find_singular();
      if (intervals_.empty() && candidates_.empty()) {
        sample_all(FINE);
        find_intervals(true);
      }
      if (intervals_.empty() && candidates_.empty() && !any([](const Sample& s) { return s.exact != 0; })) {
        // not exactly, but perhaps within the tolerances
        only_verified_ = true;
        find_intervals(true);
      }
    }
    bool singular = found_singular_ || any([](const Sample& s) { return s.stretched && s.exact; });
    for (const Interval& i : intervals_) represent(i, singular);
    const bool solved = !candidates_.empty();
    if (!solved) explain(unsolved);
    table_.evaluations.push(at_.evaluations);
    finish_pose(chain_, choice_, candidates_, {T, seed, unsolved, singular && solved, false}, table_);
  }

 private:
  bool any_solves() const {
    return any([](const Sample& s) { return (s.exact | s.verified) != 0; });
  }
  template <class Predicate>
  bool any(Predicate holds) const {
    return std::any_of(line_.begin(), line_.end(), holds);
  }
  bool feasible(const Sample& s, int branch) const {
    const unsigned solves = only_verified_ ? s.verified : s.exact;
    return ((choice_.hold_limits ? solves & s.inside : solves) >> branch & 1u) != 0;
  }

  // Even steps over the parameter's range; round ranges avoid the values that symmetric poses like.
  void sample_all(int per_turn) {
    const double range = spec_.high - spec_.low;
    const int steps = std::max(16, static_cast<int>(std::ceil(per_turn * range / TWO_PI)));
    line_.resize(static_cast<size_t>(steps) + 1);
    double values[SECTION];
    for (int first = 0; first <= steps; first += SECTION) {
      const int count = std::min(SECTION, steps + 1 - first);
      for (int k = 0; k < count; ++k) values[k] = value_of(first + k, steps);
      at_.samples(values, count, &line_[static_cast<size_t>(first)]);
    }
    std::vector<Sample> even;
    even.swap(line_);
    const double step = range / steps;
    line_.push_back(even.front());
    for (size_t k = 1; k < even.size(); ++k) fill(even[k - 1], even[k], step);
  }
  // Appends what lies between two samples, and the second: near a singular posture joints turn fast,
  // where a branch begins they start like a square root.
  void fill(const Sample& from, const Sample& to, double step) {
    const double gap = to.value - from.value;
    if (gap > LEAST_STEP && line_.size() < MOST_SAMPLES && swings(from, to, gap > 0.05 * step)) {
      double values[SECTION];
      Sample between[SECTION];
      for (int i = 0; i < SECTION; ++i) values[i] = from.value + gap * (i + 1) / (SECTION + 1);
      at_.samples(values, SECTION, between);
      for (int i = 0; i <= SECTION; ++i) fill(i ? between[i - 1] : from, i < SECTION ? between[i] : to, step);
      return;
    }
    line_.push_back(to);
  }
  static bool swings(const Sample& a, const Sample& b, bool wide) {
    if (wide && a.exact != b.exact) return true;
    double largest = 0.0;
    for (int i = 0; i < MAX_BRANCHES; ++i) {
      if (!(a.exact & b.exact & 1u << i)) continue;
      for (int j = 0; j < DOF; ++j) {
        const double d = std::fabs(a.q[i][j] - b.q[i][j]);
        largest = std::max(largest, std::min(d, std::fabs(TWO_PI - d)));
      }
    }
    return largest > SWING;
  }
  double value_of(int k, int steps) const {
    const double step = (spec_.high - spec_.low) / steps;
    if (spec_.round) return spec_.low + (k + 0.381966) * step;
    return k == steps ? spec_.high : spec_.low + k * step;
  }

  void find_intervals(bool thorough) {
    for (int b = 0; b < MAX_BRANCHES; ++b) {
      std::vector<Point> points;
      for (size_t k = 0; k < line_.size(); ++k) {
        const Point here{line_[k].value, feasible(line_[k], b)};
        Point extreme;
        if (k > 0 && k + 1 < line_.size() && hidden(b, k, thorough, extreme)) points.push_back(extreme);
        points.push_back(here);
      }
      std::sort(points.begin(), points.end(), [](const Point& x, const Point& y) { return x.value < y.value; });
      collect(b, points);
    }
  }

  struct Point {
    double value;
    bool ok;
  };

  // Between sample k and its neighbours, a point of the other kind where the margin has its extreme.
  bool hidden(int b, size_t k, bool thorough, Point& found) {
    const double left = line_[k - 1].margin[b], here = line_[k].margin[b], right = line_[k + 1].margin[b];
    const bool ok = feasible(line_[k], b);
    if (feasible(line_[k - 1], b) != ok || feasible(line_[k + 1], b) != ok) return false;  // an end is near, found anyhow
    if (!choice_.hold_limits && ok) return false;
    const double sign = ok ? -1.0 : 1.0;
    // strictly above one side: a joint that the parameter does not move makes plateaus
    if (sign * here <= sign * left || sign * here < sign * right) return false;
    const double fall = std::max(std::fabs(here - left), std::fabs(here - right));
    if (!thorough && std::fabs(here) > 3.0 * fall && here > MISSED) return false;
    double low = line_[k - 1].value, high = line_[k + 1].value, best = here;
    for (int round = 0; round < PEAK_ROUNDS; ++round) {
      double values[SECTION];
      Sample samples[SECTION];
      for (int i = 0; i < SECTION; ++i) values[i] = low + (high - low) * (i + 1) / (SECTION + 1);
      at_.samples(values, SECTION, samples);
      int top = -1;
      for (int i = 0; i < SECTION; ++i) {
        if (feasible(samples[i], b) != ok) {
          found = {values[i], !ok};
          return true;
        }
        if (top < 0 || sign * samples[i].margin[b] > sign * samples[top].margin[b]) top = i;
      }
      const double gained = sign * (samples[top].margin[b] - best);
      best = sign > 0 ? std::max(best, samples[top].margin[b]) : std::min(best, samples[top].margin[b]);
      // the way to go is longer than what the last round won many times over, or than the bracket allows
      if (round >= 2 && best > MISSED && std::fabs(best) > 4.0 * std::max(gained, 0.0) + 1e-12) break;
      if (round >= 1 && best < MISSED && MISSED - 1.0 - best > 20.0 * (high - low)) break;
      const double step = (high - low) / (SECTION + 1);
      low = values[top] - step;
      high = values[top] + step;
    }
    return false;
  }

  // Turns a line of points into intervals, their ends found by sections.
  void collect(int b, const std::vector<Point>& points) {
    const size_t first_new = intervals_.size();
    const bool whole = std::all_of(points.begin(), points.end(), [](const Point& p) { return p.ok; });
    if (whole) {
      intervals_.push_back({b, spec_.low, spec_.high});
      return;
    }
    double low = points.front().value;
    for (size_t k = 0; k < points.size(); ++k) {
      if (!points[k].ok) continue;
      if (k == 0 || !points[k - 1].ok) low = k == 0 ? points[0].value : end(b, points[k - 1].value, points[k].value);
      const bool last = k + 1 == points.size();
      if (last || !points[k + 1].ok)
        intervals_.push_back({b, low, last ? points[k].value : end(b, points[k + 1].value, points[k].value)});
    }
    if (!spec_.round || intervals_.size() == first_new) return;
    // the last point of a round range is the first one, a turn on
    if (points.front().ok && points.back().ok && intervals_.size() > first_new + 1) {
      intervals_[first_new].low = intervals_.back().low - TWO_PI;
      intervals_.pop_back();
    }
    for (size_t k = first_new; k < intervals_.size(); ++k) {
      const double turns = TWO_PI * std::floor((intervals_[k].low - spec_.low) / TWO_PI);
      intervals_[k].low -= turns;
      intervals_[k].high -= turns;
    }
  }

  // The last feasible value on the way from inside to outside: by sections, close about the secant's
  // estimate where the margin passes through zero and the last round was good, else even ones.
  double end(int b, double outside, double inside) {
    static constexpr double AWAY[SECTION] = {-0.15, -2e-2, -1e-3, -1e-5, 1e-5, 1e-3, 2e-2, 0.15};
    double margin_in = 0.0, margin_out = 0.0;  // unknown
    bool even = true;
    for (double width = std::fabs(outside - inside); width > END_TOLERANCE;) {
      double values[SECTION];
      Sample samples[SECTION];
      const double share = even ? 0.0 : margin_in / (margin_in - margin_out);
      for (int i = 0; i < SECTION; ++i) {
        const double at = even ? (i + 1.0) / (SECTION + 1) : std::clamp(share + AWAY[i], 0.0, 1.0);
        values[i] = inside + (outside - inside) * at;
      }
      at_.samples(values, SECTION, samples);
      int i = 0;
      while (i < SECTION && feasible(samples[i], b)) ++i;
      if (i > 0) {
        inside = values[i - 1];
        margin_in = samples[i - 1].margin[b];
      }
      if (i < SECTION) {
        outside = values[i];
        margin_out = samples[i].margin[b];
      }
      const double before = width;
      width = std::fabs(outside - inside);
      even = !(margin_in > 0.0 && margin_out < 0.0 && margin_out > MISSED) || (!even && width > 0.2 * before);
    }
    return inside;
  }

  // One solution of an interval.
  void represent(const Interval& interval, bool& singular) {
    double value = 0.5 * (interval.low + interval.high);
    if (seed_) value = nearest(interval);
    Sample s;
    at_.samples(&value, 1, &s);
    if (!feasible(s, interval.branch)) {
      // a gap narrower than the sweep sees
      const double low_end = end(interval.branch, value, interval.low), high_end = end(interval.branch, value, interval.high);
      if (low_end > interval.low) represent({interval.branch, interval.low, low_end}, singular);
      if (high_end < interval.high) represent({interval.branch, high_end, interval.high}, singular);
      return;
    }
    Candidate c = at_.last(interval.branch);
    c.verified = true;
    singular = singular || s.singular;
    table_.add_interval(interval.branch, interval.low, interval.high);
    candidates_.push_back(std::move(c));
  }

  // The value in an interval whose solution is nearest to the seed: the valleys of samples that crowd at
  // the ends (where joints start like a square root), narrowed by sections; roughly where another
  // interval is nearer anyhow.
  double nearest(const Interval& interval) {
    const int b = interval.branch;
    const double length = interval.high - interval.low;
    const int steps = std::clamp(static_cast<int>(std::ceil(length / TWO_PI * COARSE)), 31, COARSE - 1);
    std::vector<Sample> samples(static_cast<size_t>(steps) + 1);
    std::vector<double> values(samples.size());
    for (size_t k = 0; k < values.size(); ++k) values[k] = interval.low + length * 0.5 * (1.0 - std::cos(PI * static_cast<double>(k) / steps));
    values.back() = interval.high;
    for (size_t first = 0; first < values.size(); first += SECTION)
      at_.samples(&values[first], static_cast<int>(std::min<size_t>(SECTION, values.size() - first)), &samples[first]);
    auto distance = [&](const Sample& s) { return feasible(s, b) ? s.distance[b] : 1e300; };
    std::vector<size_t> valleys;
    for (size_t k = 0; k < samples.size(); ++k) {
      const double here = distance(samples[k]);
      if (here < 1e300 && (k == 0 || here <= distance(samples[k - 1])) &&
          (k + 1 == samples.size() || here < distance(samples[k + 1])))
        valleys.push_back(k);
    }
    std::stable_sort(valleys.begin(), valleys.end(),
                     [&](size_t i, size_t j) { return distance(samples[i]) < distance(samples[j]); });
    double best = 1e300, best_value = interval.low;
    for (size_t valley : valleys) {
      // a valley is hardly deeper than the steps beside it
      double fall = 0.0;
      for (size_t beside : {valley > 0 ? valley - 1 : valley, std::min(valley + 1, samples.size() - 1)})
        fall = std::max(fall, distance(samples[beside]) - distance(samples[valley]));
      const double least = distance(samples[valley]) - 1.5 * fall;
      if (least > best) continue;
      const int rounds = least > nearest_yet_ ? ROUGH_ROUNDS : PEAK_ROUNDS;
      double low = values[valley > 0 ? valley - 1 : 0], high = values[std::min(valley + 1, values.size() - 1)];
      double here = distance(samples[valley]), at = values[valley];
      for (int round = 0; round < rounds; ++round) {
        double section[SECTION];
        Sample found[SECTION];
        for (int i = 0; i < SECTION; ++i) section[i] = low + (high - low) * (i + 1) / (SECTION + 1);
        at_.samples(section, SECTION, found);
        for (int i = 0; i < SECTION; ++i)
          if (distance(found[i]) < here) {
            here = distance(found[i]);
            at = section[i];
          }
        const double step = (high - low) / (SECTION + 1);
        low = std::max(low, at - step);
        high = std::min(high, at + step);
      }
      if (here < best) {
        best = here;
        best_value = at;
      }
    }
    nearest_yet_ = std::min(nearest_yet_, best);
    return best_value;
  }

  // A pose that is singular at the values of the sweep: members of the continua at a few of them.
  void find_singular() {
    const size_t step = std::max<size_t>(1, line_.size() / 16);
    for (size_t k = 0; k < line_.size(); k += step) {
      if (!line_[k].singular) continue;
      const RedundantBlock& block = at_.block(line_[k].value);
      if (!(block.singular & 1u)) continue;
      for (Candidate& c : at_.continuum(line_[k].value, block.singular_slots)) {
        c.verified = c.exact;
        if (c.verified && (c.inside || !choice_.hold_limits)) {
          candidates_.push_back(std::move(c));
          found_singular_ = true;
        }
      }
    }
  }

  // Why there is no solution, and the nearest miss.
  void explain(Status& unsolved) {
    double best_margin = -1e300;
    const Sample* best = &line_.front();
    int branch = 0;
    for (const Sample& s : line_)
      for (int b = 0; b < MAX_BRANCHES; ++b)
        if (s.margin[b] > best_margin) {
          best_margin = s.margin[b];
          best = &s;
          branch = b;
        }
    Candidate c = at_.candidate(best->value, branch);
    c.verified = false;
    candidates_.push_back(std::move(c));
    if (unsolved != Status::not_found || !choice_.hold_limits) return;
    const bool singular = any([](const Sample& s) { return s.singular; });
    if (best_margin > MISSED && best_margin < -CLEAR_MISS && !singular) unsolved = Status::out_of_limits;
  }

  const Chain chain_;
  const RedundantSpec& spec_;
  const Choice& choice_;
  const Tolerances tolerances_;
  const Kernels& kernels_;
  Evaluator at_;
  Table& table_;
  const double* seed_ = nullptr;
  double nearest_yet_ = 1e300;
  bool only_verified_ = false, found_singular_ = false;
  std::vector<Sample> line_;
  std::vector<Interval> intervals_;
  std::vector<Candidate> candidates_;
};

// All branches of pairs of a pose and a value.
class AtValues {
 public:
  AtValues(const Chain& chain, const RedundantSpec& spec, double exact, const Choice& choice, Table& table)
      : chain_(chain),
        spec_(spec),
        choice_(choice),
        tolerances_{choice.tol_position, choice.tol_rotation, std::min(exact, choice.tol_position),
                    std::min(exact, choice.tol_rotation), choice.hold_limits},
        kernels_(active_kernels()),
        at_(chain_, spec_, tolerances_, kernels_),
        middle_(winding_reference(chain, nullptr, true)),
        table_(table) {}

  void run(const double* T, const double* value, long poses, const Seeds& seeds) {
    const int lanes = kernels_.lanes;
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
        if (seed) clamped[l] = winding_reference(chain_, seed, choice_.hold_limits);
        references[l] = seed ? clamped[l].data() : middle_.data();
      }
      kernels_.redundant(chain_, spec_, tolerances_, rows, held, references, nullptr, block);
      for (int l = 0; l < lanes && first + l < poses; ++l) {
        const double* seed = seeds.of(first + l, DOF);
        unsigned usable = 0;
        for (int b = 0; b < MAX_BRANCHES; ++b)
          usable |= ((choice_.hold_limits ? block.exact[b] & block.inside[b] : block.exact[b]) >> l & 1u) << b;
        const bool plain = !((block.near | block.singular) >> l & 1u);
        if (usable && plain) {
          add_sorted(block, l, seed, usable);
          table_.end_pose(Status::solved, false);
        } else {
          slow(rows[l], held[l], seed, {references[l], references[l] + DOF}, block, l);
        }
      }
    }
  }

 private:
  void add_sorted(const RedundantBlock& block, int lane, const double* seed, unsigned usable) {
    int order[MAX_BRANCHES], count = 0;
    double key[MAX_BRANCHES];
    for (int b = 0; b < MAX_BRANCHES; ++b) {
      if (!(usable >> b & 1u)) continue;
      double largest = 0.0;
      for (int j = 0; seed && j < DOF; ++j) largest = std::max(largest, std::fabs(block.value[b][j][lane] - seed[j]));
      int at = count++;
      for (; at > 0 && key[at - 1] > largest; --at) {
        key[at] = key[at - 1];
        order[at] = order[at - 1];
      }
      key[at] = largest;
      order[at] = b;
    }
    for (int k = 0; k < count; ++k) {
      const int b = order[k];
      table_.add({&block.value[b][0][lane], block.value[b][DOF][lane], block.value[b][DOF + 1][lane], b, WIDEST});
    }
  }

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
    if (!any && kernels_.redundant_unreachable(spec_, tolerances_, T)) unsolved = Status::unreachable;
    const bool free = singular;
    singular = singular || (block.stretched >> lane & 1u) != 0;
    finish_pose(chain_, choice_, candidates, {T, seed, unsolved, singular && any, free}, table_);
  }

  const Chain chain_;
  const RedundantSpec& spec_;
  const Choice& choice_;
  const Tolerances tolerances_;
  const Kernels& kernels_;
  Evaluator at_;
  const std::vector<double> middle_;
  Table& table_;
};

// work(table, first, last) on parts of the poses, their tables joined
template <class Work>
Table in_parts(long poses, long least_part, Work work) {
  std::vector<Table> parts;
  const long count = parts_of(poses, least_part);
  for (long p = 0; p < count; ++p) parts.emplace_back(DOF, 0, 0);
  run_parts(poses, count, [&](long first, long last, long part) {
    Table& table = parts[static_cast<size_t>(part)];
    table = Table(DOF, last - first, (last - first) * MAX_BRANCHES);
    work(table, first, last);
  });
  for (size_t p = 1; p < parts.size(); ++p) parts[0].append(parts[p]);
  return std::move(parts[0]);
}

}  // namespace

Table Redundant::solve(const double* T, long poses, const Seeds& seeds, const Choice& choice) const {
  Table table = in_parts(poses, 4, [&](Table& table, long first, long last) {
    Sweep sweep(chain_.view(), spec_, exact_, choice, table);
    for (long pose = first; pose < last; ++pose) sweep.run(T + 16 * pose, seeds.of(pose, DOF));
  });
  table.method = Ground::sweep;
  return table;
}

Table Redundant::solve_at(const double* T, const double* value, long poses, const Seeds& seeds,
                          const Choice& choice) const {
  Table table = in_parts(poses, 512, [&](Table& part, long first, long last) {
    AtValues(chain_.view(), spec_, exact_, choice, part)
        .run(T + 16 * first, value + first, last - first, seeds.from(first, DOF));
  });
  table.evaluations_each = MAX_BRANCHES;
  table.method = Ground::closed_form;
  return table;
}

}  // namespace kinverse
