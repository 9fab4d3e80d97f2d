"""Two motors of an axis need the same microsteps and the same source of their current: else they part, and the gantry
racks. A motor whose driver stays off does not turn at all."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

from wificnc.board.fluidnc.axes import AxisFacts, without_gaps
from wificnc.board.fluidnc.drivers import PIN_MICROSTEPS, DriverFacts
from wificnc.board.fluidnc.remarks import Remarks
from wificnc.files.problem import Problem

_HINT = (
    "wire both motors to drivers that are set alike, or to one driver, and correct the configuration; a motor that you "
    "take out of it must not be coupled to the axis"
)


def gantry_problems(path: Path, axes: Sequence[AxisFacts]) -> list[Problem]:
    """Axes whose motors would not stay together. @param path  the configuration"""
    made = []
    for facts in axes:
        reason = _undriven(facts) or _unequal(facts.drivers)
        if reason:
            key = f"axes.{facts.letter.lower()}"
            why = f"the two motors of {facts.letter} would not move alike: {reason}; nothing was written"
            made.append(Problem(path, facts.line, "gantry", key, why, _HINT))
    return made


def driven_axes(axes: Sequence[AxisFacts], remarks: Remarks) -> list[AxisFacts]:
    """Without those whose drivers stay off: their motors would stand while the position counts."""
    found = []
    for facts in axes:
        driver = facts.drivers[0]
        if driver.is_off:
            why = (
                f"registers of its {driver.name} are not written, as {driver.unwritten}, and until they are, its "
                f"outputs are off (TOFF = 0): {facts.letter} is left out. If pins make the driver work without "
                "registers, name it stepstick in the configuration and import it again"
            )
            remarks.lost(driver.path, driver.line, why)
        else:
            found.append(facts)
    return without_gaps(found, remarks)


def _undriven(facts: AxisFacts) -> str:
    if not facts.undriven or not facts.motors:
        return ""
    return f"{facts.undriven[0]} cannot be driven here, and the other one can"


def _unequal(drivers: Sequence[DriverFacts]) -> str:
    if len(drivers) < 2 or drivers[0].source == drivers[1].source:
        return ""
    return " and ".join(_described(driver) for driver in drivers)


def _described(driver: DriverFacts) -> str:
    """Where it has its microsteps and its current from."""
    motor = f"{driver.path} ({driver.name})"
    if driver.is_written:
        return f"{motor} has {driver.microsteps} microsteps and its current by its registers"
    if not driver.has_registers:
        pins = f", {', '.join(driver.mode_pins)} of which no output of ours drives" if driver.mode_pins else ""
        return f"{motor} has both by its pins and jumpers{pins}"
    if driver.is_off:
        return f"{motor} stays off, as {driver.unwritten}"
    steps = PIN_MICROSTEPS.get(driver.address) if driver.section == "tmc_2209" else None
    return f"{motor} has {f'{steps} microsteps' if steps else 'both'} by its pins, as {driver.unwritten}"
