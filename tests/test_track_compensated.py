"""Paths of the real tool of a measured arm."""

import numpy as np
import pytest

import kinverse as kv
import oracle
from kinverse import calibration
from kinverse.bench import cases
from kinverse.paths import Path, track
from tracked_paths import TOOL, Motion, largest_deviation, straight


@pytest.fixture(scope="module")
def bent():
    """A nominal arm, the real one, and the error model between them."""
    nominal = kv.load("kr16").with_tool(kv.pose([0.05, 0.02, 0.1]))
    real = nominal.with_base(kv.pose([0.002, 0, 0], rpy=[0, 0.002, 0.001]))
    q = nominal.random(60, 1)
    error = calibration.tool_error(nominal, q, real.fk(q)[:, :3, 3])
    return nominal, real, calibration.GeometricErrorModel(nominal).fit(q, error)


def real_errors(real, found):
    """Position errors of the real tool, by the oracle."""
    q, T = found.q[found.ok], found.T[found.ok]
    return np.array(
        [
            oracle.errors("position", t, oracle.robot_fk(real, row))[0]
            for row, t in zip(q, T, strict=True)
        ]
    )


@pytest.mark.parametrize("inner", [kv.Analytic(windings="all"), kv.Numerical(limits="ignore")])
def test_of_a_compensated_arm_the_real_tool_is_tracked(bent, inner):
    nominal, real, model = bent
    solver = calibration.Compensated(inner, model)
    T = nominal.fk(cases.path(nominal, 45))
    found = track(nominal, T, solver=solver)
    assert found.is_whole and real_errors(real, found).max() < 2e-6
    assert not solver.is_fitted
    path = Path.polyline([[0.9, -0.2, 1.1], [0.9, 0.2, 1.2]], orientation=TOOL)
    found = track(nominal, path, solver=solver, tolerance=1e-4, samples=10)
    assert found.is_whole and real_errors(real, found).max() < 2e-6
    assert found.deviation <= 1e-4 and largest_deviation(real, found, path) < 1.02e-4


def test_a_compensated_arm_passes_singularities_and_is_kept(bent):
    nominal, real, model = bent
    ends = np.radians([[0, -70, 60, 20, 30, 10], [20, -60, 70, 30, -30, 40]])
    T = real.fk(straight(*ends)(np.linspace(0.0, 1.0, 41)))
    solver = calibration.Compensated(kv.Analytic(), model)
    found = track(nominal, T, solver=solver, q_start=ends[0], max_step=0.1)
    assert found.is_whole and real_errors(real, found).max() < 2e-6
    modelled = Motion(solver.clone().fit(nominal).real_fk, straight(*ends))
    between = track(nominal, modelled, solver=solver, q_start=ends[0], samples=40)
    assert between.is_whole and len(set(between.branch)) == 2
    turned = track(nominal, T[:10], solver=solver, keep=lambda q: q[:, 5] > np.pi)
    assert turned.is_whole and (turned.q[:, 5] > np.pi).all()
    assert real_errors(real, turned).max() < 2e-6
