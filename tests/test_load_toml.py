import math

import numpy as np
import pytest

import oracle
from kinverse.errors import ModelError
from kinverse.load import load

HEAD = 'kind = "dh"\nconvention = "standard"\n'
ROW = '{ joint = "R", d = 0.1, a = 0.2, alpha = 0.3, theta = 0.4 }'


def toml(tmp_path, text, name="mine.toml"):
    path = tmp_path / name
    path.write_text(text)
    return path


# ---------------------------------------------------------------------------- right answers
@pytest.mark.parametrize("convention", ["standard", "modified"])
@pytest.mark.parametrize(("length", "per_metre"), [("m", 1), ("cm", 100), ("mm", 1000)])
@pytest.mark.parametrize("angle", ["rad", "deg"])
def test_units_and_conventions(tmp_path, convention, length, per_metre, angle):
    turn = 180 / math.pi if angle == "deg" else 1
    si = [(0.4, 0.1, 0.2, 0.3), (0.0, -0.2, 0.0, -1.0), (0.1, 0.0, 0.3, 0.0)]
    rows = ""
    for kind, (theta, d, a, alpha) in zip("RFP", si, strict=True):
        limits = {"R": f"limits = [{-turn}, {turn}]", "P": f"limits = [0, {per_metre / 2}]"}
        last = f", {limits[kind]}" if kind in limits else ""
        rows += (
            f'{{ joint = "{kind}", theta = {theta * turn}, d = {d * per_metre},'
            f" a = {a * per_metre}, alpha = {alpha * turn}{last} }},\n"
        )
    text = f"""
        kind = "dh"
        convention = "{convention}"
        units = {{ length = "{length}", angle = "{angle}" }}
        base = {{ xyz = [0, 0, {per_metre}], rpy = [0, 0, {turn}] }}
        tool = {{ xyz = [{0.5 * per_metre}, 0, 0] }}
        rows = [{rows}]"""
    robot = load(toml(tmp_path, text))
    base = oracle.homogeneous(oracle.rot_z(1.0), (0, 0, 1))
    tool = oracle.homogeneous(p=(0.5, 0, 0))
    np.testing.assert_allclose(robot.limits, [[-1, 1], [0, 0.5]], atol=1e-15)
    for q in robot.random(5, rng=0):
        T = oracle.dh_fk(si, "RFP", q, convention, base, tool)
        np.testing.assert_allclose(robot.fk(q), T, atol=1e-14)


def test_names_notes_and_defaults(tmp_path):
    text = HEAD + f'source = "a book"\nnotes = ["n"]\nunverified = ["u"]\nrows = [{ROW}]'
    robot = load(toml(tmp_path, text))
    assert robot.name == "mine" and robot.joint_names == ("joint1",)
    assert robot.source_note == "a book\nn" and robot.unverified == ("u",)
    assert robot.limits.tolist() == [[-math.pi, math.pi]]
    named = ROW.replace("{", '{ name = "hip",')
    assert load(toml(tmp_path, f'{HEAD}name = "arm"\nrows = [{named}]')).joint_names == ("hip",)


def test_mimic_rows(tmp_path):
    follow = ROW.replace(" }", ', mimic = { joint = "joint1", multiplier = -2, offset = 0.1 } }')
    robot = load(toml(tmp_path, f"{HEAD}rows = [{ROW}, {follow}, {ROW}]"))
    assert robot.joint_names == ("joint1", "joint3") and robot.kinds == "RRR"
    q = np.array([0.3, -0.4])
    rows = [(0.4, 0.1, 0.2, 0.3)] * 3
    T = oracle.dh_fk(rows, "RRR", [q[0], -2 * q[0] + 0.1, q[1]])
    np.testing.assert_allclose(robot.fk(q), T, atol=1e-15)


# ---------------------------------------------------------------------------- refusals
@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("", "kind must be one of dh"),
        ("kind = 1", "kind must be one of dh"),
        ('kind = "dh"', "convention must be one of standard, modified"),
        (HEAD, "rows must be a list"),
        (HEAD + "rows = []", "rows must be a list"),
        (HEAD + "rows = [1]", "row 1 must be a table"),
        (HEAD + 'rows = [{ joint = "F" }]', "at least one moving row"),
        (HEAD + 'rows = [{ joint = "X" }]', "row 1: joint must be one of R, P, F"),
        (HEAD + 'rows = [{ joint = "P" }]', "prismatic joint 'joint1' needs limits"),
        (HEAD + 'rows = [{ joint = "R", b = 1 }]', "unknown key 'b'"),
        (HEAD + 'rows = [{ joint = "R", alhpa = 1 }]', "did you mean 'alpha'"),
        (HEAD + 'rows = [{ joint = "R", a = "1" }]', "a must be a finite number"),
        (HEAD + 'rows = [{ joint = "R", a = true }]', "a must be a finite number"),
        (HEAD + 'rows = [{ joint = "R", a = nan }]', "a must be a finite number"),
        (HEAD + 'rows = [{ joint = "R", a = 1e300 }]', "a must be a finite number"),
        (HEAD + f'rows = [{{ joint = "R", a = {"9" * 400} }}]', "a must be a finite number"),
        (HEAD + f'rows = [{{ joint = "R", a = {"9" * 5000} }}]', "not well-formed|finite"),
        (HEAD + 'rows = [{ joint = "R", limits = [1, 0] }]', "upside down"),
        (HEAD + 'rows = [{ joint = "R", limits = [1] }]', "limits must be a list of 2"),
        (HEAD + 'rows = [{ joint = "R", limits = ["a", "b"] }]', "limits must be a finite"),
        (HEAD + 'rows = [{ joint = "F", limits = [0, 1] }]', "takes no name, limits"),
        (HEAD + 'rows = [{ joint = "R", name = "a\\nb" }]', "one line"),
        (HEAD + 'rows = [{ joint = "R", mimic = { joint = "x" } }]', "mimics 'x'"),
        (HEAD + 'rows = [{ joint = "R", mimic = 1 }]', "mimic must be a table"),
        (
            HEAD + 'rows = [{ joint = "R", limits = [0, 1], mimic = { joint = "x" } }]',
            "takes no limits",
        ),
        (
            HEAD + 'rows = [{ joint = "R", name = "a" }, { joint = "R", name = "a" }]',
            "names must differ",
        ),
        (HEAD + f"base = 1\nrows = [{ROW}]", "base must be a table"),
        (HEAD + f"base = {{ xyz = [0] }}\nrows = [{ROW}]", "xyz must be a list of 3"),
        (HEAD + f"base = {{ quat = [0] }}\nrows = [{ROW}]", "unknown key 'quat'"),
        (HEAD + f'units = {{ length = "inch" }}\nrows = [{ROW}]', "one of m, cm, mm"),
        (HEAD + f'units = {{ angle = "grad" }}\nrows = [{ROW}]', "one of rad, deg"),
        (HEAD + f"name = 3\nrows = [{ROW}]", "name must be a text"),
        (HEAD + f'notes = "x"\nrows = [{ROW}]', "list of texts"),
        (HEAD + f'convetion = "x"\nrows = [{ROW}]', "did you mean 'convention'"),
        (HEAD + "rows = [", "not well-formed TOML.*line|not well-formed TOML"),
        ("a = " + "[" * 5000, "nested too deeply|not well-formed"),
    ],
)
def test_refused_by_name(tmp_path, text, words):
    with pytest.raises(ModelError, match=words) as error:
        load(toml(tmp_path, text))
    assert "mine.toml" in str(error.value)


def test_not_utf8(tmp_path):
    path = tmp_path / "mine.toml"
    path.write_bytes(b'name = "\xff"')
    with pytest.raises(ModelError, match="UTF-8"):
        load(path)
