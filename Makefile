# Everything on a fresh Debian 12 with git and make: `make demo` and `make test` install what is missing, set up .venv,
# build, and run. Stamps under build/stamps remember what is done, so a second run only does what changed.
SHELL := /bin/bash
.SHELLFLAGS := -euo pipefail -c
.DELETE_ON_ERROR:
.NOTPARALLEL: # demo and test install into one .venv
.DEFAULT_GOAL := help

stamps := build/stamps
python := .venv/bin/python
# What a step prints goes into this log; it is shown when the step fails.
log := build/setup.log
quietly := cmake/quietly.sh $(log)
pip := $(quietly) $(python) -m pip install --verbose --disable-pip-version-check

# Directories too: their times tell of files that went away.
sources := $(shell find cpp cmake python -not -path '*/__pycache__*' -not -name '*.pyc')
package_files := CMakeLists.txt pyproject.toml README.md LICENSE third_party_notes.md
test_sources := $(shell find tests/cpp)
cpp_files = $(shell find cpp tests/cpp tests/fuzz $(wildcard bench docs) -name '*.hpp' -o -name '*.cpp')
python_files := python tests $(wildcard bench docs)

# Requirements are written once, in pyproject.toml: $(call required,build) prints those of the build, of the package
# ("run") or of one of its extras, one a line.
required = $(python) -c 'import sys, tomllib; \
	p = tomllib.load(open("pyproject.toml", "rb")); \
	lists = {"build": p["build-system"]["requires"], "run": p["project"]["dependencies"], **p["project"]["optional-dependencies"]}; \
	print(*lists[sys.argv[1]], sep="\n")' $(1)

.PHONY: help
help: ## Show this list
	@grep -hE '^[a-z]+:.*## ' $(MAKEFILE_LIST) | sed -E 's/^([a-z]+):.*## /\1\t/' | expand -t 12

.PHONY: demo
demo: setup ## Set everything up and inspect a virtual layup; the report is left in out/
	.venv/bin/debulk demo -o out

.PHONY: test
test: $(stamps)/tests $(stamps)/docs $(stamps)/strength ## Set everything up and run all tests and checks
	@rm -f build/layers.txt
	$(layer) 'C++ tests' 'ctest --test-dir build/test --output-on-failure -j 2'
	$(layer) 'Python tests' '$(python) -m pytest -q -n 2 --dist worksteal tests/python'
	$(layer) 'from C++ alone' 'cmake/test_cpp_package.sh build/test'
	$(layer) 'newest versions' 'cmake/test_versions.sh $(python) build/test newest' \
		'oldest versions' 'cmake/test_versions.sh $(python) build/test oldest' \
		'branches that decide' '$(decided)' 'style and types' '$(lint)' \
		'doctests' '$(python) -m pytest -q --doctest-modules --pyargs debulk lab' \
		'pages' '$(pages)'
	@echo 'debulk: how long each layer took'; cat build/layers.txt

# What takes longest in C++ is left to `make test`; in Python the marker "slow" says so (tests/python/layers.py).
.PHONY: quick
quick: $(stamps)/tests ## Run the unit tests only, C++ and Python: a minute on two cores
	@rm -f build/layers.txt
	$(layer) 'C++ unit tests' 'ctest --test-dir build/test --output-on-failure -j 2 --quiet \
		-E "ChangingScan.CrashesNoHeightMap|Neighbours.Of"'
	$(layer) 'Python unit tests' '$(python) -m pytest -q -n 2 -m "unit and not slow" tests/python'
	@cat build/layers.txt

.PHONY: versions
versions: $(stamps)/tests ## Try the oldest and the newest Python and packages that pyproject.toml allows
	cmake/test_versions.sh $(python) build/test oldest newest

.PHONY: lint
lint: $(stamps)/tools $(stamps)/package ## Check style and types
	@$(lint)
	@echo 'debulk: style and types are in order'

layer = @cmake/layer.sh
pages = $(python) -m sphinx --fail-on-warning --keep-going --quiet -b html docs build/docs
lint = .venv/bin/ruff check --quiet $(python_files) && .venv/bin/ruff format --check --quiet $(python_files) && \
	.venv/bin/mypy --no-error-summary && $(python) -m mypy.stubtest --concise debulk._core && \
	.venv/bin/clang-format --dry-run -Werror $(cpp_files)

.PHONY: format
format: $(stamps)/tools ## Put all files into the house's format
	.venv/bin/ruff format $(python_files)
	.venv/bin/ruff check --fix-only $(python_files)
	.venv/bin/clang-format -i $(cpp_files)

# The rooms that read files or walk over images by index with many threads; those after them compute with few, or with Eigen.
rooms ?= core scanner files cloud surface pocket fibre
space := $(subst ,, )
sanitized = $(layer) 'C++ tests under $(1)' '$(quietly) cmake --preset $(1) && \
	$(quietly) cmake --build --preset $(1) --target $(rooms:%=test_%) && ctest --preset $(1) -j $(2) -R "^($(subst $(space),|,$(strip $(rooms))))\."'

.PHONY: asan
asan: $(stamps)/system ## Run the C++ tests under the address and undefined-behaviour sanitizers: make asan rooms="core files"
	$(call sanitized,asan,2)

.PHONY: tsan
tsan: $(stamps)/system ## Run the C++ tests under the thread sanitizer
	$(call sanitized,tsan,1)

# What decides a verdict, and its tests. The same lists are in pyproject.toml (mutmut) and in tests/mutants/cpp.py (UNITS).
deciding := */debulk/verdict.py,*/debulk/results/compose.py,*/debulk/inspection/place/level*.py
decided_by := $(addprefix tests/python/,test_verdict.py results/test_compose.py inspection/test_level_step.py inspection/test_level_words.py)
decided = $(python) -m coverage run --data-file=build/decided -m pytest -q $(decided_by) && \
	$(python) -m coverage report --data-file=build/decided --include="$(deciding)" --show-missing --fail-under=100 && \
	$(python) tests/mutants/cpp.py coverage build/test

.PHONY: coverage
coverage: $(stamps)/tests $(stamps)/strength ## Print the branches that the unit tests take; fail if one that decides is not
	$(python) -m coverage run -m pytest -q -m "unit and not slow" tests/python
	$(python) -m coverage report --skip-covered --sort=cover
	$(decided)

.PHONY: mutants
mutants: $(stamps)/tests $(stamps)/strength ## Change what decides a verdict in small ways and list what no test notices; half an hour
	tests/mutants/python.sh $(python) build/mutants
	$(python) tests/mutants/cpp.py mutants build/test

.PHONY: fuzz
seconds ?= 60
runs ?= -1
seed ?= 0
fuzz: $(stamps)/tests $(stamps)/fuzz ## Fuzz every reader and loader, for so many seconds each: make fuzz seconds=60
	$(layer) 'fuzzing' 'cmake/fuzz.sh $(CURDIR)/$(python) $(seconds) $(runs) $(seed)'

.PHONY: corpus
corpus: ## Keep what raised the coverage of make fuzz in tests/fuzz/corpus.tar.xz, where every later run begins
	tar --sort=name --mtime=@0 --owner=0 --group=0 --exclude='seed*' --exclude='*.log' --exclude=failed \
		-C build/fuzz_corpus -cJf tests/fuzz/corpus.tar.xz .

.PHONY: house
house: $(stamps)/venv ## Draw the order of the rooms into docs/house.md
	$(python) tests/python/house.py

.PHONY: nodeset
nodeset: build/nodesets/Opc.Ua.MachineVision.NodeSet2.xml ## Get the types of OPC 40100-1 for debulk serve --opcua and its tests; needs npm
build/nodesets/%.xml:
	@mkdir -p build/nodesets
	cd build/nodesets && npm pack --silent node-opcua-nodesets && \
		tar -xzf node-opcua-nodesets-*.tgz --strip-components=2 package/nodesets/$*.xml && rm node-opcua-nodesets-*.tgz
	@touch $@

.PHONY: docs
docs: $(stamps)/package $(stamps)/docs ## Build the pages of docs/ into build/docs
	$(pages)
	@echo 'debulk: the pages are in build/docs/index.html'

.PHONY: pictures
pictures: $(stamps)/package $(stamps)/bench ## Make the pictures of the README and of docs/ anew; needs Chromium and a quiet machine
	$(python) bench/pictures/physics.py
	$(python) bench/pictures/gallery.py
	$(python) bench/pictures/page.py

.PHONY: wheel
wheel: $(stamps)/package $(stamps)/wheeltools ## Make a wheel that needs only Python, in dist/
	cmake/make_wheel.sh $(python) dist build/test

# Those of the Pythons that debulk supports which this machine has; each needs its headers.
PYTHONS ?= $(shell for p in python3.11 python3.12 python3.13; do $$p -c 1 2> /dev/null && command -v $$p; done; true)

.PHONY: wheelhouse
wheelhouse: $(stamps)/package $(stamps)/wheeltools ## Make all that a cell without a network needs, for each of PYTHONS, in dist/wheelhouse
	cmake/make_wheelhouse.sh dist/wheelhouse $(python) build/test $(PYTHONS)

.PHONY: trywheel
trywheel: wheelhouse ## Try these wheels in a clean Debian 12 without a network (as root)
	for p in $(PYTHONS); do cmake/test_wheel.sh dist/wheelhouse build/clean_root bookworm $$p; done

.PHONY: study
study: $(stamps)/package $(stamps)/bench ## Study the solver's error against run time; tables and pictures in bench/study
	$(python) -m lab.study bench/study
	$(python) bench/study/limit.py
	$(python) bench/study/knobs.py
	$(python) bench/study/profiles.py
	$(python) bench/study/scans.py
	$(python) bench/study/places.py
	$(python) bench/study/physics.py

.PHONY: referee
referee: $(stamps)/package $(stamps)/bench $(stamps)/referee ## Make what is missing of the referee's table; hours the first time
	$(python) bench/referee/strip.py
	$(python) bench/referee/wide.py
	$(python) bench/referee/figures.py
	$(python) bench/referee/own.py
	$(python) bench/referee/mujoco_runs.py
	$(python) bench/referee/sensitivities.py
	$(python) bench/referee/edge.py --laid Sedge1 Sedge5 Sedge8
	$(python) bench/referee/score.py
	$(python) bench/referee/crests.py

.PHONY: bench
bench: $(stamps)/package $(stamps)/bench ## Build and run the C++ benchmarks; results in build/bench
	cmake --preset release -DDEBULK_BENCH=ON -DDEBULK_TESTS=OFF -B build/bench-release
	cmake --build build/bench-release
	@mkdir -p build/bench
	@[ -e build/bench/pockets.txt ] || $(python) bench/solve/export_pockets.py build/bench/pockets.txt
	build/bench-release/bench/solve/bench_solve --benchmark_out=build/bench/solve.json --benchmark_counters_tabular=true
	$(python) bench/front/make_scene.py build/scenes 640 480 1280 960 2560 1920 5120 3840 10240 7680
	DEBULK_SCENES=build/scenes build/bench-release/bench/front/bench_front --benchmark_out=build/bench/front.json
	@if $(python) -c 'import open3d' 2> /dev/null; then \
		$(python) bench/front/open3d_outliers.py build/scenes/5120x3840 5120 3840 > build/bench/open3d.json; fi
	$(python) bench/front/report.py build/bench/front.json build/bench/open3d.json
	$(python) bench/files/loaders.py -o bench/files/loaders.txt
	$(python) bench/front/make_scene.py --pitch 0.55 build/scenes/paper
	$(python) bench/front/cycle.py build/scenes bench/front
	$(python) bench/front/registration.py > bench/front/registration.txt

.PHONY: protocol
protocol: $(stamps)/tests $(stamps)/docs ## Write the validation protocol of this build, one page, to build/protocol.html
	$(python) bench/protocol/protocol.py

.PHONY: trust
trust: $(stamps)/package $(stamps)/bench ## Try the verdicts on 2000 random scenes, half of them spoiled; text and picture in bench/trust
	$(python) bench/trust/trust.py --scenes 2000 --jobs 2
	$(python) bench/trust/offsets.py --out bench/trust/offsets.txt
	$(python) bench/trust/holes.py --out bench/trust/holes.txt
	$(python) bench/trust/ranges.py --out bench/trust/ranges.txt
	$(python) bench/trust/riders.py --out bench/trust/riders.txt
	$(python) bench/trust/branched.py --out bench/trust/branched.txt
	$(python) bench/trust/bridges.py --out bench/trust/bridges.txt
	$(python) bench/trust/bridges.py --seed 9 --below 300 --out bench/trust/bridges_fresh.txt
	$(python) bench/trust/dishes.py --out bench/trust/dishes.txt
	$(python) bench/trust/steep.py --out bench/trust/steep.txt
	$(python) bench/trust/smoothing.py --out bench/trust/smoothing.txt
	$(python) bench/trust/third.py --out bench/trust/third.txt
	$(python) bench/trust/lines.py --out bench/trust/lines.txt
	$(python) bench/trust/stranger.py --scenes 80 --seed 11 --out bench/trust/stranger.txt
	$(python) bench/trust/foreign.py --scenes 1 --seed 40 > bench/trust/foreign.txt
	$(python) bench/trust/foreign.py --scenes 1 --seed 41 >> bench/trust/foreign.txt
	$(python) bench/trust/bumps.py > bench/trust/bumps.txt
	$(python) bench/trust/setups.py --out bench/trust/setups.txt
	$(python) bench/trust/outlines.py --layups 2 --out bench/trust/outlines.txt

.PHONY: open-benchmark
open-benchmark: $(stamps)/package $(stamps)/bench ## Make the open benchmark's 200 scenes and score all criteria on them; some 7 minutes
	$(python) bench/open/contenders.py
	$(python) bench/open/scorer.py build/open/*.csv > bench/open/open.txt && cat bench/open/open.txt

.PHONY: setup
setup: $(stamps)/package ## Set up only: dependencies, .venv and the package in it
	@echo 'debulk: everything is set up'

.PHONY: clean
clean: ## Remove what was built (.venv and the installed packages stay)
	rm -rf build dist out

$(stamps)/system: cmake/install_dependencies.sh
	@echo 'debulk: the first set-up takes 5 to 8 minutes on two cores; the log of what follows is $(log)'
	@cmake/install_dependencies.sh .deps $(log)
	@mkdir -p $(@D) && touch $@

$(stamps)/venv: pyproject.toml $(stamps)/system
	@echo 'debulk: setting up .venv'
	@[ -x $(python) ] || python3 -m venv .venv
	@$(call required,build) > $(stamps)/build.txt
	@$(call required,run) > $(stamps)/run.txt
	@$(pip) -r $(stamps)/build.txt -r $(stamps)/run.txt
	@# Programs in bench/ and the tests import bench/lab, which no wheel has.
	@echo '$(CURDIR)/bench' > "$$($(python) -c 'import sysconfig; print(sysconfig.get_path("purelib"))')/debulk_bench.pth"
	@touch $@

# Test and lint requirements, which a demo does not need.
$(stamps)/tools: $(stamps)/venv
	@echo 'debulk: installing what tests and checks need'
	@$(call required,test) > $(stamps)/test.txt
	@$(call required,lint) > $(stamps)/lint.txt
	@$(pip) -r $(stamps)/test.txt -r $(stamps)/lint.txt
	@touch $@

$(stamps)/wheeltools: $(stamps)/venv
	@$(call required,wheel) > $(stamps)/wheel.txt
	@$(pip) -r $(stamps)/wheel.txt
	@touch $@

$(stamps)/docs: $(stamps)/venv
	@$(call required,docs) > $(stamps)/docs.txt
	@$(pip) -r $(stamps)/docs.txt
	@touch $@

$(stamps)/fuzz: $(stamps)/venv
	@command -v clang++ > /dev/null || { $(quietly) apt-get update -q && $(quietly) env DEBIAN_FRONTEND=noninteractive \
		apt-get install -q -y --no-install-recommends clang libclang-rt-dev; }
	@$(call required,fuzz) > $(stamps)/fuzz.txt
	@$(pip) -r $(stamps)/fuzz.txt
	@touch $@

$(stamps)/strength: $(stamps)/venv
	@$(call required,strength) > $(stamps)/strength.txt
	@$(pip) -r $(stamps)/strength.txt
	@touch $@

# What draws the study's pictures.
$(stamps)/bench: $(stamps)/venv
	@$(call required,bench) > $(stamps)/bench.txt
	@$(pip) -r $(stamps)/bench.txt
	@touch $@

# The engine that the referee simulates with.
$(stamps)/referee: $(stamps)/venv
	@$(call required,referee) > $(stamps)/referee.txt
	@$(pip) -r $(stamps)/referee.txt
	@touch $@

build := --config-settings=build-dir=build/test --config-settings=cmake.define.DEBULK_PRECOMPILED=ON

# The package as users get it. It shares a build with the tests, and keeps what those set there, so that nothing compiles twice.
$(stamps)/package: $(sources) $(package_files) $(stamps)/venv
	@echo 'debulk: building the package (two to four minutes on two cores the first time)'
	@$(pip) --no-build-isolation --no-deps $(build) .
	@touch $@

# The package and the C++ tests, warnings being errors. It installs the package too, which is then up to date.
$(stamps)/tests: $(sources) $(package_files) $(test_sources) $(stamps)/tools
	@echo 'debulk: building the package and the C++ tests (four to eight minutes on two cores the first time)'
	@$(pip) --no-build-isolation --no-deps $(build) --config-settings=build.targets=all \
		--config-settings=cmake.define.DEBULK_TESTS=ON --config-settings=cmake.define.CMAKE_COMPILE_WARNING_AS_ERROR=ON .
	@touch $@ $(stamps)/package
