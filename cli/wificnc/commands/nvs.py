"""`wificnc nvs`: what an ESP32 has stored, as files and on the board."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import rich_click as click
from rich.table import Table

from wificnc import ui
from wificnc.board.model import Board
from wificnc.commands._output import OutputFile
from wificnc.commands._port import connected, port_option, progress_bars
from wificnc.commands._secret import ASKED, Secret
from wificnc.commands._target import json_option
from wificnc.commands._together import refuse_given
from wificnc.commands.flash import esp32_board, esp32_partitions
from wificnc.errors import Exit, FlashError, UserError
from wificnc.files.bounded import IMAGE_MAX, read_bytes
from wificnc.firmware.flash.plan import Chip, Region, check_model
from wificnc.firmware.nvs.build import build_image
from wificnc.firmware.nvs.fit import check_chip_pins, check_pins, chips_that_fit
from wificnc.firmware.nvs.image import Entry, NvsImage, read_image
from wificnc.firmware.nvs.values import (
    differences,
    machine_entries,
    number_entry,
    random_password,
    rows,
    text_entry,
)
from wificnc.output import STDOUT, write_output
from wificnc.profile import load_machine
from wificnc.profile.fit import check_fit
from wificnc.simulator.serve.options import parse_host_name

secrets_option = click.option("--show-secrets", is_flag=True, help="Passwords in clear.")


@click.group()
def command() -> None:
    """Settings, WiFi and pins stored in an ESP32: make an image, write it, read it back, compare."""


@command.command("build")
@click.argument("machine", metavar="MACHINE.toml")
@click.option("-o", "--output", type=OutputFile(), default=Path("nvs.bin"), show_default=True,
              help="- is stdout.")  # fmt: skip
@click.option(
    "--board", "board_ref", metavar="BOARD", help="Check that the machine and the pins of --set fit this board."
)
@click.option("--ssid", help="Name of the WiFi network to join.")
@click.option("--wifi-password", type=Secret(), help="Its password. " + ASKED)
@click.option("--access-key", type=Secret(),
              help="Of network clients and updates. Without one the controller makes its own. " + ASKED)  # fmt: skip
@click.option("--http-name", "http_names", multiple=True, metavar="NAME",
              help="A name of your network that leads to the page, such as shop.lan; repeatable.")  # fmt: skip
@click.option("--set", "numbers", multiple=True, metavar="KEY=N", help="A key of protocol/nvs.toml, such as p_sx=4.")
@json_option
@click.pass_context
def build(
    ctx: click.Context,
    machine: str,
    output: Path,
    board_ref: str | None,
    ssid: str | None,
    wifi_password: str | None,
    access_key: str | None,
    http_names: tuple[str, ...],
    numbers: tuple[str, ...],
    as_json: bool,
) -> None:
    """Make an image of a machine profile. The controller's own network gets a new random password."""
    if as_json and output == STDOUT:
        raise UserError("--json and --output - both use stdout", hint="--output FILE")
    if ssid is None:
        refuse_given(ctx, ("wifi_password",), "has no effect without --ssid", hint="--ssid NAME is the network to join")
    profile = load_machine(machine)
    moved = [*map(number_entry, numbers)]
    if board_ref is not None:
        board = esp32_board(board_ref)
        check_fit(board, profile)
        check_pins(board, moved)
    fitting = chips_that_fit(moved) if board_ref is None else [board_ref]
    if fitting and board_ref is None:
        ui.warn(f"the pins are of {' and '.join(fitting)}; whether a board has them free was not checked",
                hint="--board BOARD checks them")  # fmt: skip
    own = random_password()
    texts = {"wifi_ssid": ssid, "wifi_pass": wifi_password, "access_key": access_key, "ap_pass": own}
    texts["http_names"] = ",".join(map(parse_host_name, http_names)) or None
    entries = [*machine_entries(profile), *moved]
    entries += [text_entry(key, value) for key, value in texts.items() if value is not None]
    write_output("--output", output, build_image(entries))
    ui.note(f"wrote {output}: {len(entries)} keys")
    ui.note(f"password of the controller's own network: {own}")
    if as_json:
        keys = [entry.key for entry in entries]
        ui.emit_json({"file": str(output), "keys": keys, "pins_fit": fitting, "own_password": own})


@command.command("read")
@click.argument("file", type=click.Path(path_type=Path, dir_okay=False, exists=True), required=False)
@port_option
@click.option(
    "-o", "--output", type=OutputFile(), help="Also write the image to this file; - is stdout, without the table."
)
@secrets_option
@json_option
@click.pass_context
def read(
    ctx: click.Context, file: Path | None, port: str | None, output: Path | None, show_secrets: bool, as_json: bool
) -> None:
    """Show the contents of FILE, or of the board at the port."""
    if file is not None:
        refuse_given(ctx, ("port",), "has no effect with FILE: either of them is read")
    if output == STDOUT:
        refuse_given(ctx, ("show_secrets", "as_json"), "is for the table, and -o - writes the image to stdout instead")
    data = read_bytes(file, IMAGE_MAX) if file is not None else read_board(port)
    image = read_image(data)
    if output is not None:
        write_output("--output", output, data)
    warn_of_damage(image)
    if output == STDOUT:
        return
    shown = rows(image, show_secrets)
    if as_json:
        ui.emit_json({row.key: row.value for row in shown})
        return
    table = Table("key", "value", "what it is")
    for row in shown:
        table.add_row(row.key, row.value, row.meaning)
    ui.data.print(table)


@command.command("flash")
@click.argument("file", type=click.Path(path_type=Path, dir_okay=False, exists=True))
@port_option
@click.option("--board", "board_ref", metavar="BOARD", help="Refuse pins and a chip that are not this board's.")
@click.option("--dry-run", is_flag=True, help="Check the file and print what would be written.")
@json_option
def flash(file: Path, port: str | None, board_ref: str | None, dry_run: bool, as_json: bool) -> None:
    """Write an image to the board. It replaces everything stored there. Pins that its chip does not have are refused
    before anything is written."""
    data = read_bytes(file, IMAGE_MAX)
    image = read_image(data)
    warn_of_damage(image)
    if image.damaged:
        raise FlashError(f"{file} is damaged and was not written")
    partition = esp32_partitions()["nvs"]
    if len(data) != partition.size:
        raise FlashError(f"{file} has {len(data):,} bytes, the board's storage {partition.size:,}")
    board = esp32_board(board_ref) if board_ref is not None else None
    if board is not None:
        check_pins(board, [*image.entries.values()])
    if not dry_run:
        write_board(port, data, lambda chip: check_chip_of(chip, board, image))
    if as_json:
        facts = {"offset": partition.offset, "size": len(data), "keys": len(image.entries)}
        ui.emit_json({"file": str(file), **facts, "written": not dry_run})
    elif dry_run:
        click.echo(f"0x{partition.offset:06X}  {len(data):>9,} bytes  {len(image.entries)} keys")


@command.command("diff")
@click.argument("first", type=click.Path(path_type=Path, dir_okay=False, exists=True))
@click.argument("second", type=click.Path(path_type=Path, dir_okay=False, exists=True))
@secrets_option
@json_option
def diff(first: Path, second: Path, show_secrets: bool, as_json: bool) -> None:
    """Show which keys differ between two images. Exit code 1 if there are differences."""
    one, other = (read_image(read_bytes(file, IMAGE_MAX)) for file in (first, second))
    found = differences(one, other, show_secrets)
    if as_json:
        ui.emit_json([{"key": key, "first": was, "second": is_} for key, _, was, is_ in found])
    elif found:
        table = Table("key", str(first), str(second), "what it is")
        for key, meaning, was, is_ in found:
            table.add_row(key, was, is_, meaning)
        ui.data.print(table)
    else:
        ui.note("no difference")
    raise SystemExit(Exit.JOB if found else Exit.OK)


def warn_of_damage(image: NvsImage) -> None:
    for what in image.damaged:
        ui.warn(what)


def read_board(port: str | None) -> bytes:
    """The NVS partition of the board; it is started again afterwards."""
    partition = esp32_partitions()["nvs"]
    with connected(port) as device:
        data = device.read(partition.offset, partition.size)
        device.reset()
    return data


def check_chip_of(chip: Chip, board: Board | None, image: NvsImage) -> None:
    """Raises FlashError: the image is for another chip, or the board has another one."""
    if board is not None:
        check_model(chip, board)
    check_chip_pins(chip.name, [*image.entries.values()])


def write_board(port: str | None, data: bytes, check: Callable[[Chip], None] = lambda chip: None) -> None:
    """Write the NVS partition and read it back. @param check  raises when the image is not for this chip"""
    region = Region("settings", esp32_partitions()["nvs"].offset, data)
    with connected(port) as device:
        check(device.identify())
        with progress_bars() as show:
            device.write([region], 115200, show)
        device.verify([region])
        device.reset()


def entries_of(image: NvsImage) -> list[Entry]:
    return list(image.entries.values())
