# Requires Python >= 3.11, make and git. Each target creates the environment it uses.
PYTHON ?= python3
VENV := .venv
SOURCES := service:converters:schemas:compiled
FUZZ_SECONDS ?= 120
BIN := $(VENV)/bin
# Modules are compiled when they are imported.
PIP = $(BIN)/pip install --quiet --disable-pip-version-check --no-compile
RUNNABLE := $(VENV)/.runnable
INSTALLED := $(VENV)/.installed
READY := $(VENV)/.ready
# What one process compiled, others load: a test run starts hundreds.
export PYTHONDONTWRITEBYTECODE :=

.PHONY: help install test pytest unit fuzz simulate-faults lint types contracts kernels collection check docs docs-check demo demo-cluster page bench dist audit kernel-list lock clean

help: ## Show the targets
	@grep -hE '^[a-z-]+:.*## ' $(MAKEFILE_LIST) | sed 's/:.*## /\t/' | expand -t 14

install: $(INSTALLED) ## Create .venv with the pinned versions, and compile the kernels
	$(BIN)/multiradar warm-up
	# Commands start slowly without it where Python may not write bytecode.
	$(BIN)/python -m compileall -q -q -j 0 $(VENV)/lib

# What commands need comes first: with it kernels compile while the rest is installed.
$(RUNNABLE): requirements/run.txt
	$(PYTHON) -m venv $(VENV)
	$(PIP) --require-hashes --requirement requirements/run.txt
	@touch $@

$(INSTALLED): $(RUNNABLE) requirements/build.txt pyproject.toml
	$(PIP) --require-hashes --requirement requirements/build.txt
	$(PIP) --no-deps --no-build-isolation --editable .
	@touch $@

# Users need no tools for development, whose installation takes as long as all the rest.
$(READY): $(INSTALLED) requirements/dev.txt
	$(PIP) --require-hashes --requirement requirements/dev.txt
	@touch $@

lint: $(READY) ## Check style
	$(BIN)/ruff check .
	$(BIN)/ruff format --check .

types: $(READY) ## Check types, strictly, tests included
	$(BIN)/mypy service converters schemas compiled tests validation

contracts: $(READY) ## Check the import contracts
	$(BIN)/lint-imports

check: lint types contracts ## Run all checks except the tests

kernels: $(RUNNABLE) ## Compile the kernels of all commands and studies
	PYTHONPATH=$(SOURCES) $(BIN)/python -m multiradar warm-up --all

# What pytest makes of the tests is compiled here once, not in each of its processes; it reports
# errors itself.
collection: $(READY)
	@$(BIN)/pytest --collect-only -qq >/dev/null || true

# Many tests wait; the checks run meanwhile.
test: ## Lint, types, import contracts and all tests
	$(MAKE) --jobs kernels collection
	$(MAKE) --jobs check pytest

pytest: $(READY)
	$(BIN)/pytest -n 3 --dist worksteal

unit: $(READY) ## Run the unit tests except slow ones
	$(BIN)/pytest -n 2 --dist worksteal -m "not slow" tests/unit

docs-check: $(READY) ## Compare the documents with program output (an hour); DOCS_OPTIONS=--write updates them
	$(BIN)/python -m validation.documents.check_documents $(DOCS_OPTIONS)

fuzz: $(READY) ## Run all property tests with new random examples (FUZZ_SECONDS=120 FUZZ_SEED=)
	cd tests && ../$(BIN)/python -m support.fuzzing --seconds $(FUZZ_SECONDS) $(if $(FUZZ_SEED),--seed $(FUZZ_SEED))

simulate-faults: $(READY) ## Simulate the service under faults (SIMULATE_OPTIONS="--runs 1000 --seed 0")
	cd tests && POLARS_MAX_THREADS=1 ../$(BIN)/python -m support.simulation $(SIMULATE_OPTIONS)

demo: $(INSTALLED) ## Convert the sample, serve and replay it, show tracks and biases
	$(BIN)/multiradar demo $(DEMO_OPTIONS)

$(VENV)/.cluster: $(READY) requirements/cluster.txt
	$(PIP) --require-hashes --requirement requirements/cluster.txt
	@touch $@

demo-cluster: $(VENV)/.cluster ## Serve the sample with shards on Ray in a network namespace, kill one, compare the output
	$(BIN)/python -m validation.service.demo_cluster $(DEMO_OPTIONS)

page: ## Build the page of the air picture (needs Node.js 20); the result is committed
	cd page && npm ci --no-audit --no-fund && npm run types && npm run build

$(VENV)/.docs: $(READY) requirements/docs.txt
	$(PIP) --require-hashes --requirement requirements/docs.txt
	@touch $@

docs: $(VENV)/.docs ## Build the site of the documents in build/site; warnings and broken links are errors
	$(BIN)/python -m validation.documents.make_reference docs/reference
	$(BIN)/sphinx-build --fail-on-warning --keep-going --quiet docs build/site

$(VENV)/.dist: $(READY) requirements/dist.txt
	$(PIP) --require-hashes --requirement requirements/dist.txt
	@touch $@

dist: $(VENV)/.dist ## Build wheel, sdist, SBOM and a wheelhouse for installation offline into dist
	rm -rf dist
	$(BIN)/hatchling build -d dist
	$(BIN)/cyclonedx-py requirements requirements/run.txt --pyproject pyproject.toml --output-reproducible --output-file dist/multiradar.cdx.json
	$(BIN)/pip download --quiet --require-hashes --requirement requirements/run.txt --dest dist/wheelhouse

$(VENV)/.audit: $(RUNNABLE) requirements/audit.txt
	$(PIP) --require-hashes --requirement requirements/audit.txt
	@touch $@

# Each file by itself: some pin different versions of a package. Nothing of them is installed.
audit: $(VENV)/.audit ## Look up known vulnerabilities of all pinned versions (needs the network)
	@status=0; for pins in requirements/*.txt; do \
	  echo "$$pins"; \
	  $(BIN)/pip-audit --strict --disable-pip --require-hashes --requirement "$$pins" || status=1; \
	done; exit $$status

$(VENV)/.bench: $(READY) requirements/bench.txt
	$(PIP) --require-hashes --no-build-isolation --requirement requirements/bench.txt
	@touch $@

bench: $(VENV)/.bench ## Benchmark against other packages; prints ratios and writes benchmark.json
	cd tests && ../$(BIN)/python -m benchmark --out ../benchmark.json $(BENCH_OPTIONS)

kernel-list: $(READY) ## Update the list of kernels of each command; --check compares
	cd tests && ../$(BIN)/python -m support.kernel_list $(KERNEL_LIST_OPTIONS)

lock: ## Update all pinned versions (needs uv); those of dev hold everywhere
	for use in dev run build bench cluster traces docs dist audit; do \
	  uv pip compile --universal --generate-hashes --python-version 3.11 --no-emit-index-url --no-header \
	    $$([ $$use = run ] || echo --extra $$use) $$([ $$use = dev ] || echo --constraint requirements/dev.txt) \
	    pyproject.toml -o requirements/$$use.txt; \
	done

clean: ## Remove generated files
	rm -rf $(VENV) build dist .mypy_cache .pytest_cache .ruff_cache .import_linter_cache
