"""stream_drop: the machine stops within its limits, and nothing of the stream runs later."""

from __future__ import annotations

import pytest
from test_stream import Network, open_stream
from wificnc.connection.wmc3.layout import (
    Estop,
    Refusal,
    Refused,
    Reset,
    Segment,
    Statistics,
    StatisticsResponse,
    StreamClose,
    StreamDrop,
    StreamOpen,
    StreamOpened,
)
from wificnc.connection.wmc3.stream import StreamSender
from wire_device import ACCEL, HOST, OTHER, RATE, Device

STEPS, SLICE_US = 100, 10_000  # 10000 steps/s, half of the top speed
CRUISE = STEPS * 1_000_000 / SLICE_US
BRAKES_STEPS = CRUISE * CRUISE / (2 * ACCEL)


def moving(device: Device, client: int, seconds: float = 0.4) -> StreamSender:
    """A stream of 1 s of motion, under way for this time."""
    sender = open_stream(device, client)
    network = Network(device, 1, 0.0, 0.0, (0.0, 0.0))
    sender.put([Segment((STEPS, 0, 0, 0, 0, 0), SLICE_US)] * 100)
    begun = device.now
    while device.now < begun + seconds:
        network.step(sender)
    return sender


def statistics(device: Device, client: int) -> StatisticsResponse:
    counts = device.request(client, Statistics()).payload
    assert isinstance(counts, StatisticsResponse)
    return counts


def opens(device: Device, client: int) -> Refusal:
    opened = device.request(client, StreamOpen()).payload
    assert isinstance(opened, StreamOpened)
    return Refusal(opened.refusal)


def test_it_stops_within_the_limits_and_discards_the_rest() -> None:
    device = Device()
    client = device.connect(HOST)
    sender = moving(device, client)
    begun = device.position[0]
    device.request(client, StreamDrop(sender.stream))
    assert opens(device, client) == Refusal.BUSY, "until it has stopped"
    device.run(1)
    way = device.position[0] - begun
    assert 0.5 * BRAKES_STEPS < way < 1.2 * BRAKES_STEPS + 0.02 * CRUISE, "a ramp, and what was prepared before it"
    assert device.position == device.pulses
    assert device.state == "Idle" and opens(device, client) == Refusal.NONE
    device.run(1)
    assert device.position[0] == begun + way
    device.close()


def test_in_a_hold_it_discards_and_the_hold_stays() -> None:
    device = Device()
    client = device.connect(HOST)
    sender = moving(device, client)
    device.text("!")
    device.run(0.5)
    held = device.position
    device.request(client, StreamDrop(sender.stream))
    device.run(0.1)
    assert device.state == "Hold:0"
    device.text("~")
    device.run(1)
    assert device.position == held == device.pulses and device.state == "Idle"
    device.close()


def test_a_stream_that_is_closed_and_still_runs_is_discarded() -> None:
    device = Device()
    client = device.connect(HOST)
    sender = moving(device, client, 0.2)
    device.text("!")
    device.run(0.5)
    device.request(client, StreamClose(sender.stream))
    device.request(client, StreamDrop(sender.stream))
    held = device.position
    device.text("~")
    device.run(1)
    assert device.position == held
    device.close()


def test_only_its_own_connection_drops_it() -> None:
    device = Device()
    client, other = device.connect(HOST), device.connect(OTHER)
    sender = moving(device, client, 0.2)
    for number, from_whom in ((sender.stream + 2, client), (0, client), (sender.stream, other)):
        answer = device.request(from_whom, StreamDrop(number)).payload
        assert isinstance(answer, Refused) and answer.reason == Refusal.STREAM_CLOSED
    begun = device.position[0]
    device.run(0.1)
    assert device.position[0] - begun > 0.09 * CRUISE, "it continues"
    device.close()


def test_position_losses_count_stops_without_a_ramp() -> None:
    """An e-stop at rest loses nothing; one in motion may."""
    device = Device()
    client = device.connect(HOST)
    assert statistics(device, client).position_losses == 0
    device.request(client, Estop())
    device.request(client, Reset())
    device.run(0.1)
    assert statistics(device, client).position_losses == 0
    sender = open_stream(device, client)
    sender.put([Segment((0, 0, 0, 0, 0, 0), SLICE_US)] * 50)
    network = Network(device, 1, 0.0, 0.0, (0.0, 0.0))
    for _ in range(100):
        network.step(sender)
    device.request(client, Estop())
    device.request(client, Reset())
    device.run(0.1)
    assert statistics(device, client).position_losses == 0, "its stream has no steps: nothing moves"
    moving(device, client, 0.2)
    device.request(client, Estop())
    assert statistics(device, client).position_losses == 1
    device.request(client, Reset())
    assert CRUISE <= RATE and statistics(device, client).position_losses == 1
    device.close()


def test_a_new_connection_of_the_same_host_drops_it() -> None:
    """The network was gone, and the connection with it."""
    device = Device()
    client = device.connect(HOST)
    sender = moving(device, client, 0.2)
    device.text("!")
    device.run(0.5)
    held = device.position
    device.request(device.connect(HOST), StreamDrop(sender.stream))
    device.text("~")
    device.run(1)
    assert device.position == held == device.pulses
    device.close()


def test_what_a_gone_host_has_left_in_a_hold_never_runs() -> None:
    device = Device()
    client = device.connect(HOST)
    moving(device, client, 0.2)
    device.text("!")
    device.run(0.5)
    held = device.position
    device.disconnect(client)
    device.run(0.1)
    assert device.state == "Hold:0"
    device.text("~")
    device.run(1)
    assert device.position == held == device.pulses
    device.close()


@pytest.mark.parametrize("was_locked", [True, False])
def test_an_estop_does_not_end_a_lock(was_locked: bool) -> None:
    """Power-on with homing asked for; a host sends its e-stop, and later leaves it."""
    device = Device(settings={22: 1})
    client = device.connect(HOST)
    if was_locked:
        device.text("\x18")
        device.run(0.1)
        device.text("$SLP\n")
        device.run(0.1)
        device.text("\x18")
        device.run(0.1)
        assert device.state == "Alarm"
    for _ in range(3):
        device.request(client, Estop())
        device.run(0.05)
    device.request(client, Reset())
    device.run(0.1)
    assert device.state == ("Alarm" if was_locked else "Idle")
    device.request(client, Reset())
    device.run(0.1)
    assert device.state == "Idle"
    device.close()
