"""Six joints of any kind against the libraries that solve them too."""

import numpy as np
from numpy.typing import NDArray

import kinverse as kv
from kinverse.bench import arms, cases, oracle, peers
from kinverse.bench.report import Line
from kinverse.bench.run import Spread, alternate, ratios

__all__ = ["compare"]

Array = NDArray[np.float64]

RANDOM = ("general_0", "general_3")


def compare(quick: bool) -> list[Line]:
    """IKDH on general arms and on the Jaco2, ssik on its own Jaco2: every branch, limits ignored.

    Neither takes a batch: our batch stands beside their loop, and one pose of ours beside one of
    theirs.
    """
    lines = []
    for name in (*RANDOM, "jaco2"):
        robot = arms.GENERAL[name]()
        lines += _compare(name, robot, "IKDH", peers.Ikdh(robot), 30.0, quick)
    jaco2 = peers.SsikJaco2()
    return lines + _compare("jaco2", jaco2.robot, "ssik", jaco2, 10.0, quick)


def _compare(
    name: str,
    robot: kv.Robot,
    label: str,
    peer: peers.Ikdh | peers.SsikJaco2,
    bound: float,
    quick: bool,
) -> list[Line]:
    count, rounds = (50, 2) if quick else (200, 7)
    many = 10 * count
    solver = kv.Analytic(limits="ignore").fit(robot)
    q, T = cases.reachable(robot, many, seed=6)
    poses = list(T[:count])
    targets = peer.targets(T[:count])
    solve, theirs = solver.solve, peer.one

    def one() -> None:
        for pose in poses:
            solve(pose).q  # noqa: B018

    def loop() -> list[object]:
        return [theirs(target) for target in targets]

    taken = alternate({"batch": lambda: solve(T).q, "one": one, "peer": loop}, rounds)
    answers = loop()
    s = solve(T[:count])
    ours = [s.q[s.pose_index == i] for i in range(count)]
    batch = [seconds / many for seconds in taken["batch"]]
    single, their = ([seconds / count for seconds in taken[key]] for key in ("one", "peer"))
    head = ("general arms, speed", f"{name}, {label}")
    return [
        Line(*head, "kinverse, batch: us a pose", _us(batch)),
        Line(*head, "kinverse, one pose: us", _us(single)),
        Line(*head, f"{label}, one pose: us", _us(their)),
        Line(*head, f"{label}'s loop / our batch, time", ratios(their, batch), bound),
        Line(*head, f"{label} / kinverse, one pose, time", ratios(their, single)),
        _found(head, "kinverse", robot, T[:count], q, ours),
        _found(head, label, robot, T[:count], q, [peer.joints(answer) for answer in answers]),
    ]


def _found(
    head: tuple[str, str], who: str, robot: kv.Robot, T: Array, q: Array, answers: list[Array]
) -> Line:
    """What the answers are worth: the generating configuration, and errors by the oracle."""
    hit = [
        bool(len(rows) and oracle.wrapped(robot, rows - made).min() < 1e-4)
        for rows, made in zip(answers, q, strict=False)
    ]
    index = np.repeat(np.arange(len(answers)), [len(rows) for rows in answers])
    far, turned = oracle.errors(T[index], oracle.pose(robot, np.concatenate(answers)))
    note = f"{len(index)} branches, worst error {far.max():.0e} m, {turned.max():.0e} rad"
    what = f"{who}: generating configuration found, %"
    return Line(*head, what, Spread.exact(100.0 * float(np.mean(hit))), note=note)


def _us(seconds: list[float]) -> Spread:
    return Spread.of([1e6 * s for s in seconds])
