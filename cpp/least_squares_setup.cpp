#include "least_squares_setup.hpp"

#include <algorithm>
#include <cmath>
#include <memory>

#include "table_parts.hpp"

namespace kinverse {
namespace {

constexpr double TWO_PI = 6.28318530717958647693;

// follow: the joint steps [rad or m] that are tried first, and how many restarts within them
constexpr double NEAR_STEP = 0.1;
constexpr int NEAR_STARTS = 24;

// The rotation of a 3x4 transform as Rz(first) Rx(twist) Rz(last).
struct Turns {
  double first, cosine, sine, last;
};
Turns split(const double* m) {
  // with the sign that keeps `first` within a quarter turn, so that ordinary arms have none
  double sine = std::hypot(m[2], m[6]);
  double sign = m[6] <= 0.0 ? 1.0 : -1.0;
  double first = sine > 0.0 ? std::atan2(sign * m[2], -sign * m[6]) : 0.0;
  sine *= sign;
  double cosine = m[10], c = std::cos(first), s = std::sin(first);
  double norm = std::hypot(cosine, sine);
  cosine /= norm;
  sine /= norm;
  // Rx(-twist) Rz(-first) R = Rz(last)
  double x = c * m[0] + s * m[4];
  double y = cosine * (-s * m[0] + c * m[4]) + sine * m[8];
  return {first, cosine, sine, std::atan2(y, x)};
}

// Half the arm's reach (the lengths of its links, and the way of its slides), as a power of two.
double half_reach(const Chain& chain) {
  double reach = 0.0;
  for (int i = 1; i <= chain.joints; ++i) {
    const double* m = chain.frames + 12 * i;
    reach += std::hypot(m[3], m[7], m[11]);
  }
  for (int i = 0; i < chain.joints; ++i) {
    int j = chain.source[i];
    if (chain.prismatic[i]) reach += 0.5 * std::fabs(chain.multiplier[i]) * (chain.upper[j] - chain.lower[j]);
  }
  return reach > 0.0 && std::isfinite(reach) ? std::exp2(std::round(std::log2(reach)) - 1.0) : 1.0;
}

}  // namespace

LeastSquares::LeastSquares(const OwnedChain& owned, const LeastSquaresSettings& settings)
    : chain_(owned), settings_(settings), turns_(turning_joints(owned.view())) {
  const Chain chain = chain_.view();
  const int joints = chain.joints;
  const bool hold_limits = settings.choice.hold_limits;
  unit_length_ = half_reach(chain) * settings.weight_rotation / settings.weight_position;
  plain_ = chain.dof == chain.joints;
  for (int i = 0; i < joints; ++i)
    plain_ &= !chain.prismatic[i] && chain.source[i] == i && chain.multiplier[i] == 1.0;
  slides_.assign(chain.dof, 0);
  for (int i = joints - 1; i >= 0; --i) slides_[chain.source[i]] = chain.prismatic[i];
  for (bool turns : turning_joints(chain)) whole_turns_.push_back(turns);
  for (int j = 0; j < chain.dof; ++j) unit_.push_back(slides_[j] ? unit_length_ : 1.0);

  base_.assign(chain.frames, chain.frames + 12);
  for (int k = 3; k < 12; k += 4) base_[k] /= unit_length_;
  double turned = 0.0;  // about z, left over from the transform in front of the joint
  for (int i = 0; i <= joints; ++i) {
    Link link{};
    link.cosine = 1.0;
    if (i) {
      const double* m = chain.frames + 12 * i;
      Turns turns = split(m);
      Link& before = links_.back();
      if (before.prismatic) {
        before.turn_cosine = std::cos(turned + turns.first);
        before.turn_sine = std::sin(turned + turns.first);
      } else {
        before.offset += turned + turns.first;
      }
      double c = std::cos(turns.first), s = std::sin(turns.first);
      link.shift[0] = (c * m[3] + s * m[7]) / unit_length_;
      link.shift[1] = (c * m[7] - s * m[3]) / unit_length_;
      link.shift[2] = m[11] / unit_length_;
      link.cosine = turns.cosine;
      link.sine = turns.sine;
      turned = turns.last;
    }
    if (i < joints) {
      link.source = chain.source[i];
      link.prismatic = chain.prismatic[i];
      double length = link.prismatic ? unit_length_ : 1.0;
      link.multiplier = chain.multiplier[i] * unit_[link.source] / length;
      link.offset = chain.offset[i] / length;
    }
    links_.push_back(link);
  }
  tool_cosine_ = std::cos(turned);
  tool_sine_ = std::sin(turned);

  // R_n: powers of the root of x^(n+1) = x + 1 (Roberts 2018)
  double root = 1.5;
  for (int k = 0; k < 60; ++k) root = std::pow(1.0 + root, 1.0 / (chain.dof + 1));
  double step = 1.0;
  for (int j = 0; j < chain.dof; ++j) {
    double low = chain.lower[j] / unit_[j], high = chain.upper[j] / unit_[j];
    start_middle_.push_back(0.5 * (low + high));
    // a turning joint repeats itself after a turn: starts spread over more would be the same
    start_width_.push_back(slides_[j] ? high - low : std::min(hold_limits ? high - low : TWO_PI, TWO_PI));
    start_step_.push_back(step /= root);
    lower_.push_back(hold_limits ? low : -__builtin_inf());
    upper_.push_back(hold_limits ? high : __builtin_inf());
  }
}

LeastSquaresProblem LeastSquares::problem() const {
  LeastSquaresProblem p{};
  p.task = settings_.choice.task;
  p.method = settings_.method;
  p.joints = chain_.joints();
  p.dof = chain_.dof();
  p.plain = plain_;
  p.links = links_.data();
  p.base = base_.data();
  p.tool_cosine = tool_cosine_;
  p.tool_sine = tool_sine_;
  p.unit_length = unit_length_;
  p.unit = unit_.data();
  p.turns = whole_turns_.data();
  p.lower = lower_.data();
  p.upper = upper_.data();
  p.start_middle = start_middle_.data();
  p.start_width = start_width_.data();
  p.start_step = start_step_.data();
  // the classical iterations know no limits: what they find is held against them at the end
  p.clamp = settings_.method == Method::levenberg_marquardt;
  p.centre_on_seed = !settings_.choice.hold_limits;
  p.tol_position = settings_.choice.tol_position / unit_length_;
  p.tol_rotation = settings_.choice.tol_rotation;
  p.max_distance = settings_.max_distance;
  p.damping = settings_.damping;
  p.step_tolerance = settings_.step_tolerance;
  p.gradient_tolerance = settings_.gradient_tolerance;
  p.max_starts = settings_.max_starts;
  p.max_iterations = settings_.max_iterations;
  return p;
}

Estimate::Estimate(long poses, int dof)
    : q(static_cast<size_t>(poses * dof)),
      found(static_cast<size_t>(poses)),
      stop(static_cast<size_t>(poses)),
      evaluations(static_cast<size_t>(poses)),
      iterations(static_cast<size_t>(poses)),
      starts(static_cast<size_t>(poses)) {}

LeastSquaresOutput Estimate::from(long pose, int dof, int* work) {
  return {q.data() + pose * dof,    found.data() + pose,  evaluations.data() + pose, iterations.data() + pose,
          starts.data() + pose, stop.data() + pose, work};
}

void LeastSquares::run(const LeastSquaresProblem& problem, const LeastSquaresInput& in, long poses, Estimate& estimate,
                       long first) const {
  constexpr long FEW = 4;
  const Kernels& kernels = poses < FEW ? latency_kernels() : active_kernels();
  auto work = std::make_unique_for_overwrite<int[]>(static_cast<size_t>(kernels.lanes) * static_cast<size_t>(problem.max_starts));
  kernels.least_squares(problem, in, poses, estimate.from(first, dof(), work.get()));
  if (problem.max_distance == __builtin_inf()) return;
  // a solution too far from the seed is no candidate: verification knows nothing of that bound
  for (long i = first; i < first + poses; ++i)
    if (estimate.stop[static_cast<size_t>(i)] == static_cast<std::uint8_t>(Stop::limits))
      std::fill_n(estimate.q.begin() + i * dof(), dof(), std::nan(""));
}

Estimate LeastSquares::propose(const double* T, long poses, const Seeds& seeds, std::uint64_t seed) const {
  Estimate estimate(poses, dof());
  const LeastSquaresProblem whole = problem();
  split_over_threads(poses, 64, [&](long first, long last, long) {
    const Seeds own = seeds.from(first, dof());
    run(whole, {T + 16 * first, own.rows, own.shared ? 0 : dof(), nullptr, seed, true}, last - first, estimate, first);
  });
  return estimate;
}

Estimate LeastSquares::refine(const double* T, long poses, const double* q_start) const {
  Estimate estimate(poses, dof());
  LeastSquaresProblem once = problem();
  once.max_starts = 1;
  once.max_distance = __builtin_inf();
  split_over_threads(poses, 64, [&](long first, long last, long) {
    run(once, {T + 16 * first, q_start + dof() * first, dof(), nullptr, 0, false}, last - first, estimate, first);
  });
  return estimate;
}

Table LeastSquares::follow(const double* T, long poses, const double* q_start, std::uint64_t seed, double max_step) const {
  Estimate estimate(poses, dof());
  const LeastSquaresProblem whole = problem();
  std::vector<double> last(q_start, q_start + dof()), before = last, ahead = last;
  // Where the last two solutions point to carries an arm through a singularity; an arm with joints to
  // spare would carry its idle motion on as well, so it starts from the last solution. Then the other
  // of the two; then restarts, near before far.
  constexpr int ROWS[] = {6, 3, 5, 3, 4};
  const bool spare = dof() > ROWS[static_cast<int>(whole.task)];
  struct Try {
    const double* from;
    int starts;
    double distance;
  };
  const double near = std::min(NEAR_STEP, max_step);
  const Try tries[] = {{spare ? last.data() : ahead.data(), 1, near},
                       {spare ? ahead.data() : last.data(), 1, near},
                       {last.data(), std::min(NEAR_STARTS, whole.max_starts), near},
                       {last.data(), whole.max_starts, max_step}};
  for (long i = 0; i < poses; ++i) {
    const size_t at = static_cast<size_t>(i);
    std::int64_t evaluations = 0, starts = 0;
    for (const Try& attempt : tries) {
      LeastSquaresProblem bounded = whole;
      bounded.max_starts = attempt.starts;
      bounded.max_distance = attempt.distance;
      run(bounded, {T + 16 * i, attempt.from, dof(), last.data(), seed, attempt.starts > 1}, 1, estimate, i);
      evaluations += estimate.evaluations[at];
      starts += estimate.starts[at];
      if (estimate.found[at]) break;
    }
    estimate.evaluations[at] = evaluations;
    estimate.starts[at] = starts;
    before = last;
    const double* q = estimate.q.data() + i * dof();
    if (estimate.found[at]) std::copy(q, q + dof(), last.begin());
    for (size_t j = 0; j < last.size(); ++j) ahead[j] = last[j] + (last[j] - before[j]);
  }
  // the windings of the sequence stay: each solution is its own reference
  const std::vector<double> own = estimate.q;
  Table table(dof(), poses, poses);
  verify_into(table, T, poses, {own.data(), false}, estimate);
  return table;
}

// What verify() does, for one candidate a pose.
void LeastSquares::verify_into(Table& table, const double* T, long poses, const Seeds& seeds, Estimate& estimate) const {
  const Chain chain = chain_.view();
  const Choice& choice = settings_.choice;
  const size_t count = static_cast<size_t>(poses);
  std::vector<std::int64_t> index(count);
  std::vector<double> error(2 * count);
  for (long i = 0; i < poses; ++i) {
    index[static_cast<size_t>(i)] = i;
    double* q = estimate.q.data() + i * chain.dof;
    const double* seed = seeds.of(i, chain.dof);
    for (int j = 0; j < chain.dof; ++j) {
      if (!turns_[static_cast<size_t>(j)]) continue;
      const double low = chain.lower[j], high = chain.upper[j];
      double reference = seed ? seed[j] : 0.5 * (low + high);
      if (choice.hold_limits) reference = std::clamp(reference, low, high);
      q[j] = wind(q[j], reference, low, high, choice.hold_limits);
    }
  }
  double *position = error.data(), *rotation = position + poses;
  active_kernels().measure(chain, choice.task, T, index.data(), estimate.q.data(), poses, position, rotation);
  for (long i = 0; i < poses; ++i) {
    const double* q = estimate.q.data() + i * chain.dof;
    const Solution solution{q, position[i], rotation[i], -1, 1};
    const bool verified = position[i] <= choice.tol_position && rotation[i] <= choice.tol_rotation;
    bool inside = true;
    for (int j = 0; j < chain.dof; ++j) inside = inside && q[j] >= chain.lower[j] && q[j] <= chain.upper[j];
    if (verified && (inside || !choice.hold_limits))
      table.add(solution);
    else if (std::isfinite(q[0]))
      table.add_best(solution);
    table.end_pose(verified ? Status::out_of_limits : Status::not_found, false);
  }
  table.evaluations.append(estimate.evaluations.data(), poses);
  auto column = [&](const char* name) -> Buffer<std::int64_t>& {
    return table.columns.emplace_back(name, Buffer<std::int64_t>{}).second;
  };
  column("iterations").append(estimate.iterations.data(), poses);
  column("starts").append(estimate.starts.data(), poses);
  Buffer<std::int64_t>& stops = column("stop");
  for (std::uint8_t stop : estimate.stop) stops.push(stop);
}

Table LeastSquares::solve(const double* T, long poses, const Seeds& seeds, std::uint64_t seed) const {
  const LeastSquaresProblem whole = problem();
  return in_parts(dof(), poses, 64, 1, [&](Table& table, long first, long last) {
    const Seeds own = seeds.from(first, dof());
    const double* rows = T + 16 * first;
    Estimate estimate(last - first, dof());
    run(whole, {rows, own.rows, own.shared ? 0 : dof(), nullptr, seed, true}, last - first, estimate, 0);
    verify_into(table, rows, last - first, own, estimate);
  });
}

}  // namespace kinverse
