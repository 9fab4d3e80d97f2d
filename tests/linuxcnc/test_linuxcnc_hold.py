"""A hold at the controller, or a network that is too slow: LinuxCNC waits, and nothing moves when it is off."""

from __future__ import annotations

from collections.abc import Callable

import pytest
from link_bench import SCALE, Bench, Feed, mover
from wificnc.linuxcnc.config import following_error

SPEED = 20.0
REPORT_S = 0.05  # two of its reports, and the way to the pins


def feeding(bench: Bench, target: float = 30.0) -> None:
    bench.enable()
    Feed(bench, 0, target, SPEED)
    bench.run(0.5)


def test_linuxcnc_waits_as_long_as_the_controller_holds(bench: Bench) -> None:
    feeding(bench)
    bench.virtual.text("!")
    bench.run(REPORT_S)
    assert bench.pins["held"] and bench.pins["feed-inhibit"] and bench.pins["message.held"]
    bench.run(1)
    held, commanded = bench.virtual.position, list(bench.command)
    bench.run(20)
    assert bench.virtual.position == held and bench.command == commanded
    assert not bench.pins["fault"] and bench.is_open
    bench.virtual.text("~")
    bench.run(REPORT_S)
    assert not bench.pins["held"] and not bench.pins["feed-inhibit"] and not bench.pins["message.held"]
    bench.run(3)
    assert bench.virtual.position[0] == 30 * SCALE == bench.virtual.pulses[0]
    assert not any(bench.virtual.edges(0)[1] < 0) and not bench.pins["fault"]


@pytest.mark.parametrize("how", ["enable", "estop"])
def test_what_is_held_is_given_up_when_linuxcnc_goes_off(bench: Bench, how: str) -> None:
    feeding(bench)
    bench.virtual.text("!")
    bench.run(0.5)
    bench.pins["estop"], bench.pins["enable"] = how == "estop", False
    bench.run(0.3)
    held = bench.virtual.position
    bench.virtual.text("~")
    bench.run(2)
    assert bench.virtual.position == held == bench.virtual.pulses
    bench.press_reset()
    bench.switch_on()
    bench.run(0.3)
    assert bench.is_open and not bench.pins["fault"]
    Feed(bench, 0, 30.0, SPEED)
    bench.run(3)
    assert bench.virtual.position[0] == 30 * SCALE


def test_a_link_that_is_lost_in_a_hold_leaves_nothing_behind(bench: Bench) -> None:
    feeding(bench)
    bench.virtual.text("!")
    bench.run(0.5)
    bench.wire.dead = True
    bench.run(1.5)
    bench.pins["enable"] = False
    bench.wire.dead = False
    bench.connect()
    bench.run(0.3)
    held = bench.virtual.position
    bench.virtual.text("~")
    bench.run(2)
    assert bench.virtual.position == held


def test_a_jog_that_does_not_wait_is_a_fault_that_says_why(bench: Bench) -> None:
    """LinuxCNC's feed-inhibit stops no jogs."""
    bench.enable()
    bench.each_servo = mover(bench, 0, 400.0, SPEED)
    bench.run(0.5)
    bench.virtual.text("!")
    bench.run(3)
    assert bench.pins["fault"] and bench.pins["message.held"] and "in a feed hold" in bench.said[0]
    held = bench.virtual.position
    bench.pins["enable"] = False
    bench.virtual.text("~")
    bench.run(2)
    assert bench.virtual.position == held


@pytest.mark.alike(1)
@pytest.mark.parametrize("gone_s", [0.1, 0.5, 0.9])
def test_a_network_that_is_gone_for_less_than_a_second(bench: Bench, gone_s: float) -> None:
    """The machine may be at rest meanwhile, and LinuxCNC waits for it. Every step is made once."""
    feeding(bench)
    bench.wire.dead = True
    furthest_s = 0.0
    for _ in range(round(gone_s / 0.01)):
        bench.run(0.01)
    bench.wire.dead = False
    waited = bench.pins["feed-inhibit"]
    for _ in range(300):
        bench.run(0.01)
        furthest_s = max(furthest_s, (bench.command[0] - bench.feedback[0]) / SPEED)
    assert waited == (gone_s > 0.3) and not bench.pins["feed-inhibit"]
    assert furthest_s < 0.5, "LinuxCNC does not run away from the machine"
    bench.run(2)
    assert bench.virtual.position[0] == 30 * SCALE == bench.virtual.pulses[0] and not bench.pins["fault"]


def test_switched_off_in_motion_it_stops_by_a_ramp(bench: Bench) -> None:
    bench.enable()
    bench.each_servo = mover(bench, 0, 300.0, 90.0)
    bench.run(1)
    bench.pins["enable"] = False
    at = bench.virtual.position[0]
    bench.run(1)
    speed, accel = 90.0 * SCALE, 500.0 * SCALE
    way = bench.virtual.position[0] - at
    assert 0.9 * speed * speed / (2 * accel) < way < speed * speed / (2 * accel) + 0.03 * speed
    assert bench.feedback[0] == bench.virtual.position[0] / SCALE


def test_a_machine_that_stands_elsewhere_is_a_fault(bench: Bench) -> None:
    """At rest nothing is behind any more: one step is too much."""
    bench.enable()
    bench.each_servo = mover(bench, 0, 2.0, SPEED)
    bench.run(1)
    assert not bench.pins["fault"]
    bench.wire.shift_steps = 1
    bench.run(0.1)
    assert bench.pins["fault"] and bench.pins["message.moved"]
    assert bench.said == ["joint 0 is at step 401 and was sent to step 400"]


# ---- following error ----


class Followed(Feed):
    """A joint that LinuxCNC moves there and back, and what is left of the following error that it allows."""

    def __init__(self, bench: Bench, speed: float, accel: float) -> None:
        super().__init__(bench, 0, 80.0, speed, accel)
        self.most, self.least = following_error(speed, accel)
        self.room, self.waited = self.least, False

    def step(self) -> None:
        super().step()
        if self.bench.command[0] == self.target:
            self.target = 80.0 - self.target
        error = abs(self.bench.command[0] - self.bench.feedback[0])
        self.room = min(self.room, max(self.least, self.most * self.v / self.speed) - error)
        self.waited |= self.bench.pins["feed-inhibit"]


@pytest.mark.parametrize("lost_s", [0.1, 0.4, 0.8])
def test_reports_that_are_lost_alone_make_linuxcnc_wait(make_bench: Callable[..., Bench], lost_s: float) -> None:
    """Motion is acknowledged, and LinuxCNC does not see it: it must not run away from what it sees."""
    bench = make_bench(settings={76: 50})
    bench.enable()
    joint = Followed(bench, 40.0, 400.0)
    bench.run(1.0)
    assert not joint.waited
    bench.wire.loses_status = True
    bench.run(lost_s)
    bench.wire.loses_status = False
    bench.run(2)
    assert joint.waited == (lost_s > 0.3) and not bench.pins["fault"]
    assert joint.room > 0 and joint.v > 0, "it continues"


@pytest.mark.alike(2)
@pytest.mark.parametrize("loss", [0.0, 0.03, 0.1, 0.2, 0.3])
def test_a_lossy_network_stays_within_the_following_error(make_bench: Callable[..., Bench], loss: float) -> None:
    """At its top speed and acceleration, without a rest. Datagrams take up to 20 ms, so they overtake one another."""
    bench = make_bench(settings={76: 50, 110: 5000, 120: 400})
    bench.enable()
    bench.wire.loss, bench.wire.delay_s = loss, 0.02
    joint = Followed(bench, 5000 / 60, 400.0)
    bench.run(12)
    assert joint.room > 0 and not bench.pins["fault"]
