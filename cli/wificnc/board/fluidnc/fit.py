"""Makes a board of what a configuration wires: what our rules refuse is allowed with its reason where the running
hardware proves it, or left out with the rule's own words."""

from __future__ import annotations

from typing import Any

from pydantic import ValidationError

from wificnc.board.chip import Chip
from wificnc.board.fluidnc.pins import SHIFTED
from wificnc.board.fluidnc.remarks import Remarks
from wificnc.board.model import BoardFile
from wificnc.board.rules import ALLOWABLE, check_rules
from wificnc.files.problem import Finding, KeyPath, key_text

_ROUNDS_MAX = 200  # each changes one wire
_PROVEN = {
    "strapping": "the board starts with this wiring under FluidNC",
    "debug": "JTAG is not used on this board",
}
_MOTORS = "motors that hold without a step move nothing"


def fit_board(data: dict[str, Any], chip: Chip, remarks: Remarks) -> list[Finding]:
    """Change the data until our rules accept it. @return what they still refuse"""
    for _ in range(_ROUNDS_MAX):
        findings = _check(data, chip)
        if not any(_fix(data, found, remarks) for found in findings):
            return findings
    return findings


def _check(data: dict[str, Any], chip: Chip) -> list[Finding]:
    """What our rules refuse, and tables that no board of ours can have."""
    try:
        return check_rules(BoardFile.model_validate(data), chip)
    except ValidationError as err:
        faults = err.errors()
    unknown = [Finding("bad-value", fault["loc"], fault["msg"]) for fault in faults]
    known = {key: value for key, value in data.items() if key not in {fault["loc"][0] for fault in faults}}
    return unknown + check_rules(BoardFile.model_validate(known), chip)


def _fix(data: dict[str, Any], found: Finding, remarks: Remarks) -> bool:
    """One change; False where this finding stays."""
    if found.rule == "step-engine" and data.pop("step", None):
        remarks.changed("step.engine", 0, f"RMT: {found.reason}; the interrupt makes the pulses instead")
        return True
    if found.rule == "limit-kind":
        return _leave_out(data, found, remarks)
    wire = _wire_at(data, found.path)
    if wire is None or (found.rule == "no-such-pin" and wire["pin"].startswith(SHIFTED)):
        return False
    reason = _reason(found)
    if reason is not None:
        wire.setdefault("allow", {})[found.rule] = reason
        return True
    if found.rule == "no-pull":
        wire["pull"] = "none"
        why = f"{wire['pin']} has no pull resistor: fit 10 kOhm in the wiring"
        remarks.changed(key_text(found.path), 0, why)
        return True
    return _leave_out(data, found, remarks)


def _reason(found: Finding) -> str | None:
    """Why this rule may be broken here; None where nothing says so."""
    if found.rule in _PROVEN:
        return _PROVEN[found.rule]
    if found.rule in ("boot-level", "boot-glitch") and found.path[-1] == "enable":
        return _MOTORS
    return None


def _leave_out(data: dict[str, Any], found: Finding, remarks: Remarks) -> bool:
    """Not step and direction: a motor without them is none."""
    if found.path[-1] in ("step", "dir") or found.path[0] == "timing":
        return False
    *path, last = found.path
    table: Any = data
    for part in path:
        table = table[part]
    lost = table.pop(last)
    why = f"{found.reason} [{found.rule}]"
    if found.rule in ALLOWABLE:
        why += f'; if yours excludes that: pin = "{lost["pin"]}", allow = {{ {found.rule} = "why" }}'
    remarks.lost(key_text(found.path), 0, why)
    return True


def _wire_at(data: dict[str, Any], path: KeyPath) -> dict[str, Any] | None:
    here: Any = data
    for part in path:
        if isinstance(here, dict) and part not in here:
            return None
        here = here[part]
    return here if isinstance(here, dict) and "pin" in here else None
