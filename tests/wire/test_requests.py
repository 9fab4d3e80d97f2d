"""Requests by TCP: configuration, commands; each has its one answer."""

from __future__ import annotations

import re
import struct
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest
from test_motion import segment
from test_session import reason
from wificnc.connection.wmc3.keys import KEYS
from wificnc.connection.wmc3.layout import (
    Alarm,
    ChannelOutputs,
    ConfigGet,
    ConfigSave,
    ConfigSet,
    ConfigValue,
    Estop,
    Handshake,
    HandshakeResponse,
    Home,
    IoControl,
    Jog,
    JogStop,
    Ping,
    Pong,
    Refusal,
    Refused,
    Reset,
    Resume,
    StreamOpen,
    StreamOpened,
    Type,
    ValueType,
)  # fmt: skip
from wificnc.connection.wmc3.packet import build
from wire_device import OTHER, Device

ROOT = Path(__file__).resolve().parents[2]

# ---- requests ----


@pytest.mark.parametrize("extra", [b"", b"\0"])
def test_handshake_of_36_and_37_bytes(device: Device, extra: bytes) -> None:
    class Longer(Handshake):
        def pack(self) -> bytes:
            return super().pack() + extra

    reply = device.request(device.connect(), Longer(0x01010000, "LinuxCNC WiFi CNC"))
    assert isinstance(reply.payload, HandshakeResponse)
    assert 18 + reply.header.length == 66
    assert (reply.payload.axes, reply.payload.device_name, reply.payload.device_mode) == (6, "WiFiCNC", 0)


def test_ping(device: Device) -> None:
    reply = device.request(device.connect(), Ping(0xDEADBEEF)).payload
    assert reply == Pong(0xDEADBEEF)


def config(device: Device, client: int, key: int) -> tuple[int, Any]:
    """Type and value of a key."""
    value = device.request(client, ConfigGet(key=key)).payload
    assert isinstance(value, ConfigValue) and value.key == key
    code = {0: "<B", 1: "<H", 2: "<I", 3: "<i", 4: "<f"}.get(value.value_type)
    used = struct.calcsize(code) if code else 64
    assert not any(value.value[used:])
    return value.value_type, struct.unpack_from(code, value.value)[0] if code else value.value.split(b"\0")[0]


def configure(device: Device, client: int, key: int, kind: ValueType, value: float) -> Refusal:
    code = {ValueType.U8: "<B", ValueType.U16: "<H", ValueType.U32: "<I", ValueType.I32: "<i", ValueType.FLOAT: "<f"}
    packed = struct.pack(code[kind], value).ljust(64, b"\0")
    return reason(device, client, ConfigSet(key, kind, packed))


def setting(device: Device, number: int) -> float:
    """$number of the text side."""
    device.heard()
    device.text("$$\n")
    device.run(0.01)
    found = re.search(rf"^\${number}=([\d.]+)", device.heard(), re.M)
    assert found
    return float(found[1])


# key, type and value sent, $N and its value
SETS = [
    (0x0001, ValueType.FLOAT, 80.0, 100, 80.0),
    (0x0003, ValueType.FLOAT, -80.0, 102, 80.0),
    (0x0010, ValueType.U32, 10_000, 110, 3000.0),  # 10 000 steps/s at 200 steps/mm
    (0x0021, ValueType.U32, 50_000, 121, 250.0),
    (0x0100, ValueType.U16, 5, 0, 5),
    (0x0102, ValueType.U16, 0, 1, 255),
    (0x0102, ValueType.U16, 300, 1, 300),
    (0x0103, ValueType.U16, 20, 76, 20),
    (0x0300, ValueType.U8, 5, 2, 5),
    (0x0302, ValueType.U8, 0x3F, 4, 1),
    (0x0310, ValueType.U8, 0x3F, 5, 0),
    (0x0310, ValueType.U8, 0, 5, 1),
    (0x0311, ValueType.U8, 0, 5, 1),
    (0x0320, ValueType.U8, 0x05, 23, 0x3A),
    (0x0321, ValueType.U32, 5000, 25, 1500.0),
    (0x0323, ValueType.U32, 100, 27, 0.5),
    (0x0430, ValueType.U16, 1000, 33, 1000),
    (0x0431, ValueType.U32, 24_000, 30, 24_000),
    (0x0100, ValueType.U32, 5, 0, 5),  # the wrong type: converted
    (0x0001, ValueType.U16, 80, 100, 80.0),
]


@pytest.mark.parametrize(("key", "kind", "value", "number", "expected"), SETS)
def test_a_key_is_a_setting_in_its_own_units(
    device: Device, key: int, kind: ValueType, value: float, number: int, expected: float
) -> None:
    client = device.connect()
    assert configure(device, client, key, kind, value) == Refusal.NONE
    assert setting(device, number) == pytest.approx(expected)
    assert config(device, client, key)[1] == pytest.approx(abs(value))


@pytest.mark.parametrize(
    ("key", "kind", "value", "expected"),
    [
        (0x0103, ValueType.U16, 9, Refusal.RANGE),
        (0x0103, ValueType.U16, 1001, Refusal.RANGE),
        (0x0001, ValueType.FLOAT, float("nan"), Refusal.RANGE),
        (0x0001, ValueType.FLOAT, float("inf"), Refusal.RANGE),
        (0x0001, ValueType.FLOAT, 0.0, Refusal.RANGE),
        (0x0300, ValueType.U8, 0x40, Refusal.RANGE),
        (0x0300, ValueType.I32, -1, Refusal.RANGE),
        (0x0320, ValueType.U8, 0x40, Refusal.RANGE),
        (0x0430, ValueType.U16, 49, Refusal.RANGE),
        (0x0430, ValueType.U16, 50_001, Refusal.RANGE),
        (0x0500, ValueType.U8, 1, Refusal.READ_ONLY),
        (0x0200, ValueType.U8, 1, Refusal.RANGE),
        (0x0007, ValueType.U8, 1, Refusal.UNKNOWN_KEY),
        (0xFFFF, ValueType.U8, 1, Refusal.UNKNOWN_KEY),
    ],
)
def test_a_value_that_cannot_be_is_refused_and_changes_nothing(
    device: Device, key: int, kind: ValueType, value: float, expected: Refusal
) -> None:
    client = device.connect()
    before = config(device, client, key)
    assert configure(device, client, key, kind, value) == expected
    assert config(device, client, key) == before


def test_every_key_answers_with_its_own_type(device: Device) -> None:
    client = device.connect()
    for row in KEYS:
        for key in range(row.key, row.key + row.count):
            assert config(device, client, key)[0] == ValueType[row.type.upper()], row.name


def test_an_unknown_key_is_answered_with_nothing(device: Device) -> None:
    assert config(device, device.connect(), 0x1234) == (ValueType.U32, 0)


@pytest.mark.parametrize("kind", [6, 255, 0xFFFF])
def test_a_value_type_that_there_is_not_is_refused(device: Device, kind: int) -> None:
    client = device.connect()
    assert reason(device, client, ConfigSet(0x0103, kind, b"\x64".ljust(64, b"\0"))) == Refusal.RANGE
    assert config(device, client, 0x0103) == (ValueType.U16, 50)


def test_strings_without_an_end(device: Device) -> None:
    """A name and a value of nothing but letters; a number that is given as text."""
    client = device.connect()
    hello = device.request(client, Handshake(0x01000000, "x" * 32)).payload
    assert isinstance(hello, HandshakeResponse)
    for key, why in ((0x0200, Refusal.RANGE), (0x0103, Refusal.RANGE)):
        before = config(device, client, key)
        assert reason(device, client, ConfigSet(key, ValueType.STRING, b"y" * 64)) == why
        assert config(device, client, key) == before


def test_secrets_are_not_readable(device: Device) -> None:
    assert config(device, device.connect(), 0x0201) == (ValueType.STRING, b"")


def test_settings_are_kept_by_save_only(make_device: Callable[..., Device], tmp_path: Path) -> None:
    store = str(tmp_path / "store")
    device = make_device(store=store)
    client = device.connect()
    configure(device, client, 0x0103, ValueType.U16, 100)
    assert reason(device, client, ConfigSave()) == Refusal.NONE
    configure(device, client, 0x0103, ValueType.U16, 200)
    again = make_device(store=store)
    assert config(again, again.connect(), 0x0103)[1] == 100


def test_settings_do_not_change_in_motion(device: Device) -> None:
    client = device.connect()
    device.motion(*[segment(100)] * 8)
    device.run(0.05)
    assert configure(device, client, 0x0001, ValueType.FLOAT, 80.0) == Refusal.BUSY


def test_the_pwm_does_not_change_while_the_spindle_is_on(device: Device) -> None:
    client = device.connect()
    assert reason(device, client, IoControl(misc_outputs=1, spindle=1, rpm=500)) == Refusal.NONE
    assert configure(device, client, 0x0430, ValueType.U16, 1000) == Refusal.BUSY
    assert reason(device, client, IoControl(misc_outputs=1)) == Refusal.NONE
    assert configure(device, client, 0x0430, ValueType.U16, 1000) == Refusal.NONE


def test_commands_by_tcp_are_answered(device: Device) -> None:
    client = device.connect()
    assert reason(device, client, Jog(0, 1, 100)) == Refusal.NONE
    device.run(0.2)
    assert reason(device, client, JogStop(0)) == Refusal.NONE
    device.run(0.2)
    assert reason(device, client, Jog(0, 3, 100)) == Refusal.MALFORMED
    assert reason(device, client, Resume()) == Refusal.BUSY
    assert reason(device, client, Home(1)) == Refusal.NO_HOMING
    assert reason(device, client, Estop()) == Refusal.NONE
    assert reason(device, client, Jog(0, 1, 100)) == Refusal.LOCKED
    assert reason(device, client, Reset()) == Refusal.NONE


@pytest.mark.parametrize("axes", [1, 2, 7])
def test_homing_is_refused_for_its_true_reason(make_device: Callable[..., Device], axes: int) -> None:
    device = make_device(settings={22: 1, 27: 250, 130: 200, 131: 200, 132: 200})
    assert reason(device, device.connect(), Home(axes)) == Refusal.PULL_OFF


def test_each_reason_against_homing_has_its_own_refusal() -> None:
    """As the text side has an error for each."""
    rows = re.findall(r"^REFUSAL\((\w+), (\w+), (\w+)\)", (ROOT / "core/machine/refusals.def").read_text(), re.M)
    reasons = {"NO_HOMING", "PULL_OFF", "RACKS", "STALL_SLOW", "NO_STALL"}
    assert {name: refusal for name, _, refusal in rows if name in reasons} == {name: name for name in reasons}
    assert reasons <= set(Refusal.__members__)


def test_damaged_requests_get_no_reply_and_unknown_ones_a_no(device: Device) -> None:
    client = device.connect()
    good = build(Ping(1))
    assert device.raw_request(client, good[:-1]) is None
    assert device.raw_request(client, good[:-1] + b"\xff") is None
    assert device.raw_request(client, b"") is None

    class Unknown(Ping):
        TYPE = 0x7F

    reply = device.raw_request(client, build(Unknown(1)))
    assert reply is not None and reply.payload == Refused(0, 0x7F, Refusal.UNKNOWN_TYPE)
    assert device.request(client, Ping(2)).payload == Pong(2), "the connection lives on"


def test_four_clients_and_a_fifth_takes_a_silent_place(device: Device) -> None:
    clients = [device.connect() for _ in range(4)]
    assert clients == [0, 1, 2, 3] and device.connect() == -1
    device.run(29)
    for client in clients[1:]:
        device.request(client, Ping())
    device.run(2)
    assert device.connect() == 0
    assert device.connect() == -1


@pytest.mark.slow
def test_clocks_may_wrap(device: Device) -> None:
    """hal_time_us wraps after 71.6 minutes; reports continue, a silent owner still loses motion."""
    device.run(4294.0)
    device.motion(segment(100))
    device.run(0.9)
    device.sent.clear()
    device.run(4)
    assert len(device.of_type(Type.STATUS)) == pytest.approx(80, abs=2)
    device.motion(segment(0, 100), address=OTHER)
    device.run(1)
    assert device.pulses[:2] == [100, 100]


def test_what_a_machine_has_not_takes_no_command(device: Device) -> None:
    """channel_outputs is for I/O modules: it was refused, and its sender commanded the machine all the same."""
    client = device.connect()
    assert reason(device, client, ChannelOutputs(1, 1)) == Refusal.UNKNOWN_TYPE
    device.send(ChannelOutputs(1, 1))
    assert reason(device, device.connect(OTHER), Jog(0, 1, 1000)) == Refusal.NONE


# ---- what an ack may not say ----


def test_a_reset_is_refused_while_the_estop_is_pressed(device: Device) -> None:
    client = device.connect()
    device.input("estop", True)
    device.run(0.1)
    assert reason(device, client, Reset()) == Refusal.LOCKED
    device.input("estop", False)
    device.run(0.1)
    assert reason(device, client, Reset()) == Refusal.NONE


def test_a_reset_is_refused_while_a_driver_has_a_fault(make_device: Callable[..., Device]) -> None:
    device = make_device(settings={744: 2})
    client = device.connect()
    device.send(JogStop(0xFF))
    device.input("input-1", True)
    device.run(0.1)
    assert device.status.alarm == Alarm.LOCKED and reason(device, client, Reset()) == Refusal.LOCKED
    device.input("input-1", False)
    device.run(0.1)
    assert reason(device, client, Reset()) == Refusal.NONE


@pytest.mark.parametrize("doing", [Jog(0, 1, 1000), Home(1)])
def test_no_stream_is_opened_that_could_take_nothing(make_device: Callable[..., Device], doing: Jog | Home) -> None:
    device = make_device(settings={22: 1, 130: 500})
    client = device.connect()
    assert reason(device, client, doing) == Refusal.NONE
    device.run(0.1)
    opened = device.request(client, StreamOpen()).payload
    assert isinstance(opened, StreamOpened) and (opened.stream, opened.refusal) == (0, Refusal.BUSY)


@pytest.mark.parametrize(("key", "float_value"), [(0x0103, 12.7), (0x0300, 0.5), (0x0614, 3.25)])
def test_a_fraction_of_a_whole_number_is_refused(device: Device, key: int, float_value: float) -> None:
    """It was cut off in silence."""
    client = device.connect()
    before = device.request(client, ConfigGet(key=key)).payload
    data = struct.pack("<f", float_value).ljust(64, b"\0")
    assert reason(device, client, ConfigSet(key, ValueType.FLOAT, data)) == Refusal.RANGE
    assert device.request(client, ConfigGet(key=key)).payload == before
    whole = struct.pack("<f", 20.0).ljust(64, b"\0")
    assert reason(device, client, ConfigSet(0x0103, ValueType.FLOAT, whole)) == Refusal.NONE
