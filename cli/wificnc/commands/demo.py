"""`wificnc demo`: a job that comes with WiFiCNC, through the core, and its picture."""

from __future__ import annotations

import importlib.util
from pathlib import Path

import rich_click as click

from wificnc import ui
from wificnc.build.checkout import find_checkout
from wificnc.commands import sim
from wificnc.commands._output import OutputFile
from wificnc.files import paths

JOB = paths.ROOT / "examples" / "inlay.nc"
MACHINE = "shapeoko3"


@click.command()
@click.option("-o", "--output", type=OutputFile(stdout=False), metavar="FILE",
              help="The picture: .png or .svg. Default: inlay.png, in build/demo of a checkout.")  # fmt: skip
@click.pass_context
def command(ctx: click.Context, output: Path | None) -> None:
    """Run a real job through the real core in virtual time, and draw the motion of the axes."""
    picture: Path | None = output or _picture()
    if importlib.util.find_spec("matplotlib") is None and output is None:
        ui.note("no picture, which needs matplotlib: pip install matplotlib")
        picture = None
    ctx.invoke(sim.command, file=JOB, machine=MACHINE, plot=picture)


def _picture() -> Path:
    """Where it goes when no one says so."""
    root = find_checkout()
    if root is None:
        return Path("inlay.png")
    folder = root / "build" / "demo"
    folder.mkdir(parents=True, exist_ok=True)
    return Path(paths.shown(folder / "inlay.png"))
