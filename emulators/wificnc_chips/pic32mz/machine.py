"""A board's image in the virtual chip, its motors and switches wired as the board file says."""

from __future__ import annotations

from pathlib import Path

from wificnc.board.model import Board
from wificnc.build.image import Block, read_hex
from wificnc.build.pic32mz import build_pic32mz
from wificnc.errors import BuildError, UserError

from wificnc_chips.pic32mz.chip import NO_PIN, AxisWire, VirtualChip, pin_number

STORE_OFFSET, STORE_SIZE = 0x180000, 0xC000  # of program flash: the settings' three pages (pic32mz.ld)
OLD_STORE_SIZE = 0x8000  # without the page for a copy: firmware up to November 2026


def board_image(board: Board) -> tuple[Block, ...]:
    """The very HEX that would be flashed, built when stale. Raises BuildError."""
    if board.target != "pic32mz":
        raise BuildError(f"board {board.id} has no image for the virtual PIC32MZ")
    return read_hex(build_pic32mz(board).hex.read_text(encoding="utf-8"))


def wired_chip(board: Board, image: tuple[Block, ...]) -> VirtualChip:
    """A chip with this image and this board's machine; no switch is at its place yet. Raises BuildError."""
    chip = VirtualChip(image)
    for motor in range(len(board.axis.motors())):
        chip.set_axis(motor, motor_wire(board, motor))
    if board.input.estop is not None:  # its contact is closed
        chip.drive(pin_number(board.input.estop.pin), int(board.input.estop.active == "low"))
    return chip


def motor_wire(board: Board, number: int, low: int | None = None, high: int | None = None) -> AxisWire:
    """A motor as the board wires it: those of the axes, then the second ones.

    @param low, high  where its switches are, steps; None: they stay open
    """
    motor = list(board.axis.motors().values())[number]
    near = motor.limit_min or motor.limit
    far = motor.limit_max or motor.limit
    return AxisWire(
        step=pin_number(motor.step.pin),
        dir=pin_number(motor.dir.pin),
        min_switch=pin_number(near.pin) if near else NO_PIN,
        max_switch=pin_number(far.pin) if far else NO_PIN,
        min_active=int(near is not None and near.active == "high"),
        max_active=int(far is not None and far.active == "high"),
        has_low=int(low is not None),
        has_high=int(high is not None),
        low=low or 0,
        high=high or 0,
    )


def load_store(chip: VirtualChip, path: Path | None) -> None:
    """Bring back the settings' pages of an earlier run. Raises UserError."""
    if path is None or not path.exists():
        return
    pages = path.read_bytes()
    if len(pages) not in (STORE_SIZE, OLD_STORE_SIZE):
        raise UserError(f"{path} has {len(pages)} bytes, not the {STORE_SIZE} of the settings' pages")
    chip.set_flash(STORE_OFFSET, pages)


def save_store(chip: VirtualChip, path: Path) -> None:
    """Keep the settings' pages."""
    path.write_bytes(chip.flash()[STORE_OFFSET : STORE_OFFSET + STORE_SIZE])
