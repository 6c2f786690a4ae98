"""The firefly algorithm, beside the laws for all."""

import numpy as np
import pytest

from kinverse.errors import InputError
from kinverse.optimizers import Firefly
from optimizer_laws import BOUNDS, bowls, hold_all, search


@pytest.mark.parametrize("greedy", [False, True])
def test_the_laws(greedy):
    hold_all(Firefly(population=15, greedy=greedy))


@pytest.mark.parametrize(("dimensions", "problems"), [(1, 1), (2, 3), (9, 1), (12, 4)])
def test_visits_are_those_of_the_loops_in_the_paper(dimensions, problems):
    method = Firefly(population=11, attraction=0.8, absorption=2.0, noise=0.0)
    bounds = np.tile([-3.0, 5.0], (dimensions, 1))
    run = method.start(bounds, max_evals=1000, rng=4, problems=problems)
    x = run.ask()
    f = bowls(x, np.ones((problems, dimensions)))
    run.tell(f)
    moved = run.ask()
    for one in range(problems):
        order = np.argsort(f[one])
        stood = (x[one][order] + 3.0) / 8.0
        for i in range(11):
            now = stood[i].copy()
            for j in range(i):
                far = ((stood[j] - now) ** 2).sum()
                now += 0.8 * np.exp(-2.0 * far) * (stood[j] - now)
            assert np.allclose((moved[one, i] + 3.0) / 8.0, now, atol=2e-6)


def test_one_is_a_member_of_many_in_many_dimensions():
    """Nine and more numbers are summed in another order where they lie side by side."""
    bounds = np.tile([-3.0, 5.0], (17, 1))
    goals = np.linspace(-1.0, 3.0, 17) * np.array([[1.0], [0.5], [-0.2], [0.9], [0.1]])
    many = search(Firefly(population=9), goals=goals, bounds=bounds, evals=300)
    for k in range(5):
        one = search(
            Firefly(population=9), goals=goals[k : k + 1], keys=[(k,)], bounds=bounds, evals=300
        )
        assert (one.x_best[0] == many.x_best[k]).all()


def test_a_swarm_far_smaller_than_the_box_moves_as_precisely():
    method = Firefly(population=10, noise=0.0, absorption=0.0, attraction=0.5)
    x0 = 0.3 + 1e-9 * np.random.default_rng(3).random((10, 2))
    run = method.start([(-1, 1)] * 2, max_evals=1000, x0=x0)
    x = run.ask()
    run.tell(bowls(x, np.zeros((1, 2))))
    order = np.argsort(bowls(x, np.zeros((1, 2)))[0])
    stood, moved = x[0][order], run.ask()[0]
    now = stood.copy()
    for j in range(9):
        now[j + 1 :] += 0.5 * (stood[j] - now[j + 1 :])
    assert np.abs(moved - now).max() < 1e-15


@pytest.mark.parametrize("greedy", [False, True])
def test_who_goes_back(greedy):
    method = Firefly(population=12, greedy=greedy)
    run = method.start(BOUNDS, max_evals=10**5, rng=4, problems=4)
    run.tell(bowls(run.ask(), np.zeros((4, 4))))
    for _ in range(10):
        x = run.ask()
        was = method._members(run)[1].copy()
        assert (np.diff(was, axis=1) >= 0.0).all()
        f = bowls(x, np.zeros((4, 4)))
        run.tell(f)
        members, now = method._members(run)
        assert (now[:, 0] == np.minimum(was[:, 0], f[:, 0])).all()
        assert (now[:, 1:] == (np.minimum(was, f) if greedy else f)[:, 1:]).all()
        assert np.allclose(bowls(members, np.zeros((4, 4))), now)


def test_the_random_step_is_a_share_of_the_range_and_shrinks():
    method = Firefly(population=40, attraction=0.0, noise=0.1, decay=0.5)
    run = method.start(BOUNDS, max_evals=10**5, rng=4, problems=10)
    run.tell(bowls(run.ask(), np.zeros((10, 4))))
    for step in range(6):
        order = np.argsort(run.state.f, axis=1, kind="stable")
        stood = np.take_along_axis(run.state.x, order[:, :, None], axis=1)
        x = run.ask()
        most = (np.abs(x - stood) / run.span).max()
        assert 0.045 * 0.5**step < most < 0.05001 * 0.5**step + 1e-6
        run.tell(bowls(x, np.zeros((10, 4))))


@pytest.mark.parametrize(
    ("settings", "message"),
    [
        ({"attraction": 2.5}, r"attraction must be a number in 0\.\.2"),
        ({"absorption": -1.0}, r"absorption must be a number in 0\.\.1e\+06"),
        ({"noise": 2.0}, r"noise must be a number in 0\.\.1"),
        ({"decay": 0}, None),
        ({"decay": 1.1}, r"decay must be a number in 0\.\.1"),
    ],
)
def test_settings_that_cannot_be_used(settings, message):
    method = Firefly(population=20, **settings)
    if message is None:
        method.start(BOUNDS, max_evals=1000)
        return
    with pytest.raises(InputError, match=f"Firefly: {message}"):
        method.start(BOUNDS, max_evals=1000)


@pytest.mark.parametrize("absorption", [0.0, 1e6])
def test_extreme_settings_stay_finite(absorption):
    hold = Firefly(population=60, attraction=2.0, absorption=absorption, noise=1.0, decay=1.0)
    run = hold.start(BOUNDS, max_evals=3000, problems=3)
    while not run.done:
        x = run.ask()
        assert np.isfinite(x).all()
        run.tell(bowls(x))
