"""Probe, buttons and user inputs and outputs of a configuration."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any

from wificnc.board.fluidnc.pins import Pin, take_pin
from wificnc.board.fluidnc.remarks import Remarks
from wificnc.board.fluidnc.tree import Section
from wificnc.board.model import MISC_IN_MAX, MISC_OUT_MAX

_STOPS = ("estop_pin", "fault_pin", "reset_pin")
_BUTTONS = {"safety_door_pin": "in_door", "feed_hold_pin": "in_hold", "cycle_start_pin": "in_start"}
_USER_PINS = 8


@dataclass
class InputFacts:
    """[input] of the board file, output.misc, and keys of the store."""

    inputs: dict[str, Any] = field(default_factory=dict)
    misc_in: list[dict[str, Any]] = field(default_factory=list)
    misc_out: list[dict[str, Any]] = field(default_factory=list)
    stored: dict[str, int] = field(default_factory=dict)


def read_inputs(root: Section, remarks: Remarks) -> InputFacts:
    facts = InputFacts()
    _read_probe(root.section("probe"), facts, remarks)
    _read_user(root, facts, remarks)
    control = root.section("control")
    _read_stops(control, facts, remarks)
    for name, key in _BUTTONS.items():
        pin = take_pin(control, name, remarks)
        if pin is None:
            continue
        if len(facts.misc_in) == MISC_IN_MAX:
            remarks.lost(f"control.{name}", control.line_of(name), f"more than {MISC_IN_MAX} inputs")
            continue
        facts.stored[key] = len(facts.misc_in)
        facts.misc_in.append(pin.input())
    for name in list(control.values):
        if control.take(name) is not None and name.startswith(("macro", "homing_button")):
            remarks.lost(f"control.{name}", control.line_of(name), "a button for a macro: no such input here")
    return facts


def _read_probe(probe: Section, facts: InputFacts, remarks: Remarks) -> None:
    pin = take_pin(probe, "pin", remarks)
    if pin:
        facts.inputs["probe"] = pin.input()
    probe.skip("check_mode_start", "hard_stop", "probe_hard_limit")
    setter = take_pin(probe, "toolsetter_pin", remarks)
    if setter is None:
        return
    if pin is None:
        facts.inputs["probe"] = setter.input()
        remarks.changed("probe.toolsetter_pin", probe.line_of("toolsetter_pin"), "is the probe here")
    elif setter.name != pin.name:
        facts.inputs["toolsetter"] = setter.input()
        why = "stops G38 after G65 P5 Q1, and measures tools ($341); in FluidNC both stop every G38"
        remarks.changed("probe.toolsetter_pin", probe.line_of("toolsetter_pin"), why)


def _read_stops(control: Section, facts: InputFacts, remarks: Remarks) -> None:
    for name in _STOPS:
        pin = take_pin(control, name, remarks)
        if pin is None:
            continue
        if "estop" in facts.inputs and name == "fault_pin" and len(facts.misc_in) < MISC_IN_MAX:
            _add_fault(pin, control.line_of(name), facts, remarks)
            continue
        if "estop" in facts.inputs:
            remarks.lost(f"control.{name}", control.line_of(name), "one e-stop input here")
            continue
        facts.inputs["estop"] = pin.input()
        if name == "reset_pin":
            why = "is the e-stop here: alarm 50, and the position is lost if it stops a motion"
            remarks.changed("control.reset_pin", control.line_of(name), why)


def _add_fault(pin: Pin, line: int, facts: InputFacts, remarks: Remarks) -> None:
    number = len(facts.misc_in)
    facts.misc_in.append(pin.input())
    low = f" and $745={1 << number}" if pin.input()["active"] == "low" else ""
    why = f"is misc input {number} (P{number} of M66), and stops nothing before you send $744={1 << number}{low}"
    remarks.changed("control.fault_pin", line, why)


def _read_user(root: Section, facts: InputFacts, remarks: Remarks) -> None:
    outputs, inputs = root.section("user_outputs"), root.section("user_inputs")
    for section, found, limit in ((outputs, facts.misc_out, MISC_OUT_MAX), (inputs, facts.misc_in, MISC_IN_MAX)):
        for number in range(_USER_PINS):
            _read_user_pin(section, f"digital{number}_pin", found, limit, remarks)
            for name in (f"analog{number}_pin", f"analog{number}_hz"):
                if section.take(name) is not None and name.endswith("_pin"):
                    why = "no analog inputs and outputs on a chip"
                    remarks.lost(f"{section.path}.{name}", section.line_of(name), why)


def _read_user_pin(section: Section, name: str, found: list[dict[str, Any]], limit: int, remarks: Remarks) -> None:
    pin = take_pin(section, name, remarks)
    if pin is None:
        return
    key, line = f"{section.path}.{name}", section.line_of(name)
    if len(found) == limit:
        remarks.lost(key, line, f"more than {limit} of them")
        return
    if f"digital{len(found)}_pin" != name:
        remarks.changed(key, line, f"is P{len(found)} here")
    found.append(pin.output() if section.path == "user_outputs" else pin.input())
