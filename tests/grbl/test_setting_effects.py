"""The column `affects` of protocol/settings.toml: what depends on a setting is derived again when it is set, and only
that."""

from __future__ import annotations

import ctypes
import re
from collections.abc import Iterator

import pytest
from c_library import LIB
from grbl_host import Grbl
from test_switches import make_homing
from test_trust import homed
from wificnc.tables.settings import Setting, load_settings

ROWS = load_settings().setting
ALL = pytest.mark.parametrize("row", ROWS, ids=lambda row: row.name)

EVERYTHING = ("configure_apply", "outputs_apply", "motor_current_put_out")


@pytest.fixture
def machine() -> Iterator[Grbl]:
    controller = Grbl(axes=6, encoder=True, pump=True, spindle_bus=True, drivers=True)
    controller.send("")
    yield controller
    controller.close()


def present(controller: Grbl, row: Setting) -> float:
    found = re.search(rf"^\${row.number}=(\S+)", controller.send("$$\n"), re.MULTILINE)
    assert found
    return float(found[1])


def another(row: Setting, now: float) -> float:
    """A value in range that differs from this one, small enough that no rule of the board forbids it."""
    low = max(float(row.min), 3.0) if row.name == "step_pulse_us" else float(row.min)
    choices = [float(row.default) + 1.0] if row.name.startswith("laser_curve") else []  # they ascend
    choices += [2.0] if row.name == "second_motor" else []  # X has no driver to spare
    choices += [0.0] if row.name == "charge_pump_hz" else []  # its timer makes no 1 Hz
    choices += [low, 1.0, 3.0, float(row.default), low + 1.0, 500.0, 600.0]
    return next(value for value in choices if value != now and low <= value <= row.max)


def in_memory(controller: Grbl) -> bytes:
    return ctypes.string_at(LIB.host_machine(controller._host), LIB.host_core_ram_bytes())


@ALL
def test_nothing_is_left_as_it_was_derived_before(machine: Grbl, row: Setting) -> None:
    """Whatever could be derived from settings is already what deriving all of it makes."""
    machine.fine("$22=1")
    answer = machine.send(f"${row.number}={another(row, present(machine, row))}\n")
    assert "ok\r\n" in answer, answer
    before = in_memory(machine)
    for function in EVERYTHING:
        getattr(LIB, function)(LIB.host_machine(machine._host))
    assert in_memory(machine) == before


@ALL
def test_only_motion_is_said_to_be_limited_again(machine: Grbl, row: Setting) -> None:
    limited = r"\[MSG:\$110 is limited to \d+ mm/min"
    assert re.match(limited, machine.send("$110=900000\n"))
    value = present(machine, row)
    assert bool(re.search(limited, machine.send(f"${row.number}={value}\n"))) == ("motion" in row.affects)


def test_a_rate_that_takes_too_long_to_stop_from_is_said(machine: Grbl) -> None:
    """An axis is no faster than it stops from in 100 s (core/motion/move.h)."""
    machine.send("$111=6000\n")
    assert machine.send("$121=1\n") == "ok\r\n"
    said = "[MSG:$111 is limited to {} mm/min by its acceleration: $121={}]\r\nok\r\n"
    assert machine.send("$121=0.25\n") == said.format("1500", "0.250")
    assert machine.send("$121=0.001\n") == said.format("6.000", "0.001")


@ALL
def test_only_another_place_loses_the_homing(machine: Grbl, row: Setting) -> None:
    make_homing(machine)
    machine.send("$H\n")
    assert homed(machine) == "1"
    machine.send(f"${row.number}={present(machine, row)}\n")
    assert (homed(machine) != "1") == ("position" in row.affects)
