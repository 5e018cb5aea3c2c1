# make fly    set up, fly the report's nominal case on the ROS graph, draw its figures
# make test   set up, check style, types and spelling, run the tests, measure what they cover
# make test-docs  set up, run the commands of README and docs
# make test-slow  set up, run the tests that take minutes
# make docs   set up, write the reference from the code into docs, API pages into build/docs
# make bench  set up, measure the rates that docs/performance.md speaks of
# make venv   set up alone: .venv, with ROS 2 from PyPI

FITS := import sys; sys.exit(sys.version_info[:2] not in ((3, 11), (3, 12)))
PYTHON ?= $(shell for python in python3 python3.12 python3.11; do \
	$$python -c '$(FITS)' 2>/dev/null && echo $$python && break; done)
OUT ?= flights/nominal_di-$(shell date +%Y%m%d-%H%M%S)
BIN := .venv/bin
READY := .venv/ready
MODULES := ahv_plant ahv_control ahv_msgs_py ahv_analysis launch docs examples studies test setup.py
TEXTS := $(wildcard *.md *.rst *.cff docs/*.md) config Makefile package.xml

.PHONY: fly docs test tests style-and-coverage test-docs test-slow bench venv clean

fly: venv
	@$(BIN)/ahv fly nominal_di --out $(OUT)
	@$(BIN)/ahv figures $(OUT)/bag --out $(OUT)/figures

test: venv
	@$(MAKE) --no-print-directory --jobs=2 tests style-and-coverage

tests:
	$(BIN)/python -m pytest -n 2 --dist loadfile

# Beside the tests, and after them in the queue for the processor; its output is kept for the end.
style-and-coverage:
	$(BIN)/ruff check $(MODULES)
	$(BIN)/ruff format --check $(MODULES)
	$(BIN)/mypy
	$(BIN)/codespell $(MODULES) $(TEXTS)
	@mkdir -p build
	NUMBA_DISABLE_JIT=1 nice -n 19 $(BIN)/coverage run -m pytest -m "unit and not compiled" \
	> build/coverage.txt 2>&1 || { cat build/coverage.txt; exit 1; }
	$(BIN)/coverage report

test-docs: venv
	$(BIN)/python -m pytest -m "docs and not slow"

test-slow: venv
	$(BIN)/python -m pytest -m slow

docs: venv
	$(BIN)/python -m ahv_analysis.reference
	NUMBA_DISABLE_JIT=1 $(BIN)/python docs/api_pages.py

bench: venv
	@$(BIN)/python -m test.benchmark
	@$(BIN)/python -m test.benchmark_realtime

venv: $(READY)

$(READY): setup.py setup.cfg pyproject.toml package.xml
	@$(or $(PYTHON),false) -c '$(FITS)' || \
	{ echo "ahv needs Python 3.11 or 3.12: make PYTHON=/path/to/python3.12" >&2; exit 2; }
	$(PYTHON) -m venv .venv
	$(BIN)/pip install --quiet --editable '.[ros,test]'
	@touch $(READY)

clean:
	rm -rf .venv build install log *.egg-info
