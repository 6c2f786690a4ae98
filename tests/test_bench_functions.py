"""The functions that the population methods are measured on."""

import numpy as np
import pytest

from kinverse.bench.functions import FUNCTIONS, moved, off_centre, shifted
from kinverse.bench.sections import known_minima as section


@pytest.fixture(params=FUNCTIONS, name="function")
def _function(request):
    return FUNCTIONS[request.param]


def plain(name, x):
    """Written again, one point at a time, as the functions are printed."""
    n = len(x)
    if name == "sphere":
        return sum(v**2 for v in x)
    if name == "rosenbrock":
        return sum(100 * (b - a**2) ** 2 + (1 - a) ** 2 for a, b in zip(x, x[1:], strict=False))
    if name == "rastrigin":
        return 10 * n + sum(v**2 - 10 * np.cos(2 * np.pi * v) for v in x)
    if name == "ackley":
        far = np.exp(-0.2 * np.sqrt(sum(v**2 for v in x) / n))
        return -20 * far - np.exp(sum(np.cos(2 * np.pi * v) for v in x) / n) + 20 + np.e
    product = np.prod([np.cos(v / np.sqrt(i + 1)) for i, v in enumerate(x)])
    return sum(v**2 for v in x) / 4000 - product + 1


@pytest.mark.parametrize("dimensions", [2, 10, 30])
def test_values_are_those_of_the_printed_formula(function, dimensions):
    low, high = function.bounds(dimensions).T
    x = np.random.default_rng(1).uniform(low, high, (3, 4, dimensions))
    values = function(x)
    assert values.shape == (3, 4)
    for point, value in zip(x.reshape(-1, dimensions), values.ravel(), strict=True):
        assert value == pytest.approx(plain(function.name, point), rel=1e-11)


@pytest.mark.parametrize("dimensions", [1, 10, 30])
def test_the_minimum_is_zero_exactly_and_nothing_is_lower(function, dimensions):
    best = function.best(dimensions)
    low, high = function.bounds(dimensions).T
    assert function(best) == 0.0 and ((low < best) & (best < high)).all()
    rng = np.random.default_rng(2)
    for size in (1e-3, 0.1, 1.0, 100.0):
        near = best + size * rng.normal(size=(500, dimensions))
        assert (function(near) >= 0).all()
    if dimensions > 1:
        assert (function(best + 1e-3 * rng.normal(size=(500, dimensions))) > 0).all()


@pytest.mark.parametrize("dimensions", [10, 30])
def test_a_shift_moves_the_minimum_off_the_origin_and_inside_the_box(function, dimensions):
    shift = off_centre(function, dimensions)
    other = shifted(function, shift)
    best = other.best(dimensions)
    low, high = other.bounds(dimensions).T
    assert np.array_equal(other.bounds(dimensions), function.bounds(dimensions))
    assert other(best) == pytest.approx(0.0, abs=1e-9)
    away = (best - 0.5 * (low + high)) / (0.5 * (high - low))
    assert ((np.abs(away) >= 0.2) & (np.abs(away) <= 0.8)).all()
    assert len(np.unique(away)) == dimensions and (away < 0).any() and (away > 0).any()
    assert np.array_equal(shift, off_centre(function, dimensions))  # the same every time
    x = np.random.default_rng(3).uniform(low, high, (7, dimensions))
    assert np.array_equal(other(x), function(x - shift))


def test_moved_takes_the_box_along(function):
    other = moved(function, 7.0)
    assert np.array_equal(other.bounds(4), function.bounds(4) + 7.0)
    assert np.array_equal(other.best(4), function.best(4) + 7.0)
    x = np.random.default_rng(3).uniform(-1, 1, (7, 4))
    assert np.array_equal(other(x), function(x - 7.0))


# ---------------------------------------------------------------------------- the section
def test_the_section_tells_who_gains_from_the_origin(monkeypatch):
    monkeypatch.setattr(section, "NAMES", ("pso", "bees", "cibo"))
    monkeypatch.setattr(section, "SHOWN", {})
    monkeypatch.setattr(section, "RUNS", 7)
    lines = section.known_minima(quick=True)
    methods = list(dict.fromkeys(line.subject for line in lines))
    assert methods == ["pso", "bees", "cibo", "bees, Pham", "cibo, literal"]
    for name in methods:
        own = [line for line in lines if line.subject == name]
        assert [line.what.split(",")[0] for line in own[:5]] == list(FUNCTIONS)
        assert all(line.note.startswith("7 runs") for line in own[:5])
        origin = own[6]
        if name == "cibo, literal":
            assert origin.verdict == "" and origin.figure.low > 1e6
        else:
            assert origin.verdict == "PASS"
            assert 0.9 < origin.figure.median < 1.1  # the same steps but for rounding


def test_the_peers_that_are_shown_exist():
    for method, labels in section.SHOWN.items():
        for label in labels:
            assert section._named(method, label).name == label
