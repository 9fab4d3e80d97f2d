"""A host's probes while sides of the firmware stall: the contact is exact, reported once, and nothing pushes on."""

from __future__ import annotations

import random
from collections.abc import Callable

import pytest
import stalls
from test_motion import segment
from wificnc.connection.wmc3.layout import SegmentFlag
from wire_device import ACCEL, PATIENT, TIMER_HZ, Device

COMMITTED_S = 0.055  # AHEAD_FULL_US, and a slice
RESULT = 0x23


def results(device: Device) -> list[tuple[int, int]]:
    payloads = [sent.packet.payload for sent in device.sent if sent.data[5] == RESULT]
    return [(found.contact, found.position_steps[2]) for found in payloads]  # type: ignore[attr-defined]


def probe_down(device: Device, per_slice: int, count: int) -> None:
    for left in range(count, 0, -1):
        last = SegmentFlag.LAST if left == 1 else 0
        device.motion(segment(0, 0, -per_slice, flags=SegmentFlag.PROBE | last))


@pytest.mark.alike(8)
@pytest.mark.parametrize("kind", stalls.LATE)
@pytest.mark.parametrize("seed", stalls.seeds(16))
def test_a_contact_ends_the_probe(make_device: Callable[..., Device], kind: str, seed: int) -> None:
    device, rng = make_device(settings=PATIENT), random.Random(f"{kind} {seed}")
    per_slice, count = rng.choice([5, 10, 20, 50, 100]), rng.randrange(20, 120)
    contact = -rng.randrange(1, per_slice * count)
    device.lib.virtual_surface(device.host, contact)
    stalls.stall_often(device.lib, device.host, rng, stalls.LATE[kind], TIMER_HZ)
    probe_down(device, per_slice, count)
    device.run(20)
    assert results(device) == [(1, contact)]
    assert device.position == device.pulses
    speed = per_slice * 100
    assert contact - device.position[2] <= speed * COMMITTED_S + speed**2 / (2 * ACCEL) + 1
    device.motion(segment(0, 0, 100), segment(0, 0, 0, flags=SegmentFlag.LAST))
    at = device.position[2]
    device.run(5)
    assert device.position[2] == device.pulses[2] == at + 100, "away from it"


@pytest.mark.parametrize("kind", stalls.LATE)
@pytest.mark.parametrize("seed", stalls.seeds(8))
def test_a_probe_without_contact_makes_every_step(make_device: Callable[..., Device], kind: str, seed: int) -> None:
    device, rng = make_device(settings=PATIENT), random.Random(f"{kind} {seed}")
    per_slice, count = rng.choice([5, 10, 20, 50, 100]), rng.randrange(20, 120)
    stalls.stall_often(device.lib, device.host, rng, stalls.LATE[kind], TIMER_HZ)
    probe_down(device, per_slice, count)
    device.run(20)
    assert results(device) == [(0, -per_slice * count)]
    assert device.position[2] == device.pulses[2] == -per_slice * count
