"""Streams over a network that loses, doubles, delays and reorders: every step is made exactly once."""

from __future__ import annotations

import heapq
import itertools
import random
from collections.abc import Callable

import numpy as np
import pytest
from test_motion import profile, segment, speeds
from wificnc.connection.wmc3.layout import (
    Estop,
    Handshake,
    HandshakeResponse,
    Refusal,
    Reset,
    Segment,
    SegmentFlag,
    State,
    StreamAck,
    StreamClose,
    StreamOpen,
    StreamOpened,
    StreamSegments,
    Type,
)  # fmt: skip
from wificnc.connection.wmc3.packet import build, parse
from wificnc.connection.wmc3.stream import StreamSender
from wificnc.errors import RefusedError
from wire_device import ACCEL, HOST, OTHER, Device

PORT = 40123


class Network:
    """Between a sender and a device, in virtual time; every datagram has its own fate."""

    def __init__(self, device: Device, seed: int, loss: float, double: float, delay_s: tuple[float, float]) -> None:
        self.device = device
        self.random = random.Random(seed)
        self.loss, self.double, self.delay_s = loss, double, delay_s
        self.on_way: list[tuple[float, int, bool, bytes]] = []
        self.count = itertools.count()
        self.sequence = 0

    def post(self, data: bytes, to_device: bool) -> None:
        for _ in range(2 if self.random.random() < self.double else 1):
            if self.random.random() >= self.loss:
                at = self.device.now + self.random.uniform(*self.delay_s)
                heapq.heappush(self.on_way, (at, next(self.count), to_device, data))

    def step(self, sender: StreamSender, seconds: float = 0.001) -> None:
        """Send what is due, deliver what arrives, let time advance."""
        for payload, segments in sender.poll(self.device.now):
            self.post(build(payload, self.sequence, round(self.device.now * 1e6), segments), True)
            self.sequence += 1
        while self.on_way and self.on_way[0][0] <= self.device.now:
            _, _, to_device, data = heapq.heappop(self.on_way)
            if to_device:
                self.device.raw(data, HOST, PORT)
            else:
                packet = parse(data)
                assert packet is not None and isinstance(packet.payload, StreamAck)
                sender.take(packet.payload)
        self.device.run(seconds)
        for sent in self.device.sent:
            if sent.data[5] == Type.STREAM_ACK:
                assert (sent.address, sent.port) == (HOST, PORT)
                self.post(sent.data, False)
        self.device.sent.clear()


def open_stream(device: Device, client: int | None = None, address: str = HOST) -> StreamSender:
    client = device.connect(address) if client is None else client
    opened = device.request(client, StreamOpen()).payload
    assert isinstance(opened, StreamOpened)
    assert (opened.refusal, opened.capacity) == (Refusal.NONE, 128) and opened.stream != 0
    return StreamSender(opened.stream, opened.capacity)


def run_all(network: Network, sender: StreamSender, most_s: float) -> None:
    end = network.device.now + most_s
    while not sender.is_executed:
        assert network.device.now < end, (sender.next, sender.done, sender.end)
        network.step(sender)


def ack_of(device: Device, sender: StreamSender, *segments: Segment, first: int = 0, address: str = HOST) -> StreamAck:
    """One datagram straight to the device, and its answer."""
    device.send(StreamSegments(sender.stream, first, len(segments)), segments, address, PORT)
    ack = device.of_type(Type.STREAM_ACK, address)[-1].packet.payload
    assert isinstance(ack, StreamAck)
    return ack


@pytest.mark.parametrize("seed", range(8))
def test_no_step_is_lost_or_made_twice(make_device: Callable[..., Device], seed: int) -> None:
    """30 % loss both ways, 20 % doubled, 1 to 40 ms on the way (so that they overtake one another)."""
    device = make_device()
    sender = open_stream(device)
    network = Network(device, seed, loss=0.3, double=0.2, delay_s=(0.001, 0.04))
    out = profile(12_000, 12_000, ACCEL / 2)
    steps = [*out, *[-n for n in out], *profile(3_000, 8_000, ACCEL / 2)]
    sender.put([segment(n, n // 2, ident=k % 65536) for k, n in enumerate(steps)], last=True)
    run_all(network, sender, 20)
    expected = [sum(steps), sum(int(n / 2) if n % 2 == 0 else n // 2 for n in steps), 0, 0, 0, 0]
    assert device.position == device.pulses == expected
    assert len(device.edges(0)[0]) == sum(abs(n) for n in steps), "not one step more on the way"
    assert sender.done == sender.next == len(steps)
    for axis in (0, 1):
        _, speed = speeds(device, axis, 0.005)
        assert (np.abs(np.diff(speed)) <= 2 * ACCEL * 0.005 + 2 / 0.005).all(), "slower, never a jump"


def test_a_stream_is_not_held_on_gaps(make_device: Callable[..., Device]) -> None:
    """What is missing is sent again: $78 is for hosts without a stream."""
    device = make_device(settings={78: 1})
    sender = open_stream(device)
    network = Network(device, 1, loss=0.3, double=0.2, delay_s=(0.001, 0.04))
    sender.put([segment(100)] * 200, last=True)
    run_all(network, sender, 10)
    assert device.pulses[0] == 20_000 and device.state == "Idle"


def test_the_pace_is_full_while_the_queue_lasts(device: Device) -> None:
    """A lossy network costs nothing once the queue is filled: no underrun, and the time of the segments."""
    sender = open_stream(device)
    network = Network(device, 3, loss=0.3, double=0.2, delay_s=(0.001, 0.02))
    sender.put([segment(80)] * 1000, last=True)
    run_all(network, sender, 20)
    t, _ = device.edges(0)
    assert len(t) == 80_000 and sender.underruns == 0
    assert np.abs(np.diff(t[8_000:79_000]) - 0.01 / 80).max() < 1e-6
    assert t[-1] - t[0] < 10.0 + 0.3


def test_a_network_that_is_gone_for_a_second_costs_a_pause_and_no_step(device: Device) -> None:
    sender = open_stream(device)
    network = Network(device, 1, loss=0.0, double=0.0, delay_s=(0.001, 0.002))
    sender.put([segment(100)] * 600, last=True)
    while device.position[0] < 20_000:
        network.step(sender)
    network.loss = 1.0
    gone_until = device.now + 1.7  # less than $77
    while device.now < gone_until:
        network.step(sender)
    network.loss = 0.0
    run_all(network, sender, 20)
    assert device.pulses[0] == 60_000
    assert sender.underruns == 1, "counted"
    _, speed = speeds(device, 0, 0.005)
    assert (np.abs(np.diff(speed)) <= ACCEL * 0.005 + 2 / 0.005).all()


def test_segments_of_an_old_stream_mean_nothing(device: Device) -> None:
    client = device.connect()
    old = open_stream(device, client)
    ack_of(device, old, segment(100))
    device.run(0.5)
    new = open_stream(device, client)
    assert new.stream != old.stream
    ack = ack_of(device, old, segment(100), first=1)
    assert ack.refusal == Refusal.STREAM_CLOSED and ack.stream == old.stream
    device.run(0.5)
    assert device.pulses[0] == 100
    ack_of(device, new, segment(7))
    device.run(0.5)
    assert device.pulses[0] == 107


def test_what_is_taken_out_of_order_is_told_and_waits(device: Device) -> None:
    sender = open_stream(device)
    ack = ack_of(device, sender, segment(10), segment(10), first=2)
    assert (ack.next, ack.done, ack.taken[0], ack.refusal, ack.free) == (0, 0, 0b1100, Refusal.NONE, 128)
    device.run(0.5)
    assert device.pulses[0] == 0, "nothing moves over a gap"
    ack = ack_of(device, sender, segment(10), segment(10))
    assert (ack.next, ack.taken[0]) == (4, 0)
    ack = ack_of(device, sender, segment(10), segment(10))  # again
    device.run(0.5)
    assert device.pulses[0] == 40 and ack_of(device, sender).done == 4


def test_a_stream_behind_another_has_executed_nothing_while_that_one_runs(device: Device) -> None:
    client = device.connect()
    streams = [device.request(client, StreamOpen()).payload.stream]
    device.send(StreamSegments(streams[0], 0, 4), (Segment((100, 0, 0, 0, 0, 0), 100_000),) * 4)
    device.run(0.15)
    streams.append(device.request(client, StreamOpen()).payload.stream)
    done = []
    for _ in range(6):
        device.send(StreamSegments(streams[1], 0, 1), (Segment((100, 0, 0, 0, 0, 0), 100_000),))
        done.append(device.of_type(Type.STREAM_ACK)[-1].packet.payload.done)
        device.run(0.1)
    assert done == [0, 0, 0, 0, 1, 1], "the first one takes 0.4 s"
    assert device.position[0] == device.pulses[0] == 500


def test_what_has_no_room_is_not_taken_and_not_lost(device: Device) -> None:
    sender = open_stream(device)
    for first in range(0, 128, 8):
        ack = ack_of(device, sender, *[segment(100)] * 8, first=first)
    assert (ack.next, ack.free) == (128, 0)
    ack = ack_of(device, sender, segment(100), first=128)
    assert (ack.next, ack.refusal) == (128, Refusal.NONE)
    device.run(1)
    assert ack_of(device, sender, segment(100), first=128).next == 129


def test_the_segment_that_runs_is_named_also_when_its_place_is_another_ones(make_device: Callable[..., Device]) -> None:
    """A place in the queue is free before the last step of its segment is made."""
    device = make_device(settings={76: 10})
    sender = open_stream(device)
    seen = []
    while device.position[0] < 800:
        while (ack := ack_of(device, sender)).free > 0 and ack.next < 800:
            ack_of(device, sender, segment(1, us=1000, ident=ack.next + 1), first=ack.next)
        device.run(0.001)
        seen.append((device.status.segment_id, device.status.position_steps[0]))
    running = [(ident, steps) for ident, steps in seen if ident]
    assert len(running) > 50
    assert [ident for ident, steps in running if not steps <= ident <= steps + 1] == []


@pytest.mark.parametrize(
    ("bad", "reason"),
    [
        (segment(5000), Refusal.TOO_FAST),
        (segment(10**9), Refusal.TOO_FAST),
        (Segment(steps=(10, 0, 0, 0, 0, 0)), Refusal.TIMING),
        (Segment(), Refusal.TIMING),
        (segment(-(2**31), us=4_000_000_000), Refusal.TOO_FAST),
    ],
)
def test_a_segment_that_cannot_be_is_refused_by_number(device: Device, bad: Segment, reason: Refusal) -> None:
    sender = open_stream(device)
    sender.put([segment(10), segment(10), bad, segment(10)])
    ack = ack_of(device, sender, segment(10), segment(10), bad, segment(10))
    assert (ack.refusal, ack.refused, ack.next) == (reason, 2, 2)
    with pytest.raises(RefusedError, match=f"{reason.name.lower()}, segment 2"):
        sender.take(ack)
    device.run(0.5)
    assert device.pulses[0] == 20, "what was before it runs, nothing behind it"
    later = ack_of(device, sender, segment(10), first=2)
    assert (later.refusal, later.next, later.done) == (reason, 2, 2)


def test_a_segment_out_of_the_travel_is_refused_also_behind_a_gap(make_device: Callable[..., Device]) -> None:
    """Travel 200 mm: 0 .. -40 000 steps. The segment that leaves it lies there before its turn comes."""
    device = make_device(settings={22: 1, 20: 1})
    device.send(Reset())
    device.run(0.1)
    sender = open_stream(device)
    ack = ack_of(device, sender, segment(1, us=10_000), first=1)
    assert ack.refusal == Refusal.NONE
    ack = ack_of(device, sender, segment(-1))
    assert (ack.next, ack.refusal) == (2, Refusal.NONE), "back to 0"
    ack = ack_of(device, sender, segment(1), first=2)
    assert (ack.refusal, ack.refused, ack.next) == (Refusal.TRAVEL, 2, 2)
    device.run(0.3)
    assert device.pulses[0] == 0


def test_axes_that_are_not_there_are_refused(make_device: Callable[..., Device]) -> None:
    device = make_device(axes=3)
    sender = open_stream(device)
    ack = ack_of(device, sender, segment(1), segment(0, 0, 0, 1))
    assert (ack.next, ack.refusal, ack.refused) == (1, Refusal.AXIS, 1)


def test_estop_closes_the_stream_and_says_what_was_executed(device: Device) -> None:
    sender = open_stream(device)
    for first in range(0, 64, 8):
        ack_of(device, sender, *[segment(100, us=10_000, ident=1)] * 8, first=first)
    device.run(0.3)
    device.send(Estop())
    device.run(0.05)
    ack = ack_of(device, sender)
    assert (ack.refusal, ack.next, ack.state) == (Refusal.STREAM_CLOSED, 64, State.ESTOP)
    made = device.pulses[0]
    assert ack.done == made // 100, "whole segments; the position says the rest"
    client = device.connect()
    refused = device.request(client, StreamOpen()).payload
    assert isinstance(refused, StreamOpened) and (refused.stream, refused.refusal) == (0, Refusal.LOCKED)


def test_closing_leaves_what_is_queued(device: Device) -> None:
    client = device.connect()
    sender = open_stream(device, client)
    ack_of(device, sender, *[segment(100)] * 8)
    reply = device.request(client, StreamClose(sender.stream))
    assert reply.header.type == Type.ACK
    device.run(1)
    assert device.pulses[0] == 800
    assert ack_of(device, sender).done == 8
    again = device.request(client, StreamClose(sender.stream))
    assert again.header.type == Type.REFUSED


def test_another_host_gets_no_stream_while_one_is_open(device: Device) -> None:
    sender = open_stream(device)
    other = device.connect(OTHER)
    opened = device.request(other, StreamOpen()).payload
    assert isinstance(opened, StreamOpened) and (opened.stream, opened.refusal) == (0, Refusal.OWNER)
    ack = ack_of(device, sender, segment(100), address=OTHER)
    device.run(0.5)
    assert device.pulses[0] == 0, "the right number from the wrong host"
    assert ack.next == 0


def test_a_stream_that_begins_with_a_probe_that_touches_moves_nothing(device: Device) -> None:
    device.lib.virtual_surface(device.host, 0)
    device.run(0.1)
    sender = open_stream(device)
    ack = ack_of(device, sender, segment(0, 0, -100, flags=SegmentFlag.PROBE))
    device.run(0.5)
    assert (ack.refusal, ack.refused, ack.next) == (Refusal.TOUCHES, 0, 0)
    assert device.position[2] == 0


def test_an_idle_stream_keeps_motion_until_its_connection_ends(device: Device) -> None:
    client = device.connect()
    sender = open_stream(device, client)
    ack_of(device, sender, segment(100))
    device.text("G0 X1\n")
    for _ in range(20):
        device.run(0.5)
        assert ack_of(device, sender).next == 1
    assert device.pulses[0] == 100, "the line waits"
    device.disconnect(client)
    device.run(3)
    assert device.pulses[0] == 200, "1 mm is at 200 steps"
    assert "[MSG:Remote host released motion]" in device.heard()


def test_the_connection_of_an_open_stream_is_taken_from_nobody(device: Device) -> None:
    """A fifth client may take a place that was silent for 30 s; a stream's is, its segments come by UDP."""
    sender = open_stream(device, device.connect())
    for _ in range(31):
        device.run(1)
        assert ack_of(device, sender).refusal == Refusal.NONE
    assert [device.connect(OTHER) for _ in range(4)] == [1, 2, 3, -1]
    device.run(1)
    assert ack_of(device, sender, segment(100)).next == 1


def test_the_handshake_announces_streams(device: Device) -> None:
    client = device.connect()
    response = device.request(client, Handshake(0x01000000, "test")).payload
    assert isinstance(response, HandshakeResponse)
    assert response.capabilities & 0x40 and response.buffer_capacity == 128
