# One command per habit, the same here and in CI. Each makes the environment it needs.
PYTHON ?= python3
VENV   := .venv
BIN    := $(VENV)/bin
PIP    := $(BIN)/python -m pip --disable-pip-version-check
NATIVE := pyproject.toml $(wildcard CMakeLists.txt cpp/*)
SOURCE := $(shell find src -name '*.py' -o -name '*.toml')

.PHONY: demo test lint bench docs clean

demo: $(VENV)/.demo
	$(BIN)/kinverse compare kr16 --poses 1000
	$(BIN)/kinverse solve kr16 --pose 0.4 0.3 1.9 10 0 20 --degrees
	$(BIN)/python examples/from_urdf.py

test: $(VENV)/.test
	$(BIN)/python -m pytest -n 2 -m ""

lint: $(VENV)/.test
	$(BIN)/ruff check .
	$(BIN)/mypy

bench: .venv-bench/.done
	OMP_NUM_THREADS=1 OPENBLAS_NUM_THREADS=1 .venv-bench/bin/python -m kinverse.bench --json bench.json $(BENCH)

docs: $(VENV)/.test
	$(PIP) install -q "mkdocs-material>=9.5"
	$(BIN)/python -m mkdocs build --strict

clean:
	rm -rf $(VENV) .venv-bench build dist site .mypy_cache .pytest_cache .ruff_cache .hypothesis

$(BIN)/python:
	$(PYTHON) -m venv $(VENV)

# What a user gets: a plain install. It replaces the editable one below, and the other way round.
$(VENV)/.demo: $(NATIVE) $(SOURCE) | $(BIN)/python
	$(PIP) install -q .
	$(PIP) install -q --no-deps compas-fab==2.0.1
	rm -f $(VENV)/.test && touch $@

# What a developer gets: editable, and a native core that is rebuilt only where it changed. The
# list of Python files is fixed at the install, so a new one needs another (a few seconds).
$(VENV)/.test: $(NATIVE) $(SOURCE) | $(BIN)/python
	$(PIP) install -q "scikit-build-core>=0.11" "nanobind>=2.4" "cmake>=3.26" "ninja>=1.11"
	$(PIP) install -q --no-build-isolation -e ".[test]"
	$(PIP) install -q --no-deps compas-fab==2.0.1
	rm -f $(VENV)/.demo && touch $@

.venv-bench/.done: $(NATIVE) $(SOURCE) requirements-bench.txt
	test -x .venv-bench/bin/python || $(PYTHON) -m venv .venv-bench
	.venv-bench/bin/python -m pip install -q --disable-pip-version-check -r requirements-bench.txt
	.venv-bench/bin/python -m pip install -q --disable-pip-version-check .
	touch $@
