"""A network host and a laser ($32): the beam rule of docs/laser.md holds for its motion, too; and outputs that the
board lacks are not switched."""

from __future__ import annotations

from collections.abc import Callable

import pytest
from test_motion import segment
from test_session import reason
from wificnc.connection.wmc3.layout import Estop, Hold, IoControl, Jog, JogStop, Refusal, Reset, SegmentFlag, Type
from wire_device import Device

Make = Callable[..., Device]
SLOW = 5  # steps in 10 ms: 500 steps/s, reached in 5 ms


@pytest.fixture(params=[1, 2])
def lit(make_device: Make, request: pytest.FixtureRequest) -> Device:
    """A laser that a host has switched on, M3 or M4, at rest."""
    device = make_device(settings={32: 1, 30: 1000})
    device.send(IoControl(spindle=request.param, rpm=800))
    device.run(0.05)
    return device


def duties(device: Device, seconds: float) -> set[int]:
    seen = set()
    for _ in range(round(seconds * 1000)):
        device.run(0.001)
        seen.add(device.duty())
    return seen


def test_dark_at_rest(lit: Device) -> None:
    assert lit.duty() == 0


def test_lit_while_its_segments_move_and_dark_before_and_after(lit: Device) -> None:
    """All of S, M4 too: the host plans the speed, so it scales S itself."""
    lit.motion(*[segment(SLOW) for _ in range(8)])
    lit.run(0.04)
    assert lit.duty() == pytest.approx(0.8 * 65535, abs=1)
    lit.run(0.06)
    assert duties(lit, 0.1) == {0}


@pytest.mark.parametrize("flags", [SegmentFlag.RAPID, SegmentFlag.PROBE])
def test_dark_in_what_it_calls_no_cut(lit: Device, flags: int) -> None:
    lit.motion(*[segment(SLOW, flags=flags) for _ in range(8)])
    assert duties(lit, 0.12) == {0}
    assert lit.pulses[0] == 8 * SLOW


def test_dark_while_its_segments_stand(lit: Device) -> None:
    """Time without steps is a dwell."""
    lit.motion(segment(SLOW), *[segment(0, us=40_000) for _ in range(3)], segment(SLOW))
    lit.run(0.03)
    assert duties(lit, 0.08) == {0}


def test_dark_when_its_hold_rests(lit: Device) -> None:
    lit.motion(*[segment(SLOW) for _ in range(8)])
    lit.run(0.03)
    lit.send(Hold())
    lit.run(0.02)
    assert duties(lit, 0.2) == {0}


def test_dark_in_its_jog(lit: Device) -> None:
    lit.send(Jog(axis=0, direction=1, speed_steps_s=2000))
    assert duties(lit, 0.2) == {0}
    lit.send(JogStop(0xFF))
    assert duties(lit, 0.3) == {0}
    assert lit.pulses[0] > 100


def test_dark_after_its_estop(lit: Device) -> None:
    lit.motion(*[segment(SLOW) for _ in range(8)])
    lit.run(0.03)
    lit.send(Estop())
    assert duties(lit, 0.2) == {0}


def test_dark_when_it_is_gone(lit: Device) -> None:
    """The queue runs dry and nothing follows: $77 later the spindle is off, and it was dark all the time."""
    lit.motion(*[segment(SLOW) for _ in range(8)])
    lit.run(0.1)
    assert duties(lit, 3.0) == {0}


@pytest.mark.parametrize("passes", [0, 1])
@pytest.mark.parametrize(("missing", "coolant", "refused"), [(0, 3, 0), (8, 2, 0), (8, 1, 1), (16, 1, 0), (16, 3, 1)])
def test_coolant_that_the_board_lacks_is_refused(
    make_device: Make, missing: int, coolant: int, refused: int, passes: int
) -> None:
    """As a whole, and whatever $91 says: its message goes to senders of G-code, and a host would see nothing.
    missing: BOARD_OUTPUT_ bits; packets have flood as bit 0, the core as bit 1."""
    device = make_device(missing_outputs=missing, settings={91: passes})
    client = device.connect()
    answer = reason(device, client, IoControl(misc_outputs=1, spindle=1, rpm=500, coolant=coolant))
    assert answer == (Refusal.NO_OUTPUT if refused else Refusal.NONE)
    device.send(JogStop(0xFF))
    device.run(0.06)
    assert device.status.coolant == (0 if refused else coolant)
    assert device.outputs().coolant == (0 if refused else {1: 2, 2: 1, 3: 3}[coolant])
    assert (device.outputs().spindle_direction, device.status.misc_outputs) == ((0, 0) if refused else (1, 1))
    assert reason(device, client, IoControl()) == Refusal.NONE


@pytest.mark.parametrize(("missing", "spindle", "refused"), [(0, 2, False), (4, 2, True), (4, 1, False), (1, 1, True)])
def test_a_spindle_that_the_board_cannot_turn_is_refused(
    make_device: Make, missing: int, spindle: int, refused: bool
) -> None:
    device = make_device(missing_outputs=missing)
    client = device.connect()
    reply = device.request(client, IoControl(spindle=spindle, rpm=500))
    assert (reply.header.type == Type.REFUSED) == refused
    if refused:
        assert reply.payload.reason == Refusal.NO_OUTPUT  # type: ignore[union-attr]
    assert device.outputs().spindle_direction == (0 if refused else {1: 1, 2: -1}[spindle])


def test_a_host_that_interrupts_a_cut_burns_nothing(make_device: Make) -> None:
    """The job's M3 is not the host's: its moves are dark until it lets go, and `~` lights the rest of the cut."""
    device = make_device(settings={32: 1, 30: 1000})
    device.text("G21 G90 M3 S1000\nG1 X20 F3000\n")
    device.run(0.3)
    assert device.duty() == 65535
    device.motion(*[segment(SLOW)] * 8)
    device.run(0.15)
    assert duties(device, 0.3) == {0}
    device.send(Reset())
    device.run(0.5)
    assert device.state == "Hold:0" and device.duty() == 0
    device.text("~")
    assert 65535 in duties(device, 1.0)
