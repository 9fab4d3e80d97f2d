"""A network host interrupts a job of the text side and releases motion: not a step of either is lost."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
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
    Refusal,
    Reset,
    Resume,
    State,
    StatusFlag,
    StreamClose,  # fmt: skip
)
from wire_device import ACCEL, RATE, TIMER_HZ, Device

JOB = "G21 G90 G64 P0\nG1 X20 F3000\nG1 Y10\nG3 X10 Y20 I-10 J0\nG1 X0 Y0\n"  # 50 mm/s


def path(device: Device) -> list[tuple[int, int, int]]:
    """Where every step event leads, joints X, Y, Z."""
    events = device.steps.events()
    step, sign = events["step"], 1 - 2 * (events["dir"].astype(np.int64)[:, None] >> np.arange(3) & 1)
    moves = (step[:, None] >> np.arange(3) & 1) * sign
    places = np.vstack([np.zeros((1, 3), np.int64), np.cumsum(moves, axis=0)])
    return [tuple(int(steps) for steps in place) for place in places]  # type: ignore[misc]


def run_to(device: Device, condition: Callable[[], bool], most_s: float = 20) -> None:
    """A first step from rest takes 4 ms: whoever looks every ms sees all that lies between two motions."""
    end = device.now + most_s
    while not condition():
        assert device.now < end
        device.run(0.001)


def steps_of(places: list[tuple[int, int, int]]) -> list[int]:
    """Steps of each axis, whatever their direction."""
    return [int(steps) for steps in np.abs(np.diff(np.array(places), axis=0)).sum(axis=0)]


def undisturbed(make_device: Callable[..., Device], job: str = JOB) -> list[tuple[int, int, int]]:
    device = make_device()
    device.text(job)
    device.run(10)
    return path(device)


def flags(device: Device) -> StatusFlag:
    return StatusFlag(device.status.flags) & (StatusFlag.HOST | StatusFlag.JOB)


@pytest.mark.slow
@pytest.mark.parametrize("at_ms", [12, 90, 430, 777, 1100, 1290])
def test_the_job_goes_on_from_the_very_step(make_device: Callable[..., Device], at_ms: int) -> None:
    """Without the host's steps and the way back it makes the steps that it would have made, on the same path."""
    expected = undisturbed(make_device)
    device = make_device()
    device.send(REGISTER)
    device.text(JOB)
    device.run(at_ms / 1000)
    said = device.heard()
    for _ in range(4):
        device.motion(*[segment(40, -60, 80)] * 8)
    run_to(device, lambda: "[MSG:Remote host controls motion: job paused]" in device.heard())
    left, left_at = tuple(device.position[:3]), len(path(device))
    device.run(1.5)
    assert flags(device) == StatusFlag.HOST | StatusFlag.JOB
    assert device.position[:3] == [left[0] + 1280, left[1] - 1920, left[2] + 2560]
    device.send(Reset())
    device.run(1)
    assert device.heard() == "[MSG:Remote host released motion: ~ resumes the job]\r\n"
    assert device.state == "Hold:0" and flags(device) == StatusFlag.JOB
    device.text("~")
    run_to(device, lambda: tuple(device.position[:3]) == left)
    back_at = len(path(device))
    device.run(10)
    places = path(device)
    before, after = places[:left_at], places[back_at - 1 :]
    assert before[-1] == after[0] == left
    assert [x + y for x, y in zip(steps_of(before), steps_of(after), strict=True)] == steps_of(expected)
    near = {(x + dx, y + dy, z) for x, y, z in expected for dx in (-1, 0, 1) for dy in (-1, 0, 1)}
    assert set(before) | set(after) <= near
    assert device.state == "Idle" and places[-1] == expected[-1]
    assert (said + device.heard()).count("ok\r\n") == JOB.count("\n")
    assert device.position == device.pulses


def test_not_a_line_is_lost_or_answered_twice(device: Device) -> None:
    device.heard()
    device.text(JOB)
    device.run(0.5)
    device.motion(segment(100))
    device.run(1)
    device.send(Reset())
    device.run(0.1)
    device.text("~")
    device.run(10)
    assert device.heard().count("ok\r\n") == JOB.count("\n")
    assert device.position[:3] == [0, 0, 0]
    device.text("G0 X1.5\n")
    device.run(1)
    assert device.position[0] == device.pulses[0] == 300, "coordinates are what they were"


def test_offsets_and_modes_outlive_the_host(device: Device) -> None:
    device.text("G10 L2 P1 X5 Y-3\nG92 Z1\nG91\nG1 X10 F600\nX10\n")
    device.run(0.5)
    device.motion(segment(500, 500, 500, us=200_000))
    device.run(1)
    device.send(Reset())
    device.run(0.1)
    device.text("~")
    device.run(10)
    assert device.position[:3] == [4000, 0, 0], "G91: twice 10 mm, although the host was elsewhere"
    device.heard()
    device.text("$#\n")
    device.run(0.1)
    assert "[G54:5.000,-3.000" in device.heard()


def test_it_slows_down_and_returns_within_the_limits(device: Device) -> None:
    device.text("G1 X100 F6000\n")
    device.run(0.8)
    device.motion(*[segment(50, 100)] * 8)
    device.run(1.5)
    device.send(Reset())
    device.run(0.1)
    device.text("~")
    device.run(10)
    for axis in (0, 1):
        t, direction = device.edges(axis)
        gaps = np.diff(t)
        assert gaps.min() >= 1 / RATE - 2 / TIMER_HZ
        speed = direction[1:] / gaps
        grid = np.arange(t[0], t[-1], 0.005)
        at = np.interp(grid, t, np.cumsum(direction))
        change = np.abs(np.diff(at, 2)) / 0.005**2
        assert change.max() <= ACCEL * 1.05 + 4 / 0.005**2, (axis, speed.size)
    assert device.position[:2] == [20_000, 0]


def test_z_goes_up_first_and_down_last(make_device: Callable[..., Device]) -> None:
    for height in (400, -400):
        device = make_device()
        device.text("G1 X20 F1200\n")
        device.run(0.5)
        device.motion(segment(-100, 300, height, us=100_000))
        device.run(1)
        device.send(Reset())
        device.run(0.1)
        begun = device.now
        device.text("~")
        device.run(5)
        z, y = device.edges(2)[0], device.edges(1)[0]
        z, y = z[z > begun], y[y > begun]
        assert len(z) == 400 and len(y) == 300
        assert z.min() > y.max() if height > 0 else z.max() < y.min()
        assert device.position[:3] == [4000, 0, 0]


def test_spindle_coolant_and_outputs_are_the_jobs_again(device: Device) -> None:
    device.send(REGISTER)
    device.send(IoControl(misc_outputs=0b10))
    device.text("M3 S900 M8\nG1 X20 F1200\n")
    device.run(0.5)
    device.motion(segment(50, 50))
    device.run(0.5)
    device.send(IoControl(misc_outputs=0b100, spindle=0, coolant=2))
    device.run(0.1)
    assert (device.status.spindle, device.status.coolant, device.status.misc_outputs) == (0, 2, 4)
    device.send(Reset())
    device.run(0.1)
    device.text("~")
    device.run(3.9)
    status = device.status
    assert (status.spindle, status.rpm, status.coolant, status.misc_outputs) == (1, 900, 1, 2)
    assert status.flags & StatusFlag.MOVING == 0, "the spindle runs up first"
    device.run(5)
    assert device.position[:2] == [4000, 0]
    device.heard()
    device.text("$G\n")
    device.run(0.1)
    said = device.heard()
    assert "M3" in said and "M8" in said and "S900" in said


def test_the_time_out_gives_motion_back_into_a_hold(device: Device) -> None:
    device.text("G1 X20 F1200\n")
    device.run(0.5)
    device.motion(segment(0, 100))
    device.run(1.5)
    assert device.state == "Run"
    device.run(1)  # $77 is 2 s
    assert device.state == "Hold:0"
    before = device.position
    device.run(20)
    assert device.position == before, "nothing moves before someone says so"
    device.send(Resume())
    device.run(5)
    assert device.position[:2] == [4000, 0]


def test_a_host_takes_motion_again(device: Device) -> None:
    device.text("G1 X20 F1200\n")
    for n in range(3):
        device.run(0.3)
        device.motion(segment(0, 100, ident=n))
        device.run(1)
        device.send(Reset())
        device.run(0.1)
        assert device.state == "Hold:0"
    assert device.position[1] == 300
    device.text("~")
    device.run(5)
    assert device.position[:2] == [4000, 0]


def test_a_hold_while_it_slows_down_holds_the_host(device: Device) -> None:
    device.text("G1 X100 F6000\n")
    device.run(0.8)
    device.motion(*[segment(0, 100)] * 8)
    device.send(Hold())
    device.run(2)
    assert device.state == "Hold:0" and device.position[1] == 0
    device.send(Resume())
    device.run(1)
    assert device.position[1] == 800


def test_what_came_while_it_slowed_down_is_executed(device: Device) -> None:
    """10 000 steps/s and 100 000 steps/s2: 0.1 s; a host of ten datagrams meanwhile loses none."""
    device.text("G1 X100 F3000\n")
    device.run(0.8)
    for n in range(10):
        device.motion(segment(0, 10 + n, us=10_000))
        device.run(0.01)
    device.run(1)
    assert device.position[1] == sum(10 + n for n in range(10))
    assert statistics(device).refused_segments == 0


def test_a_stream_interrupts_too(device: Device) -> None:
    device.text("G1 X100 F3000\n")
    device.run(0.8)
    client = device.connect()
    sender = open_stream(device, client)
    ack = ack_of(device, sender, segment(0, 100), segment(0, 100))
    assert (ack.next, ack.taken[0], ack.refusal) == (0, 0b11, Refusal.NONE), "they lie ready"
    device.run(1)
    ack = ack_of(device, sender)
    assert (ack.next, ack.done) == (2, 2) and device.position[1] == 200
    assert reason(device, client, Reset()) == Refusal.BUSY, "the stream is open"
    device.request(client, StreamClose(sender.stream))
    assert reason(device, client, Reset()) == Refusal.NONE
    device.text("~")
    device.run(5)
    assert device.position[:2] == [20_000, 0]


def test_segments_that_leave_the_travel_from_where_the_job_stands(make_device: Callable[..., Device]) -> None:
    """Travel 200 mm, 0 .. -40 000 steps; at X-10 the way to 0 is 2000 steps."""
    device = make_device(settings={22: 1, 20: 1})
    device.text("$X\nG1 X-10 F6000\nG4 P5\n")
    device.run(1)
    client = device.connect()
    sender = open_stream(device, client)
    ack_of(device, sender, segment(100), segment(2000, us=200_000), segment(100))
    device.run(1)
    ack = ack_of(device, sender)
    assert (ack.refusal, ack.refused, ack.done) == (Refusal.TRAVEL, 1, 1)
    assert device.position[0] == -2000 + 100
    assert statistics(device).refused_segments == 2


@pytest.mark.parametrize("payload", [Jog(1, 1, 500), Home(axes=1)])
def test_jogs_and_homing_interrupt_no_job(make_device: Callable[..., Device], payload: Jog | Home) -> None:
    device = make_device(settings={22: 1})
    device.text("$X\nG1 X10 F1000\n")
    device.run(0.3)
    assert reason(device, device.connect(), payload) == Refusal.TEXT
    device.run(3)
    assert device.position[:2] == [2000, 0]


@pytest.mark.parametrize("line", ["$J=G91 X20 F1200\n", "G38.2 Z-20 F600\n", "M0\n", "M53 P0\nG1 X20 F1200\n"])
def test_what_cannot_be_interrupted(device: Device, line: str) -> None:
    device.text(line)
    device.run(0.5)
    before = device.position[1]
    device.motion(segment(0, 100))
    device.run(0.2)
    assert device.position[1] == before == 0
    assert statistics(device).last_refusal in (Refusal.TEXT, Refusal.BUSY)


def test_a_refused_segment_interrupts_nothing(device: Device) -> None:
    device.text("G1 X10 F1000\n")
    device.run(0.3)
    device.heard()
    device.motion(segment(10**9))
    device.run(0.2)
    assert statistics(device).last_refusal == Refusal.TOO_FAST
    assert device.state == "Run" and "Host" not in device.heard()


@pytest.mark.parametrize("stop", ["\x18", "estop"])
def test_a_reset_or_an_estop_gives_the_job_up(device: Device, stop: str) -> None:
    device.text(JOB)
    device.run(0.5)
    device.motion(*[segment(0, 10, 20)] * 8)
    device.run(0.3)
    if stop == "estop":
        device.send(Estop())
    else:
        device.text(stop)
    device.run(0.7)
    assert device.position == device.pulses
    device.send(Reset())
    device.text("\x18$X\n")
    device.run(1)
    at = device.position
    device.heard()
    device.text("~\nG91 G0 X1\n")
    device.run(2)
    assert device.position == [at[0] + 200, *at[1:]] and device.status.state == State.IDLE
    assert flags(device) in (StatusFlag(0), StatusFlag.HOST)


@pytest.mark.parametrize("how", ["hold", "host"])
@pytest.mark.parametrize("at_ms", [20, 48, 62, 76, 104, 140])
def test_a_stop_near_the_end_of_what_is_planned(device: Device, how: str, at_ms: int) -> None:
    """The moves of a canned cycle fold into few pieces, and the first of them is still open where it stops: who starts
    so near to its end asks for the rest only when it is at rest there."""
    device.text("G90\nG98 G81 X2 Y2 Z-3 R1 F900\nX4\nX6 Y1\nG80\nG0 X0 Y0 Z0\n")
    device.run(at_ms / 1000)
    if how == "hold":
        device.text("!")
    else:
        device.motion(segment(10, 10, 10))
    device.run(0.5)
    device.send(Reset())
    device.run(0.05)
    device.text("~")
    device.run(12)
    assert device.state == "Idle" and device.position[:3] == [0, 0, 0]
    assert device.heard().count("ok\r\n") == 6
