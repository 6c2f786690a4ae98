#include "continuum.hpp"

#include <algorithm>
#include <array>
#include <cmath>

namespace kinverse {
namespace {

constexpr double TWO_PI = 6.28318530717958647693;
constexpr int SLOTS = FREE_SLOTS, COARSE = 64, FINE = 16, ROUNDS = 3, MOST_ROUNDS = 9;
// a descent that is still this far off after the usual rounds leads nowhere
constexpr double HOPELESS = 0.1;

using Angles = std::array<double, SLOTS>;

struct Member {
  Candidate candidate;
  Angles angles;
};

double error(const Candidate& c) { return std::max(c.position_error, c.rotation_error); }

class Search {
 public:
  Search(const ContinuumProblem& problem, const std::vector<double>& reference)
      : problem_(problem), reference_(reference) {}

  bool better(const Candidate& a, const Candidate& b) const {
    if (a.verified != b.verified) return a.verified;
    if (!a.verified) return error(a) < error(b);
    if (a.exact != b.exact) return a.exact;
    if (problem_.hold_limits && !(a.inside && b.inside)) {
      const double outside_a = outside(a), outside_b = outside(b);
      if (outside_a != outside_b) return outside_a < outside_b;
    }
    return miss(a) < miss(b);
  }

  // result[sample][branch]
  std::vector<std::vector<Member>> evaluate(const std::vector<Angles>& samples) const {
    const size_t lanes = static_cast<size_t>(problem_.lanes);
    std::vector<std::vector<Member>> result(samples.size());
    std::vector<Candidate> of_lane[WIDEST];
    for (size_t first = 0; first < samples.size(); first += lanes) {
      FreeDirections free{};
      for (size_t l = 0; l < lanes; ++l) {
        const Angles& a = samples[std::min(first + l, samples.size() - 1)];
        for (size_t slot = 0; slot < SLOTS; ++slot) {
          free.cosine[slot][l] = std::cos(a[slot]);
          free.sine[slot][l] = std::sin(a[slot]);
        }
      }
      const size_t used = std::min(lanes, samples.size() - first);
      problem_.evaluate(free, static_cast<int>(used), of_lane);
      for (size_t l = 0; l < used; ++l)
        for (Candidate& c : of_lane[l]) result[first + l].push_back({std::move(c), samples[first + l]});
    }
    return result;
  }

  Candidate refined(Member best, int branch, unsigned slots) const {
    double width = TWO_PI / COARSE;
    for (int round = 0; round < MOST_ROUNDS; ++round) {
      if (round >= ROUNDS && (best.candidate.verified || error(best.candidate) > HOPELESS)) break;
      for (size_t slot = 0; slot < SLOTS; ++slot) {
        if (!(slots >> slot & 1u)) continue;
        std::vector<Angles> samples(FINE, best.angles);
        for (int k = 0; k < FINE; ++k) samples[static_cast<size_t>(k)][slot] += width * (2.0 * k / (FINE - 1) - 1.0);
        for (auto& members : evaluate(samples)) {
          Member& m = members[static_cast<size_t>(branch)];
          if (better(m.candidate, best.candidate)) best = m;
        }
      }
      width *= 2.0 / (FINE - 1);
    }
    return best.candidate;
  }

 private:
  // how far the worst joint is outside its limits
  double outside(const Candidate& c) const {
    double largest = 0.0;
    for (size_t j = 0; j < c.q.size(); ++j)
      largest = std::max({largest, problem_.chain.lower[j] - c.q[j], c.q[j] - problem_.chain.upper[j]});
    return largest;
  }
  double miss(const Candidate& c) const {
    double largest = 0.0;
    for (size_t j = 0; j < c.q.size(); ++j) largest = std::max(largest, std::fabs(c.q[j] - reference_[j]));
    return largest;
  }

  const ContinuumProblem& problem_;
  const std::vector<double>& reference_;
};

}  // namespace

std::vector<Candidate> representatives(const ContinuumProblem& problem, const std::vector<double>& reference,
                                       unsigned slots) {
  // one free angle: evenly round the circle; several: the R_3 low-discrepancy sequence
  const double stride[3] = {0.8191725133961645, 0.6710436067037893, 0.5497004779019703};
  const bool one_slot = (slots & (slots - 1u)) == 0;
  std::vector<Angles> samples(COARSE, Angles{});
  for (int k = 0; k < COARSE; ++k) {
    size_t rank = 0;
    for (size_t slot = 0; slot < SLOTS; ++slot)
      if (slots >> slot & 1u)
        samples[static_cast<size_t>(k)][slot] =
            TWO_PI * (one_slot ? k / double(COARSE) : std::fmod(0.5 + k * stride[rank++ % 3], 1.0));
  }
  const Search search(problem, reference);
  const auto ring = search.evaluate(samples);
  std::vector<Candidate> found;
  for (int b = 0; b < problem.branches; ++b) {
    auto member = [&](size_t k) -> const Member& { return ring[k % COARSE][static_cast<size_t>(b)]; };
    size_t best = 0;
    for (size_t k = 1; k < COARSE; ++k)
      if (search.better(member(k).candidate, member(best).candidate)) best = k;
    if (member(best).candidate.verified || !one_slot) {
      found.push_back(search.refined(member(best), b, slots));
      continue;
    }
    for (size_t k = 0; k < COARSE; ++k) {
      const double here = error(member(k).candidate);
      if (here < error(member(k + 1).candidate) && here <= error(member(k + COARSE - 1).candidate))
        found.push_back(search.refined(member(k), b, slots));
    }
    if (found.empty() || found.back().branch != b) found.push_back(member(best).candidate);
  }
  return found;
}

}  // namespace kinverse
