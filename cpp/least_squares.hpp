// Nonlinear least squares on the error of a pose, one start of one pose per lane.
//
// Levenberg (1944), Marquardt (1963), projected on the joint limits; the classical iterations share
// the lanes and differ in their step only. Every start evolves independently of its neighbours: so the
// answer does not depend on which lanes did the work.
#pragma once

#include "damped_step.hpp"
#include "starts.hpp"

namespace kinverse::KINVERSE_ISA {

// Constants of the iteration, chosen by measurement (median, mean and p99 over 10,000 targets each of
// PUMA 560, UR5, Panda and iiwa14).
constexpr double FIRST_DAMPING = 0.036, LEAST_DAMPING = 1e-6, RAISED_DAMPING = 0.0324, MOST_DAMPING = 1e4;
constexpr double DAMPING_DOWN = 0.625, DAMPING_UP = 4.0;
constexpr double DAMPING_FLOOR = 1e-14;
// Patience (starts.hpp) is also for any start that has come this close (squared error): near the boundary
// of the workspace the last steps only halve the error.
constexpr double CLOSE = 1e-5, CLOSE_FACTOR = 0.7;
constexpr double CONVERGED = 0.5;  // part of the tolerances at which a start has converged
constexpr double LOST = 1e6;  // joint values beyond this are no longer an iteration

template <int W, Task TASK, int N>
class LeastSquaresLanes {
  using P = Pack<W>;
  using Eval = Evaluator<W, TASK, N>;
  static constexpr int ROWS = Eval::ROWS, SIZE = Eval::SIZE;

  const LeastSquaresProblem& problem;
  const Eval evaluate;
  Starts<W, N> starts;

  KINVERSE_INLINE int dof() const { return N ? N : problem.dof; }

 public:
  LeastSquaresLanes(const LeastSquaresProblem& problem, const LeastSquaresInput& in, long count, const LeastSquaresOutput& out)
      : problem(problem), evaluate{problem}, starts(problem, in, count, out) {}

  void run() {
    using Point = typename Eval::PointT;
    const Method method = problem.method;
    const bool lm = N || method == Method::levenberg_marquardt;
    const double tol_p = CONVERGED * problem.tol_position, tol_r = CONVERGED * problem.tol_rotation;
    const P tol_p2(tol_p * tol_p), tol_r2(tol_r * tol_r);
    for (int l = 0; l < W; ++l) starts.assign(l, 0);
    if (!starts.live) return;
    P q[SIZE];
    for (int j = 0; j < dof(); ++j) q[j] = load<W>(starts.fresh_q[j]);
    Point at;
    at.position2 = at.rotation2 = P(0.0);
    for (int k = 0; k < ROWS; ++k) {
      at.e[k] = P(0.0);
      for (int j = 0; j < dof(); ++j) at.J[j][k] = P(0.0);
    }
    evaluate(q, starts.frame(), [](P) { return Mask<W>::all(true); }, at);
    const P first = lm ? P(FIRST_DAMPING) : P(1.0);
    P error = at.position2 + at.rotation2, damping = first, mark = error, marked(0.0);
    for (long iteration = 0;; ++iteration) {
      Mask<W> converged = (at.position2 <= tol_p2) & (at.rotation2 <= tol_r2);
      P now(static_cast<double>(iteration));
      Mask<W> ended = converged, stalled = Mask<W>::all(false);
      if (lm) {
        Mask<W> due = (now - marked) >= load<W>(starts.window);
        P allowed = select(error < P(CLOSE), P(CLOSE_FACTOR), load<W>(starts.factor));
        stalled = (due & (error > allowed * mark)) | (damping > P(MOST_DAMPING));
        mark = select(due, error, mark);
        marked = select(due, now, marked);
        ended = ended | stalled;
      }
      P gradient[SIZE], free[SIZE], dq[SIZE], qn[SIZE];
      P slope2(0.0), length2(0.0);
      for (int j = 0; j < dof(); ++j) {
        P g = at.J[j][0] * at.e[0];
        for (int k = 1; k < ROWS; ++k) g = at.J[j][k] * at.e[k] + g;
        gradient[j] = g;
        Mask<W> held = ((q[j] <= load<W>(starts.lower[j])) & (g < P(0.0))) | ((q[j] >= load<W>(starts.upper[j])) & (g > P(0.0)));
        free[j] = select(held, P(0.0), P(1.0));
        if constexpr (!N) slope2 = slope2 + g * P(g * free[j]);
      }
      P mu = damping * sqrt(error) + P(DAMPING_FLOOR);
      if constexpr (!N) {
        if (method == Method::damped_least_squares)
          mu = P(problem.damping * problem.damping);
        else if (!lm)
          mu = P(DAMPING_FLOOR);
      }
      damped_step<W, ROWS, SIZE>(at, free, gradient, mu, dof(), dq);
      for (int j = 0; j < dof(); ++j) {
        if constexpr (!N) {
          if (method == Method::gauss_newton) dq[j] = dq[j] * damping;  // halved while the error rises
          length2 = length2 + dq[j] * dq[j];
        }
        qn[j] = min(load<W>(starts.upper[j]), max(load<W>(starts.lower[j]), q[j] + dq[j]));
      }
      Mask<W> small = Mask<W>::all(false), flat = small, lost = small;
      if constexpr (!N) {
        small = length2 <= P(problem.step_tolerance * problem.step_tolerance);
        flat = slope2 <= P(problem.gradient_tolerance * problem.gradient_tolerance);
        P reach(0.0);
        for (int j = 0; j < dof(); ++j) reach = max(reach, abs(qn[j]));
        lost = !((error < P(HUGE_ERROR)) & (reach < P(LOST)));
        ended = ended | small | flat | lost;
      }
      const unsigned ending = lane_bits(ended | (now >= load<W>(starts.deadline)));
      unsigned fresh = 0;
      if (ending) {
        alignas(64) double last[SIZE][W], errors[W];
        for (int j = 0; j < dof(); ++j) {
          store(last[j], q[j]);
          store(starts.fresh_q[j], qn[j]);
        }
        store(errors, error);
        // The step at hand is one more Newton step for free: taken if its linear model promises half
        // the error and what the model leaves out, bounded by the square of the way, is less still.
        P way(0.0), left[ROWS], promised(0.0);
        for (int k = 0; k < ROWS; ++k) left[k] = at.e[k];
        for (int j = 0; j < dof(); ++j) {
          P move = qn[j] - q[j];
          way = way + abs(move);
          for (int k = 0; k < ROWS; ++k) left[k] = left[k] - at.J[j][k] * move;
        }
        for (int k = 0; k < ROWS; ++k) promised = promised + left[k] * left[k];
        P square = way * way;
        unsigned ok = lane_bits(converged), polish = lane_bits((promised <= P(0.25) * error) & (P(16.0) * square * square <= error));
        unsigned stop_bits[3] = {lane_bits(small), lane_bits(flat), lane_bits(lost)}, stuck = lane_bits(stalled);
        for (int l = 0; l < W; ++l) {
          if (!(ending >> l & 1u) || starts.idle(l)) continue;
          Stop stop = ok >> l & 1u              ? Stop::residual
                      : stop_bits[2] >> l & 1u  ? Stop::diverged
                      : stop_bits[0] >> l & 1u  ? Stop::step
                      : stop_bits[1] >> l & 1u  ? Stop::gradient
                      : stuck >> l & 1u         ? Stop::stalled
                                                : Stop::iterations;
          // one more step is at hand and nearly free; a start that was a solution stays as it was
          bool better = stop == Stop::residual && (polish >> l & 1u) && iteration > starts.began[l];
          if (starts.finish(l, better ? starts.fresh_q : last, errors[l], iteration, stop)) fresh |= 1u << l;
        }
        for (int l = 0; l < W; ++l)
          if (starts.idle(l) && starts.assign(l, iteration + 1)) fresh |= 1u << l;
        if (!starts.live) return;
        for (int j = 0; j < dof(); ++j) qn[j] = load<W>(starts.fresh_q[j]);
      }
      const Mask<W> begun = lane_mask<W>(fresh);
      const bool always = !N && (method == Method::newton_raphson || method == Method::damped_least_squares);
      Mask<W> taken;
      evaluate(qn, starts.frame(),
               [&](P changed) {
                 taken = changed < error;
                 if (fresh) taken = taken | begun;
                 if (always) taken = Mask<W>::all(true);
                 error = select(taken, changed, error);
                 return taken;
               },
               at);
      for (int j = 0; j < dof(); ++j) q[j] = select(taken, qn[j], q[j]);
      if (lm)
        damping = select(taken, max(P(damping * P(DAMPING_DOWN)), P(LEAST_DAMPING)), max(P(damping * P(DAMPING_UP)), P(RAISED_DAMPING)));
      else if (method == Method::gauss_newton)
        damping = select(taken, P(1.0), P(damping * P(0.5)));
      if (fresh) {
        damping = select(begun, first, damping);
        mark = select(begun, error, mark);
        marked = select(begun, now + P(1.0), marked);
      }
    }
  }
};

template <int W, Task TASK, int N>
void least_squares_as(const LeastSquaresProblem& problem, const LeastSquaresInput& in, long count, const LeastSquaresOutput& out) {
  LeastSquaresLanes<W, TASK, N>(problem, in, count, out).run();
}

// Poses of T one after the other; see LeastSquaresOutput for what comes back.
template <int W>
void least_squares(const LeastSquaresProblem& problem, const LeastSquaresInput& in, long count, const LeastSquaresOutput& out) {
  const bool lanes = problem.plain && problem.method == Method::levenberg_marquardt && problem.step_tolerance == 0.0 &&
                     problem.gradient_tolerance == 0.0 && problem.clamp;
  switch (problem.task) {
    case Task::pose:
      if (lanes && problem.dof == 6) return least_squares_as<W, Task::pose, 6>(problem, in, count, out);
      if (lanes && problem.dof == 7) return least_squares_as<W, Task::pose, 7>(problem, in, count, out);
      return least_squares_as<W, Task::pose, 0>(problem, in, count, out);
    case Task::position:
      return least_squares_as<W, Task::position, 0>(problem, in, count, out);
    case Task::position_axis:
      return least_squares_as<W, Task::position_axis, 0>(problem, in, count, out);
    case Task::planar:
      return least_squares_as<W, Task::planar, 0>(problem, in, count, out);
    case Task::schoenflies:
      return least_squares_as<W, Task::schoenflies, 0>(problem, in, count, out);
  }
}

}  // namespace kinverse::KINVERSE_ISA
