"""`wificnc build BOARD`."""

from __future__ import annotations

import rich_click as click

from wificnc import ui
from wificnc.build.host import VARIANTS, HostBuild, build_host, core_ram_bytes
from wificnc.errors import BuildError

RAM_BUDGET_BYTES = 32 * 1024


@click.command()
@click.argument("board")
@click.option(
    "--variant",
    type=click.Choice(list(VARIANTS)),
    default="release",
    help="Of the host: plain, with debug channels, or sanitized.",
)
def command(board: str, variant: str) -> None:
    """Build the firmware of BOARD. `host` is the controller on this computer, for `wificnc sim`."""
    if board != "host":
        raise BuildError(
            f"not yet: there is no firmware for {board!r} to build", hint="`wificnc build host` works today"
        )
    show(build_host(variant), variant)


def show(build: HostBuild, variant: str) -> None:
    """Who compiled what, how large it is, and what of the controller's RAM is taken."""
    if build.warnings:
        ui.warn(f"{build.compiler.title} has something to say:\n{build.warnings.rstrip()}")
    done = f"{build.compiled} of {build.sources} files compiled in {build.seconds:.1f} s" if build.compiled else "fresh"
    ui.note(f"compiler  {build.compiler.title}")
    ui.note(f"sources   {build.sources} files, {done}")
    ui.note(f"library   {build.library} ({build.library.stat().st_size / 1024:.0f} KB)")
    if variant == "release":
        used = core_ram_bytes(build.library)
        ui.note(f"core RAM  {used:,} of {RAM_BUDGET_BYTES:,} bytes ({used / RAM_BUDGET_BYTES:.0%} of the budget)")
