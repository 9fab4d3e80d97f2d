"""Spindle, laser and coolant of a configuration."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any

from wificnc.board.fluidnc.pins import take_pin
from wificnc.board.fluidnc.remarks import Remarks
from wificnc.board.fluidnc.tree import Section
from wificnc.board.fluidnc.vfd import MODELS, UNKNOWN, read_range, read_vfd

TAKEN = ("pwm", "laser", "relay", "onoff", "10v")
_NO_OTHER = "is a second spindle: one at a time here"
_REFUSED = {
    "besc": "a brushless motor's controller needs servo pulses of 1 to 2 ms, which no output of ours makes from S",
    "hbridge": "an H bridge needs a PWM for each direction",
    "dac": "an analog output of the chip; wire a PWM with a filter, or a 0 to 10 V module",
    "plasma": "a plasma torch with an arc signal",
    "plasmaspindle": "a plasma torch with an arc signal",
}
_VFDS = (*MODELS, *UNKNOWN)
SPINDLES = (*TAKEN, *_REFUSED, *_VFDS, "nospindle", "no_spindle")
_PWM_HZ = (50, 50_000)  # of $33
_MAX_DELAY_S = 60.0  # of $394 and $539
_QUIET = ("tool_num", "off_on_alarm", "disable_with_s0", "s0_with_disable")


@dataclass
class SpindleFacts:
    """Keys of [output] and [spindle_bus] in the board file, and of [spindle] and [coolant] in the machine profile."""

    bus: dict[str, Any] = field(default_factory=dict)
    outputs: dict[str, Any] = field(default_factory=dict)
    spindle: dict[str, Any] = field(default_factory=dict)
    coolant: dict[str, Any] = field(default_factory=dict)


def read_spindles(root: Section, remarks: Remarks) -> SpindleFacts:
    """The first spindle that we drive; the others are lost."""
    facts = SpindleFacts()
    for name, section in root.sections.items():
        kind = _kind(name)
        if kind is None:
            continue
        root.skip(name)
        if kind in ("nospindle", "no_spindle"):
            section.skip_all()
        elif kind in _REFUSED:
            remarks.lost(section.path, section.line, f"{_REFUSED[kind]}: not taken")
            section.skip_all()
        elif facts.outputs or facts.bus:
            remarks.lost(section.path, section.line, _NO_OTHER)
            section.skip_all()
        elif kind not in TAKEN:
            _read_drive(kind, section, root, facts, remarks)
        else:
            _read_spindle(kind, section, facts, remarks)
    _read_coolant(root.section("coolant"), facts, remarks)
    return facts


def _kind(name: str) -> str | None:
    plain = name.replace(" ", "")
    if plain in SPINDLES:
        return plain
    return next((vfd for vfd in _VFDS if plain.startswith(vfd)), None)


def _read_drive(kind: str, section: Section, root: Section, facts: SpindleFacts, remarks: Remarks) -> None:
    facts.bus, drive = read_vfd(kind, section, root, remarks)
    section.skip(*_QUIET, "debug", "poll_ms", "retries")
    if facts.bus:
        text = section.take("speed_map")
        speeds = _speeds(text, section, remarks) if text else read_range(section, remarks)
        facts.spindle |= drive | {key: value for key, value in speeds.items() if not key.startswith("pwm_")}
        _read_delays(section, facts, remarks)
    section.skip_all()


def _read_spindle(kind: str, section: Section, facts: SpindleFacts, remarks: Remarks) -> None:
    section.skip(*_QUIET)
    output, enable = take_pin(section, "output_pin", remarks), take_pin(section, "enable_pin", remarks)
    direction = take_pin(section, "direction_pin", remarks)
    forward = take_pin(section, "forward_pin", remarks)
    if kind in ("relay", "onoff"):
        output, enable = enable if output is None else None, output or enable
    wires = {"spindle_pwm": output, "spindle_enable": enable or forward, "spindle_dir": direction}
    facts.outputs.update({name: pin.output() for name, pin in wires.items() if pin})
    if section.take("reverse_pin") is not None:
        why = "a line for each direction; here one line switches it on and one chooses the direction"
        remarks.lost(f"{section.path}.reverse_pin", section.line_of("reverse_pin"), why)
    if kind == "laser":
        facts.spindle["laser"] = True
    if output:
        _read_pwm(section, facts, remarks)
    else:
        section.skip("speed_map", "pwm_hz")
    _read_delays(section, facts, remarks)


def _read_delays(section: Section, facts: SpindleFacts, remarks: Remarks) -> None:
    """The program waits for them; a laser does not."""
    for name, ours in (("spinup_ms", "on_delay_s"), ("spindown_ms", "off_delay_s")):
        delay_s = (section.number(name) or 0) / 1000
        if delay_s:
            facts.spindle[ours] = min(delay_s, _MAX_DELAY_S)
        if delay_s > _MAX_DELAY_S:
            why = f"{delay_s:g} s; the controller waits at most {_MAX_DELAY_S:g} s"
            remarks.changed(f"{section.path}.{name}", section.line_of(name), why)


def _read_pwm(section: Section, facts: SpindleFacts, remarks: Remarks) -> None:
    hz = section.number("pwm_hz")
    if hz is not None:
        facts.spindle["pwm_hz"] = int(min(max(hz, _PWM_HZ[0]), _PWM_HZ[1]))
        if facts.spindle["pwm_hz"] != int(hz):
            why = f"{hz:g} Hz; $33 is {_PWM_HZ[0]} to {_PWM_HZ[1]} Hz"
            remarks.changed(f"{section.path}.pwm_hz", section.line_of("pwm_hz"), why)
    text = section.take("speed_map")
    if text is not None:
        facts.spindle.update(_speeds(text, section, remarks))


def _speeds(text: str, section: Section, remarks: Remarks) -> dict[str, float]:
    """`0=0% 6000=25% 24000=100%` as the two ends that Grbl knows."""
    key, line = f"{section.path}.speed_map", section.line_of("speed_map")
    try:
        pairs = [
            (float(rpm), float(duty.rstrip("%"))) for rpm, _, duty in (word.partition("=") for word in text.split())
        ]
    except ValueError:
        pairs = []
    if len(pairs) < 2 or pairs[-1][0] <= 0 or pairs[-1][1] <= 0:
        remarks.lost(key, line, f"{text} is not a rising map of speeds to per cent")
        return {}
    low = pairs[0]
    for pair in pairs[1:-1]:
        if pair[1] == low[1] or (low[0] == 0 and pair[0] == 0):
            low = pair
    return _ends(pairs, low, key, line, remarks)


def _ends(
    pairs: list[tuple[float, float]], low: tuple[float, float], key: str, line: int, remarks: Remarks
) -> dict[str, float]:
    high = pairs[-1]
    between = pairs[pairs.index(low) + 1 : -1]
    slope = (high[1] - low[1]) / (high[0] - low[0]) if high[0] > low[0] else 0.0
    if any(abs(low[1] + slope * (rpm - low[0]) - duty) > 1.0 for rpm, duty in between):
        remarks.lost(key, line, "a curve of more than two points: its ends are taken, and straight between them")
    if pairs[0][1] > 0 and pairs[0][0] == 0 and low == pairs[0]:
        remarks.changed(key, line, f"S0 is {pairs[0][1]:g} % there and off here")
    ends = {"max_rpm": high[0], "min_rpm": low[0]}
    if high[1] < 100:
        ends["pwm_max_pct"] = high[1]
    if 0 < low[1] <= high[1] - 1:
        ends["pwm_min_pct"] = low[1]
    return ends if low[0] < high[0] else {"max_rpm": high[0]}


def _read_coolant(section: Section, facts: SpindleFacts, remarks: Remarks) -> None:
    for name, ours in (("flood_pin", "coolant_flood"), ("mist_pin", "coolant_mist")):
        pin = take_pin(section, name, remarks)
        if pin:
            facts.outputs[ours] = pin.output()
    delay_ms = section.number("delay_ms")
    if delay_ms:
        facts.coolant["delay_s"] = delay_ms / 1000
