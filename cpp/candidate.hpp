// From joint values that a solver proposes to joint values that are known to be right: the winding,
// the limits, and the error measured by the robot's own forward kinematics.
#pragma once

#include "kinematics.hpp"
#include "task_error.hpp"

namespace kinverse::KINVERSE_ISA {

// How far outside a limit a value counts as rounding and is moved onto it.
constexpr double LIMIT_SLACK = 1e-9;

// The whole turn that brings q nearest to `reference` (which lies inside the limits), one step
// aside if that is outside the limits and its neighbour is not.
template <int W>
KINVERSE_INLINE Pack<W> wind(Pack<W> q, Pack<W> reference, Pack<W> lower, Pack<W> upper, bool hold_limits) {
  using P = Pack<W>;
  q = q + round<W>((reference - q) * P(1.0 / TWO_PI)) * P(TWO_PI);
  if (!hold_limits) return q;
  const P slack(LIMIT_SLACK), turn(TWO_PI);
  q = select((q > upper + slack) & (q - turn >= lower - slack), q - turn, q);
  return select((q < lower - slack) & (q + turn <= upper + slack), q + turn, q);
}

template <int W>
struct Checked {
  Pack<W> position_error, rotation_error;
  Mask<W> verified, inside;

  KINVERSE_INLINE Mask<W> within(double position, double rotation) const {
    return (position_error <= Pack<W>(position)) & (rotation_error <= Pack<W>(rotation));
  }
};

// Joint values, then the two errors, one row each, from lane `first` of the rows on.
template <int W, int LENGTH>
KINVERSE_INLINE void store_checked(const Checked<W>& checked, const Pack<W>* q, int dof, double (*row)[LENGTH], int first) {
  for (int j = 0; j < dof; ++j) store(row[j] + first, q[j]);
  store(row[dof] + first, checked.position_error);
  store(row[dof + 1] + first, checked.rotation_error);
}

// Moves q onto its limits where it is outside by rounding only, and measures its error; `reach` is the
// chain's forward kinematics.
template <int W, class Reach>
KINVERSE_INLINE Checked<W> check(const Chain& chain, Task task, const Frame<Pack<W>>& target, Pack<W>* q,
                                 double tol_position, double tol_rotation, Reach reach) {
  using P = Pack<W>;
  Checked<W> result;
  result.inside = Mask<W>::all(true);
  for (int j = 0; j < chain.dof; ++j) {
    P low(chain.lower[j]), high(chain.upper[j]), slack(LIMIT_SLACK);
    q[j] = select((q[j] < low) & (q[j] >= low - slack), low, q[j]);
    q[j] = select((q[j] > high) & (q[j] <= high + slack), high, q[j]);
    result.inside = result.inside & (q[j] >= low) & (q[j] <= high);
  }
  task_errors<W>(task, target, reach(q), result.position_error, result.rotation_error);
  result.verified = result.within(tol_position, tol_rotation);
  return result;
}

template <int W>
KINVERSE_INLINE Checked<W> check(const Chain& chain, Task task, const Frame<Pack<W>>& target, Pack<W>* q,
                                 double tol_position, double tol_rotation) {
  return check(chain, task, target, q, tol_position, tol_rotation, [&](const Pack<W>* at) { return forward<W>(chain, at); });
}

// Forward kinematics of one configuration after another, from the first joint that differs: branches
// of a pose share their first joints. For chains whose joints stand at their own values.
template <int W, int MOST>
struct SharedForward {
  KINVERSE_INLINE explicit SharedForward(const Chain& chain) : chain(chain) {}

  const Chain& chain;
  Pack<W> held[MOST];
  Frame<Pack<W>> after[MOST];  // joint i
  int known = 0;

  KINVERSE_INLINE Frame<Pack<W>> operator()(const Pack<W>* q) {
    int first = 0;
    while (first < known && same_bits(q[first], held[first])) ++first;
    Frame<Pack<W>> f = first ? after[first - 1] : constant_frame<Pack<W>>(chain.frames);
    for (int i = first; i < chain.joints; ++i) {
      if (i) f = compose(f, chain.frames + 12 * i);
      f = move_joint(f, q[i], chain.prismatic[i]);
      held[i] = q[i];
      after[i] = f;
    }
    known = chain.joints;
    return compose(f, chain.frames + 12 * chain.joints);
  }
};

}  // namespace kinverse::KINVERSE_ISA
