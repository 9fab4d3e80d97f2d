"""Fields of handshake and status during motion: misc inputs and outputs, the spindle's encoder, the charge pump."""

from __future__ import annotations

import math
from collections.abc import Callable

import pytest
from test_requests import config, configure
from wificnc.connection.wmc3.layout import (
    Capability,
    Handshake,
    HandshakeResponse,
    IoControl,
    JogStop,
    Refusal,
    Status,
    ValueType,
)
from wire_device import OTHER, TIMER_HZ, Device, Sent

Make = Callable[..., Device]
ENCODER = {88: 4096, 76: 10}
INDEX_REV = 0.375  # where the virtual spindle has its index: targets/pc/virtual_spindle.c


def hello(device: Device) -> HandshakeResponse:
    reply = device.request(device.connect(), Handshake()).payload
    assert isinstance(reply, HandshakeResponse)
    return reply


def test_capabilities_are_those_of_the_board(make_device: Make) -> None:
    every = Capability.MISC_OUTPUTS | Capability.MISC_INPUTS | Capability.SPINDLE_PWM | Capability.STREAM
    assert hello(make_device()).capabilities == every
    poor = make_device(digital_inputs=0, digital_outputs=0, missing_outputs=2)
    assert hello(poor).capabilities == Capability.STREAM
    encoder = hello(make_device(encoder=1, settings=ENCODER))
    assert encoder.capabilities == every | Capability.ENCODER
    assert encoder.encoder_ppr_high << 8 | encoder.encoder_ppr_low == 1024
    silent = hello(make_device(encoder=1, settings={88: 0}))
    assert not silent.capabilities & Capability.ENCODER and silent.encoder_ppr_low == 0


def test_misc_inputs_are_levels_of_the_boards_inputs(device: Device) -> None:
    device.send(JogStop(0xFF))
    for mask in (0b0000, 0b0101, 0b1010, 0b1111):
        for n in range(4):
            device.input(f"input-{n}", bool(mask >> n & 1))
        device.run(0.06)
        assert device.status.misc_inputs == mask


def test_misc_outputs_are_reported_as_they_are_driven(make_device: Make) -> None:
    device = make_device(digital_outputs=2)
    device.send(IoControl(misc_outputs=0x1F))
    device.run(0.06)
    assert device.status.misc_outputs == 0b11


@pytest.mark.parametrize(("spindle", "rpm"), [(1, 600), (2, 600), (1, 6000), (2, 15000)])
def test_the_encoder_says_speed_angle_and_turns(make_device: Make, spindle: int, rpm: int) -> None:
    """The angle is that of the report's own time stamp, so a host can extrapolate."""
    device = make_device(encoder=1, settings={**ENCODER, 30: 20000})
    device.send(IoControl(spindle=spindle, rpm=rpm))
    device.run(1.0)
    device.sent.clear()
    device.run(0.3)
    reports = [(sent, sent.packet.payload) for sent in device.sent]
    assert len(reports) >= 29
    sign = 1 if spindle == 1 else -1
    first = None
    for sent, status in reports:
        assert isinstance(status, Status)
        assert status.rpm == pytest.approx(rpm, rel=1e-3, abs=1)
        signed = status.spindle_turns - (status.spindle_turns >> 31 << 32)
        turns = signed + status.spindle_angle / 65536
        truth = device.lib.virtual_spindle_angle(device.host, stamp_ticks(device, sent))
        assert turns == pytest.approx(truth - INDEX_REV, abs=0.002), "the index lies at whole turns"
        first = turns if first is None else first
    assert (turns - first) * sign == pytest.approx(rpm / 60 * 0.01 * (len(reports) - 1), rel=0.01)


def stamp_ticks(device: Device, sent: Sent) -> int:
    """The report's time stamp as virtual time; it counts from the start of the session, which is at 0."""
    return round(sent.packet.header.timestamp_us * TIMER_HZ / 1e6)


def test_a_spindle_that_stands_keeps_its_angle(make_device: Make) -> None:
    device = make_device(encoder=1, settings=ENCODER)
    device.send(IoControl(spindle=1, rpm=600))
    device.run(1.03)
    device.send(IoControl(spindle=0))
    device.run(1.0)
    truth = device.lib.virtual_spindle_angle(device.host, round(device.now * TIMER_HZ))
    assert device.status.rpm == 0
    turned = device.status.spindle_turns + device.status.spindle_angle / 65536
    assert turned == pytest.approx(truth - INDEX_REV, abs=1.5 / 4096) and math.floor(truth) > 5


def test_without_an_encoder_the_commanded_speed_is_said(device: Device) -> None:
    device.send(IoControl(spindle=1, rpm=900))
    device.run(0.1)
    status = device.status
    assert (status.rpm, status.spindle_angle, status.spindle_turns) == (900, 0, 0)


def test_pulses_of_the_encoder_are_a_quarter_of_its_counts(make_device: Make) -> None:
    device = make_device(encoder=1, settings=ENCODER)
    client = device.connect()
    assert config(device, client, 0x0523) == (ValueType.U16, 1024)
    assert configure(device, client, 0x0523, ValueType.U16, 512) == Refusal.NONE
    assert config(device, client, 0x0523) == (ValueType.U16, 512)
    assert hello(device).encoder_ppr_high == 2
    assert configure(device, client, 0x0523, ValueType.U16, 16384) == Refusal.RANGE, "65536 counts"


def test_a_board_without_a_charge_pump_says_so(device: Device) -> None:
    client = device.connect()
    assert config(device, client, 0x0400) == (ValueType.U16, 0)
    assert configure(device, client, 0x0400, ValueType.U16, 10_000) == Refusal.NO_OUTPUT
    assert configure(device, client, 0x0400, ValueType.U16, 0) == Refusal.NONE
    assert not hello(device).capabilities & Capability.CHARGE_PUMP


def test_the_charge_pump_runs_at_the_frequency_of_its_key(make_device: Make) -> None:
    clock_hz = 20_000_000
    device = make_device(pump_hz=10_000, pump_clock_hz=clock_hz, pump_ticks_min=256, pump_ticks_max=262_143)
    client = device.connect()
    assert hello(device).capabilities & Capability.CHARGE_PUMP
    assert config(device, client, 0x0400) == (ValueType.U16, 10_000)
    for hz in (12_500, 0):
        assert configure(device, client, 0x0400, ValueType.U16, hz) == Refusal.NONE
        assert config(device, client, 0x0400) == (ValueType.U16, hz)
        assert device.outputs().pump_ticks == (clock_hz // hz if hz else 0)
    for hz in (76, 20_001):
        assert configure(device, client, 0x0400, ValueType.U16, hz) == Refusal.RANGE
    assert config(device, client, 0x0400) == (ValueType.U16, 0)


def test_a_host_that_leaves_stops_no_spindle_of_a_job(device: Device) -> None:
    """It has commanded (outputs that are off, over and over), but nothing that runs is its own."""
    client = device.connect()
    device.send(IoControl())
    device.text("M3 S700 M8\nG1 X-20 F600\n")
    for _ in range(20):
        device.send(IoControl())
        device.run(0.05)
    assert (device.status.spindle, device.status.coolant) == (1, 1)
    device.disconnect(client)
    device.run(0.2)
    assert (device.status.spindle, device.status.coolant) == (1, 1)


def test_a_host_that_leaves_takes_its_spindle_with_it_also_after_long_silence(device: Device) -> None:
    """It said so once, and lost command by its silence ($77 is 2 s)."""
    client = device.connect()
    device.send(IoControl(spindle=1, rpm=500, coolant=1))
    device.run(5)
    assert (device.status.spindle, device.status.coolant) == (1, 1)
    device.disconnect(client)
    device.run(0.1)
    assert (device.status.spindle, device.status.coolant) == (0, 0)


def test_the_connection_that_a_spindle_depends_on_is_taken_from_nobody(device: Device) -> None:
    """A fifth client may take a place that was silent for 30 s."""
    assert device.connect() == 0
    device.send(IoControl(spindle=1, rpm=500))
    device.run(31)
    assert [device.connect(OTHER) for _ in range(4)] == [1, 2, 3, -1]
    assert device.status.spindle == 1
    device.send(IoControl())
    device.run(31)
    assert device.connect(OTHER) == 0, "it does not run any more"


def test_what_the_text_side_has_switched_since_is_not_the_hosts(device: Device) -> None:
    client = device.connect()
    device.send(IoControl(spindle=2, rpm=500, coolant=1))
    device.run(0.1)
    device.text("M3 S700\nG1 X-20 F600\n")
    device.run(0.5)
    device.send(IoControl(spindle=2, rpm=500, coolant=1))
    device.disconnect(client)
    device.run(0.2)
    assert (device.status.spindle, device.status.coolant) == (1, 1), "a job's are left alone"
    device.run(10)
    assert (device.status.spindle, device.status.coolant) == (1, 0), "then its own goes off, the spindle is not"


def test_only_what_changes_acts(device: Device) -> None:
    """A host switches a misc output, or its own coolant off, while a job of the text side runs."""
    device.send(IoControl(coolant=2))
    device.run(0.1)
    device.text("M3 S700 M8\nG1 X-20 F600\n")
    device.run(0.5)
    device.send(IoControl(misc_outputs=1, coolant=2))
    device.run(0.1)
    status = device.status
    assert (status.misc_outputs, status.spindle, status.rpm, status.coolant) == (1, 1, 700, 0b11)
    device.send(IoControl(misc_outputs=1))
    device.run(0.1)
    assert (device.status.spindle, device.status.coolant) == (1, 1), "off is asked for, and done at any time"
    device.send(IoControl(misc_outputs=1, spindle=1, rpm=300))
    device.run(0.1)
    assert (device.status.spindle, device.status.rpm) == (1, 700), "on is refused while a job runs"
