"""The shortest path of the native core against a search through every sequence."""

import itertools

import numpy as np
import pytest

from kinverse import kernels

TURN = 2 * np.pi


def problem(rng, samples=6, rows=3, dof=2, spread=0.6):
    """Layers of a few rows about a wandering point, some of them empty."""
    count = rng.integers(0, rows + 1, samples)
    start = np.concatenate([[0], np.cumsum(count)])
    q = (
        rng.uniform(-spread, spread, (start[-1], dof))
        + rng.integers(-1, 2, (start[-1], dof)) * TURN
    )
    return {
        "q": q,
        "start": start.astype(np.int64),
        "fixed": rng.random(start[-1]) < 0.2,
        "side": rng.integers(-1, 2, start[-1]).astype(np.int32),
        "lower": np.full(dof, -4.0),
        "upper": rng.uniform(3.0, 7.0, dof),
        "turns": rng.random(dof) < 0.7,
        "max_step": rng.uniform(0.3, 1.2, dof),
        "weight": rng.uniform(0.5, 2.0, dof),
        "squares": bool(rng.integers(2)),
        "before": None,
        "open_from": np.empty(0, np.int64),
        "open_to": np.empty(0, np.int64),
    }


def nodes_of(given):
    """(joint values, row) of every winding inside the limits, layer by layer; and all in order."""
    low, high, turns = given["lower"], given["upper"], given["turns"]
    layers, number = [], 0
    for first, last in itertools.pairwise(given["start"]):
        layer = []
        for row in range(first, last):
            choices = []
            for j, value in enumerate(given["q"][row]):
                steps = range(-4, 5) if turns[j] and not given["fixed"][row] else (0,)
                choices.append(
                    [
                        value + k * TURN
                        for k in steps
                        if low[j] - 1e-9 <= value + k * TURN <= high[j] + 1e-9
                    ]
                )
            for values in itertools.product(*choices):
                layer.append((np.array(values), row))
                number += 1
        layers.append(layer)
    return layers, number


def step_of(given, a, b):
    """Cost of a step between two nodes, None where it is not allowed."""
    side, (qa, ra), (qb, rb) = given["side"], a, b
    if side[ra] != side[rb] and side[ra] >= 0 and side[rb] >= 0:
        pairs = zip(given["open_from"], given["open_to"], strict=True)
        if (ra, rb) not in set(pairs):
            return None
    d = np.abs(qa - qb)
    if (d > given["max_step"]).any():
        return None
    w = d * given["weight"]
    return float(np.sqrt((w * w).sum()) if given["squares"] else w.max())


def exhaustive(given):
    """Fewest breaks and least cost of all sequences that pass through every layer with nodes."""
    layers, _ = nodes_of(given)
    live = [i for i, layer in enumerate(layers) if layer]
    best = (10**6, 0.0)
    for ways in itertools.product(*(layers[i] for i in live)):
        breaks, cost = 0, 0.0
        for (i, a), (j, b) in itertools.pairwise(zip(live, ways, strict=True)):
            step = step_of(given, a, b) if j == i + 1 else None
            breaks += step is None
            cost += step or 0.0
        best = min(best, (breaks, cost))
    return best


def told(given, found):
    """Breaks and cost of the sequence that was found, counted here."""
    layers, _ = nodes_of(given)
    breaks, cost, last = 0, 0.0, None
    for i, layer in enumerate(layers):
        assert (found["row"][i] >= 0) == bool(layer)
        if not layer:
            assert np.isnan(found["q"][i]).all() and not found["linked"][i]
            continue
        node = (found["q"][i], int(found["row"][i]))
        assert any(row == node[1] and np.allclose(q, node[0], atol=1e-12) for q, row in layer)
        if last is not None:
            step = step_of(given, last[1], node) if last[0] == i - 1 else None
            assert not found["linked"][i] or step is not None
            breaks += not found["linked"][i]
            cost += step if found["linked"][i] else 0.0
        last = (i, node)
    return breaks, cost


@pytest.mark.parametrize("seed", range(60))
def test_it_is_the_best_of_all_sequences(seed):
    rng = np.random.default_rng(seed)
    given = problem(rng)
    if rng.integers(2) and len(given["q"]) > 2:
        pairs = [
            (a, b)
            for i in range(len(given["start"]) - 2)
            for a in range(given["start"][i], given["start"][i + 1])
            for b in range(given["start"][i + 1], given["start"][i + 2])
            if rng.random() < 0.3
        ]
        pairs.sort(key=lambda pair: (pair[1], pair[0]))
        given["open_from"], given["open_to"] = np.array(pairs, np.int64).reshape(-1, 2).T.copy()
    found = kernels.shortest_path(**given)
    layers, _ = nodes_of(given)
    if not any(layers):
        assert (found["row"] == -1).all() and found["cost"] == 0.0
        return
    breaks, cost = exhaustive(given)
    assert told(given, found) == (breaks, pytest.approx(cost, abs=1e-12))
    assert found["cost"] == pytest.approx(cost, abs=1e-12)
    assert found["level"][-1] == breaks


@pytest.mark.parametrize("seed", range(10))
def test_barriers_are_where_every_way_ends(seed):
    given = problem(np.random.default_rng(100 + seed), samples=12)
    found = kernels.shortest_path(**given)
    layers, _ = nodes_of(given)
    # the set of nodes that can be reached without a break, renewed where it dies out
    reached, barriers, rows = [], [], []
    for i, layer in enumerate(layers):
        if not layer:
            reached = []
            continue
        onward = [b for b in layer if any(step_of(given, a, b) is not None for a in reached)]
        if reached and not onward:
            barriers.append(i - 1)
            rows.append([row for _, row in reached])
        reached = onward or list(layer)
    assert found["barrier"].tolist() == barriers
    ends = found["reached_start"]
    assert [found["reached_row"][a:b].tolist() for a, b in itertools.pairwise(ends)] == rows


def test_every_instruction_set_finds_the_same():
    before = kernels.instruction_set()
    given = problem(np.random.default_rng(5), samples=200, rows=20)
    given["squares"] = False
    answers = []
    try:
        for name in kernels.instruction_sets():
            kernels.set_instruction_set(name)
            answers.append(kernels.shortest_path(**given))
    finally:
        kernels.set_instruction_set(before)
    for other in answers[1:]:
        assert np.array_equal(other["row"], answers[0]["row"])
        assert other["cost"] == pytest.approx(answers[0]["cost"], rel=1e-12)


def test_a_path_begins_where_the_arm_is():
    given = problem(np.random.default_rng(1), samples=3)
    given |= {
        "q": np.array([[0.0, 0.0], [2.0, 0.0], [1.9, 0.0], [1.8, 0.0]]),
        "start": np.array([0, 2, 3, 4]),
        "side": np.zeros(4, np.int32),
        "fixed": np.zeros(4, bool),
        "lower": np.full(2, -3.0),
        "upper": np.full(2, 3.0),
        "max_step": np.full(2, 0.5),
        "weight": np.ones(2),
        "squares": False,
    }
    assert kernels.shortest_path(**given)["row"].tolist() == [1, 2, 3]
    near = kernels.shortest_path(**given | {"before": np.array([0.1, 0.0])})
    assert near["row"].tolist() == [0, 2, 3] and near["linked"].tolist() == [False, False, True]
    far = kernels.shortest_path(**given | {"before": np.array([-2.0, 0.0])})
    assert far["row"].tolist() == [1, 2, 3] and far["cost"] == pytest.approx(4.2)


def test_windings_are_all_that_lie_inside():
    given = problem(np.random.default_rng(3), samples=30)
    given["fixed"][:] = False
    layers, count = nodes_of(given)
    box = {name: given[name] for name in ("q", "lower", "upper", "turns")}
    every = kernels.windings(**box, most=10**6)
    assert len(every) == count == kernels.winding_counts(**box).sum()
    assert np.allclose(every, [q for layer in layers for q, _ in layer], atol=1e-12)


BAD = {
    "start": [np.array([0, 1]), np.array([1, 5]), np.array([0, 7, 3]), np.array([0])],
    "side": [np.zeros(2, np.int32)],
    "fixed": [np.zeros(7, bool)],
    "q": [np.full((6, 2), np.nan), np.full((6, 2), 1e300), np.empty((6, 0))],
    "lower": [np.array([-np.inf, 0.0]), np.zeros(3)],
    "max_step": [np.array([-0.1, 1.0]), np.array([4.0, 1.0]), np.array([np.nan, 1.0])],
    "weight": [np.array([-1.0, 1.0]), np.array([np.nan, 1.0])],
    "before": [np.array([np.nan, 0.0]), np.zeros(3)],
    "open_from": [np.array([3])],
}


@pytest.mark.parametrize("name, value", [(n, v) for n, values in BAD.items() for v in values])
def test_what_does_not_fit_is_refused(name, value):
    rng = np.random.default_rng(0)
    given = problem(rng, samples=3)
    given |= {"q": rng.random((6, 2)), "start": np.array([0, 2, 4, 6]), "turns": np.ones(2, bool)}
    given |= {"side": np.zeros(6, np.int32), "fixed": np.zeros(6, bool)}
    kernels.shortest_path(**given)
    with pytest.raises(ValueError):
        kernels.shortest_path(**given | {name: value})


def test_open_pairs_that_do_not_ascend_are_refused():
    given = problem(np.random.default_rng(0), samples=3)
    pairs = {"open_from": np.array([0, 0]), "open_to": np.array([2, 1])}
    with pytest.raises(ValueError, match="ascend"):
        kernels.shortest_path(**given | pairs)


def test_too_many_windings_are_refused():
    given = problem(np.random.default_rng(0), samples=1, rows=1)
    given |= {"q": np.zeros((1, 2)), "start": np.array([0, 1]), "side": np.zeros(1, np.int32)}
    given["fixed"] = np.zeros(1, bool)
    given |= {"lower": np.full(2, -1e9), "upper": np.full(2, 1e9), "turns": np.ones(2, bool)}
    with pytest.raises((ValueError, RuntimeError)):
        kernels.shortest_path(**given)
    with pytest.raises(ValueError, match="too many"):
        kernels.windings(given["q"], given["lower"], given["upper"], given["turns"], 1000)
