# Everything needs only make and python3 (3.11 or newer): the rest goes into .venv. `make` alone prints the list.
# A stamp file says that .venv is up to date; it is older than pyproject.toml or constraints.txt when it is not.
.DEFAULT_GOAL := help
.PHONY: help run test slow faults mutants torture stress check types lint docs docs-check format coverage pictures weights catalogue corpus constraints clean wheel

# Tests start many processes; without byte code each of them would compile a thousand modules again.
unexport PYTHONDONTWRITEBYTECODE

PYTHON ?= python3
VENV := .venv
BIN := $(VENV)/bin
# --no-compile halves the time: Python compiles what it imports, when it does.
PIP_INSTALL := $(BIN)/pip install --quiet --no-compile --disable-pip-version-check -c constraints.txt

help: ## Print this list
	@awk -F ':.*## ' '/^[a-z]+:.*## / { printf "  make %-12s %s\n", $$1, $$2 }' $(MAKEFILE_LIST)

run: $(VENV)/.installed ## Install, migrate, start the web pages and a worker, open the browser
	@$(BIN)/parenting up

# The tests run after a failed check too, so that one run tells everything. The documentation is checked beside them:
# they wait for pages and processes now and then.
test: $(VENV)/.installed-dev ## Install, then run every check and the tests of every run (ARGS="-k queue" for some)
	@checks=passed; start=$$(date +%s); $(MAKE) --no-print-directory --keep-going types lint || checks=failed; \
	middle=$$(date +%s); mkdir -p build; $(MAKE) --no-print-directory docs-check > build/docs-check.log 2>&1 & docs=$$!; \
	tests=passed; $(BIN)/pytest -m "not postgresql and not faults and not slow" $(ARGS) || tests=failed; \
	wait $$docs || { checks=failed; cat build/docs-check.log; }; end=$$(date +%s); \
	echo "checks: $$checks, $$((middle - start)) s before the tests; tests: $$tests in $$((end - middle)) s"; \
	test $$checks = passed && test $$tests = passed

faults: $(VENV)/.installed-dev ## Kills, power cuts, refusing stores, races, sabotage (10 minutes; ARGS for some)
	scripts/faults $(ARGS)

mutants: $(VENV)/.installed-dev ## Plant faults one by one; each must be caught by its test (10 minutes, nightly)
	$(BIN)/python -m scripts.mutants $(ARGS)

slow: $(VENV)/.installed-dev ## The tests that are too long for every run, on both stores (30 minutes; ARGS for some)
	$(BIN)/pytest -m slow tests tests/faults $(ARGS)
	$(MAKE) --no-print-directory docs

torture: $(VENV)/.installed-dev ## Those of `make slow`, tests of two lengths at their long one (hours), all sabotaged servers
	PARENTING_TORTURE=1 $(BIN)/pytest -m "torture or slow" tests tests/faults $(ARGS)
	$(BIN)/python -m scripts.mutants --sabotage

stress: $(VENV)/.installed-dev ## Every test, ten times over, with both cores busy (needs stress; ARGS for some)
	scripts/stress $(ARGS)

check: $(VENV)/.installed-dev ## Lint, formatting, types, layers, documentation
	@$(MAKE) --no-print-directory --jobs=2 --keep-going --output-sync=target types docs-check lint

types: $(VENV)/.installed-dev
	$(BIN)/mypy --num-workers 2

lint: $(VENV)/.installed-dev
	$(BIN)/ruff check .
	$(BIN)/ruff format --check .
	$(BIN)/lint-imports --no-logo

format: $(VENV)/.installed-dev ## Format the code and mend what lint can mend
	$(BIN)/ruff check --fix .
	$(BIN)/ruff format .

coverage: $(VENV)/.installed-dev ## Run the tests and print the lines that none of them reached
	$(BIN)/pytest --cov --cov-report=term-missing:skip-covered $(ARGS)

pictures: $(VENV)/.installed-dev ## Draw the pictures of the documentation again (needs Chromium)
	$(BIN)/parenting worlds --draw docs/pictures > /dev/null
	$(BIN)/python scripts/pictures.py
	$(BIN)/python scripts/screenshots.py

docs: $(VENV)/.installed-dev ## Build the documentation as a site in build/docs; a warning is an error
	$(BIN)/sphinx-build --fail-on-warning --quiet -b html docs build/docs
	$(BIN)/python scripts/offline.py build/docs

# It resolves every reference, writes no page and reads no default as its source has it: that takes half of the time.
docs-check: $(VENV)/.installed-dev
	$(BIN)/sphinx-build --fail-on-warning --quiet -b dummy -D autodoc_preserve_defaults=0 docs build/docs-check

weights: $(VENV)/.installed ## Pre-train the weights of the built-in levels again (20 minutes)
	$(BIN)/parenting pretrain --out weights --force

catalogue: $(VENV)/.installed-dev ## Collect the sentences of the parent's pages (web/languages), compile translations
	$(BIN)/python -m scripts.catalogue

corpus: $(VENV)/.installed-dev ## Write data of this version into tests/old, for the tests of later ones (once a release)
	ATEN_CPU_CAPABILITY=default $(BIN)/python -m scripts.corpus make

wheel: $(VENV)/.installed-dev ## Build the wheel of this version into dist/
	$(BIN)/pip wheel --quiet --disable-pip-version-check --no-deps --no-build-isolation --wheel-dir dist .

# torch stays at the version that constraints.txt names: a newer one may pull gigabytes. TORCH=... changes it.
TORCH = $(shell sed -n 's/^torch==//p' constraints.txt)
LOCK := build/constraints
constraints: ## Resolve all dependencies again and write constraints.txt
	rm -rf $(LOCK)
	$(PYTHON) -m venv $(LOCK)
	$(LOCK)/bin/pip install --quiet --no-compile --disable-pip-version-check "torch==$(TORCH)" '.[dev]'
	$(LOCK)/bin/pip freeze --all --exclude parenting --exclude pip > $(LOCK)/freeze
	{ sed '/^[^#]/,$$d' constraints.txt; sed 's/+[a-z0-9.]*$$//' $(LOCK)/freeze; } > $(LOCK)/constraints.txt
	mv $(LOCK)/constraints.txt constraints.txt

clean: ## Remove the environment and everything built (your databases stay)
	rm -rf $(VENV) build dist *.egg-info .mypy_cache .ruff_cache .pytest_cache .hypothesis .import_linter_cache .coverage
	find . -name __pycache__ -type d -prune -exec rm -rf {} +

$(VENV)/.installed: pyproject.toml constraints.txt | $(BIN)/pip
	@echo "Installing into $(VENV), once: about a minute."
	@$(PIP_INSTALL) -e .
	@touch $@

$(VENV)/.installed-dev: pyproject.toml constraints.txt | $(BIN)/pip
	@echo "Installing into $(VENV) with the tools for development, once: about two minutes."
	@$(PIP_INSTALL) -e '.[dev]'
	@touch $@ $(VENV)/.installed

# pip is the last thing that venv installs: where it is, the environment is whole.
$(BIN)/pip:
	@command -v $(PYTHON) >/dev/null 2>&1 || { \
	  echo "$(PYTHON) is not installed. Install Python 3.11 or newer (Debian, Ubuntu: apt install python3 python3-venv)." >&2; exit 1; }
	@$(PYTHON) -c 'import sys; sys.exit(sys.version_info < (3, 11))' || { \
	  echo "$(PYTHON) is older than 3.11. Name a newer one: make $(MAKECMDGOALS) PYTHON=python3.12" >&2; exit 1; }
	@$(PYTHON) -c 'import ensurepip, venv' 2>/dev/null || { \
	  echo "$(PYTHON) cannot make an environment: venv is missing (Debian, Ubuntu: apt install python3-venv)." >&2; exit 1; }
	@$(PYTHON) -m venv --clear $(VENV)
