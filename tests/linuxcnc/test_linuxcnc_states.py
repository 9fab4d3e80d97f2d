"""Each state of the component before each thing that can happen in it: nothing moves that no one commands."""

from __future__ import annotations

import math
from collections.abc import Callable

import pytest
from link_bench import G38, SCALE, Bench, HomeByIndex, homing_bench, mover
from wificnc.connection.wmc3.layout import Home, State

SPEED = 20.0


def switch_on_as_linuxcnc(bench: Bench) -> None:
    """Its command is what the feedback was while it was off, and from now on its own."""
    bench.command[:] = bench.feedback
    bench.each_servo = lambda: None
    bench.pins["enable"] = True


def reset(bench: Bench) -> None:
    bench.pins["enable"] = False
    bench.pins["reset"] = True
    bench.run(0.05)
    bench.pins["reset"] = False
    bench.run(0.05)


# ---- switching on ----


def test_switched_off_and_on_while_it_moves(bench: Bench) -> None:
    """LinuxCNC then believes to be where the machine has been. It does not go back there."""
    bench.enable()
    bench.each_servo = mover(bench, 0, 50.0, SPEED)
    bench.run(0.5)
    bench.pins["enable"] = False
    bench.run(0.02)
    switch_on_as_linuxcnc(bench)
    begun = bench.virtual.position[0]
    bench.run(1)
    assert bench.virtual.position[0] >= begun and not any(bench.virtual.edges(0)[1] < 0)
    assert bench.pins["fault"] and "has moved" in bench.said[0]
    reset(bench)
    switch_on_as_linuxcnc(bench)
    bench.run(0.3)
    assert bench.is_open and not bench.pins["fault"]
    bench.each_servo = mover(bench, 0, 1.0, SPEED)
    bench.run(2)
    assert bench.virtual.position[0] == 200 == bench.virtual.pulses[0]


def test_switched_off_it_ends_soon_whatever_has_waited(bench: Bench) -> None:
    """A network that was gone for 0.7 s has 0.7 s of motion to catch up with, which no one wants any more."""
    bench.enable()
    bench.each_servo = mover(bench, 0, 500.0, SPEED)
    bench.run(1)
    bench.wire.dead = True
    bench.run(0.7)
    bench.wire.dead = False
    bench.pins["enable"] = False
    begun = bench.virtual.position[0]
    bench.run(1)
    assert bench.virtual.position[0] - begun <= 0.15 * SPEED * SCALE, "its queue of 0.1 s, and what brakes"
    assert not bench.pins["fault"] and bench.feedback[0] == bench.virtual.position[0] / SCALE


def test_a_report_from_before_the_motion_is_not_where_it_stands(bench: Bench) -> None:
    """Off and on, and no report has come since. What is open then must begin where the machine really is."""
    bench.run(0.1)
    bench.pins["enable"] = True
    bench.run(0.03)
    assert bench.is_open
    bench.wire.loses_status = True
    bench.each_servo = mover(bench, 0, 2.0, SPEED)
    bench.run(0.4)
    bench.pins["enable"] = False
    bench.run(0.2)
    switch_on_as_linuxcnc(bench)
    bench.run(0.1)
    bench.wire.loses_status = False
    bench.run(0.5)
    assert bench.pins["fault"], "LinuxCNC believes to be at 0"
    assert bench.virtual.position[0] == bench.virtual.pulses[0] == 400


def test_on_again_in_a_hold_nothing_old_runs(bench: Bench) -> None:
    """What was queued before LinuxCNC was off is not what it wants now."""
    bench.enable()
    bench.each_servo = mover(bench, 0, 500.0, SPEED)
    bench.run(0.5)
    bench.virtual.text("!")
    bench.run(0.5)
    bench.pins["enable"] = False
    bench.run(0.2)
    held = bench.virtual.position
    switch_on_as_linuxcnc(bench)
    bench.run(0.5)
    assert bench.is_open and bench.pins["held"] and not bench.pins["fault"]
    bench.virtual.text("~")
    bench.run(1)
    assert bench.virtual.position == held
    bench.each_servo = mover(bench, 0, bench.command[0] + 2.0, SPEED)
    bench.run(1)
    assert bench.virtual.position[0] == held[0] + 400 and not bench.pins["fault"]


def test_only_switching_on_begins_motion(bench: Bench) -> None:
    """A fault is cleared while LinuxCNC has never switched off: it waits for that."""
    bench.enable()
    bench.samples_come = False
    bench.run(1.2)
    assert bench.pins["fault"]
    bench.samples_come = True
    bench.pins["reset"] = True
    bench.run(0.3)
    assert bench.pins["ready"] and not bench.is_open
    bench.pins["enable"] = False
    bench.run(0.02)
    bench.pins["enable"] = True
    bench.run(0.2)
    assert bench.is_open


def test_switched_on_as_soon_as_it_is_connected(bench: Bench) -> None:
    """Someone waits for that pin, and the machine is not at 0. Nothing is missed within the first tick."""
    bench.virtual.text("G1X1F1000\n")
    bench.run(2)
    bench.virtual.run(0.004)  # reports come between ticks
    bench.lib.link_lose(bench.pins.handle)
    bench.connect()
    for _ in range(200):
        bench.run(0.001 if not bench.pins["ready"] else 0)
    switch_on_as_linuxcnc(bench)
    bench.run(0.3)
    assert bench.is_open and not bench.pins["fault"]


def test_an_answer_to_the_switching_on_before(bench: Bench) -> None:
    """The network holds answers back while LinuxCNC is switched on, off and on."""
    bench.run(0.1)
    bench.wire.is_slow = True
    for is_on in (True, False, True):
        bench.pins["enable"] = is_on
        bench.run(0.05)
    bench.wire.is_slow = False
    bench.run(0.3)
    bench.each_servo = mover(bench, 0, 5.0, SPEED)
    bench.run(1)
    assert bench.virtual.position[0] == 1000 and not bench.pins["fault"]


def test_a_contact_36_minutes_ago(bench: Bench) -> None:
    """The controller's clock has 32 bits of us: half of them are not the past."""
    bench.virtual.lib.virtual_surface(bench.virtual.host, -400)
    bench.enable()
    G38(bench, -25.0, 8.0)
    bench.run_to(lambda: not bench.is_probing)
    bench.each_servo = mover(bench, 2, 1.0, SPEED)
    bench.run(1)
    for minutes in (20, 40):
        bench.wire.clock_us = minutes * 60 * 10**6
        bench.run(0.1)
    bench.pins["enable"] = False
    bench.run(0.3)
    bench.enable()


def test_a_reset_of_before_the_connection_is_none(bench: Bench) -> None:
    """No one unlocks a machine by what was pressed while it was not there."""
    bench.enable()
    bench.wire.dead = True
    bench.run(3)
    assert bench.lost and bench.pins["fault"]
    bench.pins["reset"] = True
    bench.wire.dead = False
    bench.pins["enable"] = False
    bench.connect()
    bench.run(0.3)
    assert bench.pins["connected"] and bench.pins["fault"]


def test_a_controller_that_has_started_anew(bench: Bench) -> None:
    """Its clock and its position begin again; reports of it are no late ones of the time before."""
    bench.wire.clock_us = 10**9
    bench.run(2)
    other = type(bench.virtual)(settings={76: 10})
    try:
        bench.virtual.sent, bench.wire.clock_us = [], 0
        bench.wire.virtual = other
        other.raw(bench.wire.registration)
        bench.run(0.1)
        assert bench.lost == "the controller has restarted"
    finally:
        bench.wire.virtual = bench.virtual
        other.close()


def test_a_servo_time_that_stands_is_a_fault(bench: Bench) -> None:
    bench.enable()
    bench.each_servo = lambda: setattr(bench, "servo_s", 1000.0)
    bench.run(1.2)
    assert bench.pins["fault"] and not bench.is_open


@pytest.mark.parametrize("servo_s", [math.nan, -1e9])
def test_a_servo_time_that_is_none_moves_nothing(bench: Bench, servo_s: float) -> None:
    bench.enable()
    bench.each_servo = lambda: setattr(bench, "servo_s", servo_s)
    bench.run(1.2)
    assert bench.pins["fault"] and not bench.is_open


# ---- e-stop ----


def press_estop(bench: Bench) -> None:
    bench.enable()
    bench.pins["estop"], bench.pins["enable"] = True, False
    bench.run(0.2)
    assert bench.pins["estopped"]


def test_a_reset_that_comes_before_the_end_of_the_estop(bench: Bench) -> None:
    """LinuxCNC says both in one report; its threads bring one some periods later, and the reset is a short pulse."""
    press_estop(bench)
    bench.pins["reset"] = True
    bench.run(0.02)
    bench.pins["reset"] = bench.pins["estop"] = False
    bench.run(0.2)
    assert bench.pins["estop-ok"] and bench.pins["ready"]


def test_an_estop_that_stays_is_not_reset_when_it_ends(bench: Bench) -> None:
    press_estop(bench)
    bench.pins["reset"] = True
    bench.run(1)
    bench.pins["estop"] = False
    bench.run(0.5)
    assert bench.pins["estopped"] and not bench.pins["estop-ok"]


# ---- probing ----


def test_probing_again_at_once_watches_anew(bench: Bench) -> None:
    """G38.4 off the plate, and G38.2 3 ms later: both are within one segment."""
    bench.virtual.lib.virtual_surface(bench.virtual.host, -400)
    bench.enable()
    bench.each_servo = mover(bench, 2, -2.5, SPEED)
    bench.run(1)
    bench.is_probing = True
    bench.each_servo = mover(bench, 2, 0.0, 5.0)
    bench.run(2)
    assert not bench.pins["probe"]
    bench.is_probing = False
    bench.run(0.003)
    probe = G38(bench, -25.0, 8.0)
    bench.run_to(lambda: not bench.is_probing)
    assert probe.probed == [0.0, 0.0, -2.0]
    brakes = (8.0 * SCALE) ** 2 / (2 * 100_000) + 0.007 * 8.0 * SCALE + 1  # 7 ms: what is emitted ahead is still gone
    assert -400 - bench.virtual.position[2] <= brakes, "it was the controller that stopped at the contact"


# ---- homing ----


def homes_asked(bench: Bench) -> list[int]:
    return [packet.payload.axes for packet in bench.wire.requests if isinstance(packet.payload, Home)]


def test_a_joint_that_asks_while_another_homes_is_homed_next(make_bench: Callable[..., Bench]) -> None:
    bench = homing_bench(make_bench)
    first = HomeByIndex(bench, [0])
    bench.run(1)
    assert bench.pins["homing"]
    bench.pins["joint.1.index-enable"] = True
    second = HomeByIndex(bench, [0, 1])
    del first
    bench.run_to(lambda: not second.left, 60)
    assert homes_asked(bench) == [1, 2]
    assert bench.virtual.position[:2] == [-3800, -3800] and bench.feedback[:2] == [-19.0, -19.0]
    assert not bench.pins["fault"]


@pytest.mark.parametrize("gives_up", ["index-enable", "enable"])
def test_homing_that_linuxcnc_gives_up_is_stopped(make_bench: Callable[..., Bench], gives_up: str) -> None:
    """Escape, or machine off: the controller does not continue to its switches."""
    bench = homing_bench(make_bench)
    HomeByIndex(bench, [0, 1])
    bench.run(1)
    assert bench.pins["homing"] and bench.status and bench.status.state == State.HOMING
    bench.each_servo = lambda: None
    for joint in (0, 1):
        bench.pins[f"joint.{joint}.index-enable"] = False
    if gives_up == "enable":
        bench.pins["enable"] = False
    at = bench.virtual.position
    bench.run(1)
    assert bench.virtual.position == bench.virtual.pulses
    assert max(abs(a - b) for a, b in zip(at, bench.virtual.position, strict=True)) <= 0.05 * 20_000
    assert bench.pins["fault"] and bench.pins["estopped"] and not bench.pins["estop-ok"]
    assert bench.feedback[0] == bench.virtual.position[0] / SCALE
    reset(bench)
    switch_on_as_linuxcnc(bench)
    bench.run(0.3)
    assert bench.is_open


def test_homing_that_is_given_up_before_it_begins(make_bench: Callable[..., Bench]) -> None:
    """What is queued is still executed; then nothing homes, and commands are followed again."""
    bench = homing_bench(make_bench)
    bench.each_servo = mover(bench, 0, 3.0, SPEED)
    bench.run(0.25)
    bench.pins["joint.1.index-enable"] = True
    bench.run(0.02)
    bench.pins["joint.1.index-enable"] = False
    bench.run(1)
    assert homes_asked(bench) == [] and bench.virtual.position[:3] == [600, 0, 0]
    assert not bench.pins["fault"] and bench.feedback[0] == 3.0


def test_an_alarm_while_it_homes(make_bench: Callable[..., Bench]) -> None:
    bench = homing_bench(make_bench)
    HomeByIndex(bench, [0])
    bench.run(1)
    bench.virtual.input("estop", True)
    bench.run(0.2)
    assert bench.pins["fault"] and not bench.pins["estop-ok"] and not bench.pins["homing"]
    assert bench.pins["joint.0.index-enable"], "it is not homed"
