# Two commands do all the set-up: `make demo` runs the main job, `make test` passes the tests.
PYTHON ?= python3
JOBS ?= -1
# How long the fuzzer runs, and how many kills the faults are tried with.
MINUTES ?= 60
KILLS ?= 208
VENV := .venv
BIN := $(VENV)/bin
# What runs the product, and with it what the tests need. Bytecode is made where a module is first imported: most never are.
READY := $(VENV)/.ready
TESTABLE := $(VENV)/.testable
INSTALL := PYTHONWARNINGS=ignore PIP_DISABLE_PIP_VERSION_CHECK=1 $(BIN)/python -m pip install --quiet --no-compile --editable
VEGGLUE := $(BIN)/vegglue
# One process a core, but no more than four: each takes some 1.2 GB. The tests of a file share what they set up.
PYTEST := $(BIN)/pytest tests -n auto --maxprocesses 4 --dist loadfile
CASES := d0 d3a d3a_refined d3b d3b_paper
SOURCES := $(wildcard vegglue/*.py vegglue/*/*.py vegglue/wording/*/*)
SHARED := configs/kict.yaml $(wildcard data/kict/*.csv) $(SOURCES) $(READY)
export OPENBLAS_NUM_THREADS := 1
export OMP_NUM_THREADS := 1
# Where Python may keep no bytecode, every process compiles all libraries anew: 8 s of a core for each of the tests' own.
unexport PYTHONDONTWRITEBYTECODE

.PHONY: help demo paper checked test check release house bench blind laws faults confluence measured fuzz clean simulate infer report setup
.PRECIOUS: runs/%/ensemble.h5 runs/%/posterior.h5
help:
	@grep -E '^[a-z]+:.*#' $(MAKEFILE_LIST) | sed 's/:.*#/:/'

setup: $(TESTABLE)  # the environment, in .venv
$(READY): pyproject.toml
	$(PYTHON) -m venv $(VENV)
	$(INSTALL) .
	touch $@
$(TESTABLE): $(READY)
	$(INSTALL) '.[test]'
	touch $@

demo: $(READY)  # the loop on a site with a hidden effect, then the paper's D3a, to finished reports
	$(VEGGLUE) demo runs/demo --jobs $(JOBS)

paper: report  # the paper's cases with all 5,000 members
simulate: $(CASES:%=runs/%/ensemble.h5)  # ensembles that are out of date
infer: $(CASES:%=runs/%/posterior.h5)  # posteriors that are out of date
report: $(CASES:%=runs/%/report.html)  # reports that are out of date

runs/%/ensemble.h5: configs/%.yaml $(SHARED)
	$(VEGGLUE) simulate $< --jobs $(JOBS)
	@touch $@
runs/%/posterior.h5: runs/%/ensemble.h5
	$(VEGGLUE) infer configs/$*.yaml
runs/%/report.html: runs/%/posterior.h5
	$(VEGGLUE) report configs/$*.yaml

# Loops of the solver are compiled while types are checked, and not by each process of the tests for itself.
checked: $(TESTABLE)
	$(BIN)/ruff check vegglue tests
	@$(BIN)/python tests/compiled_loops.py & loops=$$!; $(BIN)/mypy; types=$$?; wait $$loops && exit $$types

test: checked  # everything that must pass
	$(PYTEST)

check: checked  # the fast part
	$(PYTEST) -m 'not slow'

release: $(TESTABLE)  # wheel and sdist in dist: built twice with the same bytes, checked, not uploaded
	$(INSTALL) '.[release]'
	$(BIN)/python tests/release.py

house: $(TESTABLE)  # counts of files, lines, helpers and words, for a reader
	@$(BIN)/python tests/house.py

bench: $(TESTABLE)  # measured speed: members/s, cell-steps/s, share of the kernel; BESIDE=CHECKOUT: two builds by turns
	$(BIN)/python tests/studies/$(if $(BESIDE),beside.py $(BESIDE),bench.py)

blind: $(TESTABLE)  # the study of docs/blind.md: hours; goes on where it was stopped
	nice $(BIN)/python tests/studies/blind.py --jobs $(JOBS)

laws: $(TESTABLE)  # the study of docs/discover.md: hours; goes on where it was stopped
	nice $(BIN)/python tests/studies/laws.py

faults: $(TESTABLE)  # every command killed at random moments, counted in docs/faults.md: half an hour
	$(BIN)/python tests/kills.py $(KILLS)
	$(BIN)/python tests/fault_table.py

confluence: $(TESTABLE)  # the numbers of the confluence in docs/measured.md, from the published set in the folder DATA
	$(BIN)/python tests/studies/confluence.py "$(DATA)" --jobs $(JOBS)

measured: $(TESTABLE)  # the numbers of docs/measured.md, from copies of the published repositories in the folder DATA
	$(BIN)/python tests/studies/measured.py "$(DATA)" --jobs $(JOBS)

fuzz: $(TESTABLE)  # files from strangers, bred towards lines not yet reached, for MINUTES
	$(BIN)/python tests/studies/fuzz.py --minutes $(MINUTES)
	$(BIN)/python tests/studies/fuzz.py --minutes $(MINUTES) --results

clean:  # remove the environment and all runs
	rm -rf $(VENV) build dist *.egg-info runs/*/
