"""Whatever a file holds, loading it gives a robot or a kinverse error, nothing else."""

import contextlib
from importlib.resources import files

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from kinverse.errors import KinverseError
from kinverse.load import load
from models import compas_urdf

MJCF = """<mujoco model="m"><compiler angle="radian" eulerseq="zyx"/>
<default><joint axis="0 1 0" range="-1 1"/><default class="c"><joint type="slide"/></default>
</default><worldbody><frame pos="0 0 1" euler="1 0 0"><body name="a" pos="1 2 3" quat="1 0 0 1">
<joint name="j" pos="0 0 1" ref="0.2"/><body name="b" childclass="c" zaxis="0 1 1">
<joint name="k" limited="true"/><site name="s" xyaxes="1 0 0 0 1 0"/></body></body></frame>
</worldbody><equality><joint joint1="x" joint2="y"/></equality></mujoco>"""

URDF = """<robot name="r"><link name="a"/><link name="b"/><link name="c"/><link name="d"/>
<joint name="j" type="revolute"><parent link="a"/><child link="b"/><axis xyz="0 1 0"/>
<origin xyz="1 2 3" rpy="0.1 0 0"/><limit lower="-1" upper="1"/></joint>
<joint name="k" type="prismatic"><parent link="b"/><child link="c"/><limit upper="0.5"/></joint>
<joint name="l" type="continuous"><parent link="c"/><child link="d"/>
<mimic joint="j" multiplier="2" offset="0.1"/></joint></robot>"""

TOML = files("kinverse").joinpath("robots", "ir361.toml").read_text()

SEEDS = {
    "urdf": [URDF.encode(), compas_urdf("panda").read_bytes()],
    "xml": [MJCF.encode()],
    "toml": [TOML.encode()],
}

# pieces that mean something to a reader, and pieces that mean nothing to any
PIECES = (
    b"<link/>", b"<joint/>", b"</joint>", b"<body>", b"</body>", b"<freejoint/>", b'link="a"',
    b'<mimic joint="j"/>', b'<mimic joint="l"/>', b'joint="k"', b'name="a"', b'name="j"',
    b'type="ball"', b'type="planar"', b'type="fixed"', b'type="slide"', b"nan", b"inf", b"-1e308",
    b"1e-320", b"0", b"-", b'class="c"', b'childclass="x"', b'pos="1 2"', b'axis="0 0 0"',
    b'<include file="x.xml"/>', b"<!DOCTYPE x>", b"&lt;", b"&x;", b"<!--", b"-->", b"<![CDATA[",
    b"\x00", b"\xff\xfe", b"\xf0\x9f\xa6\xbe", b"[[", b"]]", b"{}", b'"""', b"rows = []",
    b'joint = "P"', b"limits = [1, 0]", b"mimic = {}", b"=", b",", b"9" * 4400, b"true",
)  # fmt: skip


@st.composite
def mutated(draw, kind):
    data = draw(st.sampled_from(SEEDS[kind]))
    for _ in range(draw(st.integers(1, 6))):
        at = draw(st.integers(0, len(data)))
        piece = draw(st.one_of(st.sampled_from(PIECES), st.binary(max_size=4)))
        match draw(st.sampled_from(["insert", "replace", "delete", "cut", "repeat", "swap"])):
            case "insert":
                data = data[:at] + piece + data[at:]
            case "replace":
                data = data[:at] + piece + data[at + len(piece) :]
            case "delete":
                data = data[:at] + data[at + draw(st.integers(1, 60)) :]
            case "cut":
                data = data[:at]
            case "repeat":
                end = at + draw(st.integers(1, 200))
                data = data[:end] + data[at:end] + data[end:]
            case "swap":
                # one word for another that stands elsewhere: names, numbers, types
                words = data.split(b'"')
                if len(words) > 3:
                    i, j = (
                        draw(st.integers(0, len(words) - 1)),
                        draw(st.integers(0, len(words) - 1)),
                    )
                    words[i] = words[j]
                    data = b'"'.join(words)
    return data


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    return tmp_path_factory.mktemp("fuzz")


@pytest.mark.parametrize("kind", SEEDS)
@settings(max_examples=300, deadline=None, suppress_health_check=list(HealthCheck))
@given(st.data())
def test_mutated_files(folder, kind, data):
    path = folder / f"model.{kind}"
    path.write_bytes(data.draw(mutated(kind)))
    ends = st.sampled_from([None, "a", "b", "s", "panda_link8", "panda_link0", "\0", ""])
    choice = {} if kind == "toml" else {"base": data.draw(ends), "tip": data.draw(ends)}
    with contextlib.suppress(KinverseError):
        robot = load(path, **choice)
        assert np.isfinite(robot.fk(robot.limits.mean(axis=1))).all()


@pytest.mark.parametrize("kind", SEEDS)
@settings(max_examples=100, deadline=None)
@given(text=st.one_of(st.binary(max_size=200), st.text(max_size=200).map(str.encode)))
def test_any_bytes(folder, kind, text):
    path = folder / f"any.{kind}"
    path.write_bytes(text)
    with pytest.raises(KinverseError):
        load(path)


@given(name=st.text(max_size=40))
def test_any_name(name):
    with contextlib.suppress(KinverseError):
        load(name)


@pytest.mark.parametrize("kind", SEEDS)
def test_every_truncation(folder, kind):
    whole = SEEDS[kind][0]
    path = folder / f"cut.{kind}"
    for end in range(0, len(whole) - 1, 7):
        path.write_bytes(whole[:end])
        with contextlib.suppress(KinverseError):
            load(path)
