# Everything sets itself up by tools/dev.py: a Python environment in .venv, the packages, the host build.

PYTHON ?= python3
VENV   ?= .venv
PY     := $(VENV)/bin/python
WIFICNC := $(VENV)/bin/wificnc
DEV    := $(PYTHON) tools/dev.py --venv $(VENV)

SECONDS ?= 60
SEED    ?= 0
LINES   ?= 1000000
WIRE    ?= 1
CPU     ?= 1

BOARDS ?=
TAG    ?=

.PHONY: help demo test test-all test-slice test-deep test-chip power-cuts platforms chip-traces lint fuzz bench bench-chip bench-motion bench-latency xtensa bench-serve bench-page bench-wire bench-linuxcnc \
    stream-million pictures release docs format generate web untranslated clean distclean
.DEFAULT_GOAL := help

# With bytecode a Python program of ours starts in 0.1 s instead of 0.2 s, and tests start hundreds; a second run collects
# them in 4 s instead of 11 s.
unexport PYTHONDONTWRITEBYTECODE

help:
	@echo 'make demo    run a real job through the real core and draw it (build/demo/)'
	@echo 'make test    the ring core: nearly all tests, in virtual time; RING=chips or RING=realtime for another, PYTEST="tests/gcode -x" for a part'
	@echo 'make test-all  the three rings, as CI runs them: also virtual chips, objects, wheels; browsers, sockets, LinuxCNC, senders'
	@echo 'make test-slice  a fortieth of what test-all leaves out, as the workflow of a change runs it: that of the commit, or PART=N'
	@echo 'make test-deep  all that test-all leaves out: the same on more computers, boards and cuts of the power'
	@echo 'make test-chip  the Grbl checklist and the senders against the real image in the virtual PIC32MZ, all of them'
	@echo 'make power-cuts  the power cut at every flash operation of every command that stores, and how many those were'
	@echo 'make platforms  the PC target and the wheels for the seven kinds of computers, three of them in an emulator'
	@echo 'make lint    formats, types, static analysis, include directions, house rules'
	@echo 'make fuzz    look for inputs that break something: 60 s for each harness, or SECONDS=N'
	@echo 'make bench   speed, instructions and memory, with the method'
	@echo 'make bench-motion  time, acceleration, jerk and path error from step traces; FILES="a.nc b.nc" for others'
	@echo 'make chip-traces  whole jobs in the real image, each step compared with the host; FILES="a.nc b.nc" WIRE=20 CPU=4'
	@echo 'make bench-chip  the virtual PIC32MZ and the interrupts of its real image; the virtual ESP32'
	@echo 'make xtensa  the ESP32 firmware as Xtensa objects: interrupts, and static RAM of each board'
	@echo 'make bench-latency  from a byte or the e-stop to the last pulse and the beam, PIC32MZ, ESP32 and PC'
	@echo 'make bench-serve  a serving controller as senders see it; make stream-million: its first part'
	@echo 'make bench-page  the web page while a large job runs: frames, main thread, Hold; SEGMENTS=100000 for fewer'
	@echo 'make bench-wire  the binary protocol: round trip, and how evenly reports come'
	@echo 'make bench-linuxcnc  what the component of LinuxCNC takes of the processor, and how far the feedback is behind'
	@echo 'make release what people download, into dist/: of the boards that are built or can be built here'
	@echo 'make docs    the documentation as a site, into build/site'
	@echo 'make pictures  those of docs/motion.md, drawn from what the planner does, and of docs/wiring'
	@echo 'make generate  write every generated file, from the tables in protocol/, boards/ and core/'
	@echo 'make web     the page for browsers (web/dist); needs Node.js'
	@echo 'make untranslated  list the texts of the page that German and Spanish lack; needs Node.js'
	@echo 'make format  let the formatters mend what they can'
	@echo 'make clean   remove what was built; make distclean removes .venv too'

demo:
	@$(DEV) demo

test test-all test-slice test-deep:
	@$(DEV) $@ $(if $(RING),--ring $(RING)) $(if $(PART),--part $(PART)) $(PYTEST)

# A part of it is in `make test-all`, and all of it in the slices.
test-chip: $(VENV)/.ready-dev
	@$(WIFICNC) build host
	WIFICNC_ON_CHIP=all $(PY) -m pytest tests/grbl tests/states tests/senders tests/pic32mz/test_pic32mz_zig.py -k "chip or zig" $(PYTEST)

# Some 5 300 cuts, a quarter of an hour; every fourth of the longer commands' is in `make test-all`, all in the slices.
power-cuts: $(VENV)/.ready-dev
	WIFICNC_ON_CHIP=all $(PY) -m pytest -n auto -rP tests/pic32mz/test_pic32mz_power_cut_commands.py $(PYTEST)

# Some 10 minutes. `make test-all` compiles what only Windows has.
platforms: $(VENV)/.ready-dev
	@$(WIFICNC) build host
	$(PY) -m pytest -n auto tests/build/test_platforms.py tests/release/test_wheels.py $(PYTEST)

lint:
	@$(DEV) lint $(ONLY)

fuzz: $(VENV)/.ready-dev
	$(PY) tests/fuzz/run.py --seconds $(SECONDS) --seed $(SEED) $(ONLY)

bench: $(VENV)/.ready-dev
	@cd tools && $(abspath $(PY)) -m bench

bench-motion: $(VENV)/.ready-dev
	@cd tools && $(abspath $(PY)) -m bench.motion $(abspath $(FILES))

bench-chip: $(VENV)/.ready-dev
	@cd tools && $(abspath $(PY)) -m bench.chip && $(abspath $(PY)) -m bench.esp_chip

xtensa: $(VENV)/.ready-dev
	@cd tools && $(abspath $(PY)) -m xtensa

chip-traces: $(VENV)/.ready-dev
	@cd tools && $(abspath $(PY)) -m bench.traces --wire $(WIRE) --cpu $(CPU) $(abspath $(FILES))

bench-latency: $(VENV)/.ready-dev
	@cd tools && $(abspath $(PY)) -m bench.latency

bench-serve: $(VENV)/.ready-dev
	@cd tools && $(abspath $(PY)) -m bench.serve --lines $(LINES) $(ONLY)

bench-page: $(VENV)/.ready-dev
	@cd tools && $(abspath $(PY)) -m bench.page --segments $(or $(SEGMENTS),500000)

bench-wire: $(VENV)/.ready-dev
	@cd tools && $(abspath $(PY)) -m bench.wire

bench-linuxcnc: $(VENV)/.ready-dev
	@cd tools && $(abspath $(PY)) -m bench.linuxcnc

stream-million: ONLY = streams
stream-million: bench-serve

# The page is part of it where there is one.
release: $(VENV)/.ready-dev
	@if [ -f web/package.json ]; then $(MAKE) --no-print-directory web; fi
	$(WIFICNC) release -o dist $(if $(BOARDS),--boards $(BOARDS)) $(if $(TAG),--tag $(TAG))

docs: $(VENV)/.ready-dev
	@cd tools && $(abspath $(PY)) -m pages

pictures: $(VENV)/.ready-dev
	@cd tools && $(abspath $(PY)) -m wiring.pictures && $(abspath $(PY)) -m motion.pictures

generate: $(VENV)/.ready-dev
	@cd tools && $(abspath $(PY)) -m generate

web: $(VENV)/.ready-dev
	@cd tools && $(abspath $(PY)) -m web.build

untranslated: $(VENV)/.ready-dev
	@cd tools && $(abspath $(PY)) -m web.untranslated

format: $(VENV)/.ready-dev
	$(PY) -m ruff check --quiet --fix cli conftest.py emulators tools tests examples || true
	$(PY) -m ruff format --quiet cli conftest.py emulators tools tests examples
	git ls-files '*.c' '*.h' | xargs $(VENV)/bin/clang-format -i

clean:
	rm -rf build .pytest_cache .mypy_cache .ruff_cache .hypothesis

distclean: clean
	rm -rf $(VENV)

# The newest stamp wins: tools/dev.py knows what it stands for.
$(VENV)/.ready-dev: pyproject.toml emulators/pyproject.toml
	@$(DEV) setup --dev
