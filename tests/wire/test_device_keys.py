"""Keys of pins and network, written: only by who may, only what the rules of boards allow, and with a way back."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import pytest
from test_requests import config, configure
from test_session import reason
from wificnc.board.load import load_board
from wificnc.connection.wmc3.layout import ConfigSave, ConfigSet, Ping, Refusal, ValueType
from wire_device import HOST, OTHER, Device, device_board

Make = Callable[..., Device]
SSID, PASSWORD, NAME, MODE, ADDRESS, GATEWAY, NETMASK = 0x0200, 0x0201, 0x0202, 0x0210, 0x0211, 0x0212, 0x0213
ESTOP_INVERT, STEP_X, STEP_Y, STEP_B, DIR_X, LIMIT_X, PROBE, LED = (
    0x0312,
    0x0500,
    0x0501,
    0x0504,
    0x0506,
    0x050D,
    0x0513,
    0x0516,
)
MISC_IN = 0x0530
TRIAL_S, KEY = 120, "a key of some length"
BOARD = "esp32s3-zero"


@pytest.fixture
def make(make_device: Make, tmp_path: Path) -> Make:
    """Devices on the same board and store, one after the other."""

    def start(**more: object) -> Device:
        board = load_board(BOARD)
        return make_device(axes=3, device=device_board(board), store=str(tmp_path / "store"), **more)

    return start


def set_pin(device: Device, client: int, key: int, pin: int) -> Refusal:
    return configure(device, client, key, ValueType.U8, pin)


def set_text(device: Device, client: int, key: int, text: bytes) -> Refusal:
    return reason(device, client, ConfigSet(key, ValueType.STRING, text.ljust(64, b"\0")))


def save(device: Device, client: int) -> Refusal:
    return reason(device, client, ConfigSave())


def address(*parts: int) -> int:
    return int.from_bytes(bytes(parts), "little")


# ---- pins ----


def test_a_pin_moves_and_is_stored(make: Make) -> None:
    device = make()
    client = device.connect()
    assert set_pin(device, client, STEP_X, 18) == Refusal.NONE
    assert config(device, client, STEP_X) == (ValueType.U8, 18)
    assert save(device, client) == Refusal.NONE
    device = make()
    client = device.connect()
    assert config(device, client, STEP_X)[1] == 18 and config(device, client, DIR_X)[1] == 3


def test_what_is_not_saved_is_gone_at_the_next_start(make: Make) -> None:
    device = make()
    assert set_pin(device, device.connect(), STEP_X, 18) == Refusal.NONE
    device = make()
    assert config(device, device.connect(), STEP_X)[1] == 1


def test_two_signals_exchange_their_pins(make: Make) -> None:
    """As one who writes all pins and then saves."""
    device = make()
    client = device.connect()
    for key, pin in ((STEP_X, 2), (STEP_Y, 1)):
        assert set_pin(device, client, key, pin) == Refusal.NONE
    assert save(device, client) == Refusal.NONE
    assert [config(device, client, key)[1] for key in (STEP_X, STEP_Y)] == [2, 1]


def test_writing_back_what_was_read_is_always_accepted(make: Make) -> None:
    device = make()
    client = device.connect()
    for key in (*range(0x0500, 0x051A), *range(0x0520, 0x0523), *range(0x0530, 0x0534), *range(0x0700, 0x0705)):
        assert set_pin(device, client, key, config(device, client, key)[1]) == Refusal.NONE
    assert save(device, client) == Refusal.NONE


@pytest.mark.parametrize(
    ("key", "pin", "why"),
    [
        (STEP_X, 0, Refusal.PIN),  # strapping
        (STEP_X, 19, Refusal.PIN),  # USB
        (STEP_X, 22, Refusal.PIN),  # the chip has no such pin
        (STEP_X, 40, Refusal.PIN),  # the coolant's
        (STEP_X, 255, Refusal.PIN),  # an axis needs it
        (STEP_B, 18, Refusal.READ_ONLY),  # three axes
        (MISC_IN, 18, Refusal.READ_ONLY),
        (0x0520, 18, Refusal.READ_ONLY),
    ],
)
def test_a_pin_that_cannot_be_is_refused_and_changes_nothing(make: Make, key: int, pin: int, why: Refusal) -> None:
    device = make()
    client = device.connect()
    before = config(device, client, key)
    assert set_pin(device, client, key, pin) == why
    assert config(device, client, key) == before
    assert save(device, client) == Refusal.NONE


def test_two_signals_at_one_pin_are_refused_as_a_whole(make: Make) -> None:
    device = make()
    client = device.connect()
    assert set_pin(device, client, LED, 18) == Refusal.NONE
    assert set_pin(device, client, PROBE, 5) == Refusal.NONE  # limit X is there
    assert save(device, client) == Refusal.PIN
    assert [config(device, client, key)[1] for key in (LED, PROBE, LIMIT_X)] == [21, 14, 5]


def test_a_signal_may_go_without_a_pin(make: Make) -> None:
    device = make()
    client = device.connect()
    assert set_pin(device, client, PROBE, 255) == Refusal.NONE
    assert save(device, client) == Refusal.NONE
    assert config(device, client, PROBE)[1] == 255


def test_the_estop_has_the_other_sense_from_the_next_start_on(make: Make) -> None:
    device = make()
    client = device.connect()
    assert config(device, client, ESTOP_INVERT) == (ValueType.U8, 1)  # the board's contact opens when pressed
    assert configure(device, client, ESTOP_INVERT, ValueType.U8, 2) == Refusal.RANGE
    assert configure(device, client, ESTOP_INVERT, ValueType.U8, 0) == Refusal.NONE
    assert save(device, client) == Refusal.NONE
    device = make()
    assert config(device, device.connect(), ESTOP_INVERT)[1] == 0


def test_nothing_is_written_without_the_key(make: Make) -> None:
    device = make(key=KEY)
    client = device.connect(OTHER)
    before = [config(device, client, key) for key in (STEP_X, SSID, ADDRESS, 0x0400, 0x0430, ESTOP_INVERT)]
    assert set_pin(device, client, STEP_X, 18) == Refusal.AUTHENTICATION
    assert set_text(device, client, SSID, b"theirs") == Refusal.AUTHENTICATION
    assert configure(device, client, ADDRESS, ValueType.U32, 1) == Refusal.AUTHENTICATION
    assert save(device, client) == Refusal.AUTHENTICATION
    assert [config(device, client, key) for key in (STEP_X, SSID, ADDRESS, 0x0400, 0x0430, ESTOP_INVERT)] == before
    own = device.connect()
    assert device.prove(own, KEY) == Refusal.NONE
    assert set_pin(device, own, STEP_X, 18) == Refusal.NONE


def test_nothing_is_written_in_motion(make: Make) -> None:
    device = make()
    client = device.connect()
    device.text("G1 X5 F600\n")
    device.run(0.1)
    assert set_pin(device, client, STEP_X, 18) in (Refusal.BUSY, Refusal.TEXT)
    assert config(device, client, STEP_X)[1] == 1


# ---- network ----


def new_network(device: Device, client: int, name: bytes = b"new") -> None:
    assert set_text(device, client, SSID, name) == Refusal.NONE
    assert set_text(device, client, PASSWORD, b"twelve bytes") == Refusal.NONE
    assert save(device, client) == Refusal.NONE


def ssid(device: Device) -> bytes:
    return bytes(config(device, device.connect(), SSID)[1])


def joined(device: Device) -> int:
    return int(device.lib.host_wire_joined(device.wire))


def test_a_network_is_joined_after_the_reply_and_its_password_is_not_readable(make: Make) -> None:
    device = make()
    client = device.connect()
    new_network(device, client)
    assert joined(device) == 0
    device.run(1.1)
    assert joined(device) == 1
    assert config(device, client, SSID) == (ValueType.STRING, b"new")
    assert config(device, client, PASSWORD) == (ValueType.STRING, b"")


def test_without_contact_the_old_network_returns(make: Make) -> None:
    """What the old connection still says is no contact: it may run over another way."""
    device = make()
    client = device.connect()
    new_network(device, client)
    device.run(1.1)
    device.request(client, Ping())
    device.run(TRIAL_S - 0.5)
    assert joined(device) == 1
    device.run(1)
    assert joined(device) == 2
    assert ssid(device) == b"" and ssid(make()) == b""


def test_a_client_that_comes_back_keeps_it(make: Make) -> None:
    device = make()
    new_network(device, device.connect())
    device.run(60)
    device.request(device.connect(), Ping())
    device.run(2 * TRIAL_S)
    assert joined(device) == 1 and ssid(device) == b"new" and ssid(make()) == b"new"


def test_a_stranger_who_comes_does_not_keep_it(make: Make) -> None:
    device = make(key=KEY)
    own = device.connect()
    assert device.prove(own, KEY) == Refusal.NONE
    new_network(device, own)
    device.run(10)
    device.request(device.connect(OTHER), Ping())
    device.run(TRIAL_S)
    assert joined(device) == 2 and ssid(device) == b""


def test_a_power_cut_does_not_end_the_trial(make: Make) -> None:
    device = make()
    new_network(device, device.connect())
    device.run(10)
    device = make()
    device.run(TRIAL_S + 1)
    assert joined(device) == 1 and ssid(device) == b""


def test_after_two_changes_the_one_that_worked_returns(make: Make) -> None:
    device = make()
    new_network(device, device.connect(), b"first")
    device.run(2)
    device.request(device.connect(), Ping())
    client = device.connect()
    new_network(device, client, b"second")
    device.run(2)
    new_network(device, client, b"third")
    device.run(TRIAL_S + 3)
    assert ssid(device) == b"first"


@pytest.mark.parametrize(
    ("key", "text"),
    [
        (SSID, b"x" * 33),
        (PASSWORD, b"short"),
        (PASSWORD, b"x" * 64),
        (NAME, b"-mill"),
        (NAME, b"my mill"),
        (NAME, b"x" * 32),
    ],
)
def test_a_text_that_cannot_be_is_refused(make: Make, key: int, text: bytes) -> None:
    device = make()
    client = device.connect()
    assert set_text(device, client, key, text) == Refusal.RANGE
    assert config(device, client, key) == (ValueType.STRING, b"")


GOOD = {
    MODE: 1,
    ADDRESS: address(192, 168, 4, 20),
    GATEWAY: address(192, 168, 4, 1),
    NETMASK: address(255, 255, 255, 0),
}


def static(device: Device, client: int, values: dict[int, int]) -> Refusal:
    for key, value in values.items():
        kind = ValueType.U8 if key == MODE else ValueType.U32
        assert configure(device, client, key, kind, value) == Refusal.NONE
    return save(device, client)


def test_a_static_address(make: Make) -> None:
    device = make()
    client = device.connect()
    assert configure(device, client, MODE, ValueType.U8, 2) == Refusal.RANGE
    assert static(device, client, GOOD) == Refusal.NONE
    assert {key: config(device, client, key)[1] for key in GOOD} == GOOD


@pytest.mark.parametrize(
    "change",
    [
        {ADDRESS: 0},
        {ADDRESS: address(192, 168, 4, 255)},  # broadcast
        {ADDRESS: address(192, 168, 4, 0)},
        {ADDRESS: address(127, 0, 0, 2)},
        {ADDRESS: address(224, 0, 0, 2)},
        {NETMASK: address(255, 0, 255, 0)},
        {NETMASK: address(255, 255, 255, 255)},
        {GATEWAY: address(192, 168, 5, 1)},
        {GATEWAY: GOOD[ADDRESS]},
    ],
)
def test_addresses_that_cannot_be_are_refused_as_a_whole(make: Make, change: dict[int, int]) -> None:
    device = make()
    client = device.connect()
    assert static(device, client, {**GOOD, **change}) == Refusal.RANGE
    assert {key: config(device, client, key)[1] for key in GOOD} == dict.fromkeys(GOOD, 0)
    device.run(3)
    assert joined(device) == 0


def test_what_cannot_be_stored_changes_nothing(make_device: Make, tmp_path: Path) -> None:
    device = make_device(axes=3, device=device_board(load_board(BOARD)), store=str(tmp_path / "missing" / "store"))
    client = device.connect(HOST)
    assert set_pin(device, client, STEP_X, 18) == Refusal.NONE
    assert save(device, client) == Refusal.NOT_STORED
    assert config(device, client, STEP_X)[1] == 1
