# One command each. `make help` lists them.
CARGO ?= cargo
CONCORDEM := target/release/concordem
DEMO := demo
SCENARIOS := rust-core/scenario/src/schema/templates

# The steps of make test, longest first, so that none is left alone at the end.
TEST_STEPS := test-yade-native test-rust test-harness test-yade test-hosts test-studies test-python test-lint test-gold test-docs

.PHONY: help demo liggghts lammps fuzz combinations test test-full test-build $(TEST_STEPS) check bench docs book validate validate-full clean-demo

help:
	@echo "make demo           build, run the 50 mm concrete specimen in tension and compression, write a report"
	@echo "make liggghts       the styles for LIGGGHTS and their launcher, into target/liggghts"
	@echo "make lammps         LAMMPS and the plugin for it, into .venv-lammps and target/lammps"
	@echo "make test           all tests, against the real YADE, LIGGGHTS, and LAMMPS, which must be there (as root)"
	@echo "make test-full      make test, then validate-full, fuzz, combinations, and the slow code blocks of the book (nightly)"
	@echo "make fuzz           1,000,000 mutated inputs for all readers (hours); SEED=N chooses others"
	@echo "make combinations   2,000 random scenarios against oracles (minutes); COUNT=N makes more, SEED=N others"
	@echo "make check          formatting and lints"
	@echo "make bench          speed of laws, neighbour search, and whole steps; ratio to YADE"
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

clean-demo:
	rm -rf $(DEMO)

# A missing peer is a failure here and in the long studies, and so is to be without root, which Debian 13 for YADE needs.
test test-build $(TEST_STEPS) validate-full: export CI := 1

# One build, then independent steps, two at a time. Each says how long it took; the table is target/test-times.txt.
JOBS ?= 2

test:
	.ci/setup test
	rm -f target/test-times.txt
	# Debian 13 for the native plugin of YADE, in the background; the step that needs it waits for it.
	(setsid nohup yade-bridge/tests/native/chroot.sh make >/dev/null 2>&1 &)
	.ci/timed build $(MAKE) --no-print-directory test-build
	$(MAKE) --no-print-directory --keep-going --jobs=$(JOBS) --output-sync=target $(TEST_STEPS)
	@echo; cat target/test-times.txt

# Everything that the steps start: program, tests, examples, libraries for the hosts, Python package. The same selection of
# packages in every call of cargo: another one may choose other features of dependencies, and compile them again.
TESTED := --release --workspace --exclude concordem-python --exclude concordem-bench
test-build:
	$(CARGO) fmt --all --check
	$(CARGO) build $(TESTED) --lib --bins --examples --tests
	liggghts-bridge/build
	liggghts-bridge/lammps/build
	yade-bridge/test.sh wheel

# Unit, integration and documentation tests of the library and of the program.
test-rust:
	@.ci/timed $@ $(CARGO) test $(TESTED) --exclude concordem-liggghts

# Our styles inside LIGGGHTS and LAMMPS, under MPI.
HOST_TESTS := $(patsubst liggghts-bridge/tests/%.rs,--test %,$(wildcard liggghts-bridge/tests/*.rs))
test-hosts:
	@.ci/timed $@ $(CARGO) test $(TESTED) $(HOST_TESTS)

test-gold:
	@.ci/timed $@ tests/golden/yade/check_gold.sh
	@.ci/timed read-back tests/results_read_back.sh

# Reduced cases of the long studies, by the same code.
test-studies:
	@.ci/timed specimens validation/specimens.py
	@.ci/timed rigid-box validation/rigid_box_sampling.py --built
	@.ci/timed distributed .venv/bin/python validation/distributed_specimen.py
	@.ci/timed elastic validation/elastic.py

test-python:
	@.ci/timed $@ yade-bridge/test.sh python

test-yade:
	@.ci/timed $@ yade-bridge/tests/yade/run.sh

test-yade-native:
	@.ci/timed $@ yade-bridge/tests/native/run.sh

test-harness:
	@.ci/timed harness-units sh -c 'cd validation && ../.venv/bin/python -m pytest -q tests'
	@.ci/timed harness env PYTHONPATH=validation .venv/bin/python -m concordem_validate run

# The pages of the book, their links, and the code blocks that need neither hosts nor minutes.
test-docs:
	@.ci/timed $@ docs/build

# Lints and the documentation of the library, in a target folder of their own: cargo locks the one of the other steps.
LINT := --target-dir target/lint --workspace
test-lint:
	@.ci/timed clippy $(CARGO) clippy $(LINT) --all-targets -- -D warnings
	@.ci/timed rustdoc env RUSTDOCFLAGS="-D warnings" $(CARGO) doc $(LINT) --no-deps --exclude concordem-python --exclude concordem-bench

# What is too long for every commit. The studies keep what is finished and go on there.
test-full: test fuzz combinations validate-full
	docs/build --hosts --slow

# A night of mutated inputs for every reader; the tests run 2,000 of them. SEED=N gives others.
SEED ?= 1
fuzz:
	CONCORDEM_FUZZ_INPUTS=1000000 CONCORDEM_FUZZ_SEED=$(SEED) $(CARGO) test $(TESTED) --test fuzz -- --nocapture

# Random scenarios; the tests run 100 of them.
COUNT ?= 2000
combinations:
	CONCORDEM_COMBINATIONS=$(COUNT) CONCORDEM_COMBINATIONS_SEED=$(SEED) $(CARGO) test $(TESTED) --test combinations -- --nocapture

check:
	.ci/setup build
	$(CARGO) fmt --all --check
	$(MAKE) --no-print-directory test-lint

bench:
	.ci/setup test
	$(CARGO) bench -p concordem-bench
	tests/peers/compare_speed.sh
	yade-bridge/tests/yade/speed.sh
	yade-bridge/tests/native/run.sh speed

docs:
	.ci/setup build
	RUSTDOCFLAGS="-D warnings" $(CARGO) doc --no-deps --workspace --exclude concordem-python --exclude concordem-bench

book: $(CONCORDEM)
	docs/build

# A missing peer fails where CI is set, and is said otherwise. PYTHONPATH: no installation is needed.
validate: $(CONCORDEM)
	.ci/setup test
	liggghts-bridge/build
	yade-bridge/test.sh wheel
	cd validation && ../.venv/bin/python -m pytest -q tests
	PYTHONPATH=validation .venv/bin/python -m concordem_validate run

validate-full: $(CONCORDEM)
	.ci/setup test
	liggghts-bridge/build
	yade-bridge/test.sh wheel
	PYTHONPATH=validation .venv/bin/python -m concordem_validate run --full --strict
	validation/specimens.py --full
	.venv/bin/python validation/distributed_specimen.py --full
	validation/deformable.py --full
	validation/elastic.py --full
	$(CARGO) run --release -p concordem --example beam_study --no-default-features -- validation/results/beams.json
	validation/rigid_box_sampling.py --full
