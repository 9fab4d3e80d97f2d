"""What docs/linuxcnc.md promises of failures in motion, at a machine that moves at 90 mm/s."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest
from link_bench import SCALE, Bench, Feed, homing_bench, mover
from wificnc.connection.wmc3.layout import Home, Refusal, Refused, StreamOpen, StreamOpened
from wire_device import ACCEL, OTHER

SPEED = 90.0
WINDOW_S = 0.01


def moving(bench: Bench) -> None:
    bench.enable()
    for joint in bench.joints:
        bench.pins[f"joint.{joint}.homed"] = True
    bench.each_servo = mover(bench, 0, 500.0, SPEED)
    bench.run(1)
    assert bench.virtual.position[0] > 0.7 * SPEED * SCALE


def worst_acceleration(bench: Bench) -> float:
    """Of the first axis, in windows of 10 ms, as part of its limit."""
    times, signs = bench.virtual.edges(0)
    grid = np.arange(times[0] - WINDOW_S, times[-1] + 3 * WINDOW_S, WINDOW_S)
    position = np.concatenate([[0], np.cumsum(signs)])[np.searchsorted(times, grid)]
    grain = 1 / WINDOW_S**2  # a step more or less in a window
    return float((np.abs(np.diff(position, 2)) / WINDOW_S**2 - grain).max() / ACCEL)


def stands(bench: Bench) -> bool:
    at = bench.virtual.position
    bench.run(0.5)
    return at == bench.virtual.position == bench.virtual.pulses


@pytest.mark.parametrize("how", ["killed", "stopped", "network"])
def test_without_its_host_the_controller_stops_within_its_limits(bench: Bench, how: str) -> None:
    """The component or LinuxCNC is killed (its connection ends), its process does not run, the network is gone."""
    moving(bench)
    at = bench.virtual.position[0]
    bench.wire.dead = True
    if how == "killed":
        bench.virtual.disconnect(bench.wire.client)
    if how == "stopped":
        bench.is_held_up = True
    bench.run(2)
    assert worst_acceleration(bench) < 1.2 and stands(bench)
    queue_and_brakes = 0.12 * SPEED * SCALE + (SPEED * SCALE) ** 2 / (2 * ACCEL)
    assert bench.virtual.position[0] - at < 1.05 * queue_and_brakes


@pytest.mark.parametrize("line", ["\x18", "limit-x"])
def test_a_hard_stop_in_motion(make_bench: Callable[..., Bench], line: str) -> None:
    """A reset at the controller, or a limit switch: steps may be lost, and LinuxCNC is unhomed."""
    bench = make_bench(settings={21: 1})
    moving(bench)
    if line == "\x18":
        bench.virtual.text(line)
    else:
        bench.virtual.input(line, True)
    bench.run(0.2)
    assert bench.pins["fault"] and not bench.pins["estop-ok"] and bench.pins["message.unhomed"]
    message = "message.ended" if line == "\x18" else "message.limit"
    assert bench.pins[message], [name for name in ("message.ended", "message.alarm") if bench.pins[name]]
    bench.pins["enable"] = False
    bench.run(0.1)
    if line != "\x18":
        bench.virtual.input(line, False)
    for joint in bench.joints:
        bench.pins[f"joint.{joint}.homed"] = False
    bench.press_reset()
    assert bench.pins["estop-ok"] and not bench.pins[message] and stands(bench)


def test_linuxcncs_own_estop_in_motion(bench: Bench) -> None:
    """It asks for that: no fault, no message but that joints are to be homed."""
    moving(bench)
    bench.pins["estop"], bench.pins["enable"] = True, False
    bench.run(0.3)
    assert not bench.pins["fault"] and not bench.pins["message.estop"] and bench.pins["message.unhomed"]
    for joint in bench.joints:
        bench.pins[f"joint.{joint}.homed"] = False
    bench.press_reset()
    assert bench.pins["estop-ok"] and stands(bench)


def test_an_estop_button_says_so(bench: Bench) -> None:
    moving(bench)
    bench.virtual.input("estop", True)
    bench.run(0.15)
    assert bench.pins["message.estop"] and not bench.pins["message.ended"] and not bench.pins["estop-ok"]
    bench.pins["enable"] = False
    bench.press_reset()
    assert not bench.pins["estop-ok"], "it is still pressed"
    bench.virtual.input("estop", False)
    bench.run(1)
    assert not bench.pins["estop-ok"], "releasing it is not enough"


def test_another_host_cannot_take_motion_over(bench: Bench) -> None:
    moving(bench)
    other = bench.virtual.connect(OTHER)
    opened = bench.virtual.request(other, StreamOpen()).payload
    homes = bench.virtual.request(other, Home(axes=1)).payload
    assert isinstance(opened, StreamOpened) and opened.refusal == Refusal.OWNER
    assert isinstance(homes, Refused) and homes.reason == Refusal.OWNER
    bench.run(1)
    assert not bench.pins["fault"]
    bench.pins["enable"] = False
    assert not stands(bench) and stands(bench) and worst_acceleration(bench) < 1.2


def test_another_host_that_commands_while_linuxcnc_is_gone(bench: Bench) -> None:
    bench.run(1)
    bench.virtual.disconnect(bench.wire.client)
    bench.wire.dead = True
    bench.run(5)
    other = bench.virtual.connect(OTHER)
    opened = bench.virtual.request(other, StreamOpen()).payload
    assert isinstance(opened, StreamOpened) and opened.refusal == Refusal.NONE
    bench.wire.dead = False
    bench.wire.client = bench.virtual.connect()
    bench.wire.answers.clear()
    bench.connect()
    bench.run(0.3)
    bench.press_reset()
    bench.switch_on()
    bench.run(1.5)
    assert bench.pins["fault"] and bench.pins["message.refused"] and not bench.is_open
    assert "another host is in control" in bench.said[-1]


def test_a_component_that_begins_again_while_linuxcnc_is_on(bench: Bench) -> None:
    """It takes no motion before LinuxCNC is homed and switched on again."""
    moving(bench)
    bench.virtual.disconnect(bench.wire.client)
    bench.link = bench.lib.component_link()
    bench.wire.client = bench.virtual.connect()
    bench.wire.answers.clear()
    bench.connect()
    bench.run(1)
    assert not bench.is_open and not bench.pins["estop-ok"] and not bench.pins["ready"] and stands(bench)
    assert worst_acceleration(bench) < 1.2


def test_homing_that_is_cut_by_the_network(make_bench: Callable[..., Bench]) -> None:
    """The controller ends its homing by itself, as it has begun it; LinuxCNC is in e-stop."""
    bench = homing_bench(make_bench)
    for joint in bench.joints:
        bench.pins[f"joint.{joint}.index-enable"] = True
    bench.run(1)
    bench.wire.dead = True
    bench.run(30)
    assert bench.lost and not bench.pins["estop-ok"] and bench.virtual.position[:3] == [-3800] * 3
    bench.run(1)
    assert bench.virtual.position[:3] == [-3800] * 3, "a pull-off of 1 mm from the low ends at -20"


def test_a_door_is_a_hold(make_bench: Callable[..., Bench]) -> None:
    bench = make_bench()
    bench.enable()
    Feed(bench, 0, 30.0, 20.0)
    bench.run(0.5)
    bench.virtual.input("door", True)
    bench.run(5)
    assert bench.pins["held"] and not bench.pins["fault"] and stands(bench)
    bench.virtual.input("door", False)
    bench.virtual.text("~")
    bench.run(8)
    assert bench.virtual.position[0] == 30 * SCALE == bench.virtual.pulses[0] and not bench.pins["fault"]


@pytest.mark.parametrize("how", ["killed", "network"])
def test_a_component_that_was_lost_in_motion_is_back_after_a_reset(bench: Bench, how: str) -> None:
    """The controller holds what it had ($74=1). It needs no visit to its text side: leaving LinuxCNC's e-stop is
    enough, in which LinuxCNC starts, and which it enters when the component has lost its connection."""
    moving(bench)
    bench.wire.dead = True
    bench.virtual.disconnect(bench.wire.client)
    bench.run(3)
    assert bench.virtual.state == "Hold:0" and stands(bench)
    if how == "killed":
        bench.link = bench.lib.component_link()
    bench.pins["enable"] = False
    bench.pins["estop"] = True
    bench.wire.dead = False
    bench.wire.client = bench.virtual.connect()
    bench.wire.answers.clear()
    bench.connect()
    for joint in bench.joints:
        bench.pins[f"joint.{joint}.homed"] = False
    bench.run(1)
    bench.press_reset()
    bench.run(1)
    assert bench.virtual.state == "Idle" and stands(bench)
    at = bench.virtual.position[0]
    bench.switch_on()
    bench.run(1)
    assert bench.is_open
    Feed(bench, 0, at / SCALE + 5.0, SPEED)
    bench.run(3)
    assert bench.virtual.position[0] == at + 5 * SCALE and not bench.pins["fault"]
