"""`wificnc release`."""

from __future__ import annotations

from dataclasses import asdict
from pathlib import Path
from typing import Any

import rich_click as click

from wificnc import ui
from wificnc.build.checkout import find_checkout
from wificnc.build.cross import require_zig
from wificnc.build.platforms import PLATFORMS
from wificnc.commands._output import OutputFolder
from wificnc.commands._target import json_option
from wificnc.errors import ReleaseError
from wificnc.firmware.release.facts import firmware_boards, look, read_source
from wificnc.firmware.release.plan import Plan, plan_release
from wificnc.firmware.release.run import check_output, has_page, make_release

ALL, NONE = "all", "none"


@click.command()
@click.option("--boards", "names", metavar="BOARD,...", default="",
              help="These boards, or `all`; a missing one is an error. Default: the ones that are built.")  # fmt: skip
@click.option("-o", "--output", type=OutputFolder(), default=Path("dist"), show_default=True,
              help="Folder; an older release in it is replaced.")  # fmt: skip
@click.option("--tag", default="", metavar="vVERSION",
              help="A final release: all boards, the page, a clean tree, a dated changelog.")  # fmt: skip
@click.option("--platforms", "computers", metavar="NAME,...", default=ALL, show_default=True,
              help="Computers for which a wheel without need of a compiler is made; or `none`.")  # fmt: skip
@click.option("--dry-run", is_flag=True, help="Print what the release would contain.")
@json_option
def command(names: str, output: Path, tag: str, computers: str, dry_run: bool, as_json: bool) -> None:
    """Make all files of a release from what has been built: images of boards, packages, the page's firmware,
    sums, a bill of materials. The same commit gives the same bytes."""
    root = find_checkout()
    if root is None:
        raise ReleaseError("a release is made in a checkout of the repository", hint="git clone it")
    source, boards = read_source(root), firmware_boards()
    wanted = _listed(names, [board.id for board in boards])
    plan = plan_release(source, boards, look(root, source, boards), wanted, tag, _listed(computers, list(PLATFORMS)))
    if plan.platforms:
        require_zig()
    if tag and not has_page(root):
        raise ReleaseError("the page has not been built, and a final release has one", hint="make web")
    check_output(output)
    if not source.is_clean:
        ui.warn(f"files were changed since the last commit: this is {source.revision}, which cannot be reproduced")
    if not dry_run:
        with ui.talk.status("making the release") as status:
            make_release(plan, root, output, final=bool(tag), say=lambda step: status.update(f"making: {step}"))
        show(plan, output)
    if as_json:
        ui.emit_json(plan_json(plan, output, made=not dry_run))
    elif dry_run:
        for asset in plan.assets:
            click.echo(asset.name)
    show_missing(plan)
    if not has_page(root):
        ui.warn("the page has not been built, so web/ has only the firmware: `make web`")


def _listed(text: str, everything: list[str]) -> list[str]:
    """Names with commas between them, or `all`, or `none`."""
    names = [name.strip() for name in text.split(",") if name.strip()]
    if names == [ALL]:
        return everything
    return [] if names == [NONE] else names


def show(plan: Plan, output: Path) -> None:
    for asset in plan.assets:
        ui.note(f"{(output / asset.name).stat().st_size / 1024:>8.0f} KB  {asset.name}")
    done = f"{len(plan.boards)} of {len(plan.boards) + len(plan.missing)} boards"
    ui.note(f"{output}: WiFiCNC {plan.source.version} of commit {plan.source.revision}, {done}")


def plan_json(plan: Plan, output: Path, made: bool) -> dict[str, Any]:
    """The document of --json. The keys are a contract with scripts."""
    return {
        "version": plan.source.version,
        "revision": plan.source.revision,
        "folder": str(output),
        "made": made,
        "files": [asdict(asset) for asset in plan.assets],
        "missing": [{"board": row.board.id, "why": row.why} for row in plan.missing],
    }


def show_missing(plan: Plan) -> None:
    """What this machine could not build, and who can."""
    for row in plan.missing:
        ui.warn(f"no firmware of {row.board.id}: {row.why}")
