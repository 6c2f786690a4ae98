// The step of damped least squares on the joints that are free to move.
#pragma once

#include "residual.hpp"

namespace kinverse::KINVERSE_ISA {

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

}  // namespace kinverse::KINVERSE_ISA
