"""A host's jogs, holds and interrupted jobs while sides of the firmware stall."""

from __future__ import annotations

import random
from collections.abc import Callable

import numpy as np
import pytest
import stalls
from test_motion import segment
from test_stalls import assert_smooth, put_line
from wificnc.connection.wmc3.layout import Hold, Jog, JogStop, Resume, SegmentFlag
from wire_device import ACCEL, PATIENT, RATE, TIMER_HZ, Device

COMMITTED_S = 0.055  # AHEAD_FULL_US, and a segment


def stalled(device: Device, rng: random.Random, late: str, count: int = 40) -> None:
    stalls.stall_often(device.lib, device.host, rng, stalls.LATE[late], TIMER_HZ, count)


def rest(device: Device, most_s: float = 60) -> None:
    """Until nothing moves for a second."""
    end = device.now + most_s
    while True:
        at = device.pulses
        device.run(1.5)
        if device.pulses == at:
            return
        assert device.now < end, "it does not come to rest"


def assert_all_smooth(device: Device) -> None:
    for axis in range(3):
        if len(device.edges(axis)[0]) > 1:
            assert_smooth(device, axis)


@pytest.mark.alike(4)
@pytest.mark.slow
@pytest.mark.parametrize("late", stalls.LATE)
@pytest.mark.parametrize("seed", stalls.seeds(8))
def test_jogs_start_turn_and_stop(make_device: Callable[..., Device], seed: int, late: str) -> None:
    device, rng = make_device(), random.Random(f"{seed} {late}")
    stalled(device, rng, late)
    for _ in range(8):
        device.send(Jog(rng.randrange(3), rng.choice([-1, 1]), rng.choice([300, 4000, RATE])))
        device.run(rng.expovariate(2))
        if rng.random() < 0.5:
            device.send(JogStop(axis=0xFF))
            device.run(rng.expovariate(5))
    device.send(JogStop(axis=0xFF))
    rest(device)
    assert device.position == device.pulses and device.state == "Idle"
    assert_all_smooth(device)
    at = device.position
    device.motion(segment(100), segment(0, flags=SegmentFlag.LAST))
    device.run(3)
    assert device.position == device.pulses == [at[0] + 100, *at[1:]]


@pytest.mark.alike(6)
@pytest.mark.parametrize("late", stalls.LATE)
@pytest.mark.parametrize("speed", [500, 4000, RATE])
@pytest.mark.parametrize("seed", stalls.seeds(4))
def test_a_jog_ends_near_where_it_was_stopped(
    make_device: Callable[..., Device], seed: int, speed: int, late: str
) -> None:
    """Not earlier than when the controller can look, then what is committed and the way to a stop."""
    device, rng = make_device(), random.Random(f"{seed} {speed} {late}")
    device.send(Jog(0, 1, speed))
    device.run(0.5 + rng.uniform(0, 1))
    at, for_s = device.position[0], rng.choice([0.05, 0.3, 1.0])
    for side in stalls.LATE[late]:
        stalls.stall(device.lib, device.host, side, 0.0, for_s, TIMER_HZ)
    device.send(JogStop(axis=0xFF))
    rest(device)
    # a motion side that is late keeps what was published before
    assert device.position[0] - at <= speed * COMMITTED_S + speed**2 / (2 * ACCEL) + 4
    assert device.position == device.pulses
    assert_smooth(device, 0)


@pytest.mark.alike(4)
@pytest.mark.parametrize("late", stalls.LATE)
@pytest.mark.parametrize("seed", stalls.seeds(8))
def test_holds_of_a_host_lose_nothing(make_device: Callable[..., Device], seed: int, late: str) -> None:
    device, rng = make_device(settings=PATIENT), random.Random(f"{seed} {late}")
    put_line(device, 12)
    stalled(device, rng, late, 60)
    for _ in range(10):
        device.run(rng.expovariate(6))
        device.send(rng.choice([Hold(), Resume()]))
    device.run(3)
    device.send(Resume())
    device.run(30)
    assert device.position == device.pulses == [7_680, 0, 0, 0, 0, 0]
    assert (device.edges(0)[1] == 1).all()
    assert_smooth(device, 0)


@pytest.mark.alike(4)
@pytest.mark.parametrize("late", stalls.LATE)
@pytest.mark.parametrize("seed", stalls.seeds(8))
def test_a_job_that_a_host_interrupts_ends_where_it_should(
    make_device: Callable[..., Device], seed: int, late: str
) -> None:
    device, rng = make_device(), random.Random(f"{seed} {late}")
    client = device.connect()
    stalled(device, rng, late, 60)
    device.text("M3S1000\nG1F3000X20\nY15\nG2X0Y0R20\nG1X5Z2\nX0Z0\nM5\nM30\n")
    device.run(rng.uniform(0.05, 1.2))
    for _ in range(rng.randrange(1, 6)):
        device.motion(segment(rng.choice([-9, 9]), rng.choice([-9, 0, 9])))
        device.run(rng.expovariate(8))
    device.run(rng.expovariate(1))
    device.disconnect(client)
    said, end = device.heard(), device.now + 150
    while "Pgm End" not in said and device.now < end:
        device.run(2)
        device.text("~")
        said += device.heard()
    device.run(5)
    assert device.position == device.pulses == [0] * 6
    assert device.state == "Idle" and device.outputs().spindle_direction == 0
    assert_all_smooth(device)


def test_both_sides_and_the_reader_are_late_in_turn(make_device: Callable[..., Device]) -> None:
    """Every side for 20 to 400 ms, the next one beginning before the last ends, at every phase of a short stream."""
    for shift in range(12):
        device = make_device()
        for turn in range(12):
            side = list(stalls.Side)[turn % 3]
            stalls.stall(device.lib, device.host, side, 0.017 * shift + 0.11 * turn, 0.02 + 0.035 * turn, TIMER_HZ)
        put_line(device, 6)
        device.text("?")
        device.run(20)
        assert device.position == device.pulses == [3_840, 0, 0, 0, 0, 0]
        assert np.ptp(device.edges(0)[0]) < 10
        assert_smooth(device, 0)
