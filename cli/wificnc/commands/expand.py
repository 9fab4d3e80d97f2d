"""`wificnc expand FILE`: the plain lines that a program executes."""

from __future__ import annotations

from pathlib import Path

import rich_click as click

from wificnc import ui
from wificnc.build.host import ensure_host_library
from wificnc.commands._output import OutputFile
from wificnc.commands._program import max_lines_option
from wificnc.job.expand import Expanded, Start, expand, load_expand
from wificnc.job.program import LONGEST_CODE
from wificnc.output import STDOUT, write_output
from wificnc.sim.job import read_job


@click.command()
@click.argument("file", type=click.Path(path_type=Path))
@click.option("-o", "--output", type=OutputFile(), required=True, metavar="OUT",
              help="Write the lines here; - is stdout.")  # fmt: skip
@click.option("--at-zero", is_flag=True,
              help="The machine is assumed to be at 0, without offsets, in the modes after power-on.")  # fmt: skip
@click.option("--number", is_flag=True, help="Give each line the number of its line in FILE as N word.")
@max_lines_option
def command(file: Path, output: Path, at_zero: bool, number: bool, max_lines: int) -> None:
    """Run the O words, expressions and parameters of a program FILE, and write the plain lines that are left.

    Any Grbl controller understands them. A program that depends on the machine's position, its offsets or a probe is
    refused.
    """
    start = Start.AT_ZERO if at_zero else Start.ANYWHERE
    library = load_expand(ensure_host_library())
    expanded = expand(library, file.name, read_job(file), start, max_lines)
    text = numbered_text(expanded) if number else expanded.text
    write_output("--output", output, text)
    if output != STDOUT:
        ui.note(f"wrote {output}: {len(expanded.numbers):,} lines")


def numbered_text(expanded: Expanded) -> bytes:
    """The lines with N words, but for those that have one, would become too long, or are $ lines."""
    lines = []
    for number, line in zip(expanded.numbers, expanded.text.splitlines(keepends=True), strict=True):
        numbered = b"N%d%s" % (number, line)
        fits = len(numbered.rstrip()) <= LONGEST_CODE and line[:1] not in (b"N", b"$")
        lines.append(numbered if fits else line)
    return b"".join(lines)
