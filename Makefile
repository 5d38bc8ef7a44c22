# fireworld: `make demo` shows it, `make test` checks all of it. Needs Python 3.11 or newer, and pip.
PYTHON ?= python3
BIN := .venv/bin
export PIP_DISABLE_PIP_VERSION_CHECK := 1
export RERUN_ANALYTICS_ENABLED := 0

.PHONY: install

install: .venv/.installed

.venv/.installed: pyproject.toml constraints.txt
	$(PYTHON) -m venv .venv
	PIP_CONSTRAINT=constraints.txt $(BIN)/python -m pip install --quiet --editable '.[view,figures,dev]'
	touch $@
