# fireworld: `make demo` shows it (and installs no more than that), `make check` checks it within a minute, `make test` within ten, `make heavy` the rest.
# Needs Python 3.11 or newer, and pip.
PYTHON ?= python3
WORKERS ?= 2
FUZZ_SECONDS ?= 60
FAULT_SECONDS ?= 600
FAULT_SEED ?= 1
BIN := .venv/bin
DEMO := recordings/demo
PICTURE := recordings/picture-
export PIP_DISABLE_PIP_VERSION_CHECK := 1

.DELETE_ON_ERROR:
.PHONY: help install demo check test heavy static check-format check-lint check-types check-imports check-tests format docs site oldest pictures fuzz faults bench check-teams clean

help:  ## List these targets.
	@awk -F ':.*## ' '/^[a-z-]+:.*## / { printf "  make %-14s %s\n", $$1, $$2 }' $(MAKEFILE_LIST)

install: .venv/.installed  ## Make .venv with everything in it, and nothing else.

# What a demonstration shows: fireworld and the viewer. The stamps are written last, so that half an installation does not
# count, and are renewed when the requirements change. A Python without ensurepip (Debian keeps it in a package of its own)
# lends its own pip to the new environment.
.venv/.demo: pyproject.toml constraints.txt
	@echo "Installing fireworld and its viewer, Rerun, into .venv, once: 310 MB are downloaded, 1.1 GB of disk are taken."
	@echo "That takes half a minute on a fast line, five minutes on one of 10 Mbit/s; nothing is shown meanwhile."
	@$(PYTHON) -m venv .venv || { $(PYTHON) -m venv --without-pip .venv && $(PYTHON) -m pip --python $(BIN)/python install --quiet pip; }
	@PIP_CONSTRAINT=constraints.txt $(BIN)/python -m pip install --quiet --editable '.[view]'
	@touch $@

.venv/.installed: .venv/.demo
	@echo "Installing what develops and tests fireworld, once: another 150 MB are downloaded, .6 GB of disk are taken."
	@PIP_CONSTRAINT=constraints.txt $(BIN)/python -m pip install --quiet --editable '.[view,figures,gym,minari,dask,dev]'
	@touch $@

# No file is a target here: a recording is made anew each time, and half a one never counts as made.
demo: .venv/.demo  ## Run the default scenario, record it, verify the recording, save it for Rerun and as a page that plays.
	@echo "A fire in a city of 624 buildings, and a team of four brigades that learned to put it out. It takes five seconds,"
	@echo "fifteen more the first time, when the simulator is compiled."
	@mkdir -p recordings
	$(BIN)/fireworld run default --record $(DEMO).mcap --force
	$(BIN)/fireworld verify $(DEMO).mcap
	$(BIN)/fireworld view $(DEMO).mcap --save $(DEMO).rrd --force
	$(BIN)/fireworld play $(DEMO).mcap -o $(DEMO).html --force
	@echo
	@echo "$(DEMO).mcap   the recording: every step, every decision and its reason"
	@echo "$(DEMO).html   the same as a page that plays, in any browser"
	@echo "$(DEMO).rrd    the same for Rerun, in three dimensions"
	@echo
	@echo "Next:"
	@echo "  look at it             $(BIN)/fireworld view $(DEMO).mcap, or open the page"
	@echo "  see another team fail  $(BIN)/fireworld run test-1 --policy easiest"
	@echo "  write a team           docs/tutorial-policy.md"

# While you work: a minute on two cores, once the kernels and the types are cached.
check: static  ## Check format, lint, types and imports, and run the tests that are not slow.
	$(BIN)/python -m pytest --numprocesses $(WORKERS) -m "not slow"

# Ten minutes on two cores.
test: static check-tests  ## The same with slow tests, but for the heavy ones.

# Another ten.
heavy: install  ## Run the heavy tests: pages of the docs, browsers, compilations, installed packages, whole studies.
	$(BIN)/python -m pytest --numprocesses $(WORKERS) -m heavy $(PYTEST)

static: check-format check-lint check-types check-imports  ## Check everything but the tests.

check-format: install  ## Check that the code is formatted.
	$(BIN)/ruff format --check .

check-lint: install  ## Run the linter.
	$(BIN)/ruff check .

check-types: install  ## Run mypy --strict.
	$(BIN)/mypy

check-imports: install  ## Check that imports go down only.
	$(BIN)/lint-imports

check-tests: install  ## Run all tests but the heavy ones; PYTEST=... are further options of pytest.
	$(BIN)/python -m pytest --numprocesses $(WORKERS) -m "not heavy" $(PYTEST)

# The lowest versions that pyproject.toml allows. Pages of the docs are as the newest libraries write them; of what is slow,
# only what leans on libraries.
oldest: .venv-oldest/.installed  ## Run the tests of everything but docs and packages with the oldest libraries, in a .venv-oldest.
	.venv-oldest/bin/python -m pytest --numprocesses $(WORKERS) -m "not slow or libraries" --ignore tests/docs --ignore tests/installed $(PYTEST)

.venv-oldest/.installed: pyproject.toml constraints-oldest.txt
	$(PYTHON) -m venv .venv-oldest
	PIP_CONSTRAINT=constraints-oldest.txt .venv-oldest/bin/python -m pip install --quiet --editable '.[view,film,osm,onnx,archive,gym,minari,dask]' \
		hypothesis import-linter protobuf pytest pytest-xdist scipy
	touch $@

format: install  ## Format the code and fix what the linter can fix.
	$(BIN)/ruff format .
	$(BIN)/ruff check --fix .

docs: install  ## Renew what is made from the code in docs/, and what the commands in the pages print.
	$(BIN)/python -m tests.docs.log_format
	$(BIN)/python -m tests.docs.foxglove_schema
	$(BIN)/python -m tests.docs.scenario_reference
	$(BIN)/python -m tests.docs.contested_table
	$(BIN)/python -m tests.docs.suites_table
	$(BIN)/python -m tests.docs.cli_reference
	$(BIN)/python -m tests.docs.readings_result
	$(BIN)/python -m tests.docs.blocks --renew

site: .venv/.site  ## Make docs/ a web site that needs no network, reports/site.
	PYTHONPATH=. NO_MKDOCS_2_WARNING=1 $(BIN)/python -m mkdocs build --strict --quiet
	@echo "open reports/site/index.html"

.venv/.site: .venv/.demo
	@echo "Installing what makes the site, once: another 30 MB are downloaded, 120 MB of disk are taken."
	@PIP_CONSTRAINT=constraints.txt $(BIN)/python -m pip install --quiet --editable '.[view,docs]'
	@touch $@

pictures: install  ## Draw the pictures of the docs again, from runs made again.
	mkdir -p docs/pictures recordings
	$(BIN)/fireworld run default --policy chief --seed 1 --record $(PICTURE)default.mcap --force
	$(BIN)/fireworld run test-1 --policy paper-noncooperative --seed 1 --record $(PICTURE)alone.mcap --force
	$(BIN)/fireworld run test-1 --policy paper-cooperative --seed 1 --record $(PICTURE)together.mcap --force
	$(BIN)/fireworld render $(PICTURE)default.mcap -o docs/pictures/still.png --step 38 --force
	$(BIN)/fireworld render $(PICTURE)default.mcap -o docs/pictures/strip.png --steps 0,30,60,last --force
	$(BIN)/fireworld render $(PICTURE)default.mcap -o docs/pictures/film.gif --force
	$(BIN)/fireworld render $(PICTURE)alone.mcap $(PICTURE)together.mcap -o docs/pictures/pair.png --step 60 --force
	$(BIN)/fireworld render $(PICTURE)alone.mcap $(PICTURE)together.mcap -o docs/pictures/before-after.png --steps 0,last --force
	$(BIN)/python -m tests.viewer.headless
	$(BIN)/python -m tests.viewer.play_picture
	$(BIN)/fireworld train paper --seed 1 -o $(PICTURE)training.npz --record $(PICTURE)training.mcap --force
	$(BIN)/fireworld render $(PICTURE)training.mcap -o docs/pictures/training.png --force

fuzz: install  ## Try odd and altered files on all readers for FUZZ_SECONDS (60), and as long with atheris where it installs.
	$(BIN)/python -m tests.fuzz --seconds $(FUZZ_SECONDS)
	if PIP_CONSTRAINT=constraints.txt $(BIN)/python -m pip install --quiet --editable '.[fuzz]'; \
	then $(BIN)/python -m tests.fuzz.with_atheris --seconds $(FUZZ_SECONDS); \
	else echo "atheris does not install here: done without it"; fi

# What is finished is kept in reports/faults; a second call continues after it, unless the code has changed.
faults: install  ## Try faults of every kind for FAULT_SECONDS (600): kills, full disks, damaged logs, odd policies, ...
	$(BIN)/python -m tests.faults.campaign --seconds $(FAULT_SECONDS) --seed $(FAULT_SEED) --resume $(if $(FAULT_KINDS),--only $(FAULT_KINDS))

bench: install  ## Measure speed against baselines; with AGAINST=COMMIT, this tree against that commit.
	$(BIN)/python -m benchmarks.$(if $(AGAINST),against $(AGAINST),bench)

check-teams: install  ## Train the teams that come with fireworld again, for more than an hour; they must be the same.
	$(BIN)/python -m benchmarks.shipped

clean:  ## Remove what the other targets made, .venv too.
	rm -rf .venv .venv-oldest .mypy_cache .ruff_cache .pytest_cache .hypothesis .import_linter_cache dist build reports
	rm -f $(DEMO).mcap $(DEMO).mcap.partial $(DEMO).rrd $(DEMO).html $(PICTURE)*.mcap
	find . -name __pycache__ -type d -prune -exec rm -rf {} +
