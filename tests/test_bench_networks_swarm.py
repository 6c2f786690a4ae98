"""The section of the hybrid networks: who sees which rows, and what nobody can undercut."""

import numpy as np
import pytest

import kinverse as kv
from kinverse.bench.sections import networks_swarm as section


class Recorder:
    """Learns nothing; knows what it was shown."""

    def fit(self, X, q):
        self.X, self.q = X, q

    def predict(self, X):
        self.asked = X
        return np.zeros((len(X), self.q.shape[1]))


def test_the_test_rows_are_not_trained_on(monkeypatch):
    made = []
    monkeypatch.setattr(
        section, "_network", lambda *settings: made.append((settings, Recorder())) or made[-1][1]
    )
    robot = kv.load("adept_one")
    draws = [section._draw(robot, 1000, seed) for seed in (1, 2)]
    line = section._trained(robot, draws, "pso", 4, 7)
    assert [settings for settings, _ in made] == [
        ("pso", 4, 7, section.NETWORK_SEED + k) for k in (0, 1)
    ]
    for (_, network), rows in zip(made, draws, strict=True):
        assert (len(network.X), len(network.asked)) == (700, 300)
        np.testing.assert_array_equal(np.vstack([network.X, network.asked]), rows.X)
        assert not set(network.X[:, 0]) & set(network.asked[:, 0])
    # the figure is of the turning joints alone; the slide is told in metres
    turns = [np.sqrt(np.mean(rows.q[700:][:, [0, 1, 3]] ** 2)) for rows in draws]
    assert (line.figure.low, line.figure.high) == pytest.approx((min(turns), max(turns)))
    slide = np.median([np.sqrt(np.mean(rows.q[700:, 2] ** 2)) for rows in draws])
    assert f"joint3 {slide:.3g} m" in line.note and "700 networks tried" in line.note


def test_every_method_and_back_propagation_make_their_network():
    for method in section.METHODS:
        network = section._network(method, 5, 3, 1)
        assert network.max_evals == 300 and network.optimizer.population == 100
    assert section._network("back-propagation", 5, 3, 1).trainer == "lbfgs"


@pytest.mark.slow
def test_nobody_undercuts_the_floor():
    lines = section.hybrid_mlps(quick=True)
    for name in section.ROBOTS:
        own = {line.what: line.figure for line in lines if line.subject == name}
        floor = own.pop("floor: mean of the joints at the same position")
        assert len(own) == 7
        assert all(figure.low > 0.98 * floor.low for figure in own.values())
        assert floor.median < own["mean of the training joints"].median
    note = next(line.note for line in lines if line.what.startswith("floor"))
    # the SCARA's last joint does not move the point at all: its limits alone tell its spread
    joint4 = float(note.split("joint4 ")[1].split(" rad")[0])
    assert joint4 == pytest.approx(np.deg2rad(277) / np.sqrt(3), rel=0.05)
