// How far the joints move between two sets of joint values, all pairs: the innermost loop of the
// shortest path.
#pragma once

#include "kernels.hpp"
#include "simd.hpp"

namespace kinverse::KINVERSE_ISA {

// The steps from `count` joint values to one. `from` holds a row of `stride` values for each joint,
// a multiple of WIDEST; turning joints take the shorter way round, for the whole turns are chosen
// later. Infinite where any joint moves further than its limit.
template <int W, bool SQUARES>
KINVERSE_INLINE void joint_steps_to(const StepSpec& spec, const double* from, long count, long stride, const double* to,
                                    double* step) {
  using P = Pack<W>;
  for (long first = 0; first < count; first += W) {
    P size(0.0);
    Mask<W> over = Mask<W>::all(false);
    for (int j = 0; j < spec.dof; ++j) {
      P d = load<W>(from + j * stride + first) - P(to[j]);
      if (spec.turns[j]) d = d - round(P(d * P(1.0 / TWO_PI))) * P(TWO_PI);
      d = abs(d);
      over = over | (d > P(spec.limit[j]));
      const P weighted = d * P(spec.weight[j]);
      size = SQUARES ? weighted * weighted + size : max(size, weighted);
    }
    store(step + first, select(over, P(__builtin_inf()), SQUARES ? sqrt(size) : size));
  }
}

// (tos, stride) steps.
template <int W>
void joint_steps(const StepSpec& spec, const double* from, long count, long stride, const double* to, long tos,
                 double* step) {
  for (long b = 0; b < tos; ++b) {
    const double* target = to + b * spec.dof;
    if (spec.squares)
      joint_steps_to<W, true>(spec, from, count, stride, target, step + b * stride);
    else
      joint_steps_to<W, false>(spec, from, count, stride, target, step + b * stride);
  }
}

}  // namespace kinverse::KINVERSE_ISA
