// The starts of the least-squares iteration: which start of which pose each lane works on, and which
// of them is the answer. Of several starts of a pose the lowest-numbered that converges wins, whichever
// lanes did the work and however soon they were done.
#pragma once

#include "least_squares_problem.hpp"
#include "se3.hpp"

namespace kinverse::KINVERSE_ISA {

// A start must bring its squared error down by the factor within the window. The first starts are
// left early, for most of them another start is cheaper; the later ones, which only hard poses see,
// get the patience that singular targets need.
constexpr double STALL_WINDOW = 2.0, STALL_FACTOR = 0.24;
constexpr int PATIENT_START = 24;
constexpr double PATIENT_WINDOW = 12.0, PATIENT_FACTOR = 0.5;
constexpr double HUGE_ERROR = 1e300;

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

// `N` joints, all turning and plain; 0: as the problem says.
template <int W, int N>
class Starts {
  using P = Pack<W>;
  static constexpr int SIZE = N ? N : MAX_JOINTS;

 public:
  Starts(const LeastSquaresProblem& problem, const LeastSquaresInput& in, long count, const LeastSquaresOutput& out)
      : problem(problem), in(in), out(out), count(count) {
    for (int s = 0; s < W; ++s) slots[s].running = 0;
    for (int l = 0; l < W; ++l) {
      slot_of[l] = -1;
      resting[l] = false;
    }
  }

  // lanes at work
  int live = 0;
  long began[W];  // iteration at which the lane's start was first evaluated
  alignas(64) double window[W], factor[W], deadline[W];
  alignas(64) double lower[SIZE][W], upper[SIZE][W];
  alignas(64) double fresh_q[SIZE][W];  // where a lane that was given a start begins

  bool idle(int l) const { return slot_of[l] < 0; }
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

  // The start in lane l has ended: book it, free the lanes whose work it makes useless, and go on with
  // the pose's next start if it needs one (true).
  KINVERSE_INLINE bool finish(int l, double (*q)[W], double error, long iteration, Stop stop) {
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

 private:
  KINVERSE_INLINE int dof() const { return N ? N : problem.dof; }
  KINVERSE_INLINE bool turns(int j) const { return N || problem.turns[j]; }

  KINVERSE_INLINE void begin(int l, int s, long when) {
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

  const LeastSquaresProblem& problem;
  const LeastSquaresInput& in;
  const LeastSquaresOutput& out;
  const long count;
  long next_pose = 0;
  Slot slots[W];
  int slot_of[W], start_of[W];
  bool resting[W];
  alignas(64) double target[12][W];
};

}  // namespace kinverse::KINVERSE_ISA
