"""`wificnc build BOARD`."""

from __future__ import annotations

import re
from dataclasses import asdict
from typing import Any

import rich_click as click

from wificnc import __version__, ui
from wificnc.board.load import load_board
from wificnc.board.model import Board
from wificnc.build import esp32
from wificnc.build.checkout import checkout_root
from wificnc.build.environments import write_environments
from wificnc.build.esp32_size import firmware_sizes
from wificnc.build.host import RAM_BUDGET_BYTES, VARIANTS, HostBuild, build_host, core_ram_bytes
from wificnc.build.mips import Choice
from wificnc.build.pic32mz import (
    FLASH_BUDGET,
    FLASH_BYTES,
    RAM_BUDGET,
    RAM_BYTES,
    Pic32Build,
    build_pic32mz,
)
from wificnc.build.signing import signing_key
from wificnc.build.size import Size
from wificnc.commands._target import json_option
from wificnc.errors import BuildError, UserError

PIC32MZ_DEBUG = "its ELF has debug information: gdb-multiarch build/BOARD/wificnc.elf"
USED = re.compile(r"^(RAM|Flash):.*\((used .*)\)$")


@click.command()
@click.argument("board_ref", metavar="BOARD")
@click.option(
    "--release/--debug",
    "release",
    default=None,
    help="Release (the default) or debug build: for ESP32 boards and the simulator.",
)
@click.option("--variant", type=click.Choice(list(VARIANTS)), help="Simulator only: also with sanitizers.")
@click.option("--cc", type=click.Choice(["gcc", "zig"]),
              help="PIC32MZ only: the compiler. Default: gcc if it is installed.")  # fmt: skip
@click.option("--clean", is_flag=True, help="Boards only: delete earlier output, then build everything.")
@click.option("-v", "--verbose", is_flag=True, help="Boards only: print every line of the build.")
@json_option
def command(
    board_ref: str, release: bool | None, variant: str | None, cc: Choice | None, clean: bool, verbose: bool,
    as_json: bool,
) -> None:  # fmt: skip
    """Build the firmware of BOARD into build/BOARD. `host` is the controller on this computer, for `wificnc sim`."""
    kind: esp32.Kind = "debug" if release is False else "release"
    if cc is not None and (board_ref == "host" or load_board(board_ref).target != "pic32mz"):
        raise UserError("--cc is for a PIC32MZ only", hint="the simulator's compiler is the one in the variable CC")
    if board_ref == "host":
        variant = host_variant(release, variant)
        facts = show(build_host(variant), variant)
    else:
        facts = build_firmware(load_board(board_ref), kind, variant, cc, clean=clean, verbose=verbose)
    if as_json:
        ui.emit_json({"board": board_ref, **facts})


def build_firmware(
    board: Board, kind: esp32.Kind, variant: str | None, cc: Choice | None, *, clean: bool, verbose: bool
) -> dict[str, Any]:
    """@return for --json. Raises UserError, BuildError."""
    if variant is not None:
        raise UserError(f"--variant is for the simulator, and {board.id} is a board", hint="--debug is for boards")
    if board.target == "pic32mz":
        if kind == "debug":
            raise UserError(f"{board.id} has one kind of build: --debug has no effect on it", hint=PIC32MZ_DEBUG)
        return show_pic32mz(build_pic32mz(board, clean=clean, cc=cc), board)
    if board.target == "esp32":
        return build_board(board, kind, clean, verbose)
    raise BuildError(f"board {board.id} is this computer: it has no firmware", hint="wificnc build host")


def host_variant(release: bool | None, variant: str | None) -> str:
    """Raises UserError when the two ask for different builds."""
    asked = None if release is None else "release" if release else "debug"
    if variant is not None and asked is not None and asked != variant:
        raise UserError(f"--{asked} and --variant {variant} exclude each other", hint="give one of them")
    return variant or asked or "release"


def build_board(board: Board, kind: esp32.Kind, clean: bool, verbose: bool) -> dict[str, Any]:
    """By PlatformIO. Raises BuildError."""
    root = checkout_root()
    pio = esp32.find_platformio()
    esp32.require_packages(esp32.core_directory())
    write_environments(root)
    plan = esp32.plan_build(board, root, kind=kind, pio=pio)
    lines: list[str] = []
    with ui.talk.status(f"building {board.id}") as status:
        if clean:
            list(esp32.run_build(esp32.plan_build(board, root, kind=kind, clean=True, pio=pio)))
        for line in esp32.run_build(plan):
            lines.append(line)
            if verbose:
                ui.note(line)
            else:
                status.update(f"building {board.id}: {line[:80]}")
    warn_of_old_configuration(esp32.configuration_without(root, plan, board.chip), plan)
    facts = {"revision": esp32.git_revision(root), "board_sha256": board.sha256, "wificnc": __version__}
    artefacts = esp32.collect(plan, facts, signing_key())
    slot = esp32.slot_bytes((root / "targets/esp32/partitions.csv").read_text(encoding="utf-8"))
    sizes = firmware_sizes(plan.output, board.chip, slot)
    show_firmware(sizes, lines)
    ui.note(f"all of it  {plan.output}, flash it: wificnc flash {board.id}")
    files = [str(plan.output / artefact.name) for artefact in artefacts]
    return {"kind": kind, "files": files, "sizes": [asdict(size) for size in sizes]}


def warn_of_old_configuration(missing: list[str], plan: esp32.Plan) -> None:
    """No one's own changes are thrown away, and nothing of ours is left out in silence."""
    if missing:
        kept = f"sdkconfig.{plan.made.name}"
        ui.warn(
            f"{kept} is from an earlier build and differs from targets/esp32/sdkconfig.*:"
            f" {', '.join(missing)}\nif this is not intended: delete {kept}, then build again with --clean"
        )


def show_pic32mz(build: Pic32Build, board: Board) -> dict[str, Any]:
    """What was made, against the memory map."""
    done = f"{build.compiled} of {build.sources} files compiled in {build.seconds:.1f} s" if build.compiled else "fresh"
    ui.note(f"compiler   {build.compiler}")
    ui.note(f"sources    {build.sources} files, {done}")
    sizes = [
        Size("flash", build.flash_bytes, FLASH_BYTES, FLASH_BUDGET),
        Size("RAM", build.ram_bytes, RAM_BYTES, RAM_BUDGET),
    ]
    for size in sizes:
        share = f"{size.used / size.budget:.0%} of the budget of {size.budget:,}"
        ui.note(f"{size.name:<10} {size.used:,} bytes, {share}; the chip has {size.there:,}")
        if size.is_over:
            fits = "It fits the chip and runs; gcc's image is smaller (--cc gcc)"
            ui.warn(f"this is more {size.name} than our budget. {fits}")
    ui.note(f"all of it  {build.hex}, flash it: wificnc flash {board.id}")
    return {"kind": "release", "files": [str(build.hex), str(build.elf)], "sizes": [asdict(size) for size in sizes]}


def show_firmware(sizes: list[Size], lines: list[str]) -> None:
    """Sizes against budgets and what there is. Raises BuildError when the firmware does not fit."""
    for size in sizes:
        ui.note(f"{size.name:<10} {size}")
    for match in filter(None, map(USED.match, lines)):
        ui.note(f"{match[1]:<10} {match[2]}")
    for size in sizes:
        if size.used > size.there:
            raise BuildError(f"the firmware does not fit: {size.name} {size}")
        if size.is_over:
            ui.warn(f"{size.name}: more than the budget. The firmware fits, and leaves too little room to grow")


def show(build: HostBuild, variant: str) -> dict[str, Any]:
    """Who compiled what, how large it is, and what of the controller's RAM is taken."""
    if build.warnings:
        ui.warn(f"{build.compiler.title} reports warnings:\n{build.warnings.rstrip()}")
    done = f"{build.compiled} of {build.sources} files compiled in {build.seconds:.1f} s" if build.compiled else "fresh"
    ui.note(f"compiler  {build.compiler.title}")
    ui.note(f"sources   {build.sources} files, {done}")
    ui.note(f"library   {build.library} ({build.library.stat().st_size / 1024:.0f} KB)")
    facts: dict[str, Any] = {"kind": variant, "files": [str(build.library)], "sizes": []}
    if variant == "release":
        used = core_ram_bytes(build.library)
        ui.note(f"core RAM  {used:,} of {RAM_BUDGET_BYTES:,} bytes ({used / RAM_BUDGET_BYTES:.0%} of the budget)")
        facts["sizes"] = [asdict(Size("core RAM", used, RAM_BUDGET_BYTES, RAM_BUDGET_BYTES))]
    return facts
