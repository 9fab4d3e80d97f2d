"""Homed joints of LinuxCNC in the controller's coordinates: when those are lost, nothing moves before homing."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from pathlib import Path

import pytest
from link_bench import SWITCHES, Bench, HomeByIndex, mover
from wificnc.connection.wmc3.layout import State
from wire_device import Device

SPEED = 20.0
JOINTS = range(3)


@pytest.fixture
def make_controller(tmp_path: Path) -> Iterator[Callable[..., Device]]:
    """The same controller each time, as it is at power-on."""
    made: list[Device] = []

    def make(settings: dict[int, float]) -> Device:
        if made:
            made[-1].close()
            made[-1] = Device(settings={}, store=str(tmp_path / "store"))
        else:
            made.append(Device(settings={76: 10, **settings}, store=str(tmp_path / "store")))
        for axis, low in enumerate((-1000, -500, -800)):
            made[-1].lib.virtual_travel(made[-1].host, axis, low, 9000)
        return made[-1]

    yield make
    made[-1].close()


def show_homed(bench: Bench, homed: bool = True) -> None:
    """LinuxCNC says so."""
    for joint in JOINTS:
        bench.pins[f"joint.{joint}.homed"] = homed


def home(bench: Bench) -> None:
    show_homed(bench, False)
    homing = HomeByIndex(bench, list(JOINTS))
    bench.run_to(lambda: not homing.left, 60)
    show_homed(bench)
    bench.each_servo = lambda: None
    bench.run(0.1)


def unhome_asked(bench: Bench) -> set[int]:
    """Joints with a rising edge of unhome within a second."""
    asked: set[int] = set()
    for _ in range(100):
        before = {joint for joint in JOINTS if bench.pins[f"joint.{joint}.unhome"]}
        bench.run(0.01)
        asked |= {joint for joint in JOINTS if bench.pins[f"joint.{joint}.unhome"]} - before
    return asked


def is_refused(bench: Bench) -> bool:
    return not bench.pins["estop-ok"] and not bench.pins["ready"]


def test_a_machine_with_switches_is_homed_again_after_power_off(make_controller: Callable[..., Device]) -> None:
    bench = Bench(make_controller(SWITCHES))
    bench.enable()
    home(bench)
    bench.each_servo = mover(bench, 0, -10.0, SPEED)
    bench.run(2)
    assert bench.virtual.position[0] == -2000 and bench.pins["ready"] and unhome_asked(bench) == set()
    bench.pins["enable"] = False
    bench.power_cycle(make_controller(SWITCHES))
    bench.run(0.5)
    assert is_refused(bench) and bench.pins["message.unhomed"] and unhome_asked(bench) == {0, 1, 2}
    bench.pins["enable"] = True
    bench.run(1)
    assert not bench.is_open, "not even if LinuxCNC is switched on against it"
    bench.press_reset()
    assert is_refused(bench) and not bench.pins["reset-done"], "the operator cannot reset that away"
    show_homed(bench, False)
    bench.run(0.1)
    assert bench.pins["estop-ok"] and bench.pins["locked"] and bench.virtual.state == "Alarm"
    bench.press_reset()
    assert bench.pins["locked"] and bench.virtual.state == "Alarm", "the power-on lock stays"
    bench.switch_on()
    bench.run(0.2)
    assert bench.pins["message.home-first"] and not bench.pins["fault"]
    home(bench)
    assert bench.virtual.state != "Alarm" and not bench.pins["locked"] and not bench.pins["fault"]
    assert bench.virtual.position[:3] == [-3800] * 3 and unhome_asked(bench) == set()
    bench.each_servo = mover(bench, 0, -15.0, SPEED)
    bench.run(2)
    assert bench.virtual.position[0] == -3000 and not bench.pins["fault"]


def test_locked_it_only_homes(make_controller: Callable[..., Device]) -> None:
    make_controller(SWITCHES)
    bench = Bench(make_controller(SWITCHES))
    bench.run(0.3)
    bench.switch_on()
    bench.run(0.1)
    bench.each_servo = mover(bench, 0, 5.0, SPEED)
    bench.run(0.5)
    assert bench.pins["fault"] and "only homing" in bench.said[-1]
    assert bench.virtual.position[0] == 0 and bench.virtual.state == "Alarm"


def test_an_axis_at_a_time(make_controller: Callable[..., Device]) -> None:
    """Each press of Home leads to a homed joint, whatever the controller makes of the others."""
    make_controller(SWITCHES)
    bench = Bench(make_controller(SWITCHES))
    bench.run(0.3)
    bench.switch_on()
    bench.run(0.1)
    for joint in JOINTS:
        homing = HomeByIndex(bench, [joint])
        bench.run_to(lambda homing=homing: not homing.left, 60)  # type: ignore[misc]
        bench.pins[f"joint.{joint}.homed"] = True
        bench.run(0.3)
        assert not bench.pins["fault"]
    assert bench.virtual.position[:3] == [-3800] * 3 and bench.is_open


def test_a_homed_axis_of_a_locked_controller_does_not_move(make_controller: Callable[..., Device]) -> None:
    make_controller(SWITCHES)
    bench = Bench(make_controller(SWITCHES))
    bench.run(0.3)
    bench.switch_on()
    bench.run(0.1)
    homing = HomeByIndex(bench, [0])
    bench.run_to(lambda: not homing.left, 60)
    bench.pins["joint.0.homed"] = True
    bench.run(0.3)
    assert not bench.pins["fault"] and bench.pins["locked"]
    bench.each_servo = mover(bench, 0, -15.0, SPEED)
    bench.run(0.5)
    assert bench.pins["fault"] and "only homing" in bench.said[-1]
    assert bench.virtual.position[0] == -3800 and bench.virtual.state == "Alarm"


def test_linuxcncs_estop_does_not_unlock(make_controller: Callable[..., Device]) -> None:
    """It is pressed when LinuxCNC starts, and left by the operator."""
    make_controller(SWITCHES)
    bench = Bench(make_controller(SWITCHES))
    bench.pins["estop"] = True
    bench.run(0.5)
    assert bench.status and bench.status.state == State.ESTOP and not bench.pins["estop-ok"]
    bench.press_reset()
    bench.run(0.2)
    assert bench.pins["locked"] and bench.pins["estop-ok"] and bench.virtual.state == "Alarm"


def test_home_where_it_stands_is_the_operators_word(make_controller: Callable[..., Device]) -> None:
    """A configuration without switches, on a controller that is locked: the lock ends when every joint is homed."""
    make_controller(SWITCHES)
    bench = Bench(make_controller(SWITCHES))
    bench.run(0.3)
    bench.switch_on()
    for joint in (0, 1):
        bench.run(0.3)
        bench.pins[f"joint.{joint}.homed"] = True
    bench.run(0.3)
    assert bench.virtual.state == "Alarm" and not bench.is_open
    bench.pins["joint.2.homed"] = True
    bench.run(0.5)
    assert bench.virtual.state != "Alarm" and bench.is_open and not bench.pins["fault"]


def test_homed_where_it_stood_is_lost_with_the_power(make_controller: Callable[..., Device]) -> None:
    bench = Bench(make_controller({}))
    bench.enable()
    show_homed(bench)
    bench.each_servo = mover(bench, 0, -10.0, SPEED)
    bench.run(2)
    bench.pins["enable"] = False
    bench.power_cycle(make_controller({}))
    bench.run(0.5)
    assert is_refused(bench) and unhome_asked(bench) == {0, 1, 2}
    show_homed(bench, False)
    bench.run(0.1)
    bench.press_reset()
    bench.switch_on()
    bench.run(0.3)
    assert bench.is_open and not bench.pins["fault"]


@pytest.mark.parametrize("switches", [True, False])
def test_an_estop_in_motion_loses_the_position(make_controller: Callable[..., Device], switches: bool) -> None:
    bench = Bench(make_controller(SWITCHES if switches else {}))
    bench.enable()
    if switches:
        home(bench)
    show_homed(bench)
    bench.each_servo = mover(bench, 0, bench.command[0] + 15.0, SPEED)
    bench.run(0.4)
    bench.virtual.input("estop", True)
    bench.run(0.1)
    assert bench.pins["fault"] and bench.pins["message.estop"]
    bench.pins["enable"] = False
    bench.virtual.input("estop", False)
    bench.press_reset()
    assert is_refused(bench) and unhome_asked(bench) == {0, 1, 2}
    show_homed(bench, False)
    bench.press_reset()
    assert bench.pins["estop-ok"]


@pytest.mark.parametrize("switches", [True, False])
def test_an_estop_at_rest_loses_nothing(make_controller: Callable[..., Device], switches: bool) -> None:
    bench = Bench(make_controller(SWITCHES if switches else {}))
    bench.enable()
    if switches:
        home(bench)
    show_homed(bench)
    bench.run(0.5)
    bench.pins["enable"] = False
    bench.virtual.input("estop", True)
    bench.run(0.3)
    assert not bench.pins["estop-ok"]
    bench.virtual.input("estop", False)
    bench.press_reset()
    bench.run(0.2)
    assert bench.pins["estop-ok"] and unhome_asked(bench) == set()


@pytest.mark.parametrize("gone_s", [1.5, 10.0])
def test_a_network_that_was_gone_loses_nothing(bench: Bench, gone_s: float) -> None:
    bench.enable()
    show_homed(bench)
    bench.run(0.1)
    bench.wire.dead = True
    bench.run(gone_s)
    assert bench.lost and bench.pins["message.link-lost"]
    bench.pins["enable"] = False
    bench.wire.dead = False
    bench.connect()
    bench.run(0.3)
    assert not bench.pins["message.link-lost"]
    bench.press_reset()
    assert bench.pins["estop-ok"] and bench.pins["ready"] and unhome_asked(bench) == set()


def test_a_controller_that_was_off_for_long(make_controller: Callable[..., Device]) -> None:
    """It has run for longer than when it was last seen: what counts is how long it can have run."""
    bench = Bench(make_controller({}))
    bench.enable()
    show_homed(bench)
    bench.run(0.5)
    bench.pins["enable"] = False
    other = make_controller({})
    other.run(20)
    bench.power_cycle(other, off_s=30)
    bench.run(0.5)
    assert is_refused(bench) and unhome_asked(bench) == {0, 1, 2}


def test_joints_that_were_homed_before_the_component_began(bench: Bench) -> None:
    """No one has watched what happened meanwhile."""
    other = Bench(bench.virtual)
    show_homed(other)
    other.link = other.lib.component_link()
    other.wire.answers.clear()
    other.connect()
    other.run(0.5)
    assert is_refused(other) and unhome_asked(other) == {0, 1, 2}
