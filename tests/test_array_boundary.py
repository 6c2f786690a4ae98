"""Whatever is handed to a solver, the answer is an answer or a clear error."""

import hypothesis.extra.numpy as hnp
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import kinverse as kv

ROBOT = kv.load("puma560")
SOLVERS = [kv.Analytic().fit(ROBOT), kv.Numerical(max_starts=3).fit(ROBOT)]
ANSWERS = (kv.InputError, TypeError)

DTYPES = st.sampled_from(["f8", "f4", "i4", "u1", "?", "c16", "U3", "O", ">f8", "f2"])
SHAPES = hnp.array_shapes(min_dims=0, max_dims=4, min_side=0, max_side=5) | st.sampled_from(
    [(4, 4), (3, 4, 4), (0, 4, 4), (6,), (3, 6), (1, 6), (0, 6)]
)


@st.composite
def arrays(draw):
    dtype, shape = draw(DTYPES), draw(SHAPES)
    if dtype == "O":
        return np.full(shape, draw(st.sampled_from([None, 1.0, "x", [1]])), dtype=object)
    array = draw(hnp.arrays(dtype, shape))
    how = draw(st.sampled_from(["plain", "fortran", "strided", "readonly"]))
    if how == "fortran":
        array = np.asfortranarray(array)
    elif how == "strided" and array.ndim:
        array = np.repeat(array, 2, axis=0)[::2]
    elif how == "readonly":
        array.flags.writeable = False
    return array


@pytest.mark.parametrize("solver", SOLVERS, ids=["analytic", "numerical"])
@settings(max_examples=150, deadline=None)
@given(T=arrays(), q_seed=st.none() | arrays())
def test_any_array_is_answered_or_refused(solver, T, q_seed):
    with np.errstate(all="ignore"):
        try:
            s = solver.solve(T, q_seed=q_seed)
        except ANSWERS as error:
            assert len(str(error)) > 10
            return
    assert s.q.shape == (s.count.sum(), 6)


@settings(max_examples=100, deadline=None)
@given(q=arrays())
def test_any_array_through_forward_kinematics(q):
    with np.errstate(all="ignore"):
        try:
            T = ROBOT.fk(q)
        except ANSWERS:
            return
    assert T.shape[-2:] == (4, 4) and np.isfinite(T).all()


@settings(max_examples=60, deadline=None)
@given(noise=hnp.arrays("f8", (4, 4), elements=st.floats(-1e-3, 1e-3)))
def test_nearly_rigid_poses_are_taken_or_named(noise):
    T = ROBOT.fk(np.full(6, 0.4)) + noise
    T[3] = [0, 0, 0, 1]
    R = T[:3, :3]
    rigid = np.abs(R.T @ R - np.eye(3)).max()
    if rigid < 0.99e-5:
        assert len(SOLVERS[0].solve(T)) == 1
    elif rigid > 1.01e-5:
        with pytest.raises(kv.InputError, match="T"):
            SOLVERS[0].solve(T)


@pytest.mark.parametrize("value", [np.nan, np.inf, -np.inf])
@pytest.mark.parametrize("solver", SOLVERS, ids=["analytic", "numerical"])
def test_the_bad_row_of_a_batch_is_named(solver, value):
    T = ROBOT.fk(ROBOT.random(20, rng=1))
    T[13, 1, 3] = value
    with pytest.raises(kv.InputError, match="13"):
        solver.solve(T)
    seeds = ROBOT.random(20, rng=2)
    seeds[7, 2] = value
    with pytest.raises(kv.InputError, match="7"):
        solver.solve(ROBOT.fk(ROBOT.random(20, rng=1)), q_seed=seeds)
