"""One configuration of FluidNC: the board file, the machine profile, and what was not taken."""

from __future__ import annotations

from dataclasses import dataclass
from math import ceil
from pathlib import Path
from typing import Any

from wificnc.board.chip import Chip, load_chips
from wificnc.board.fluidnc.axes import AxisFacts, read_axes, shared_enable
from wificnc.board.fluidnc.chip import chip_of, wired_pins
from wificnc.board.fluidnc.drivers import driver_tables, reach_drivers
from wificnc.board.fluidnc.fit import fit_board
from wificnc.board.fluidnc.gantry import driven_axes, gantry_problems
from wificnc.board.fluidnc.inputs import InputFacts, read_inputs
from wificnc.board.fluidnc.pins import take_pin
from wificnc.board.fluidnc.profile import profile_data
from wificnc.board.fluidnc.remarks import Kind, Remarks
from wificnc.board.fluidnc.spindles import read_spindles
from wificnc.board.fluidnc.text import toml_text
from wificnc.board.fluidnc.tree import Section, printable, read_fluidnc
from wificnc.board.rules import SPREAD_NS
from wificnc.files.problem import FileProblems, Finding, Problem

NS_PER_S, NS_PER_US = 1_000_000_000, 1_000
_PULSE_NS, _DIR_NS, _RATE_HZ, _TIMER_HZ = 1_800, 1_900, 250_000, 20_000_000  # as our own ESP32 boards
_TICK_NS = NS_PER_S // _TIMER_HZ
_LEAST_PULSE_US = 1  # whole microseconds
_PULSE_US_MAX, _DIR_US_MAX = 255, 50  # of [timing] in a board file
_SPI_RATE_HZ = 160_000  # of boards/esp32s3-devkitc-shift.toml
_WORD_NS, _SHIFTED_OUTPUTS = 2_000, 32  # of the ESP32's I2S peripheral; of shift registers
_ENGINES = {"rmt": "rmt", "i2s_static": "i2s", "i2s_stream": "i2s", "timed": "gpio"}
_MEMORY = {
    "esp32": {"mode": "flash", "flash_mb": [4, 8, 16], "psram_mb": [0]},
    "esp32s3": {"mode": "quad", "flash_mb": [4, 8, 16], "psram_mb": [0, 2]},
}
_S3_PSRAM_PIN = "GPIO26"  # of a quad PSRAM
_S3_BARE = {"mode": "flash", "flash_mb": [4, 8, 16], "psram_mb": [0]}
_NOT_HERE = {
    "sdcard": "no SD card: programs come over USB, the network or from the page",
    "oled": "no display; the page and the status light show the state",
    "i2c": "no I2C bus",
    "uart": "displays and pendants are not taken; a pendant goes into [pendant] by hand (docs/pendant.md)",
    "macros": "no macros: $N0 and $N1 run lines at start, buttons are those of the sender",
    "parking": "Z goes up at the door or in a hold by $42, $58 and $59 here, which are not taken (docs/tool-change.md)",
    "status_outputs": "no outputs that show the state; there is a status light",
    "extenders": "no expanders for pins",
    "atc": "tools are changed by hand with $341, which is not taken (docs/tool-change.md)",
    "ethernet": "not taken: a W5500 goes into [ethernet] by hand (boards/README.md)",
}
# What says nothing that a controller of ours could do otherwise.
_QUIET = (
    *("meta", "yaml_wiki", "yaml_url", "report_inches", "verbose_errors", "use_line_numbers", "planner_blocks"),
    *("enable_parking_override_control", "start", "spi", "homing_init_lock", "software_debounce_ms"),
)


@dataclass(frozen=True)
class Imported:
    """What a configuration became."""

    name: str
    board: dict[str, Any]
    machine: dict[str, Any]
    stored: dict[str, int]  # keys of the store, in addition to the machine profile's
    remarks: Remarks
    refused: list[Finding]  # by the rules of boards

    def board_text(self, source: str) -> str:
        return toml_text(self._comments(source), self.board)

    def machine_text(self, source: str) -> str:
        return toml_text(self._comments(source), self.machine)

    def _comments(self, source: str) -> list[str]:
        lines = [f"Made by `wificnc boards import` from {source}."]
        for kind in Kind:
            remarks = self.remarks.lines(kind)
            lines += [f"{kind.value.capitalize()}:"] * bool(remarks) + [f"  {remark}" for remark in remarks]
        return lines


def import_fluidnc(path: Path, chip: str | None = None) -> Imported:
    """Convert a configuration. @param chip  esp32 or esp32s3; None: what its pins say

    Raises:
        FileProblems: it is no configuration, or no axis of it can be driven.
    """
    root, remarks = read_fluidnc(path), Remarks()
    axes = read_axes(root.section("axes"), remarks)
    bus = reach_drivers(root, axes, remarks)
    problems = gantry_problems(path, axes)
    if problems:
        raise FileProblems(problems)
    axes = driven_axes(axes, remarks)
    if not axes:
        reason = "; ".join(["has no axis with a motor that we drive", *map(str, remarks.found)])
        raise FileProblems([Problem(path, root.line_of("axes"), "no-axis", "axes", reason)])
    enable = shared_enable(root.section("axes"), remarks)
    drivers = driver_tables(bus, axes, remarks)
    spindles, inputs = read_spindles(root, remarks), read_inputs(root, remarks)
    machine = profile_data(root, axes, spindles.spindle, spindles.coolant, remarks)
    outputs = {"enable": enable} if enable else {}
    outputs |= spindles.outputs
    board = _board_data(path, root, axes, outputs, inputs, remarks)
    board |= drivers | ({"spindle_bus": spindles.bus} if spindles.bus else {})
    board["chip"] = chip or chip_of(board, path)
    board["memory"] = _memory_of(board, remarks)
    board["timing"] = _timing(
        root.section("stepping"), board.get("step", {}).get("engine", "gpio"), _chip(board), remarks
    )
    _list_left(root, remarks)
    refused = fit_board(board, _chip(board), remarks)
    return Imported(machine["name"], board, machine, inputs.stored, remarks, refused)


def _chip(board: dict[str, Any]) -> Chip:
    chip = load_chips()["esp32", board["chip"]]
    return chip.with_shift_registers(board["i2so"]["outputs"]) if "i2so" in board else chip


def _board_data(
    path: Path, root: Section, axes: list[AxisFacts], outputs: dict[str, Any], inputs: InputFacts, remarks: Remarks
) -> dict[str, Any]:
    name = root.title("board", remarks) or root.title("name", remarks) or printable(path.stem) or "imported"
    data: dict[str, Any] = {
        "schema": 1,
        "name": name,
        "summary": f"{''.join(facts.letter for facts in axes)}, imported from a FluidNC configuration",
        "target": "esp32",
        "chip": "esp32",
        "source": {"map": f"FluidNC configuration {printable(path.name)}", "board": name},
        "memory": {},
        "timing": {},
    }
    engine = _engine(root, remarks)
    if engine != "gpio":
        data["step"] = {"engine": engine}
    if engine == "i2s" and (bus := _bus(root.section("i2so"), remarks)):
        data["i2so"] = bus
    root.skip("i2so")
    data["axis"] = {facts.letter.lower(): _axis(facts) for facts in axes}
    data["output"] = {**outputs, **({"misc": inputs.misc_out} if inputs.misc_out else {})}
    data["input"] = {**inputs.inputs, **({"misc": inputs.misc_in} if inputs.misc_in else {})}
    return {key: value for key, value in data.items() if value != {} or key in ("memory", "timing")}


def _axis(facts: AxisFacts) -> dict[str, Any]:
    first, *others = facts.motors
    return {**first, "second": others[0]} if others else first


def _engine(root: Section, remarks: Remarks) -> str:
    stepping = root.section("stepping")
    name = (stepping.take("engine") or "rmt").lower()
    stepping.skip("disable_delay_us", "segments")
    if name not in _ENGINES:
        remarks.changed("stepping.engine", stepping.line_of("engine"), f"{name}: the interrupt makes the pulses here")
    return _ENGINES.get(name, "gpio")


def _bus(i2so: Section, remarks: Remarks) -> dict[str, Any] | None:
    """[i2so], the wiring of shift registers."""
    i2so.skip("min_pulse_us")
    if i2so.take("oe_pin") is not None:
        why = "switches the registers' outputs on, and no output of ours is fixed at a level: wire OE to ground"
        remarks.lost("i2so.oe_pin", i2so.line_of("oe_pin"), why)
    pins = {name: take_pin(i2so, f"{name}_pin", remarks) for name in ("bck", "data", "ws")}
    wires = {name: pin.output() for name, pin in pins.items() if pin}
    return {**wires, "outputs": _SHIFTED_OUTPUTS} if len(wires) == len(pins) else None


def _timing(stepping: Section, engine: str, chip: Chip, remarks: Remarks) -> dict[str, Any]:
    """As our own boards, with the pulse and the direction's time of the configuration where they are longer."""
    pulse_us = int(_time_us(stepping, "pulse_us", _PULSE_US_MAX, remarks))
    dir_us = _time_us(stepping, "dir_delay_us", _DIR_US_MAX, remarks)
    least_ns, grid_ns = _PULSE_NS, _TICK_NS
    if engine == "i2s" and chip.spi_words:
        least_ns, engine = chip.spi_words.word_ns, "spi"
    elif engine == "i2s":
        grid_ns = _WORD_NS
    pulse_ns, dir_ns = (grid_ns * ceil(ns / grid_ns) for ns in (least_ns, max(_DIR_NS, dir_us * NS_PER_US)))
    needed_ns = pulse_ns + max(pulse_ns, dir_ns) + SPREAD_NS.get(engine, max(SPREAD_NS.values()))
    timing = {"timer_hz": _TIMER_HZ, "step_pulse_ns": pulse_ns}
    if pulse_us * NS_PER_US > pulse_ns:
        timing["default_pulse_us"] = pulse_us
    return {**timing, "dir_setup_ns": dir_ns, "max_step_rate_hz": min(_rate_hz(engine), NS_PER_S // needed_ns)}


def _time_us(stepping: Section, name: str, most_us: int, remarks: Remarks) -> float:
    us = stepping.number(name)
    if us is None:
        return 0.0
    if us < 0 or (us < _LEAST_PULSE_US and name == "pulse_us"):
        remarks.lost(f"stepping.{name}", stepping.line_of(name), f"{us:g} us is not a value for it: the board's own")
    elif us > most_us:
        remarks.changed(f"stepping.{name}", stepping.line_of(name), f"{us:g} us; at most {most_us} us here")
    return max(0.0, min(us, most_us))


def _rate_hz(engine: str) -> int:
    """At which the interrupt leaves the processor time enough (docs/performance.md)."""
    return _SPI_RATE_HZ if engine == "spi" else _RATE_HZ


def _memory_of(board: dict[str, Any], remarks: Remarks) -> dict[str, Any]:
    if board["chip"] != "esp32s3" or _S3_PSRAM_PIN not in wired_pins(board):
        return dict(_MEMORY[board["chip"]])
    why = f"{_S3_PSRAM_PIN} is the chip select of a PSRAM where a module has one: this board has none"
    remarks.changed("memory.mode", 0, why)
    return dict(_S3_BARE)


def _list_left(root: Section, remarks: Remarks) -> None:
    """Keys that have not been read."""
    root.skip(*_QUIET, "board", "name")
    for key, line, text in root.left():
        first = key.partition(".")[0]
        why = next((why for name, why in _NOT_HERE.items() if first.startswith(name)), None)
        if why is None:
            why = "is not known here" if text is None else f"{text!r} is not understood" if text else "has no value"
            remarks.lost(key, line, why)
        else:
            remarks.lost(first, root.line_of(first), why)
