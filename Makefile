# The short commands. `make` builds, `make test` tests, `make demo` shows; the work is CMake's.
BUILD ?= build
JOBS ?= $(shell nproc)
PREFIX ?= /usr/local
GENERATOR := $(shell command -v ninja > /dev/null && echo "-G Ninja")
MESH ?=
CMAKE_FLAGS ?=

.PHONY: freecad freecad-test blender blender-test blender-pictures web web-test python python-test python-old python-asan test-cluster format all configure setup test test-long test-platforms dist release golden demo install bench docs guide-pictures layers clean

all: configure
	@cmake --build $(BUILD) -j $(JOBS)

configure:
	@cmake -S . -B $(BUILD) $(GENERATOR) -DCMAKE_INSTALL_PREFIX=$(PREFIX) $(CMAKE_FLAGS) > $(BUILD).log 2>&1 || { cat $(BUILD).log; exit 1; }
	@rm -f $(BUILD).log

setup:
	@tools/setup.sh

test: all
	@cd $(BUILD) && ctest -j $(JOBS) --output-on-failure

# What takes too long for every change: whole runs, the torture set and the fuzz corpora under sanitizers, and the torture set at all counts.
test-long: test
	@for preset in asan-ubsan tsan; do \
	cmake --preset $$preset > /dev/null && cmake --build --preset $$preset -j $(JOBS) && ctest --preset $$preset -j $(JOBS) || exit 1; done
	@$(BUILD)/quadwright-tests torture --table > $(BUILD)/torture.md; code=$$?; tail -n 1 $(BUILD)/torture.md; exit $$code

# The user's MESH, or a bracket made here: sharp edges, holes, handles.
demo: all
	@mkdir -p out
	@mesh="$(MESH)"; if [ -z "$$mesh" ]; then mesh=out/demo-input.obj; $(BUILD)/quadwright-shapes bracket 12000 $$mesh; own="--preset cad"; fi; \
	$(BUILD)/quadwright "$$mesh" -o out/demo-quads.obj --json out/demo.json $$own $(DEMO_FLAGS) && \
	$(BUILD)/quadwright render "$$mesh" out/demo-quads.obj -o out/demo.png && \
	echo "the quads: out/demo-quads.obj   the picture: out/demo.png   the report: out/demo.json"

install: all
	@cmake --install $(BUILD)

bench: all
	@bench/run $(BUILD)

# The hashes of tests/golden.tsv, where a change of the results is meant.
golden: all
	@cmake -DTOOL=$(abspath $(BUILD))/quadwright -DSHAPES=$(abspath $(BUILD))/quadwright-shapes -DROOT=$(CURDIR) -DWORK=$(abspath $(BUILD))/test-golden \
	-DREWRITE=ON -P tests/golden.cmake

# The same bytes with other compilers, optimizations, processors, C libraries and systems (musl, Windows by wine, WebAssembly by Node).
test-platforms:
	@tools/test-platforms

# What is handed out, each tried: static Linux program, Windows program, Debian packages, SHA256SUMS; in build-dist/out.
dist:
	@tools/dist

# A release into out/release, and nothing leaves this machine: docs/dev/release.md.
release:
	@tools/release out/release

format:
	@tools/check-format --fix

# The manual as the program knows it: a page, a man page, and completions for shells.
docs: include/quadwright/options.h all
	@mkdir -p docs/man tools/completions
	@set -e; m=$(BUILD)/quadwright-manual; $$m markdown > docs/cli.md; $$m man > docs/man/quadwright.1; $$m bash > tools/completions/quadwright.bash; \
	$$m zsh > tools/completions/_quadwright; $$m fish > tools/completions/quadwright.fish

# After a new row of the table this comes before a build: make docs.
include/quadwright/options.h: include/quadwright/options.def tools/options-header
	@awk -f tools/options-header $< > $@

# The pictures of docs/guides, by the commands that the pages show.
guide-pictures: all
	@cmake -DROOT=$(CURDIR) -DTOOL=$(abspath $(BUILD))/quadwright -DSHAPES=$(abspath $(BUILD))/quadwright-shapes -DWORK=$(abspath $(BUILD))/test-guides -DCOPY=ON -P tests/guides.cmake

clean:
	@rm -rf $(BUILD) build-* out

# The wheel of the Python package in out/, and its tests in a clean environment. On Debian what is missing is installed.
python:
	@tools/python-package build

python-test:
	@tools/setup.sh
	@$(MAKE) --no-print-directory all
	@QUADWRIGHT_TOOL=$(abspath $(BUILD))/quadwright tools/python-package test

# The wheel for older systems, built in a Debian bullseye (root); and the tests under AddressSanitizer, with a thousand remeshes that leak nothing.
python-old: all
	@QUADWRIGHT_TOOL=$(abspath $(BUILD))/quadwright tools/python-package old

python-asan: all
	@QUADWRIGHT_TOOL=$(abspath $(BUILD))/quadwright tools/python-package asan

# Batches in shards under GNU parallel and under Slurm, each with a task killed in the middle. Installs both.
test-cluster: all
	@tools/test-cluster

# The WebAssembly module, the npm package (out/npm) and the page (static files in bindings/web/dist), and their tests in Node and in headless Chromium.
web: configure
	@cmake --build $(BUILD) -j $(JOBS) --target quadwright-shapes
	@QUADWRIGHT_SHAPES=$(abspath $(BUILD))/quadwright-shapes tools/web page

web-test: all
	@QUADWRIGHT_TOOL=$(abspath $(BUILD))/quadwright QUADWRIGHT_SHAPES=$(abspath $(BUILD))/quadwright-shapes tools/web test

# The Blender add-on: its zip and the index of a static repository in out/blender; its tests in Debian's Blender, without a window and in one under Xvfb.
blender:
	@tools/blender-addon build

blender-test: all
	@QUADWRIGHT_TOOL=$(abspath $(BUILD))/quadwright QUADWRIGHT_SHAPES=$(abspath $(BUILD))/quadwright-shapes tools/blender-addon test

blender-pictures: all
	@QUADWRIGHT_TOOL=$(abspath $(BUILD))/quadwright QUADWRIGHT_SHAPES=$(abspath $(BUILD))/quadwright-shapes tools/blender-addon pictures

# The FreeCAD workbench: its zip in out/freecad; its tests in Debian's FreeCAD, without a window and in one under Xvfb.
freecad:
	@tools/freecad-addon build

freecad-test:
	@tools/freecad-addon test
