"""Verification in plain NumPy, one candidate at a time: the second opinion on the native one.

Has the signature and the answer of ``kernels.verify``; mimic joints are not covered.
"""

import numpy as np
from scipy.spatial.transform import Rotation

from kinverse.table import Table, plain_evidence

SLACK = 1e-9
TURN = 2 * np.pi


def verify(robot, task, T, q, pose_index, branch, hint, q_seed, tol_p, tol_r, windings, ignore):
    poses, n = len(T), robot.dof
    low, high = robot.limits.T
    revolute = np.array([kind == "R" for kind in robot.kinds])
    rows, status = [], np.array(hint, np.uint8)
    best_q, best = np.full((poses, n), np.nan), np.full((poses, 2), np.nan)
    for i in range(poses):
        near = (low + high) / 2 if q_seed is None else q_seed[i]
        found, outside, least = [], False, np.inf
        for k in np.flatnonzero(pose_index == i):
            if not np.isfinite(q[k]).all():
                continue
            for wound in _windings(q[k], near, low, high, revolute, windings, ignore):
                inside = bool(((low - SLACK <= wound) & (wound <= high + SLACK)).all())
                value = np.clip(wound, low, high) if inside and not ignore else wound
                error = errors(task, T[i], robot.fk(value))
                score = max(error[0] / tol_p, error[1] / tol_r)
                if score < least:
                    least, best_q[i], best[i] = score, value, error
                if error[0] > tol_p or error[1] > tol_r:
                    continue
                outside |= not inside
                alike = any(_alike(value, f[0], revolute, windings) for f in found)
                if (inside or ignore) and not alike:
                    found.append((value, *error, branch[k]))
        key = (lambda f: f[3]) if q_seed is None else (lambda f, s=near: np.abs(f[0] - s).max())
        rows += [(i, *f) for f in sorted(found, key=key)]
        status[i] = 0 if found else 1 if outside else status[i]
    index = np.array([row[0] for row in rows], np.int64)
    return Table(
        q=np.array([row[1] for row in rows]).reshape(-1, n),
        pose_index=index,
        position_error=np.array([row[2] for row in rows], float),
        rotation_error=np.array([row[3] for row in rows], float),
        branch=np.array([row[4] for row in rows], np.int32),
        status=status,
        count=np.bincount(index, minlength=poses).astype(np.int64),
        singular=np.zeros(poses, bool),
        evaluations=np.bincount(pose_index, minlength=poses).astype(np.int64),
        iterations=np.full(poses, -1),
        starts=np.full(poses, -1),
        stop=np.full(poses, -1),
        cost=np.full(poses, np.nan),
        best_q=best_q,
        best_position_error=best[:, 0].copy(),
        best_rotation_error=best[:, 1].copy(),
        evidence=plain_evidence("search", poses),
    )


def errors(task, target, found):
    """(position [m], rotation [rad]) error of a pose; tasks by number, as in the core."""
    u, _, vt = np.linalg.svd(target[:3, :3])
    R = u @ vt
    offset = found[:3, 3] - target[:3, 3]
    log = Rotation.from_matrix(R @ found[:3, :3].T).as_rotvec()
    if task == 3:
        offset = offset[:2]
    if task == 1:
        turned = 0.0
    elif task == 2:
        a, b = R[:, 2], found[:3, 2]
        turned = float(np.arctan2(np.linalg.norm(np.cross(a, b)), a @ b))
    else:
        turned = abs(log[2]) if task in (3, 4) else float(np.linalg.norm(log))
    return float(np.linalg.norm(offset)), float(turned)


def _windings(q, near, low, high, revolute, every, ignore):
    """The windings to try: the nearest one inside the limits where there is one, or all of them.

    With the limits ignored there is no end of windings, so only the nearest is tried.
    """
    choices = []
    for value, at, lo, hi, turns in zip(q, near, low, high, revolute, strict=True):
        k = np.arange(-9, 10) if turns else np.zeros(1)
        wound = value + TURN * k
        inside = wound[(lo - SLACK <= wound) & (wound <= hi + SLACK)]
        if len(inside) == 0 or ignore:
            inside = wound[[np.argmin(np.abs(wound - at))]]
        choices.append(inside if every else inside[[np.argmin(np.abs(inside - at))]])
    return np.stack(np.meshgrid(*choices, indexing="ij"), -1).reshape(-1, len(q))


def _alike(one, other, revolute, every):
    apart = np.abs(one - other)
    if not every:
        apart = np.where(revolute, np.abs(np.remainder(apart + np.pi, TURN) - np.pi), apart)
    return bool(apart.max() < 1e-6)
