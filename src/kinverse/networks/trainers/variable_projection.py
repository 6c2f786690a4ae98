"""Variable projection: Levenberg-Marquardt on the hidden weights alone.

The output layer is linear, so its best weights W follow from the hidden layer's outputs by least
squares; eliminating them (Golub & Pereyra 1973) leaves the hidden weights v, and of the residual
R(v) = Phi(v) W(v) - Y the exact Gauss-Newton matrix. With the rows Phi = [a, 1] (N, h + 1),
K = Phi^T Phi + lambda I and the derivative of unit j by the weights, dphi_j / dv:

    J^T J = sum_k (A_k^T A_k - B_k^T K^-1 B_k) + sum_k M_k^T (K^-1)_hh M_k
    A_k = sum_j W_jk dphi_j/dv,   B_k = Phi^T A_k,   M_k = rows sum_n r_nk dphi_nj/dv over j

(Kaufman 1975 drops the last sum, and is slower here.) For one hidden layer all of it comes from
one symmetric product, see ``_one_layer``. That matrix is drawn from a fresh random part of the
rows in each epoch; the residual, its gradient and the test whether a step is accepted use them all.
Damping follows Nielsen (1999).
"""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from kinverse.networks.activations import activation
from kinverse.networks.layers import Layers
from kinverse.networks.monitor import Monitor
from kinverse.networks.trainers import Task
from kinverse.networks.trainers.damping import Nielsen

__all__ = ["variable_projection"]

Array = NDArray[np.float64]
Rows = NDArray[np.int64]

RIDGE = 1e-4
"""lambda: what keeps K regular."""
PART_RIDGE = 1e-3
"""More of it where K is drawn from a part of the rows, in proportion to N / part."""
FIRST_ROWS, FIRST_EPOCHS = 1000, 14
"""Rows that the matrix is drawn from in the first epochs; later half of them."""
START_DAMPING, MOST_DAMPING = 1e-2, 1e12
REDRAWN_AFTER = 7
"""Rejected steps after which other rows are drawn."""
FIRST_NORM = 0.5
"""Scale of the first weights: half the units would saturate at Nguyen and Widrow's 0.7."""
LEAST_GRADIENT = 1e-9
CHUNK = 1000


class _State(NamedTuple):
    """Everything at one set of hidden weights, on all rows."""

    v: Array  # (Pv,) hidden weights
    outputs: list[Array]  # of each layer up to the last hidden one
    W: Array  # (h + 1, m) best output weights, the bias row last
    R: Array  # (N, m) residuals
    value: float  # (|R|^2 + lambda |W|^2) / 2


def variable_projection(task: Task, monitor: Monitor) -> None:
    """Train layers whose output is linear; an epoch is one accepted step."""
    search = _Search(task)
    state = search.at(search.start())
    damping, rejected = Nielsen(START_DAMPING), 0
    gradient = search.gradient(state)
    curvature = search.curvature(state, monitor.epochs)
    while np.abs(gradient).max() > LEAST_GRADIENT * len(task.X) and damping.mu < MOST_DAMPING:
        step = _solved(curvature, damping.mu, gradient)
        new = None if step is None else search.at(state.v + step)
        expected = 0.0 if step is None else 0.5 * float(step @ (damping.mu * step - gradient))
        if new is None or not new.value < state.value:
            damping.refuse()
            rejected += 1
            if rejected % REDRAWN_AFTER == 0:
                curvature = search.curvature(state, monitor.epochs)
            continue
        damping.accept((state.value - new.value) / max(expected, np.finfo(np.float64).tiny))
        rejected, state = 0, new
        if search.told(state, monitor):
            return
        gradient = search.gradient(state)
        curvature = search.curvature(state, monitor.epochs)
    monitor.stop("no step lowers the error any more")
    if monitor.best is None:
        search.told(state, monitor)


class _Search:
    """One training: its rows, and the quantities of the module's head."""

    def __init__(self, task: Task) -> None:
        self._task = task
        self._X, self._Y = task.X, task.Y
        sizes, names = task.layers.sizes, task.layers.activations
        self._hidden = Layers(sizes[:-1], names[:-1])

    def start(self) -> Array:
        """The first hidden weights."""
        if self._task.start is not None:
            return self._task.start[: self._hidden.count].copy()
        whole = self._task.layers.nguyen_widrow(self._task.rng, FIRST_NORM)
        return whole[: self._hidden.count]

    def at(self, v: Array) -> _State:
        """Outputs, best output weights and residuals of hidden weights."""
        from scipy.linalg import cho_solve

        outputs = self._hidden.outputs(v, self._X)
        Phi = _with_ones(outputs[-1])
        W = cho_solve(_factor(Phi, RIDGE), Phi.T @ self._Y, check_finite=False)
        R = Phi @ W
        R -= self._Y
        value = 0.5 * (float(np.vdot(R, R)) + RIDGE * float(np.vdot(W, W)))
        return _State(v, outputs, W, R, value)

    def gradient(self, state: _State) -> Array:
        """Derivatives (Pv,) of the value; W is the best, so it counts as fixed."""
        return self._hidden.gradient(state.v, state.outputs, state.R @ state.W[:-1].T)

    def curvature(self, state: _State, epochs: int) -> Array:
        """J^T J (Pv, Pv) from a fresh part of the rows, scaled to all of them."""
        rows = len(self._X)
        part = min(rows, FIRST_ROWS if epochs < FIRST_EPOCHS else max(FIRST_ROWS, rows // 2))
        # in order: neighbouring memory, and an odd row of the last chunk does not matter
        picked = np.sort(self._task.rng.choice(rows, part, replace=False))
        if part == rows:
            picked = np.arange(rows)
        ridge = RIDGE if part == rows else RIDGE + PART_RIDGE * rows / part
        of = _one_layer if len(self._hidden.activations) == 1 else _many_layers
        return of(self._hidden, state, picked, ridge)

    def told(self, state: _State, monitor: Monitor) -> bool:
        """Tell the monitor of an epoch; True: it says stop."""
        weights = np.concatenate([state.v, state.W.ravel()])
        return monitor.epoch(weights, np.mean(state.R * state.R, axis=0))


def _one_layer(hidden: Layers, state: _State, picked: Rows, ridge: float) -> Array:
    """The matrix by one symmetric product of [Phi, Z] over picked rows; the s_k are over all.

    The derivative of unit j by its weight from input a is Z_aj = slope_j x_a, and 0 for the other
    units. With S = W_h W_h^T and s_k = Z^T r_k the sums of the module's head become element by
    element products, S and K^-1 repeated for each pair of inputs:

        J^T J = (Z^T Z - B^T K^-1 B) o tile(S) + (sum_k s_k s_k^T) o tile((K^-1)_hh),  B = Phi^T Z
    """
    from scipy.linalg import cho_factor, cho_solve

    X, a = (layer[picked] for layer in state.outputs)
    n, h = X.shape[1], a.shape[1]
    derivative = activation(hidden.activations[0]).slope
    slope, scale = derivative(a), len(state.R) / len(picked)
    wide = h + 1 + (n + 1) * h
    product = np.zeros((wide, wide))
    buffer = np.empty((min(CHUNK, len(X)), wide))
    for k in range(0, len(X), CHUNK):
        rows = slice(k, k + CHUNK)
        block = buffer[: len(X[rows])]
        block[:, :h], block[:, h] = a[rows], 1.0
        Z = block[:, h + 1 :].reshape(len(block), n + 1, h)
        np.multiply(X[rows, :, None], slope[rows, None, :], out=Z[:, :n])
        Z[:, n] = slope[rows]
        product += block.T @ block
    product *= scale
    K = product[: h + 1, : h + 1]
    K[np.diag_indices(h + 1)] += ridge
    B = product[: h + 1, h + 1 :]
    factor = cho_factor(K, lower=True, check_finite=False)
    J = product[h + 1 :, h + 1 :] - B.T @ cho_solve(factor, B, check_finite=False)
    W = state.W[:-1]
    X, slope = state.outputs[0], derivative(state.outputs[1])
    s = np.stack(
        [np.concatenate([(X.T @ (slope * r[:, None])).ravel(), r @ slope]) for r in state.R.T]
    )
    inverse = cho_solve(factor, np.eye(h + 1), check_finite=False)[:h, :h]
    tiles = (n + 1, n + 1)
    J *= np.tile(W @ W.T, tiles)
    J += (s.T @ s) * np.tile(inverse, tiles)
    return np.asarray(J)


def _many_layers(hidden: Layers, state: _State, picked: Rows, ridge: float) -> Array:
    """The matrix by the hidden layers' own Jacobian over picked rows, in blocks of them."""
    from scipy.linalg import cho_solve

    X, R, scale = state.outputs[0][picked], state.R[picked], len(state.R) / len(picked)
    h, m, count = hidden.sizes[-1], R.shape[1], hidden.count
    W = state.W[:-1]
    Phi = _with_ones(state.outputs[-1][picked])
    JJ = np.zeros((count, count))
    B, M = np.zeros((m, h + 1, count)), np.zeros((m, h, count))
    for rows in hidden.blocks(X):
        by_unit = hidden.jacobian(state.v, X[rows])  # (rows, h, Pv)
        A = W.T @ by_unit  # (rows, m, Pv)
        flat = A.reshape(-1, count)
        JJ += flat.T @ flat
        for k in range(m):
            B[k] += Phi[rows].T @ A[:, k]
            M[k] += np.tensordot(R[rows, k], by_unit, axes=1)
    JJ, B, M = JJ * scale, B * scale, M * scale
    factor = _factor(Phi, ridge, scale)
    inverse = cho_solve(factor, np.eye(h + 1), check_finite=False)[:h, :h]
    for k in range(m):
        JJ += M[k].T @ inverse @ M[k] - B[k].T @ cho_solve(factor, B[k], check_finite=False)
    return JJ


def _with_ones(a: Array) -> Array:
    out = np.empty((len(a), a.shape[1] + 1))
    out[:, :-1], out[:, -1] = a, 1.0
    return out


def _factor(Phi: Array, ridge: float, scale: float = 1.0) -> tuple[Array, bool]:
    """Cholesky factor of scale Phi^T Phi + ridge I."""
    from scipy.linalg import cho_factor

    K = Phi.T @ Phi
    K *= scale
    K[np.diag_indices(len(K))] += ridge
    factor: tuple[Array, bool] = cho_factor(K, lower=True, check_finite=False)
    return factor


def _solved(curvature: Array, damping: float, gradient: Array) -> Array | None:
    """-(J^T J + mu I)^-1 g, or None where rounding has made the matrix indefinite."""
    from scipy.linalg import LinAlgError, cho_factor, cho_solve

    damped = curvature.copy()
    damped[np.diag_indices(len(damped))] += damping
    try:
        factor = cho_factor(damped, lower=True, overwrite_a=True, check_finite=False)
    except LinAlgError:
        return None
    step = np.asarray(cho_solve(factor, -gradient, check_finite=False))
    return step if np.isfinite(step).all() else None
