// Nonlinear least squares on the error of a pose, one start of one pose per lane.
//
// Levenberg (1944), Marquardt (1963), projected on the joint limits; the classical iterations share
// the lanes and differ in their step only. Every start evolves independently of its neighbours, and
// of several starts of a pose the lowest-numbered that converges wins: so the answer does not depend
// on which lanes did the work.
#pragma once

#include "least_squares_problem.hpp"
#include "task_error.hpp"

namespace kinverse::KINVERSE_ISA {

constexpr int rows_of(Task task) {
  return task == Task::pose || task == Task::position_axis ? 6 : task == Task::schoenflies ? 4 : 3;
}

// Constants of the iteration, chosen by measurement (median, mean and p99 over 10,000 targets each of
// PUMA 560, UR5, Panda and iiwa14).
constexpr double FIRST_DAMPING = 0.036, LEAST_DAMPING = 1e-6, RAISED_DAMPING = 0.0324, MOST_DAMPING = 1e4;
constexpr double DAMPING_DOWN = 0.625, DAMPING_UP = 4.0;
constexpr double DAMPING_FLOOR = 1e-14;
// A start must bring its squared error down by the factor within the window. The first starts are
// left early, for most of them another start is cheaper; the later ones, which only hard poses see,
// get the patience that singular targets need.
constexpr double STALL_WINDOW = 2.0, STALL_FACTOR = 0.24;
constexpr int PATIENT_START = 24;
constexpr double PATIENT_WINDOW = 12.0, PATIENT_FACTOR = 0.5;
// So does any start that has come this close (squared error): near the boundary of the workspace the
// last steps only halve the error.
constexpr double CLOSE = 1e-5, CLOSE_FACTOR = 0.7;
constexpr double CONVERGED = 0.5;  // part of the tolerances at which a start has converged
constexpr double HUGE_ERROR = 1e300;
constexpr double LOST = 1e6;  // joint values beyond this are no longer an iteration

// A point of the iteration: residual, its derivative by the joints, and its squared parts.
template <int W, int ROWS, int SIZE>
struct Point {
  Pack<W> e[ROWS], J[SIZE][ROWS], position2, rotation2;
};

template <int W, Task TASK, int N>
struct Evaluator {
  using P = Pack<W>;
  static constexpr int ROWS = rows_of(TASK), SIZE = N ? N : MAX_JOINTS;
  using PointT = Point<W, ROWS, SIZE>;
  const LeastSquaresProblem& problem;

  KINVERSE_INLINE int joints() const { return N ? N : problem.joints; }
  KINVERSE_INLINE int dof() const { return N ? N : problem.dof; }

  KINVERSE_INLINE void advance(Frame<P>& f, const Link& link) const {
    P a(link.shift[0]), b(link.shift[1]), c(link.shift[2]), k(link.cosine), s(link.sine);
    f.p = {a * f.x.x + (b * f.y.x + (c * f.z.x + f.p.x)), a * f.x.y + (b * f.y.y + (c * f.z.y + f.p.y)),
           a * f.x.z + (b * f.y.z + (c * f.z.z + f.p.z))};
    Vec3<P> y = f.y, z = f.z;
    f.y = {k * y.x + s * z.x, k * y.y + s * z.y, k * y.z + s * z.z};
    f.z = {k * z.x - s * y.x, k * z.y - s * y.y, k * z.z - s * y.z};
  }
  static KINVERSE_INLINE void turn(Frame<P>& f, P c, P s) {
    Vec3<P> x = f.x, y = f.y;
    f.x = {c * x.x + s * y.x, c * x.y + s * y.y, c * x.z + s * y.z};
    f.y = {c * y.x - s * x.x, c * y.y - s * x.y, c * y.z - s * x.z};
  }

  // Go from `at` to q in the lanes that `accept` takes, judged by the new squared error.
  template <class Accept>
  KINVERSE_INLINE void operator()(const P* q, const Frame<P>& target, Accept accept, PointT& at) const {
    Vec3<P> axis[SIZE], origin[SIZE];
    Frame<P> f = constant_frame<P>(problem.base);
    for (int i = 0; i < joints(); ++i) {
      const Link& link = problem.links[i];
      if (i) advance(f, link);
      axis[i] = f.z;
      origin[i] = f.p;
      if constexpr (N) {
        P s, c;
        sincos(q[i] + P(link.offset), s, c);
        turn(f, c, s);
      } else {
        P value = P(link.multiplier) * q[link.source] + P(link.offset);
        if (link.prismatic) {
          f.p = {value * f.z.x + f.p.x, value * f.z.y + f.p.y, value * f.z.z + f.p.z};
          turn(f, P(link.turn_cosine), P(link.turn_sine));
        } else {
          P s, c;
          sincos(value, s, c);
          turn(f, c, s);
        }
      }
    }
    advance(f, problem.links[joints()]);
    P e[ROWS], position2, rotation2;
    residual(target, f, e, position2, rotation2);
    Vec3<P> row = log_row(target, f, e, rotation2);
    const Mask<W> taken = accept(position2 + rotation2);
    at.position2 = select(taken, position2, at.position2);
    at.rotation2 = select(taken, rotation2, at.rotation2);
    for (int k = 0; k < ROWS; ++k) at.e[k] = select(taken, e[k], at.e[k]);
    if constexpr (N) {
      for (int i = 0; i < N; ++i) {
        P column[ROWS];
        put(cross(axis[i], f.p - origin[i]), axis[i], f, row, column);
        for (int k = 0; k < ROWS; ++k) at.J[i][k] = select(taken, column[k], at.J[i][k]);
      }
    } else {
      P sums[SIZE][ROWS];
      for (int j = 0; j < dof(); ++j)
        for (int k = 0; k < ROWS; ++k) sums[j][k] = P(0.0);
      for (int i = 0; i < joints(); ++i) {
        const Link& link = problem.links[i];
        P column[ROWS];
        Vec3<P> still{P(0.0), P(0.0), P(0.0)};
        if (link.prismatic)
          put(axis[i], still, f, row, column);
        else
          put(cross(axis[i], f.p - origin[i]), axis[i], f, row, column);
        P rate(link.multiplier);
        for (int k = 0; k < ROWS; ++k) sums[link.source][k] = rate * column[k] + sums[link.source][k];
      }
      for (int j = 0; j < dof(); ++j)
        for (int k = 0; k < ROWS; ++k) at.J[j][k] = select(taken, sums[j][k], at.J[j][k]);
    }
  }

 private:
  // Rotation residual of a full pose: 2 sin(angle / 2) times the axis, which has a gradient up to a
  // half turn and no arc functions.
  static KINVERSE_INLINE void residual(const Frame<P>& target, const Frame<P>& f, P* e, P& position2, P& rotation2) {
    Vec3<P> d = target.p - f.p;
    e[0] = d.x;
    e[1] = d.y;
    if constexpr (TASK == Task::planar) {
      position2 = d.x * d.x + d.y * d.y;
    } else {
      e[2] = d.z;
      position2 = dot(d, d);
    }
    if constexpr (TASK == Task::pose) {
      P trace1 = P(1.0) + dot(target.x, f.x) + (dot(target.y, f.y) + dot(target.z, f.z));
      P factor = P(2.0) / sqrt(max(trace1, P(1e-30)));
      Vec3<P> r = scaled(factor, rotation_moment(target, f));
      unsigned turned = lane_bits(trace1 < P(4.0 * HALF_TURN * HALF_TURN));
      if (__builtin_expect(turned != 0, 0)) {
        Vec3<P> u{P(0.0), P(0.0), P(0.0)};
        half_turn_axis<W>(target, f, u, turned);
        Mask<W> there = lane_mask<W>(turned);
        r = {select(there, u.x + u.x, r.x), select(there, u.y + u.y, r.y), select(there, u.z + u.z, r.z)};
      }
      e[3] = r.x;
      e[4] = r.y;
      e[5] = r.z;
      rotation2 = dot(r, r);
    } else if constexpr (TASK == Task::position) {
      rotation2 = P(0.0);
    } else if constexpr (TASK == Task::position_axis) {
      Vec3<P> r = target.z - f.z;
      e[3] = r.x;
      e[4] = r.y;
      e[5] = r.z;
      rotation2 = dot(r, r);
    }
  }

  // Planar and Schoenflies tasks: the z component of log(R_target R^T), and its derivative, the z row
  // of the inverse right Jacobian of SO(3) (Chirikjian 2012, eq. 10.86).
  static KINVERSE_INLINE Vec3<P> log_row(const Frame<P>& target, const Frame<P>& f, P* e, P& rotation2) {
    Vec3<P> row{P(0.0), P(0.0), P(0.0)};
    if constexpr (TASK == Task::planar || TASK == Task::schoenflies) {
      P angle;
      Vec3<P> log = rotation_log<W>(target, f, angle);
      P angle2 = angle * angle;
      HalfAngle<P> half = half_angle(target, f);
      P exact = (P(1.0) - P(0.5) * angle * half.cosine / max(half.sine, P(1e-3))) / max(angle2, P(1e-6));
      P series = P(1.0 / 12.0) + angle2 * (P(1.0 / 720.0) + angle2 * P(1.0 / 30240.0));
      P k = select(angle2 < P(1e-2), series, exact);
      row = {k * log.z * log.x - P(0.5) * log.y, k * log.z * log.y + P(0.5) * log.x,
             P(1.0) + k * (log.z * log.z - angle2)};
      e[ROWS - 1] = log.z;
      rotation2 = log.z * log.z;
    }
    return row;
  }

  // One column of the derivative from a joint's linear and angular velocity of the tool.
  static KINVERSE_INLINE void put(Vec3<P> linear, Vec3<P> angular, const Frame<P>& f, Vec3<P> row, P* column) {
    column[0] = linear.x;
    column[1] = linear.y;
    if constexpr (TASK != Task::planar) column[2] = linear.z;
    if constexpr (TASK == Task::pose) {
      column[3] = angular.x;
      column[4] = angular.y;
      column[5] = angular.z;
    } else if constexpr (TASK == Task::position_axis) {
      Vec3<P> v = cross(angular, f.z);
      column[3] = v.x;
      column[4] = v.y;
      column[5] = v.z;
    } else if constexpr (TASK == Task::planar || TASK == Task::schoenflies) {
      column[ROWS - 1] = dot(row, angular);
    }
  }
};

// Solve A x = b in place for a symmetric positive A (lower triangle), by L D L^T without pivoting.
template <int W, int K>
KINVERSE_INLINE void solve_symmetric(Pack<W> (*A)[K], Pack<W>* b, int size) {
  using P = Pack<W>;
  P inverse[K];
  for (int j = 0; j < size; ++j) {
    P scaled_row[K];
    P d = A[j][j];
    for (int k = 0; k < j; ++k) {
      scaled_row[k] = A[j][k] * inverse[k];
      d = d - A[j][k] * scaled_row[k];
    }
    inverse[j] = P(1.0) / max(d, P(1e-18));
    for (int i = j + 1; i < size; ++i) {
      P t = A[i][j];
      for (int k = 0; k < j; ++k) t = t - A[i][k] * scaled_row[k];
      A[i][j] = t;
    }
  }
  for (int i = 0; i < size; ++i) {
    P t = b[i];
    for (int k = 0; k < i; ++k) t = t - A[i][k] * b[k];
    b[i] = t * inverse[i];
  }
  for (int i = size - 1; i >= 0; --i) {
    P t(0.0);
    for (int k = i + 1; k < size; ++k) t = t + A[k][i] * b[k];
    b[i] = b[i] - inverse[i] * t;
  }
}

// The damped step on the free joints: dq = F J^T (J F J^T + mu I)^-1 e, or by the normal equations
// where the joints are fewer than the rows. `free` is 1 for free joints and 0 for held ones.
template <int W, int ROWS, int SIZE>
KINVERSE_INLINE void damped_step(const Point<W, ROWS, SIZE>& at, const Pack<W>* free, const Pack<W>* gradient, Pack<W> mu,
                                 int dof, Pack<W>* dq) {
  using P = Pack<W>;
  if (SIZE >= ROWS && dof >= ROWS) {
    P A[ROWS][ROWS], y[ROWS];
    for (int r = 0; r < ROWS; ++r) {
      y[r] = at.e[r];
      for (int c = 0; c <= r; ++c) A[r][c] = r == c ? mu : P(0.0);
    }
    for (int j = 0; j < dof; ++j)
      for (int r = 0; r < ROWS; ++r) {
        P held = at.J[j][r] * free[j];
        for (int c = 0; c <= r; ++c) A[r][c] = held * at.J[j][c] + A[r][c];
      }
    solve_symmetric<W, ROWS>(A, y, ROWS);
    for (int j = 0; j < dof; ++j) {
      P s = at.J[j][0] * y[0];
      for (int r = 1; r < ROWS; ++r) s = at.J[j][r] * y[r] + s;
      dq[j] = s * free[j];
    }
  } else {
    P A[ROWS][ROWS], y[ROWS];
    for (int r = 0; r < dof; ++r) {
      y[r] = gradient[r] * free[r];
      for (int c = 0; c <= r; ++c) {
        P s = at.J[r][0] * at.J[c][0];
        for (int k = 1; k < ROWS; ++k) s = at.J[r][k] * at.J[c][k] + s;
        s = s * free[r] * free[c];
        A[r][c] = r == c ? s + mu + (P(1.0) - free[r]) : s;
      }
    }
    solve_symmetric<W, ROWS>(A, y, dof);
    for (int j = 0; j < dof; ++j) dq[j] = y[j] * free[j];
  }
}

// A pose being worked on, and how far its starts have come.
struct Slot {
  long pose;
  int next_start;  // the first that has not begun
  int winner;  // lowest start that has converged, max_starts if none
  int running;  // lanes at work on it
  double best_error;  // of the starts that failed
  int best_start;
  bool shifted;
  double lower[MAX_JOINTS], upper[MAX_JOINTS], first[MAX_JOINTS], low[MAX_JOINTS], width[MAX_JOINTS], shift[MAX_JOINTS];
};

KINVERSE_INLINE std::uint64_t splitmix(std::uint64_t x) {
  x += 0x9e3779b97f4a7c15ULL;
  x = (x ^ (x >> 30)) * 0xbf58476d1ce4e5b9ULL;
  x = (x ^ (x >> 27)) * 0x94d049bb133111ebULL;
  return x ^ (x >> 31);
}

KINVERSE_INLINE double nearest_winding(double q, double middle) {
  return q - TWO_PI * __builtin_rint((q - middle) / TWO_PI);
}

template <int W, Task TASK, int N>
class LeastSquaresLanes {
  using P = Pack<W>;
  using Eval = Evaluator<W, TASK, N>;
  static constexpr int ROWS = Eval::ROWS, SIZE = Eval::SIZE;

  const LeastSquaresProblem& problem;
  const LeastSquaresInput& in;
  const LeastSquaresOutput& out;
  const long count;
  const Eval evaluate;
  long next_pose = 0;
  int live = 0;
  Slot slots[W];
  int slot_of[W], start_of[W];
  bool resting[W];
  long began[W];  // iteration at which the lane's start was first evaluated
  alignas(64) double window[W], factor[W], deadline[W];
  alignas(64) double target[12][W], lower[SIZE][W], upper[SIZE][W], fresh_q[SIZE][W];

  KINVERSE_INLINE int dof() const { return N ? N : problem.dof; }
  KINVERSE_INLINE bool turns(int j) const { return N || problem.turns[j]; }

 public:
  LeastSquaresLanes(const LeastSquaresProblem& problem, const LeastSquaresInput& in, long count, const LeastSquaresOutput& out)
      : problem(problem), in(in), out(out), count(count), evaluate{problem} {}

  void run() {
    using Point = typename Eval::PointT;
    const Method method = problem.method;
    const bool lm = N || method == Method::levenberg_marquardt;
    const double tol_p = CONVERGED * problem.tol_position, tol_r = CONVERGED * problem.tol_rotation;
    const P tol_p2(tol_p * tol_p), tol_r2(tol_r * tol_r);
    for (int s = 0; s < W; ++s) slots[s].running = 0;
    for (int l = 0; l < W; ++l) {
      slot_of[l] = -1;
      resting[l] = false;
    }
    for (int l = 0; l < W; ++l) assign(l, 0);
    if (!live) return;
    P q[SIZE];
    for (int j = 0; j < dof(); ++j) q[j] = load<W>(fresh_q[j]);
    Point at;
    at.position2 = at.rotation2 = P(0.0);
    for (int k = 0; k < ROWS; ++k) {
      at.e[k] = P(0.0);
      for (int j = 0; j < dof(); ++j) at.J[j][k] = P(0.0);
    }
    evaluate(q, frame(), [](P) { return Mask<W>::all(true); }, at);
    const P first = lm ? P(FIRST_DAMPING) : P(1.0);
    P error = at.position2 + at.rotation2, damping = first, mark = error, marked(0.0);
    for (long iteration = 0;; ++iteration) {
      Mask<W> converged = (at.position2 <= tol_p2) & (at.rotation2 <= tol_r2);
      P now(static_cast<double>(iteration));
      Mask<W> ended = converged, stalled = Mask<W>::all(false);
      if (lm) {
        Mask<W> due = (now - marked) >= load<W>(window);
        P allowed = select(error < P(CLOSE), P(CLOSE_FACTOR), load<W>(factor));
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
        Mask<W> held = ((q[j] <= load<W>(lower[j])) & (g < P(0.0))) | ((q[j] >= load<W>(upper[j])) & (g > P(0.0)));
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
        qn[j] = min(load<W>(upper[j]), max(load<W>(lower[j]), q[j] + dq[j]));
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
      const unsigned ending = lane_bits(ended | (now >= load<W>(deadline)));
      unsigned fresh = 0;
      if (ending) {
        alignas(64) double last[SIZE][W], errors[W];
        for (int j = 0; j < dof(); ++j) {
          store(last[j], q[j]);
          store(fresh_q[j], qn[j]);
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
          if (!(ending >> l & 1u) || slot_of[l] < 0) continue;
          Stop stop = ok >> l & 1u              ? Stop::residual
                      : stop_bits[2] >> l & 1u  ? Stop::diverged
                      : stop_bits[0] >> l & 1u  ? Stop::step
                      : stop_bits[1] >> l & 1u  ? Stop::gradient
                      : stuck >> l & 1u         ? Stop::stalled
                                                : Stop::iterations;
          // one more step is at hand and nearly free; a start that was a solution stays as it was
          bool better = stop == Stop::residual && (polish >> l & 1u) && iteration > began[l];
          if (finish(l, better ? fresh_q : last, errors[l], iteration, stop)) fresh |= 1u << l;
        }
        for (int l = 0; l < W; ++l)
          if (slot_of[l] < 0 && assign(l, iteration + 1)) fresh |= 1u << l;
        if (!live) return;
        for (int j = 0; j < dof(); ++j) qn[j] = load<W>(fresh_q[j]);
      }
      const Mask<W> begun = lane_mask<W>(fresh);
      const bool always = !N && (method == Method::newton_raphson || method == Method::damped_least_squares);
      Mask<W> taken;
      evaluate(qn, frame(),
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

 private:
  KINVERSE_INLINE Frame<P> frame() const {
    auto at = [this](int k) { return load<W>(target[k]); };
    return {{at(0), at(4), at(8)}, {at(1), at(5), at(9)}, {at(2), at(6), at(10)}, {at(3), at(7), at(11)}};
  }

  // Give lane l something to do: the next pose, else a further start of the pose that has had fewest.
  bool assign(int l, long when) {
    int s = -1;
    while (s < 0 && next_pose < count) {
      for (s = 0; slots[s].running; ++s) {
      }
      if (!open(s, next_pose++)) s = -1;
    }
    if (s < 0) {
      for (int k = 0; k < W; ++k) {
        const Slot& slot = slots[k];
        if (slot.running && slot.winner == problem.max_starts && slot.next_start < problem.max_starts &&
            (in.eager || slot.next_start > 1) && (s < 0 || slot.next_start < slots[s].next_start))
          s = k;
      }
    }
    if (s < 0) {
      if (!resting[l]) rest(l);
      return false;
    }
    begin(l, s, when);
    return true;
  }

  void begin(int l, int s, long when) {
    Slot& slot = slots[s];
    slot_of[l] = s;
    start_of[l] = slot.next_start++;
    began[l] = when;
    resting[l] = false;
    deadline[l] = static_cast<double>(when + problem.max_iterations);
    window[l] = start_of[l] < PATIENT_START ? STALL_WINDOW : PATIENT_WINDOW;
    factor[l] = start_of[l] < PATIENT_START ? STALL_FACTOR : PATIENT_FACTOR;
    ++slot.running;
    ++live;
    const double* T = in.T + 16 * slot.pose;
    const double c = problem.tool_cosine, d = problem.tool_sine;
    for (int r = 0; r < 3; ++r) {
      // the last turn about z of the arm, undone on the target
      target[4 * r][l] = T[4 * r] * c - T[4 * r + 1] * d;
      target[4 * r + 1][l] = T[4 * r] * d + T[4 * r + 1] * c;
      target[4 * r + 2][l] = T[4 * r + 2];
      target[4 * r + 3][l] = T[4 * r + 3] / problem.unit_length;
    }
    for (int j = 0; j < dof(); ++j) {
      lower[j][l] = problem.clamp ? slot.lower[j] : -__builtin_inf();
      upper[j][l] = problem.clamp ? slot.upper[j] : __builtin_inf();
      fresh_q[j][l] = slot.first[j];
    }
    if (start_of[l] == 0) return;
    if (!slot.shifted) shift(slot);
    for (int j = 0; j < dof(); ++j) {
      double x = slot.shift[j] + problem.start_step[j] * start_of[l];
      x -= __builtin_floor(x);
      fresh_q[j][l] = slot.low[j] + slot.width[j] * x;
    }
  }

  void rest(int l) {
    resting[l] = true;
    window[l] = factor[l] = deadline[l] = HUGE_ERROR;
    for (int k = 0; k < 12; ++k) target[k][l] = 0.0;
    for (int j = 0; j < dof(); ++j) lower[j][l] = upper[j][l] = fresh_q[j][l] = 0.0;
  }

  // Cranley-Patterson shift of the starts, keyed by the caller's seed and the pose alone.
  void shift(Slot& slot) {
    std::uint64_t h = splitmix(in.seed);
    for (int k = 0; k < 12; ++k) {
      double x = in.T[16 * slot.pose + k] + 0.0;
      std::uint64_t bits;
      __builtin_memcpy(&bits, &x, 8);
      h = (h ^ bits) * 0x9fb21c651e98df25ULL;
      h ^= h >> 29;
    }
    for (int j = 0; j < dof(); ++j) {
      h = splitmix(h);
      slot.shift[j] = static_cast<double>(h >> 11) * 0x1p-53;
    }
    slot.shifted = true;
  }

  // The box of a pose and its first start; false if the box is empty.
  bool open(int s, long pose) {
    Slot& slot = slots[s];
    slot.pose = pose;
    slot.next_start = 0;
    slot.winner = slot.best_start = problem.max_starts;
    slot.best_error = __builtin_inf();
    slot.shifted = false;
    const double* seed = in.q_seed ? in.q_seed + pose * in.seed_stride : nullptr;
    const double* centre = in.q_centre ? in.q_centre : seed;
    bool empty = false;
    for (int j = 0; j < dof(); ++j) {
      double low = problem.lower[j], high = problem.upper[j], middle = problem.start_middle[j];
      if (centre && problem.max_distance < __builtin_inf()) {
        double distance = problem.max_distance / problem.unit[j], c = centre[j] / problem.unit[j];
        low = low > c - distance ? low : c - distance;
        high = high < c + distance ? high : c + distance;
        empty |= low > high;
      }
      double q = seed ? seed[j] / problem.unit[j] : middle;
      if (seed && (q < low || q > high) && turns(j)) {
        double wound = nearest_winding(q, 0.5 * (low + high));
        if (wound >= low && wound <= high) q = wound;
      }
      q = q < low ? low : q > high ? high : q;
      if (problem.centre_on_seed && seed) middle = q;
      double half = 0.5 * problem.start_width[j], from = middle - half, to = middle + half;
      from = from < low ? low : from;
      to = to > high ? high : to;
      if (from > to) {
        from = low;
        to = high;
      }
      slot.lower[j] = low;
      slot.upper[j] = high;
      slot.first[j] = q;
      slot.low[j] = from;
      slot.width[j] = to - from;
    }
    if (empty) {
      alignas(64) double first[SIZE][W];
      for (int j = 0; j < dof(); ++j) first[j][0] = slot.first[j];
      keep(slot, 0, first, 0, Stop::limits);
      close(s, false, 0);
    }
    return !empty;
  }

  void keep(const Slot& slot, int l, const double (*q)[W], int iterations, Stop stop) {
    for (int j = 0; j < dof(); ++j) out.q[slot.pose * dof() + j] = q[j][l] * problem.unit[j];
    out.iterations[slot.pose] = iterations;
    out.stop[slot.pose] = static_cast<std::uint8_t>(stop);
  }

  void close(int s, bool found, int starts) {
    const Slot& slot = slots[s];
    const int* evaluations = out.work + s * problem.max_starts;
    std::int64_t sum = 0;
    for (int k = 0; k < starts; ++k) sum += evaluations[k];
    out.found[slot.pose] = found;
    out.evaluations[slot.pose] = sum;
    out.starts[slot.pose] = starts;
  }

  // The start in lane l has ended: book it, free the lanes whose work it makes useless, and go on with
  // the pose's next start if it needs one (true).
  bool finish(int l, double (*q)[W], double error, long iteration, Stop stop) {
    const int s = slot_of[l], start = start_of[l], iterations = static_cast<int>(iteration - began[l]);
    Slot& slot = slots[s];
    out.work[s * problem.max_starts + start] = iterations + 1;
    if (stop == Stop::residual && !problem.clamp && !settle(slot, l, q)) stop = Stop::limits;
    release(l);
    if (stop == Stop::residual) {
      slot.winner = start;
      keep(slot, l, q, iterations, stop);
      for (int k = 0; k < W; ++k)
        if (slot_of[k] == s && start_of[k] > start) release(k);
    } else if (slot.winner == problem.max_starts) {
      bool best = error < slot.best_error || (error == slot.best_error && start < slot.best_start);
      if (best || slot.best_start == problem.max_starts) {
        slot.best_error = error;
        slot.best_start = start;
        keep(slot, l, q, iterations, stop);
      }
      if (slot.next_start < problem.max_starts) {
        begin(l, s, iteration + 1);
        return true;
      }
    }
    if (!slot.running) {
      const bool found = slot.winner < problem.max_starts;
      close(s, found, found ? slot.winner + 1 : problem.max_starts);
    }
    return false;
  }

  void release(int l) {
    --slots[slot_of[l]].running;
    --live;
    slot_of[l] = -1;
  }

  // Joint values found without regard to the limits: the winding inside the box, if there is one.
  bool settle(const Slot& slot, int l, double (*q)[W]) {
    bool inside = true;
    for (int j = 0; j < dof(); ++j) {
      double value = q[j][l];
      if ((value < slot.lower[j] || value > slot.upper[j]) && turns(j)) value = nearest_winding(value, 0.5 * (slot.lower[j] + slot.upper[j]));
      inside &= value >= slot.lower[j] && value <= slot.upper[j];
      q[j][l] = value;
    }
    return inside;
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
