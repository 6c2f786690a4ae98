"""The core by itself: sanitizers, and instruction sets that must not share code."""

import shutil
import subprocess
from pathlib import Path

import numpy as np
import pytest

import kinverse as kv
from kinverse import kernels

ROOT = Path(__file__).resolve().parent.parent


def run(*command):
    done = subprocess.run(command, capture_output=True, text=True, timeout=900)
    assert done.returncode == 0, f"{' '.join(map(str, command))}\n{done.stdout}\n{done.stderr}"
    return done.stdout


@pytest.fixture(scope="module")
def native_build(tmp_path_factory):
    folder = tmp_path_factory.mktemp("native")
    options = ["-DKINVERSE_NATIVE_TESTS=ON", "-DKINVERSE_SANITIZE=ON", "-DCMAKE_BUILD_TYPE=Release"]
    run("cmake", "-S", ROOT, "-B", folder, "-G", "Ninja", *options)
    run("cmake", "--build", folder)
    return folder


@pytest.mark.slow
def test_native_tests_pass_under_address_and_undefined_behaviour_sanitizers(native_build):
    assert "native tests passed" in run(native_build / "native_tests")


@pytest.mark.slow
def test_instruction_sets_share_no_weak_symbols(native_build):
    """The linker keeps one copy of a weak symbol: it might be the one compiled for AVX-512."""
    if shutil.which("nm") is None:
        pytest.fail("nm (binutils) is needed to read symbol tables")
    weak = {}
    for target in ("kernels", "least_squares", "redundant"):
        paths = list(native_build.glob(f"CMakeFiles/{target}_*.dir/cpp/*.cpp.o"))
        assert paths, target
        for path in paths:
            lines = run("nm", "--defined-only", path).splitlines()
            name = path.parts[-3].removeprefix(f"{target}_").removesuffix(".dir")
            found = {x.split()[-1] for x in lines if x.split()[-2] in "WVu"}
            weak[name] = weak.get(name, set()) | found
    assert weak.keys() >= set(kernels.instruction_sets())
    names = list(weak)
    for i, one in enumerate(names):
        for other in names[i + 1 :]:
            assert not weak[one] & weak[other]


def test_each_instruction_set_agrees_with_the_one_lane_path():
    robot = kv.load("panda")
    q = robot.random(101, rng=0)
    before = kernels.instruction_set()
    try:
        for name in kernels.instruction_sets():
            kernels.set_instruction_set(name)
            assert kernels.instruction_set() == name
            lanes, one = robot.chain.fk(q), robot.chain.fk(q, one_lane=True)
            assert lanes.tobytes() == one.tobytes()  # no contraction: the same bits in any width
    finally:
        kernels.set_instruction_set(before)


def test_unknown_instruction_set_is_named_with_the_valid_ones():
    with pytest.raises(ValueError, match="baseline"):
        kernels.set_instruction_set("quantum")
    for count in (0, -1, 10**6):
        with pytest.raises(ValueError, match="threads"):
            kv.set_threads(count)


def test_threads_give_the_same_bits():
    robot = kv.load("ur5")
    q = robot.random(5000, rng=3)
    T = robot.fk(q)
    one = kv.solve(robot, T, solver="analytic")
    kv.set_threads(3)
    try:
        three = kv.solve(robot, T, solver="analytic")
        assert robot.fk(q).tobytes() == T.tobytes()
    finally:
        kv.set_threads(1)
    for name in ("q", "pose_index", "position_error", "branch", "status", "count"):
        assert getattr(one, name).tobytes() == getattr(three, name).tobytes()
    np.testing.assert_array_equal(one.stats.evaluations, three.stats.evaluations)
