"""Data sets: reproducible, true to the robot, and honest about what they left out."""

import pickle

import numpy as np
import pytest

import kinverse as kv
import oracle
from kinverse.learning import (
    DataSet,
    PoseFeatures,
    Predicate,
    VirtualVector,
    branch_of,
    collision_free,
    far_from_singularity,
    inside_limits,
    one_branch,
    sample,
)
from kinverse.robot import Robot


@pytest.fixture(scope="module")
def kr16():
    return kv.load("kr16")


@pytest.fixture(scope="module")
def closed(kr16):
    return kv.Analytic().fit(kr16)


def high(q):
    return q[:, 0] > 1.0


def bent(q):
    return q[:, 2] > 0.0


# Drawing ----------------------------------------------------------------------------------------


def test_poses_are_those_of_the_joints(kr16):
    data = sample(kr16, 20, random_state=1)
    for q, T in zip(data.q, data.T, strict=True):
        assert np.abs(oracle.fk(kr16.frames, kr16.kinds, q) - T).max() < 1e-12
    assert len(data) == 20 == data.drawn and data.rejected == {}


def test_joints_fill_the_limits(kr16):
    q = sample(kr16, 5000, random_state=2).q
    low, high = kr16.limits.T
    assert ((q >= low) & (q <= high)).all()
    share = (q - low) / (high - low)
    assert np.abs(share.mean(axis=0) - 0.5).max() < 0.02
    assert share.min() < 0.01 and share.max() > 0.99


def test_seeds(kr16):
    one = sample(kr16, 50, random_state=3)
    assert (one.q == sample(kr16, 50, random_state=3).q).all()
    assert (one.q != sample(kr16, 50, random_state=4).q).any()
    assert (sample(kr16, 50).q == sample(kr16, 50, random_state=0).q).all()
    generator = np.random.default_rng(5)
    first, second = (sample(kr16, 50, random_state=generator).q for _ in range(2))
    assert (first != second).any()


def test_a_longer_draw_begins_with_the_shorter_one(kr16):
    # no sample and no count depends on how the draw was cut into batches
    short = sample(kr16, 40, random_state=6, keep=[high, bent])
    long = sample(kr16, 400, random_state=6, keep=[high, bent])
    assert (long.q[:40] == short.q).all()
    assert short.drawn < long.drawn


# Keeping ----------------------------------------------------------------------------------------


def test_counts_add_up(kr16):
    data = sample(kr16, 300, random_state=7, keep=[high, bent])
    assert list(data.rejected) == ["high", "bent"]
    assert 300 + sum(data.rejected.values()) == data.drawn
    assert (high(data.q) & bent(data.q)).all()
    q = kr16.random(data.drawn, np.random.default_rng(7))  # the same draw, judged by hand
    assert data.rejected["high"] == (~high(q)).sum()
    assert data.rejected["bent"] == (high(q) & ~bent(q)).sum()
    assert (q[high(q) & bent(q)] == data.q).all()


def test_a_later_predicate_sees_what_earlier_ones_left(kr16):
    seen = []

    def watch(q):
        seen.append(high(q).all())
        return np.ones(len(q), dtype=bool)

    data = sample(kr16, 100, random_state=8, keep={"first": high, "second": watch})
    assert all(seen) and data.rejected["second"] == 0
    assert list(data.rejected) == ["first", "second"]


def test_predicates_of_one_name_are_told_apart(kr16):
    three = [Predicate("half", lambda q, j=j: q[:, j] > 0.0) for j in range(3)]
    assert list(sample(kr16, 10, keep=three).rejected) == ["half", "half #2", "half #3"]


def test_predicates_that_keep_nothing_are_named(kr16):
    with pytest.raises(kv.InputError, match="'never' rejected .* 0 were kept"):
        sample(kr16, 5, keep={"high": high, "never": lambda q: q[:, 0] > 99.0})


def test_what_is_rare_but_there_is_found(kr16):
    low, top = kr16.limits[0]
    rare = Predicate("rare", lambda q: q[:, 0] > top - 1e-3 * (top - low))
    data = sample(kr16, 100, random_state=9, keep=rare)
    assert len(data) == 100 and data.rejected["rare"] > 80_000


@pytest.mark.parametrize(
    "answer",
    [
        lambda q: True,
        lambda q: np.ones(len(q) + 1, bool),
        lambda q: np.ones(len(q)),
        lambda q: None,
    ],
)
def test_predicates_that_return_something_else_are_named(kr16, answer):
    with pytest.raises(kv.InputError, match=r"predicate 'mine' must return \(\d+,\) of bool"):
        sample(kr16, 5, keep={"mine": answer})
    with pytest.raises(kv.InputError, match="predicate '<lambda>' must return"):
        (inside_limits(kr16) & answer)(kr16.random(3))


@pytest.mark.parametrize("keep", [3, "high", [high, None], {"a": 1}])
def test_what_is_no_predicate_is_refused(kr16, keep):
    with pytest.raises(kv.InputError, match="keep must be predicates"):
        sample(kr16, 5, keep=keep)


def test_predicates_go_together(kr16):
    q = kr16.random(200, rng=1)
    one, other = Predicate("high", high), Predicate("bent", bent)
    assert ((one & other)(q) == (high(q) & bent(q))).all()
    assert ((one | bent)(q) == (high(q) | bent(q))).all()
    assert ((~one)(q) == ~high(q)).all()
    assert (one & ~other).name == "(high & ~bent)"
    again = pickle.loads(pickle.dumps(far_from_singularity(kr16) & one))
    assert (again(q) == (far_from_singularity(kr16)(q) & high(q))).all()


# Predicates at hand -----------------------------------------------------------------------------


def test_inside_limits(kr16):
    q = sample(kr16, 200, random_state=1, keep=inside_limits(kr16, 0.3)).q
    low, top = kr16.limits.T
    assert ((q >= low + 0.3) & (q <= top - 0.3)).all()
    each = np.array([0.0, 0.1, 0.0, 0.0, 1.0, 0.0])
    q = sample(kr16, 200, random_state=1, keep=inside_limits(kr16, each)).q
    assert ((q >= low + each) & (q <= top - each)).all()
    assert inside_limits(kr16)(kr16.limits.T).all()
    for margin in (-0.1, np.nan, [0.1, 0.2]):
        with pytest.raises(kv.InputError, match="margin"):
            inside_limits(kr16, margin)
    with pytest.raises(kv.InputError, match=f"nothing of joint {kr16.joint_names[1]!r}"):
        inside_limits(kr16, 2.0)


def test_far_from_singularity_is_the_inverse_condition_number(kr16):
    q = kr16.random(300, rng=2)
    reach = 0.0
    T, before = np.eye(4), None
    for frame in kr16.frames:
        T = T @ frame
        reach += 0.0 if before is None else np.linalg.norm(T[:3, 3] - before)
        before = T[:3, 3]
    J = kr16.jacobian(q) / np.array([reach] * 3 + [1.0] * 3)[:, None]
    measure = 1.0 / np.linalg.cond(J)
    for least in (0.001, 0.01, 0.05):
        clear = np.abs(measure - least) > 1e-9
        kept = far_from_singularity(kr16, least=least)(q)
        assert (kept == (measure >= least))[clear].all()
        assert kept.any() and not kept.all()


def test_singular_postures_are_not_kept(kr16):
    straight_wrist = kr16.random(50, rng=3)
    straight_wrist[:, 4] = 0.0
    assert not far_from_singularity(kr16, least=1e-6)(straight_wrist).any()
    planar = kv.load("planar3r")
    assert not far_from_singularity(planar, task="planar")(np.array([[1.0, 0.0, 2.0]])).any()
    scara = kv.load("adept_one")
    postures = np.array([[0.3, 0.0, 0.1, 0.2], [0.3, 1.5, 0.1, 0.2]])
    assert far_from_singularity(scara)(postures).tolist() == [False, True]


def test_far_from_singularity_does_not_heed_the_unit_of_length(kr16):
    q = kr16.random(300, rng=4)
    frames = np.array(kr16.frames)
    frames[:, :3, 3] *= 1000.0
    large = Robot(frames, kr16.kinds, kr16.limits)
    assert (far_from_singularity(large)(q) == far_from_singularity(kr16)(q)).all()


def test_slides_are_measured_in_the_reach_too():
    small, postures = kv.load("adept_one"), kv.load("adept_one").random(300, rng=5)
    frames, limits = np.array(small.frames), np.array(small.limits)
    frames[:, :3, 3] *= 1000.0
    limits[2] *= 1000.0
    large = Robot(frames, small.kinds, limits)
    kept = far_from_singularity(small, least=0.05)(postures)
    assert (far_from_singularity(large, least=0.05)(postures * [1, 1, 1000, 1]) == kept).all()
    assert kept.any() and not kept.all()


@pytest.mark.parametrize("least", [0.0, 1.0, -1.0, np.nan, "a", True])
def test_bad_bounds_are_refused(kr16, least):
    with pytest.raises(kv.InputError, match="least must lie between 0 and 1"):
        far_from_singularity(kr16, least=least)
    with pytest.raises(kv.InputError, match="unknown task"):
        far_from_singularity(kr16, task="dance")


def test_one_branch_is_that_of_the_closed_form(kr16, closed):
    for branch in (0, "shoulder+ elbow+ wrist-"):
        data = sample(kr16, 100, random_state=5, keep=one_branch(closed, branch))
        number = branch if isinstance(branch, int) else closed.branch_labels_.index(branch)
        for q, T in zip(data.q, data.T, strict=True):
            s = closed.solve(T, q_seed=q)
            assert s.branch[np.abs(s.q - q).max(axis=1).argmin()] == number


def test_a_branch_is_a_single_valued_map(kr16, closed):
    # why data sets by branch are made: two configurations of a branch have different poses
    data = sample(kr16, 2000, random_state=6).labelled(closed)
    assert set(np.unique(data.branches)) == set(range(8))
    s = closed.solve(data.T)
    own = data.branches[s.pose_index] == s.branch
    assert (np.bincount(s.pose_index[own], minlength=2000) == 1).all()
    away = s.q[own] - data.q
    assert np.abs(away - 2 * np.pi * np.rint(away / (2 * np.pi))).max() < 1e-5


def test_configurations_of_other_windings_and_singular_ones(kr16, closed):
    q = kr16.random(1, rng=7)
    q[0, [3, 5]] = [1.0, -2.0]
    turned = q + 2 * np.pi * np.array([0, 0, 0, -1, 0, 1])
    assert (branch_of(closed, turned) == branch_of(closed, q)).all()
    q[0, 4] = 0.0  # axes 4 and 6 on one line: a continuum
    assert branch_of(closed, q).tolist() == [-1]
    assert branch_of(closed, np.empty((0, 6))).shape == (0,)


def test_branches_are_told_apart_up_to_where_they_meet(kr16, closed):
    def nearest(third):
        q = np.array([0.2, -0.6, third, 0.3, 0.8, 0.1])
        s = closed.solve(kr16.fk(q), q_seed=q)
        return s.branch[np.abs(s.q - q).max(axis=1).argmin()]

    low, top = -1.5, 2.0
    bent_back = nearest(low)
    while top - low > 1e-9:  # where the arm is stretched
        middle = 0.5 * (low + top)
        low, top = (middle, top) if nearest(middle) == bent_back else (low, middle)
    third = low + np.array([-5e-6, -2e-6, 2e-6, 5e-6])
    q = np.tile([0.2, -0.6, 0.0, 0.3, 0.8, 0.1], (4, 1))
    q[:, 2] = third
    assert branch_of(closed, q).tolist() == [nearest(each) for each in third]
    assert nearest(third[0]) != nearest(third[-1])


def test_branches_that_there_are_not_are_refused(kr16, closed):
    for branch in (8, -1, "elbow", True, 0.5):
        with pytest.raises(kv.InputError, match=r"the branches are 0 'shoulder\+ elbow\+ wrist\+'"):
            one_branch(closed, branch)
    with pytest.raises(kv.InputError, match="not fitted"):
        one_branch(kv.Analytic(), 0)
    with pytest.raises(kv.InputError, match="7 joints for 6 components"):
        one_branch(kv.Analytic().fit(kv.load("iiwa14")), 0)


def test_collisions_are_counted_under_their_name(kr16):
    data = sample(kr16, 50, keep=collision_free(lambda q: kr16.fk(q)[:, 2, 3] > 0.5))
    assert list(data.rejected) == ["collision_free"] and (data.T[:, 2, 3] > 0.5).all()
    with pytest.raises(TypeError, match="callable"):
        collision_free(None)


# Regions ----------------------------------------------------------------------------------------


def test_a_region_is_a_box_inside_the_limits(kr16):
    centre = np.array([0.1, -2.5, 1.0, 0.0, 0.5, 6.0])
    q = sample(kr16, 2000, random_state=1, region=(centre, 0.5)).q
    low, top = (
        np.maximum(kr16.limits[:, 0], centre - 0.5),
        np.minimum(kr16.limits[:, 1], centre + 0.5),
    )
    assert ((q >= low) & (q <= top)).all()
    assert (q.min(axis=0) < low + 0.01).all() and (q.max(axis=0) > top - 0.01).all()
    half = np.array([0.1, 0.0, 0.1, 0.1, 0.1, 0.1])
    q = sample(kr16, 20, region=(centre, half)).q
    assert (q[:, 1] == centre[1]).all() and np.ptp(q[:, 0]) <= 0.2


@pytest.mark.parametrize(
    "region, why",
    [
        ((np.full(6, 9.0), 0.1), "outside the limits of joint"),
        ((np.zeros(5), 0.1), "centre of the region must have shape"),
        ((np.zeros((2, 6)), 0.1), "centre of the region must have shape"),
        ((np.zeros(6), -0.1), "half width"),
        ((np.zeros(6), [0.1, 0.2]), "half width"),
        ((np.zeros(6), np.nan), "half width"),
        ((np.full(6, np.nan), 0.1), "finite"),
        (np.zeros((3, 6)), "pair"),
        (0.5, "pair"),
    ],
)
def test_bad_regions_are_refused(kr16, region, why):
    with pytest.raises(kv.InputError, match=why):
        sample(kr16, 5, region=region)


# Patterns and parts -----------------------------------------------------------------------------


def test_patterns_of_the_inverse_and_of_the_forward_map():
    robot = kv.load("planar3r_003")
    data = sample(robot, 30, random_state=1)
    features = PoseFeatures("xy").fit(data.T)
    X, y = data.inverse(features, VirtualVector("cos_sin"))
    assert (y == data.q).all() and X.shape == (30, 4)
    total = data.q.sum(axis=1)
    assert np.abs(X[:, 2:] - np.column_stack([np.cos(total), np.sin(total)])).max() < 1e-14
    X, y = data.forward(features)
    assert (X == data.q).all() and (y == data.T[:, :2, 3]).all()
    assert data.inverse(features)[0].shape == (30, 2)
    with pytest.raises(kv.InputError, match="not fitted"):
        data.inverse(PoseFeatures("xy"))


def test_a_split_takes_every_configuration_once(kr16, closed):
    data = sample(kr16, 100, random_state=1, keep=high).labelled(closed)
    train, test = data.split(0.3, random_state=2)
    assert (len(train), len(test)) == (70, 30)
    rows = np.vstack([train.q, test.q])
    assert (np.unique(rows, axis=0) == np.unique(data.q, axis=0)).all()
    assert (train.T == kr16.fk(train.q)).all()
    assert (train.branches == branch_of(closed, train.q)).all()
    assert train.drawn == data.drawn and train.rejected == data.rejected
    assert (data.split(0.3, random_state=2)[0].q == train.q).all()
    assert (data.split(0.3, random_state=3)[0].q != train.q).any()
    for share in (0, 0.001, 0.999, 1.0):
        with pytest.raises(kv.InputError, match="test_fraction"):
            data.split(share)


def test_parts_by_rows_and_masks(kr16):
    data = sample(kr16, 20, random_state=1)
    assert (data.take([3, 5]).q == data.q[[3, 5]]).all()
    assert (data.take(data.q[:, 0] > 0).q[:, 0] > 0).all()
    for rows in ([], [20], [-1], [0.5], np.zeros(19, bool), np.zeros(20, bool), [[1]]):
        with pytest.raises(kv.InputError, match="rows must be"):
            data.take(rows)


def test_joints_of_ones_own(kr16):
    mine = kr16.random(9, rng=1)
    data = DataSet(kr16, mine)
    assert data.drawn == 9 and data.rejected == {} and data.branches is None
    mine[:] = 0.0
    assert data.q.any()  # a copy
    with pytest.raises(ValueError, match="read-only"):
        data.q[0] = 0.0
    assert "9 configurations of kr16" in repr(data)
    for q in (np.zeros((0, 6)), np.zeros(6), np.zeros((3, 5)), np.full((1, 6), np.nan)):
        with pytest.raises(kv.InputError, match="q must"):
            DataSet(kr16, q)
    for branches in ([1, 2], np.zeros(9)):
        with pytest.raises(kv.InputError, match="branches must be"):
            DataSet(kr16, data.q, branches=branches)


@pytest.mark.parametrize("count", [0, -1, 1.5, True, None])
def test_bad_numbers_are_refused(kr16, count):
    with pytest.raises(kv.InputError, match="n_samples"):
        sample(kr16, count)


def test_bad_seeds_are_refused(kr16):
    with pytest.raises(TypeError, match="random_state must be None, an int or a numpy Generator"):
        sample(kr16, 5, random_state="seed")
    with pytest.raises(kv.InputError, match="random_state as a seed"):
        sample(kr16, 5, random_state=-1)


def test_a_planar_arm_of_four_joints_is_not_singular_everywhere():
    robot = Robot.from_dh(a=[0.4, 0.3, 0.2, 0.1], d=0.0, alpha=0.0, joints="RRRR")
    bent, straight = [0.3, 0.8, -1.1, 0.6], [0.3, 0.0, 0.0, 0.0]
    for task in ("pose", "planar"):
        keep = far_from_singularity(robot, least=0.01, task=task)
        assert keep(np.array([bent, straight])).tolist() == [True, False]
