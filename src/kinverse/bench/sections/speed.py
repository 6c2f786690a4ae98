"""How fast, against the fastest peers, on the same poses in alternating rounds."""

import numpy as np
from numpy.typing import NDArray

import kinverse as kv
from kinverse import kernels
from kinverse.bench import cases, oracle, peers
from kinverse.bench.report import Line
from kinverse.bench.run import Spread, alternate, latencies, ratios

__all__ = ["closed_form", "fk_lanes", "follow", "numerical"]

Array = NDArray[np.float64]
CLOSED = ("puma560", "ur5", "kr16")
ARMS = ("puma560", "ur5", "panda", "iiwa14")


def wide(at_8: float, at_4: float) -> float | None:
    """A target for eight lanes (avx512) or four (avx2); none for a narrower core."""
    return {"avx512": at_8, "avx2": at_4}.get(kernels.instruction_set())


def closed_form(quick: bool) -> list[Line]:
    """One pose and a batch against EAIK, both reading the joint values of every branch."""
    count, rounds = (500, 3) if quick else (2_000, 15)
    many = 2_000 if quick else 10_000
    return [line for name in CLOSED for line in _closed_form(name, count, rounds, many)]


def _closed_form(name: str, count: int, rounds: int, many: int) -> list[Line]:
    robot = kv.load(name)
    solver = kv.Analytic().fit(robot)
    peer = peers.Eaik(robot)
    _, T = cases.reachable(robot, many, seed=2)
    poses = list(T[:count])
    batch = list(T)
    solve, their = solver.solve, peer.one

    def ours_one() -> None:
        for pose in poses:
            solve(pose).q  # noqa: B018

    def theirs_one() -> None:
        for pose in poses:
            their(pose).Q  # noqa: B018

    def ours_many() -> object:
        return solve(T).q

    def theirs_many() -> object:
        # its matrices are left unread: reading them would cost it another tenth
        return peer.many(batch, 1)

    one = alternate({"ours": ours_one, "eaik": theirs_one}, rounds)
    bulk = alternate({"ours": ours_many, "eaik": theirs_many}, rounds)
    head = ("closed form, speed", name)
    return [
        Line(*head, "one pose: kinverse us", _scaled(one["ours"], 1e6 / count)),
        Line(*head, "one pose: EAIK us", _scaled(one["eaik"], 1e6 / count)),
        Line(*head, "one pose: kinverse / EAIK", ratios(one["ours"], one["eaik"]), 0.6, False),
        Line(*head, "batch: kinverse poses/s", _rate(bulk["ours"], many)),
        Line(*head, "batch: EAIK poses/s", _rate(bulk["eaik"], many), note="one thread"),
        Line(
            *head,
            "batch: kinverse / EAIK, rate",
            ratios(bulk["eaik"], bulk["ours"]),
            wide(12.0, 6.0),
        ),
    ]


def numerical(quick: bool) -> list[Line]:
    """Random targets from random seeds, against RTB's ik_LM; OptIK on some of them."""
    count, rounds = (500, 1) if quick else (10_000, 3)
    return [line for name in ARMS for line in _numerical(name, count, rounds)]


def _numerical(name: str, count: int, rounds: int) -> list[Line]:
    robot = kv.load(name)
    solver = kv.Numerical().fit(robot)
    rtb, optik = peers.Rtb(robot), peers.OptIK(robot)
    _, T = cases.reachable(robot, count, seed=3)
    q0, _ = cases.reachable(robot, count, seed=4)
    inputs = list(zip(T, q0, strict=True))

    def ours(pose: Array, seed: Array) -> Array:
        q: Array = solver.solve(pose, seed).q
        return q

    runs = [latencies({"ours": ours, "rtb": rtb.solve}, inputs) for _ in range(rounds)]
    taken, answers = [run[0] for run in runs], runs[-1][1]
    some = min(count, 1_000)
    slow, others = latencies({"optik": optik.solve}, inputs[:some])
    answers |= others
    head = ("numerical", name)
    share = {key: _solved(robot, T, _first(robot, found)) for key, found in answers.items()}
    lines = [
        Line(*head, "kinverse solved, %", share["ours"], 100.0, note=f"of {count:,}"),
        Line(*head, "RTB solved, %", share["rtb"]),
        Line(*head, "OptIK solved, %", share["optik"], note=f"of {some:,}"),
    ]
    for what, measure, at_8 in (
        ("median", np.median, 12.0),
        ("mean", np.mean, 20.0),
        ("p99", _p99, 25.0),
    ):
        mine = [float(measure(t["ours"])) for t in taken]
        rtbs = [float(measure(t["rtb"])) for t in taken]
        note = (
            f"us: kinverse {1e6 * np.median(mine):.1f}, RTB {1e6 * np.median(rtbs):.1f}, "
            f"OptIK {1e6 * float(measure(slow['optik'])):.0f}"
        )
        bound = wide(at_8, at_8 / 2)
        lines.append(Line(*head, f"RTB / kinverse, {what}", ratios(rtbs, mine), bound, note=note))
    bulk = alternate({"ours": lambda: solver.solve(T, q0).q}, max(rounds, 2))
    lines.append(Line(*head, "batch poses/s", _rate(bulk["ours"], count), 150_000.0))
    return lines


def follow(quick: bool) -> list[Line]:
    """A smooth path, each pose from the last one's answer, against RTB started the same way."""
    count, rounds = (100, 3) if quick else (500, 9)
    return [line for name in ARMS for line in _follow(name, count, rounds)]


def _follow(name: str, count: int, rounds: int) -> list[Line]:
    robot = kv.load(name)
    solver = kv.Numerical().fit(robot)
    rtb = peers.Rtb(robot)
    q = cases.path(robot, count)
    T = oracle.pose(robot, q)

    def ours() -> Array:
        return np.asarray(solver.follow(T, q[0]).q)

    def theirs() -> Array:
        answers, last = np.empty_like(q), q[0]
        for i, pose in enumerate(T):
            last = answers[i] = rtb.solve(pose, last)
        return answers

    mine, rtbs = ours(), theirs()
    complete = mine.shape == q.shape
    jump = np.abs(np.diff(mine, axis=0, prepend=q[:1])).max(axis=1)
    taken = alternate({"ours": ours, "rtb": theirs}, rounds)
    head = ("follow a path", name)
    share = _solved(robot, T, mine) if complete else Spread.exact(100.0 * len(mine) / count)
    return [
        Line(*head, "points solved, %", share, 100.0, note=f"of {count}"),
        Line(*head, "RTB points solved, %", _solved(robot, T, rtbs)),
        Line(*head, "largest joint jump rad", Spread.exact(float(jump.max())), 0.1, False),
        Line(
            *head,
            "RTB / kinverse, time a point",
            ratios(taken["rtb"], taken["ours"]),
            wide(12.0, 6.0),
            note=f"us: kinverse {1e6 * np.median(taken['ours']) / count:.2f}, "
            f"RTB {1e6 * np.median(taken['rtb']) / count:.1f}",
        ),
    ]


def fk_lanes(quick: bool) -> list[Line]:
    """Forward kinematics: packs against one lane of the same core, and against the oracle."""
    count, rounds = (2_000, 5) if quick else (10_000, 25)
    before = kernels.instruction_set()
    try:
        return [
            line
            for isa in kernels.instruction_sets()
            for name in ("kr16", "panda")
            for line in _fk_lanes(isa, name, count, rounds)
        ]
    finally:
        kernels.set_instruction_set(before)


def _fk_lanes(isa: str, name: str, count: int, rounds: int) -> list[Line]:
    kernels.set_instruction_set(isa)
    robot = kv.load(name)
    q, T = cases.reachable(robot, count, seed=5)
    chain = robot.chain
    taken = alternate({"packs": lambda: chain.fk(q), "one": lambda: chain.fk(q, True)}, rounds)
    off = float(np.abs(chain.fk(q) - T).max())
    head = (f"forward kinematics, {isa}", name)
    return [
        Line(*head, "ns a pose", _scaled(taken["packs"], 1e9 / count)),
        Line(
            *head,
            "packs against one lane, times",
            ratios(taken["one"], taken["packs"]),
            wide(4.0, 2.5),
        ),
        Line(*head, "off the oracle", Spread.exact(off), 1e-12, False),
    ]


def _first(robot: kv.Robot, answers: list[object]) -> Array:
    """The first solution of each answer, NaN where there is none."""
    q = np.full((len(answers), robot.dof), np.nan)
    for row, answer in zip(q, answers, strict=True):
        rows = np.asarray(answer).reshape(-1, robot.dof)
        if len(rows):
            row[:] = rows[0]
    return q


def _solved(robot: kv.Robot, T: Array, q: Array) -> Spread:
    """How many of the first targets the answers reach within 1e-6 m and rad, inside the limits."""
    T = T[: len(q)]
    good = np.asarray(np.isfinite(q).all(axis=1))
    far, turned = oracle.errors(T, oracle.pose(robot, np.where(good[:, None], q, 0.0)))
    # a hair over the tolerance for the oracle's own rounding
    good &= (far <= 1e-6 + 1e-12) & (turned <= 1e-6 + 1e-12)
    good &= oracle.inside(robot, q)
    return Spread.exact(100.0 * float(good.mean()))


def _p99(values: Array) -> float:
    return float(np.percentile(values, 99))


def _scaled(seconds: list[float], factor: float) -> Spread:
    return Spread.of([factor * s for s in seconds])


def _rate(seconds: list[float], count: int) -> Spread:
    return Spread.of([count / s for s in seconds])
