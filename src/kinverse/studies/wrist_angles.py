"""Joint angles of a wrist from a rotation, given as a matrix or as a quaternion.

Axes are named 0, 1, 2 for x, y, z. Formulas for any order of axes; parity is +1 where first, second
and third are in cyclic order.
"""

import math

from kinverse.studies.counted import Number, atan2, sqrt
from kinverse.studies.forms import Matrix, Pair

__all__ = ["three_axes", "two_axes"]


def three_axes(W: Matrix | Pair, i: int, j: int) -> list[tuple[Number, Number, Number]]:
    """Both (a, b, c) with ``W = R_i(a) R_j(b) R_i(c)``.

    From a quaternion: equations 4.197-4.199 of the thesis of Jha (2015) with the missing factor 2,
    for any axes. At b = 0 only a + c is defined and neither form tells.
    """
    k, parity = _third(i, j)
    if isinstance(W, Matrix):
        R = W.R
        b = atan2(sqrt(R[j][i] * R[j][i] + R[k][i] * R[k][i]), R[i][i])
        a = atan2(R[j][i], -parity * R[k][i])
        c = atan2(R[i][j], parity * R[i][k])
    else:
        w, qi, qj, qk = W.h[0], W.h[1 + i], W.h[1 + j], parity * W.h[1 + k]
        half = atan2(sqrt(qj * qj + qk * qk), sqrt(w * w + qi * qi))
        mean, difference = atan2(qi, w), atan2(qk, qj)
        a, b, c = mean + difference, half + half, mean - difference
    return [(a, b, c), (a + math.pi, -b, c + math.pi)]


def two_axes(W: Matrix | Pair, i: int, j: int) -> tuple[Number, Number, Number]:
    """(a, b) with ``W = R_i(a) R_j(b)``, and a number that is zero if there are such angles."""
    k, parity = _third(i, j)
    if isinstance(W, Matrix):
        R = W.R
        a = atan2(parity * R[k][j], R[j][j])
        b = atan2(parity * R[i][k], R[i][i])
        return a, b, R[i][j]
    w, qi, qj, qk = W.h[0], W.h[1 + i], W.h[1 + j], parity * W.h[1 + k]
    ww, ii, jj, kk = w * w, qi * qi, qj * qj, qk * qk
    wi, jk = w * qi + qj * qk, w * qj + qi * qk
    across, along = ww - kk, ii - jj
    a = atan2(wi + wi, across - along)
    b = atan2(jk + jk, across + along)
    return a, b, qi * qj - w * qk


def _third(i: int, j: int) -> tuple[int, int]:
    return 3 - i - j, 1 if (j - i) % 3 == 1 else -1
