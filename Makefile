# `make fly` and `make test` are all that a fresh machine with Python 3.11+ needs; everything lands in .venv.
PYTHON ?= python3
VENV := .venv
BIN := $(VENV)/bin
PIP := $(BIN)/python -m pip --disable-pip-version-check

.DEFAULT_GOAL := help
.PHONY: help fly test lint bench campaign clean

help: ## this list
	@grep -hE '^[a-z]+:.*## ' $(MAKEFILE_LIST) | sed 's/:.*## /\t/' | sort

fly: $(VENV)/.flying ## set up and fly a mission in the simulator, in real time, ending with the review page
	$(BIN)/lcd-fly missions/four_waypoints.yaml

test: $(VENV)/.developing ## set up and pass the tests
	$(BIN)/python -m pytest -m "not realtime" -n logical --maxprocesses 4 --dist loadfile
	$(BIN)/python -m pytest -m realtime

lint: $(VENV)/.developing ## style, types and import contracts
	$(BIN)/ruff check .
	$(BIN)/ruff format --check .
	$(BIN)/mypy
	$(BIN)/lint-imports

bench: $(VENV)/.benching ## measure against the peers, which this installs, and write BENCHMARKS.md; one alone: NAME=rollouts
	$(if $(NAME),$(BIN)/lcd bench $(NAME),$(BIN)/python -m benchmarks.report)

campaign: $(VENV)/.developing ## long comparisons; dated results land in docs/campaigns
	$(BIN)/python -m benchmarks.campaign

clean: ## remove what can be made again (not flights/ and data/)
	rm -rf $(VENV) build dist .mypy_cache .ruff_cache .pytest_cache .hypothesis .import_linter_cache

$(VENV)/.created:
	$(PYTHON) -c 'import sys; sys.exit(0 if sys.version_info >= (3, 11) else "Python 3.11 or newer is needed: make PYTHON=/path/to/python3.11 ...")'
	$(PYTHON) -m venv $(VENV)
	touch $@

# Downloads are shown by pip itself. The stamps depend on what decides the set-up, so a second call costs nothing.
$(VENV)/.flying: $(VENV)/.created pyproject.toml constraints.txt
	@echo "setting up $(VENV) (first time: one to two minutes of downloads)"
	$(PIP) install --quiet --progress-bar on -c constraints.txt -e .
	touch $@

$(VENV)/.developing: $(VENV)/.flying
	@echo "adding what the tests need (PyTorch is large)"
	$(PIP) install --quiet --progress-bar on -c constraints.txt -e '.[dev]'
	touch $@

$(VENV)/.benching: $(VENV)/.flying
	$(PIP) install --quiet --progress-bar on -c constraints.txt -e '.[bench,jaxopt]'
	touch $@
