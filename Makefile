# Every target does its own set-up: a virtual environment in .venv, and the install into it.
PYTHON ?= python3
VENV := .venv
BIN := $(VENV)/bin
STAMP := $(VENV)/.installed
EXAMPLE := plugins/examples/solidsph-wendland

# Tests in a browser need Debian's chromium and chromium-driver, which .ci/run installs.
BROWSER := /usr/bin/chromium /usr/bin/chromedriver
WITHOUT := $(filter-out $(wildcard $(BROWSER)),$(BROWSER))

# Two processes, each with whole files: the loops that the tests of a file share compile once. The
# order of the files is that of tests/conftest.py.
TWO := -n 2 --dist loadfile --no-loadscope-reorder

# Some hundred processes import the package: each would compile its modules anew.
unexport PYTHONDONTWRITEBYTECODE

SPHINX := $(BIN)/sphinx-build --quiet
DOCS_STAMP := $(VENV)/.docs
BENCH_STAMP := $(VENV)/.bench

.PHONY: demo test validate bare gallery frontiers bench bench-page docs docs-links lint format clean

demo: $(STAMP)  ## the paper's headline experiment: table, record and picture
	$(BIN)/solidsph run tensile-instability

test: $(STAMP) lint  ## lint, types and every test but the slow physics
	$(if $(WITHOUT),@echo "no $(WITHOUT): tests in a browser are left out; apt-get install chromium chromium-driver")
	$(BIN)/pytest $(TWO) -m "not validation$(if $(WITHOUT), and not browser)"

validate: $(STAMP) docs  ## the slow physics, every combination, many more examples, the built site
	$(BIN)/pytest $(TWO) -m "validation or examples" --hypothesis-profile thorough -rP

bare: $(STAMP)  ## scenes that name nothing of the scheme: their errors as a table, and plots over spacing
	$(BIN)/python -m tests.bare results/bare

bench: $(BENCH_STAMP)  ## against a plain C loop, whole steps, memory, throughput along every axis, the updated form, every effect, finite elements, LAMMPS
	$(BIN)/python benchmarks/bench.py
	$(BIN)/python benchmarks/moving.py
	$(BIN)/python benchmarks/effects.py
	$(BIN)/python benchmarks/finite_elements.py
	$(BIN)/python benchmarks/beside_lammps.py
	$(BIN)/python benchmarks/meshed_parts.py

bench-page: $(STAMP)  ## the same, written to the documentation
	$(BIN)/python benchmarks/bench.py --write docs/benchmarks.md

gallery: $(STAMP)  ## the figures of the paper, written to the documentation
	$(BIN)/solidsph reproduce --page docs/gallery.md

frontiers: $(STAMP)  ## error against time of the documented cases, written to the documentation
	$(BIN)/python benchmarks/frontiers.py --write docs/what-accuracy-costs.md

docs: $(DOCS_STAMP)  ## the documentation as a site, in build/site; runs the tutorials
	$(SPHINX) -W --keep-going -E -b html docs build/site
	@echo "open build/site/index.html"

docs-links: $(DOCS_STAMP)  ## whether links to other sites lead somewhere
	$(SPHINX) -b linkcheck -D nb_execution_mode=off docs build/links

lint: $(STAMP)
	$(BIN)/ruff check .
	$(BIN)/ruff format --check .
	MYPY_NUM_WORKERS=2 $(BIN)/mypy

format: $(STAMP)
	$(BIN)/ruff check --fix .
	$(BIN)/ruff format .

# Entry points are read from the installed metadata, so a changed pyproject means a new install.
$(STAMP): pyproject.toml $(EXAMPLE)/pyproject.toml
	test -x $(BIN)/python || $(PYTHON) -m venv $(VENV)
	$(BIN)/python -c "import sys; sys.exit(sys.version_info < (3, 11))" || \
		{ echo "Python 3.11 or newer is needed; run: make PYTHON=python3.11 (after rm -r $(VENV))"; exit 1; }
	$(BIN)/python -m pip install --quiet --editable ".[test,dev]"
	$(BIN)/python -m pip install --quiet --editable $(EXAMPLE)
	touch $(STAMP)

$(BENCH_STAMP): $(STAMP)
	$(BIN)/python -m pip install --quiet --editable ".[bench]"
	touch $(BENCH_STAMP)

$(DOCS_STAMP): $(STAMP)
	$(BIN)/python -m pip install --quiet --editable ".[docs]"
	touch $(DOCS_STAMP)

clean:
	rm -rf $(VENV) build dist .mypy_cache .ruff_cache .pytest_cache .hypothesis
