.PHONY: help demo lint check test bags thesis benchmark benchmark-effects benchmark-second benchmark-outside benchmark-coverage chaos endurance fuzz mutants clean

help: # what there is to make
	@sed -n 's/^\([a-z-]*\):.*# /make \1	/p' Makefile

demo: # a crash replayed, what its model lacks named, added and shown in Rerun; of your own with RECORDING=path, WITH=path, MODEL=file
	@[ -n "$$DISPLAY$$WAYLAND_DISPLAY" ] || { tools/setup && tools/screenshot-libs; }
	@tools/run crash_estimator demo $(if $(RECORDING),--recording "$(RECORDING)") $(if $(WITH),--with "$(WITH)") $(if $(MODEL),--model "$(MODEL)")

# Without autoload: the plugins of an installed ROS 2 are written for an older pytest.
PYTEST = PYTEST_DISABLE_PLUGIN_AUTOLOAD=1 tools/env python -m pytest -p _hypothesis_pytestplugin -p xdist.plugin

# One that is lost, as by the time limit of pyproject.toml, ends the run with the test's name: xdist would wait for ever
# for what another one in its place has not been told of.
TWO = -n 2 --dist loadfile --no-loadscope-reorder --max-worker-restart 0

lint: # style and types: ruff and mypy with the settings of pyproject.toml
	@tools/env python -m ruff check --quiet .
	@tools/env python -m ruff format --check --quiet .
	@tools/env python -m mypy

# What `check` looks at: of these folders the files that start nothing, and of the core some that hardly simulate, which
# is what takes the time elsewhere.
CHECKED = $(patsubst %,tests/core/test_%.py,discretize effects estimators factors model_file motion_and_contact rating) \
	tests/replay tests/viewer tests/nodes tests/commands/test_demo_story.py \
	tests/commands/test_diagnose_command.py tests/project/test_architecture.py tests/project/test_package_xml.py

check: lint # for every save: style, types, and the tests that need no ROS graph, no other process and little time
	@$(PYTEST) $(TWO) -q --no-graph $(CHECKED)

# A file's tests are run by one of two processes, the longest files first (tests/conftest.py); -n 0 in PYTEST_ARGS: all
# by one. What is compiled is so once, before.
test: lint # all tests, style and types first; some of them with PYTEST_ARGS="-k name"
	@tools/screenshot-libs
	@tools/env python -m crash_estimator.warm_up
	@$(PYTEST) $(TWO) $(PYTEST_ARGS)

bags: # the simulated recordings in bags/, made anew
	@tools/run crash_replay synthesize --all --to bags

thesis: # the thesis's experiments run again: docs/thesis.md; with measured tests in DATA=FOLDER, which do not come with the project
	@tools/env python -m crash_estimator.thesis $(if $(DATA),--data "$(DATA)")

benchmark: # every promised speed beside its reference, 8 minutes: docs/benchmark.md; ARGS="--quick" writes out/benchmark.md
	@tools/setup
	@.venv/bin/pip install -q --no-deps --no-build-isolation -r tools/benchmark-requirements.txt || true
	@tools/env python -m crash_estimator.benchmarks.speed $(ARGS)

benchmark-effects: # which hidden effects are found, on 1500 simulated tests: docs/missing-effects.md; ARGS="--cases 20" writes out/missing-effects.md
	@tools/env python -m crash_estimator.benchmarks.effects $(ARGS)

benchmark-second: # the same on 300 tests of a second simulator: docs/second-generator.md; ARGS="--cases 20 --seed 71000000" writes to out/
	@tools/env python -m crash_estimator.benchmarks.second $(ARGS)

benchmark-outside: # what is said of recordings made elsewhere, in DATA=FOLDER, which do not come with the project: docs/outside.md
	@tools/env python -m crash_estimator.benchmarks.outside --data "$(DATA)"

benchmark-coverage: # whether the stated sigmas hold, 40 seeds of five models, an hour: docs/coverage.md; ARGS="--seeds 8 --to out/coverage.md"
	@tools/env python -m crash_estimator.benchmarks.coverage_page $(ARGS)

chaos: # processes killed, stopped and started again on purpose, 200 runs: docs/chaos.md; ARGS="--runs 20", --seed, --only, --case
	@tools/env python -m crash_estimator.chaos $(ARGS)

endurance: # a million samples through every method, 500 tests and 500 passes through every node: docs/endurance.md
	@tools/env python -m crash_estimator.endurance $(ARGS)

fuzz: # 20 000 wrong inputs on every way in: docs/fuzz.md; ARGS="--seed 2", or "--replay out/fuzz/FILE" for one that failed
	@tools/env python -m crash_estimator.fuzz.command $(ARGS)

mutants: # what share of 200 one-line mistakes the tests catch: docs/mutants.md; ARGS="--seed 2", --mutants, --only core/estimators, --minutes, --again for those not caught
	@tools/env python tools/mutants.py $(ARGS)

clean: # removes what the set-up installed and built, and what the programs wrote
	rm -rf .venv .setup out ros2_ws/build ros2_ws/install ros2_ws/log
