"""The component and a controller in virtual time: hand-over of probing and homing, e-stop, reconnection."""

from __future__ import annotations

import math
from collections.abc import Callable

import numpy as np
import pytest
from link_bench import G38, SCALE, SWITCHES, Bench, HomeByIndex, homing_bench, mover
from wificnc.connection.wmc3.layout import Ack, Estop, HandshakeResponse, Home, Reset, State, Type
from wificnc.connection.wmc3.packet import HEADER_SIZE, build, crc16
from wire_device import OTHER, TIMER_HZ
from wire_device import Device as VirtualDevice


def shaped(shaper: int) -> dict[int, float]:
    return {176: 1, **{170 + axis: shaper for axis in range(6)}}


@pytest.mark.parametrize("shaper", [0, 3])
def test_it_follows_to_the_step(make_bench: Callable[..., Bench], shaper: int) -> None:
    """With input shapers for a host's motion, too."""
    bench = make_bench(settings=shaped(shaper))
    bench.enable()
    moves = [mover(bench, joint, target, 50.0) for joint, target in enumerate((20.003, -7.5, 3.3333))]
    bench.each_servo = lambda: [move() for move in moves] and None
    bench.run(3)
    assert bench.virtual.position[:3] == bench.virtual.pulses[:3] == [round(20.003 * 200), -1500, round(3.3333 * 200)]
    assert bench.feedback == pytest.approx([20.003, -7.5, 3.3333], abs=0.5 / SCALE)
    assert bench.pins["underruns"] == 0 and not bench.pins["fault"]


def test_a_lossy_network_costs_no_step(bench: Bench) -> None:
    """30 % of all datagrams are lost, both ways, and 30 % come twice."""
    bench.wire.loss = 0.3
    bench.enable()
    bench.each_servo = mover(bench, 0, 40.003, 50.0)
    bench.run(3)
    assert bench.virtual.position == bench.virtual.pulses == [round(40.003 * SCALE), 0, 0, 0, 0, 0]
    assert bench.pins["underruns"] == 0 and not bench.pins["fault"]


def test_a_component_that_gets_its_turn_late_cuts_no_corner(bench: Bench) -> None:
    """It sleeps for 70 ms around a corner. Each servo period was sampled, so the path is what it would have been."""
    bench.enable()
    speed = 50.0

    def corner() -> None:
        """X, and then Y: LinuxCNC with exact stop switched off would round this, but it is what it commands."""
        joint = 0 if bench.command[0] < 20.0 else 1
        bench.command[joint] += speed * 0.001

    bench.each_servo = corner
    bench.run_to(lambda: bench.command[0] > 18.5)
    bench.is_held_up = True
    bench.run(0.07)
    bench.is_held_up = False
    bench.run(0.5)
    times = [bench.virtual.edges(axis)[0] for axis in (0, 1)]
    late_s = times[0][-1] - times[1][0]  # X still moves while Y does
    assert late_s <= 0.0101, "at most one slice of 10 ms has both"
    assert bench.pins["underruns"] == 0 and not bench.pins["fault"]


def test_a_sampler_that_was_never_added_is_a_fault(bench: Bench) -> None:
    bench.samples_come = False
    bench.run(0.2)
    bench.pins["enable"] = True
    bench.run(1.5)
    assert (
        bench.pins["fault"]
        and bench.pins["message.servo"]
        and bench.said == ["the servo thread gives no samples: load sampler, and addf it, as docs/linuxcnc.md shows"]
    )


def test_a_servo_thread_that_stops_is_another_fault(bench: Bench) -> None:
    """It has run: nothing is missing in the HAL file."""
    bench.enable()
    bench.samples_come = False
    bench.run(1.2)
    assert bench.pins["fault"] and bench.pins["message.servo"] and len(bench.said) == 1
    assert "has stopped for more than 1 s" in bench.said[0] and "addf" not in bench.said[0]


def test_samples_that_the_sampler_could_not_keep_are_a_fault(bench: Bench) -> None:
    """What was commanded in those periods is not known: the machine stops, instead of cutting the corner."""
    bench.lib.link_note_lost_samples(bench.link, 3)
    bench.enable()
    bench.lib.link_note_lost_samples(bench.link, 3)
    bench.each_servo = mover(bench, 0, 50.0, 20.0)
    bench.run(0.5)
    assert not bench.pins["fault"], "those of before mean nothing"
    bench.lib.link_note_lost_samples(bench.link, 45)
    at = bench.virtual.position[0]
    bench.run(1)
    assert bench.pins["fault"] and bench.pins["message.servo"] and bench.pins["samples-lost"] == 45
    assert "42 servo periods" in bench.said[0]
    assert bench.virtual.position[0] - at < 0.05 * 20.0 * 200, "a ramp, not the queue"


def test_a_scale_that_is_none(bench: Bench) -> None:
    bench.run(0.1)
    bench.pins["joint.2.scale"] = math.nan
    bench.pins["enable"] = True
    bench.run(0.1)
    assert bench.pins["fault"] and bench.said == ["joint.2.scale is not a number of steps per unit"]


def test_switched_off_it_leaves_the_text_side_alone(bench: Bench) -> None:
    """What it sends to stay in touch ends no jog."""
    bench.run(0.5)
    bench.virtual.text("$J=G91X20F300\n")
    bench.run(3)
    assert bench.virtual.state == "Jog"
    bench.run(2)
    assert bench.virtual.position[0] == 4000 and bench.feedback[0] == 20.0


# ---- who it is ----


def test_a_key(make_bench: Callable[..., Bench]) -> None:
    bench = make_bench(key="open sesame")
    bench.enable()
    bench.each_servo = mover(bench, 0, 1.0, 20.0)
    bench.run(1)
    assert bench.virtual.position[0] == 200


@pytest.mark.parametrize(
    ("key", "lost"),
    [
        ("wrong", "the controller refuses the access key: wificnc linuxcnc pair"),
        ("", "the controller is locked: wificnc linuxcnc pair"),
    ],
)
def test_a_wrong_key(key: str, lost: str) -> None:
    device = VirtualDevice(key="right")
    bench = Bench(device, key=key)
    bench.run(0.1)
    assert bench.lost == lost and not bench.pins["connected"]
    device.close()


def test_a_controller_with_too_few_axes() -> None:
    device = VirtualDevice(axes=3)
    bench = Bench(device, joints=4)
    bench.run(0.1)
    assert bench.lost == "the controller has fewer axes than --joints says"
    device.close()


def message(packet: bytes) -> bytes:
    return len(packet).to_bytes(2, "little") + packet


@pytest.mark.parametrize(
    "said",
    [
        message(bytes(18)),
        message(build(Ack())),  # a good one, and nothing was asked
        b"\xff\xff",  # longer than any
    ],
)
def test_an_answer_that_is_none_ends_the_connection(bench: Bench, said: bytes) -> None:
    bench.run(0.1)
    bench.wire.answers.append(said)
    bench.run(0.02)
    assert bench.lost == "the controller answers something else than it was asked"


def test_an_answer_that_is_too_short_ends_the_connection(bench: Bench) -> None:
    """Three bytes where a handshake's response has 48; only the header says how many there are."""
    packet = bytearray(build(HandshakeResponse(axes=3)))[: HEADER_SIZE + 3]
    packet[6:8] = (3).to_bytes(2, "little")
    packet[16:18] = bytes(2)
    packet[16:18] = crc16(bytes(packet)).to_bytes(2, "little")
    bench.wire.answers[:] = [message(bytes(packet))]
    bench.run(0.02)
    assert bench.lost == "the controller answers something else than it was asked"


def test_a_controller_that_reports_and_does_not_answer(bench: Bench) -> None:
    bench.enable()
    bench.wire.is_mute = True
    bench.run(7)
    assert bench.lost == "the controller does not answer"


def test_reports_out_of_order(bench: Bench) -> None:
    """One that comes late is older than what is known."""
    bench.enable()
    bench.virtual.run(0.05)
    old = bench.virtual.of_type(Type.STATUS)[0].data
    bench.each_servo = mover(bench, 0, 1.0, 20.0)
    bench.run(1)
    peer = bench.lib.component_peer(bench.link)
    bench.lib.peer_hear_udp(peer, old, len(old), bench.virtual.now)
    assert bench.feedback[0] == 1.0


def test_a_scale_of_0_is_1(bench: Bench) -> None:
    bench.pins["joint.0.scale"] = 0.0
    bench.enable()
    bench.each_servo = mover(bench, 0, 30.0, 50.0)
    bench.run(2)
    assert bench.virtual.position[0] == 30 and bench.feedback[0] == 30.0


# ---- probing ----


@pytest.mark.alike(3)
@pytest.mark.parametrize("surface", [-500, -1234, -3999])
@pytest.mark.parametrize("speed", [1.0, 8.0])
def test_g38_measures_the_contact_to_the_step(bench: Bench, surface: int, speed: float) -> None:
    bench.virtual.lib.virtual_surface(bench.virtual.host, surface)
    bench.enable()
    probe = G38(bench, -25.0, speed)
    bench.run_to(lambda: not bench.is_probing)
    assert probe.probed == [0.0, 0.0, surface / SCALE]
    deepest = int(np.cumsum(bench.virtual.edges(2)[1]).min())
    # what is emitted ahead is still gone, then it brakes: slices of 3 ms, two with prep and up to two in the ring
    reaction_s = 4 * 0.003
    brakes = (speed * SCALE) ** 2 / (2 * 100_000) + reaction_s * speed * SCALE + 1
    assert surface - deepest <= brakes, "it stops at the contact, not where LinuxCNC has been meanwhile"
    assert bench.command[2] < deepest / SCALE, "which is behind it"
    bench.run(1)
    stands = bench.virtual.position
    assert min(np.cumsum(bench.virtual.edges(2)[1])) == deepest, "nothing pushes it further"
    assert not bench.pins["fault"] and bench.feedback[2] == stands[2] / SCALE
    bench.each_servo = mover(bench, 2, 3.0, 20.0)
    bench.run(3)
    assert bench.virtual.position[:3] == [0, 0, 600], "the retreat ends where LinuxCNC believes it to"
    assert min(np.cumsum(bench.virtual.edges(2)[1])) == deepest
    assert bench.virtual.position == bench.virtual.pulses


def test_behind_a_contact_sideways_motion_stays_at_its_height(bench: Bench) -> None:
    bench.virtual.lib.virtual_surface(bench.virtual.host, -1000)
    bench.enable()
    G38(bench, -25.0, 8.0)
    bench.run_to(lambda: not bench.is_probing)
    bench.run(0.5)
    z = bench.virtual.position[2]
    bench.each_servo = mover(bench, 0, 4.0, 20.0)
    bench.run(2)
    assert bench.virtual.position[:3] == [800, 0, z]
    bench.each_servo = mover(bench, 2, 0.0, 20.0)
    bench.run(2)
    assert bench.virtual.position[:3] == [800, 0, 0]


@pytest.mark.parametrize("late_s", [0.0, 0.15])
def test_two_touches_after_each_other(bench: Bench, late_s: float) -> None:
    """Fast, a retreat, slowly: as everyone probes. Reports of the time before the contact may come long after it."""
    bench.wire.status_late_s = late_s
    bench.virtual.lib.virtual_surface(bench.virtual.host, -1000)
    bench.enable()
    for speed in (8.0, 1.0):
        probe = G38(bench, -25.0, speed)
        bench.run_to(lambda: not bench.is_probing)
        assert probe.probed == [0.0, 0.0, -5.0]
        bench.each_servo = mover(bench, 2, -4.0, 20.0)
        bench.run(2)
        assert bench.virtual.position[2] == -800 and not bench.pins["probe"]


def test_a_report_from_before_the_motion_is_not_where_it_ended(bench: Bench) -> None:
    """All reports of the motion are lost; the newest that is known says that the machine is where it began."""
    bench.virtual.lib.virtual_surface(bench.virtual.host, -400)
    bench.run(0.1)
    bench.wire.loses_status = True
    bench.pins["enable"] = True
    bench.run(0.05)
    probe = G38(bench, -25.0, 8.0)
    bench.run(0.6)
    assert probe.probed == [0.0, 0.0, -2.0] and not bench.is_open
    bench.wire.loses_status = False
    bench.each_servo = mover(bench, 2, 1.0, 20.0)
    bench.run(2)
    assert bench.virtual.position[2] == 200 and not bench.pins["fault"]


def test_a_probe_that_meets_nothing_changes_nothing(bench: Bench) -> None:
    bench.enable()
    probe = G38(bench, -5.0, 8.0)
    bench.run_to(lambda: not bench.is_probing)
    bench.run(1)
    assert probe.probed is None and bench.virtual.position[2] == -1000 and not bench.pins["fault"]
    bench.each_servo = mover(bench, 2, 0.0, 20.0)
    bench.run(2)
    assert bench.virtual.position[2] == 0


def test_probing_away_from_a_contact_is_not_stopped_by_it(bench: Bench) -> None:
    """G38.4: the probe touches, and it moves until it does not."""
    bench.virtual.lib.virtual_surface(bench.virtual.host, -400)
    bench.enable()
    bench.each_servo = mover(bench, 2, -2.5, 20.0)
    bench.run(1)
    assert bench.pins["probe"]
    bench.is_probing = True
    bench.each_servo = mover(bench, 2, 0.0, 5.0)
    bench.run(2)
    assert bench.virtual.position[2] == 0 and not bench.pins["probe"] and not bench.pins["fault"]


def test_a_reset_long_after_a_contact_is_no_contact(bench: Bench) -> None:
    """The stream ends as it does at a contact; the newest result is the old one."""
    bench.virtual.lib.virtual_surface(bench.virtual.host, -400)
    bench.enable()
    G38(bench, -25.0, 8.0)
    bench.run_to(lambda: not bench.is_probing)
    bench.each_servo = mover(bench, 2, 1.0, 20.0)
    bench.run(2)
    assert bench.is_open and not bench.pins["probe"]
    raised: list[bool] = []
    bench.each_servo = lambda: raised.append(bench.pins["probe"])
    bench.virtual.text("\x18")
    bench.run(0.3)
    assert bench.pins["fault"] and not bench.is_open and not any(raised)


def test_behind_a_contact_deeper_is_deeper(bench: Bench) -> None:
    """What LinuxCNC commands further into the workpiece is its will: the distance stays, it does not grow."""
    bench.virtual.lib.virtual_surface(bench.virtual.host, -1000)
    bench.enable()
    G38(bench, -25.0, 8.0)
    bench.run_to(lambda: not bench.is_probing)
    bench.run(0.5)
    z = bench.virtual.position[2]
    bench.each_servo = mover(bench, 2, bench.command[2] - 1.0, 5.0)
    bench.run(2)
    assert bench.virtual.position[2] == z - 200


# ---- homing ----


@pytest.mark.parametrize("joints", [[0, 1, 2], [2], [0, 1]])
def test_homing_is_the_controllers(make_bench: Callable[..., Bench], joints: list[int]) -> None:
    bench = homing_bench(make_bench)
    homing = HomeByIndex(bench, list(joints))
    bench.run(1)
    assert bench.pins["homing"] and bench.status and bench.status.state == State.HOMING
    bench.run_to(lambda: not homing.left, 60)
    # home is -20 mm with 1 mm pulled off
    expected = [-19.0 if joint in joints else 0.0 for joint in range(3)]
    assert bench.feedback == expected and bench.virtual.position[:3] == [round(mm * SCALE) for mm in expected]
    assert homing.worst < 0.2, "no following error, wherever the machine went"
    asked = [packet.payload for packet in bench.wire.requests if isinstance(packet.payload, Home)]
    assert asked == [Home(sum(1 << n for n in joints))]
    bench.run(0.2)
    bench.each_servo = mover(bench, joints[0], -10.0, 20.0)
    bench.run(2)
    assert bench.virtual.position[joints[0]] == -2000 and not bench.pins["fault"]


def test_homing_that_finds_no_switch_is_a_fault(make_bench: Callable[..., Bench]) -> None:
    bench = homing_bench(make_bench)
    bench.virtual.lib.virtual_travel(bench.virtual.host, 0, -100_000, 100_000)
    HomeByIndex(bench, [0])
    bench.run_to(lambda: bool(bench.pins["fault"]), 60)
    assert bench.pins["joint.0.index-enable"] and not bench.pins["ready"]


def test_a_joint_that_has_no_switch_is_not_homed(make_bench: Callable[..., Bench]) -> None:
    """The controller leaves it out and says that it is done. LinuxCNC must not believe that this joint is homed."""
    bench = make_bench(settings=SWITCHES, joints=4)
    bench.virtual.lib.virtual_travel(bench.virtual.host, 0, -1000, 9000)
    bench.enable()
    HomeByIndex(bench, [0, 3])
    bench.run_to(lambda: bool(bench.pins["fault"]), 60)
    assert bench.said == ["the controller has not found its switches"]
    assert bench.pins["joint.0.index-enable"] and bench.pins["joint.3.index-enable"]


# ---- the chain, the link ----


def test_a_command_far_from_where_the_machine_stands_is_a_fault(bench: Bench) -> None:
    bench.run(0.1)
    bench.command[1] = 60.0
    bench.pins["enable"] = True
    bench.run(0.2)
    assert bench.pins["fault"] and bench.virtual.position == [0] * 6
    assert bench.said == ["joint 1 is commanded to 60 and is at 0: switch on again"]


def test_the_estop_chain(bench: Bench) -> None:
    bench.enable()
    assert bench.pins["estop-ok"]
    bench.each_servo = mover(bench, 0, 50.0, 50.0)
    bench.run(0.5)
    bench.pins["estop"] = True
    bench.run(0.05)
    assert bench.pins["estopped"] and not bench.pins["estop-ok"] and not bench.pins["ready"]
    at = bench.virtual.position
    bench.pins["estop"] = bench.pins["enable"] = False
    bench.run(1)
    assert bench.virtual.position == at == bench.virtual.pulses and bench.feedback[0] == at[0] / SCALE
    bench.pins["reset"] = True
    bench.run(0.1)
    bench.pins["reset"] = False
    bench.run(0.1)
    assert bench.pins["estop-ok"] and bench.pins["ready"] and not bench.pins["fault"]
    bench.command[0] = bench.feedback[0]  # LinuxCNC's command follows while it is off
    bench.each_servo = lambda: None
    bench.enable()
    bench.each_servo = mover(bench, 0, 1.0, 50.0)
    bench.run(2)
    assert bench.virtual.position[0] == 200


def test_an_estop_that_another_host_resets(bench: Bench) -> None:
    """As long as LinuxCNC's is pressed, it is."""
    bench.run(0.2)
    bench.pins["estop"] = True
    bench.run(0.2)
    assert bench.pins["estopped"]
    bench.virtual.send(Reset(), address=OTHER)
    bench.run(0.2)
    assert bench.pins["estopped"]
    assert any(isinstance(packet.payload, Estop) for packet in bench.wire.requests), "also where no datagram gets"


def test_a_reset_before_the_estop_is_reported(bench: Bench) -> None:
    """As when LinuxCNC starts: its e-stop is pressed and immediately released. Reports may be a second apart."""
    bench.run(0.2)
    bench.wire.loses_status = True
    bench.pins["estop"] = True
    bench.run(0.05)
    bench.pins["estop"], bench.pins["reset"] = False, True
    bench.run(0.15)
    bench.wire.loses_status = False
    bench.run(0.3)
    assert bench.virtual.state == "Idle" and bench.pins["estop-ok"]


def test_an_estop_input_of_the_controller_reaches_linuxcnc(bench: Bench) -> None:
    bench.enable()
    bench.virtual.input("estop", True)
    bench.run(0.05)
    assert bench.pins["estopped"] and not bench.pins["estop-ok"]


def test_a_link_that_is_lost_and_comes_back(bench: Bench) -> None:
    bench.enable()
    bench.each_servo = mover(bench, 0, 50.0, 20.0)
    bench.run(0.5)
    bench.wire.dead = True
    bench.run(3)
    assert bench.lost in ("the controller is silent", "the controller does not answer")
    assert bench.pins["fault"] and not bench.pins["connected"] and not bench.pins["estop-ok"]
    bench.virtual.run(1)
    stands = bench.virtual.position
    assert 0 < stands[0] < 10_000 and stands == bench.virtual.pulses
    bench.wire.dead = False
    bench.pins["enable"] = False
    bench.each_servo = lambda: None
    bench.command[0] = stands[0] / SCALE
    bench.connect()
    bench.run(0.1)
    assert bench.pins["connected"] and bench.pins["fault"] and not bench.pins["ready"], "until someone says so"
    bench.pins["reset"] = True
    bench.enable()
    assert bench.feedback[0] == stands[0] / SCALE
    bench.each_servo = mover(bench, 0, 5.0, 20.0)
    bench.run(3)
    assert bench.virtual.position[0] == 1000


def test_outputs(bench: Bench) -> None:
    bench.enable()
    for pin in ("spindle-on", "spindle-reverse", "mist", "digital-out-03"):
        bench.pins[pin] = True
    bench.pins["spindle-rpm"] = 700.4
    bench.run(0.1)
    status = bench.status
    assert status and (status.spindle, status.rpm, status.coolant, status.misc_outputs) == (2, 700, 2, 0b1000)
    assert bench.pins["spindle-at-speed"] and bench.pins["spindle-speed-rps"] == pytest.approx(-700 / 60)


def test_inputs(bench: Bench) -> None:
    bench.virtual.input("input-2", True)
    bench.run(0.1)
    assert [bench.pins[f"digital-in-{n:02}"] for n in range(4)] == [False, False, True, False]
    assert [bench.pins[f"digital-in-{n:02}-not"] for n in range(4)] == [True, True, False, True]


# ---- the spindle's encoder ----

ENCODER = {88: 4096, 30: 20_000}
INDEX_REV = 0.375  # where the virtual spindle has its index: targets/pc/virtual_spindle.c


def true_turns(bench: Bench) -> float:
    """From the index."""
    ticks = round(bench.virtual.now * TIMER_HZ)
    return float(bench.virtual.lib.virtual_spindle_angle(bench.virtual.host, ticks)) - INDEX_REV


def start_spindle(bench: Bench, rpm: float) -> None:
    bench.enable()
    bench.pins["spindle-on"], bench.pins["spindle-rpm"] = True, rpm
    bench.run(0.05)
    bench.run_to(lambda: bool(bench.pins["spindle-at-speed"]))


def test_encoder_pins_are_where_the_spindle_is(make_bench: Callable[..., Bench]) -> None:
    bench = make_bench(settings=ENCODER, encoder=1)
    start_spindle(bench, 1200)
    assert bench.pins["spindle-speed-rps"] == pytest.approx(20.0, rel=0.01)
    away = []
    for _ in range(200):
        bench.run(0.001)
        away.append(bench.pins["spindle-revs"] - true_turns(bench))
    assert max(away) - min(away) <= 0.02, "a fiftieth of a turn at 1200 rpm is a ms"
    assert round(away[-1]) == pytest.approx(away[-1], abs=0.25), "0 is at the index, 10 ms late at most"


def test_index_enable_of_the_spindle(make_bench: Callable[..., Bench]) -> None:
    bench = make_bench(settings=ENCODER, encoder=1)
    start_spindle(bench, 300)
    bench.run(0.25)  # until it has turned once the index is not known
    bench.pins["spindle-index-enable"] = True
    before = true_turns(bench)
    bench.run_to(lambda: not bench.pins["spindle-index-enable"], 1)
    zero = true_turns(bench) - bench.pins["spindle-revs"]
    assert zero == pytest.approx(round(zero), abs=0.06), "0 is at an index, 10 ms late at most"
    assert 0.0 <= round(zero) - before <= 1.01, "at the next one; it is looked for from the next ms on"


def cut(bench: Bench, pitch: float, length: float) -> float:
    """A pass of G33 as LinuxCNC makes it. @return by how many turns of the spindle the axis is behind, modulo 1"""
    z0 = bench.command[2]
    bench.pins["spindle-index-enable"] = True
    behind = []

    def follow() -> None:
        if not bench.pins["spindle-index-enable"] and bench.command[2] - z0 < length:
            bench.command[2] = z0 + pitch * bench.pins["spindle-revs"]

    bench.each_servo = follow
    end = bench.virtual.now + 10
    while bench.command[2] - z0 < length:
        bench.run(0.001)
        assert bench.virtual.now < end
        at = bench.virtual.position[2] / SCALE - z0
        if 0.5 * length < at < length - pitch:
            behind.append(true_turns(bench) - at / pitch)
    assert max(behind) - min(behind) <= 2 / SCALE / pitch + 0.02, "along the pass it is one helix: two steps"
    bench.run(1)
    return behind[-1] % 1.0


def test_two_passes_of_g33_are_one_thread(make_bench: Callable[..., Bench]) -> None:
    bench = make_bench(settings=ENCODER, encoder=1)
    start_spindle(bench, 120)
    first = cut(bench, 0.5, 4.0)
    bench.each_servo = mover(bench, 2, 0.0, 20.0)
    bench.run(1.37)
    second = cut(bench, 0.5, 4.0)
    away = (second - first + 0.5) % 1.0 - 0.5
    assert abs(away) * 0.5 <= 2 / SCALE, "to two steps"
