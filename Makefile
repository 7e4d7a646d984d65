# Every target sets up .venv by itself; it needs python3 (3.11 or newer) and make, and uses uv when it is there.
PYTHON ?= python3
VENV := .venv
BIN := $(VENV)/bin
BASE := $(VENV)/.base
READY := $(VENV)/.ready

# a process runs whole files, so that it prepares what their tests share once; tests/conftest.py puts slow files first;
# one process more than there are processors, as some tests wait
PARALLEL := -n $(shell echo $$(($$(getconf _NPROCESSORS_ONLN) + 1))) --dist loadfile --no-loadscope-reorder

# compiled modules are kept, even where the environment says otherwise; without them each process compiles its own
export PYTHONDONTWRITEBYTECODE :=

.PHONY: demo test quick check bench docs installed release attacks clean
.DEFAULT_GOAL := demo

demo: $(BASE)
	$(BIN)/asperity demo

test: $(READY)
	$(BIN)/python -m pytest $(PARALLEL)

quick: $(READY)
	$(BIN)/python -m pytest $(PARALLEL) -q -m "not slow" tests/unit

check: $(READY)
	$(BIN)/ruff check .
	$(BIN)/ruff format --check .
	$(BIN)/mypy
	$(BIN)/lint-imports

bench: $(READY)
	$(BIN)/python -m benchmarks

# a wheel in environments that are not ours: base, with extras, lowest and newest dependencies, a folder nobody can write
installed: $(READY)
	PYTHON="$(PYTHON)" ./.ci/installed

# refused while metadata name no author and no address; then the wheel and the sdist, installed and tried
release: $(READY)
	ASPERITY_RELEASE=1 $(BIN)/python -m pytest -q tests/unit/test_release.py
	PYTHON="$(PYTHON)" ./.ci/installed

attacks: $(READY)
	$(BIN)/python -m benchmarks.attacks --share 0.02

# the site, in build/site: warnings are errors, nothing is fetched
docs: $(READY)
	$(BIN)/python docs/build.py

clean:
	rm -rf $(VENV)

INSTALL := $(if $(shell command -v uv),uv pip install --python $(BIN)/python,$(BIN)/python -m pip install) --quiet --constraint constraints.txt

# the package alone, which the demo needs
$(BASE): pyproject.toml constraints.txt
	@$(PYTHON) -c 'import sys; sys.exit(sys.version_info < (3, 11))' || { echo "asperity needs Python 3.11 or newer; point PYTHON=... at one"; exit 1; }
	@echo "Setting up $(VENV) (once; about a minute) ..."
	@if command -v uv >/dev/null 2>&1; then \
	  uv venv --quiet --clear --python "$(PYTHON)" $(VENV); \
	else \
	  $(PYTHON) -m venv --clear $(VENV) && $(INSTALL) 'pip>=25.1'; \
	fi
	@$(INSTALL) --editable .
	@touch $(BASE)

# with extras, and what tests and docs need
$(READY): $(BASE)
	@echo "Adding extras and developers' packages to $(VENV) (once; a minute or two) ..."
	@$(INSTALL) --editable '.[recordings,study,page,infer,monitor]' --group dev --group docs
	@touch $(READY)
