# Two jobs on a fresh machine: `make demo` and `make test`; `make app` opens the window. None sets anything up twice.
PYTHON ?= python3
VENV := .venv
BIN := $(VENV)/bin
READY := $(VENV)/ready

.PHONY: app demo docs test test-long setup
demo: $(READY)
	$(BIN)/daq-app demo

app: $(READY)
	$(BIN)/daq-app

test: $(READY)
	@$(BIN)/python tests/run.py

test-long: $(READY)
	@$(BIN)/python tests/run.py --long

docs: $(READY)
	$(BIN)/python -m sphinx --fail-on-warning --keep-going --quiet docs docs/_build
	@echo "The documentation is in docs/_build/index.html."

setup: $(READY)

$(READY): pyproject.toml constraints.txt
	@command -v $(PYTHON) >/dev/null || { echo "daq-app needs Python 3.11 or later: install the system package python3 (and python3-venv)."; exit 1; }
	@$(PYTHON) -c 'import sys; sys.exit(sys.version_info < (3, 11))' || { echo "daq-app needs Python 3.11 or later, and $(PYTHON) is older: install it and run 'make PYTHON=python3.11 ...'."; exit 1; }
	@$(PYTHON) -c 'import venv, ensurepip' 2>/dev/null || { echo "Python cannot make a virtual environment here: install the system package python3-venv."; exit 1; }
	@test -x $(BIN)/python || $(PYTHON) -m venv $(VENV)
	$(BIN)/python -m pip install --quiet --disable-pip-version-check -c constraints.txt -e '.[test]'
	$(BIN)/python -m compileall -q daq_app drivers sessions simulators solver
	@touch $@
