"""What a host leaves behind when it is gone: nothing of it continues for ever, and no cutter stops in the work."""

from __future__ import annotations

from collections.abc import Callable

import pytest
from test_motion import segment
from test_session import reason
from test_stream import ack_of, open_stream
from wificnc.connection.wmc3.layout import (
    Estop,
    Home,
    HomeComplete,
    IoControl,
    Jog,
    JogStop,
    Refusal,
    Reset,
    Status,
    StatusFlag,
    Type,
)
from wire_device import OTHER, Device

REGISTER = JogStop(axis=0xFF)
SPINDLE = IoControl(misc_outputs=1, spindle=1, rpm=500, coolant=1)
TIMEOUT_S = 2.0  # $77
STOP_S = 0.05  # a jog's ramp


@pytest.fixture
def device(device: Device) -> Device:
    """Someone watches."""
    device.connect(OTHER)
    device.send(REGISTER, address=OTHER)
    return device


def driven(device: Device) -> tuple[int, int, int]:
    status = device.of_type(Type.STATUS, OTHER)[-1].packet.payload
    assert isinstance(status, Status)
    return status.spindle, status.coolant, status.misc_outputs


def test_a_jog_ends_with_the_last_connection_of_its_host(device: Device) -> None:
    first, second = device.connect(), device.connect()
    device.jog(Jog(0, 1, 1000), 3)
    assert device.position[0] > 2900
    device.disconnect(first)
    device.jog(Jog(0, 1, 1000), 1)
    assert device.position[0] > 3900, "there is another one"
    device.disconnect(second)
    at = device.position[0]
    device.run(1)
    assert device.position[0] - at <= 1000 * STOP_S
    assert device.state == "Idle"


def test_the_spindle_stops_however_long_its_host_was_silent(device: Device) -> None:
    client = device.connect()
    assert reason(device, client, SPINDLE) == Refusal.NONE
    device.send(REGISTER)
    device.run(60)
    assert driven(device) == (1, 1, 1), "a connection that lives needs to say nothing"
    device.disconnect(client)
    device.run(0.2)
    assert driven(device) == (0, 0, 1)


def test_the_spindle_of_a_host_without_a_connection_stops_when_it_is_silent(device: Device) -> None:
    device.send(SPINDLE)
    for _ in range(5):
        device.run(0.9 * TIMEOUT_S)
        device.send(REGISTER)
    assert driven(device) == (1, 1, 1)
    device.run(TIMEOUT_S + 0.1)
    assert driven(device) == (0, 0, 1)


def test_the_spindle_turns_until_what_is_queued_is_cut(make_device: Callable[..., Device]) -> None:
    device = make_device(settings={74: 0})
    device.send(REGISTER, address=OTHER)
    client = device.connect()
    sender = open_stream(device, client)
    assert reason(device, client, SPINDLE) == Refusal.NONE
    ack_of(device, sender, *[segment(1000, us=500_000)] * 8)
    device.run(0.5)
    device.disconnect(client)
    while device.position[0] < 8000:
        device.run(0.05)
        assert driven(device)[0] == 1 or device.position[0] == 8000, device.position
    device.run(0.2)
    assert driven(device) == (0, 0, 1)


def test_nobody_else_commands_while_a_hosts_spindle_turns(device: Device) -> None:
    client, other = device.connect(), device.connect(OTHER)
    assert reason(device, client, SPINDLE) == Refusal.NONE
    device.run(2 * TIMEOUT_S)
    assert reason(device, other, Jog(0, 1, 1000)) == Refusal.OWNER
    assert reason(device, client, IoControl(misc_outputs=1)) == Refusal.NONE
    device.run(TIMEOUT_S + 0.1)
    assert reason(device, other, Jog(0, 1, 1000)) == Refusal.NONE


def test_a_host_that_comes_back_in_time_keeps_its_spindle(make_device: Callable[..., Device]) -> None:
    device = make_device(settings={74: 0})
    device.send(REGISTER, address=OTHER)
    client = device.connect()
    sender = open_stream(device, client)
    assert reason(device, client, SPINDLE) == Refusal.NONE
    ack_of(device, sender, *[segment(1000, us=500_000)] * 8)
    device.run(0.5)
    device.disconnect(client)
    device.run(0.5)
    device.connect()
    device.run(10)
    assert driven(device) == (1, 1, 1)


def test_the_spindle_of_the_text_side_is_not_the_hosts(device: Device) -> None:
    client = device.connect()
    assert reason(device, client, SPINDLE) == Refusal.NONE
    device.text("M3 S900 G1 X40 F600\n")
    device.run(1)
    device.disconnect(client)
    device.run(1)
    assert (driven(device)[0], device.state) == (1, "Run")


def test_the_hosts_spindle_stops_also_while_a_job_waits(device: Device) -> None:
    client = device.connect()
    device.text("G1 X40 F600\n")
    device.run(1)
    device.motion(segment(1000, us=500_000))
    device.run(1.5)
    assert device.status.flags & StatusFlag.JOB and not device.status.flags & StatusFlag.MOVING, "it waits"
    assert reason(device, client, SPINDLE) == Refusal.NONE
    device.disconnect(client)
    device.run(0.2)
    assert driven(device) == (0, 0, 1)


def test_after_an_estop_only_a_new_command_starts_the_spindle(device: Device) -> None:
    client = device.connect()
    for payload in (SPINDLE, Estop(), Reset(), SPINDLE):
        assert reason(device, client, payload) == Refusal.NONE
        device.run(0.1)
    assert driven(device)[0] == 0, "a host that repeats itself starts nothing"
    assert reason(device, client, IoControl(misc_outputs=1)) == Refusal.NONE
    assert reason(device, client, SPINDLE) == Refusal.NONE
    device.run(0.1)
    assert driven(device)[0] == 1


@pytest.mark.parametrize("timeout_ms", [500, 60_000])
def test_the_time_is_that_of_setting_77(make_device: Callable[..., Device], timeout_ms: int) -> None:
    device = make_device(settings={77: timeout_ms})
    device.motion(*[segment(1000, us=10_000_000)] * 8)
    device.run(timeout_ms / 1000 - 0.1)
    assert device.state == "Run"
    device.run(0.3)
    assert device.state.startswith("Hold")


def homing(make_device: Callable[..., Device]) -> Device:
    device = make_device(settings={22: 1, 24: 600, 25: 600, 130: 300})
    device.send(REGISTER, address=OTHER)
    device.text("$X\n")
    device.run(0.1)
    return device


@pytest.mark.parametrize("connected", [True, False])
def test_homing_of_a_host_that_is_gone_ends_in_alarm_6(make_device: Callable[..., Device], connected: bool) -> None:
    """By the end of its last connection, or by its silence."""
    device = homing(make_device)
    if connected:
        client = device.connect()
    device.send(Home(axes=1))
    device.run(0.5)
    assert device.state == "Home"
    if connected:
        device.run(2 * TIMEOUT_S)
        assert device.state == "Home", "a connection that lives needs to say nothing"
        device.heard()
        device.disconnect(client)
        device.run(0.1)
    else:
        device.run(TIMEOUT_S)
    assert device.state == "Alarm"
    at = device.position
    device.run(2)
    assert device.position == at == device.pulses
    said = device.heard()
    assert "ALARM:6" in said and "[MSG:Sender lost: homing stopped]" in said
    done = [sent.packet.payload for sent in device.of_type(Type.HOME_COMPLETE, OTHER)]
    assert done == [HomeComplete(1, 0)]


def test_the_text_sides_homing_is_not_the_hosts(make_device: Callable[..., Device]) -> None:
    device = homing(make_device)
    client = device.connect()
    assert reason(device, client, Jog(0, 1, 1000)) == Refusal.NONE
    device.send(REGISTER)
    device.run(TIMEOUT_S + 1)
    device.text("$HX\n")
    device.run(0.5)
    device.disconnect(client)
    device.run(1)
    assert device.state == "Home"


def test_a_refused_host_keeps_nobody_else_out(device: Device) -> None:
    """A jog during a job is refused, and its host commands nothing."""
    client, other = device.connect(), device.connect(OTHER)
    device.text("G1 X40 F100\n")
    device.run(0.5)
    assert reason(device, client, Jog(0, 1, 1000)) == Refusal.TEXT
    assert reason(device, other, Jog(0, 1, 1000)) == Refusal.TEXT
