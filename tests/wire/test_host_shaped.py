"""A network host's motion with input shapers (`$176`): they do to it what they do to the planner's motion
(tests/motion/test_motion_shaper.py has the frame's swing and the oracle of delayed parts)."""

from __future__ import annotations

import itertools
import math
import random
from collections.abc import Callable

import numpy as np
import pytest
import stalls
from numpy.typing import NDArray
from test_motion import profile, segment, speeds
from test_preempt import JOB, flags, path, run_to, undisturbed
from test_session import REGISTER, statistics
from wificnc.connection.wmc3.layout import (
    Estop,
    Hold,
    IoControl,
    Reset,
    Resume,
    Segment,
    SegmentFlag,
    State,
    StatusFlag,
    Take,
)
from wificnc.tune.shapers import SHAPERS, impulses
from wire_device import ACCEL, PATIENT, RATE, TIMER_HZ, Device

Make = Callable[..., Device]
Floats = NDArray[np.float64]
ZV, MZV, EI, EI_2 = 1, 2, 3, 4
DAMPING = 0.02
STEPS_PER_MM = 1600  # fine ones: a single step makes a frame swing, too
FINER = 8  # than those of wire_device.py
WAYS = (100, 600, 2000, 5000)  # of its steps


def shaped(kind: int, hz: float = 40.0, host: int = 1, steps_per_mm: int = STEPS_PER_MM) -> dict[int, float]:
    """On all axes."""
    rows = {100: steps_per_mm, 170: kind, 180: hz, 190: DAMPING}
    return PATIENT | {176: host} | {first + ax: value for first, value in rows.items() for ax in range(6)}


def trapezoid(steps: int, speed: float = 15_000 * FINER, flags: int = 0) -> list[Segment]:
    ways = [n for n in profile(steps, speed, ACCEL * FINER) if n]
    last = flags | SegmentFlag.LAST
    return [segment(n, flags=last if k + 1 == len(ways) else flags) for k, n in enumerate(ways)]


def stream(device: Device, todo: list[Segment]) -> None:
    """The queue is so full that its end slows nothing down."""
    for at in range(0, len(todo), 8):
        device.motion(*todo[at : at + 8])
        device.run(0.07 if at > 64 else 0.0)
    device.run(2)


def residual_um(device: Device, hz: float) -> float:
    """What a frame of this frequency swings after the last pulse, as residual_um() of test_motion_shaper.py."""
    t, direction = device.edges(0)
    root = math.sqrt(1 - DAMPING**2)
    phasors = np.exp((DAMPING + 1j * root) * 2 * math.pi * hz * (t - t[-1]))
    return float(1e3 * abs((direction * phasors).sum()) / STEPS_PER_MM / root)


def swings_um(make_device: Make, settings: dict[int, float], hz: float) -> Floats:
    found = []
    for steps in WAYS:
        device = make_device(settings=settings)
        stream(device, trapezoid(steps * FINER))
        assert device.position[0] == device.pulses[0] == steps * FINER
        found.append(residual_um(device, hz))
    return np.array(found)


@pytest.mark.parametrize(
    ("kind", "off", "most"), [(ZV, 0.0, 0.05), (MZV, 0.1, 0.20), (MZV, -0.1, 0.20), (EI_2, -0.1, 0.20)]
)
def test_the_frame_swings_less(make_device: Make, kind: int, off: float, most: float) -> None:
    """As for the planner's motion."""
    hz = 40.0 * (1 + off)
    plain, less = (swings_um(make_device, shaped(kind, host=host), hz) for host in (0, 1))
    assert np.linalg.norm(plain) > 10
    assert np.linalg.norm(less) <= most * np.linalg.norm(plain)


@pytest.mark.parametrize("kind", [ZV, MZV, EI, EI_2])
def test_motion_is_the_sum_of_its_delayed_parts(make_device: Make, kind: int) -> None:
    parts = impulses(SHAPERS[kind], 40.0, DAMPING)
    plain, late = (make_device(settings=shaped(kind, host=host)) for host in (0, 1))
    for device in (plain, late):
        stream(device, trapezoid(3000 * FINER))
    (t0, _), (t1, _) = plain.edges(0), late.edges(0)
    t = t0[0] + np.linspace(-0.005, t1[-1] - t1[0] + 0.005, 5000)
    want = sum(w * np.searchsorted(t0, t - s, "right") for w, s in zip(parts.weights, parts.times_s, strict=True))
    by = t1[0] - t0[0] + np.arange(-4e-3, 4e-3, 5e-6)
    found = min(np.abs(np.searchsorted(t1, t + s, "right") - want).max() for s in by)
    assert found / STEPS_PER_MM <= 0.003  # mm, of 100 mm/s: 30 us, by which a start in slices of 2 or 3 ms may differ


def test_without_the_setting_nothing_is_shaped(make_device: Make) -> None:
    """Shapers of the axes are for the controller's own motion then."""
    devices = [make_device(settings=shaped(kind, host=0)) for kind in (0, EI)]
    for device in devices:
        stream(device, trapezoid(3000 * FINER))
    first, second = (device.edges(0)[0] for device in devices)
    assert np.array_equal(first - first[0], second - second[0])


@pytest.mark.parametrize("kind", [ZV, EI_2])
@pytest.mark.parametrize("seed", range(6))
def test_any_stream_ends_exactly_within_the_limits(make_device: Make, kind: int, seed: int) -> None:
    """Ways of all lengths and directions in 1 to 40 ms, with pauses, rests and holds."""
    rng = random.Random(seed)
    device = make_device(settings=shaped(kind, hz=25.0, steps_per_mm=200))
    want = np.zeros(3, int)
    for _ in range(25):
        todo = []
        for _ in range(rng.randrange(1, 6)):
            us = rng.choice([1000, 4000, 10_000, 40_000])
            steps = [round(rng.uniform(-1, 1) * RATE * us * 1e-6) * rng.choice([0, 1, 1]) for _ in range(3)]
            want += steps
            todo.append(segment(*steps, us=us, flags=SegmentFlag.LAST if rng.random() < 0.1 else 0))
        device.motion(*todo)
        if rng.random() < 0.2:
            device.send(Hold())
            device.run(rng.uniform(0.01, 0.3))
            device.send(Resume())
        device.run(rng.choice([0.02, 0.2]))
    device.run(25)
    assert device.status.state == State.IDLE
    assert device.position[:3] == device.pulses[:3] == want.tolist()
    for axis in range(3):
        _, speed = speeds(device, axis)
        assert np.abs(speed).max() <= RATE * 1.001 + 500
        # as of a host's slices without a shaper: tests/wire/test_motion.py
        assert (np.abs(np.diff(speed)) <= ACCEL * 0.01 + 2 / 0.01 + 2 / 0.002).all()


def test_a_slow_stream_with_steps_far_apart_keeps_its_time(make_device: Make) -> None:
    """One step each 30 ms, and slices of 1 ms without any between them: as LinuxCNC sends a slow move."""
    device = make_device(settings=shaped(EI))
    todo = [segment(int(k % 30 == 29), us=1000) for k in range(1200)]
    for at in range(0, len(todo), 8):
        device.motion(*todo[at : at + 8])
        device.run(0.008 if at > 40 else 0.0)
    device.run(1)
    t, _ = device.edges(0)
    assert len(t) == 40
    assert t[-5] - t[5] == pytest.approx(30 * 0.030, abs=0.002)


def test_segments_that_probe_are_followed_exactly(make_device: Make) -> None:
    """They begin from rest, and are the same as without a shaper."""
    devices = [make_device(settings=shaped(EI, host=host)) for host in (0, 1)]
    for device in devices:
        stream(device, [*trapezoid(2000)[:-1], *trapezoid(1500, 40_000, SegmentFlag.PROBE)])
        device.run(1)
        assert device.status.state == State.IDLE
    (plain, _), (exact, _) = (device.edges(0) for device in devices)
    assert len(plain) == len(exact)
    probing = len(exact) - 1500
    assert exact[probing] - exact[probing - 1] > 0.005
    # Their beginning differs: the one without a shaper has come at speed.
    assert np.abs(np.diff(exact[-700:]) - np.diff(plain[-700:])).max() < 2e-6


def test_after_a_contact_it_stops_as_without_a_shaper(make_device: Make) -> None:
    stops = []
    for host in (0, 1):
        device = make_device(settings=shaped(EI, host=host))
        stream(device, trapezoid(2000))
        device.lib.virtual_surface(device.host, -3000)
        for _ in range(2):
            device.motion(*[segment(0, 0, -400, flags=SegmentFlag.PROBE) for _ in range(8)])
        device.run(2)
        results = [sent.packet.payload for sent in device.sent if sent.data[5] == 0x23]
        assert [(r.contact, r.position_steps[2]) for r in results] == [(1, -3000)]  # type: ignore[attr-defined]
        assert device.position == device.pulses
        stops.append(device.position[2])
        before = list(device.position)
        stream(device, trapezoid(300))
        assert device.position == device.pulses == [before[0] + 300, *before[1:]]
    assert stops[0] == pytest.approx(stops[1], abs=4)


@pytest.mark.parametrize("after_s", [0.05, 0.2, 0.4])
def test_discard_comes_to_rest_where_the_pulses_are(make_device: Make, after_s: float) -> None:
    device = make_device(settings=shaped(EI_2))
    client = device.connect()
    for _ in range(6):
        device.motion(*[segment(800, -320) for _ in range(8)])
    device.run(after_s)
    device.request(client, Take(discard=1))
    device.run(1)
    assert device.status.state == State.IDLE
    assert device.position == device.pulses
    assert 0 < device.position[0] < 48 * 800
    before = list(device.position)
    stream(device, trapezoid(500))
    assert device.position == device.pulses == [before[0] + 500, *before[1:]]


@pytest.mark.parametrize("after_s", [0.02, 0.11, 0.35])
def test_an_emergency_stop_keeps_the_count(make_device: Make, after_s: float) -> None:
    device = make_device(settings=shaped(EI))
    for _ in range(5):
        device.motion(*[segment(960, 480) for _ in range(8)])
    device.run(after_s)
    device.send(Estop())
    device.run(0.3)
    assert device.position == device.pulses
    device.send(Reset())
    device.run(0.3)
    device.text("$X\n")
    device.run(0.1)
    before = list(device.position)
    stream(device, trapezoid(400))
    assert device.position == device.pulses == [before[0] + 400, *before[1:]]


def test_the_text_side_continues_from_where_the_host_came_to_rest(make_device: Make) -> None:
    device = make_device(settings=shaped(MZV))
    device.text("G91G1F3000X1\n")
    device.run(1)
    stream(device, trapezoid(2000))
    device.send(Reset())
    device.run(1)
    device.text("X-2Y1\n")
    device.run(2)
    assert device.position == device.pulses
    assert device.position[:2] == [2000 - STEPS_PER_MM, STEPS_PER_MM]


def test_a_thousand_segments_a_second_for_long(make_device: Make) -> None:
    """Those that a shaper still needs take no place of those that wait (without one: tests/wire/test_senders.py)."""
    device = make_device(settings=shaped(EI, steps_per_mm=200))
    places = [round(8 * ms + 1000 * math.sin(math.pi * ms / 1000)) for ms in range(5001)]
    steps = [after - before for before, after in itertools.pairwise(places)]
    for first in range(0, len(steps), 8):
        device.motion(*[segment(n, -n, us=1000) for n in steps[first : first + 8]])
        device.run(0.008 if first > 40 else 0.0)
    device.run(1)
    counts = statistics(device)
    assert device.pulses[:2] == [places[-1], -places[-1]]
    assert (counts.segments, counts.underruns, counts.refused_segments) == (5000, 0, 0)


def test_a_laser_is_lit_while_the_axes_move_and_at_no_other_time(make_device: Make) -> None:
    """They move longer than the segments of a cut, and by as much later."""
    device = make_device(settings=shaped(ZV, hz=10.0) | {32: 1, 30: 1000})
    device.send(IoControl(spindle=1, rpm=800))
    device.run(0.05)
    stream_of = trapezoid(4000)
    for at in range(0, len(stream_of), 8):
        device.motion(*stream_of[at : at + 8])
    lit = []
    for _ in range(1000):
        device.run(0.001)
        if device.duty() > 0:
            lit.append(device.now)
    t, _ = device.edges(0)
    assert len(t) == 4000 and device.duty() == 0
    assert lit[0] <= t[0] + 0.003 and lit[-1] >= t[-1] - 0.003
    assert t[0] - 0.006 <= lit[0] and lit[-1] <= t[-1] + 0.02, "a step is the end of its way, not the beginning"
    assert max(np.diff(lit)) < 0.0015


def test_stalls_end_in_a_stop_and_lose_nothing(make_device: Make) -> None:
    device = make_device(settings=shaped(EI, hz=20.0, steps_per_mm=200))
    for _ in range(12):
        device.motion(*[segment(80) for _ in range(8)])
    stalls.stall(device.lib, device.host, stalls.Side.CONTROLLER, 0.4, 1.0, TIMER_HZ)
    device.run(1.2)
    # 50 ms of motion, the stop of 8 000 steps/s, the shaper's window of 50 ms, and a last sample that is filled with
    # rest: they grow to 30 ms (docs/motion.md, section 7)
    assert 0.4 < device.edges(0)[0][-1] < 0.4 + 0.06 + 8_000 / ACCEL + 0.05 + 0.03
    device.run(4)
    assert device.position == device.pulses == [7_680, 0, 0, 0, 0, 0]
    _, speed = speeds(device, 0)
    assert (np.abs(np.diff(speed)) <= ACCEL * 0.002 + 2 / 0.002).all()


@pytest.mark.parametrize("at_s", [0.09, 0.43, 1.1])
def test_a_job_that_a_host_interrupts_continues_on_its_path(make_device: Make, at_s: float) -> None:
    """Both are shaped, by the same history: the job's rests while the host has it."""
    settings = shaped(EI, steps_per_mm=200)
    expected = undisturbed(lambda: make_device(settings=settings))
    device = make_device(settings=settings)
    device.send(REGISTER)
    device.text(JOB)
    device.run(at_s)
    for _ in range(4):
        device.motion(*[segment(40, -60, 80) for _ in range(8)])
    run_to(device, lambda: device.position[2] > 0)
    left_at = len(path(device)) - 1
    device.run(1.5)
    away = device.position[:3]
    assert away[2] == 2560
    device.send(Reset())
    device.run(1)
    device.text("~")
    run_to(device, lambda: device.position[2] == 0)
    back_at = len(path(device))
    device.run(10)
    places = path(device)
    near = {(x + dx, y + dy, z) for x, y, z in expected for dx in range(-2, 3) for dy in range(-2, 3)}
    assert set(places[: left_at - 2]) | set(places[back_at:]) <= near
    assert device.state == "Idle" and places[-1] == expected[-1]
    assert device.position == device.pulses


def test_its_motion_is_no_job_of_the_text_side(make_device: Make) -> None:
    """What has not left the shaper yet is the host's, too."""
    device = make_device(settings=shaped(EI, hz=10.0))
    device.send(REGISTER)
    for _ in range(3):
        device.motion(*[segment(400) for _ in range(8)])
    seen = set()
    while device.state != "Idle" or not seen:
        device.run(0.05)
        seen.add(flags(device))
    assert seen == {StatusFlag.HOST}
    assert device.position == device.pulses == [9600, 0, 0, 0, 0, 0]
