# Every target that needs Python first makes .venv, or brings it up to date; `make` alone lists them.

PYTHON ?= python3
JOBS ?= 2
OUT ?= out
ARGS ?=

VENV := .venv
PY := $(VENV)/bin/python
STAMP := $(VENV)/.installed

# One BLAS thread per process: parallelism is over chunks of work, and the order of a sum must not
# depend on the number of cores.
export OPENBLAS_NUM_THREADS := 1
export MKL_NUM_THREADS := 1
export OMP_NUM_THREADS := 1
export NUMEXPR_NUM_THREADS := 1
export VECLIB_MAXIMUM_THREADS := 1
# Matplotlib's font cache lives with the environment: HOME may be read-only, and nobody's own
# matplotlibrc changes a figure.
export MPLCONFIGDIR := $(CURDIR)/$(VENV)/matplotlib
export PIP_DISABLE_PIP_VERSION_CHECK := 1
export PIP_BUILD_CONSTRAINT := constraints.txt
# Tests draw the same examples every time; HYPOTHESIS_PROFILE=nightly draws many new ones.
HYPOTHESIS_PROFILE ?= ci
export HYPOTHESIS_PROFILE

.DEFAULT_GOAL := help
.PHONY: help setup figures figures-paper test test-lowest dist lint audit check notebooks notebook-pages docs evidence bench clean

help:  ## list the targets
	@echo 'usage: make TARGET [ARGS="..."] [JOBS=2] [OUT=out] [PYTHON=python3]'
	@awk -F ':.*## ' '/^[a-z-]+:.*## / { printf "  %-14s %s\n", $$1, $$2 }' Makefile

setup: $(STAMP)  ## make .venv and install the pinned packages into it

figures: $(STAMP)  ## draw every figure small, check its claims, write the report; ARGS="ID ..." draws some
	$(PY) -m figures run --preset quick --jobs $(JOBS) --out $(OUT) $(ARGS)
	$(PY) -m figures report --out $(OUT)

figures-paper: OUT := $(OUT)-paper
figures-paper: $(STAMP)  ## the same at the papers' sample counts, into out-paper/; hours, and verdicts are kept
	$(PY) -m figures run --preset paper --jobs $(JOBS) --out $(OUT) $(ARGS); \
	    status=$$?; $(PY) -m figures keep --out $(OUT) && exit $$status
	$(PY) -m figures report --out $(OUT)

test: $(STAMP)  ## run the laws; ARGS="-k name" runs some
	$(PY) -m pytest -n $(JOBS) --dist worksteal $(ARGS)

test-lowest: $(VENV)-lowest/.installed  ## the same with the lowest versions that pyproject.toml allows
	$(VENV)-lowest/bin/python -m pytest -n $(JOBS) --dist worksteal $(ARGS)

dist: $(STAMP)  ## build the two archives into dist/, and check them
	$(PY) -m hatchling build --clean
	$(PY) -m pytest tests/test_release.py -q

lint: $(STAMP)  ## ruff and mypy --strict
	$(PY) -m ruff check
	$(PY) -m ruff format --check
	$(PY) -m mypy --strict

audit: $(STAMP)  ## do ledger, results in out/, kept paper runs and evidence fit? nothing may be stale
	$(PY) -m figures audit --out $(OUT)
	$(PY) benchmarks/evidence.py --stale

check: lint figures test audit  ## all that must pass before a change is handed in

notebooks: $(STAMP)-notebooks  ## open the notebooks in Jupyter; ARGS="--no-browser" on a machine without one
	$(PY) -m jupyterlab notebooks $(ARGS)

notebook-pages: $(STAMP)  ## run the notebooks and write them into docs/notebooks; ARGS="01 ..." does some
	$(PY) -m notebooks.pages $(ARGS)

docs: $(STAMP)-docs  ## the documentation site, into out-docs/html, to read without a network
	$(PY) -m docs.site --out out-docs $(ARGS)

evidence: $(STAMP)  ## the long runs whose results are committed; hours
	@if [ -f benchmarks/evidence.py ]; then $(PY) benchmarks/evidence.py $(ARGS); \
	else echo 'No evidence jobs yet: benchmarks/evidence.py will hold them.'; fi

bench: $(STAMP)  ## time the hot paths; every script prints ratios
	@set -e; for script in benchmarks/bench_*.py; do \
	    if [ ! -e "$$script" ]; then echo 'No benchmarks yet: benchmarks/bench_*.py will hold them.'; break; fi; \
	    echo "== $$script"; $(PY) "$$script" $(ARGS); done

clean:  ## remove caches, build products, out/ and out-docs/; keep .venv and out-paper/
	rm -rf out out-docs build dist .hypothesis .mypy_cache .pytest_cache .ruff_cache
	find . -path ./$(VENV) -prune -o -type d -name __pycache__ -exec rm -rf {} +

# ---------------------------------------------------------------- set-up

IS_NEW_ENOUGH := import sys; sys.exit(sys.version_info < (3, 11))

define TOO_OLD
restir-ref needs Python 3.11 or newer; '$(PYTHON)' is not.
Name another one, for example:  make PYTHON=python3.12
endef

define NO_VENV
'$(PYTHON) -m venv' failed (its message is above), so there is no .venv.
On Debian and Ubuntu the module is a package of its own:  apt-get install python3-venv
Or name another Python:  make PYTHON=python3.12
endef

define NO_WITNESS
Mitsuba 3 could not be installed (the message is above); what compares our pictures with its is skipped.
endef
export TOO_OLD NO_VENV NO_WITNESS

$(STAMP): pyproject.toml constraints.txt
	@$(PY) -c 'import pip; $(IS_NEW_ENOUGH)' 2>/dev/null || { \
	    rm -rf $(VENV); \
	    $(PYTHON) -c '$(IS_NEW_ENOUGH)' || { echo "$$TOO_OLD" >&2; exit 1; }; \
	    $(PYTHON) -m venv $(VENV) || { rm -rf $(VENV); echo "$$NO_VENV" >&2; exit 1; }; }
	@echo 'Installing the pinned packages into $(VENV); the first time takes about a minute.'
	@$(PY) -m pip install -qq --upgrade pip
	@$(PY) -m pip install -qq -c constraints.txt -e . --group dev
	@$(PY) -m pip install -qq -c constraints.txt -e '.[reference]' || { test -z "$$CI" && echo "$$NO_WITNESS" >&2; }
	@touch $@

# Beside .venv, so that both stay whole.  The bounds of `dependencies` become pins, the other pins stay.
LOWEST := import re, tomllib; \
    bounds = tomllib.load(open("pyproject.toml", "rb"))["project"]["dependencies"]; \
    print(*(bound.replace(">=", "==") for bound in bounds), sep="\n")

$(VENV)-lowest/.installed: pyproject.toml
	$(PYTHON) -m venv $(VENV)-lowest || { rm -rf $(VENV)-lowest; echo "$$NO_VENV" >&2; exit 1; }
	@$(VENV)-lowest/bin/python -m pip install -qq --upgrade pip
	@$(VENV)-lowest/bin/python -c '$(LOWEST)' > $(VENV)-lowest/lowest.txt
	@$(VENV)-lowest/bin/python -m pip install -qq -c $(VENV)-lowest/lowest.txt -e . --group test
	@touch $@

$(STAMP)-notebooks: $(STAMP)
	@echo 'Installing Jupyter into $(VENV).'
	@$(PY) -m pip install -qq -c constraints.txt -e '.[notebooks]'
	@touch $@

$(STAMP)-docs: $(STAMP)
	@echo 'Installing Sphinx into $(VENV).'
	@$(PY) -m pip install -qq -c constraints.txt -e . --group docs
	@touch $@
