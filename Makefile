# Everything a user needs: `make demo` and `make test`. Each sets itself up.
.DEFAULT_GOAL := help
PYTHON ?= python3
VENV := .venv
BIN := $(VENV)/bin
SOURCES := servo_ctrl hil_sim local_can can_frames reconcile studies twin shipped_files
HOURS ?= 168
MINUTES ?= 60
STAMP := $(VENV)/.installed
RUNS ?= 5000
FRAMES ?= 1000000
SECONDS ?= 60
PICTURES ?= seconds
PINNED_AND_OURS := --constraint constraints.txt --editable '.[dev]'
export PIP_DISABLE_PIP_VERSION_CHECK := 1
unexport PYTHONDONTWRITEBYTECODE  # else each process of the tests compiles all its modules anew

.PHONY: true-model help setup demo test check check-fast tests tests-fast test-vcan conformance vcan-fast system pages bench bench-reconcile bench-real bench-fleet bench-hmi bench-real-time tune-random soak load mutation campaign hostile fuzz audit site tutorials test-image test-history test-fleet notebooks budget release hashes clean

help:  ## list the targets
	@grep -hE '^[a-z-]+:.*##' $(MAKEFILE_LIST) | sed 's/:.*##/\t/' | expand -t 17

setup: $(STAMP)  ## make the virtual environment from pinned dependencies

# uv takes a sixth of pip's time. It does not read pip's configuration: where it finds no package, pip installs.
# compileall takes all processors. A quarter is of use to nobody here: tests of packages, Plotly's classes, lexers, windows, what mypy has
# compiled. A file that is not for this Python is left, and what is left is compiled by who imports it.
$(STAMP): pyproject.toml constraints.txt
	@$(PYTHON) -c 'import sys; sys.exit(sys.version_info < (3, 11))' || \
	  { echo "Python 3.11 or newer is needed; name one with: make PYTHON=/path/to/python3.11"; exit 1; }
	@$(PYTHON) -m venv $(VENV) || \
	  { echo "python3 cannot make a virtual environment: install your system's python3-venv package"; exit 1; }
	$(BIN)/pip install --quiet --no-compile --constraint constraints.txt uv
	$(BIN)/uv pip install --quiet --python $(BIN)/python $(PINNED_AND_OURS) || \
	  $(BIN)/pip install --quiet --no-compile $(PINNED_AND_OURS)
	@$(BIN)/python -m compileall -qq -j 0 -x '/(tests?|pip|graph_objs|mypyc?|lexers|gui|backrefs|async_api|cuda|distutils|dataframe)/' $(VENV)/lib || true
	@$(BIN)/hil-sim compile --machine machines/xy_table & \
	  $(BIN)/servo-ctrl compile --machine machines/xy_table && wait $$!  # both sides' kernels, on two processors
	@touch $@

demo: setup  ## run the X-Y table over the embedded bus, with its page; results in out/demo
	$(BIN)/servo-ctrl demo --out out/demo

check: setup  ## ruff, mypy strict, import-linter
	$(BIN)/ruff check .
	$(BIN)/ruff format --check .
	$(BIN)/mypy
	$(BIN)/lint-imports

system:  ## install the system packages that some tests need (as root, by apt)
	@sh tests/system_packages.sh

# A file is run by one process, so its fixtures are made once; long files begin first (tests/conftest.py).
PYTEST := $(BIN)/pytest --workers auto

test:  ## all checks and every test, on the embedded bus and on real SocketCAN
	@$(MAKE) --no-print-directory --jobs 4 check tests test-vcan

check-fast:  ## lint, types, quick tests, one run over the bus, one on vcan0: two minutes
	@$(MAKE) --no-print-directory --jobs 4 check tests-fast vcan-fast

# Threads of linear algebra spin while they wait for a processor; small matrices take twice the time with them.
tests tests-fast: export OPENBLAS_NUM_THREADS := 1
tests tests-fast: export OMP_NUM_THREADS := 1

tests: setup system
	$(PYTEST)

tests-fast: setup system
	$(PYTEST) -m "not slow" tests/unit tests/conformance \
	  tests/hil/test_daemon_lockstep.py::test_program_is_run_and_recorded_from_end_to_end

test-vcan: setup system  ## the tests on real SocketCAN (vcan0 in user-mode Linux)
	$(BIN)/python tests/vcan/run_in_uml.py

conformance: setup  ## public CANopen suites twice in a row on vcan0, where installed (PATH, CANOPENDEMO=); what is not is named
	$(BIN)/python tests/vcan/run_in_uml.py -rs tests/vcan/public_suites.py tests/vcan/lely_suites.py tests/vcan/flooded_run.py

vcan-fast: setup system
	$(BIN)/python tests/vcan/run_in_uml.py tests/vcan/test_socketcan.py

site: setup  ## the documentation as a site, in out/site; warnings are errors
	@NO_MKDOCS_2_WARNING=1 $(BIN)/mkdocs build --strict

tutorials: setup  ## run all of the tutorials and every command of the pages, also what takes minutes
	@TUTORIALS=all $(PYTEST) tests/docs/test_tutorials.py tests/docs/test_commands_run.py

test-image: setup  ## build the image, bring the bench up with podman-compose (as root; minutes); writes image.json
	$(BIN)/python -m tests.campaigns.image.main --json image.json

test-history: setup  ## the record of months: a real InfluxDB (apt-get install influxdb) answers the dashboard's queries
	$(BIN)/python -m tests.campaigns.history.main

test-fleet: setup  ## reconcile fleet on Dask's scheduler, two workers, one of them killed, and an S3 server
	$(BIN)/python -m tests.campaigns.fleet.main

notebooks: setup  ## execute the notebooks of docs/notebooks (needs the publishers' data)
	@$(BIN)/python -m tests.campaigns.notebooks.main

budget: setup  ## measure what each dependency costs; writes docs/dependencies.json, then make pages
	@$(BIN)/python -m tests.campaigns.pages.dependencies

release: setup  ## wheel, sdist, site, bill of materials, licences, twice the same bytes; in out/release
	$(BIN)/python -m tests.campaigns.release.main --out out/release

hashes: setup  ## write constraints-hashes.txt: SHA-256 of every file of every pinned package (needs a registry)
	@$(BIN)/uv pip compile --quiet --no-deps --generate-hashes --universal --python-version 3.11.9 --no-annotate \
	  --no-header constraints.txt --output-file constraints-hashes.txt

audit: setup  ## ask the OSV database for advisories on the pinned packages (needs a network)
	@$(BIN)/python tests/support/advisories.py

pages: setup  ## make every generated table and page of docs/ anew from committed figures, and its pictures (PICTURES=minutes, hours)
	@$(BIN)/python -m tests.campaigns.pages.main --pictures $(PICTURES)

bench: setup  ## measure the ratios; writes bench.json
	$(BIN)/python -m tests.campaigns.bench.main --json bench.json

bench-reconcile: setup  ## reconcile beside PySINDy on concealed cases, and its time; writes bench-reconcile.json
	$(BIN)/python -m tests.campaigns.bench.reconcile_main --json bench-reconcile.json

bench-real: setup  ## reconcile and rivals on measured axes, each recording left out in turn; writes bench-real.json
	$(BIN)/python -m tests.campaigns.bench.real_main --json bench-real.json

bench-fleet: setup  ## axes a minute of reconcile fleet against workers; writes bench-fleet.json
	$(BIN)/python -m tests.campaigns.bench.fleet_main --json bench-fleet.json

bench-real-time: setup  ## ten runs of ten minutes at 1 kHz with the page in a browser (2 hours); writes bench-real-time.json
	$(BIN)/python -m tests.campaigns.bench.real_time_main --json bench-real-time.json

bench-hmi: setup  ## what the operator's bench costs the cycle, nobody looking and ten pages; writes bench-hmi.json
	$(BIN)/python -m tests.campaigns.bench.hmi_main --json bench-hmi.json

soak: setup  ## a simulated week in lockstep, an hour in real time (HOURS=, MINUTES=); writes soak.json
	$(BIN)/python -m tests.campaigns.endurance.soak_main --json soak.json --simulated-hours $(HOURS) --real-minutes $(MINUTES)

mutation: setup  ## are the tests of fault policy, drive states and limits able to fail; writes mutation.json
	$(BIN)/pip install --quiet --constraint constraints.txt --editable '.[dev,mutation]'
	$(BIN)/python -m tests.campaigns.mutation.mutation_main --json mutation.json

load: setup  ## the cycle under a full bus, full processors and a stalled disk; writes load.json
	$(BIN)/python -m tests.campaigns.endurance.load_main --json load.json

campaign: setup  ## every fault in every state, seeded (RUNS=); goes on where it was; writes campaign.json
	$(BIN)/python -m tests.campaigns.campaign.main --runs $(RUNS) --json campaign.json

tune-random: setup  ## random axes measured, tuned for Ms 2 and measured again, in the batch twin
	$(BIN)/python -m tests.campaigns.tuning.main

true-model: setup  ## every program of every machine and of random ones, against their own plants; writes true-model.json
	$(BIN)/python -m tests.campaigns.true_model.main --json true-model.json

hostile: setup  ## hostile frames at controller, simulator and bus, seeded (FRAMES=); writes hostile.json
	$(BIN)/python -m tests.campaigns.hostile.main --frames $(FRAMES) --json hostile.json

fuzz: setup  ## coverage-guided fuzzing of every parser, so many seconds each (SECONDS=); writes fuzz.json
	$(BIN)/python -m tests.campaigns.hostile.fuzz --seconds $(SECONDS) --json fuzz.json

clean:  ## remove the environment and everything that was made
	rm -rf $(VENV) out bench.json bench-reconcile.json bench-real.json bench-fleet.json bench-hmi.json bench-real-time.json campaign.json soak.json load.json mutation.json hostile.json fuzz.json image.json true-model.json .pytest_cache .mypy_cache .ruff_cache .import_linter_cache
