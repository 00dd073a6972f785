# make run    set up, start the service and measure the sample surgery   (ARGS="--exit" stops after the table)
# make test   set up and run the tests
# make test-postgres   the same on PostgreSQL and Redis, where both are installed
# make check  lint, format, types, import contracts, OpenAPI contract, docstrings, tests that mirror modules, generated pages
# make bench  accuracy on the sample scenes and speed                    (SCENES=dir for other scenes)
# make web    build the page of web/ into service/dashboard; needs Node 20 or newer
# make clean  remove the environment and caches; the database in var/ stays

PYTHON ?= $(shell for p in python3 python3.14 python3.13 python3.12 python3.11; do \
	$$p -c 'import sys; sys.exit(sys.version_info < (3, 11))' 2>/dev/null && echo $$p && break; done)
BIN := .venv/bin
PIP := $(BIN)/python -m pip --disable-pip-version-check -qq
SOURCES := spinewatch contract exports reports settings store workers service commands migrations bench training checks tests
SCENES ?= samples
ARGS ?=

.PHONY: help run test test-postgres check bench web clean

help:
	@sed -n "s/^# //p" Makefile

run: .venv/.runtime
	@$(BIN)/spinewatch sample $(ARGS)

test: .venv/.dev
	$(BIN)/pytest -n 2 $(ARGS)

test-postgres: .venv/.dev
	TEST_DATABASE=postgresql $(BIN)/pytest -n 2 $(ARGS)

check: .venv/.dev
	$(BIN)/ruff check $(SOURCES)
	$(BIN)/ruff format --check $(SOURCES)
	$(BIN)/mypy
	$(BIN)/lint-imports
	$(BIN)/python -m service.openapi --check
	$(BIN)/python -m checks

bench: .venv/.runtime
	$(BIN)/python -m bench.scenes $(SCENES) --check
	$(BIN)/python -m bench.speed --check

web: web/node_modules/.package-lock.json
	cd web && npm run --silent types && npm run --silent check && npm run --silent build

clean:
	rm -rf web/node_modules web/src/api/schema.ts
	rm -rf .venv .mypy_cache .pytest_cache .ruff_cache .hypothesis .import_linter_cache build *.egg-info
	find $(SOURCES) -name __pycache__ -prune -exec rm -rf {} +

$(BIN)/python:
	@test -n "$(PYTHON)" || { echo "Spinewatch needs Python 3.11 or newer; install it, or name it: make PYTHON=..." >&2; exit 1; }
	@$(PYTHON) -m venv .venv || { rm -rf .venv; \
		echo "Python cannot make a virtual environment; install its venv module (Debian: apt install python3-venv)" >&2; exit 1; }

.venv/.runtime: requirements.lock pyproject.toml | $(BIN)/python
	@echo "Installing what Spinewatch needs into .venv ..."
	@$(BIN)/python -m pip --disable-pip-version-check -q install --progress-bar on --require-hashes \
		--requirement requirements.lock
	@$(PIP) install --no-deps --editable .
	@touch $@

.venv/.dev: requirements-dev.lock .venv/.runtime
	@echo "Installing what the tests need into .venv ..."
	@$(PIP) install --require-hashes --requirement requirements-dev.lock
	@touch $@

web/node_modules/.package-lock.json: web/package.json web/package-lock.json web/.npmrc
	@command -v npm >/dev/null || { echo "the page is built by npm; install Node 20 or newer (Debian: apt install npm)" >&2; exit 1; }
	@echo "Installing what the page is built with into web/node_modules ..."
	@cd web && npm ci --silent
	@touch $@
