#include "verify.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>

#include "dispatch.hpp"

namespace kinverse {
namespace {

constexpr double TWO_PI = 6.28318530717958647693;
constexpr double SAME_SOLUTION = 1e-6;
constexpr double LIMIT_SLACK = 1e-9;

}  // namespace

Tolerances tolerances_of(const Choice& choice, double exact) {
  return {choice.tol_position, choice.tol_rotation, std::min(exact, choice.tol_position),
          std::min(exact, choice.tol_rotation), choice.hold_limits};
}

std::vector<bool> turning_joints(const Chain& chain) {
  std::vector<bool> turns(static_cast<size_t>(chain.dof), true);
  for (int i = 0; i < chain.joints; ++i) {
    // a whole turn of a free joint is one for its mimics only if their ratio is whole
    double ratio = chain.multiplier[i];
    if (chain.prismatic[i] || ratio != std::nearbyint(ratio)) turns[static_cast<size_t>(chain.source[i])] = false;
  }
  return turns;
}

double wind(double q, double reference, double low, double high, bool hold_limits) {
  q = std::fma(std::nearbyint((reference - q) * (1.0 / TWO_PI)), TWO_PI, q);
  if (!hold_limits) return q;
  if (q > high + LIMIT_SLACK && q - TWO_PI >= low - LIMIT_SLACK) return q - TWO_PI;
  if (q < low - LIMIT_SLACK && q + TWO_PI <= high + LIMIT_SLACK) return q + TWO_PI;
  return q;
}

namespace {

// Largest joint distance; whole turns count as nothing where `wrapped`.
double distance(const double* a, const double* b, int dof, const std::vector<bool>* wrapped) {
  double largest = 0.0;
  for (int j = 0; j < dof; ++j) {
    double d = a[j] - b[j];
    if (wrapped && (*wrapped)[static_cast<size_t>(j)]) d = std::remainder(d, TWO_PI);
    largest = std::max(largest, std::fabs(d));
  }
  return largest;
}

// Every winding of q inside the limits, or the nearest one if there is none.
void all_windings(const Chain& chain, const std::vector<bool>& turns, const std::vector<double>& reference,
                  std::vector<double> q, size_t joint, std::vector<std::vector<double>>& found) {
  constexpr size_t MOST = 8192;  // a guard: fit refuses settings that could come near it
  if (joint == static_cast<size_t>(chain.dof)) {
    if (found.size() < MOST) found.push_back(q);
    return;
  }
  double low = chain.lower[joint], high = chain.upper[joint];
  q[joint] = turns[joint] ? wind(q[joint], reference[joint], low, high, true) : q[joint];
  if (!turns[joint]) return all_windings(chain, turns, reference, q, joint + 1, found);
  double first = std::ceil((low - LIMIT_SLACK - q[joint]) / TWO_PI);
  double last = std::floor((high + LIMIT_SLACK - q[joint]) / TWO_PI);
  if (first > last) first = last = 0.0;
  const double base = q[joint];
  for (double k = first; k <= last && found.size() < MOST; ++k) {
    q[joint] = std::fma(k, TWO_PI, base);
    all_windings(chain, turns, reference, q, joint + 1, found);
  }
}

// All verified candidates lie outside the limits. Moved onto them, some may still hold (these become
// usable), some may nearly hold; true if neither is so, by a factor of `margin` in the error.
bool clearly_out_of_limits(const Chain& chain, const Choice& choice, const double* T, std::vector<Candidate>& candidates) {
  constexpr double MARGIN = 100.0;
  std::vector<double> moved;
  std::vector<std::int64_t> pose;
  std::vector<Candidate*> of;
  for (Candidate& c : candidates) {
    if (!c.verified) continue;
    for (int j = 0; j < chain.dof; ++j)
      moved.push_back(std::clamp(c.q[static_cast<size_t>(j)], chain.lower[j], chain.upper[j]));
    pose.push_back(0);
    of.push_back(&c);
  }
  std::vector<double> position(of.size()), rotation(of.size());
  active_kernels().measure(chain, choice.task, T, pose.data(), moved.data(), static_cast<long>(of.size()),
                           position.data(), rotation.data());
  bool clear = true;
  for (size_t k = 0; k < of.size(); ++k) {
    const double excess = std::max(position[k] / choice.tol_position, rotation[k] / choice.tol_rotation);
    clear = clear && excess > MARGIN;
    if (!(excess <= 1.0)) continue;
    const double* row = moved.data() + k * static_cast<size_t>(chain.dof);
    *of[k] = {{row, row + chain.dof}, position[k], rotation[k], of[k]->branch, true, true};
  }
  return clear;
}

void project_rotation(double* T) {
  // Newton's iteration for the polar factor, R <- R (3 I - R^T R) / 2: from 1e-5 to rounding in two
  for (int round = 0; round < 3; ++round) {
    double R[3][3], S[3][3];
    for (int i = 0; i < 3; ++i)
      for (int j = 0; j < 3; ++j) R[i][j] = T[4 * i + j];
    for (int i = 0; i < 3; ++i)
      for (int j = 0; j < 3; ++j) {
        double dot = R[0][i] * R[0][j] + R[1][i] * R[1][j] + R[2][i] * R[2][j];
        S[i][j] = ((i == j ? 3.0 : 0.0) - dot) * 0.5;
      }
    for (int i = 0; i < 3; ++i)
      for (int j = 0; j < 3; ++j) T[4 * i + j] = R[i][0] * S[0][j] + R[i][1] * S[1][j] + R[i][2] * S[2][j];
  }
}

}  // namespace

std::vector<double> winding_reference(const Chain& chain, const double* seed, bool hold_limits) {
  std::vector<double> reference(static_cast<size_t>(chain.dof));
  for (int j = 0; j < chain.dof; ++j) {
    double low = chain.lower[j], high = chain.upper[j];
    double value = seed ? seed[j] : 0.5 * (low + high);
    reference[static_cast<size_t>(j)] = hold_limits ? std::clamp(value, low, high) : value;
  }
  return reference;
}

void finish_pose(const Chain& chain, const Choice& choice, std::vector<Candidate>& candidates, const PoseFacts& facts,
                 Table& table) {
  const std::vector<bool> turns = turning_joints(chain);
  auto error = [](const Candidate& c) { return std::max(c.position_error, c.rotation_error); };
  auto usable = [&](const Candidate& c) { return c.verified && (c.inside || !choice.hold_limits); };
  Status unsolved = facts.unsolved;
  if (std::any_of(candidates.begin(), candidates.end(), [](const Candidate& c) { return c.verified; }) &&
      std::none_of(candidates.begin(), candidates.end(), usable)) {
    const bool shown = clearly_out_of_limits(chain, choice, facts.T, candidates);
    unsolved = shown && !facts.representative ? Status::out_of_limits : Status::not_found;
  }
  const bool has_exact = std::any_of(candidates.begin(), candidates.end(),
                                     [&](const Candidate& c) { return usable(c) && error(c) <= choice.exact; });
  std::vector<const Candidate*> kept;
  const Candidate* best = nullptr;
  for (const Candidate& c : candidates) {
    if (!best || error(c) < error(*best)) best = &c;
    if (!usable(c) || (has_exact && !(error(c) <= choice.exact))) continue;
    const bool known = c.may_repeat && std::any_of(kept.begin(), kept.end(), [&](const Candidate* k) {
      return distance(k->q.data(), c.q.data(), chain.dof, choice.all_windings ? nullptr : &turns) < SAME_SOLUTION;
    });
    if (!known) kept.push_back(&c);
  }
  std::stable_sort(kept.begin(), kept.end(), [&](const Candidate* a, const Candidate* b) {
    if (!facts.seed) return a->branch < b->branch;
    return distance(a->q.data(), facts.seed, chain.dof, nullptr) < distance(b->q.data(), facts.seed, chain.dof, nullptr);
  });
  for (const Candidate* c : kept) table.add({c->q.data(), c->position_error, c->rotation_error, c->branch, 1});
  if (kept.empty() && best) table.add_best({best->q.data(), best->position_error, best->rotation_error, best->branch, 1});
  table.end_pose(unsolved, facts.singular);
}

Table verify(const Chain& chain, const Choice& choice, const double* T, long poses, const double* q,
             const std::int64_t* pose_index, const std::int32_t* branch, long count, const std::uint8_t* hint,
             const Seeds& seeds, const std::uint8_t* singular) {
  const std::vector<bool> turns = turning_joints(chain);
  const size_t dof = static_cast<size_t>(chain.dof);
  // by pose, in the order given
  std::vector<long> order(static_cast<size_t>(count));
  std::iota(order.begin(), order.end(), 0L);
  std::stable_sort(order.begin(), order.end(), [&](long a, long b) { return pose_index[a] < pose_index[b]; });

  std::vector<double> wound;
  std::vector<std::int64_t> pose_of;
  std::vector<int> branch_of;
  std::vector<bool> may_repeat;
  std::vector<std::vector<double>> seen;  // of the pose at hand, before windings
  std::int64_t seen_pose = -1;
  for (long k : order) {
    const double* row = q + k * chain.dof;
    std::vector<double> reference = winding_reference(chain, seeds.of(pose_index[k], chain.dof), choice.hold_limits);
    std::vector<std::vector<double>> windings;
    std::vector<double> values(row, row + dof);
    if (std::any_of(values.begin(), values.end(), [](double v) { return !std::isfinite(v); })) continue;
    bool repeats = true;
    if (pose_index[k] != seen_pose) seen.clear();
    seen_pose = pose_index[k];
    if (choice.all_windings) {
      // told before windings multiply the pairs to compare
      repeats = std::any_of(seen.begin(), seen.end(), [&](const std::vector<double>& other) {
        return distance(other.data(), values.data(), chain.dof, &turns) < 2.0 * SAME_SOLUTION;
      });
      seen.push_back(values);
    }
    if (choice.all_windings && choice.hold_limits) {
      all_windings(chain, turns, reference, values, 0, windings);
    } else {
      for (size_t j = 0; j < dof; ++j)
        if (turns[j]) values[j] = wind(values[j], reference[j], chain.lower[j], chain.upper[j], choice.hold_limits);
      windings.push_back(values);
    }
    for (const auto& w : windings) {
      wound.insert(wound.end(), w.begin(), w.end());
      pose_of.push_back(pose_index[k]);
      branch_of.push_back(branch[k]);
      may_repeat.push_back(repeats);
    }
  }
  const long measured = static_cast<long>(pose_of.size());
  std::vector<double> position(pose_of.size()), rotation(pose_of.size());
  active_kernels().measure(chain, choice.task, T, pose_of.data(), wound.data(), measured, position.data(),
                           rotation.data());

  Table table(chain.dof, poses, measured);
  size_t next = 0;
  std::vector<Candidate> candidates;
  for (long pose = 0; pose < poses; ++pose) {
    candidates.clear();
    for (; next < pose_of.size() && pose_of[next] == pose; ++next) {
      const double* row = wound.data() + next * dof;
      bool inside = true;
      for (size_t j = 0; j < dof; ++j) inside = inside && row[j] >= chain.lower[j] && row[j] <= chain.upper[j];
      bool verified = position[next] <= choice.tol_position && rotation[next] <= choice.tol_rotation;
      candidates.push_back({{row, row + dof}, position[next], rotation[next], branch_of[next], inside, verified, may_repeat[next]});
    }
    table.evaluations.push(static_cast<std::int64_t>(candidates.size()));
    const bool continuum = singular && singular[pose];
    finish_pose(chain, choice, candidates,
                {T + 16 * pose, seeds.of(pose, chain.dof), static_cast<Status>(hint[pose]), continuum, continuum}, table);
  }
  return table;
}

std::vector<double> usable_poses(const double* T, long count, long& bad) {
  std::vector<PoseVerdict> verdict(static_cast<size_t>(count));
  active_kernels().inspect_poses(T, count, verdict.data());
  std::vector<double> copy;
  bad = -1;
  for (long i = 0; i < count; ++i) {
    PoseVerdict v = verdict[static_cast<size_t>(i)];
    if (v == PoseVerdict::exact) continue;
    if (v != PoseVerdict::inexact) {
      bad = i;
      return {};
    }
    if (copy.empty()) copy.assign(T, T + 16 * count);
    project_rotation(copy.data() + 16 * i);
  }
  return copy;
}

}  // namespace kinverse
