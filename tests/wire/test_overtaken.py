"""Orders that the network has delayed or doubled: what comes behind a stop that was sent after it moves nothing."""

from __future__ import annotations

import pytest
from test_motion import segment
from test_session import REGISTER, statistics
from wificnc.connection.wmc3.layout import (
    Estop,
    Hold,
    IoControl,
    Jog,
    JogStop,
    Motion,
    Refusal,
    Reset,
    Resume,
    Segment,
    State,
)
from wificnc.connection.wmc3.packet import build
from wificnc.connection.wmc3.packing import Layout
from wire_device import OTHER, Device


def late(payload: Layout, sequence: int, segments: tuple[Segment, ...] = ()) -> bytes:
    """A datagram as it was sent: numbers and time stamps (us) in the order of sending."""
    return build(payload, sequence, 1_000_000 + 1000 * sequence, segments)


@pytest.mark.parametrize("stop", [JogStop(axis=0xFF), Estop(), Hold()])
@pytest.mark.parametrize("twice", [False, True], ids=["late", "doubled"])
def test_a_jog_that_comes_behind_its_stop_moves_nothing(device: Device, stop: Layout, twice: bool) -> None:
    device.send(REGISTER)
    jog = late(Jog(0, 1, 2000), 11)
    if twice:
        device.raw(jog)
        device.run(0.3)
    device.raw(late(stop, 12))
    device.run(1)
    if not isinstance(stop, JogStop):
        device.raw(late(Reset() if isinstance(stop, Estop) else Resume(), 13))
        device.run(1)
    stood = device.position[0]
    device.raw(jog)
    device.run(1)
    assert device.position[0] == stood
    device.raw(late(Jog(0, 1, 2000), 14))
    device.run(0.3)
    assert device.position[0] > stood, "the next one does"


def test_an_older_jog_replaces_no_newer_one(device: Device) -> None:
    device.raw(late(Jog(0, -1, 2000), 12))
    device.run(0.1)
    device.raw(late(Jog(0, 1, 2000), 11))
    device.run(0.5)
    assert device.position[0] < -500


def test_a_late_resume_ends_no_newer_hold(device: Device) -> None:
    device.motion(*[segment(100)] * 8)
    resume = late(Resume(), 12)
    device.raw(late(Hold(), 11))
    device.raw(resume)
    device.raw(late(Hold(), 13))
    device.run(1)
    stood = device.position[0]
    device.raw(resume)
    device.run(1)
    assert (device.status.state, device.position[0]) == (State.HOLD, stood)
    device.raw(late(Resume(), 14))
    device.run(1)
    assert device.position[0] == 800


def test_a_late_reset_ends_no_newer_estop(device: Device) -> None:
    device.send(REGISTER)
    reset = late(Reset(), 12)
    for data in (late(Estop(), 11), reset, late(Estop(), 13), reset):
        device.raw(data)
        device.run(0.1)
    assert device.status.state == State.ESTOP


def test_motion_from_before_an_estop_is_not_made_after_it(device: Device) -> None:
    device.raw(late(Motion(count=1), 11, (segment(100),)))
    device.raw(late(Estop(), 13))
    device.run(1)
    device.raw(late(Reset(), 14))
    device.run(1)
    stood = device.position[0]
    device.raw(late(Motion(count=1), 12, (segment(100),)))
    device.run(1)
    counts = statistics(device)
    assert device.position[0] == stood and (counts.refused_segments, counts.last_refusal) == (1, Refusal.OVERTAKEN)
    device.raw(late(Motion(count=1), 15, (segment(100),)))
    device.run(1)
    assert device.position[0] == stood + 100


def test_motion_from_before_a_hold_is_queued(device: Device) -> None:
    device.raw(late(Hold(), 13))
    device.raw(late(Motion(count=1), 12, (segment(100),)))
    device.run(0.1)
    device.raw(late(Resume(), 14))
    device.run(1)
    assert device.position[0] == 100


def test_older_outputs_do_not_undo_newer_ones(device: Device) -> None:
    device.raw(late(IoControl(spindle=0), 12))
    device.raw(late(IoControl(spindle=1, rpm=500), 11))
    device.run(0.1)
    assert device.status.spindle == 0
    device.raw(late(IoControl(spindle=1, rpm=500), 13))
    device.run(0.1)
    assert device.status.spindle == 1


def test_programs_that_begin_anew_or_have_no_clock_are_not_judged(device: Device) -> None:
    """A program that numbers from 0 each time it is started, and one that has no time stamps."""
    for begin_us in (1_000_000, 3_000_000):
        device.raw(build(Jog(0, 1, 2000), 1, begin_us))
        device.run(0.2)
        device.raw(build(JogStop(axis=0xFF), 2, begin_us + 200_000))
        device.run(0.3)
    assert device.position[0] > 700
    stood = device.position[0]
    for sequence, payload in ((12, JogStop(axis=0xFF)), (11, Jog(0, 1, 2000))):
        device.raw(build(payload, sequence, 0))
    device.run(0.5)
    assert device.position[0] > stood + 500


def test_another_hosts_stop_is_no_order_of_mine(device: Device) -> None:
    device.raw(late(JogStop(axis=0xFF), 12), OTHER)
    device.raw(late(Jog(0, 1, 2000), 11))
    device.run(0.5)
    assert device.position[0] > 500
