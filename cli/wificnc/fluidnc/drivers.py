"""The motor drivers with registers of a configuration: [driver_bus] and [driver.x] of the board file, and what the
machine profile has of each."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

from wificnc.board.buses import Driver
from wificnc.fluidnc.pins import SHIFTED, Pin, take_pin
from wificnc.fluidnc.remarks import Remarks
from wificnc.fluidnc.tree import Section

KINDS = {"tmc_2209": "tmc2209", "tmc_2130": "tmc2130", "tmc_5160": "tmc5160"}
REGISTERS = (
    "its driver's registers (current, microsteps, StallGuard) are not written: it runs as a step and direction "
    "driver, as its pins and its own defaults set it"
)
_MA, _MOHM, _PCT = 1000, 1000, 100
_AMPS, _MICROSTEPS, _STEALTH = 0.5, 16, 65535  # FluidNC's defaults; $230 for stealthChop at any speed
_SPI_CONTROLLER = "SPI3"


@dataclass
class DriverFacts:
    """One driver."""

    kind: str
    path: str
    line: int
    address: int
    cs: Pin | None
    spi_index: int  # 0: not in a chain
    uart: int
    sense_mohm: int | None
    profile: dict[str, Any]


def read_driver(part: Section, kind: str, remarks: Remarks) -> DriverFacts | None:
    """Its registers; None: it has none that we write, which is a remark."""
    if kind not in KINDS:
        remarks.lost(part.path, part.line, REGISTERS)
        part.skip_all()
        return None
    cs, sense = take_pin(part, "cs_pin", remarks), part.number("r_sense_ohms")
    run, hold = part.number("run_amps") or _AMPS, part.number("hold_amps") or _AMPS
    mode = (part.take("run_mode") or "StealthChop").lower()
    profile = {
        "driver_current_ma": round(run * _MA),
        "driver_microsteps": part.whole("microsteps") or _MICROSTEPS,
        "driver_hold_pct": min(_PCT, round(hold / run * _PCT)) if run > 0 else _PCT,
    }
    if mode == "stealthchop":
        profile["driver_stealth_mm_min"] = _STEALTH
    _report_homing(part, run, remarks)
    address, index, uart = part.whole("addr"), part.whole("spi_index"), part.whole("uart_num")
    part.skip_all()
    mohm = round(sense * _MOHM) if sense else None
    return DriverFacts(KINDS[kind], part.path, part.line, address, cs, index, uart, mohm, profile)


def _report_homing(part: Section, run_amps: float, remarks: Remarks) -> None:
    """What it sets for homing alone, if that is something else than in a job."""
    if (part.take("homing_mode") or "").lower() == "stallguard":
        why = "homing by StallGuard: wire DIAG, and set $22, $24, $25 and $250 (docs/drivers.md)"
        remarks.lost(f"{part.path}.homing_mode", part.line_of("homing_mode"), why)
    homing = part.number("homing_amps")
    if homing and homing != run_amps:
        why = f"{homing:g} A: an axis homes with the current of a job, $140"
        remarks.changed(f"{part.path}.homing_amps", part.line_of("homing_amps"), why)


def take_drivers(root: Section, axes: Sequence[Any], remarks: Remarks) -> dict[str, Any]:
    """[driver_bus] and [driver] of the board file; the profiles of the axes get what is theirs.

    @param axes  AxisFacts of axes.py
    """
    found = {_name(facts, driver): driver for facts in axes for driver in facts.drivers}
    if not found:
        return {}
    uart = next(iter(found.values())).kind == "tmc2209"
    for name, driver in list(found.items()):
        if (driver.kind == "tmc2209") != uart:
            _lose(found, name, remarks, "all drivers with registers are on one bus")
    bus = _uart(root, found, remarks) if uart else _spi(root, found, remarks)
    made = {name: _driver(driver, uart, bus) for name, driver in found.items()}
    for driver in found.values():
        _limit_current(driver, remarks)
    for facts in axes:
        _take_profile(facts, found, remarks)
    return {"driver_bus": bus, "driver": made} if made else {}


def _limit_current(facts: DriverFacts, remarks: Remarks) -> None:
    """What the sense resistor does not allow the controller refuses, and FluidNC cuts off."""
    row = Driver.model_validate({"kind": facts.kind, "sense_mohm": facts.sense_mohm})
    wanted = facts.profile["driver_current_ma"]
    if wanted > row.current_max_ma:
        facts.profile["driver_current_ma"] = row.current_max_ma
        why = f"{wanted} mA: a sense resistor of {row.sense} mOhm allows at most {row.current_max_ma} mA"
        remarks.changed(f"{facts.path}.run_amps", facts.line, why)


def _name(facts: Any, driver: DriverFacts) -> str:
    """Of its table: x, or y2 for the second of two motors."""
    is_second = len(facts.motors) > 1 and ".motor1." in f"{driver.path}."
    return f"{facts.letter.lower()}2" if is_second else f"{facts.letter.lower()}"


def _take_profile(facts: Any, found: dict[str, DriverFacts], remarks: Remarks) -> None:
    """Both motors of an axis have its settings: those of the first one."""
    letter = facts.letter.lower()
    first, second = found.get(letter), found.get(f"{letter}2")
    if first and second and first.profile != second.profile:
        differs = ", ".join(key for key, value in first.profile.items() if second.profile.get(key) != value)
        remarks.changed(
            second.path, second.line, f"{differs or 'run_mode'}: both motors of an axis have those of motor0"
        )
    if driver := first or second:
        facts.profile |= driver.profile


def _lose(found: dict[str, DriverFacts], name: str, remarks: Remarks, why: str) -> None:
    driver = found.pop(name)
    remarks.lost(driver.path, driver.line, f"{REGISTERS}: {why}")


def _driver(facts: DriverFacts, uart: bool, bus: dict[str, Any]) -> dict[str, Any]:
    made: dict[str, Any] = {"kind": facts.kind}
    if uart:
        made["address"] = facts.address
    elif "cs" in bus:
        made["place"] = facts.spi_index - 1
    elif facts.cs:
        made["cs"] = {"pin": facts.cs.name, "active": "low"}
    if facts.sense_mohm:
        made["sense_mohm"] = facts.sense_mohm
    return made


def _uart(root: Section, found: dict[str, DriverFacts], remarks: Remarks) -> dict[str, Any]:
    """All on the UART of the first, each at an address of its own."""
    number = next(iter(found.values())).uart or 1
    section = root.section(f"uart{number}")
    pins = {key: take_pin(section, f"{key}d_pin", remarks) for key in ("tx", "rx")}
    section.skip_all()
    seen: set[int] = set()
    for name, driver in list(found.items()):
        if driver.cs:
            _lose(found, name, remarks, "a pin selects it on the UART (cs_pin), and no output of ours does that")
        elif None in pins.values():
            _lose(found, name, remarks, f"uart{number} has no txd_pin or no rxd_pin")
        elif driver.address in seen or driver.address > 3:
            _lose(found, name, remarks, f"address {driver.address} is another driver's, or above 3")
        seen.add(driver.address)
    return {"uart": f"UART{number}", **{key: pin.output() for key, pin in pins.items() if pin}}


def _spi(root: Section, found: dict[str, DriverFacts], remarks: Remarks) -> dict[str, Any]:
    """A chain where they share a select line, else each with its own."""
    section = root.section("spi")
    names = {"mosi": "mosi_pin", "miso": "miso_pin", "sclk": "sck_pin"}
    pins = {key: take_pin(section, name, remarks) for key, name in names.items()}
    drivers = list(found.values())
    chained = all(driver.spi_index > 0 for driver in drivers)
    places = sorted(driver.spi_index for driver in drivers)
    # The drivers of a chain have one select line, which the first of them names.
    select = next((driver.cs for driver in drivers if driver.cs), None)
    for name, driver in list(found.items()):
        cs = select if chained else driver.cs
        if None in pins.values():
            _lose(found, name, remarks, "spi lacks mosi_pin, miso_pin or sck_pin")
        elif cs is None or cs.name.startswith(SHIFTED):
            _lose(found, name, remarks, "its cs_pin is an output of a shift register, or missing")
        elif chained and places != list(range(1, len(places) + 1)):
            _lose(found, name, remarks, "the chain has drivers that drive no motor here")
    bus: dict[str, Any] = {"spi": _SPI_CONTROLLER, **{key: pin.output() for key, pin in pins.items() if pin}}
    if chained and select:
        bus["cs"] = {"pin": select.name, "active": "low"}
    return bus
