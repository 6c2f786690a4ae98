// From a chain and settings to the problem that the kernel takes.
#pragma once

#include <vector>

#include "least_squares_problem.hpp"
#include "owned_chain.hpp"
#include "verify.hpp"

namespace kinverse {

struct LeastSquaresSettings {
  Choice choice;
  Method method = Method::levenberg_marquardt;
  double weight_position = 1.0, weight_rotation = 1.0;
  double max_distance = __builtin_inf();
  double damping = 0.0, step_tolerance = 0.0, gradient_tolerance = 0.0;
  int max_starts = 200, max_iterations = 60;
};

// What the iteration says of each pose, not yet verified.
struct Estimate {
  Estimate(long poses, int dof);
  LeastSquaresOutput from(long pose, int dof, int* work);
  std::vector<double> q;  // (poses, dof): of the start that converged first in order, else of the best
  std::vector<std::uint8_t> found, stop;
  std::vector<std::int64_t> evaluations, iterations, starts;
};

class LeastSquares {
 public:
  LeastSquares(const OwnedChain& chain, const LeastSquaresSettings& settings);
  int dof() const { return chain_.dof(); }
  const Choice& choice() const { return settings_.choice; }

  // T (poses, 16), checked. Poses are spread over the threads.
  Estimate propose(const double* T, long poses, const Seeds& seeds, std::uint64_t seed) const;
  // The same, verified; choice.all_windings is not for this path.
  Table solve(const double* T, long poses, const Seeds& seeds, std::uint64_t seed) const;
  // One start each, from q_start (poses, dof).
  Estimate refine(const double* T, long poses, const double* q_start) const;
  // Poses in sequence, each from the last solution (q_start for the first) and no joint further from
  // it than `max_step`. A pose that is not found leaves the sequence where it was.
  Table follow(const double* T, long poses, const double* q_start, std::uint64_t seed, double max_step) const;

 private:
  LeastSquaresProblem problem() const;
  void run(const LeastSquaresProblem& problem, const LeastSquaresInput& in, long poses, Estimate& estimate, long first) const;
  void verify_into(Table& table, const double* T, long poses, const Seeds& seeds, Estimate& estimate) const;

  OwnedChain chain_;
  LeastSquaresSettings settings_;
  std::vector<Link> links_;
  std::vector<double> base_, unit_, lower_, upper_, start_middle_, start_width_, start_step_;
  std::vector<std::uint8_t> slides_, whole_turns_;
  std::vector<bool> turns_;
  bool plain_;
  double tool_cosine_, tool_sine_, unit_length_;
};

}  // namespace kinverse
