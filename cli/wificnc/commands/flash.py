"""`wificnc flash BOARD`."""

from __future__ import annotations

import shlex
import time
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import rich_click as click
import serial

from wificnc import ui
from wificnc.board import paths
from wificnc.board.load import load_board
from wificnc.board.model import Board
from wificnc.build.esp32 import SIGNATURE
from wificnc.build.signing import raw_signature
from wificnc.commands._chip import require_chips
from wificnc.commands._finite import FiniteRange
from wificnc.commands._port import connected, port_option, progress_bars
from wificnc.commands._secret import READ, Secret
from wificnc.commands._target import json_option
from wificnc.commands._together import refuse_given
from wificnc.connection.target import host_and_port
from wificnc.errors import BuildError, FlashError, UserError
from wificnc.firmware.flash.find import firmware_folder
from wificnc.firmware.flash.ota import PORT as OTA_PORT
from wificnc.firmware.flash.ota import Hello, Signed, greeted
from wificnc.firmware.flash.pic32mz import OWN, RUNNERS, is_own, plan_flash, read_image, run_flash
from wificnc.firmware.flash.plan import (
    Chip,
    Partition,
    Region,
    app_image,
    check_chip,
    load_regions,
    read_partitions,
)
from wificnc.firmware.flash.reach import RESTART_S, wait_until_kept
from wificnc.firmware.flash.uhb import HidWire, Page, describe, plan_pages
from wificnc.firmware.flash.uhb import flash as write_by_usb

FASTEST_BAUD = 460800
BANNER_S = 8.0  # its start, and WiFi's


@click.command()
@click.argument("board_ref", metavar="BOARD")
@port_option
@click.option("--baud", type=click.IntRange(9600, 3_000_000), default=FASTEST_BAUD, show_default=True,
              help="While writing.")  # fmt: skip
@click.option("--erase", is_flag=True, help="Erase everything first: settings, WiFi and passwords too.")
@click.option("--verify/--no-verify", default=True, help="Read the digests back when all is written.")
@click.option("--verify-boot", is_flag=True,
              help="Start the firmware in the virtual chip first; if it fails there, write nothing.")  # fmt: skip
@click.option("--from", "folder", type=click.Path(path_type=Path, file_okay=False, exists=True),
              help="Take the firmware from this folder.")  # fmt: skip
@click.option("--wait", "wait_s", type=FiniteRange(0), default=BANNER_S, show_default=True,
              help="Seconds to wait for the firmware's first message.")  # fmt: skip
@click.option("--dry-run", is_flag=True, help="Print what would be written; the chip is not accessed.")
@click.option("--ota", "ota_host", metavar="HOST[:PORT]", help="Update over the network instead.")
@click.option("--other-board", is_flag=True,
              help="For --ota: the controller runs the firmware of another board, and BOARD's is meant.")  # fmt: skip
@click.option("--key", type=Secret(), envvar="WIFICNC_KEY", show_envvar=True,
              help="For --ota: the controller's access key. Prompted for if not given. " + READ)  # fmt: skip
@click.option("--tool", type=click.Choice([*(runner.name for runner in RUNNERS), OWN]),
              help="PIC32MZ only: the programmer; uhb is built in and uses the board's USB bootloader.")  # fmt: skip
@json_option
@click.pass_context
def command(
    ctx: click.Context,
    board_ref: str,
    port: str | None,
    baud: int,
    erase: bool,
    verify: bool,
    verify_boot: bool,
    folder: Path | None,
    wait_s: float,
    dry_run: bool,
    ota_host: str | None,
    other_board: bool,
    key: str | None,
    tool: str | None,
    as_json: bool,
) -> None:
    """Write the firmware of BOARD to the board: what `wificnc build BOARD` has made, else what this package carries.

    What the controller has stored, settings, WiFi and passwords, stays unless --erase is given.
    """
    board = load_board(board_ref)
    check_options(ctx, board.target, ota_host)
    if folder is None:
        folder = firmware_folder(board.id)
        ui.note(f"firmware  {folder}")
    if verify_boot:
        try_out(board, folder)
    if board.target == "pic32mz":
        done = flash_pic32mz(board, folder, tool, dry_run)
    elif ota_host is not None:
        load_regions(folder, esp32_board(board_ref), esp32_partitions())
        done = update(board, folder, ota_host, key, Way(dry_run, other_board))
    else:
        done = flash_esp32(esp32_board(board_ref), folder, port, Options(baud, erase, verify, wait_s), dry_run)
    if as_json:
        ui.emit_json({"board": board.id, "folder": str(folder), "written": not dry_run, **done.facts})
    else:
        for line in done.lines:
            click.echo(line)


def check_options(ctx: click.Context, target: str, ota_host: str | None) -> None:
    """Raises FlashError: an option that this way to write the firmware does not have."""
    by_usb = ("erase", "port", "baud", "verify", "wait_s")
    try:
        if target == "pic32mz":
            refuse_given(
                ctx, (*by_usb, "ota_host", "other_board", "key"), "is not for a PIC32MZ: its programmer decides"
            )
            return
        refuse_given(ctx, ("tool",), "is for a PIC32MZ, and this board has none")
        if ota_host is None:
            refuse_given(ctx, ("other_board", "key"), "is for --ota; over USB, BOARD decides")
        else:
            refuse_given(ctx, by_usb, "is not for --ota: leave one of them out")
    except UserError as err:
        raise FlashError(err.message) from err


def try_out(board: Board, folder: Path) -> None:
    """In the virtual chip. Raises FlashError: it fails there, or is no build; BuildError: no such chip is here."""
    require_chips("--verify-boot")
    from wificnc_chips import verify_boot

    if board.target == "esp32":
        load_regions(folder, board, esp32_partitions())
    elif board.target == "pic32mz":
        read_image(board, folder / "wificnc.hex")
    done = verify_boot(board, folder)
    ui.note(f"boots     in the virtual chip: {done.banner} {done.version}, {done.events} exact step events of a G1")


@dataclass(frozen=True)
class Done:
    """What a way to write firmware leaves to report: for --json, and as lines of stdout."""

    facts: dict[str, Any]
    lines: list[str] = field(default_factory=list)


@dataclass(frozen=True)
class Options:
    """How it is written."""

    baud: int
    erase: bool
    verify: bool
    wait_s: float


def flash_esp32(board: Board, folder: Path, port: str | None, options: Options, dry_run: bool) -> Done:
    """By the chip's own loader. Raises FlashError."""
    partitions = esp32_partitions()
    regions = load_regions(folder, board, partitions)
    facts = {"erase": options.erase, "regions": [region_json(region) for region in regions]}
    if dry_run:
        return Done(facts, plan_lines(regions, options.erase))
    written = write(board, regions, partitions, port, options)
    said = banner(written, options.wait_s) if options.wait_s > 0 else []
    if options.wait_s > 0:
        greet(said, options.wait_s)
    return Done({**facts, "port": written, "said": said})


def region_json(region: Region) -> dict[str, Any]:
    return {"name": region.name, "offset": region.offset, "size": len(region.data)}


def write(
    board: Board, regions: list[Region], partitions: dict[str, Partition], port: str | None, options: Options
) -> str:
    """Look at the chip, write it, and start it. @return its port. Raises FlashError."""
    with connected(port) as device:
        chip = device.identify()
        show_chip(chip)
        for warning in check_chip(chip, board, regions, partitions):
            ui.warn(warning)
        with progress_bars() as show:
            if options.erase:
                device.erase()
            device.write(regions, options.baud, show)
        if options.verify:
            device.verify(regions)
            ui.note("verified  every region was read back")
        device.reset()
        return device.port


def flash_pic32mz(board: Board, folder: Path, tool: str | None, dry_run: bool) -> Done:
    """By the program of someone else, or ourselves by the board's USB bootloader. Raises FlashError."""
    image = folder / "wificnc.hex"
    if is_own(tool):
        pages = plan_pages(read_image(board, image))
        if not dry_run:
            flash_by_usb(pages)
        return Done({"tool": OWN, "pages": len(pages)}, describe(pages) if dry_run else [])
    command = plan_flash(board, image, tool)
    if not dry_run:
        ui.note(shlex.join(command))
        run_flash(command, tool)
    return Done({"command": command}, [shlex.join(command)] if dry_run else [])


def flash_by_usb(pages: list[Page]) -> None:
    """Raises FlashError."""
    with HidWire() as wire, progress_bars() as show:
        record = write_by_usb(wire, pages, show)
    ui.note(f"written   by {record.name}, bootloader {record.version >> 8:x}.{record.version & 0xFF:02x}")
    ui.warn("the bootloader cannot read back: each page was acknowledged, and none compared")


def esp32_board(board_ref: str) -> Board:
    """Raises BuildError for a board without an ESP32."""
    board = load_board(board_ref)
    if board.target != "esp32":
        raise BuildError(f"{board.id} has no ESP32: this command cannot write it")
    return board


def esp32_partitions() -> dict[str, Partition]:
    return read_partitions((paths.TARGETS / "esp32" / "partitions.csv").read_text(encoding="utf-8"))


def plan_lines(regions: list[Region], erase: bool) -> list[str]:
    """What --dry-run prints."""
    lines = [f"0x{region.offset:06X}  {len(region.data):>9,} bytes  {region.name}" for region in regions]
    kept = "untouched: what the controller has stored (settings, WiFi, passwords)"
    return ["erase      everything", *lines] if erase else [*lines, kept]


def show_chip(chip: Chip) -> None:
    psram = f"{chip.psram_mb} MB PSRAM" if chip.psram_mb else "no PSRAM in the chip"
    ui.note(f"chip      {chip.title}, {chip.flash_mb:g} MB flash, {psram}, {chip.mac}")


def banner(port: str, seconds: float) -> list[str]:
    """What the firmware says after its start, as far as it says something in time."""
    lines: list[str] = []
    deadline = time.monotonic() + seconds
    try:
        with serial.Serial(port, 115200, timeout=0.5) as link:
            while time.monotonic() < deadline and not any("[MSG:Address" in line for line in lines):
                line = link.readline().decode("ascii", "replace").strip()
                lines += [line] if line else []
    except (serial.SerialException, OSError):
        pass  # native USB comes and goes with a reset
    return lines


def greet(said: list[str], seconds: float) -> None:
    lines = [line for line in said if line.startswith(("Grbl ", "[MSG:"))]
    for line in lines:
        ui.note(line)
    if not any(line.startswith("Grbl ") for line in lines):
        ui.warn(f"written, but the firmware has not printed anything for {seconds:g} s: `wificnc monitor` waits longer")


def signed_image(folder: Path, board: Board) -> Signed:
    """Raises FlashError."""
    data = app_image(folder / "firmware.bin", board.chip)
    try:
        return Signed(data, raw_signature((folder / SIGNATURE).read_bytes()))
    except (OSError, ValueError) as err:
        why = "damaged" if isinstance(err, ValueError) else "missing"
        raise FlashError(
            f"the signature of this firmware is {why}: {folder / SIGNATURE}",
            hint=f"`wificnc build {board.id}` signs it; or write it over USB: without --ota",
        ) from err


@dataclass(frozen=True)
class Way:
    """How an update over the network is made."""

    dry_run: bool
    other_board: bool  # than that of the firmware that runs


def update(board: Board, folder: Path, host: str, key: str | None, way: Way) -> Done:
    """Over the network. Raises FlashError."""
    image = signed_image(folder, board)
    name, port = host_and_port(host, OTA_PORT)
    facts = {"host": name, "port": port, "size": len(image.data)}
    if way.dry_run:
        return Done(facts, [f"{len(image.data):,} bytes to {name}:{port}, into the inactive slot"])
    if not any(bytes.fromhex(image.digest)):
        raise FlashError(
            f"{folder / 'firmware.bin'} does not contain the digest of its ELF file",
            hint=f"`wificnc build {board.id}` makes one that does; or write it over USB: without --ota",
        )
    upload, hello = greeted(name, port)
    try:
        other = check_board_there(board, hello, host, way)
        if not key:
            upload.close()  # who types may take longer than the controller waits
            key = click.prompt("access key", hide_input=True, err=True)
            upload, hello = greeted(name, port)
        with progress_bars() as show:
            upload.send(hello, image, key, lambda done, total: show("firmware", done, total), other)
    finally:
        upload.close()
    ui.note("the controller has checked it and starts it now; if this fails, it returns to the old firmware")
    if not hello.digest:
        time.sleep(RESTART_S)
    wait_until_kept(name, port, key, image.digest)
    ui.note(f"the new firmware runs and is kept: {image.digest}")
    return Done({**facts, "digest": image.digest})


def check_board_there(board: Board, hello: Hello, host: str, way: Way) -> bool:
    """@return the controller is another board, and BOARD's is meant. Raises FlashError."""
    if hello.board != board.id and not way.other_board:
        raise FlashError(
            f"{host} is the board {hello.board}, and this firmware is for {board.id}",
            hint=f"wificnc flash {hello.board} --ota {host}; or give --other-board if {board.id} is meant",
        )
    return hello.board != board.id
