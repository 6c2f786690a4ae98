import re

import kinverse as kv

NAMES = """
Analytic FirstOf InputError KinverseError MissingExtra ModelError NoClosedForm NoSolution Numerical
Fusion Learned
Proposal Robot Seeded Solutions Solver Status Swarm __version__ check_solver load pose set_threads
solve solver_names
""".split()


def test_the_public_names_are_these():
    assert sorted(kv.__all__) == sorted(NAMES)
    assert len(NAMES) <= 25


def test_every_name_is_there_and_nothing_public_beside_them_but_modules():
    beside = {name for name in vars(kv) if not name.startswith("_")} - set(NAMES)
    assert all(type(getattr(kv, name)).__name__ == "module" for name in beside), beside
    assert all(getattr(kv, name) is not None for name in NAMES)


def test_what_shares_its_name_with_a_module_is_the_function():
    assert callable(kv.solve) and callable(kv.load) and callable(kv.pose)


def test_every_public_name_says_what_it_does():
    for name in set(NAMES) - {"__version__"}:
        doc = getattr(kv, name).__doc__
        assert doc and doc.strip(), name


def test_the_version_is_the_installed_one():
    assert re.match(r"\d+\.\d+", kv.__version__)


def test_unknown_names_are_attribute_errors():
    assert not hasattr(kv, "ikine")
