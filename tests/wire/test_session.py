"""Who may move, what is a duplicate, what is refused and why."""

from __future__ import annotations

from collections.abc import Callable

import pytest
from test_motion import segment
from wificnc.connection.wmc3.layout import (
    Ack,
    Estop,
    Hold,
    Home,
    HomeComplete,
    IoControl,
    Jog,
    JogStop,
    Motion,
    Refusal,
    Refused,
    Reset,
    Resume,
    Segment,
    SegmentFlag,
    State,
    Statistics,
    StatisticsResponse,
    Type,
)  # fmt: skip
from wificnc.connection.wmc3.packet import build
from wificnc.connection.wmc3.packing import Layout
from wire_device import OTHER, PATIENT, RATE, TIMER_HZ, Device

REGISTER = JogStop(axis=0xFF)


def statistics(device: Device, client: int | None = None) -> StatisticsResponse:
    client = device.connect() if client is None else client
    reply = device.request(client, Statistics()).payload
    device.disconnect(client)
    assert isinstance(reply, StatisticsResponse)
    return reply


def reason(device: Device, client: int, payload: Layout) -> Refusal:
    """What a request is answered with: NONE for an ack."""
    reply = device.request(client, payload)
    if isinstance(reply.payload, Ack):
        assert (reply.payload.sequence, reply.payload.type) == (device.sequence - 1, payload.TYPE)
        return Refusal.NONE
    assert isinstance(reply.payload, Refused) and reply.payload.type == payload.TYPE
    return Refusal(reply.payload.reason)


# ---- datagrams of hosts without a stream ----


def test_a_doubled_datagram_moves_once(device: Device) -> None:
    data = build(Motion(count=1), 5, 123456, [segment(100)])
    for _ in range(3):
        device.raw(data)
    device.run(0.5)
    assert device.pulses[0] == 100
    assert statistics(device).duplicates == 2


def test_a_host_that_numbers_nothing_is_not_judged(device: Device) -> None:
    """Two datagrams without number and time stamp are two orders."""
    data = build(Motion(count=1), 0, 0, [segment(100)])
    device.raw(data)
    device.raw(data)
    device.run(0.5)
    assert device.pulses[0] == 200


def test_gaps_and_late_datagrams_are_counted(device: Device) -> None:
    for sequence in (1, 2, 5, 6, 4, 7):
        device.raw(build(Motion(count=1), sequence, 1000 + sequence, [segment(10)]))
    device.sequence = 8
    device.run(0.5)
    counts = statistics(device)
    assert (counts.missing, counts.late) == (1, 1), "3 and 4 were missing, 4 came late"
    assert device.pulses[0] == 60
    assert device.status.state == State.IDLE


@pytest.mark.parametrize("begin", [3, 10_000], ids=["first", "anew"])
def test_a_late_begin_hides_no_gap(device: Device, begin: int) -> None:
    """The first datagram overtakes the two before it. They were not missing; a number behind it is, and stays so."""
    if begin > 1000:
        device.raw(build(Motion(count=1), 1, 1, [segment(10)]))
    for sequence in (begin, begin + 2, begin - 1, begin - 2):
        device.raw(build(Motion(count=1), sequence, sequence, [segment(10)]))
    device.sequence = begin + 3
    assert statistics(device).missing == 1


@pytest.mark.parametrize(("seconds", "lost"), [(1.5, 1500), (5, 500), (30, 30_000)])
def test_a_gap_is_one_however_long(make_device: Callable[..., Device], seconds: float, lost: int) -> None:
    """The network was gone, the host continued: also when it lost motion by its silence ($77 is 2 s)."""
    device = make_device(settings={78: 1})
    device.raw(build(Motion(count=1), 1, 1, [segment(100)]))
    device.run(seconds)
    device.raw(build(Motion(count=1), lost + 2, 1, [segment(100)]))
    device.run(1)
    device.sequence = lost + 3
    assert (device.status.state, device.pulses[0]) == (State.HOLD, 100)
    assert statistics(device).missing == lost


@pytest.mark.parametrize("begin", [1, 400, 1_000_000], ids=["small", "near", "random"])
def test_a_program_that_begins_anew_left_no_gap(make_device: Callable[..., Device], begin: int) -> None:
    device = make_device(settings={78: 1})
    device.raw(build(Motion(count=1), 500, 1, [segment(100)]))
    device.run(3)
    device.raw(build(Motion(count=1), begin, 1, [segment(100)]))
    device.run(1)
    device.raw(build(Motion(count=1), begin + 2, 1, [segment(100)]))
    device.run(1)
    device.sequence = begin + 3
    assert (device.status.state, device.pulses[0]) == (State.HOLD, 200), "but a gap of its own is one"
    counts = statistics(device)
    assert (counts.missing, counts.late) == (1, 0)


def test_a_host_after_another_one_left_no_gap(device: Device) -> None:
    device.raw(build(Motion(count=1), 1, 1, [segment(10)]))
    device.run(3)
    device.raw(build(Motion(count=1), 30, 1, [segment(10)]), OTHER)
    device.run(3)
    device.raw(build(Motion(count=1), 50, 1, [segment(10)]))
    device.sequence = 51
    assert statistics(device).missing == 0


def test_the_same_datagram_from_a_program_that_begins_anew_is_another_order(device: Device) -> None:
    """It numbers from 1 and has no clock, so its first datagram may be the same byte for byte."""
    data = build(Motion(count=1), 1, 0, [segment(100)])
    for _ in range(2):
        device.raw(data)
        device.raw(data)
        device.run(3)
    assert device.pulses[0] == 200
    assert statistics(device).duplicates == 2, "those that came immediately"


def test_what_another_host_sends_makes_nothing_a_duplicate(device: Device) -> None:
    data = build(Motion(count=1), 2, 0, [segment(100)])
    device.raw(build(Motion(count=1), 1, 0, [segment(0, 10)]))
    device.raw(data, OTHER)
    device.raw(data)
    device.run(1)
    assert device.pulses[:2] == [100, 10]
    counts = statistics(device)
    assert (counts.duplicates, counts.refused_segments, counts.last_refusal) == (0, 1, Refusal.OWNER)


def test_hold_on_gap_leaves_what_is_behind_the_gap(make_device: Callable[..., Device]) -> None:
    """However short the queue is, it stops before that."""
    device = make_device(settings={78: 1})
    for length in (1, 3, 8):
        device.motion(*[segment(100)] * length)
        device.run(0.025)
        device.sequence += 1  # lost
        device.motion(*[segment(0, 50)] * 8)
        device.run(1)
        assert device.status.state == State.HOLD and device.pulses[1] % 400 == 0
        device.send(Resume())
        device.run(1)
    assert device.pulses[:2] == [1200, 1200]


def test_hold_on_gap(make_device: Callable[..., Device]) -> None:
    device = make_device(settings={78: 1})
    device.raw(build(Motion(count=8), 1, 1, [segment(100)] * 8))
    device.run(0.1)
    device.raw(build(Motion(count=8), 3, 2, [segment(100)] * 8))
    device.run(1)
    assert device.status.state == State.HOLD
    device.send(Resume())
    device.run(1)
    assert device.pulses[0] == 1600


@pytest.mark.parametrize("bad", [[segment(100)] * 200, [segment(100), segment(10**9)]], ids=["full", "too-fast"])
def test_hold_on_gap_holds_also_where_segments_are_refused(
    make_device: Callable[..., Device], bad: list[Segment]
) -> None:
    """Their steps are as lost as those of a datagram that never came."""
    device = make_device(settings={78: 1, **PATIENT})
    for first in range(0, len(bad), 8):
        device.motion(*bad[first : first + 8])
    device.run(2)
    assert device.status.state == State.HOLD
    assert statistics(device, device.connect(OTHER)).refused_segments > 0
    device.motion(segment(0, 100), address=OTHER)
    device.send(Resume())
    device.run(3)
    assert device.status.state == State.IDLE, "another host's are refused, and hold no one up"


def test_motion_that_is_refused_in_an_estop_leaves_no_hold_behind(make_device: Callable[..., Device]) -> None:
    device = make_device(settings={78: 1})
    device.send(Estop())
    device.run(0.6)
    device.motion(segment(100))
    device.run(0.1)
    device.send(Reset())
    device.run(0.2)
    assert device.status.state == State.IDLE
    device.motion(segment(100))
    device.run(0.5)
    assert device.pulses[0] == 100


def test_a_full_queue_is_counted(make_device: Callable[..., Device]) -> None:
    device = make_device(settings=PATIENT)
    device.send(Hold())
    device.run(0.01)
    for _ in range(17):
        device.motion(*[segment(1)] * 8)
    counts = statistics(device, device.connect(OTHER))
    assert (counts.segments, counts.refused_segments, counts.last_refusal) == (128, 8, Refusal.FULL)
    device.send(Resume())
    device.run(3)
    assert device.pulses[0] == 128


@pytest.mark.parametrize("size", [66, 110, 374])
def test_variable_and_full_length_motion(device: Device, size: int) -> None:
    data = build(Motion(count=1), 1, 1, [segment(50), *[Segment()] * ((size - 66) // 44)])
    assert len(data) == size
    device.raw(data)
    device.run(0.5)
    assert device.pulses[0] == 50


@pytest.mark.parametrize(
    "data",
    [
        build(Motion(count=0), 1, 1),
        build(Motion(count=9), 1, 1, [segment(10)] * 8),
        build(Motion(count=2), 1, 1, [segment(10)]),
        build(Motion(count=1), 1, 1, [segment(10)])[:-1],
        bytes([*build(Motion(count=1), 1, 1, [segment(10)])[:4], 2, *build(Motion(count=1), 1, 1, [segment(10)])[5:]]),
        b"",
        b"3CMW",
        bytes(1400),
        bytes([*build(Motion(count=1), 1, 1, [segment(10)])[:-3], 1, 0, 0]),
        bytes([0, *build(Motion(count=1), 1, 1, [segment(10)])[1:]]),
        b"".join([build(Motion(count=8), 1, 1, [segment(10)] * 8)[:6], b"\xff\xff", bytes(1392)]),
    ],
    ids=[
        *("count-0", "count-9", "count-beyond", "cut", "version-2", "empty", "four-bytes", "zeros"),
        *("wrong-checksum", "wrong-magic", "oversized"),
    ],
)
def test_malformed_datagrams_move_nothing_and_are_counted(device: Device, data: bytes) -> None:
    device.raw(data)
    device.run(0.5)
    assert device.pulses == [0] * 6
    assert statistics(device).malformed == 1


@pytest.mark.parametrize(
    ("bad", "why"),
    [
        (segment(10**9), Refusal.TOO_FAST),
        (segment(-(2**31), 2**31 - 1, us=2**32 - 1), Refusal.TOO_FAST),
        (segment(10, us=0), Refusal.TIMING),
        (segment(us=0), Refusal.TIMING),
        (Segment(steps=(1, 0, 0, 0, 0, 0), entry_speed_sq=2**32 - 1, exit_speed_sq=2**32 - 1), Refusal.NONE),
    ],
    ids=["1e9-steps", "all-bits", "no-time", "nothing", "all-speed"],
)
def test_segments_that_cannot_be_move_nothing_and_say_why(device: Device, bad: Segment, why: Refusal) -> None:
    device.motion(bad, segment(0, 5))
    device.run(0.5)
    counts = statistics(device)
    if why == Refusal.NONE:
        assert device.pulses[:2] == [1, 5] and counts.refused_segments == 0
    else:
        assert device.pulses == [0] * 6, "nor what comes behind it in the packet"
        assert (counts.refused_segments, counts.last_refusal) == (2, why)


# ---- owner and listeners ----


def test_only_one_host_commands(device: Device) -> None:
    device.motion(*[segment(100)] * 8)
    device.motion(segment(0, 100), address=OTHER)
    device.send(Jog(1, 1, 500), address=OTHER)
    device.send(IoControl(spindle=1), address=OTHER)
    device.run(2)
    assert device.pulses == [800, 0, 0, 0, 0, 0]
    assert statistics(device).last_refusal == Refusal.OWNER
    device.run(3)  # the owner was silent for $77 = 2 s
    device.motion(segment(0, 100), address=OTHER)
    device.run(1)
    assert device.pulses == [800, 100, 0, 0, 0, 0]


def test_anybody_may_stop(device: Device) -> None:
    device.motion(*[segment(100)] * 8)
    device.run(0.03)
    device.send(Estop(), address=OTHER)
    device.run(0.1)
    assert device.status.state == State.ESTOP and device.pulses[0] < 800
    device.send(Reset(), address=OTHER)
    device.run(0.1)
    assert device.status.state == State.ESTOP, "the owner is the one to unlock"


def test_asking_takes_the_status_from_nobody(device: Device) -> None:
    device.send(REGISTER)
    device.send(REGISTER, address=OTHER)
    device.sent.clear()
    device.run(1)
    assert len(device.of_type(Type.STATUS)) == len(device.of_type(Type.STATUS, OTHER)) == pytest.approx(20, abs=1)


def test_many_who_ask_do_not_take_the_owners_place(device: Device) -> None:
    device.motion(segment(10))
    for last in range(50):
        device.send(REGISTER, address=f"10.1.0.{last}")
    device.sent.clear()
    device.run(1)
    assert len(device.of_type(Type.STATUS)) == pytest.approx(20, abs=1)
    assert len(device.sent) == pytest.approx(80, abs=4), "four at most"


def test_the_text_side_waits_and_gets_motion_back(device: Device) -> None:
    device.heard()
    device.motion(segment(100))
    device.text("G0 X1\n")
    device.run(1)
    assert device.pulses[0] == 100
    assert device.heard() == "[MSG:Remote host controls motion]\r\n"
    device.send(Reset())
    device.run(1)
    assert device.heard() == "[MSG:Remote host released motion]\r\nok\r\n"
    assert device.position[0] == device.pulses[0] == 200, "to 1 mm, from where the host stood"


def test_motion_goes_back_by_itself(device: Device) -> None:
    device.motion(segment(100))
    device.text("G0 X1\n")
    for _ in range(300):
        device.send(IoControl())  # as some hosts do all the time
        device.run(0.01)
    assert device.position[0] == 200


def test_a_jog_does_not_disturb_a_job_of_the_text_side(device: Device) -> None:
    """Segments do: test_preempt.py."""
    device.text("G1 X10 F1000\nG1 X0\n")
    device.run(0.3)
    device.send(Jog(1, 1, 500))
    device.run(3)
    assert device.pulses == [0] * 6 and len(device.edges(0)[0]) == 4000 and len(device.edges(1)[0]) == 0


def test_a_reset_of_the_text_side_drops_what_the_host_has_queued(device: Device) -> None:
    for _ in range(8):
        device.motion(*[segment(100)] * 8)
    device.run(0.2)
    device.text("\x18")
    device.run(0.5)
    assert 0 < device.pulses[0] < 6400 and device.position == device.pulses
    assert device.status.state == State.ALARM and device.status.alarm != 0, "stopped in motion"


def test_what_is_refused_takes_no_motion(device: Device) -> None:
    """A hold of the text side; segments and jogs that cannot be: lines of the text side wait for no one."""
    client = device.connect()
    device.text("!")
    device.run(0.1)
    assert device.state.startswith("Hold")
    assert reason(device, client, Jog(0, 1, 1000)) == Refusal.BUSY
    device.text("~")
    device.run(0.1)
    device.motion(segment(10**9))
    device.motion(segment(10, us=0))
    device.text("G0 X1\n")
    device.run(0.5)
    assert device.position[0] == 200 and device.heard() == "ok\r\n"


# ---- jog, home, outputs ----


def test_jog_runs_until_it_is_stopped_with_ramps(device: Device) -> None:
    device.jog(Jog(axis=1, direction=-1, speed_steps_s=2000), 1.5)
    assert device.status.state == State.JOG and device.status.rate_steps_s == pytest.approx(2000, rel=0.05)
    device.send(JogStop(axis=0))
    device.run(0.5)
    assert device.status.state == State.IDLE
    t, direction = device.edges(1)
    assert (direction == -1).all() and len(t) == pytest.approx(3000, abs=60)
    even = t[(t > t[0] + 0.2) & (t < t[0] + 1.3)]
    assert (1 / (even[1:] - even[:-1])).min() > 1990, "it never slows down on its way"


def test_a_jog_replaces_another(device: Device) -> None:
    device.send(Jog(0, 1, 2000))
    device.run(0.5)
    device.send(Jog(2, 1, 1000))
    device.run(0.5)
    device.send(REGISTER)
    device.run(0.5)
    x, _, z, *_ = device.pulses
    assert x == pytest.approx(1000, abs=60) and z == pytest.approx(480, abs=60)


def test_a_jog_ends_at_the_travel(make_device: Callable[..., Device]) -> None:
    device = make_device(settings={22: 1, 20: 1})
    device.send(Reset())
    device.run(0.1)
    device.jog(Jog(0, -1, 20_000), 5)
    device.run(1)
    assert device.pulses[0] == -200 * 200
    assert device.status.state == State.IDLE


@pytest.mark.parametrize("jog", [Jog(0, 0, 100), Jog(0, 2, 100), Jog(6, 1, 100), Jog(0, 1, 0)])
def test_a_wrong_jog_is_ignored(device: Device, jog: Jog) -> None:
    device.send(jog)
    device.run(0.3)
    assert device.pulses == [0] * 6


def test_a_jog_faster_than_the_axis_goes_at_its_top_speed(device: Device) -> None:
    device.send(Jog(0, 1, 0xFFFFFFFF))
    device.run(1)
    device.send(REGISTER)
    device.run(1)
    t, _ = device.edges(0)
    assert (t[1:] - t[:-1]).min() >= 1 / RATE - 2 / TIMER_HZ


def test_homing_leaves_out_what_has_no_end_and_reports(make_device: Callable[..., Device]) -> None:
    device = make_device(settings={22: 1, 23: 63, 27: 1, 130: 20, 131: 20, 132: 0, 133: 0, 134: 0, 135: 0})
    device.lib.virtual_travel(device.host, 0, -1000, 5000)
    device.lib.virtual_travel(device.host, 1, -500, 5000)
    device.connect()  # a host without one would have to be heard of all the time
    device.send(Home(axes=0x3F))
    device.run(0.5)
    assert device.status.state == State.HOMING and device.status.homing == 0b11
    device.run(60)
    done = [sent.packet.payload for sent in device.of_type(Type.HOME_COMPLETE)]
    assert done == [HomeComplete(0x3F, 1)]
    assert device.status.state == State.IDLE
    # home is -20 mm with 1 mm pulled off
    assert device.status.position_steps[:2] == (-19 * 200, -19 * 200)
    assert statistics(device).homed == 0b11
    assert "ok" not in device.heard(), "no line of the text side was answered"


def test_homing_that_finds_nothing_fails_and_says_so(make_device: Callable[..., Device]) -> None:
    device = make_device(settings={22: 1, 130: 5, 131: 0, 132: 0, 133: 0, 134: 0, 135: 0})
    device.send(Home(axes=0x3F))
    device.run(60)
    assert [sent.packet.payload for sent in device.of_type(Type.HOME_COMPLETE)] == [HomeComplete(0x3F, 0)]
    assert device.status.state == State.ALARM and device.status.alarm == 12


def test_outputs_act_on_change_and_are_reported(device: Device) -> None:
    device.send(IoControl(misc_outputs=0b101, spindle=1, rpm=0, coolant=1))
    device.run(0.1)
    status = device.status
    assert (status.misc_outputs, status.spindle, status.coolant) == (0b101, 1, 1)
    device.text("M5 M9\n")
    device.run(0.1)
    device.send(IoControl(misc_outputs=0b101, spindle=1, rpm=0, coolant=1))
    device.run(0.1)
    assert device.status.spindle == 0, "the same again does not undo what the text side did"
    device.send(IoControl(spindle=2, rpm=500, coolant=2))
    device.run(0.1)
    assert (device.status.spindle, device.status.rpm, device.status.coolant) == (2, 500, 2)


def test_outputs_go_off_when_the_owners_connection_ends(device: Device) -> None:
    client = device.connect()
    device.send(IoControl(misc_outputs=1, spindle=1, rpm=500, coolant=1))
    device.run(0.1)
    assert device.status.spindle == 1
    device.disconnect(client)
    device.run(0.1)
    assert (device.status.spindle, device.status.coolant, device.status.misc_outputs) == (0, 0, 1)
    device.send(IoControl(misc_outputs=1, spindle=1, rpm=500, coolant=1))
    device.run(0.1)
    assert device.status.spindle == 1, "its next packet turns it on again"


def test_an_estop_input_is_reported(device: Device) -> None:
    device.send(REGISTER)
    device.input("estop", True)
    device.run(0.1)
    assert (device.status.estop, device.status.state) == (1, State.ESTOP)
    device.send(Reset())
    device.run(0.2)
    assert device.status.state == State.ESTOP, "still pressed"
    device.input("estop", False)
    device.send(Reset())
    device.run(0.2)
    assert (device.status.estop, device.status.state) == (0, State.IDLE)


def test_reports_keep_their_pace_when_the_device_is_late(device: Device) -> None:
    """It looks at the time when it can. What one report is late does not move the next ones."""
    device.text("$76=10\n")
    device.send(JogStop(0xFF))
    device.run(0.05)
    device.sent.clear()
    begin = device.now
    while device.now - begin < 5:
        device.run(0.0037)
    stamps = [sent.packet.header.timestamp_us for sent in device.of_type(Type.STATUS)]
    late_us = [stamp - stamps[0] - 10_000 * n for n, stamp in enumerate(stamps)]
    assert len(stamps) == pytest.approx(500, abs=1)
    assert max(abs(us) for us in late_us) <= 1000


# ---- probing ----


def test_a_probe_that_touches_is_not_pushed_on(device: Device) -> None:
    """A host without a stream continues sending until it hears of the contact."""
    device.lib.virtual_surface(device.host, -500)
    down = segment(0, 0, -20, us=10_000, flags=SegmentFlag.PROBE)
    for _ in range(100):
        device.motion(down)
        device.run(0.01)
    assert [sent.packet.payload.contact for sent in device.sent if sent.data[5] == 0x23] == [1]  # type: ignore[attr-defined]
    assert device.position[2] >= -540, "the ramp, and nothing of what came later"
    counts = statistics(device)
    assert counts.refused_segments > 50 and counts.last_refusal == Refusal.TOUCHES
    device.motion(segment(0, 0, 100), segment(0, 0, -200, us=100_000, flags=SegmentFlag.PROBE))
    device.run(1)
    assert len([sent for sent in device.sent if sent.data[5] == 0x23]) == 2, "away from it, and again"
