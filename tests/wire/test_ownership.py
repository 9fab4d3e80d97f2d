"""A refused command takes nothing; who wants to command takes it by a request that says so."""

from __future__ import annotations

from collections.abc import Callable

import pytest
from test_motion import segment
from test_session import REGISTER, reason, statistics
from test_stream import ack_of, open_stream
from wificnc.connection.wmc3.layout import (
    Estop,
    Hold,
    Home,
    IoControl,
    Jog,
    JogStop,
    Motion,
    Refusal,
    Resume,
    State,
    StreamOpen,
    StreamOpened,
    Take,
    Type,
)  # fmt: skip
from wificnc.connection.wmc3.packet import build
from wificnc.connection.wmc3.packing import Layout
from wire_device import HOST, OTHER, Device

NOBODY = (0, 0, 0, 0)


def owner(device: Device) -> tuple[int, ...]:
    return tuple(statistics(device).owner)


def bytes_of(address: str) -> tuple[int, ...]:
    return tuple(int(part) for part in address.split("."))


# ---- refused ----


@pytest.mark.parametrize(
    "payload",
    [Home(axes=1), Jog(9, 1, 1000), Jog(0, 3, 1000), IoControl(spindle=7), IoControl(coolant=2, spindle=9)],
    ids=["home", "jog-axis", "jog-direction", "spindle", "spindle-and-coolant"],
)
def test_a_refused_command_makes_nobody_the_owner(device: Device, payload: Layout) -> None:
    """Homing is off ($22=0)."""
    device.send(payload)
    assert owner(device) == NOBODY
    client = device.connect()
    assert reason(device, client, payload) != Refusal.NONE
    assert owner(device) == NOBODY
    device.motion(segment(100), address=OTHER)
    device.run(0.5)
    assert device.pulses[0] == 100, "who has something to do is not kept out"


def test_refused_motion_makes_nobody_the_owner(device: Device) -> None:
    device.send(Estop())
    device.motion(segment(100))
    client = device.connect()
    opened = device.request(client, StreamOpen()).payload
    assert isinstance(opened, StreamOpened) and opened.refusal == Refusal.LOCKED
    assert owner(device) == NOBODY


def test_segments_of_a_closed_stream_take_nothing(device: Device) -> None:
    client = device.connect()
    sender = open_stream(device, client)
    device.disconnect(client)
    device.run(3)
    assert owner(device) == NOBODY
    ack_of(device, sender, segment(100))
    assert owner(device) == NOBODY


def test_a_host_that_is_refused_again_and_again_keeps_nobody_out(device: Device) -> None:
    device.motion(segment(100))
    for _ in range(30):
        device.run(0.1)
        device.send(Jog(0, 3, 1000))
    device.send(Jog(1, 1, 1000), address=OTHER)
    device.run(0.1)
    assert owner(device) == bytes_of(OTHER), "$77 has passed since the last motion that was taken"


def test_refused_motion_of_a_stranger_makes_no_datagram_of_the_owner_a_new_one(device: Device) -> None:
    data = build(Motion(count=1), 5, 123456, [segment(100)])
    device.raw(data)
    device.run(3)
    assert owner(device) == NOBODY
    device.raw(data)
    device.motion(segment(10**9), address=OTHER)
    device.raw(data)
    device.run(0.5)
    assert device.pulses[0] == 200, "the second one only, which came after more than 2 s"


# ---- taking ----


def test_what_was_queued_is_held_until_the_new_owner_resumes(device: Device) -> None:
    first, second = device.connect(), device.connect(OTHER)
    sender = open_stream(device, first)
    ack_of(device, sender, *[segment(1000, us=100_000)] * 8)
    device.run(0.2)
    assert reason(device, second, Take()) == Refusal.NONE
    assert owner(device) == bytes_of(OTHER)
    device.run(1)
    held = device.pulses[0]
    assert device.state.startswith("Hold") and 0 < held < 8000
    ack = ack_of(device, sender, segment(1000, us=100_000), first=8)
    assert (ack.refusal, ack.next) == (Refusal.OWNER, 8), "the stream says who has ended it"
    assert reason(device, first, Resume()) == Refusal.OWNER
    device.run(1)
    assert device.pulses[0] == held
    assert reason(device, second, Resume()) == Refusal.NONE
    device.run(2)
    assert device.pulses[0] == 8000


def test_what_was_queued_can_be_discarded(device: Device) -> None:
    device.connect()
    second = device.connect(OTHER)
    device.motion(*[segment(1000, us=100_000)] * 8)
    device.run(0.2)
    assert reason(device, second, Take(discard=1)) == Refusal.NONE
    device.run(1)
    at = device.pulses[0]
    assert 0 < at < 8000 and device.state == "Idle"
    assert reason(device, second, Resume()) == Refusal.BUSY, "there is nothing to resume"


def test_a_jog_ends_with_its_hosts_control(device: Device) -> None:
    second = device.connect(OTHER)
    device.send(Jog(0, 1, 1000))
    device.run(0.2)
    assert reason(device, second, Take()) == Refusal.NONE
    device.run(0.2)
    assert device.state == "Idle", "nothing is held: there is nothing to resume"
    at = device.pulses[0]
    device.send(Jog(0, 1, 1000))
    device.run(0.2)
    assert device.pulses[0] == at


def test_a_former_owner_stays_out_while_the_new_one_is_there(device: Device) -> None:
    """A program that repeats itself 100 times a second does not come back by patience."""
    second = device.connect(OTHER)
    device.motion(segment(100))
    assert reason(device, second, Take()) == Refusal.NONE
    for _ in range(500):
        device.run(0.01)
        device.motion(segment(100))
        device.send(IoControl(spindle=1, rpm=100))
    assert device.pulses[0] <= 100
    assert owner(device) == bytes_of(OTHER)
    assert statistics(device).last_refusal == Refusal.OWNER
    device.disconnect(second)
    device.run(0.1)
    device.run(3)
    assert owner(device) == NOBODY


def test_the_owner_may_take_what_it_has(device: Device) -> None:
    client = device.connect()
    device.motion(*[segment(1000, us=100_000)] * 8)
    device.run(0.2)
    assert reason(device, client, Take()) == Refusal.NONE
    device.run(2)
    assert device.pulses[0] == 8000, "nothing of it is held"


def test_nobody_else_may_be_taken_from_by_datagram(device: Device) -> None:
    device.motion(*[segment(1000, us=100_000)] * 8)
    device.send(Take(), address=OTHER)
    device.run(2)
    assert device.pulses[0] == 8000
    assert statistics(device).malformed == 1


def test_taking_needs_the_key(make_device: Callable[..., Device]) -> None:
    device = make_device(key="secret")
    client = device.connect(OTHER)
    assert reason(device, client, Take()) == Refusal.AUTHENTICATION
    assert owner(device) == NOBODY


def test_a_job_of_the_text_side_is_not_held_by_taking(device: Device) -> None:
    client = device.connect()
    device.text("G1 X10 F600\n")
    device.run(0.2)
    assert reason(device, client, Take()) == Refusal.NONE
    device.run(3)
    assert device.pulses[0] == 2000


# ---- observers ----


@pytest.mark.parametrize("payload", [Hold(), JogStop(0xFF), Estop()], ids=["hold", "jog_stop", "estop"])
def test_an_observer_stops_what_moves(device: Device, payload: Layout) -> None:
    device.send(Jog(0, 1, 1000))
    device.run(0.2)
    device.send(payload, address=OTHER)
    device.run(0.1)
    at = device.position[0]
    device.run(0.2)
    assert device.position[0] == at > 0
    assert owner(device) == bytes_of(HOST)


def test_an_observer_starts_nothing(device: Device) -> None:
    device.motion(*[segment(1000, us=100_000)] * 8)
    device.send(REGISTER, address=OTHER)
    device.run(0.2)
    device.send(Hold(), address=OTHER)
    device.run(1)
    held = device.pulses[0]
    observer = device.connect(OTHER)
    for payload in (Resume(), Jog(0, 1, 1000), Home(axes=1), IoControl(spindle=1, rpm=500)):
        assert reason(device, observer, payload) == Refusal.OWNER
    device.run(1)
    assert device.pulses[0] == held and device.status.state == State.HOLD


# ---- reports ----


def reports(device: Device, address: str, seconds: float) -> int:
    before = len(device.of_type(Type.STATUS, address))
    device.run(seconds)
    return len(device.of_type(Type.STATUS, address)) - before


def test_reports_end_ten_seconds_after_the_last_datagram(device: Device) -> None:
    device.send(REGISTER)
    assert 195 <= reports(device, HOST, 60) <= 201, "one datagram had brought reports for an hour"


def test_a_connection_keeps_the_reports(device: Device) -> None:
    client = device.connect()
    device.send(REGISTER)
    assert reports(device, HOST, 60) > 1190
    device.disconnect(client)
    device.run(1)
    assert reports(device, HOST, 60) <= 1


def test_strangers_take_the_reports_of_nobody_who_is_served(device: Device) -> None:
    device.send(REGISTER, address=OTHER)
    for n in range(20):
        device.send(REGISTER, address=f"10.0.1.{n}")
    assert reports(device, OTHER, 5) >= 99
    device.connect()
    device.send(REGISTER)
    assert reports(device, HOST, 5) >= 99, "with all places taken, who has a connection still gets one"
