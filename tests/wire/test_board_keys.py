"""Configuration keys that describe the board: each says what is."""

from __future__ import annotations

from collections.abc import Callable

import pytest
from board_keys import published_keys
from test_inputs_outputs import hello
from test_requests import config, configure
from wificnc.board.load import find_boards, load_board
from wificnc.connection.wmc3.layout import Capability, Refusal, ValueType
from wire_device import Device, device_board

Make = Callable[..., Device]
BOARDS = [path.stem for path in find_boards() if load_board(path).target != "pic32mz"]


@pytest.mark.parametrize("board_id", BOARDS)
def test_every_key_says_what_the_board_file_says(make_device: Make, board_id: str) -> None:
    board = load_board(board_id)
    device = make_device(axes=len(board.axes), device=device_board(board))
    client = device.connect()
    expected = published_keys(board.path)
    assert {key: config(device, client, key)[1] for key in expected} == expected


def test_a_device_without_a_board_file_has_no_pins(device: Device) -> None:
    client = device.connect()
    assert {config(device, client, key) for key in (0x0500, 0x0514, 0x0530, 0x0703)} == {(ValueType.U8, 255)}


def test_the_pwm_frequency_is_that_of_its_setting_and_0_without_pwm(make_device: Make) -> None:
    device = make_device(settings={33: 20_000})
    assert config(device, device.connect(), 0x0430) == (ValueType.U16, 20_000)
    poor = make_device(missing_outputs=2)
    client = poor.connect()
    assert config(poor, client, 0x0430) == (ValueType.U16, 0)
    assert configure(poor, client, 0x0430, ValueType.U16, 1000) == Refusal.NO_OUTPUT
    assert not hello(poor).capabilities & Capability.SPINDLE_PWM
