"""The channels of an I/O module: what they are, and how to change that."""

from __future__ import annotations

from dataclasses import dataclass

from wificnc.connection.wmc3.device import Device, pack_value
from wificnc.connection.wmc3.keys import KEYS
from wificnc.connection.wmc3.layout import ChannelOutputs, Status
from wificnc.errors import UserError

MODULE_MODE = 1
MOST = 16
NO_PIN = 0xFF


@dataclass(frozen=True)
class Channel:
    """One channel, as it is configured, and its level. `on` is after inversion."""

    number: int
    direction: str  # "input" or "output"
    pin: int | None
    pull_up: bool
    invert: bool
    fault: bool  # left out: its pin cannot do it, or another channel has it
    on: bool


@dataclass(frozen=True)
class Change:
    """What shall be otherwise; None: as it is. Pin 255: none."""

    output: bool | None = None
    pin: int | None = None
    pull_up: bool | None = None
    invert: bool | None = None


def read_channels(device: Device, status: Status) -> list[Channel]:
    """The channels in use. Raises LinkError."""
    masks = {name: _get(device, f"io_{name}_mask") for name in ("direction", "pull_up", "invert", "fault")}
    return [
        Channel(
            number=n,
            direction="output" if masks["direction"] >> n & 1 else "input",
            pin=None if (pin := _get(device, "io_pin", n)) == NO_PIN else pin,
            pull_up=bool(masks["pull_up"] >> n & 1),
            invert=bool(masks["invert"] >> n & 1),
            fault=bool(masks["fault"] >> n & 1),
            on=bool((status.io_inputs | status.io_outputs) >> n & 1),
        )
        for n in range(_get(device, "io_channels"))
    ]


def configure(device: Device, number: int, change: Change) -> None:
    """Change a channel, take it into use, and keep it. What is refused leaves all as it was.

    Raises:
        RefusedError: its pin cannot do that on this board, or another channel has it.
    """
    masks = {"io_direction_mask": change.output, "io_pull_up_mask": change.pull_up, "io_invert_mask": change.invert}
    wanted = {("io_channels", 0): max(_get(device, "io_channels"), number + 1)}
    for name, bit in masks.items():
        if bit is not None:
            mask = _get(device, name)
            wanted[name, 0] = mask | 1 << number if bit else mask & ~(1 << number)
    if change.pin is not None:
        wanted["io_pin", number] = change.pin
    before = {key: _get(device, *key) for key in wanted}
    try:
        for key, value in wanted.items():
            _set(device, *key, value)
        device.save()
    except Exception:
        for key, value in before.items():
            _set(device, *key, value)
        raise


def switch(device: Device, number: int, on: bool) -> None:
    """Switch an output. Raises RefusedError when it is none."""
    device.command(ChannelOutputs(1 << number, (1 << number) if on else 0))


def check_number(number: int) -> int:
    """Raises UserError."""
    if not 0 <= number < MOST:
        raise UserError(f"unknown channel {number}", hint=f"channels are 0 to {MOST - 1}")
    return number


def _get(device: Device, name: str, index: int = 0) -> int:
    row = next(row for row in KEYS if row.name == name)
    return int(device.get(row.key + index))


def _set(device: Device, name: str, index: int, value: int) -> None:
    row = next(row for row in KEYS if row.name == name)
    device.set(row.key + index, *pack_value(row, str(value)))
