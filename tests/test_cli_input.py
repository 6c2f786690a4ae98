"""Numbers, files and broken rows on their way into the command line."""

import numpy as np
import pytest

from kinverse import InputError, se3
from kinverse.cli import _poses
from kinverse.cli._args import join_numbers, numbers, pose_numbers


def rotation(roll, pitch, yaw):
    def about(axis, angle):
        R = np.eye(3)
        i, j = (axis + 1) % 3, (axis + 2) % 3
        R[i, i] = R[j, j] = np.cos(angle)
        R[j, i], R[i, j] = np.sin(angle), -np.sin(angle)
        return R

    return about(2, yaw) @ about(1, pitch) @ about(0, roll)


def write(tmp_path, text, name="poses.csv"):
    path = tmp_path / name
    path.write_text(text, encoding="utf-8")
    return path


# ---------------------------------------------------------------------------- numbers
@pytest.mark.parametrize(
    ("argv", "joined"),
    [
        (["--q", "0", "-1.5", "2e-3", "--json"], ["--q=0,-1.5,2e-3", "--json"]),
        (["--q", "0,-1", "--degrees"], ["--q=0,-1", "--degrees"]),
        (["--q"], ["--q="]),
        (["--pose", "-.5", "nan", "kr16"], ["--pose=-.5,nan", "kr16"]),
        (["--rng", "-1"], ["--rng", "-1"]),
        (["--q", "0 -90 90"], ["--q=0 -90 90"]),
        (["--q=1", "2", "--json"], ["--q=1,2", "--json"]),
        (["--q", "0", "O", "1", "kr16"], ["--q=0,O,1", "kr16"]),
        (["--q", "0,x"], ["--q=0,x"]),
        ([], []),
    ],
)
def test_numbers_behind_an_option_are_gathered(argv, joined):
    assert join_numbers(argv) == joined


def test_numbers_are_counted_and_finite():
    assert numbers("1,-2", 2, "--q", "a b") == [1.0, -2.0]
    assert numbers(" 1 -2, 3 ", 3, "--q", "a b c") == [1.0, -2.0, 3.0]
    with pytest.raises(InputError, match="--q needs 2 numbers \\(a b\\), got 3"):
        numbers("1,2,3", 2, "--q", "a b")
    with pytest.raises(InputError, match="got 0"):
        numbers("", 2, "--q", "a b")
    with pytest.raises(InputError, match="finite"):
        numbers("1,nan", 2, "--q", "a b")
    with pytest.raises(InputError, match="--q: 'x' is not a number"):
        numbers("1,x", 2, "--q", "a b")


# ---------------------------------------------------------------------------- poses
def test_rotation_is_yaw_pitch_roll():
    given = _poses.from_numbers([1, 2, 3, 0.3, -0.4, 0.5], degrees=False)
    assert np.allclose(given.T[0, :3, :3], rotation(0.3, -0.4, 0.5), atol=1e-15)
    assert given.T[0, :3, 3].tolist() == [1, 2, 3]
    degrees = _poses.from_numbers([1, 2, 3, *np.degrees([0.3, -0.4, 0.5])], degrees=True)
    assert np.allclose(degrees.T, given.T, atol=1e-15)


def test_columns_come_in_any_order_and_others_are_named(tmp_path):
    path = write(
        tmp_path, "note,Yaw,pitch,roll, z ,y,x\nfirst,0.5,-0.4,0.3,3,2,1\n\nb,0,0,0,0,0,1\n"
    )
    given = _poses.from_csv(path, degrees=False, skip=False)
    assert given.ignored == ("note",)
    assert given.rows.tolist() == [1, 2]
    assert np.allclose(given.T[0, :3, :3], rotation(0.3, -0.4, 0.5), atol=1e-15)
    assert given.T[1, :3, 3].tolist() == [1, 0, 0]


@pytest.mark.parametrize("whole", [False, True])
def test_quaternions_and_matrices_say_the_same(tmp_path, whole):
    T = se3.pose([0.1, 0.2, 0.3], rpy=[0.3, -0.4, 0.5])
    quat = se3.quat_from_rotation(T[:3, :3])
    head = "qx,qy,qz,qw,x,y,z"
    cells = [*quat[1:], quat[0], *T[:3, 3]]
    path = write(tmp_path, head + "\n" + ",".join(map(repr, map(float, cells))))
    by_quat = _poses.from_csv(path, degrees=False, skip=False)
    rows = 4 if whole else 3
    head = ",".join(f"m{i + 1}{j + 1}" for i in range(rows) for j in range(4))
    cells = ",".join(repr(float(v)) for v in T[:rows].ravel())
    by_matrix = _poses.from_csv(write(tmp_path, f"{head}\n{cells}\n"), degrees=False, skip=False)
    assert np.allclose(by_quat.T[0], T, atol=1e-15)
    assert np.array_equal(by_matrix.T[0], T)


@pytest.mark.parametrize(
    ("row", "says"),
    [
        ("1,2,3,0,0,abc", "row 2 (line 3): column yaw: 'abc' is not a number"),
        ("1,2,3,0,0,", "row 2 (line 3): column yaw: '' is not a number"),
        ("1,2,inf,0,0,0", "row 2 (line 3): column z: 'inf' is not finite"),
        ("1,2,3,0,0", "row 2 (line 3): 5 cells where the header has 6"),
        ("1,2,3,0,0,0,9", "row 2 (line 3): 7 cells"),
    ],
)
def test_a_broken_row_is_named_and_can_be_skipped(tmp_path, row, says):
    path = write(tmp_path, f"x,y,z,roll,pitch,yaw\n1,0,0,0,0,0\n{row}\n2,0,0,0,0,0\n")
    with pytest.raises(InputError) as stopped:
        _poses.from_csv(path, degrees=False, skip=False)
    assert "poses.csv" in str(stopped.value) and says in str(stopped.value)
    given = _poses.from_csv(path, degrees=False, skip=True)
    assert given.rows.tolist() == [1, 3]
    assert len(given.problems) == 1 and says in given.problems[0]


def test_a_row_that_is_no_rotation_is_broken(tmp_path):
    head = ",".join(f"m{i}{j}" for i in (1, 2, 3) for j in (1, 2, 3, 4))
    path = write(tmp_path, f"{head}\n{','.join(['1'] * 12)}\n")
    with pytest.raises(InputError, match=r"row 1 \(line 2\): .*rotation"):
        _poses.from_csv(path, degrees=False, skip=False)
    path = write(tmp_path, "x,y,z,qw,qx,qy,qz\n0,0,0,0,0,0,0\n")
    with pytest.raises(InputError, match=r"row 1 \(line 2\): .*length"):
        _poses.from_csv(path, degrees=False, skip=False)


@pytest.mark.parametrize("text", ["", "a,b,c\n1,2,3\n", "x,y,z\n1,2,3\n", "1,2,3,0,0,0\n"])
def test_a_header_without_a_pose_is_refused(tmp_path, text):
    with pytest.raises(InputError, match="must name the columns"):
        _poses.from_csv(write(tmp_path, text), degrees=False, skip=True)


def test_blank_lines_count_as_lines(tmp_path):
    path = write(tmp_path, "x,y,z,roll,pitch,yaw\n\n1,0,0,0,0,0\n\n\n1,0,0,0,0,no\n")
    with pytest.raises(InputError, match=r"row 2 \(line 6\): column yaw"):
        _poses.from_csv(path, degrees=False, skip=False)


def test_positions_alone_do_for_the_task_position(tmp_path):
    path = write(tmp_path, "z,y,x\n3,2,1\n")
    given = _poses.from_csv(path, degrees=False, skip=False, task="position")
    assert np.array_equal(given.T, [se3.pose([1, 2, 3])])
    with pytest.raises(InputError, match="with --task position x y z alone"):
        _poses.from_csv(path, degrees=False, skip=False)
    assert pose_numbers("1 2 3", "position") == [1.0, 2.0, 3.0]
    with pytest.raises(InputError, match="--pose needs 6 .* alone are for --task position.*got 3"):
        pose_numbers("1 2 3", "pose")
    assert np.array_equal(_poses.from_numbers([1, 2, 3], degrees=True).T, [se3.pose([1, 2, 3])])


def test_a_doubled_column_is_refused(tmp_path):
    with pytest.raises(InputError, match="each once; found x, x, y"):
        _poses.from_csv(write(tmp_path, "x,x,y,z,roll,pitch,yaw\n"), degrees=False, skip=True)


def test_a_header_alone_is_no_pose(tmp_path):
    given = _poses.from_csv(write(tmp_path, "x,y,z,roll,pitch,yaw\n"), degrees=False, skip=False)
    assert given.T.shape == (0, 4, 4)


def test_bytes_that_are_no_text_are_refused(tmp_path):
    path = tmp_path / "poses.csv"
    path.write_bytes(b"\xff\xfe\x00x")
    with pytest.raises(InputError, match=r"poses\.csv: not a CSV"):
        _poses.from_csv(path, degrees=False, skip=False)


# ---------------------------------------------------------------------------- matrices
def test_matrix_files(tmp_path):
    T = np.array([se3.pose([1, 2, 3]), se3.pose([0, 0, 1], rpy=[0.1, 0.2, 0.3])])
    np.save(tmp_path / "two.npy", T)
    text = "\n\n".join("\n".join(" ".join(repr(float(v)) for v in row) for row in one) for one in T)
    path = write(tmp_path, text, "two.txt")
    assert np.array_equal(_poses.from_matrix(tmp_path / "two.npy").T, T)
    assert np.array_equal(_poses.from_matrix(path).T, T)


@pytest.mark.parametrize(
    "text", ["", "1 2 3\n", "1 0 0 0\n0 1 0 0\n", "a b c d\n" * 4, "1 1 1 1\n" * 4, "1 0\n0 1 2\n"]
)
def test_matrix_files_that_are_none(tmp_path, text):
    with pytest.raises(InputError, match=r"pose\.txt"):
        _poses.from_matrix(write(tmp_path, text, "pose.txt"))


def test_npy_files_hold_no_objects(tmp_path):
    np.save(tmp_path / "bad.npy", np.array([{"a": 1}], dtype=object), allow_pickle=True)
    with pytest.raises(InputError, match=r"bad\.npy"):
        _poses.from_matrix(tmp_path / "bad.npy")
    (tmp_path / "short.npy").write_bytes(b"\x93NUMPY")
    with pytest.raises(InputError, match=r"short\.npy"):
        _poses.from_matrix(tmp_path / "short.npy")
