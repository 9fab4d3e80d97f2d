"""A board's real image in the virtual chip, whichever chip that is: what jobs, servers and checks ask of it."""

from __future__ import annotations

from pathlib import Path
from typing import Protocol

from wificnc.board.model import Board
from wificnc.build.image import Block, read_hex
from wificnc.errors import BuildError, JobError, UserError
from wificnc.firmware.flash.find import firmware_folder
from wificnc.firmware.nvs.image import read_image
from wificnc.firmware.nvs.values import NAMESPACE

from wificnc_chips.esp32.image import load_image
from wificnc_chips.esp32.machine import SHIFT_PIN, EspMachine, gpio
from wificnc_chips.pic32mz.chip import PORT_WIDTH, VirtualChip, pin_number
from wificnc_chips.pic32mz.machine import board_image, load_store, save_store, wired_chip

PORTS = "ABCDEFG"
GPIOS = {"esp32": 40, "esp32s3": 49}
BOOT_S = 0.05
BANNER_S = 5.0  # of the chip's time
HEX = "wificnc.hex"


class Wired(Protocol):
    """A chip with its board around it. Pins are numbers of pin_numbers(), times cycles of cpu_hz."""

    cpu_hz: int

    def close(self) -> None: ...

    def power_on(self) -> None: ...

    @property
    def cycles(self) -> int: ...

    def run(self, seconds: float) -> object: ...

    def run_until(self, cycle: int) -> object: ...

    def write(self, data: bytes) -> None: ...

    def read(self) -> bytes: ...

    def record_edges(self, on: bool) -> None: ...

    def edges(self) -> list[tuple[int, int, int]]: ...

    def level(self, pin: int) -> int: ...

    def drive(self, pin: int, level: int | None) -> None: ...

    def drive_at(self, cycle: int, pin: int, level: int | None) -> None: ...

    def steps(self) -> bytes: ...

    def position(self, motor: int) -> int: ...


def wire(board: Board, image: Path | None) -> Wired:
    """A chip with this image, which has been switched on. @param image  None: what `wificnc build` has made

    Raises:
        BuildError: there is no image of this board, or no virtual chip.
        UserError: the image cannot run.
    """
    if board.target == "esp32":
        return EspMachine(board, load_image(image or firmware_folder(board.id), board))
    return wired_chip(board, board_image(board) if image is None else _hex(board, image))


def _hex(board: Board, path: Path) -> tuple[Block, ...]:
    """A PIC32MZ's image: its HEX file, or the folder with it."""
    if board.target != "pic32mz":
        raise BuildError(f"board {board.id} has no image for a virtual chip")
    try:
        return read_hex((path / HEX if path.is_dir() else path).read_text(encoding="ascii"))
    except (OSError, UnicodeDecodeError) as err:
        why = "not an Intel HEX file" if isinstance(err, UnicodeDecodeError) else err.strerror
        raise UserError(f"cannot read the image {path}: {why}", hint=f"wificnc build {board.id}") from err


def greet(chip: Wired) -> str:
    """Wait for Grbl's banner, and until nothing comes behind it: startup lines have answers, too. @return what came.
    Raises JobError."""
    said, end = "", chip.cycles + round(BANNER_S * chip.cpu_hz)
    has_begun = False
    while chip.cycles < end:
        chip.run(BOOT_S)
        fresh = chip.read().decode("latin-1")
        if has_begun and not fresh:
            return said
        said += fresh
        has_begun = "\r\n" in said.partition("Grbl ")[2]
    if has_begun:
        return said
    last = said.strip().splitlines()[-1:] or ["nothing"]
    raise JobError(
        f"the image has not said Grbl's banner in {BANNER_S:g} s of the chip's time, but: {last[0]}",
        hint="is it an image of this board?",
    )


def pin_numbers(board: Board) -> dict[str, int]:
    """Of the chip's pins by their names: RD3, GPIO25; and of its shift registers' outputs: I2SO.1."""
    if board.target == "esp32":
        outputs = board.i2so.outputs if board.i2so else 0
        names = [
            *(f"GPIO{number}" for number in range(GPIOS[board.chip])),
            *(f"{SHIFT_PIN}{bit}" for bit in range(outputs)),
        ]
        return {name: gpio(name) for name in names}
    return {f"R{port}{bit}": pin_number(f"R{port}{bit}") for port in PORTS for bit in range(PORT_WIDTH)}


def number_of(board: Board, pin: str) -> int:
    """A pin of the board file."""
    return gpio(pin) if board.target == "esp32" else pin_number(pin)


def load_settings(chip: Wired, path: Path | None) -> None:
    """Bring back what an earlier run has stored; the next power_on() sees it. Raises UserError."""
    if isinstance(chip, VirtualChip):
        load_store(chip, path)
    elif isinstance(chip, EspMachine) and path is not None and path.exists():
        chip.set_settings(path.read_bytes(), path)


def save_settings(chip: Wired, path: Path) -> None:
    """Keep what is stored."""
    if isinstance(chip, VirtualChip):
        save_store(chip, path)
    elif isinstance(chip, EspMachine):
        path.write_bytes(chip.settings())


def access_key(chip: Wired) -> str | None:
    """Of the network clients of its image, as stored; None: none, or it needs none."""
    if not isinstance(chip, EspMachine):
        return None
    image = read_image(chip.settings())
    key = image.get(NAMESPACE, "access_key")
    return key if isinstance(key, str) and image.get(NAMESPACE, "access_open") != 1 else None
