"""The motor drivers with registers of a configuration: [driver_bus] and [driver.x] of the board file, and what the
machine profile has of each."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Any

from wificnc.board.buses import Driver
from wificnc.board.fluidnc.pins import SHIFTED, Pin, take_pin
from wificnc.board.fluidnc.remarks import Remarks
from wificnc.board.fluidnc.tree import Section

KINDS = {"tmc_2209": "tmc2209", "tmc_2130": "tmc2130", "tmc_5160": "tmc5160"}
# A TMC2209 without registers has its microsteps by MS1 and MS2, the pins that are its address on a UART (data sheet).
PIN_MICROSTEPS = {0: 8, 1: 32, 2: 64, 3: 16}
_BY_PINS = ("tmc_2208", "tmc_2209")  # the others have their outputs off until TOFF is written
_MA, _MOHM, _PCT = 1000, 1000, 100
_AMPS, _MICROSTEPS, _STEALTH = 0.5, 16, 65535  # FluidNC's defaults; $230 for stealthChop at any speed
_SPI_CONTROLLER = "SPI3"


@dataclass
class DriverFacts:
    """One driver of a motor."""

    section: str  # stepstick, tmc_2209 ..
    path: str
    line: int
    address: int = 0
    cs: Pin | None = None
    spi_index: int = 0  # 0: not in a chain
    uart: int = 0
    sense_mohm: int | None = None
    microsteps: int = 0  # by its registers
    mode_pins: tuple[str, ...] = ()  # that FluidNC drives
    profile: dict[str, Any] = field(default_factory=dict)
    homing: list[tuple[str, int, str]] = field(default_factory=list)  # remarks, if its registers are written
    unwritten: str = ""  # why its registers are not; "": they are

    @property
    def kind(self) -> str:
        """Of a board file; only of drivers whose registers are written."""
        return KINDS[self.section]

    @property
    def has_registers(self) -> bool:
        return self.section.startswith("tmc_")

    @property
    def is_written(self) -> bool:
        return self.has_registers and not self.unwritten

    @property
    def is_off(self) -> bool:
        """It lets no current through a motor."""
        return self.has_registers and not self.is_written and self.section not in _BY_PINS

    @property
    def source(self) -> tuple[Any, ...]:
        """What microsteps and current come from. Equal for two drivers: their motors stay together."""
        if self.is_written:
            return ("registers", self.microsteps)
        if not self.has_registers:
            return ("pins", self.mode_pins)
        return (self.section, self.address, self.sense_mohm, self.microsteps, self.mode_pins)

    @property
    def name(self) -> str:
        """Such as TMC2209."""
        return self.section.upper().replace("_", "")


def read_driver(part: Section, kind: str, remarks: Remarks) -> DriverFacts:
    """@param kind  name of the section: stepstick, tmc_2209 .."""
    mode_pins = tuple(name for name in ("ms1_pin", "ms2_pin", "ms3_pin", "reset_pin") if part.take(name) is not None)
    facts = DriverFacts(kind, part.path, part.line, mode_pins=mode_pins)
    if not facts.has_registers:
        return facts
    facts.cs, sense = take_pin(part, "cs_pin", remarks), part.number("r_sense_ohms")
    run = part.positive("run_amps", _AMPS, remarks)
    given = part.number("hold_amps")
    hold = _AMPS if given is None else given
    mode = (part.take("run_mode") or "StealthChop").lower()
    facts.microsteps = int(part.positive("microsteps", _MICROSTEPS, remarks))
    facts.profile = {
        "driver_current_ma": round(run * _MA),
        "driver_microsteps": facts.microsteps,
        "driver_hold_pct": max(0, min(_PCT, round(hold / run * _PCT))),
    }
    if mode == "stealthchop":
        facts.profile["driver_stealth_mm_min"] = _STEALTH
    facts.homing = _homing_remarks(part, run)
    facts.address, facts.spi_index, facts.uart = (part.whole(name) for name in ("addr", "spi_index", "uart_num"))
    part.skip_all()
    facts.sense_mohm = round(sense * _MOHM) if sense else None
    if kind not in KINDS:
        facts.unwritten = f"registers of a {facts.name} are not supported"
    return facts


def _homing_remarks(part: Section, run_amps: float) -> list[tuple[str, int, str]]:
    """What it sets for homing alone, if that is something else than in a job."""
    made = []
    if (part.take("homing_mode") or "").lower() == "stallguard":
        why = "homing by StallGuard: wire DIAG, and set $22, $24, $25 and $250 (docs/drivers.md)"
        made.append(("homing_mode", part.line_of("homing_mode"), why))
    homing = part.number("homing_amps")
    if homing and homing != run_amps:
        why = f"{homing:g} A: an axis homes with the current of a job, $140"
        made.append(("homing_amps", part.line_of("homing_amps"), why))
    return made


def reach_drivers(root: Section, axes: Sequence[Any], remarks: Remarks) -> dict[str, Any]:
    """The bus of all drivers with registers; those that it does not reach learn why.

    @param axes  AxisFacts of axes.py
    @return [driver_bus] of the board file
    """
    found = [driver for facts in axes for driver in facts.drivers if driver.is_written]
    if not found:
        return {}
    is_uart = found[0].kind == "tmc2209"
    for driver in found:
        if (driver.kind == "tmc2209") != is_uart:
            driver.unwritten = f"drivers with registers are on one bus here, which is that of {found[0].path}"
    found = [driver for driver in found if driver.is_written]
    return _uart(root, found, remarks) if is_uart else _spi(root, found, remarks)


def driver_tables(bus: dict[str, Any], axes: Sequence[Any], remarks: Remarks) -> dict[str, Any]:
    """[driver_bus] and [driver] of the board file; the profiles of the axes get what is theirs.

    @param axes  AxisFacts that the board has
    """
    made: dict[str, Any] = {}
    for facts in axes:
        for number, driver in enumerate(facts.drivers):
            _report(facts.letter, driver, remarks)
            if driver.is_written:
                made[facts.letter.lower() + ("2" if number else "")] = _driver(driver, bus)
        _take_profile(facts, [driver for driver in facts.drivers if driver.is_written], remarks)
    return {"driver_bus": bus, "driver": made} if made else {}


def _report(letter: str, driver: DriverFacts, remarks: Remarks) -> None:
    """What its registers have set in FluidNC, and now do not."""
    if driver.is_written:
        for name, line, why in driver.homing:
            (remarks.lost if name == "homing_mode" else remarks.changed)(f"{driver.path}.{name}", line, why)
    elif driver.has_registers:
        remarks.lost(driver.path, driver.line, _by_pins(letter, driver))


def _by_pins(letter: str, driver: DriverFacts) -> str:
    steps = PIN_MICROSTEPS.get(driver.address) if driver.section == "tmc_2209" else None
    have = f"its pins set (address {driver.address}: {steps})" if steps else "its pins MS1 and MS2 set"
    why = (
        f"its registers are not written, as {driver.unwritten}: it runs with the current that VREF and the sense "
        f"resistors set, and the microsteps that {have}; the configuration has {driver.microsteps}"
    )
    if steps == driver.microsteps:
        return why
    right = (
        f"multiply steps/mm of {letter} by {steps / driver.microsteps:g}" if steps else f"compare steps/mm of {letter}"
    )
    return f"{why}: {right}"


def _driver(facts: DriverFacts, bus: dict[str, Any]) -> dict[str, Any]:
    made: dict[str, Any] = {"kind": facts.kind}
    if "uart" in bus:
        made["address"] = facts.address
    elif "cs" in bus:
        made["place"] = facts.spi_index - 1
    elif facts.cs:
        made["cs"] = {"pin": facts.cs.name, "active": "low"}
    if facts.sense_mohm:
        made["sense_mohm"] = facts.sense_mohm
    return made


def _take_profile(facts: Any, drivers: list[DriverFacts], remarks: Remarks) -> None:
    """Both motors of an axis have its settings: those of the first one, with a current that both may have."""
    if not drivers:
        return
    for driver in drivers:
        _limit_current(driver, remarks)
    first, *others = drivers
    for second in others:
        current_ma = min(first.profile["driver_current_ma"], second.profile["driver_current_ma"])
        differs = [key for key in first.profile | second.profile if first.profile.get(key) != second.profile.get(key)]
        first.profile["driver_current_ma"] = current_ma
        if differs:
            why = f"{', '.join(differs)}: both motors of an axis have those of motor0, and the smaller current"
            remarks.changed(second.path, second.line, f"{why}, {current_ma} mA")
    facts.profile |= first.profile


def _limit_current(facts: DriverFacts, remarks: Remarks) -> None:
    """What the sense resistor does not allow the controller refuses, and FluidNC cuts off."""
    row = Driver.model_validate({"kind": facts.kind, "sense_mohm": facts.sense_mohm})
    wanted = facts.profile["driver_current_ma"]
    if wanted > row.current_max_ma:
        facts.profile["driver_current_ma"] = row.current_max_ma
        why = f"{wanted} mA: a sense resistor of {row.sense} mOhm allows at most {row.current_max_ma} mA"
        remarks.changed(f"{facts.path}.run_amps", facts.line, why)


def _uart(root: Section, found: list[DriverFacts], remarks: Remarks) -> dict[str, Any]:
    """All on the UART of the first, each at an address that no other driver on it has."""
    number = found[0].uart or 1
    section = root.section(f"uart{number}")
    pins = {key: take_pin(section, f"{key}d_pin", remarks) for key in ("tx", "rx")}
    section.skip_all()
    on_bus = [driver.address for driver in found if (driver.uart or 1) == number and driver.cs is None]
    for driver in found:
        if driver.cs:
            driver.unwritten = f"{driver.cs.name} selects it on the UART (cs_pin), and no output of ours does that"
        elif (driver.uart or 1) != number:
            driver.unwritten = (
                f"it is on uart{driver.uart}, and drivers with registers are on one bus here, uart{number}"
            )
        elif None in pins.values():
            driver.unwritten = f"there is no uart{number} with txd_pin and rxd_pin at pins of the chip"
        elif driver.address > 3 or driver.address < 0:
            driver.unwritten = f"a TMC2209 has no address {driver.address}"
        elif on_bus.count(driver.address) > 1:
            driver.unwritten = (
                f"another driver on uart{number} has address {driver.address}, too, and both would answer"
            )
    return {"uart": f"UART{number}", **{key: pin.output() for key, pin in pins.items() if pin}}


def _spi(root: Section, found: list[DriverFacts], remarks: Remarks) -> dict[str, Any]:
    """A chain where they share a select line, else each with its own. All or none: a driver whose select line no pin
    drives takes what is meant for the others."""
    section = root.section("spi")
    names = {"mosi": "mosi_pin", "miso": "miso_pin", "sclk": "sck_pin"}
    pins = {key: take_pin(section, name, remarks) for key, name in names.items()}
    chained = any(driver.spi_index > 0 for driver in found)
    # The drivers of a chain have one select line, which the first of them names.
    select = next((driver.cs for driver in found if driver.cs), None)
    why = "spi lacks mosi_pin, miso_pin or sck_pin" if None in pins.values() else ""
    why = why or (_chain_fault(found, select) if chained else _select_fault(found))
    for driver in found:
        driver.unwritten = why
    bus: dict[str, Any] = {"spi": _SPI_CONTROLLER, **{key: pin.output() for key, pin in pins.items() if pin}}
    if chained and select:
        bus["cs"] = {"pin": select.name, "active": "low"}
    return bus


def _chain_fault(found: list[DriverFacts], select: Pin | None) -> str:
    """Why a chain cannot be written; "": it can."""
    places = sorted(driver.spi_index for driver in found)
    if select is None:
        return "no driver of the chain has a cs_pin"
    if select.name.startswith(SHIFTED):
        return f"the chain's cs_pin is {select.name}, an output of a shift register"
    if places != list(range(1, len(places) + 1)):
        return f"the chain has spi_index {', '.join(map(str, places))} at the motors here, not 1 to {len(places)}"
    return ""


def _select_fault(found: list[DriverFacts]) -> str:
    for driver in found:
        if driver.cs is None:
            return f"{driver.path} has no cs_pin"
        if driver.cs.name.startswith(SHIFTED):
            return f"cs_pin of {driver.path} is {driver.cs.name}, an output of a shift register"
    return ""
