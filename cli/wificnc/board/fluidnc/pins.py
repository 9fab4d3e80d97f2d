"""Pins as FluidNC writes them: `gpio.12:low:pu`, `i2so.3`, `NO_PIN`."""

from __future__ import annotations

import re
from dataclasses import dataclass
from typing import Any

from wificnc.board.fluidnc.remarks import Remarks
from wificnc.board.fluidnc.tree import Section

_PIN = re.compile(r"^(?P<bus>gpio|i2so)\.(?P<number>\d{1,3})(?P<options>(:[a-z0-9.]+)*)$", re.IGNORECASE | re.ASCII)
SHIFTED = "I2SO."  # an output of a shift register
_BUSES = {"gpio": "GPIO", "i2so": SHIFTED}
_PULLS = {"pu": "up", "pd": "down"}


@dataclass(frozen=True)
class Pin:
    """One pin: its name in our tables, the level that means on, its pull resistor."""

    name: str
    active: str
    pull: str

    def output(self, inverted: bool = False) -> dict[str, Any]:
        """As an output of a board file. @param inverted  FluidNC names what the pin switches off"""
        active = {"low": "high", "high": "low"}[self.active] if inverted else self.active
        return {"pin": self.name, "active": active}

    def input(self) -> dict[str, Any]:
        return {"pin": self.name, "active": self.active, "pull": self.pull}


def take_pin(section: Section, name: str, remarks: Remarks) -> Pin | None:
    """The pin at a key; None where there is none, or where it is of a kind that no board of ours has."""
    text = section.take(name)
    if text is None:
        return None
    match = _PIN.match(text.replace(" ", ""))
    if match is None:
        remarks.lost(f"{section.path}.{name}".strip("."), section.line_of(name), f"{text} is not a pin of the ESP32")
        return None
    options = match["options"].lower().split(":")
    pull = next((_PULLS[option] for option in options if option in _PULLS), "none")
    active = "low" if "low" in options else "high"
    return Pin(f"{_BUSES[match['bus'].lower()]}{int(match['number'])}", active, pull)
