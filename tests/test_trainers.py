"""The trainers of MLP: each does what its source says, and all keep what every trainer promises."""

import numpy as np
import pytest

from kinverse.errors import InputError
from kinverse.networks import MLP
from kinverse.networks.layers import Layers
from kinverse.networks.monitor import Monitor
from kinverse.networks.trainers import TRAINERS, Task, find_trainer
from kinverse.networks.trainers.damping import make_damping
from kinverse.networks.trainers.gradient_descent import FASTER, MOST_RISE, SLOWER
from kinverse.networks.trainers.one_step_secant import secant_direction

FORM = Layers((2, 6, 2), ("tansig", "purelin"))
RATES = {"gdm": 0.3, "gdx": 0.05}


def rows(count=150, seed=0, noise=0.0):
    rng = np.random.default_rng(seed)
    X = rng.uniform(-1, 1, (count, 2))
    Y = np.stack([np.sin(2 * X[:, 0]) * X[:, 1], np.tanh(X[:, 0] - X[:, 1])], axis=1)
    return X, Y + noise * rng.standard_normal(Y.shape)


class Recorder(Monitor):
    """A monitor that keeps the weights of every epoch."""

    def __init__(self, epochs, outputs):
        super().__init__(max_epochs=epochs, unit=np.ones(outputs))
        self.weights = []

    def epoch(self, weights, mse, **more):
        self.weights.append(np.array(weights))
        return super().epoch(weights, mse, **more)


def run(name, X, Y, *, layers=FORM, epochs=50, start=None, seed=0, rate=0.01, momentum=0.9):
    task = Task(layers, X, Y, start, np.random.default_rng(seed), rate, momentum)
    monitor = Recorder(epochs, Y.shape[1])
    find_trainer(name).train(task, monitor)
    return monitor


def network(trainer, **settings):
    rate = RATES.get(trainer, 0.01)
    return MLP((6,), trainer=trainer, learning_rate=rate, random_state=3, **settings)


SMALL = Layers((2, 3, 2), ("tansig", "purelin"))


def determined(noise=0.05):
    """Rows that a small network made, and weights near its own."""
    rng = np.random.default_rng(5)
    X, true = rng.uniform(-1, 1, (2000, 2)), SMALL.nguyen_widrow(rng, 1.5)
    Y = SMALL.forward(true, X) + noise * rng.standard_normal((2000, 2))
    return X, Y, true + 0.05 * rng.standard_normal(SMALL.count)


# What all promise -----------------------------------------------------------------------------


@pytest.fixture(params=TRAINERS)
def trainer(request):
    return request.param


def test_it_learns(trainer):
    X, Y = rows()
    assert network(trainer, max_iter=300).fit(X, Y).score(X, Y) > 0.85


def test_two_hidden_layers_and_a_bounded_output(trainer):
    X, Y = rows()
    bounded = "purelin" if find_trainer(trainer).linear_output else "tansig"
    net = MLP(
        (6, 5),
        activation=("logsig", "tansig"),
        output_activation=bounded,
        trainer=trainer,
        learning_rate=RATES.get(trainer, 0.01),
        max_iter=300,
        random_state=0,
    )
    assert net.fit(X, Y).score(X, Y) > 0.7
    assert len(net.loss_curve_) == net.n_iter_ <= 300


def test_weights_that_are_perfect_are_kept(trainer):
    X, _ = rows()
    start = FORM.nguyen_widrow(np.random.default_rng(8))
    monitor = run(trainer, X, FORM.forward(start, X), start=start)
    assert monitor.epochs >= 1
    assert monitor.training_mse[-1].max() < 1e-6
    assert np.isfinite(monitor.best).all()


def test_ctrl_c_keeps_the_best_so_far(trainer):
    seen = []

    def stop_in_the_fifth(progress):
        seen.append(progress.training_mse.mean())
        if progress.epoch == 5:
            raise KeyboardInterrupt

    X, Y = rows()
    net = network(trainer, callback=stop_in_the_fifth)
    with pytest.warns(UserWarning, match="interrupted after 5 epochs"):
        net.fit(X, Y)
    assert (net.n_iter_, net.stop_reason_) == (5, "interrupted")
    kept = seen[-1] if trainer == "bayes" else min(seen)
    np.testing.assert_allclose(np.mean((net.predict(X) - Y) ** 2), kept, rtol=1e-9)


def test_the_callback_ends_it(trainer):
    X, Y = rows()
    net = network(trainer, callback=lambda progress: progress.epoch == 3).fit(X, Y)
    assert (net.n_iter_, net.stop_reason_) == (3, "the callback ended the training")


def test_the_goal_ends_it(trainer):
    X, Y = rows()
    net = network(trainer, goal=0.05).fit(X, Y)
    assert net.stop_reason_ == "the goal was reached"
    assert net.loss_curve_[-1] <= 0.05 < net.loss_curve_[:-1].min(initial=np.inf)


def test_a_warm_start_goes_on_from_where_it_was(trainer):
    X, Y = rows(noise=0.1)
    net = network(trainer, warm_start=True, max_iter=15).fit(X, Y)
    before = net.loss_curve_[-1]
    net.fit(X, Y)
    # what these two make smaller is more than the error
    slack = 1.05 if trainer in ("bayes", "varpro") else 1.0 + 1e-9
    assert net.loss_curve_[0] <= slack * before
    assert network(trainer, max_iter=1).fit(X, Y).loss_curve_[0] > 1.2 * before


def test_early_stopping_judges_by_rows_it_never_learns_from(trainer, monkeypatch):
    X, Y = rows(70, noise=0.3)
    learned, optimize = [], MLP._optimize

    def spied(self, X, Y, *rest):
        learned.append(X)
        optimize(self, X, Y, *rest)

    monkeypatch.setattr(MLP, "_optimize", spied)
    told = []
    net = MLP(
        (25,),
        trainer=trainer,
        learning_rate=RATES.get(trainer, 0.01),
        scaling=None,
        early_stopping=True,
        validation_fraction=0.3,
        max_iter=60,
        callback=lambda progress: told.append(progress.validation_mse.mean()),
        random_state=0,
    ).fit(X, Y)
    trained = (X[:, None] == learned[0]).all(axis=2).any(axis=1)
    assert (trained.sum(), len(learned[0])) == (49, 49)
    held = ~trained
    error = np.mean((net.predict(X[held]) - Y[held]) ** 2)
    np.testing.assert_allclose(error, min(told), rtol=1e-9)
    np.testing.assert_allclose(told, net.validation_mse_.mean(axis=1))
    since = len(told) - 1 - int(np.argmin(told))
    assert since == 10 if net.stop_reason_.startswith("no better") else since < 10


# Levenberg-Marquardt --------------------------------------------------------------------------


def test_levenberg_marquardt_solves_a_linear_problem_in_few_steps():
    rng = np.random.default_rng(0)
    X = rng.uniform(-1, 1, (80, 3))
    Y = X @ rng.standard_normal((3, 2)) + 1.0 + 0.1 * rng.standard_normal((80, 2))
    A = np.column_stack([X, np.ones(80)])
    best = np.mean((A @ np.linalg.lstsq(A, Y, rcond=None)[0] - Y) ** 2)
    form = Layers((3, 2, 2), ("purelin", "purelin"))
    monitor = run("lm", X, Y, layers=form, epochs=8)
    np.testing.assert_allclose(monitor.training_mse[-1].mean(), best, rtol=1e-9)


def test_levenberg_marquardt_never_accepts_a_rise():
    X, Y = rows(noise=0.2)
    monitor = run("lm", X, Y, epochs=300)
    assert monitor.epochs > 20
    assert (np.diff(monitor.training_mse.mean(axis=1)) < 0.0).all()


def test_levenberg_marquardt_ends_where_no_step_helps():
    X, Y, start = determined()
    monitor = run("lm", X, Y, layers=SMALL, start=start, epochs=200)
    assert monitor.epochs < 200
    assert monitor.reason.startswith(("no step lowers the error", "the gradient has vanished"))
    J = SMALL.jacobian(monitor.best, X).reshape(-1, SMALL.count)
    error = SMALL.forward(monitor.best, X) - Y
    assert np.abs(J.T @ error.ravel()).max() < 1e-5


# Bayesian regularisation ----------------------------------------------------------------------


def log_evidence(alpha, beta, w, error, JJ):
    """Of MacKay (1992), up to a constant: weights and errors of precision 2 alpha and 2 beta."""
    H = 2 * beta * JJ + 2 * alpha * np.eye(len(w))
    return (
        -beta * np.sum(error**2)
        - alpha * np.sum(w**2)
        - 0.5 * np.linalg.slogdet(H)[1]
        + 0.5 * len(w) * np.log(alpha)
        + 0.5 * error.size * np.log(beta)
    )


def test_bayes_ends_at_the_summit_of_the_evidence():
    X, Y = rows(200, noise=0.1)
    monitor = run("bayes", X, Y, epochs=3000)
    w, gamma = monitor.best, monitor.learned["effective_parameters_"]
    J = FORM.jacobian(w, X).reshape(-1, FORM.count)
    error = (FORM.forward(w, X) - Y).ravel()
    JJ = J.T @ J
    alpha = gamma / (2 * w @ w)
    beta = (error.size - gamma) / (2 * error @ error)
    values = beta * np.linalg.eigvalsh(JJ)
    np.testing.assert_allclose(gamma, np.sum(values / (values + alpha)), rtol=1e-4)
    pull = beta * J.T @ error
    np.testing.assert_allclose(pull, -alpha * w, atol=1e-3 * np.abs(pull).max())

    def slope(change_alpha, change_beta, eps=1e-5):
        """By log alpha or log beta."""
        up, down = (
            log_evidence(
                alpha * np.exp(sign * eps * change_alpha),
                beta * np.exp(sign * eps * change_beta),
                w,
                error,
                JJ,
            )
            for sign in (1, -1)
        )
        return (up - down) / (2 * eps)

    assert abs(slope(1, 0)) < 1e-3 * gamma
    assert abs(slope(0, 1)) < 1e-3 * error.size


def test_bayes_shrinks_what_pure_noise_would_teach():
    rng = np.random.default_rng(4)
    X, Y = rng.uniform(-1, 1, (60, 2)), rng.uniform(-1, 1, (60, 2))
    settings = {"max_iter": 200, "random_state": 0}
    plain = MLP((10,), trainer="lm", **settings).fit(X, Y)
    net = MLP((10,), trainer="bayes", **settings).fit(X, Y)
    count = len(net.weights_)
    assert 0.0 < net.effective_parameters_ < 0.35 * count
    assert np.linalg.norm(net.weights_) < 0.2 * np.linalg.norm(plain.weights_)
    assert net.loss_curve_[-1] > 1.5 * plain.loss_curve_[-1]


def test_bayes_uses_every_parameter_that_clean_data_determine():
    X, Y, start = determined(noise=1e-4)
    monitor = run("bayes", X, Y, layers=SMALL, start=start, epochs=100)
    assert 0.98 * SMALL.count < monitor.learned["effective_parameters_"] <= SMALL.count


def test_bayes_of_fewer_patterns_than_parameters_is_finite():
    X, Y = rows(8, noise=0.1)
    with pytest.warns(UserWarning, match="8 patterns"):
        net = MLP((30,), trainer="bayes", max_iter=50, random_state=0).fit(X, Y)
    assert 0.0 < net.effective_parameters_ <= Y.size
    assert np.isfinite(net.predict(X)).all()


def test_bayes_keeps_the_latest_weights_not_those_of_least_error():
    X, Y = rows(30, noise=0.5)
    by_heart = run("lm", X, Y, epochs=60)
    monitor = run("bayes", X, Y, start=by_heart.best, epochs=60)
    errors = monitor.training_mse.mean(axis=1)
    assert errors[-1] > 1.2 * errors.min()
    np.testing.assert_array_equal(monitor.best, monitor.weights[-1])


def test_effective_parameters_are_those_of_the_last_training():
    X, Y = rows()
    net = network("bayes", max_iter=5).fit(X, Y)
    assert 0.0 < net.effective_parameters_ <= len(net.weights_)
    net.set_params(trainer="lm").fit(X, Y)
    assert not hasattr(net, "effective_parameters_")


def test_what_is_learned_goes_with_the_best_weights():
    held = [3.0, 1.0, 2.0]
    monitor = Monitor(
        max_epochs=9,
        unit=np.ones(1),
        validation=(np.zeros((1, 1)), np.zeros((1, 1))),
        output=lambda weights, X: np.array([[weights]]),
    )
    for k, error in enumerate(held):
        monitor.epoch(error, np.ones(1), latest=True, learned={"number_": k})
    assert (monitor.best, monitor.learned) == (1.0, {"number_": 1})


# Gradient descent -----------------------------------------------------------------------------


def by_differences(X, Y, w, eps=1e-6):
    def mse(w):
        return np.mean((FORM.forward(w, X) - Y) ** 2)

    return np.array([(mse(w + eps * e) - mse(w - eps * e)) / (2 * eps) for e in np.eye(len(w))])


def test_momentum_is_the_loop_of_its_definition():
    X, Y = rows()
    w = start = FORM.nguyen_widrow(np.random.default_rng(2))
    monitor = run("gdm", X, Y, start=start, epochs=10, rate=0.2, momentum=0.7)
    change = np.zeros_like(w)
    for k in range(10):
        change = 0.7 * change - 0.2 * 0.3 * by_differences(X, Y, w)
        w = w + change
        np.testing.assert_allclose(monitor.weights[k], w, atol=1e-8)


@pytest.mark.parametrize(("rate", "momentum"), [(0.99, 0.01), (0.59, 0.68), (0.96, 0.34)])
def test_the_rates_of_document_004_do_not_diverge(rate, momentum):
    X, Y = rows(900)
    net = MLP(
        (4,), activation="logsig", trainer="gdm", learning_rate=rate, momentum=momentum,
        random_state=0,
    )  # fmt: skip
    net.fit(X, Y)
    assert net.n_iter_ == 1000
    assert net.loss_curve_[-1] < 0.5 * net.loss_curve_[0]


def test_a_rate_that_diverges_is_told_and_predicts_numbers():
    X, Y = rows()
    net = MLP((6,), trainer="gdm", learning_rate=1e8, random_state=0).fit(X, Y)
    assert "smaller rate" in net.stop_reason_
    assert np.isfinite(net.predict(X)).all()


def test_a_bad_step_is_discarded_and_the_rate_lowered():
    X, Y = rows()
    start = FORM.nguyen_widrow(np.random.default_rng(2))
    g = by_differences(X, Y, start)
    monitor = run("gdx", X, Y, start=start, epochs=60, rate=50.0, momentum=0.5)
    still = [np.array_equal(w, start) for w in monitor.weights]
    tries = still.index(False)
    assert tries >= 3
    step = -50.0 * SLOWER**tries * 0.5 * g
    np.testing.assert_allclose(monitor.weights[tries], start + step, rtol=1e-5, atol=1e-6)
    errors = monitor.training_mse.mean(axis=1)
    assert (errors[1:] <= MOST_RISE * errors[:-1]).all()


def test_a_good_step_raises_the_rate():
    X, Y = rows()
    start = FORM.nguyen_widrow(np.random.default_rng(2))
    one, two = run("gdx", X, Y, start=start, epochs=2, rate=0.01, momentum=0.0).weights
    step = -0.01 * FASTER * by_differences(X, Y, one)
    np.testing.assert_allclose(two, one + step, atol=1e-9)


# One-step secant ------------------------------------------------------------------------------


def test_secant_direction_is_that_of_memoryless_bfgs():
    rng = np.random.default_rng(7)
    for _ in range(20):
        g, s, y = rng.standard_normal((3, 6))
        y = y if s @ y > 0 else -y
        rho = 1.0 / (s @ y)
        left = np.eye(6) - rho * np.outer(s, y)
        H = left @ left.T + rho * np.outer(s, s)
        np.testing.assert_allclose(secant_direction(g, s, y), -H @ g, rtol=1e-9, atol=1e-9)
        np.testing.assert_array_equal(secant_direction(g, s, -y), -g)


def test_one_step_secant_falls_in_every_epoch():
    X, Y = rows(noise=0.1)
    monitor = run("oss", X, Y, epochs=200)
    assert (np.diff(monitor.training_mse.mean(axis=1)) < 0.0).all()


# Limited memory BFGS --------------------------------------------------------------------------


def test_limited_memory_bfgs_says_why_it_ended():
    X, Y, start = determined()
    monitor = run("lbfgs", X, Y, layers=SMALL, start=start, epochs=5000)
    assert monitor.epochs < 5000
    assert monitor.reason == "no step lowers the error any more"
    one = run("lbfgs", X, Y, layers=SMALL, start=start, epochs=1)
    assert (one.epochs, one.reason) == (1, "all epochs were used")


@pytest.mark.parametrize("trainer", ["lm", "bayes"])
@pytest.mark.parametrize("damping", ["tenfold", "nielsen"])
def test_either_damping_learns_a_smooth_map(trainer, damping):
    rng = np.random.default_rng(3)
    X = rng.uniform(-1, 1, (300, 2))
    y = np.sin(2.0 * X[:, 0]) * X[:, 1]
    net = MLP(hidden=(10,), trainer=trainer, damping=damping, max_iter=60, random_state=1)
    assert net.fit(X, y).loss_curve_[-1] < 1e-3 * y.var()


def test_nielsen_trusts_a_model_that_keeps_its_promise():
    rule = make_damping("nielsen", 1.0)
    rule.accept(1.0)
    assert rule.mu == pytest.approx(1.0 / 3.0)
    rule.refuse()
    rule.refuse()
    assert rule.mu == pytest.approx(8.0 / 3.0)
    rule.accept(0.0)  # nothing gained: the model was too bold
    assert rule.mu == pytest.approx(16.0 / 3.0)


def test_an_unknown_damping_names_the_known():
    with pytest.raises(InputError, match="'tenfold' or 'nielsen'"):
        MLP(damping="none", trainer="lm").fit(np.zeros((5, 1)), np.arange(5.0))


def test_a_callback_sees_the_network_as_it_is_now():
    rng = np.random.default_rng(3)
    X = rng.uniform(-1, 1, (60, 2))
    y = 3.0 * X[:, :1] - 1.0
    errors = []

    def look(progress):
        errors.append(float(np.mean((progress.predict(X) - y) ** 2)))

    net = MLP(hidden=(4,), max_iter=8, random_state=0, callback=look).fit(X, y)
    np.testing.assert_allclose(errors, net.training_mse_[:, 0], rtol=1e-9)
