"""kinverse train, and kinverse solve with what it wrote."""

import json
import os
import signal
import sys
import zipfile

import numpy as np
import pytest

import kinverse as kv
from kinverse import InputError
from kinverse.cli import _network, main
from kinverse.networks import NAMES, make_network, storage
from kinverse.networks.monitor import Monitor

SMALL = ["--network", "mlp", "--set", "hidden=8", "--set", "max_iter=4", "--samples", "150"]
POSE = ["--pose", "0.4", "0.3", "1.9", "10", "0", "20", "--degrees"]


def run(capsys, *argv):
    code = main(list(map(str, argv)))
    said = capsys.readouterr()
    return code, said.out, said.err


def refused(capsys, *argv, status=2):
    code, out, err = run(capsys, *argv)
    assert code == status and out == ""
    assert err.startswith("kinverse: error: ") and err.count("\n") == 1
    return err


@pytest.fixture(scope="module")
def kr16(tmp_path_factory):
    """A small Learned of the KR16, in a file."""
    path = tmp_path_factory.mktemp("models") / "kr16.npz"
    assert main(["train", "kr16", *SMALL, "--out", str(path)]) == 0
    return path


@pytest.fixture
def here(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    return tmp_path


# ---------------------------------------------------------------------------- training
def test_train_tells_each_branch_and_writes(capsys, here):
    code, out, err = run(capsys, "train", "kr16", *SMALL, "--out", "kr16.npz")
    assert code == 0 and err == ""
    assert "8 networks MLP 12-8-9" in out and "all epochs were used" in out
    lines = [line.split() for line in out.splitlines() if "wrist" in line]
    assert [line[:3] for line in lines] == [
        [f"shoulder{a}", f"elbow{b}", f"wrist{c}"] for a in "+-" for b in "+-" for c in "+-"
    ]
    assert {line[3] for line in lines} == {"150"} and {line[4] for line in lines} == {"4"}
    assert out.endswith("written: kr16.npz\n") and os.listdir(here) == ["kr16.npz"]


def test_what_is_told_is_what_the_file_does(capsys, here):
    given = ["train", "adept_one", *SMALL, "--rng", "7", "--out", "a.npz", "--json"]
    code, out, _ = run(capsys, *given)
    told = json.loads(out)
    robot = kv.load("adept_one")
    solver = kv.Learned.load("a.npz", robot)
    assert code == 0 and told["robot"] == "adept_one" and not told["interrupted"]
    assert [each["branch"] for each in told["networks"]] == list(solver.branch_labels_)
    assert solver.random_state == 7 and solver.n_samples == 150
    assert solver.network.get_params()["hidden"] == 8
    for k, each in enumerate(told["networks"]):
        net = solver.experts_[k].network
        assert each["epochs"] == net.n_iter_ == 4
        # the slide is no circular joint: its error is the network's own after its best epoch
        slide = solver.experts_[k].joint_errors(net.training_mse_)[:, 2]
        assert np.abs(1e3 * np.sqrt(slide) / each["training_mm"] - 1.0).min() < 1e-3
    rows = solver.held_out(500)
    held = told["held_out"]
    assert held["start_mm"] == pytest.approx(1e3 * np.median(rows.position_error))
    assert held["start_deg"] == pytest.approx(np.degrees(np.median(rows.rotation_error)))
    off = np.linalg.norm((robot.fk(rows.predicted) - rows.T)[:, :3, 3], axis=1)
    np.testing.assert_allclose(off, rows.position_error, atol=1e-12)
    np.testing.assert_allclose(robot.fk(rows.q), rows.T, atol=1e-9)


def test_the_same_command_writes_the_same_solver(capsys, here):
    given = ["train", "adept_one", *SMALL]
    _, first, _ = run(capsys, *given, "--out", "a.npz", "--json")
    _, second, _ = run(capsys, *given, "--out", "b.npz", "--json")
    _, other, _ = run(capsys, *given, "--out", "c.npz", "--json", "--random-state", "5")
    assert json.loads(first) == json.loads(second) | {"file": "a.npz"}
    assert json.loads(first)["networks"] != json.loads(other)["networks"]
    robot = kv.load("adept_one")
    T = robot.fk(robot.random(20, 3))
    a, b = (kv.Learned.load(name, robot).predict(T) for name in ("a.npz", "b.npz"))
    np.testing.assert_array_equal(a, b)


def test_fresh_poses_are_none_that_were_learned(kr16):
    solver = kv.Learned.load(kr16, kv.load("kr16"))
    learned = np.concatenate([expert.neighbours.q for expert in solver.experts_])
    fresh = solver.held_out(100)
    distance = np.abs(fresh.q[:, None] - learned[None]).max(axis=2).min(axis=1)
    assert distance.min() > 1e-9


def test_a_redundant_arm_has_one_network(capsys, here):
    given = ["train", "planar3r_003", *SMALL, "--virtual", "cos_sin", "--task", "position"]
    code, out, _ = run(capsys, *given, "--features", "xyz", "--out", "a.npz", "--json")
    told = json.loads(out)
    assert code == 0 and told["task"] == "position" and len(told["networks"]) == 1
    assert told["held_out"]["start_deg"] is None  # the task has no rotation
    solver = kv.Learned.load("a.npz", kv.load("planar3r_003"))
    assert solver.experts_[0].virtual.kind == "cos_sin"
    code, out, _ = run(capsys, *given[:-4], "--virtual", "joint:joint1", "--out", "b.npz")
    assert code == 0 and "one network MLP 13-8-3" in out and " deg in the median" in out


def test_refine_none_is_kept(capsys, here):
    assert run(capsys, "train", "adept_one", *SMALL, "--refine", "none", "--out", "a.npz")[0] == 0
    pose = ["--pose", "0.4", "0.1", "0.7", "0", "180", "0", "--degrees", "--json"]
    code, out, _ = run(capsys, "solve", "adept_one", "--solver", "a.npz", *pose)
    (told,) = json.loads(out)["poses"]
    assert code == 1 and told["status"] == "NOT_FOUND" and told["best"]["position_error"] > 1e-4


def test_fusion_learns_a_region(capsys, here):
    robot = kv.load("ir361")
    centre = np.degrees(robot.limits.mean(axis=1)) + [0, 10, 20, 30, 40, 50]
    given = ["--solver", "fusion", "--degrees", "--region", *centre, "3", "--poses", "25"]
    given += ["--network", "RBFNetwork", "--set", "n_neurons=30", "--set", "spread=3"]
    code, out, _ = run(capsys, "train", "ir361", *given, "--out", "f.npz", "--json")
    told = json.loads(out)
    assert code == 0 and told["solver"] == "Fusion" and told["network"] == "RBFNetwork"
    assert told["networks"][0]["examples"] == 25 * 24 and told["networks"][0]["epochs"] == 30
    assert told["held_out"]["solved_percent"] == 100.0
    solver = kv.Fusion.load("f.npz", robot)
    about = np.degrees(solver.held_out(50).q) - centre
    assert np.abs(about).max() <= 3.0 and np.abs(about).max() > 2.5
    given[given.index("3")] = "1 1 1 2 2 2"
    assert run(capsys, "train", "ir361", *given, "--out", "g.npz")[0] == 0
    about = np.degrees(kv.Fusion.load("g.npz", robot).held_out(100).q) - centre
    assert np.all(np.abs(about).max(axis=0) <= [1, 1, 1, 2, 2, 2])


def test_too_few_patterns_are_remarked_on_once(capsys, here):
    given = ["--network", "mlp", "--set", "hidden=99", "--set", "max_iter=2", "--samples", "110"]
    code, _, err = run(capsys, "train", "adept_one", *given, "--out", "a.npz")
    assert code == 0 and err.count("it can learn them by heart") == 1
    assert err.startswith("kinverse: note: MLP: ")


# ---------------------------------------------------------------------------- Ctrl-C
def interrupting(monkeypatch, at, second=()):
    """Ctrl-C after some epoch of all networks, and in the middle of others; their count."""
    epoch, count = Monitor.epoch, [0]

    def counted(self, *given, **settings):
        ends = epoch(self, *given, **settings)
        count[0] += 1
        if count[0] == at or count[0] in second:
            signal.raise_signal(signal.SIGINT)
        return ends

    monkeypatch.setattr(Monitor, "epoch", counted)
    return count


def test_ctrl_c_keeps_what_was_learned(capsys, here, monkeypatch):
    count = interrupting(monkeypatch, at=6)
    before = signal.getsignal(signal.SIGINT)
    code, out, err = run(capsys, "train", "adept_one", *SMALL, "--out", "a.npz", "--json")
    told = json.loads(out)
    assert code == 1 and told["interrupted"]
    assert "interrupted: the networks keep what they had learned, and are written" in err
    # the second network was in its second epoch: the callback is asked in the next
    assert [each["epochs"] for each in told["networks"]] == [4, count[0] - 4] and count[0] == 7
    assert signal.getsignal(signal.SIGINT) is before
    robot = kv.load("adept_one")
    assert kv.Learned.load("a.npz", robot).solve(robot.fk(robot.random(30, 1))).ok.all()


def test_a_second_ctrl_c_does_not_wait(capsys, here, monkeypatch):
    interrupting(monkeypatch, at=1, second=(2,))
    given = ["--network", "mlp", "--set", "max_iter=100", "--samples", "150"]
    code, out, err = run(capsys, "train", "adept_one", *given, "--out", "a.npz", "--json")
    assert code == 1 and json.loads(out)["networks"][0]["epochs"] <= 2
    assert "interrupted" in err and os.listdir(here) == ["a.npz"]


def test_ctrl_c_before_anything_is_learned_writes_nothing(capsys, here, monkeypatch):
    from kinverse.solvers import learned

    def by_branch(*given):
        signal.raise_signal(signal.SIGINT)

    monkeypatch.setattr(learned, "by_branch", by_branch)
    given = [*SMALL, "--out", "a.npz"]
    assert "interrupted" in refused(capsys, "train", "kr16", *given, status=130)
    assert os.listdir(here) == []


# ---------------------------------------------------------------------------- bad input
@pytest.mark.parametrize(
    ("argv", "says"),
    [
        (["--network", "magic"], "unknown network 'magic': the networks are elman, mlp"),
        (["--network", "mlp", "--set", "hiden=3"], "no setting 'hiden': its settings are activ"),
        (["--network", "mlp", "--set", "callback=3"], "no setting 'callback'"),
        (["--network", "mlp", "--set", "hidden"], "--set needs name=value"),
        (["--network", "mlp", "--set", "hidden="], "--set needs name=value"),
        (["--network", "mlp", "--set", "hidden=3", "--set", "hidden=4"], "given twice"),
        (["--network", "mlp", "--set", "hidden=none"], "hidden must name at least one layer"),
        (["--network", "mlp", "--set", "trainer=sgd"], "varpro"),
        (["--network", "mlp", "--set", "goal=nan"], "goal must be a finite number"),
        (["--set", "hidden=foo"], "at least one layer, (h_1, ...) or h, got 'foo'"),
        (
            ["--virtual", "elbow"],
            "unknown virtual vector 'elbow': it may be angle_sum, cos, cos_sin",
        ),
        (["--virtual", "joint:elbow"], "elbow"),
        (["--virtual", "cos"], "turning axes that are all parallel"),
        (["--features", "uvw"], "xyz+quat"),
        (["--refine", "magic"], "newton, lm or None"),
        (["--samples", "1"], "n_samples must lie in 2.."),
        (["--rng", "-1"], "random_state must lie in 0.."),
        (["--task", "magic"], "position_axis"),
        (["--poses", "30"], "--poses belongs to --solver fusion"),
        (["--region", "0", "0", "0", "0", "0", "0", "1"], "--region belongs to --solver fusion"),
        (["--solver", "fusion", "--samples", "30"], "--samples belongs to --solver learned"),
        (["--solver", "fusion", "--virtual", "cos"], "--virtual belongs to --solver learned"),
        (["--solver", "fusion", "--refine", "lm"], "--refine belongs to --solver learned"),
        (["--solver", "fusion", "--region", "1", "2"], "--region needs 6 joint values (joint1"),
        (["--solver", "fusion", "--region", "1", "x", "2"], "--region: 'x' is not a number"),
        (["--solver", "fusion", "--region", "6", "6", "6", "6", "6", "6", "1"], "region"),
        (["--solver", "magic"], "is not one of"),
        (["--plot", "a.txt"], ".png, .svg or .pdf"),
        (["--base", "a"], "kr16"),
    ],
)
def test_bad_options_are_one_line_and_write_nothing(capsys, here, argv, says):
    small = [] if {"--network", "--set", "--samples", "--solver"} & set(argv) else SMALL
    assert says in refused(capsys, "train", "kr16", *small, *argv, "--out", "a.npz")
    assert os.listdir(here) == []


@pytest.mark.parametrize(
    ("out", "says"),
    [
        ("a.pkl", "--out must end in .npz, got 'a.pkl'"),
        ("no/such/a.npz", "no folder"),
        ("folder.npz", "is a folder"),
        pytest.param(
            "/proc/a.npz",
            "cannot write in /proc",
            marks=pytest.mark.skipif(not os.path.isdir("/proc"), reason="no /proc here"),
        ),
    ],
)
def test_what_cannot_be_written_is_told_before_the_work(capsys, here, monkeypatch, out, says):
    monkeypatch.setattr(kv.Learned, "_fit", lambda *given: pytest.fail("it trained"))
    (here / "folder.npz").mkdir()
    assert says in refused(capsys, "train", "kr16", *SMALL, "--out", out)


def test_slides_and_turns_need_a_width_each(capsys, here):
    given = ["train", "adept_one", "--solver", "fusion", "--out", "a.npz", "--region"]
    assert "it needs 4 half widths" in refused(capsys, *given, "0", "0", "0.1", "0", "0.1")


def test_missing_packages_are_named(capsys, here, monkeypatch):
    monkeypatch.setattr(kv.Learned, "_fit", lambda *given: pytest.fail("it trained"))
    monkeypatch.setitem(sys.modules, "matplotlib.figure", None)
    said = refused(capsys, "train", "kr16", *SMALL, "--out", "a.npz", "--plot", "a.png")
    assert "kinverse[plot]" in said
    for name in [name for name in sys.modules if name.startswith("kinverse.networks.mlp")]:
        monkeypatch.delitem(sys.modules, name)
    import kinverse.networks

    monkeypatch.delattr(kinverse.networks, "MLP", raising=False)
    monkeypatch.setitem(sys.modules, "sklearn", None)
    monkeypatch.delitem(sys.modules, "kinverse.networks._base", raising=False)
    monkeypatch.setitem(sys.modules, "sklearn.base", None)
    assert "kinverse[learn]" in refused(capsys, "train", "kr16", *SMALL, "--out", "a.npz")


# ---------------------------------------------------------------------------- settings
@pytest.mark.parametrize(
    ("text", "value"),
    [
        ("3", 3),
        ("-3", -3),
        ("0.5", 0.5),
        ("1e-3", 1e-3),
        ("60,60", (60, 60)),
        ("60,", (60,)),
        ("tansig, purelin", ("tansig", "purelin")),
        ("none", None),
        ("True", True),
        ("false", False),
        ("lm", "lm"),
        ("__import__('os')", "__import__('os')"),
    ],
)
def test_settings_are_read_and_never_run(text, value):
    got = _network.value(text)
    assert got == value and type(got) is type(value)


@pytest.mark.parametrize("name", NAMES)
def test_no_setting_of_any_kind_is_more_than_an_input_error(name):
    """Whatever is given, it is taken or refused by name."""
    quick = {"SwarmMLP": "max_evals=200", "SwarmRBF": "max_evals=200", "RBFNetwork": "n_neurons=5"}
    rng = np.random.default_rng(0)
    X = rng.uniform(-1.0, 1.0, (100, 2))
    y = np.stack([X.sum(axis=1), X[:, 0] * X[:, 1]], axis=1)
    taken = 0
    for key in make_network(name.lower()).get_params(deep=False):
        if key in _network.NOT_HERE:
            continue
        for text in ("none", "true", "x", "0", "-1", "0.5", "1,2", "nan", "x,y", ","):
            first = quick.get(name, "max_iter=2")
            settings = [] if first.startswith(key + "=") else [first]
            net = _network.network(name, [*settings, f"{key}={text}"])
            try:
                net.fit(X, y)
            except InputError as error:
                assert str(error)
            else:
                taken += 1
    assert taken


# ---------------------------------------------------------------------------- solve --solver FILE
def test_solve_takes_the_file_as_any_solver(capsys, kr16):
    code, out, err = run(capsys, "solve", "kr16", *POSE, "--solver", kr16)
    assert code == 0 and err == "" and "SOLVED 1 of 1" in out
    _, told, _ = run(capsys, "solve", "kr16", *POSE, "--solver", kr16, "--json")
    _, exact, _ = run(capsys, "solve", "kr16", *POSE, "--json")
    told, exact = json.loads(told), json.loads(exact)
    assert told["solver"] == str(kr16) and told["task"] == "pose"
    found = {s["label"]: s["q"] for s in told["poses"][0]["solutions"]}
    every = {s["label"]: s["q"] for s in exact["poses"][0]["solutions"]}
    assert found and found.keys() <= every.keys()
    for label, q in found.items():
        np.testing.assert_allclose(q, every[label], atol=1e-3)


def test_the_files_task_is_taken_over_and_no_other(capsys, here):
    given = ["train", "planar3r_003", *SMALL, "--virtual", "cos", "--task", "position"]
    run(capsys, *given, "--features", "xyz", "--out", "a.npz")
    solve = ["solve", "planar3r_003", "--solver", "a.npz", "--pose", "3", "12", "0"]
    code, out, _ = run(capsys, *solve, "--json")
    assert json.loads(out)["task"] == "position" and len(json.loads(out)["poses"]) == 1
    assert "trained for task 'position', --task is 'planar'" in refused(
        capsys, *solve, "--task", "planar"
    )


def solve(capsys, path, robot="kr16"):
    return refused(capsys, "solve", robot, *POSE, "--solver", path)


def test_a_file_of_another_robot_names_both(capsys, kr16):
    assert "trained for the robot 'kr16', not for 'ur5'" in solve(capsys, kr16, "ur5")


def test_no_file_is_told(capsys, here):
    assert "no such file: none.npz" in solve(capsys, "none.npz")
    (here / "folder.npz").mkdir()
    assert "folder.npz" in solve(capsys, "folder.npz")
    assert "unknown solver 'file.npy'" in solve(capsys, "file.npy")


@pytest.mark.parametrize("share", [0.0, 0.1, 0.5, 0.9, 0.999])
def test_a_truncated_file_is_refused(capsys, kr16, here, share):
    whole = kr16.read_bytes()
    (here / "a.npz").write_bytes(whole[: int(share * len(whole))])
    assert "a.npz: no model file" in solve(capsys, "a.npz")


def test_an_altered_byte_is_refused(capsys, kr16, here):
    whole = bytearray(kr16.read_bytes())
    for place in np.linspace(0, len(whole) - 1, 12).astype(int):
        altered = whole.copy()
        altered[place] ^= 0x5A
        (here / "a.npz").write_bytes(altered)
        code, out, err = run(capsys, "solve", "kr16", *POSE, "--solver", "a.npz", "--json")
        # a byte that says nothing about the arrays, such as a file's date, may differ
        if code == 2:
            assert "a.npz" in err and err.count("\n") == 1
        else:
            answers = run(capsys, "solve", "kr16", *POSE, "--solver", kr16, "--json")[1]
            assert json.loads(out)["poses"] == json.loads(answers)["poses"]


def rewritten(source, target, change, arrays=lambda arrays: arrays):
    """The file with another header or other arrays, its sum not made anew."""
    with np.load(source) as file:
        held = {name: file[name] for name in file.files}
    header = json.loads(held.pop("header").tobytes())
    change(header)
    text = np.frombuffer(json.dumps(header).encode(), np.uint8)
    np.savez_compressed(target, header=text, **arrays(held))


def test_other_numbers_or_settings_are_refused(capsys, kr16, here):
    rewritten(kr16, "a.npz", lambda header: None)
    assert run(capsys, "solve", "kr16", *POSE, "--solver", "a.npz")[0] == 0
    rewritten(kr16, "a.npz", lambda header: header["settings"].update(tol_position=1.0))
    assert "altered" in solve(capsys, "a.npz")

    def more(arrays):
        return arrays | {"0.q": arrays["0.q"] + 1e-3}

    rewritten(kr16, "a.npz", lambda header: None, more)
    assert "altered" in solve(capsys, "a.npz")
    rewritten(kr16, "a.npz", lambda header: header.update(kinverse=99))
    assert "a.npz: model file version 99, this kinverse reads 1" in solve(capsys, "a.npz")


def test_a_header_that_lies_is_refused_whole(capsys, kr16, here):
    """With a sum that fits, as one would write who alters a file on purpose."""
    header, arrays = storage.read(kr16, "trained solver")
    fresh = {k: v for k, v in header.items() if k not in ("kinverse", "kind")}
    lies = [
        ("solver", "Swarm"),
        ("settings", {"magic": 1}),
        ("settings", header["settings"] | {"refine": "magic"}),
        ("settings", header["settings"] | {"tol_position": "x"}),
        ("settings", []),
        ("branches", [0]),
        ("branches", [99] * 8),
        ("branches", ["x"] * 8),
        ("branch_labels", ["a"]),
        ("experts", header["experts"][:1]),
        ("experts", [{}] * 8),
        ("experts", "x"),
        ("fingerprint", "0"),
    ]
    for key, value in lies:
        storage.write("a.npz", "trained solver", fresh | {key: value}, arrays)
        assert "a.npz" in solve(capsys, "a.npz"), (key, value)
    for name in ("0.q", "0.T", "0.circular", "0.network.weights_"):
        storage.write("a.npz", "trained solver", fresh, arrays | {name: np.zeros(3)})
        assert "a.npz" in solve(capsys, "a.npz"), name


class Harm:
    """What pickle would run."""

    def __reduce__(self):
        return os.mkdir, ("harm",)


def test_a_file_with_pickled_objects_is_refused_unread(capsys, kr16, here):
    with np.load(kr16) as file:
        held = {name: file[name] for name in file.files}
    np.savez(here / "a.npz", **held, extra=np.array([Harm()], dtype=object))
    assert "refused, it holds pickled objects" in solve(capsys, "a.npz")
    assert not (here / "harm").exists()


def test_other_files_are_no_models(capsys, here):
    np.savez("a.npz", x=np.zeros(3))
    assert "no model file" in solve(capsys, "a.npz")
    with zipfile.ZipFile("b.npz", "w") as archive:
        archive.writestr("header.npy", "text")
    assert "b.npz" in solve(capsys, "b.npz")
    net = make_network("mlp", hidden=3, max_iter=2)
    X = np.random.default_rng(0).normal(size=(50, 2))
    net.fit(X, X).save("net.npz")
    assert "net.npz: holds a network, not a trained solver" in solve(capsys, "net.npz")


# ---------------------------------------------------------------------------- pictures
def test_train_draws(capsys, here):
    given = ["train", "adept_one", *SMALL, "--out", "a.npz", "--plot", "a.png"]
    code, _, err = run(capsys, *given)
    assert code == 0 and "drawn: a.png" in err
    assert (here / "a.png").stat().st_size > 10_000


def test_no_picture_of_a_search_that_is_none(capsys, kr16):
    said = refused(capsys, "solve", "kr16", *POSE, "--solver", kr16, "--plot", "a.png")
    assert "--plot draws swarm solvers" in said
