"""Trainers on the planar arm of document 003, beside scikit-learn and torch; times of predictions.

All times are of the processor. The test error that tells when a trainer has arrived is looked at
between its epochs, off the clock; a training is not steered by it, only watched no longer once it
has arrived, or after its CPU seconds.
"""

import time
import warnings
from collections.abc import Callable
from functools import partial
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

import kinverse as kv
from kinverse.bench.report import Line
from kinverse.bench.run import Spread
from kinverse.errors import MissingExtra

__all__ = ["predicting", "trainers"]

Array = NDArray[np.float64]

SECTION = "planar 3R of document 003, 4-140-3"
TRAIN, TEST, HIDDEN = 7000, 1500, 140
DATA, NETWORK = 6_100, 40
"""First seeds of data and of networks: unrelated, and each run has its own of both."""
GOOD, BEST = 1.5, 1.1
"""Test errors aimed at: root mean squares of the worst joint [deg]."""


class Ours(NamedTuple):
    """One of our trainers: its settings, the CPU seconds it may take, where it may end."""

    settings: dict[str, Any]
    seconds: float
    runs: int
    until: float


OURS = {
    "varpro (default)": Ours({"trainer": "varpro"}, 40.0, 5, BEST),
    "lm, nielsen": Ours({"trainer": "lm", "damping": "nielsen"}, 80.0, 5, GOOD),
    "bayes, nielsen": Ours({"trainer": "bayes", "damping": "nielsen"}, 130.0, 5, GOOD),
    "lm, tenfold": Ours({"trainer": "lm"}, 80.0, 3, GOOD),
}


class Run(NamedTuple):
    """What one training did: CPU seconds to each error, the last error, epochs, CPU an epoch."""

    good: float
    best: float
    error: float
    epochs: int
    each: float


def trainers(quick: bool) -> list[Line]:
    """CPU seconds until the worst joint's test error is 1.5 and 1.1 degrees."""
    runs = 1 if quick else 5
    sets = [_data(DATA + k, quick) for k in range(runs)]
    peer = [_scikit_learn(data, quick) for data in sets[: 1 if quick else 3]]
    seconds = Spread.of([taken for taken, _ in peer])
    errors = Spread.of([error for _, error in peer])
    lines = [
        _line("scikit-learn lbfgs", "CPU of its 1,000 iterations, s", seconds, runs=len(peer)),
        _line("scikit-learn lbfgs", "test error, deg", errors, runs=len(peer)),
    ]
    hidden = (20,) if quick else (HIDDEN,)
    for name, ours in OURS.items():
        count = 1 if quick else ours.runs
        cap = 1.0 if quick else ours.seconds
        done = [_ours(ours, hidden, data, NETWORK + k, cap) for k, data in enumerate(sets[:count])]
        lines += _told(name, done, cap, seconds.median, quick)
    lines += _stopped_early(sets, hidden)
    lines += _torch(sets[0], hidden, quick)
    return lines


class Data(NamedTuple):
    """Rows to train with and to test with; angles in degrees nowhere but in the lines."""

    X: Array
    y: Array
    X_test: Array
    y_test: Array


def _data(seed: int, quick: bool) -> Data:
    from kinverse.learning import PoseFeatures, VirtualVector, sample

    robot = kv.load("planar3r_003")
    train, test = (400, 100) if quick else (TRAIN, TEST)
    drawn = sample(robot, train + test, random_state=seed)
    X, y = drawn.inverse(PoseFeatures("xyz").fit(drawn.T), VirtualVector("cos_sin"))
    X = X[:, [0, 1, 3, 4]]  # z is 0 in the plane
    return Data(X[:train], y[:train], X[train:], y[train:])


def _worst(predicted: Array, wanted: Array) -> float:
    return float(np.degrees(np.sqrt(np.mean((predicted - wanted) ** 2, axis=0))).max())


def _ours(ours: Ours, hidden: tuple[int, ...], data: Data, seed: int, cap: float) -> Run:
    from kinverse.networks import MLP

    start, off = time.process_time(), 0.0
    reached = {GOOD: np.inf, BEST: np.inf}
    last = np.inf

    def look(progress: Any) -> bool:
        nonlocal off, last
        now = time.process_time()
        spent = now - start - off
        last = _worst(progress.predict(data.X_test), data.y_test)
        for error in reached:
            if last <= error:
                reached[error] = min(reached[error], spent)
        off += time.process_time() - now
        return spent >= cap or last <= ours.until

    network = MLP(hidden, max_iter=100_000, random_state=seed, callback=look, **ours.settings)
    network.fit(data.X, data.y)
    spent = time.process_time() - start - off
    return Run(reached[GOOD], reached[BEST], last, network.n_iter_, spent / network.n_iter_)


def _told(name: str, done: list[Run], cap: float, peer: float, quick: bool) -> list[Line]:
    default = name.startswith("varpro")
    good = Spread.of([run.good for run in done])
    error = Spread.of([run.error for run in done])
    target = not quick and name != "lm, tenfold"
    note = f"within {cap:g} s of CPU; inf: not within it"
    lines = [
        _line(
            name,
            f"CPU to a test error of {GOOD} deg, s",
            good,
            cap if target else None,
            note=note,
            runs=len(done),
        ),
        _line(name, "test error when the clock or that error ended it, deg", error, note=note),
        _line(name, "CPU an epoch, s", Spread.of([run.each for run in done])),
    ]
    if default:
        ratio = Spread.of([run.good / peer for run in done])
        lines[1:1] = [
            _line(
                name,
                f"CPU to {GOOD} deg / scikit-learn's 1,000 iterations",
                ratio,
                None if quick else 1.0 / 3.0,
            ),
            _line(
                name,
                f"CPU to {BEST} deg, s",
                Spread.of([run.best for run in done]),
                None if quick else cap,
                note=note,
            ),
        ]
    return lines


def _stopped_early(sets: list[Data], hidden: tuple[int, ...]) -> list[Line]:
    """As a user would train: a share of the training rows held back, and no clock."""
    from kinverse.networks import MLP

    errors, spent = [], []
    for k, data in enumerate(sets):
        start = time.process_time()
        net = MLP(hidden, early_stopping=True, random_state=NETWORK + k).fit(data.X, data.y)
        spent.append(time.process_time() - start)
        errors.append(_worst(net.predict(data.X_test), data.y_test))
    name = "varpro, early stopping"
    return [
        _line(name, "test error, deg", Spread.of(errors)),
        _line(name, "CPU, s", Spread.of(spent), note="at most 200 epochs, its default"),
    ]


def _scikit_learn(data: Data, quick: bool) -> tuple[float, float]:
    """CPU seconds and test error of its 1,000 iterations on rows scaled as ours are."""
    try:
        from sklearn.neural_network import MLPRegressor
        from sklearn.preprocessing import MinMaxScaler
    except ImportError as error:
        raise MissingExtra("the networks' bench", "learn") from error
    inputs = MinMaxScaler((-1, 1)).fit(data.X)
    outputs = MinMaxScaler((-1, 1)).fit(data.y)
    net = MLPRegressor(
        hidden_layer_sizes=(20,) if quick else (HIDDEN,),
        activation="tanh",
        solver="lbfgs",
        alpha=0.0,
        max_iter=30 if quick else 1000,
        max_fun=10**9,
        tol=0.0,
        random_state=1,
    )
    start = time.process_time()
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # it warns that it used all its iterations
        net.fit(inputs.transform(data.X), outputs.transform(data.y))
    spent = time.process_time() - start
    predicted = outputs.inverse_transform(net.predict(inputs.transform(data.X_test)))
    return spent, _worst(predicted, data.y_test)


def _torch(data: Data, hidden: tuple[int, ...], quick: bool) -> list[Line]:
    """CPU an epoch of Levenberg-Marquardt in torch, on the same scaled rows and net."""
    what = "torch-levenberg-marquardt / ours, CPU a step"
    try:
        import torch
        from torch_levenberg_marquardt.training import LevenbergMarquardtModule, MSELoss
    except ImportError:
        missing = Spread.exact(float("nan"))
        note = "not measured: see requirements-bench-torch.txt"
        return [Line(SECTION, "lm", what, missing, None, note=note)]
    from kinverse.networks import MLP

    torch.set_num_threads(1)
    steps = 2 if quick else 5
    spent: dict[str, float] = {}
    ways = [(kind, way) for kind in (torch.float32, torch.float64) for way in ("qr", "cholesky")]
    for kind, way in ways:
        torch.manual_seed(3)
        net = torch.nn.Sequential(
            torch.nn.Linear(data.X.shape[1], hidden[0]),
            torch.nn.Tanh(),
            torch.nn.Linear(hidden[0], data.y.shape[1]),
        ).to(kind)
        module = LevenbergMarquardtModule(model=net, loss_fn=MSELoss(), solve_method=way)
        X, y = (torch.tensor(_scaled(part), dtype=kind) for part in (data.X, data.y))
        module.training_step(X, y)
        start = time.process_time()
        for _ in range(steps):
            module.training_step(X, y)
        spent[f"{kind}, {way}"] = (time.process_time() - start) / steps
    start = time.process_time()
    ours = MLP(hidden, trainer="lm", max_iter=steps, random_state=3).fit(data.X, data.y)
    mine = (time.process_time() - start) / ours.n_iter_
    quicker = min(spent, key=lambda kind: spent[kind])
    ratio = Spread.exact(spent[quicker] / mine)
    note = f"{quicker}, its quickest way: {spent[quicker]:.3g} s; ours in float64: {mine:.3g} s"
    bound = None if quick else 3.0
    return [
        Line(SECTION, "lm", "torch-levenberg-marquardt / ours, CPU a step", ratio, bound, note=note)
    ]


def _scaled(rows: Array) -> Array:
    """Columns to [-1, 1], as our networks scale them."""
    low, high = rows.min(axis=0), rows.max(axis=0)
    return np.asarray(2.0 * (rows - low) / (high - low) - 1.0)


def predicting(quick: bool) -> list[Line]:
    """One prediction from Python and ten thousand at once, of nets 12-68-6."""
    from sklearn.neural_network import MLPRegressor

    from kinverse.networks import MLP, RBFNetwork

    rng = np.random.default_rng(DATA)
    X = rng.uniform(-1, 1, (400 if quick else 3000, 12))
    y = np.sin(X[:, :6]) * X[:, 6:]
    many = rng.uniform(-1, 1, (10_000, 12))
    nets = {
        "MLP": MLP((68,), max_iter=5, random_state=1).fit(X, y),
        "RBFNetwork": RBFNetwork(68, spread=3.0).fit(X, y),
    }
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        nets["scikit-learn MLPRegressor"] = MLPRegressor(hidden_layer_sizes=(68,), max_iter=5).fit(
            X, y
        )
    lines = []
    for name, net in nets.items():
        ours = not name.startswith("scikit")
        one = Spread.of([1e6 * t for t in _repeated(partial(net.predict, many[:1]), 500)])
        batch = Spread.of([1e6 * t / len(many) for t in _repeated(partial(net.predict, many), 5)])
        section = "predictions of nets 12-68-6"
        lines += [
            Line(section, name, "CPU for one pose, us", one, 30.0 if ours else None, False),
            Line(section, name, "CPU a pose in 10,000, us", batch, 1.0 if ours else None, False),
        ]
    return lines


def _repeated(call: Callable[[], object], times: int) -> list[float]:
    """CPU seconds of a call, in seven rounds of so many."""
    call()
    rounds = []
    for _ in range(7):
        start = time.process_time()
        for _ in range(times):
            call()
        rounds.append((time.process_time() - start) / times)
    return rounds


def _line(
    subject: str,
    what: str,
    figure: Spread,
    bound: float | None = None,
    note: str = "",
    runs: int | None = None,
) -> Line:
    told = f"{runs} seeds of data and networks" if runs else ""
    return Line(SECTION, subject, what, figure, bound, False, "; ".join(filter(None, (told, note))))
