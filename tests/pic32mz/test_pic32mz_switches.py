"""Limit switches, e-stop and probe at the pins of the real image."""

from __future__ import annotations

from itertools import pairwise

import pytest
from chip_controller import BANNER, Controller
from wificnc_chips.pic32mz import CPU_HZ

TRAVEL = 10_000  # steps between the switches, 40 mm


@pytest.fixture
def machine(controller: Controller) -> Controller:
    """Is in the middle of its travel; homes to the near end, Z to the far one."""
    for axis in range(4):
        controller.switches(axis, -TRAVEL // 2, TRAVEL // 2)
    controller.fine("$22=1", "$23=11", "$24=100", "$25=1500", "$26=5", "$27=2", "$44=4", "$45=11", "$46=0")
    return controller


def test_homing_finds_every_switch(machine: Controller) -> None:
    """To the step: every axis is $27 off the step at which its switch closes."""
    assert machine.send("$H", 60.0).endswith("ok\r\n")
    off = round(2.0 * 250)
    assert machine.stands() == [-TRAVEL // 2 + off, -TRAVEL // 2 + off, TRAVEL // 2 - off, -TRAVEL // 2 + off]
    assert machine.state() == "Idle"


def test_homing_without_a_switch_is_alarm_9(machine: Controller) -> None:
    machine.switches(2, None, None)
    machine.fine("$132=10")
    assert "ALARM:9" in machine.send("$H", 120.0) or "ALARM:9" in machine.heard


def test_hard_limit_stops_at_the_step_that_met_it(machine: Controller) -> None:
    """$21: no pulse leaves the pins after the switch's edge but the one on its way; the position is exact."""
    machine.fine("$21=1")
    machine.send("$X")
    machine.fine("G91G1X30F3000")
    machine.run(1.0)
    assert "ALARM:1\r\n" in machine.heard
    assert machine.stands()[0] == TRAVEL // 2
    said = machine.realtime("\x18", 2.0)
    assert BANNER in said
    assert machine.position()[0] == TRAVEL / 2 / 250


def test_far_switch_is_active_high_near_one_low(machine: Controller) -> None:
    """Both mean the same to $5 and to the status report."""
    for steps, reported in ((0, ""), (-TRAVEL // 2, "X"), (TRAVEL // 2, "X")):
        machine.chip.place(0, steps)
        machine.run(0.02)
        pins = machine.status().split("|Pn:")
        assert (pins[1].split("|")[0].rstrip(">") if len(pins) > 1 else "") == reported


GLITCHES = [(0, 4, True), (5, 5, False), (5, 11, True), (100, 100, False), (100, 106, True), (1000, 999, False)]


@pytest.mark.parametrize(("filter_us", "length_us", "stops"), GLITCHES)
def test_a_glitch_stops_nothing(machine: Controller, filter_us: int, length_us: float, stops: bool) -> None:
    """$92, and up to 5 us more that the interrupts take. 0 counts what the edge's interrupt still sees."""
    machine.switches(1, None, None)  # at each step the bench puts the line of a switch back
    machine.fine("$21=1", f"$92={filter_us}")
    machine.send("$X")
    machine.fine("G91G1Y10F600")
    machine.run(0.3)
    machine.at(0.001, "limit_y_min", 0)
    machine.at(0.001 + length_us * 1e-6, "limit_y_min", 1)
    machine.run(0.1)
    assert ("ALARM:1" in machine.heard) == stops
    assert stops or machine.state() == "Run"


@pytest.mark.parametrize("filter_us", [0, 5, 100, 1000])
def test_a_switch_that_closes_stops_in_time(machine: Controller, filter_us: int) -> None:
    """No step leaves the pins later than the time, and the 3 us that interrupts take, after the one that met it."""
    machine.switches(1, None, 2000)
    machine.fine("$21=1", f"$92={filter_us}", "$111=5000", "$121=500")
    machine.send("$X")
    machine.fine("G91G1Y15F5000")
    machine.run(1.0)
    assert "ALARM:1" in machine.heard
    cycles = [int(step["cycle"]) for step in machine.steps() if step["step"] & 2]
    assert len(cycles) == machine.stands()[1] >= 2000
    late_s = (cycles[-1] - cycles[1999]) / CPU_HZ
    assert filter_us * 1e-6 - 100e-6 < late_s <= filter_us * 1e-6 + 3e-6


def test_bouncing_does_not_count_twice(machine: Controller) -> None:
    machine.fine("$21=1")
    machine.send("$X")
    for edge in range(10):
        machine.at(0.001 + edge * 0.0003, "limit_y_min", edge % 2)
    machine.chip.write(b"G91G1Y10F600\n")
    machine.run(0.5)
    assert machine.heard.count("ALARM:1") == 1


def test_estop(machine: Controller) -> None:
    """No step leaves the pins after it; the position survives, and only a reset after its release helps."""
    machine.send("$X")
    machine.fine("G91G1X20F3000")
    machine.run(0.2)
    machine.at(0.0, "estop", None)  # its contact opens, or its wire breaks
    machine.run(0.0001)
    stood = machine.stands()
    machine.run(1.0)
    assert "ALARM:50\r\n" in machine.heard and machine.stands() == stood and stood[0] > 0
    machine.at(0.0, "estop", 0)
    machine.run(0.1)
    machine.realtime("\x18", 2.0)
    assert machine.position()[0] == round(stood[0] / 250, 3)


ESTOP_CUTS_US = 10.0


@pytest.mark.parametrize("laser", [0, 1])
def test_estop_cuts_drivers_and_spindle_in_its_interrupt(machine: Controller, laser: int) -> None:
    """Before any task, and until a reset after its release, also with motors that would stay on ($1=255)."""
    machine.send("$X")
    machine.fine("$1=255", f"$32={laser}", "M3S1000", "G91G1X20F3000")
    machine.run(0.2)
    off = {machine.pin(f"enable_{axis}"): 1 for axis in "xyza"} | {machine.pin("spindle_pwm"): 0}
    machine.chip.record_edges(True)
    machine.chip.edges()
    begin = machine.chip.cycles
    machine.at(0.0, "estop", None)  # its contact opens, or its wire breaks
    machine.run(1.0)
    edges = machine.chip.edges()
    for pin, level in off.items():
        fallen = [cycle for cycle, moved, to in edges if moved == pin and to == level]
        if pin == machine.pin("spindle_pwm") and not fallen:  # full power: the PWM is a level
            continue
        assert (fallen[0] - begin) / CPU_HZ * 1e6 < ESTOP_CUTS_US or pin == machine.pin("spindle_pwm")
        assert machine.chip.level(pin) == level
    assert "ALARM:50\r\n" in machine.heard
    machine.realtime("\x18", 1.0)
    assert all(machine.chip.level(pin) == level for pin, level in off.items())
    machine.at(0.0, "estop", 0)
    machine.run(0.1)
    machine.realtime("\x18", 2.0)
    assert machine.chip.level(machine.pin("enable_x")) == 0


def test_probe_stops_where_it_touched(machine: Controller) -> None:
    """The reported position is the step at which the line closed, exact."""
    machine.send("$X")
    surface = -1234
    machine.chip.surface(machine.pin("probe"), surface)
    said = machine.send("G91G38.2Z-10F300", 20.0)
    assert f"[PRB:0.000,0.000,{surface / 250:.3f},0.000:1]" in said
    machine.rest()
    assert machine.stands()[2] <= surface


def test_spindle_and_coolant(controller: Controller) -> None:
    """$30 = 1000: M3 S250 is a quarter of each period high, at 5 kHz."""
    chip, pwm, flood = controller.chip, controller.pin("spindle_pwm"), controller.pin("coolant_flood")
    chip.record_edges(True)
    controller.fine("M3S250M8")
    controller.run(0.05)
    chip.edges()
    controller.run(0.1)
    edges = [(cycle, level) for cycle, pin, level in chip.edges() if pin == pwm]
    rises = [cycle for cycle, level in edges if level]
    highs = [fall - rise for (rise, up), (fall, _) in pairwise(edges) if up]
    assert {b - a for a, b in pairwise(rises)} == {40_000}
    assert set(highs) == {10_000} and chip.level(flood) == 1
    controller.fine("M5M9")
    controller.run(0.01)
    chip.edges()
    controller.run(0.1)
    assert chip.edges() == [] and chip.level(pwm) == 0 and chip.level(flood) == 0


def test_the_ports_of_this_board_and_no_others(controller: Controller) -> None:
    """M66 P0 and P1 are SW1 and SW2, M64 P0 is LED2; what the board has not is error:131."""
    controller.at(0.0, "misc_in_0", 1)
    controller.at(0.0, "misc_in_1", 0)
    controller.run(0.02)
    controller.fine("M66P0", "G0X#5399")
    controller.rest()
    assert controller.position()[0] == 1
    controller.fine("M66P1", "G0X#5399")
    controller.rest()
    assert controller.position()[0] == 0
    answers = [controller.send(line) for line in ("M66P2", "M64P1", "M62P4", "M66E0", "M68E0Q1")]
    assert answers == ["error:131\r\n"] * 5


def test_digital_output(controller: Controller) -> None:
    """M64 P0 is RA9."""
    pin = controller.pin("misc_out_0")
    controller.fine("M64P0")
    controller.run(0.01)
    assert controller.chip.level(pin) == 1
    controller.fine("M65P0")
    controller.run(0.01)
    assert controller.chip.level(pin) == 0
