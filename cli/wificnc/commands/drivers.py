"""`wificnc drivers`: motor drivers with registers, how they are, and their settings."""

from __future__ import annotations

import time
from collections.abc import Sequence
from dataclasses import asdict
from typing import Any

import rich_click as click
from rich.table import Table

from wificnc import ui
from wificnc.commands._target import controller_option, json_option
from wificnc.commands.settings import apply, change_json, ready, show_changes
from wificnc.connection.client import Client, Target, connected
from wificnc.connection.drivers import WARNINGS, Driver, number_of, parse_driver, scaled_steps, settings_axis
from wificnc.connection.settings import Change, Values, differences, name_of, out_of_range, sending_order
from wificnc.errors import JobError, RefusedError, UserError
from wificnc.tables import load_settings

WRITTEN_S = 5.0  # a driver that answers has its registers within a second
LOOK_S = 0.1
MICROSTEPS = tuple(1 << power for power in range(9))
STYLES = {"verified": "green", "not written": "dim", "being written": "yellow"}


@click.command(context_settings={"ignore_unknown_options": True})
@click.argument("motor", required=False)
@click.argument("assignments", nargs=-1, metavar="[NAME=VALUE]...")
@click.option("--steps", is_flag=True, help="With other microsteps change steps/mm, too, so that a mm stays one.")
@controller_option
@json_option
def command(motor: str | None, assignments: tuple[str, ...], steps: bool, target: Target, as_json: bool) -> None:
    """Show the motor drivers with registers (TMC2209, TMC5160, TMC2130), or change settings of one:
    `wificnc drivers`, `wificnc drivers y`, `wificnc drivers y current_ma=800 microsteps=32 --steps`.

    Exit code 1 if one of them has a fault, or did not take what was written.
    """
    if not assignments and not steps:
        with connected(target) as client:
            client.synchronise()
            shown = chosen(read_drivers(client), motor)
    else:
        with ready(target) as client:
            shown = change(client, motor or "", assignments, steps, as_json)
    if as_json and not assignments:
        ui.emit_json([asdict(driver) for driver in shown])
    elif not as_json:
        ui.data.print(drivers_table(shown))
    if faults := [driver for driver in shown if not set(driver.problems) <= set(WARNINGS)]:
        words = ", ".join(f"{driver.name}: {', '.join(driver.problems)}" for driver in faults)
        raise JobError(f"a driver has a fault ({words})", hint="docs/drivers.md says what to do")


def read_drivers(client: Client) -> list[Driver]:
    """Raises RefusedError: the board has none, or its firmware does not know them."""
    found = [driver for body in client.must("$DRIVERS").brackets("DRIVER") if (driver := parse_driver(body))]
    if not found:
        raise RefusedError("this board has no motor drivers with registers", hint="[driver_bus] of its board file")
    return found


def chosen(drivers: Sequence[Driver], motor: str | None) -> list[Driver]:
    """All of them, or this one. Raises UserError."""
    found = [driver for driver in drivers if motor is None or driver.name == motor.upper()]
    if not found:
        known = ", ".join(driver.name for driver in drivers)
        if not motor or "=" in motor:
            like = f"{drivers[0].name.lower()} {motor or 'current_ma=800'}"
            raise UserError("the motor is missing", hint=f"like wificnc drivers {like}")
        raise UserError(f"no motor {motor} has a driver with registers", hint=f"one of: {known}")
    return found


def change(client: Client, motor: str, assignments: Sequence[str], steps: bool, as_json: bool) -> list[Driver]:
    """Write settings of a driver, and wait until it has proved that it has them. @return the drivers that have them"""
    (driver,) = chosen(read_drivers(client), motor)
    before = client.settings()
    axis = settings_axis(driver.name, before)
    wanted = parse(assignments, axis)
    if current := wanted.get(number_of("current_ma", axis)):
        check_current(current, same_axis(client, axis, before))
    warnings = take_microsteps(wanted, axis, before, steps)
    changes = sending_order([Change(n, name_of(n), "", before.get(n), value) for n, value in wanted.items()])
    if refused := out_of_range(changes):
        raise UserError("\n".join(["nothing was changed:", *refused]))
    for warning in warnings:
        ui.warn(warning)
    apply(client, changes)
    after = client.settings()
    show_changes(differences(before, after))
    if as_json:
        ui.emit_json([change_json(each) for each in differences(before, after)])
    return written(client, axis, after)


def take_microsteps(wanted: dict[int, str], axis: int, before: Values, steps: bool) -> list[str]:
    """Steps/mm that go with other microsteps, if they are to change, too. @return what the user must know. Raises
    UserError: the controller would refuse them, and have the steps/mm by then."""
    number, scaled = number_of("microsteps", axis), load_settings()["steps_per_mm"].number + axis
    if number not in wanted:
        if steps:
            raise UserError("--steps needs microsteps", hint="nothing was changed; like microsteps=32 --steps")
        return []
    microsteps = float(wanted[number])
    if microsteps not in MICROSTEPS:
        known = ", ".join(map(str, MICROSTEPS))
        raise UserError(f"microsteps are {known}, not {wanted[number]}", hint="nothing was changed")
    wanted[number] = f"{microsteps:.0f}"
    if microsteps == float(before[number]):
        return []
    now = scaled_steps(before[scaled], int(before[number]), int(microsteps))
    lost = "with other microsteps the position is lost: home the machine again"
    if steps:
        wanted[scaled] = now
        return [lost]
    return [f"{name_of(scaled)} stays {before[scaled]}; {now} goes with {wanted[number]} microsteps: --steps", lost]


def parse(assignments: Sequence[str], axis: int) -> dict[int, str]:
    """Number of the setting -> value. Raises UserError."""
    found: dict[int, str] = {}
    for assignment in assignments:
        name, equals, value = assignment.partition("=")
        try:
            float(value)
        except ValueError:
            equals = ""
        if not equals:
            raise UserError(f"{assignment!r} is not an assignment", hint="NAME=VALUE, like current_ma=800")
        number = number_of(name.strip(), axis)
        if number in found:
            raise UserError(f"{name.strip()} is given twice", hint="nothing was changed")
        found[number] = value.strip()
    return found


def check_current(text: str, drivers: Sequence[Driver]) -> None:
    """Raises UserError: the controller would refuse it."""
    least = min(drivers, key=lambda driver: driver.most_ma)
    if float(text) > least.most_ma:
        raise UserError(
            f"{text} mA: the sense resistor of driver {least.name} allows at most {least.most_ma} mA",
            hint="nothing was changed",
        )


def same_axis(client: Client, axis: int, settings: Values) -> list[Driver]:
    """Drivers that have the settings of this axis: of a gantry both."""
    return [driver for driver in read_drivers(client) if settings_axis(driver.name, settings) == axis]


def written(client: Client, axis: int, settings: Values) -> list[Driver]:
    """Until none of them is being written. Raises JobError."""
    deadline = time.monotonic() + WRITTEN_S
    while time.monotonic() < deadline:
        drivers = same_axis(client, axis, settings)
        if all(driver.state != "being written" for driver in drivers):
            return drivers
        client.wait(LOOK_S)
    raise JobError("the driver is not written yet", hint="the motor supply must be on: docs/drivers.md")


def drivers_table(drivers: Sequence[Driver]) -> Table:
    table = Table(box=None, pad_edge=False, padding=(0, 2, 0, 0), header_style="dim")
    for column in ("motor", "chip", "state", "mA", "max", "hold", "steps", "in use", "load", "resets"):
        table.add_column(column, justify="left" if column in ("motor", "chip", "state") else "right", no_wrap=True)
    for driver in drivers:
        state = f"[{STYLES.get(driver.state, 'red')}]{', '.join(driver.problems) or driver.state}[/]"
        numbers: list[Any] = [driver.current_ma, driver.most_ma, f"{driver.hold_pct} %", driver.microsteps]
        numbers += [f"{driver.scale + 1}/32", driver.load, driver.resets]
        table.add_row(driver.name, f"{driver.chip}@{driver.place}", state, *map(str, numbers))
    return table
