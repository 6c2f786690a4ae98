"""Model files hold no code; what is damaged, foreign or strange is refused whole."""

import json
import pickle
import zipfile

import numpy as np
import pytest

import kinverse as kv
from kinverse import networks
from kinverse.errors import InputError
from kinverse.networks import MLP, RBFNetwork, SwarmMLP, storage
from kinverse.optimizers import GreyWolf

pytestmark = pytest.mark.filterwarnings("ignore::UserWarning")


@pytest.fixture(scope="module")
def rows():
    rng = np.random.default_rng(2)
    X = rng.uniform(-1, 1, (60, 3))
    return X, np.stack([X[:, 0] * X[:, 1], np.sin(X[:, 2])], axis=1)


@pytest.fixture(scope="module")
def network(rows):
    return MLP((6,), max_iter=8, random_state=1).fit(*rows)


@pytest.fixture
def file(network, tmp_path):
    network.save(tmp_path / "net.npz")
    return tmp_path / "net.npz"


def parts(file):
    with np.load(file) as archive:
        arrays = {name: archive[name] for name in archive.files}
    return json.loads(arrays.pop("header").tobytes()), arrays


def written(path, header, arrays):
    text = np.frombuffer(json.dumps(header).encode(), np.uint8)
    np.savez(path, header=text, **arrays)
    return path


def test_what_is_cut_short_is_refused(file, tmp_path):
    data = file.read_bytes()
    short = tmp_path / "short.npz"
    for k in range(0, len(data), max(1, len(data) // 40)):
        short.write_bytes(data[:k])
        with pytest.raises(InputError, match="short.npz"):
            networks.load(short)


def test_a_flipped_byte_is_noticed_or_harmless(file, network, rows, tmp_path):
    data, bent = file.read_bytes(), tmp_path / "bent.npz"
    wanted, refused = network.predict(rows[0]), 0
    for k in np.random.default_rng(0).integers(0, len(data), 150).tolist():
        bent.write_bytes(data[:k] + bytes([data[k] ^ 0x55]) + data[k + 1 :])
        try:
            again = networks.load(bent)
        except InputError:
            refused += 1
        else:
            # time stamps and the like carry nothing
            np.testing.assert_array_equal(again.predict(rows[0]), wanted)
    assert refused > 100


def test_changed_numbers_are_noticed(file, tmp_path):
    header, arrays = parts(file)
    arrays["weights_"] = arrays["weights_"] + 1e-9
    with pytest.raises(InputError, match="altered"):
        networks.load(written(tmp_path / "a.npz", header, arrays))


def test_another_version_and_kind_are_named(file, tmp_path):
    header, arrays = parts(file)
    with pytest.raises(InputError, match="version 99.* reads 1"):
        networks.load(written(tmp_path / "a.npz", {**header, "kinverse": 99}, arrays))
    with pytest.raises(InputError, match="holds a map, not a network"):
        networks.load(written(tmp_path / "b.npz", {**header, "kind": "map"}, arrays))


def test_pickled_objects_are_refused_unread(tmp_path):
    class Bomb:
        def __reduce__(self):
            return pytest.fail, ("a pickle was read",)

    raw = tmp_path / "raw.npz"
    raw.write_bytes(pickle.dumps({"a": 1}))
    with pytest.raises(InputError, match="raw.npz"):
        networks.load(raw)
    boxed = tmp_path / "boxed.npz"
    np.savez(boxed, header=np.array([Bomb()], dtype=object))
    with pytest.raises(InputError, match="pickled objects"):
        networks.load(boxed)


def test_a_file_that_unpacks_to_too_much_is_refused(tmp_path):
    bomb = tmp_path / "bomb.npz"
    with zipfile.ZipFile(bomb, "w", zipfile.ZIP_DEFLATED) as archive:
        with archive.open("header.npy", "w", force_zip64=True) as member:
            block = bytes(2**24)
            for _ in range(2**6 + 1):
                member.write(block)
    assert bomb.stat().st_size < 2**22
    with pytest.raises(InputError, match="unpack to more"):
        networks.load(bomb)


@pytest.mark.parametrize("header", [[], 3, {"kinverse": 1, "kind": "network"}, {"kinverse": "1"}])
def test_headers_of_other_shapes(header, tmp_path):
    with pytest.raises(InputError, match=r"a\.npz"):
        networks.load(written(tmp_path / "a.npz", header, {"x": np.zeros(3)}))


def test_missing_files_and_folders(tmp_path):
    with pytest.raises(FileNotFoundError):
        networks.load(tmp_path / "none.npz")
    with pytest.raises(OSError):
        networks.load(tmp_path)


def test_a_write_that_fails_leaves_the_old_file(file, network, monkeypatch):
    before = file.read_bytes()

    def full(*args, **keywords):
        raise OSError(28, "No space left on device")

    monkeypatch.setattr("pathlib.Path.write_bytes", full)
    with pytest.raises(OSError, match="No space"):
        network.save(file)
    monkeypatch.undo()
    assert file.read_bytes() == before
    assert [path.name for path in file.parent.iterdir()] == ["net.npz"]


def test_what_is_not_fitted_is_not_saved(tmp_path):
    with pytest.raises(InputError, match="not fitted"):
        MLP().save(tmp_path / "a.npz")
    assert not list(tmp_path.iterdir())


def test_a_stream_of_random_numbers_stays_behind(rows, tmp_path):
    odd = MLP((4,), max_iter=3, random_state=np.random.default_rng(1)).fit(*rows)
    odd.save(tmp_path / "a.npz")
    again = networks.load(tmp_path / "a.npz")
    assert again.random_state is None
    np.testing.assert_array_equal(again.predict(rows[0]), odd.predict(rows[0]))


@pytest.mark.parametrize("key", ["weights_", "input_unit_", "layers_", "output_middle_"])
def test_parts_that_do_not_belong_together(file, key, tmp_path):
    header, arrays = storage.read(file, "network")
    for name in ("kinverse", "kind", "digest"):
        header.pop(name, None)
    short = {**arrays, key: arrays[key][:-1]}
    storage.write(tmp_path / "a.npz", "network", header, short)
    with pytest.raises(InputError, match="do not belong together"):
        networks.load(tmp_path / "a.npz")
    del header["learned"][key]
    storage.write(tmp_path / "b.npz", "network", header, arrays)
    with pytest.raises(InputError, match="do not belong together|not as it was written"):
        networks.load(tmp_path / "b.npz")


def test_an_optimizer_with_settings_comes_back(rows, tmp_path):
    net = SwarmMLP((3,), optimizer=GreyWolf(population=20), max_evals=200, random_state=1)
    net.fit(*rows).save(tmp_path / "a.npz")
    assert networks.load(tmp_path / "a.npz").optimizer == GreyWolf(population=20)


def solvers():
    net = MLP((8,), max_iter=5)
    return [
        ("puma560", kv.Learned(net, n_samples=200)),
        ("adept_one", kv.Learned(RBFNetwork(20), n_samples=200, keep=lambda q: q[:, 0] > 0)),
        ("planar3r_003", kv.Learned(net, n_samples=200, virtual="cos_sin", task="position")),
        ("puma560", kv.Fusion(n_poses=15, region=(np.full(6, 0.5), 0.1))),
    ]


@pytest.mark.parametrize(
    ("name", "solver"), solvers(), ids=["branches", "rail", "virtual", "pairs"]
)
def test_a_trained_solver_answers_the_same_from_its_file(name, solver, tmp_path):
    robot = kv.load(name)
    T = robot.fk(robot.random(30, np.random.default_rng(4)))
    wanted = solver.fit(robot).solve(T)
    solver.save(tmp_path / "a.npz")
    again = type(solver).load(tmp_path / "a.npz", robot)
    got = again.solve(T)
    np.testing.assert_array_equal(got.q, wanted.q)
    np.testing.assert_array_equal(got.branch, wanted.branch)
    assert got.branch_labels == wanted.branch_labels
    # and it is a whole solver: it can be copied and saved again
    again.save(tmp_path / "b.npz")
    np.testing.assert_array_equal(type(solver).load(tmp_path / "b.npz", robot).solve(T).q, wanted.q)


def test_another_robot_is_refused_by_both_names(tmp_path):
    puma = kv.load("puma560")
    solver = kv.Learned(MLP((5,), max_iter=3), n_samples=150).fit(puma)
    solver.save(tmp_path / "a.npz")
    with pytest.raises(InputError, match="'puma560', not for 'kr16'"):
        kv.Learned.load(tmp_path / "a.npz", kv.load("kr16"))
    narrow = puma.with_limits(0.9 * puma.limits)
    with pytest.raises(InputError, match="another 'puma560'.*limits"):
        kv.Learned.load(tmp_path / "a.npz", narrow)
    with pytest.raises(InputError, match="holds a Learned, not a Fusion"):
        kv.Fusion.load(tmp_path / "a.npz", puma)


def test_a_network_of_another_library_cannot_be_saved(tmp_path):
    from sklearn.linear_model import LinearRegression

    solver = kv.Learned(LinearRegression(), n_samples=150).fit(kv.load("puma560"))
    with pytest.raises(InputError, match="LinearRegression cannot be saved"):
        solver.save(tmp_path / "a.npz")


def test_the_reader_gives_what_the_writer_took(tmp_path):
    arrays = {"a": np.arange(6.0).reshape(2, 3), "b.c": np.array(["x", "yz"])}
    storage.write(tmp_path / "a.npz", "test", {"plain": [1, None, "é"]}, arrays)
    header, got = storage.read(tmp_path / "a.npz", "test")
    assert header["plain"] == [1, None, "é"]
    assert all((got[name] == arrays[name]).all() for name in arrays)
