"""Every network keeps scikit-learn's contract, and ours."""

import numpy as np
import pytest
from sklearn.base import clone
from sklearn.utils.estimator_checks import parametrize_with_checks

from kinverse import networks
from kinverse.networks import make_network
from kinverse.optimizers import DifferentialEvolution, GreyWolf

pytestmark = pytest.mark.filterwarnings("ignore::UserWarning")

MAY_BE_POOR = {"PiSigma", "SwarmMLP"}
SETTINGS = {
    "MLP": [
        {},
        {"trainer": "lbfgs", "max_iter": 100},
        {"trainer": "lm", "max_iter": 15},
        {"trainer": "bayes", "max_iter": 15},
        {"trainer": "gdm", "learning_rate": 0.5, "max_iter": 150},
        {"trainer": "gdx", "max_iter": 100},
        {"trainer": "oss", "max_iter": 60},
        {
            "trainer": "lm",
            "hidden": (5, 4),
            "activation": ("tansig", "logsig"),
            "output_activation": "tansig",
            "max_iter": 15,
        },
    ],
    "RBFNetwork": [
        {},
        {"n_neurons": 20, "selection": "residual", "goal": 1e-4, "goal_kind": "sse"},
        {"n_neurons": 40, "selection": "random", "spread": 2.0},
        {"selection": "exact", "spread": "dmax", "scaling": None},
    ],
    "SwarmRBF": [
        {},
        {"n_neurons": 4, "max_evals": 500, "optimizer": "gwo", "early_stopping": True},
        {"n_neurons": 6, "max_evals": 500, "optimizer": DifferentialEvolution(population=20)},
    ],
    "SwarmMLP": [
        {"max_evals": 5000},
        {"optimizer": "ga", "encoding": "binary", "max_evals": 2000},
        {"optimizer": GreyWolf(population=30), "encoding": "matrix", "max_evals": 2000},
    ],
    "ANFIS": [{}, {"mf": "gauss", "order": 1}, {"mf": "tri", "order": 0}],
    "PiSigma": [{}, {"rule": "simultaneous", "output": "purelin", "learning_rate": 0.005}],
    "PolynomialPerceptron": [{}, {"output": "tansig"}],
}
"""Settings beside the defaults that the whole contract is held for."""


def cases(first=0, last=None):
    """Estimators with settings number first..last of each network."""
    return [
        make_network(name, **settings)
        for name in networks.NAMES
        for settings in SETTINGS.get(name, [{}])[first:last]
    ]


@parametrize_with_checks(cases(last=1))
def test_scikit_learn_finds_nothing_to_object(estimator, check):
    check(estimator)


@pytest.mark.slow
@parametrize_with_checks(cases(first=1))
def test_nor_with_other_settings(estimator, check):
    check(estimator)


@pytest.mark.parametrize("name", networks.NAMES)
def test_only_two_may_be_poor(name):
    assert make_network(name).__sklearn_tags__().regressor_tags.poor_score == (name in MAY_BE_POOR)


@pytest.fixture(params=cases(), ids=repr)
def network(request):
    return clone(request.param)


def smooth(rows=120, seed=3):
    rng = np.random.default_rng(seed)
    X = rng.uniform(-1, 1, (rows, 3))
    return X, np.stack([np.sin(X[:, 0] + X[:, 1]), X[:, 2] * 3.0], axis=1)


def seeded(network, seed=5):
    if "random_state" in network.get_params():
        network.set_params(random_state=seed)
    return network


def test_one_seed_gives_one_network(network):
    X, y = smooth()
    one, two = (seeded(clone(network)).fit(X, y) for _ in range(2))
    np.testing.assert_array_equal(one.predict(X), two.predict(X))


def test_the_quick_way_and_the_checked_way_agree(network):
    X, y = smooth()
    seeded(network).fit(X, y)
    np.testing.assert_array_equal(network.predict(X), network.predict(X.tolist()))


def test_constant_columns_do_no_harm(network):
    X, y = smooth()
    X = np.column_stack([X, np.full(len(X), 7.0)])
    y = np.column_stack([y, np.full(len(y), -2.0)])
    out = seeded(network).fit(X, y).predict(X)
    assert np.isfinite(out).all()
    np.testing.assert_allclose(out[:, 2], -2.0, atol=1e-6)


def test_a_saved_network_predicts_the_same_bits(network, tmp_path):
    X, y = smooth()
    seeded(network).fit(X, y).save(tmp_path / "net.npz")
    again = networks.load(tmp_path / "net.npz")
    np.testing.assert_array_equal(again.predict(X), network.predict(X))
    assert repr(again) == repr(network)


def test_nan_is_refused_and_leaves_the_network_as_it_was(network):
    X, y = smooth()
    seeded(network).fit(X, y)
    before = network.predict(X)
    bad = X.copy()
    bad[7, 1] = np.nan
    with pytest.raises(ValueError, match="NaN"):
        network.predict(bad)
    with pytest.raises(ValueError, match="NaN"):
        network.fit(bad, y)
    np.testing.assert_array_equal(network.predict(X), before)


@pytest.mark.parametrize(
    "name", [n for n in networks.NAMES if hasattr(make_network(n), "activation")]
)
def test_a_setting_changed_after_fit_waits_for_the_next_fit(name):
    X, y = smooth()
    network = seeded(make_network(name)).fit(X, y)
    before = network.predict(X)
    network.set_params(activation="logsig" if network.activation == "tansig" else "tansig")
    np.testing.assert_array_equal(network.predict(X), before)


@pytest.mark.parametrize("size", [1e-310, 1e-140, 1e140])
def test_targets_of_any_size_give_numbers(size):
    X, y = smooth()
    net = make_network("MLP", hidden=(6,), max_iter=10, random_state=1).fit(X, size * y)
    assert np.isfinite(net.predict(X)).all()
    if size > 1e-200:
        assert net.n_iter_ > 1
        assert np.abs(net.predict(X) / size - y).max() < 0.5


def test_who_goes_on_has_not_seen_the_rows_held_back():
    rng = np.random.default_rng(0)
    X, noise = rng.uniform(-1, 1, (80, 3)), rng.standard_normal(80)
    net = make_network(
        "MLP", hidden=(40,), trainer="lm", early_stopping=True, warm_start=True, max_iter=30
    )
    errors = [net.fit(X, noise).validation_mse_.min() for _ in range(4)]
    assert min(errors) > 0.5 * noise.var()
