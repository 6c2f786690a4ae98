"""What several methods draw with."""

import numpy as np
import pytest

from kinverse.errors import InputError
from kinverse.optimizers.tools import number_within, roulette, take


@pytest.mark.parametrize("members", [1, 2, 3, 7, 8, 9, 100])
def test_the_wheel_is_a_search_of_the_sums(members):
    rng = np.random.default_rng(members)
    weights = rng.random((5, members)) * (rng.random((5, members)) < 0.7)
    weights[:, rng.integers(members)] += 0.1
    u = rng.random((5, 400))
    picked = roulette(weights, u)
    for row, one, got in zip(weights, u, picked, strict=True):
        sums = (row / row.max()).cumsum()
        assert (got == np.searchsorted(sums, one * sums[-1], side="right")).all()
        assert (row[got] > 0.0).all()


def test_the_wheel_gives_each_its_share():
    weights = np.array([[1.0, 0.0, 2.0, 5.0]])
    picked = roulette(weights, (np.arange(8000)[None] + 0.5) / 8000)
    assert np.bincount(picked[0], minlength=4).tolist() == [1000, 0, 2000, 5000]


def test_a_wheel_of_nothing_is_fair_and_huge_weights_do_not_overflow():
    u = np.random.default_rng(0).random((1, 3000))
    for weight in (0.0, 1e308):
        counts = np.bincount(roulette(np.full((1, 3), weight), u)[0], minlength=3)
        assert counts.min() > 900


def test_take_takes_members():
    rng = np.random.default_rng(1)
    x, index = rng.random((4, 6, 3)), rng.integers(6, size=(4, 9))
    assert (take(x, index) == np.take_along_axis(x, index[:, :, None], axis=1)).all()
    assert (take(x[:, :, 0], index) == np.take_along_axis(x[:, :, 0], index, axis=1)).all()


@pytest.mark.parametrize("value", [-0.1, 1.1, np.nan, np.inf, "1", None, True, [0.5]])
def test_a_number_outside_is_refused(value):
    with pytest.raises(InputError, match=r"share must be a number in 0\.\.1, got "):
        number_within("share", value, 0.0, 1.0)


def test_a_number_without_an_upper_end():
    number_within("share", 3, 0.0)
    number_within("share", np.float32(0.5), 0.0, 1.0)
    with pytest.raises(InputError, match="of at least 0"):
        number_within("share", np.inf, 0.0)
