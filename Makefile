# Everything happens inside .venv, which is made if absent. Nothing is installed twice: a stamp named after
# pyproject.toml, constraints.txt and this folder says what .venv already holds.
PYTHON ?= python3
VENV := .venv
BIN := $(VENV)/bin
PIP := $(BIN)/python -m pip install --quiet --disable-pip-version-check -c constraints.txt
KEY := $(shell cat pyproject.toml constraints.txt | cksum | cut -d' ' -f1)-$(shell pwd | cksum | cut -d' ' -f1)
CORE := $(VENV)/core-$(KEY).stamp
FULL := $(VENV)/full-$(KEY).stamp
EXTRAS := dev,learning,parquet,peers,render
WORKERS ?= 2
export MPLBACKEND ?= Agg

.PHONY: demo test test-slow lint wheel install install-all clean help
.DEFAULT_GOAL := help

help:  ## this list
	@sed -n 's/^\([a-z-]*\):.*## /\1\t/p' Makefile | expand -t 14

demo: $(CORE)  ## install the core and fly the demonstration: out/demo/report.html
	$(BIN)/icing demo

test: $(FULL) lint  ## install everything, check style, types and imports, run the tests (not the slow ones)
	OMP_NUM_THREADS=1 $(BIN)/python -m pytest -q -n $(WORKERS) --dist loadfile -m "not slow"

test-slow: $(FULL)  ## the slow tests alone
	OMP_NUM_THREADS=1 $(BIN)/python -m pytest -q -n $(WORKERS) --dist loadfile -m slow

lint: $(FULL)  ## style, types, import contracts
	$(BIN)/ruff check .
	$(BIN)/mypy
	$(BIN)/lint-imports

wheel: $(FULL)  ## build the wheel, and test it outside the checkout
	rm -rf dist
	$(BIN)/python -m build --wheel --outdir dist .
	$(BIN)/python -m pytest -q tests/test_wheel.py

install: $(CORE)  ## the core alone

install-all: $(FULL)  ## the core and all that tests and training need

clean:  ## remove what was built or measured; .venv stays
	rm -rf dist build out .pytest_cache .mypy_cache .ruff_cache .import_linter_cache .hypothesis

$(BIN)/python:
	@$(PYTHON) -c 'import sys; sys.exit(sys.version_info < (3, 11))' || { echo "make: $(PYTHON) is too old; CPython 3.11 or later is needed (make PYTHON=...)" >&2; exit 1; }
	$(PYTHON) -m venv $(VENV) || { rm -rf $(VENV); echo "make: no venv module; on Debian: apt install python3-venv" >&2; exit 1; }

$(CORE): | $(BIN)/python
	$(PIP) -e .
	@rm -f $(VENV)/*.stamp && touch $@

$(FULL): | $(BIN)/python
	$(PIP) -e ".[$(EXTRAS)]"
	@rm -f $(VENV)/*.stamp && touch $(CORE) $@
