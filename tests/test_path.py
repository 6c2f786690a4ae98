"""Paths: s is the way gone, what was given is met, and bad input is named."""

import pickle

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import kinverse as kv
from kinverse import se3
from kinverse.paths import Constant, Path, Radial, Tangent

CORNERS = np.array([[0.0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 1], [0.2, 0.1, 0.5]])
POSES = se3.pose(CORNERS, rpy=np.random.default_rng(5).uniform(-1, 1, (5, 3)))
FRAME = kv.pose([0.5, 0.1, 0.9], rpy=[0.7, -0.4, 1.1])

SHAPES = {
    "line": Path.line(POSES[0], POSES[1]),
    "arc": Path.arc(*POSES[:3]),
    "circle": Path.circle(FRAME, 0.3),
    "backwards": Path.circle(FRAME, 0.3, angles=[1.0, -7.0]),
    "polyline": Path.polyline(POSES),
    "blended": Path.polyline(POSES, blend=0.2),
    "rectangle": Path.rectangle([0.2, 0.9], [-0.4, 0.3], FRAME),
    "rounded": Path.rectangle([0.2, 0.9], [-0.4, 0.3], FRAME, blend=0.1),
    "spline": Path.spline(POSES),
    "closed": Path.spline(POSES, closed=True),
}
every = pytest.mark.parametrize("path", SHAPES.values(), ids=SHAPES.keys())


def places(path, s):
    return path(s)[..., :3, 3]


# ---------------------------------------------------------------------------- s is the way gone
@every
def test_s_is_the_way_gone(path):
    s = np.linspace(0, path.length, 20_001)
    steps = np.linalg.norm(np.diff(places(path, s), axis=0), axis=1)
    step = s[1]
    assert (steps <= step * (1 + 1e-9)).all(), "a chord is no longer than its arc"
    # only chords across a sharp corner are much shorter
    assert np.sum(steps < step * (1 - 1e-4)) <= len(path.breaks)
    assert steps.sum() == pytest.approx(path.length, rel=1e-3)


@every
def test_poses_are_rigid_and_tangents_are_where_it_goes(path):
    s = path.length * np.linspace(0.013, 0.987, 101)
    se3.as_poses(path(s))
    h = 1e-6 * path.length
    far = np.abs(s[:, None] - path.breaks).min(axis=1) > h
    ahead = (places(path, s + h) - places(path, s - h)) / (2 * h)
    np.testing.assert_allclose(path.curve.tangents(s)[far], ahead[far], atol=1e-6)


@every
@pytest.mark.parametrize("chord", [1e-2, 1e-5])
def test_chords_stay_within_the_error_asked_for(path, chord):
    T, s = path.sample(chord=chord)
    assert s[0] == 0.0 and s[-1] == path.length and (np.diff(s) > 0).all()
    assert np.isin(path.breaks, s).all() and np.array_equal(T, path(s))
    share = np.linspace(0, 1, 22)[1:-1]
    inner = places(path, s[:-1, None] + share * np.diff(s)[:, None])
    start, along = T[:-1, None, :3, 3], np.diff(T[:, :3, 3], axis=0)[:, None]
    share = ((inner - start) * along).sum(-1, keepdims=True) / (along**2).sum(-1, keepdims=True)
    off = np.linalg.norm(inner - start - np.clip(share, 0, 1) * along, axis=-1)
    assert off.max() <= chord * (1 + 1e-9)
    if type(path.curve).__name__ == "Arc":
        fewer = path.length / (len(s) - 2)  # one step fewer would not do
        assert path.curve.radius * (1 - np.cos(fewer / path.curve.radius / 2)) > chord


def test_a_straight_line_needs_its_ends_only():
    assert len(SHAPES["line"].sample(chord=1e-12).s) == 2
    assert len(SHAPES["polyline"].sample(chord=1e-12).s) == len(CORNERS)


@every
def test_counts_are_even_and_shapes_follow(path):
    T, s = path.sample(7)
    np.testing.assert_allclose(np.diff(s), path.length / 6)
    assert T.shape == (7, 4, 4)
    assert path(0.0).shape == (4, 4) and path(s.reshape(7, 1)).shape == (7, 1, 4, 4)
    # a spline looks for its parameter, to 1e-14 of the length, for all points together
    np.testing.assert_allclose(path(s[3]), T[3], atol=1e-12)


@every
def test_a_path_is_frozen_and_travels(path):
    with pytest.raises(AttributeError):
        path.length = 3
    path.breaks[:] = 7.0
    same = pickle.loads(pickle.dumps(path))
    assert np.array_equal(same(same.breaks), path(path.breaks)) and path.breaks[0] == 0.0
    assert "m, " in repr(path)


# ---------------------------------------------------------------------------- shapes
@pytest.mark.parametrize("name", ["polyline", "spline"])
def test_given_poses_are_met(name):
    path = SHAPES[name]
    np.testing.assert_allclose(path(path.breaks), POSES, atol=1e-13)


def test_an_arc_meets_its_three_poses():
    path = SHAPES["arc"]
    knots = path.orientation.knots
    np.testing.assert_allclose(path(knots), POSES[:3], atol=1e-13)


def test_a_circle_is_the_documents():
    path = Path.circle([12.9, 3.087, 0], 8.0, angles=[1.4 * np.pi, 2.75 * np.pi])
    t = np.linspace(1.4, 2.75, 50) * np.pi
    x, y, z = places(path, np.clip(8 * (t - t[0]), 0, path.length)).T
    np.testing.assert_allclose(x, 12.9 + 8 * np.cos(t), atol=1e-12)
    np.testing.assert_allclose(y, 3.087 + 8 * np.sin(t), atol=1e-12)
    assert not z.any()


@pytest.mark.parametrize("name", ["blended", "rounded"])
def test_blends_touch_both_sides_where_asked(name):
    path, blend = SHAPES[name], {"blended": 0.2, "rounded": 0.1}[name]
    s = path.breaks[1:-1]
    before, after = path.curve.tangents(s - 1e-9), path.curve.tangents(s)
    np.testing.assert_allclose(before, after, atol=1e-7)
    if name == "blended":
        off = np.linalg.norm(places(path, s)[:, None] - CORNERS, axis=-1).min(axis=1)
        np.testing.assert_allclose(off, blend)
    else:
        ends = path([0.0, path.length])
        np.testing.assert_allclose(ends[0], ends[1], atol=1e-12)
        assert path.length == pytest.approx(2.8 - 8 * blend + 2 * np.pi * blend)


def test_a_blend_reaches_the_rotation_in_the_middle_of_its_arc():
    path = SHAPES["blended"]
    at = path(path.orientation.knots)
    np.testing.assert_allclose(at[:, :3, :3], POSES[:, :3, :3], atol=1e-13)
    for k in (1, 2, 3):
        reach = np.linalg.norm(places(path, path.orientation.knots[k]) - CORNERS[k])
        near = np.linalg.norm(places(path, path.sample(2000).s) - CORNERS[k], axis=1).min()
        assert reach <= near + 1e-9


def test_a_straight_corner_is_not_rounded():
    path = Path.polyline([[0, 0, 0], [1, 0, 0], [2, 0, 0]], blend=0.5)
    assert path.length == 2.0
    np.testing.assert_allclose(places(path, [0.25, 1.75])[:, 0], [0.25, 1.75])


def test_a_spline_is_smooth_through_its_knots():
    for name in ("spline", "closed"):
        path = SHAPES[name]
        s = path.breaks[1:-1]
        h = 1e-4
        bent = [(path.curve.tangents(s + d) - path.curve.tangents(s + d - h)) / h for d in (0.0, h)]
        np.testing.assert_allclose(bent[0], bent[1], atol=0.05)  # continuous curvature
    ends = SHAPES["closed"].curve.tangents(np.array([0.0, SHAPES["closed"].length]))
    np.testing.assert_allclose(ends[0], ends[1], atol=1e-12)


def test_a_spline_through_a_line_turns_back_where_it_must():
    path = Path.spline([[0, 0, 0], [1, 0, 0], [0, 0, 0], [1, 0, 0]])
    x = places(path, path.sample(20_001).s)[:, 0]
    assert np.abs(np.diff(x)).sum() == pytest.approx(path.length, rel=1e-3)


# ---------------------------------------------------------------------------- orientation
@settings(max_examples=30)
@given(st.integers(0, 10**6))
def test_slerp_turns_evenly_and_the_short_way(seed):
    rng = np.random.default_rng(seed)
    ends = se3.pose(rng.uniform(-1, 1, (2, 3)), rpy=rng.uniform(-3, 3, (2, 3)))
    R = Path.line(*ends).sample(9).T[:, :3, :3]
    turns = se3.rotation_log(np.swapaxes(R[:-1], 1, 2) @ R[1:])
    whole = se3.rotation_log(R[0].T @ R[-1])
    np.testing.assert_allclose(turns, np.tile(whole / 8, (8, 1)), atol=1e-7)


def test_radial_is_document_003s():
    then = kv.pose(rpy=[np.pi, 0, 0])
    path = Path.rectangle([5, 15], [-1, 10], orientation=Radial(then))
    T = path.sample(97).T
    yaw = np.arctan2(T[:, 1, 3], T[:, 0, 3])
    want = se3.pose(rpy=np.stack([0 * yaw, 0 * yaw, yaw], -1)) @ then
    np.testing.assert_allclose(T[:, :3, :3], want[:, :3, :3], atol=1e-14)
    short = Path.rectangle([5, 15], [-1, 10], orientation="radial")
    np.testing.assert_allclose(short(3.0) @ then, path(3.0), atol=1e-14)


@every
def test_tangent_has_x_along_the_path_and_z_near_up(path):
    up = np.array([0.3, -0.2, 0.9])
    tied = Path(path.curve, Tangent(up))
    s = path.length * np.linspace(0.01, 0.99, 57)
    R = tied(s)[:, :3, :3]
    np.testing.assert_allclose(R[:, :, 0], path.curve.tangents(s), atol=1e-12)
    np.testing.assert_allclose(R[:, :, 1] @ up, 0.0, atol=1e-12)
    assert (R[:, :, 2] @ up > 0).all()


def test_orientation_comes_before_the_poses_own():
    R = kv.pose(rpy=[0.1, 0.2, 0.3])
    for orientation in (R, R[:3, :3], Constant(R)):
        path = Path.polyline(POSES, orientation=orientation)
        np.testing.assert_allclose(path.sample(5).T[:, :3, :3], np.tile(R[:3, :3], (5, 1, 1)))
    assert np.array_equal(Path.line([1, 0, 0], [2, 0, 0])(0.5)[:3, :3], np.eye(3))


def test_a_path_that_only_turns_is_measured_in_rad():
    T = se3.pose([0.3, 0.2, 0.1], rpy=[[0, 0, 0], [0, 0, 1.5], [0, 0.25, 1.5]])
    path = Path.from_poses(T)
    assert path.unit == "rad" and path.length == pytest.approx(1.75)
    np.testing.assert_allclose(path([0, 1.5, path.length]), T, atol=1e-14)
    at = path(0.6)
    np.testing.assert_allclose(se3.rpy_from_rotation(at[:3, :3]), [0, 0, 0.6], atol=1e-14)
    with pytest.raises(kv.InputError, match="no chord error"):
        path.sample(chord=1e-3)
    with pytest.raises(kv.InputError, match="stands still"):
        Path.line(T[0], T[1], orientation=None) and Path(path.curve, Tangent())(0.5)


# ---------------------------------------------------------------------------- files
RPY = "x [mm],y [mm],z [mm],roll [deg],pitch [deg],yaw [deg]"


def csv(tmp_path, head, rows, name="path.csv"):
    file = tmp_path / name
    file.write_text("\n".join([head, *(",".join(map(repr, row)) for row in rows)]) + "\n")
    return file


def numbers():
    rpy = se3.rpy_from_rotation(POSES[:, :3, :3])
    return CORNERS, rpy


@pytest.mark.parametrize("degrees", [None, False])
def test_units_are_read_from_the_header(tmp_path, degrees):
    xyz, rpy = numbers()
    rows = np.hstack([1e3 * xyz, np.degrees(rpy)]).tolist()
    path = Path.from_file(csv(tmp_path, RPY, rows), degrees=degrees)
    np.testing.assert_allclose(path(path.breaks), POSES, atol=1e-12)


def test_files_without_units_are_as_the_command_line_reads_them(tmp_path):
    xyz, rpy = numbers()
    head = "x,y,z,roll,pitch,yaw"
    plain = Path.from_file(csv(tmp_path, head, np.hstack([xyz, rpy]).tolist()))
    degrees = np.hstack([xyz, np.degrees(rpy)]).tolist()
    turned = Path.from_file(csv(tmp_path, head, degrees), degrees=True)
    np.savez(tmp_path / "path.npz", T=POSES)
    np.save(tmp_path / "path.npy", POSES)
    for path in (plain, turned, *(Path.from_file(tmp_path / f"path.{k}") for k in ("npz", "npy"))):
        np.testing.assert_allclose(path(path.breaks), POSES, atol=1e-12)
    with pytest.raises(kv.InputError, match="more than a turn.*degrees=True"):
        Path.from_file(csv(tmp_path, head, degrees))
    with pytest.raises(kv.InputError, match="column roll is in rad, but degrees"):
        Path.from_file(csv(tmp_path, head.replace("roll", "roll [rad]"), degrees), degrees=True)


def test_positions_alone_take_an_orientation(tmp_path):
    file = csv(tmp_path, "x,y [cm],z", (CORNERS * [1, 100, 1] + [0.5, 50, 0]).tolist())
    path = Path.from_file(file, orientation="radial")
    np.testing.assert_allclose(places(path, path.breaks), CORNERS + [0.5, 0.5, 0])


def test_a_file_that_cannot_be_a_path_is_named(tmp_path):
    good = "0,0,0,0,0,0\n1,0,0,0,0,0\n"
    for text, says in {
        "": "must name the columns",
        good: "must name the columns",
        "x,y,z,roll,pitch,yaw\n": "at least two points, got none",
        "x,y,z,roll,pitch,yaw\n1,0,0,0,0,0\n": "at least two points, got one",
        f"x [ft],y,z,roll,pitch,yaw\n{good}": r"column x: unit 'ft' is not known: m, cm, mm",
        f"x,y,z,roll,pitch,yaw [mm]\n{good}": r"column yaw: unit 'mm' is not known: rad, deg",
        f"x,y,z,roll,pitch,yaw\n{good}1,0,nan,0,0,0\n": r"row 3 \(line 4\): column z: 'nan'",
        f"x,y,z,roll,pitch,yaw\n{good}1,0,0,0,0,0\n": r"points\[2\] is in the place of points\[1\]",
    }.items():
        file = tmp_path / "bad.csv"
        file.write_text(text)
        with pytest.raises(kv.InputError, match=rf"bad\.csv: .*{says}"):
            Path.from_file(file)
    (tmp_path / "bad.npz").write_bytes(b"PK\x03\x04 no")
    np.savez(tmp_path / "other.npz", poses=POSES)
    np.savez(tmp_path / "object.npz", T=np.array([{}], dtype=object))
    np.save(tmp_path / "array.npy", POSES)
    (tmp_path / "array.npy").rename(tmp_path / "array.npz")
    for name in ("bad", "object", "array"):
        with pytest.raises(kv.InputError, match=rf"{name}\.npz"):
            Path.from_file(tmp_path / f"{name}.npz")
    with pytest.raises(kv.InputError, match=r"other\.npz: needs an array T .*found poses"):
        Path.from_file(tmp_path / "other.npz")
    with pytest.raises(kv.InputError, match=r"ends in \.csv, \.npz or \.npy"):
        Path.from_file(tmp_path / "path.txt")
    with pytest.raises(OSError):
        Path.from_file(tmp_path / "none.csv")


# ---------------------------------------------------------------------------- bad input
def broken(row, value):
    T = POSES.copy()
    T[row, :3, 3] = value
    return T


BAD = {
    "at least two T|at least two points, got one": lambda: Path.from_poses(POSES[:1]),
    "at least two points, got none": lambda: Path.from_poses(np.empty((0, 4, 4))),
    "got one": lambda: Path.spline(POSES[0]),
    r"points\[3\] is in the place of points\[2\] \(rows 4 and 3 of a file\)": lambda: (
        Path.from_poses(POSES[[0, 1, 2, 2, 3]])
    ),
    r"points\[2\] is in the place of points\[1\].*only turns": lambda: Path.from_poses(
        broken(2, CORNERS[1])
    ),
    r"T\[1\] repeats T\[0\] \(rows 2 and 1 of a file\)": lambda: Path.from_poses(POSES[[0, 0]]),
    r"T\[3\] \(row 3\) is not a rigid pose: it holds NaN": lambda: Path.from_poses(
        broken(3, np.nan)
    ),
    r"points\[1\] \(row 1\) is not finite": lambda: Path.polyline([[0, 0, 0], [0, np.inf, 0]]),
    r"points\[0\] \(row 0\) is not a rigid pose: its last row": lambda: Path.spline(POSES * 2),
    r"shape \(K, 3\) or \(K, 4, 4\)": lambda: Path.polyline(np.zeros((3, 2))),
    "ragged": lambda: Path.polyline([[0, 0, 0], [1, 2]]),
    "start, end must all be positions": lambda: Path.line([0, 0, 0], POSES[0]),
    "lie on a line": lambda: Path.arc([0, 0, 0], [1, 1, 0], [3, 3, 0]),
    "lie on a line: no": lambda: Path.arc([0, 0, 0], [1, 1, 0], [0, 0, 0]),
    "radius must be one finite number, positive": lambda: Path.circle([0, 0, 0], 0.0),
    "angles must be two finite": lambda: Path.circle([0, 0, 0], 1.0, angles=[1, 1]),
    "x must be two finite": lambda: Path.rectangle([1, 1], [0, 1]),
    "blend must be": lambda: Path.polyline(CORNERS, blend=-1),
    "blend = 0.6 m has no room between points 1 and 2": lambda: Path.polyline(CORNERS, blend=0.6),
    "doubles back at point 1": lambda: Path.polyline([[0, 0, 0], [1, 0, 0], [0, 0, 0]], blend=0.1),
    "returns to its first point by itself": lambda: Path.spline(POSES[[0, 1, 2, 0]], closed=True),
    "needs three points": lambda: Path.spline(POSES[:2], closed=True),
    "orientation must be 'radial' or 'tangent'": lambda: Path.polyline(CORNERS, orientation="x"),
    "orientation is not a rigid pose": lambda: Path.polyline(CORNERS, orientation=np.ones((3, 3))),
    "up must be a direction": lambda: Tangent([0, 0, 0]),
    r"the path at s = 0.5 is on the z axis": lambda: Path.line(
        [-0.5, 0, 1], [1, 0, 1], orientation="radial"
    )(0.5),
    "runs along up": lambda: Path.line([1, 0, 0], [1, 0, 1], orientation="tangent").sample(3),
    r"s must lie from 0 to 1 m, got 1.5 at index 1": lambda: SHAPES["line"]([0.1, 1.5]),
    "got nan": lambda: SHAPES["line"](np.nan),
    "either a count or a chord": lambda: SHAPES["line"].sample(),
    "either a count or a chord error": lambda: SHAPES["line"].sample(3, chord=1.0),
    "count must lie in 2": lambda: SHAPES["line"].sample(1),
    "count must be a whole number": lambda: SHAPES["line"].sample(2.5),
    "chord must be one finite number, positive": lambda: SHAPES["circle"].sample(chord=0.0),
    "more than 10000000 samples": lambda: SHAPES["circle"].sample(chord=1e-15),
}


@pytest.mark.parametrize("says", BAD)
def test_bad_input_is_named(says):
    with pytest.raises(kv.InputError, match=says):
        BAD[says]()


def test_text_is_no_path():
    with pytest.raises(TypeError):
        Path.polyline([["a", "b", "c"]] * 2)
