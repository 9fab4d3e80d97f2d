"""Senders as there are, for long, and over bad networks. WIFICNC_SENDER_SECONDS=3600: for an hour."""

from __future__ import annotations

import itertools
import math
import os
import random
import struct
from collections.abc import Callable

import pytest
from test_motion import segment
from test_session import statistics
from wificnc.connection.wmc3.layout import MAGIC, VERSION, Motion, Segment, Type
from wificnc.connection.wmc3.packet import build, crc16
from wire_device import HOST, PATIENT, Device, number

SECONDS = int(os.environ.get("WIFICNC_SENDER_SECONDS", "120"))
SLICE_S = 0.01
LEAD = 10  # segments that are queued before


def circle(time_s: float) -> tuple[int, int]:
    """1 mm of radius in 2 s, and a slow drift that is never a whole number of steps in a slice."""
    turn = math.pi * time_s
    return round(200 * math.sin(turn) + time_s / 3), round(200 * (1 - math.cos(turn)) - time_s / 7)


def packet(sequence: int, steps: tuple[int, int], size: int) -> bytes:
    """One segment, padded to a full packet if size says so; quicker than build()."""
    body = struct.pack("<B3x6iI12xHBx", 1, *steps, 0, 0, 0, 0, 10_000, sequence & 0xFFFF, 0).ljust(size - 18, b"\0")
    stamp = (10_000 * sequence + 1) & 0xFFFFFFFF
    head = struct.pack("<IBBHII", MAGIC, VERSION, Type.MOTION, len(body), sequence & 0xFFFFFFFF, stamp)
    return head + struct.pack("<H", crc16(head + b"\0\0" + body)) + body


def test_the_quick_packet_is_one_of_the_protocol() -> None:
    assert packet(7, (3, -4), 66) == build(Motion(count=1), 7, 70_001, [segment(3, -4, ident=7)])


@pytest.mark.parametrize("size", [374, 66], ids=["full-length", "variable-length"])
def test_a_hundred_segments_a_second_for_long(device: Device, size: int) -> None:
    """Every 10 ms a segment of 10 ms: the queue never runs dry and no step is missing, whatever the time."""
    slices = SECONDS * 100 // (1 if size == 66 else 4)
    at, levels = (0, 0), []
    for count in range(1, slices + 1):
        to = circle(count * SLICE_S)
        data = packet(count, (to[0] - at[0], to[1] - at[1]), size)
        device.lib.host_wire_datagram(device.wire, number(HOST), 40000, data, len(data))
        at = to
        if count > LEAD:
            device.run(SLICE_S)
        if count % 100 == 0:
            levels.append(128 - device.status.buffer_free)
            device.sent.clear()
            device.steps.clear()
    device.run(1)
    counts = statistics(device)
    assert device.position[:2] == list(at)
    assert (counts.underruns, counts.refused_segments, counts.missing, counts.stretched) == (0, 0, 0, 0)
    assert counts.done == counts.segments == slices
    assert min(levels) >= LEAD - 2, "neither does it run towards empty"
    assert max(levels) <= LEAD + 20, "nor fill up: no time is lost or won"


@pytest.mark.parametrize("most", [5, 30], ids=["within the limits", "slowed down where it leaps"])
@pytest.mark.parametrize("seed", range(4))
def test_a_lossy_network_without_a_stream(make_device: Callable[..., Device], seed: int, most: int) -> None:
    """30 % lost, 20 % doubled, neighbours that overtake: what arrives is made once, what does not is counted. $78=0:
    and nothing is held."""
    device, chance = make_device(settings={**PATIENT, 78: 0}), random.Random(seed)
    sent = {n: (chance.randrange(-most, most + 1), chance.randrange(-most, most + 1)) for n in range(1, 401)}
    lost = {n for n in sent if 1 < n < 400 and chance.random() < 0.3}
    order = sorted((n + chance.uniform(0, 3), n) for n in sent if n not in lost)
    arrivals = [n for _, n in order for _ in range(2 if chance.random() < 0.2 else 1)]
    for count, n in enumerate(arrivals):
        device.raw(packet(n, sent[n], 66 if n % 2 else 374))
        if count >= LEAD:
            device.run(SLICE_S)
        while most > 5 and device.status.buffer_free < LEAD:
            device.run(SLICE_S)
    device.run(3 if most == 5 else 30)
    expected = [sum(steps[axis] for n, steps in sent.items() if n not in lost) for axis in (0, 1)]
    assert device.pulses[:2] == device.position[:2] == expected
    counts = statistics(device)
    assert counts.missing == len(lost) and counts.duplicates == len(arrivals) - len(order)
    assert counts.segments == counts.done == len(order) and counts.refused_segments == 0


def test_a_thousand_segments_a_second_for_long(device: Device) -> None:
    """Eight in a packet, every 8 ms, for ten seconds."""
    places = [round(8 * ms + 1000 * math.sin(math.pi * ms / 1000)) for ms in range(10_001)]
    steps = [after - before for before, after in itertools.pairwise(places)]
    for first in range(0, 10_000, 8):
        device.motion(*[Segment((n, -n, 0, 0, 0, 0), 1000) for n in steps[first : first + 8]])
        if first > 40:
            device.run(0.008)
    device.run(1)
    counts = statistics(device)
    assert device.pulses[:2] == [places[-1], -places[-1]] and counts.segments == 10_000
    assert (counts.underruns, counts.refused_segments) == (0, 0)
