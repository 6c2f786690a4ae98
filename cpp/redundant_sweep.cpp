#include "redundant_sweep.hpp"

#include <algorithm>
#include <cmath>

namespace kinverse {
namespace {

constexpr double PI = 3.14159265358979323846, TWO_PI = 2.0 * PI;
constexpr int DOF = RedundantSample::DOF, SECTION = 8;
// Samples per turn of the parameter: at first, and for a pose where these found nothing.
constexpr int COARSE = 256, FINE = 2048;
// How exactly the ends of ranges are found [rad].
constexpr double END_TOLERANCE = 1e-9;
// Between samples no joint may move further than this [rad], else more are taken, down to this step.
constexpr double SWING = 0.35, LEAST_STEP = 1e-6;
constexpr size_t MOST_SAMPLES = 8192;
// Limits missed by more than this everywhere on the fine sweep count as shown to be missed [rad].
constexpr double CLEAR_MISS = 0.02;
// A round of sections leaves 2/9 of a bracket: from a coarse step to the last digits of an optimum.
constexpr int PEAK_ROUNDS = 12, ROUGH_ROUNDS = 3;
constexpr double MISSED = -9.0;  // a margin below this: the branch misses the pose

// Whether a joint of some branch moves further between two samples than they may lie apart.
bool swings(const RedundantSample& a, const RedundantSample& b, bool wide) {
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

}  // namespace

void RedundantSweep::run(const double* T, const double* seed) {
  const std::vector<double> reference = winding_reference(call_.chain, seed, call_.choice.hold_limits);
  seed_ = seed;
  at_.aim(T, seed, reference);
  ranges_.clear();
  candidates_.clear();
  nearest_yet_ = 1e300;
  only_verified_ = found_singular_ = false;
  Status unsolved = Status::not_found;
  sample_all(COARSE);
  const bool solves = any([](const RedundantSample& s) { return (s.exact | s.verified) != 0; });
  if (!solves && call_.kernels.redundant_unreachable(call_.spec, call_.tolerances, T)) {
    unsolved = Status::unreachable;
  } else {
    find_ranges(false);
    if (ranges_.empty() && any([](const RedundantSample& s) { return s.singular; })) find_singular();
    if (ranges_.empty() && candidates_.empty()) {
      sample_all(FINE);
      find_ranges(true);
    }
    if (ranges_.empty() && candidates_.empty() && !any([](const RedundantSample& s) { return s.exact != 0; })) {
      // not exactly, but perhaps within the tolerances
      only_verified_ = true;
      find_ranges(true);
    }
  }
  bool singular = found_singular_ || any([](const RedundantSample& s) { return s.stretched && s.exact; });
  for (const Range& i : ranges_) represent(i, singular);
  const bool solved = !candidates_.empty();
  if (!solved) explain(unsolved);
  table_.evaluations.push(at_.evaluations);
  finish_pose(call_.chain, call_.choice, candidates_, {T, seed, unsolved, singular && solved, false}, table_);
}

bool RedundantSweep::feasible(const RedundantSample& s, int branch) const {
  const unsigned solves = only_verified_ ? s.verified : s.exact;
  return ((call_.choice.hold_limits ? solves & s.inside : solves) >> branch & 1u) != 0;
}

// Even steps over the parameter's range; round ranges avoid the values that symmetric poses like.
void RedundantSweep::sample_all(int per_turn) {
  const double range = call_.spec.high - call_.spec.low;
  const int steps = std::max(16, static_cast<int>(std::ceil(per_turn * range / TWO_PI)));
  line_.resize(static_cast<size_t>(steps) + 1);
  double values[SECTION];
  for (int first = 0; first <= steps; first += SECTION) {
    const int count = std::min(SECTION, steps + 1 - first);
    for (int k = 0; k < count; ++k) values[k] = value_of(first + k, steps);
    at_.samples(values, count, &line_[static_cast<size_t>(first)]);
  }
  std::vector<RedundantSample> even;
  even.swap(line_);
  const double step = range / steps;
  line_.push_back(even.front());
  for (size_t k = 1; k < even.size(); ++k) fill(even[k - 1], even[k], step);
}

// Appends what lies between two samples, and the second: near a singular posture joints turn fast,
// where a branch begins they start like a square root.
void RedundantSweep::fill(const RedundantSample& from, const RedundantSample& to, double step) {
  const double gap = to.value - from.value;
  if (gap > LEAST_STEP && line_.size() < MOST_SAMPLES && swings(from, to, gap > 0.05 * step)) {
    double values[SECTION];
    RedundantSample between[SECTION];
    for (int i = 0; i < SECTION; ++i) values[i] = from.value + gap * (i + 1) / (SECTION + 1);
    at_.samples(values, SECTION, between);
    for (int i = 0; i <= SECTION; ++i) fill(i ? between[i - 1] : from, i < SECTION ? between[i] : to, step);
    return;
  }
  line_.push_back(to);
}

double RedundantSweep::value_of(int k, int steps) const {
  const double step = (call_.spec.high - call_.spec.low) / steps;
  if (call_.spec.round) return call_.spec.low + (k + 0.381966) * step;
  return k == steps ? call_.spec.high : call_.spec.low + k * step;
}

void RedundantSweep::find_ranges(bool thorough) {
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

// Between sample k and its neighbours, a point of the other kind where the margin has its extreme.
bool RedundantSweep::hidden(int b, size_t k, bool thorough, Point& found) {
  const double left = line_[k - 1].margin[b], here = line_[k].margin[b], right = line_[k + 1].margin[b];
  const bool ok = feasible(line_[k], b);
  if (feasible(line_[k - 1], b) != ok || feasible(line_[k + 1], b) != ok) return false;  // an end is near, found anyhow
  if (!call_.choice.hold_limits && ok) return false;
  const double sign = ok ? -1.0 : 1.0;
  // strictly above one side: a joint that the parameter does not move makes plateaus
  if (sign * here <= sign * left || sign * here < sign * right) return false;
  const double fall = std::max(std::fabs(here - left), std::fabs(here - right));
  if (!thorough && std::fabs(here) > 3.0 * fall && here > MISSED) return false;
  double low = line_[k - 1].value, high = line_[k + 1].value, best = here;
  for (int round = 0; round < PEAK_ROUNDS; ++round) {
    double values[SECTION];
    RedundantSample samples[SECTION];
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

// Turns a line of points into ranges, their ends found by sections.
void RedundantSweep::collect(int b, const std::vector<Point>& points) {
  const size_t first_new = ranges_.size();
  const bool whole = std::all_of(points.begin(), points.end(), [](const Point& p) { return p.ok; });
  if (whole) {
    ranges_.push_back({b, call_.spec.low, call_.spec.high});
    return;
  }
  double low = points.front().value;
  for (size_t k = 0; k < points.size(); ++k) {
    if (!points[k].ok) continue;
    if (k == 0 || !points[k - 1].ok) low = k == 0 ? points[0].value : end(b, points[k - 1].value, points[k].value);
    const bool last = k + 1 == points.size();
    if (last || !points[k + 1].ok)
      ranges_.push_back({b, low, last ? points[k].value : end(b, points[k + 1].value, points[k].value)});
  }
  if (!call_.spec.round || ranges_.size() == first_new) return;
  // the last point of a round range is the first one, a turn on
  if (points.front().ok && points.back().ok && ranges_.size() > first_new + 1) {
    ranges_[first_new].low = ranges_.back().low - TWO_PI;
    ranges_.pop_back();
  }
  for (size_t k = first_new; k < ranges_.size(); ++k) {
    const double turns = TWO_PI * std::floor((ranges_[k].low - call_.spec.low) / TWO_PI);
    ranges_[k].low -= turns;
    ranges_[k].high -= turns;
  }
}

// The last feasible value on the way from inside to outside: by sections, close about the secant's
// estimate where the margin passes through zero and the last round was good, else even ones.
double RedundantSweep::end(int b, double outside, double inside) {
  static constexpr double AWAY[SECTION] = {-0.15, -2e-2, -1e-3, -1e-5, 1e-5, 1e-3, 2e-2, 0.15};
  double margin_in = 0.0, margin_out = 0.0;  // unknown
  bool even = true;
  for (double width = std::fabs(outside - inside); width > END_TOLERANCE;) {
    double values[SECTION];
    RedundantSample samples[SECTION];
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

// One solution of an range.
void RedundantSweep::represent(const Range& range, bool& singular) {
  double value = 0.5 * (range.low + range.high);
  if (seed_) value = nearest(range);
  RedundantSample s;
  at_.samples(&value, 1, &s);
  if (!feasible(s, range.branch)) {
    // a gap narrower than the sweep sees
    const double low_end = end(range.branch, value, range.low), high_end = end(range.branch, value, range.high);
    if (low_end > range.low) represent({range.branch, range.low, low_end}, singular);
    if (high_end < range.high) represent({range.branch, high_end, range.high}, singular);
    return;
  }
  Candidate c = at_.last(range.branch);
  c.verified = true;
  singular = singular || s.singular;
  table_.add_interval(range.branch, range.low, range.high);
  candidates_.push_back(std::move(c));
}

// The value in a range whose solution is nearest to the seed: the valleys of samples that crowd at
// the ends (where joints start like a square root), narrowed by sections; roughly where another range is
// nearer anyhow.
double RedundantSweep::nearest(const Range& range) {
  const int b = range.branch;
  const double length = range.high - range.low;
  const int steps = std::clamp(static_cast<int>(std::ceil(length / TWO_PI * COARSE)), 31, COARSE - 1);
  std::vector<RedundantSample> samples(static_cast<size_t>(steps) + 1);
  std::vector<double> values(samples.size());
  for (size_t k = 0; k < values.size(); ++k) values[k] = range.low + length * 0.5 * (1.0 - std::cos(PI * static_cast<double>(k) / steps));
  values.back() = range.high;
  for (size_t first = 0; first < values.size(); first += SECTION)
    at_.samples(&values[first], static_cast<int>(std::min<size_t>(SECTION, values.size() - first)), &samples[first]);
  auto distance = [&](const RedundantSample& s) { return feasible(s, b) ? s.distance[b] : 1e300; };
  std::vector<size_t> valleys;
  for (size_t k = 0; k < samples.size(); ++k) {
    const double here = distance(samples[k]);
    if (here < 1e300 && (k == 0 || here <= distance(samples[k - 1])) &&
        (k + 1 == samples.size() || here < distance(samples[k + 1])))
      valleys.push_back(k);
  }
  std::stable_sort(valleys.begin(), valleys.end(),
                   [&](size_t i, size_t j) { return distance(samples[i]) < distance(samples[j]); });
  double best = 1e300, best_value = range.low;
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
      RedundantSample found[SECTION];
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
void RedundantSweep::find_singular() {
  const size_t step = std::max<size_t>(1, line_.size() / 16);
  for (size_t k = 0; k < line_.size(); k += step) {
    if (!line_[k].singular) continue;
    const RedundantBlock& block = at_.block(line_[k].value);
    if (!(block.singular & 1u)) continue;
    for (Candidate& c : at_.continuum(line_[k].value, block.singular_slots)) {
      c.verified = c.exact;
      if (c.verified && (c.inside || !call_.choice.hold_limits)) {
        candidates_.push_back(std::move(c));
        found_singular_ = true;
      }
    }
  }
}

// Why there is no solution, and the nearest miss.
void RedundantSweep::explain(Status& unsolved) {
  double best_margin = -1e300;
  const RedundantSample* best = &line_.front();
  int branch = 0;
  for (const RedundantSample& s : line_)
    for (int b = 0; b < MAX_BRANCHES; ++b)
      if (s.margin[b] > best_margin) {
        best_margin = s.margin[b];
        best = &s;
        branch = b;
      }
  Candidate c = at_.candidate(best->value, branch);
  c.verified = false;
  candidates_.push_back(std::move(c));
  if (unsolved != Status::not_found || !call_.choice.hold_limits) return;
  const bool singular = any([](const RedundantSample& s) { return s.singular; });
  if (best_margin > MISSED && best_margin < -CLEAR_MISS && !singular) unsolved = Status::out_of_limits;
}

}  // namespace kinverse
