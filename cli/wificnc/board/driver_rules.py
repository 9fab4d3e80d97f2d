"""The rules of motor drivers with registers, and of the bus that reaches them."""

from __future__ import annotations

from collections.abc import Iterator

from wificnc.board.buses import Driver
from wificnc.board.chip import Chip
from wificnc.board.model import BoardFile
from wificnc.board.shift_registers import pulse_engine
from wificnc.files.problem import Finding


def drivers(board: BoardFile, chip: Chip) -> Iterator[Finding]:
    """A BoardRule."""
    bus, named = board.driver_bus, board.driver.named()
    if bus is None:
        if named:
            reason = "these drivers have registers, and the board has no bus to write them"
            yield Finding("drivers", ("driver",), reason, "add [driver_bus] with uart or spi")
        return
    if not named:
        yield Finding(
            "drivers", ("driver_bus",), "no driver is on this bus", 'add [driver.x] with kind = "tmc2209" ...'
        )
    if (bus.uart is None) == (bus.spi is None):
        yield Finding("drivers", ("driver_bus",), "a bus is a UART or an SPI controller", "give one of uart and spi")
        return
    yield from _driver_controller(board, chip)
    keys = ("tx", "rx") if bus.uart else ("mosi", "miso", "sclk")
    for key in keys:
        if getattr(bus, key) is None:
            yield Finding("drivers", ("driver_bus",), f"the bus has no {key}", f'{key} = "..."')
    for name, driver in named.items():
        yield from _driver(board, name, driver)
    yield from _both_motors(board)
    yield from _driver_places(board)


def _driver_controller(board: BoardFile, chip: Chip) -> Iterator[Finding]:
    bus = board.driver_bus
    assert bus is not None
    key, name = ("uart", bus.uart) if bus.uart else ("spi", bus.spi)
    known = chip.driver_uarts if bus.uart else chip.spi_hosts
    if not chip.driver_uarts:
        reason = f"the firmware of the {chip.name} does not write registers of motor drivers"
        yield Finding("drivers", ("driver_bus",), reason, "leave it out, and set current and microsteps at the drivers")
    elif name not in known:
        yield Finding(
            "drivers", ("driver_bus", key), f"{chip.name} has no {name!r} to spare", f"one of: {', '.join(known)}"
        )
    elif bus.spi and chip.spi_words and pulse_engine(board) == "spi" and chip.spi_words.host == name:
        yield Finding("drivers", ("driver_bus", "spi"), f"{name} makes the step pulses", "one of the others")
    elif bus.uart and board.spindle_bus and board.spindle_bus.uart == name and chip.target != "host":
        reason = f"{name} is the UART of the spindle's drive"
        yield Finding("drivers", ("driver_bus", "uart"), reason, "one of the others")
    elif bus.uart and board.pendant and board.pendant.uart == name:
        yield Finding("drivers", ("driver_bus", "uart"), f"{name} is the UART of the pendant", "one of the others")
    elif bus.spi and board.ethernet and board.ethernet.spi_host == name:
        yield Finding("drivers", ("driver_bus", "spi"), f"{name} is the controller of the W5500", "one of the others")


def _driver(board: BoardFile, name: str, driver: Driver) -> Iterator[Finding]:
    bus, path = board.driver_bus, ("driver", name)
    assert bus is not None
    uart = driver.kind == "tmc2209"
    if name not in board.axis.motors():
        second = name.endswith("2")
        reason = f"the board has no second motor of {name[0]}" if second else f"the board has no axis {name}"
        table = f"[axis.{name[0]}.second]" if second else f"[axis.{name}]"
        yield Finding("drivers", path, reason, f"add {table}, or leave this out")
        return
    if uart != (bus.uart is not None):
        reason = f"a {driver.kind.upper()} is reached by {'UART' if uart else 'SPI'}"
        yield Finding("drivers", (*path, "kind"), reason, "all drivers with registers are on one bus")
        return
    if uart and driver.address is None:
        yield Finding("drivers", path, "the address of this driver is missing", "address = 0 to 3, by its MS1 and MS2")
    if not uart and bus.cs is None and driver.cs is None:
        yield Finding("drivers", path, "nothing selects this driver", "cs here, or one for a chain in [driver_bus]")
    if not uart and bus.cs is not None and (driver.cs is not None or driver.place is None):
        reason = "a driver of a chain has a place and no select line for itself"
        yield Finding("drivers", path, reason, "place = 0 for the one next to mosi, and no cs")
    motor = board.axis.motors()[name]
    ends = [wire for key in ("limit", "limit_min", "limit_max", "home") if (wire := getattr(motor, key)) is not None]
    if driver.diag and not ends:
        reason = "DIAG is to be at a limit input, and this axis has none"
        yield Finding("drivers", (*path, "diag"), reason, f"add limit to [axis.{name}]")
    elif driver.diag and all(wire.active == "low" for wire in ends):
        reason = "DIAG is high in a stall, and this axis' limit is active low"
        yield Finding("drivers", (*path, "diag"), reason, 'limit = { pin = "...", active = "high", pull = "none" }')


def _both_motors(board: BoardFile) -> Iterator[Finding]:
    """One by its registers and the other by its pins have other microsteps: they part, and the gantry racks."""
    with_registers = board.driver.named()
    for letter, axis in board.axis.wired().items():
        pair = (letter, f"{letter}2")
        named = [name for name in pair if name in with_registers]
        if axis.second is None or len(named) != 1:
            continue
        other = pair[named[0] == letter]
        reason = (
            f"this motor of {letter.upper()} has its microsteps and current by registers, and the other one by pins"
        )
        hint = f"add [driver.{other}], or leave out [driver.{named[0]}] and set both drivers alike by their pins"
        yield Finding("drivers", ("driver", named[0]), reason, hint)


def _driver_places(board: BoardFile) -> Iterator[Finding]:
    """Two drivers in one place, or a hole in the chain."""
    bus, named = board.driver_bus, board.driver.named()
    assert bus is not None
    key = "address" if bus.uart else "place"
    seen: dict[int, str] = {}
    for name, driver in named.items():
        at = getattr(driver, key)
        if at is None:
            continue
        if at in seen:
            reason = f"driver.{seen[at]} has {key} {at} too, and both would answer"
            yield Finding("drivers", ("driver", name, key), reason, f"a {key} that no other driver has")
        seen[at] = name
    if bus.cs and seen and max(seen) != len(seen) - 1:
        reason = f"a chain of {len(seen)} has the places 0 to {len(seen) - 1}"
        yield Finding("drivers", ("driver", seen[max(seen)], "place"), reason, "count them from mosi on")
