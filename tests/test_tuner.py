"""The tuner: what it finds, tells and keeps."""

import warnings

import numpy as np
import pytest
from sklearn.linear_model import Ridge
from sklearn.model_selection import GridSearchCV, GroupKFold, KFold

from kinverse.errors import InputError
from kinverse.networks import MLP, SwarmMLP, tune
from kinverse.optimizers import GreyWolf


def rows(count=90, seed=4):
    rng = np.random.default_rng(seed)
    X = rng.uniform(-1, 1, (count, 2))
    return X, np.stack([np.sin(3 * X[:, 0]), 0.01 * X[:, 0] * X[:, 1]], axis=1)


def mlp(**settings):
    return MLP(**({"trainer": "lbfgs", "max_iter": 60, "random_state": 1} | settings))


GRID = {"hidden": [(1,), (8,)], "activation": ["tansig", "purelin"]}


def test_it_finds_what_can_learn_the_rows():
    X, y = rows()
    found = tune(mlp(), X, y, GRID, folds=3, random_state=0)
    assert found.best.settings == {"hidden": (8,), "activation": "tansig"}
    assert len(found.trials) == 4 and not found.interrupted
    errors = [trial.error for trial in found.trials]
    assert errors == sorted(errors) and errors[0] < 0.3 < errors[-1]
    assert found.network.hidden == (8,)
    np.testing.assert_array_equal(found.network.predict(X), mlp(hidden=(8,)).fit(X, y).predict(X))


def test_figures_are_those_of_the_folds():
    X, y = rows()
    pairs = list(KFold(4, shuffle=True, random_state=9).split(X))
    trial = tune(mlp(), X, y, {"hidden": [(3,)]}, folds=pairs).best
    for k, (train, held) in enumerate(pairs):
        error = mlp(hidden=(3,)).fit(X[train], y[train]).predict(X[held]) - y[held]
        rms = np.sqrt((error**2).mean(axis=0))
        np.testing.assert_allclose(trial.rms[k], rms, rtol=1e-12)
        relative = np.sqrt(np.mean((rms / y.std(axis=0)) ** 2))
        assert trial.errors[k] == pytest.approx(relative, rel=1e-12)
    assert trial.error == trial.errors.mean() and trial.spread == trial.errors.std()
    assert trial.fit_seconds > 0.0


def test_it_ranks_as_scikit_learns_grid_search():
    X, y = rows()
    pairs = list(KFold(3, shuffle=True, random_state=2).split(X))
    grid = {"alpha": [1e-3, 1.0, 30.0, 1e3]}
    theirs = GridSearchCV(Ridge(), grid, cv=pairs, scoring="neg_mean_squared_error")
    ranks = theirs.fit(X, y[:, 0]).cv_results_["rank_test_score"]
    order = [grid["alpha"][k] for k in np.argsort(ranks)]
    found = tune(Ridge(), X, y[:, 0], grid, folds=pairs)
    assert [trial.settings["alpha"] for trial in found.trials] == order
    np.testing.assert_allclose(found.network.predict(X), theirs.predict(X))


def test_units_of_the_targets_do_not_matter():
    X, y = rows()
    y[:, 1] += 0.01 * np.random.default_rng(0).normal(size=len(y))  # most is noise
    one = tune(mlp(), X, y, GRID, folds=3, random_state=0)
    two = tune(mlp(), X, y * [1.0, 2.0**20], GRID, folds=3, random_state=0)
    for a, b in zip(one.trials, two.trials, strict=True):
        assert a.settings == b.settings
        np.testing.assert_allclose(a.errors, b.errors, rtol=1e-9)


def test_a_constant_target_is_no_division_by_zero():
    X, y = rows()
    y[:, 1] = 7.0
    assert np.isfinite(tune(mlp(), X, y, {"hidden": [(2,)]}, folds=2).best.error)


def test_one_split_and_given_groups():
    X, y = rows()
    one = tune(mlp(), X, y, {"hidden": [2]}, validation_fraction=0.25, random_state=1)
    assert one.best.rms.shape == (1, 2) and one.best.spread == 0.0
    groups = np.arange(len(X)) // 10
    five = tune(mlp(), X, y, {"hidden": [2]}, folds=GroupKFold(3).split(X, y, groups))
    assert five.best.rms.shape == (3, 2)


def test_one_seed_gives_one_result():
    X, y = rows()
    net = mlp(random_state=None)
    one, two, other = (tune(net, X, y, {"hidden": [4, 5]}, random_state=s) for s in (3, 3, 4))
    np.testing.assert_array_equal(one.network.predict(X), two.network.predict(X))
    assert [t.error for t in one.trials] == [t.error for t in two.trials]
    assert one.best.error != other.best.error
    assert net.random_state is None and "weights_" not in vars(net)


def test_a_few_drawn_of_many():
    X, y = rows()
    grid = {"hidden": [1, 2, 3, 4, 5], "activation": ["tansig", "logsig"]}
    one, two = (tune(mlp(), X, y, grid, folds=2, max_trials=4, random_state=s) for s in (1, 2))
    tried = [{tuple(t.settings.items()) for t in found.trials} for found in (one, two)]
    assert len(tried[0]) == len(tried[1]) == 4 and tried[0] != tried[1]
    assert len(tune(mlp(), X, y, {"hidden": [1, 2]}, folds=2, max_trials=9).trials) == 2


def test_progress_is_told_and_may_end_it():
    X, y = rows()
    seen = []
    found = tune(mlp(), X, y, GRID, folds=2, callback=lambda p: seen.append(p) or p.done == 3)
    assert [(p.done, p.total) for p in seen] == [(1, 4), (2, 4), (3, 4)]
    assert {id(p.trial) for p in seen} == {id(trial) for trial in found.trials}
    assert found.network is not None and not found.interrupted


@pytest.mark.parametrize("fits", [3, 4])
def test_an_interrupt_keeps_what_was_finished(fits):
    X, y = rows()
    begun = []

    def interrupt(progress):
        begun.append(progress.epoch == 1)
        if sum(begun) == fits + 1:
            raise KeyboardInterrupt

    with warnings.catch_warnings(record=True) as told:
        warnings.simplefilter("always")
        found = tune(mlp(callback=interrupt, max_iter=5), X, y, GRID, folds=2)
    assert "interrupted after" in str(told[-1].message)
    # a trial of two fits counts if both ran to their end
    assert len(found.trials) == fits // 2 and found.interrupted and found.network is None
    assert found.best.rms.shape == (2, 2)


def test_an_interrupt_of_the_last_fit_keeps_all_trials():
    class Slow(Ridge):
        def fit(self, X, y):
            if len(X) == 90:
                raise KeyboardInterrupt
            return super().fit(X, y)

    X, y = rows()
    with pytest.warns(UserWarning, match="after 2 of 2 trials"):
        found = tune(Slow(), X, y, {"alpha": [1.0, 2.0]}, folds=2)
    assert len(found.trials) == 2 and found.network is None


def test_an_interrupt_before_the_first_result_passes_through():
    X, y = rows()

    def interrupt(progress):
        raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt), pytest.warns(UserWarning, match="interrupted"):
        tune(mlp(callback=interrupt), X, y, GRID)


def test_the_table():
    X, y = rows()
    lines = str(tune(mlp(), X, y, GRID, folds=2, random_state=0)).splitlines()
    assert lines[0].split() == ["hidden", "activation", "error", "spread", "seconds"]
    assert lines[1].split()[:2] == ["(8,)", "tansig"] and len(lines) == 5
    assert len(set(map(len, lines))) == 1


def test_a_fit_that_ends_in_no_number_ranks_last():
    class Broken(Ridge):
        def predict(self, X):
            return super().predict(X) * (np.nan if self.alpha == 1.0 else 1.0)

    X, y = rows()
    found = tune(Broken(), X, y, {"alpha": [1.0, 2.0]}, folds=2)
    assert [trial.settings["alpha"] for trial in found.trials] == [2.0, 1.0]
    assert found.trials[1].error == np.inf


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        ({"grid": {"hiden": [1]}}, "no setting 'hiden': it has .*hidden"),
        ({"grid": {"hidden": []}}, "no values"),
        ({"grid": {"hidden": 3}}, "list of values"),
        ({"grid": {"trainer": "lbfgs"}}, "list of values"),
        ({"grid": {}}, "grid"),
        ({"grid": [("hidden", 3)]}, "grid"),
        ({"grid": {"hidden": [4, 0]}}, "hidden units"),
        ({"folds": 1}, "folds"),
        ({"folds": 200}, "90 rows"),
        ({"folds": []}, "folds"),
        ({"folds": "five"}, "folds"),
        ({"validation_fraction": 1.0}, "validation_fraction"),
        ({"validation_fraction": 0.9999}, "90 rows"),
        ({"max_trials": 0}, "max_trials"),
        ({"network": "mlp"}, "regressor"),
    ],
)
def test_bad_arguments_are_named_before_anything_is_trained(arguments, words):
    X, y = rows()

    def never(progress):
        raise AssertionError("a network was trained")

    given = {"network": mlp(callback=never), "grid": {"hidden": [2]}} | arguments
    with pytest.raises(InputError, match=words):
        tune(given.pop("network"), X, y, given.pop("grid"), **given)


def test_bad_rows_are_refused():
    X, y = rows()
    for bad in (X[:-1], np.where(X > 0.9, np.nan, X)):
        with pytest.raises(ValueError):
            tune(mlp(), bad, y, {"hidden": [2]})


def test_settings_of_an_optimizer_can_be_tuned():
    X, y = rows()
    net = SwarmMLP(optimizer=GreyWolf(), max_evals=2000, random_state=1)
    grid = {"optimizer__population": [20, 50], "bound": np.array([0.01, 1.0])}
    found = tune(net, X, y, grid, folds=2)
    assert [trial.settings["bound"] for trial in found.trials] == [1.0, 1.0, 0.01, 0.01]
    assert found.network.optimizer.population == found.best.settings["optimizer__population"]
    assert net.optimizer == GreyWolf()
