// Newton's iteration for a pose of a six-joint arm: it polishes the roots of an elimination, and makes
// solutions of starts.
#pragma once

#include "candidate.hpp"
#include "kernels.hpp"

namespace kinverse::KINVERSE_ISA {

// One damped Newton step on the true chain towards `target`, lengths in units of `size`. Returns the
// squared error before the step; `pivot` is the smallest of J J^T.
template <int W>
KINVERSE_INLINE Pack<W> newton_step(const Chain& chain, double size, const Frame<Pack<W>>& target, Pack<W>* q,
                                    Pack<W>& pivot) {
  using P = Pack<W>;
  P J[6][6], e[6];
  const Frame<P> reached = forward<W>(chain, q, J);
  const P unit(1.0 / size);
  const Vec3<P> dp = scaled(unit, target.p - reached.p), m = rotation_moment(target, reached);
  const P trace = dot(target.x, reached.x) + dot(target.y, reached.y) + dot(target.z, reached.z);
  // 2 sin(angle / 2) along the axis
  const P stretch = P(2.0) / sqrt(max(trace + P(1.0), P(1e-4)));
  e[0] = dp.x, e[1] = dp.y, e[2] = dp.z;
  e[3] = m.x * stretch, e[4] = m.y * stretch, e[5] = m.z * stretch;
  P error(0.0);
  for (int k = 0; k < 6; ++k) error = e[k] * e[k] + error;
  for (int i = 0; i < 6; ++i) {
    P* column = J[chain.source[i]];
    const P length(chain.prismatic[i] ? size : 1.0);  // slides are measured in sizes too
    for (int k = 0; k < 3; ++k) column[k] = P(column[k] * unit) * length;
    for (int k = 3; k < 6; ++k) column[k] = column[k] * length;
  }
  const P mu = P(1e-3) * error + P(1e-16);
  P H[6][6], D[6];
  for (int r = 0; r < 6; ++r) {
    for (int c = 0; c <= r; ++c) {
      P sum = r == c ? mu : P(0.0);
      for (int j = 0; j < 6; ++j) sum = J[j][r] * J[j][c] + sum;
      H[r][c] = sum;
    }
  }
  pivot = P(1e300);
  for (int j = 0; j < 6; ++j) {
    P L[6], d = H[j][j];
    for (int k = 0; k < j; ++k) {
      L[k] = H[j][k] * D[k];
      d = d - H[j][k] * L[k];
    }
    pivot = min(pivot, d);
    D[j] = P(1.0) / max(d, P(1e-17));
    for (int i = j + 1; i < 6; ++i) {
      P t = H[i][j];
      for (int k = 0; k < j; ++k) t = t - H[i][k] * L[k];
      H[i][j] = t;
    }
  }
  // H holds L D below the diagonal
  for (int i = 0; i < 6; ++i) {
    for (int k = 0; k < i; ++k) e[i] = e[i] - H[i][k] * e[k];
    e[i] = e[i] * D[i];
  }
  for (int i = 5; i >= 0; --i) {
    P t(0.0);
    for (int k = i + 1; k < 6; ++k) t = H[k][i] * e[k] + t;
    e[i] = e[i] - D[i] * t;
  }
  for (int i = 0; i < 6; ++i) {
    const int j = chain.source[i];
    P step(0.0);
    for (int k = 0; k < 6; ++k) step = J[j][k] * e[k] + step;
    q[j] = step * P(chain.prismatic[i] ? size : 1.0) + q[j];
  }
  return error;
}

constexpr double SINGULAR_PIVOT = 1e-12;  // of J J^T in units of the arm's size

// Newton steps, then winding, limits and errors; stored from lane `first` of the block on.
template <int W>
KINVERSE_INLINE void polish(const Chain& chain, double size, int most_steps, const Tolerances& tolerances,
                            const Frame<Pack<W>>& target, const double* reference, Pack<W>* q, RootBlock& block,
                            int first, int count) {
  using P = Pack<W>;
  // At a double root the error falls by 16 a step and no faster, and roots come apart only in the last
  // digits: go on as long as some root gains.
  P pivot, last(1e300);
  for (int step = 0; step < most_steps; ++step) {
    const P error = newton_step<W>(chain, size, target, q, pivot);
    const P wanted = step < 12 ? P(1e300) : P(0.5) * last;
    if (!any((error > P(1e-27)) & (error < P(100.0)) & (error < wanted))) break;
    last = error;
  }
  for (int i = 0; i < 6; ++i) {
    const int j = chain.source[i];
    if (!chain.prismatic[i])
      q[j] = wind(q[j], P(reference[j]), P(chain.lower[j]), P(chain.upper[j]), tolerances.hold_limits);
  }
  const Checked<W> checked = check(chain, Task::pose, target, q, tolerances.position, tolerances.rotation);
  store_checked(checked, q, 6, block.value, first);
  const unsigned used = count - first < W ? (1u << (count - first)) - 1u : ~0u;
  const Mask<W> exact = checked.within(tolerances.exact_position, tolerances.exact_rotation);
  block.exact |= (lane_bits(exact) & used) << first;
  block.verified |= (lane_bits(checked.verified) & used) << first;
  block.inside |= (lane_bits(checked.inside) & used) << first;
  block.singular |= (lane_bits(pivot < P(SINGULAR_PIVOT)) & used) << first;
}

}  // namespace kinverse::KINVERSE_ISA
