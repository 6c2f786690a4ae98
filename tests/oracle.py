"""A second opinion in plain NumPy: shares no code with src/kinverse.

One pose at a time, textbook formulas, no speed. What is tested is compared with this.
"""

import math

import numpy as np

TASKS = ("pose", "position", "position_axis", "planar", "schoenflies")


def rot_x(angle):
    c, s = math.cos(angle), math.sin(angle)
    return np.array([[1, 0, 0], [0, c, -s], [0, s, c]])


def rot_y(angle):
    c, s = math.cos(angle), math.sin(angle)
    return np.array([[c, 0, s], [0, 1, 0], [-s, 0, c]])


def rot_z(angle):
    c, s = math.cos(angle), math.sin(angle)
    return np.array([[c, -s, 0], [s, c, 0], [0, 0, 1]])


def homogeneous(R=None, p=(0, 0, 0)):
    T = np.eye(4)
    if R is not None:
        T[:3, :3] = R
    T[:3, 3] = p
    return T


def rpy(roll, pitch, yaw):
    return rot_z(yaw) @ rot_y(pitch) @ rot_x(roll)


def about(axis, angle):
    """Rotation about any axis by the power series of the matrix exponential."""
    x, y, z = np.asarray(axis, dtype=float) / np.linalg.norm(axis)
    K = np.array([[0, -z, y], [z, 0, -x], [-y, x, 0]]) * (angle / 16)
    R, term = np.eye(3), np.eye(3)
    for k in range(1, 20):
        term = term @ K / k
        R = R + term
    for _ in range(4):  # each squaring doubles the rounding
        R = R @ R
    return R


def joint_motion(kind, value):
    return homogeneous(rot_z(value)) if kind == "R" else homogeneous(p=(0, 0, value))


def fk(frames, kinds, q, source=None, multiplier=None, offset=None):
    """Forward kinematics of the canonical chain for one q (n,)."""
    T = np.array(frames[0], dtype=float)
    for i, kind in enumerate(kinds):
        value = q[i if source is None else source[i]]
        value = value * (1 if multiplier is None else multiplier[i])
        value = value + (0 if offset is None else offset[i])
        T = T @ joint_motion(kind, value) @ frames[i + 1]
    return T


def robot_fk(robot, q):
    """The same from a Robot's fields."""
    return fk(robot.frames, robot.kinds, q, robot.source, robot.multiplier, robot.offset)


def dh_fk(rows, kinds, q, convention="standard", base=None, tool=None):
    """Rows (theta, d, a, alpha); kinds of R, P, F; q of the moving rows only."""
    T = np.eye(4) if base is None else np.array(base, dtype=float)
    values = iter(q)
    for (theta, d, a, alpha), kind in zip(rows, kinds, strict=True):
        if kind == "R":
            theta = theta + next(values)
        elif kind == "P":
            d = d + next(values)
        joint = homogeneous(rot_z(theta), (0, 0, d))
        link = homogeneous(rot_x(alpha), (a, 0, 0))
        T = T @ (joint @ link if convention == "standard" else link @ joint)
    return T if tool is None else T @ tool


def jacobian(forward, q, step=1e-6):
    """Geometric Jacobian (6, n) by central differences of forward(q) -> (4, 4)."""
    q = np.asarray(q, dtype=float)
    J = np.empty((6, len(q)))
    R = forward(q)[:3, :3]
    for j in range(len(q)):
        e = np.zeros(len(q))
        e[j] = step
        high, low = forward(q + e), forward(q - e)
        J[:3, j] = (high[:3, 3] - low[:3, 3]) / (2 * step)
        W = (high[:3, :3] - low[:3, :3]) / (2 * step) @ R.T
        J[3:, j] = (W[2, 1] - W[1, 2]) / 2, (W[0, 2] - W[2, 0]) / 2, (W[1, 0] - W[0, 1]) / 2
    return J


def angle_between(A, B):
    """Angle of A B^T in [0, pi], accurate at both ends (Frobenius norms, no arccos)."""
    A, B = np.asarray(A, dtype=float), np.asarray(B, dtype=float)
    # |A - B|_F = 2 sqrt2 sin(angle/2), and the trace gives the cosine of half the angle
    half_sine = np.linalg.norm(A - B) / (2 * math.sqrt(2))
    half_cosine = math.sqrt(max(0.0, (1.0 + np.trace(A @ B.T)) / 4.0))
    return 2 * math.atan2(half_sine, half_cosine)


def log(R):
    """Rotation vector of R (3, 3); away from pi."""
    angle = angle_between(R, np.eye(3))
    v = np.array([R[2, 1] - R[1, 2], R[0, 2] - R[2, 0], R[1, 0] - R[0, 1]]) / 2
    sine = np.linalg.norm(v)
    return v if sine < 1e-300 else v * (angle / sine)


def nearest_rotation(R):
    """By Newton's iteration for the polar factor."""
    R = np.array(R, dtype=float)
    for _ in range(30):
        R = (R + np.linalg.inv(R).T) / 2
    return R


def errors(task, T_target, T):
    """(position error, rotation error) over the components a task constrains."""
    p = T[:3, 3] - T_target[:3, 3]
    R_t, R = nearest_rotation(T_target[:3, :3]), T[:3, :3]
    if task == "pose":
        return float(np.linalg.norm(p)), angle_between(R_t, R)
    if task == "position":
        return float(np.linalg.norm(p)), 0.0
    if task == "position_axis":
        a, b = R_t[:, 2], R[:, 2]
        angle = math.atan2(np.linalg.norm(np.cross(a, b)), a @ b)
        return float(np.linalg.norm(p)), float(angle)
    if task == "planar":
        return float(np.linalg.norm(p[:2])), float(abs(log(R_t @ R.T)[2]))
    if task == "schoenflies":
        return float(np.linalg.norm(p)), float(abs(log(R_t @ R.T)[2]))
    raise ValueError(task)


def pose_errors(robot, q, T):
    """Position and rotation errors, two (K,) arrays, of joint values (K, n) for poses (K, 4, 4)."""
    pairs = [errors("pose", goal, robot_fk(robot, row)) for goal, row in zip(T, q, strict=True)]
    return np.array(pairs).reshape(-1, 2).T
