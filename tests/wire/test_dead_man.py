"""A host that hangs moves nothing for long: a jog needs repetition, an open stream signs of life, and what is queued
ends as $74 says."""

from __future__ import annotations

from collections.abc import Callable

import pytest
from test_motion import segment
from test_session import reason, statistics
from test_stream import ack_of, open_stream
from wificnc.connection.wmc3.layout import (
    JOG_LIFE_MS,
    JOG_REPEAT_MS,
    Home,
    IoControl,
    Jog,
    Ping,
    Refusal,
    Reset,
    Resume,
    StreamSegments,
    Take,
)  # fmt: skip
from wire_device import OTHER, Device

FINISH, HOLD, STOP = 0, 1, 2  # $74
LIFE_S, REPEAT_S = JOG_LIFE_MS / 1000, JOG_REPEAT_MS / 1000
STOP_S = 0.05  # a jog's ramp
TIMEOUT_S = 2.0  # $77
SPINDLE = IoControl(spindle=1, rpm=500, coolant=1)
SLOW = [segment(1000, us=1_000_000)] * 8  # 1000 steps/s, 8 s


# ---- jogs ----


@pytest.mark.parametrize("connected", [True, False])
def test_a_jog_that_is_not_repeated_ends(device: Device, connected: bool) -> None:
    """Also of a host whose connection lives, and that says other things."""
    client = device.connect() if connected else -1
    device.send(Jog(0, 1, 1000))
    for _ in range(40):
        device.run(0.05)
        if connected:
            device.request(client, Ping(1))
    assert device.state == "Idle"
    assert 1000 * (LIFE_S - STOP_S) < device.position[0] <= 1000 * (LIFE_S + STOP_S)


def test_a_repeated_jog_is_even(device: Device) -> None:
    for _ in range(round(3 / REPEAT_S)):
        device.send(Jog(0, 1, 1000))
        device.run(REPEAT_S)
    times, _ = device.edges(0)
    cruise = times[(times > times[0] + STOP_S) & (times < times[0] + 2.5)]
    assert max(cruise[1:] - cruise[:-1]) == pytest.approx(0.001, rel=0.01)
    device.run(1)
    assert device.state == "Idle"


def test_two_lost_repetitions_do_not_end_a_jog(device: Device) -> None:
    for _ in range(5):
        device.send(Jog(0, 1, 1000))
        device.run(3 * REPEAT_S)
        assert device.state == "Jog"


# ---- streams ----


def test_a_stream_whose_host_is_silent_is_lost_though_its_connection_is_there(device: Device) -> None:
    client = device.connect()
    sender = open_stream(device, client)
    ack_of(device, sender, *SLOW)
    device.run(TIMEOUT_S + 0.5)
    assert device.state.startswith("Hold")
    at = device.pulses[0]
    assert 1000 * TIMEOUT_S - 100 < at < 1000 * (TIMEOUT_S + 0.2)
    device.run(10)
    assert device.pulses[0] == at, "no client has resumed it"
    ack = ack_of(device, sender, *SLOW[:1], first=8)
    assert (ack.refusal, ack.next) == (Refusal.SILENT, 8)
    assert reason(device, client, Resume()) == Refusal.NONE
    device.run(10)
    assert device.pulses[0] == 8000, "what was taken is not lost"


@pytest.mark.parametrize("sign", ["question", "request"])
def test_any_sign_of_life_keeps_a_stream(device: Device, sign: str) -> None:
    client = device.connect()
    sender = open_stream(device, client)
    ack_of(device, sender, *SLOW)
    for _ in range(20):
        device.run(0.5)
        if sign == "question":
            device.send(StreamSegments(sender.stream, 8, 0), port=40123)
        else:
            device.request(client, Ping(1))
    assert device.pulses[0] == 8000
    assert ack_of(device, sender, *SLOW[:1], first=8).refusal == Refusal.NONE


# ---- what is accepted ----


@pytest.mark.alike(6)
@pytest.mark.parametrize("how", ["datagram", "stream", "datagram in a job"])
@pytest.mark.parametrize("length_s", [1.9, 2.0, 2.1, 30.0])
def test_the_last_segment_is_executed_to_its_end(device: Device, length_s: float, how: str) -> None:
    """However long it is: no motion that was accepted ends in a hold because its host has said all."""
    last = segment(0, 1000, us=round(length_s * 1e6))
    if how == "datagram in a job":
        device.text("G1 X20 F1200\n")
        device.run(0.3)
    if how == "stream":
        ack_of(device, open_stream(device, device.connect()), last)
    else:
        device.motion(last)
    device.run(length_s + 0.5)
    assert device.pulses[1] == 1000
    assert not device.state.startswith("Hold")
    assert "lost" not in device.heard()


@pytest.mark.parametrize("length_s", [0.1, 2.0, 5.0])
def test_motion_is_the_hosts_for_a_time_behind_its_end(device: Device, length_s: float) -> None:
    device.motion(segment(100, us=round(length_s * 1e6)))
    device.run(length_s + TIMEOUT_S - 0.1)
    assert "[MSG:Remote host released motion]" not in device.heard()
    device.run(0.2)
    assert "[MSG:Remote host released motion]" in device.heard()


# ---- $74 ----


def lose(device: Device, how: str) -> None:
    """Eight seconds are queued as a stream or as datagrams; after 0.5 s their host is no longer there."""
    client = device.connect() if how != "silent datagrams" else -1
    if how == "silent datagrams":
        device.motion(*SLOW)
    else:
        ack_of(device, open_stream(device, client), *SLOW)
    device.run(0.5)
    if how == "closed":
        device.disconnect(client)
    else:
        device.run(TIMEOUT_S)


LOSSES = pytest.mark.parametrize("how", ["closed", "silent", "silent datagrams"])


@LOSSES
def test_what_is_queued_finishes(make_device: Callable[..., Device], how: str) -> None:
    device = make_device(settings={74: FINISH})
    lose(device, how)
    device.run(10)
    assert (device.pulses[0], device.state) == (8000, "Idle")


@LOSSES
def test_what_is_queued_is_held(make_device: Callable[..., Device], how: str) -> None:
    device = make_device()
    lose(device, how)
    device.run(1)
    at = device.pulses[0]
    assert device.state == "Hold:0" and 0 < at < 8000
    assert "[MSG:Remote host lost: feed hold]" in device.heard()
    device.run(60)
    assert (device.pulses[0], device.state) == (at, "Hold:0")
    device.text("~")
    device.run(10)
    end = at if how == "closed" else 8000  # a host that has left does not come back for what a hold keeps
    assert (device.pulses[0], device.state) == (end, "Idle")


@pytest.mark.alike(1)  # an hour is some five seconds of the processor
@LOSSES
def test_what_is_held_is_held_for_an_hour(make_device: Callable[..., Device], how: str) -> None:
    device = make_device()
    lose(device, how)
    device.run(1)
    at = device.pulses[0]
    device.run(3600)
    assert (device.pulses[0], device.state) == (at, "Hold:0") and 0 < at < 8000


@LOSSES
def test_what_is_queued_is_reset(make_device: Callable[..., Device], how: str) -> None:
    device = make_device(settings={74: STOP})
    device.send(SPINDLE)
    lose(device, how)
    device.run(1)
    at = device.pulses[0]
    assert device.state == "Alarm" and 0 < at < 8000
    assert "ALARM:3" in device.heard()
    assert device.outputs().spindle_direction == 0 and device.outputs().coolant == 0
    device.run(10)
    assert device.pulses[0] == at


def test_a_host_that_is_lost_in_a_hold_is_not_held_again_when_somebody_resumes(device: Device) -> None:
    client = device.connect()
    ack_of(device, open_stream(device, client), *SLOW)
    device.run(TIMEOUT_S + 1)
    device.text("~")
    device.run(1)
    assert device.state == "Run"
    device.run(8)
    assert device.pulses[0] == 8000


@pytest.mark.parametrize("delay_s", [0, 0.5, 5])
def test_the_spindle_stops_in_the_hold_after_its_time_and_returns(
    make_device: Callable[..., Device], delay_s: float
) -> None:
    device = make_device(settings={75: delay_s})
    client = device.connect()
    assert reason(device, client, SPINDLE) == Refusal.NONE
    ack_of(device, open_stream(device, client), *SLOW)
    device.run(TIMEOUT_S + 0.01)
    while device.state != "Hold:0":
        assert device.outputs().spindle_direction == 1, "the cutter turns while it moves"
        device.run(0.01)
    if delay_s == 0:
        device.run(3600)
        assert (device.outputs().spindle_direction, device.outputs().coolant) == (1, 2)
        return
    device.run(delay_s - 0.05)
    assert (device.outputs().spindle_direction, device.outputs().coolant) == (1, 2)
    device.run(0.1)
    assert (device.outputs().spindle_direction, device.outputs().coolant) == (0, 0)
    held = device.pulses[0]
    device.text("~")
    device.run(3.9)
    assert device.outputs().spindle_direction == 1 and device.pulses[0] == held, "it runs up first"
    device.run(20)
    assert device.pulses[0] == 8000


@pytest.mark.parametrize("then", [HOLD, STOP])
def test_a_beam_is_dark_as_soon_as_the_axes_rest(make_device: Callable[..., Device], then: int) -> None:
    """Whatever the spindle's time: $75 is not for lasers."""
    device = make_device(settings={32: 1, 30: 1000, 74: then, 75: 3600})
    client = device.connect()
    assert reason(device, client, SPINDLE) == Refusal.NONE
    ack_of(device, open_stream(device, client), *SLOW)
    device.run(1)
    assert device.duty() > 0
    device.disconnect(client)
    for _ in range(100):
        device.run(0.001)
        assert device.duty() == 0 or device.state in ("Run", "Hold:1"), "no beam at rest"
    assert device.duty() == 0 and device.outputs().spindle_direction == 0


def test_homing_ends_with_a_host_that_is_gone_whatever_the_setting(make_device: Callable[..., Device]) -> None:
    for then in (FINISH, HOLD, STOP):
        device = make_device(settings={22: 1, 24: 600, 25: 600, 130: 300, 74: then})
        device.text("$X\n")
        device.run(0.1)
        client = device.connect()
        assert reason(device, client, Home(axes=1)) == Refusal.NONE
        device.run(0.5)
        device.disconnect(client)
        device.run(0.5)
        assert device.state == "Alarm" and "ALARM:6" in device.heard()


def test_a_lost_host_lets_others_in(device: Device) -> None:
    ack_of(device, open_stream(device), *SLOW)
    device.disconnect(0)
    device.run(10)
    device.text("~")
    device.run(3)
    assert tuple(statistics(device).owner) == (0, 0, 0, 0)
    device.motion(segment(0, 100), address=OTHER)
    device.run(1)
    assert device.pulses[1] == 100


# ---- out of that hold ----


def back(device: Device) -> int:
    """Its host, by a new connection."""
    device.run(1)
    assert device.state == "Hold:0"
    return device.connect()


@LOSSES
@pytest.mark.parametrize("by", [Reset(), Resume()])
def test_a_host_that_is_back_moves_again_without_the_text_side(device: Device, how: str, by: Reset | Resume) -> None:
    """Of a host that is only silent motion waits: a reset is refused until it is discarded, a resume continues it."""
    lose(device, how)
    client = back(device)
    at = device.pulses[0]
    left = 0 if how == "closed" or isinstance(by, Reset) else 8000 - at
    if isinstance(by, Reset) and how != "closed":
        assert reason(device, client, by) == Refusal.BUSY
        assert reason(device, client, Take(discard=1)) == Refusal.NONE
        device.run(0.1)
    assert reason(device, client, by) == Refusal.NONE
    device.run(9)
    assert (device.state, device.pulses[0]) == ("Idle", at + left)
    ack_of(device, open_stream(device, client), segment(0, 100))
    device.run(1)
    assert device.pulses[1] == 100


@LOSSES
def test_a_reset_ends_no_hold_of_an_operator(device: Device, how: str) -> None:
    lose(device, how)
    device.text("!")
    client = back(device)
    reason(device, client, Take(discard=1))
    device.run(0.1)
    assert reason(device, client, Reset()) == Refusal.NONE
    device.run(10)
    assert device.state == "Hold:0"
    device.text("~")
    device.run(1)
    assert device.state == "Idle"


def test_a_reset_ends_no_hold_that_keeps_lines_back(device: Device) -> None:
    lose(device, "closed")
    device.text("G0 Y5\n")
    client = back(device)
    reason(device, client, Reset())
    device.run(10)
    assert (device.state, device.pulses[1]) == ("Hold:0", 0)
