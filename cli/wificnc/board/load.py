"""From a board id or a file to a checked Board."""

from __future__ import annotations

from pathlib import Path

from wificnc.board import paths
from wificnc.board.chip import Chip, load_chips, text_sha256
from wificnc.board.model import Board, BoardFile
from wificnc.board.problem import BoardProblems
from wificnc.board.rules import check_rules
from wificnc.errors import BoardError
from wificnc.files.problem import FileProblems, Finding, Problem
from wificnc.files.repair import concerns, repaired
from wificnc.files.shape import by_line, closest, locate, validate
from wificnc.files.tomlfile import TomlFile, read_toml


def find_boards() -> list[Path]:
    """The board files of the repository, by id."""
    paths.require_repository()
    return sorted(paths.BOARDS.glob("*.toml"), key=lambda path: path.stem)


def board_path(ref: str | Path) -> Path:
    """The file of a board id, or the path itself.

    Raises:
        BoardError: there is no such board.
    """
    if isinstance(ref, Path) or ref.endswith(".toml") or "/" in ref or "\\" in ref:
        return Path(ref)
    known = {path.stem: path for path in find_boards()}
    if ref not in known:
        meant = closest(ref, known)
        hint = f"did you mean {meant}?" if meant else f"boards: {', '.join(known)}; or give the path of a TOML file"
        raise BoardError(f"unknown board {ref!r}", hint)
    return known[ref]


def load_board(ref: str | Path) -> Board:
    """Load and check a board by its id or its file.

    Raises:
        BoardError: there is no such board, or its file breaks rules; then every problem is listed.
    """
    path = board_path(ref)
    try:
        source = read_toml(path)
        findings = _first_key(source)
        try:
            file = validate(BoardFile, source)
        except FileProblems as err:
            raise FileProblems(by_line([*err.problems, *_other_problems(source, findings)])) from err
        chip = _chip_of(file, source)
        findings += check_rules(file, chip)
        if findings:
            raise FileProblems(locate(findings, source))
    except FileProblems as err:
        raise BoardProblems(err.problems) from err
    fields = {name: getattr(file, name) for name in file.model_fields_set if name != "schema_version"}
    sha256 = text_sha256(source.text + chip.sha256)
    return Board(schema=1, id=path.stem, path=path, sha256=sha256, pins=chip, **fields)


def check_board(ref: str | Path) -> list[Problem]:
    """Every problem of a board; none when it is good.

    Raises:
        BoardError: there is no such board.
    """
    try:
        load_board(ref)
    except BoardProblems as err:
        return list(err.problems)
    return []


def _other_problems(source: TomlFile, findings: list[Finding]) -> list[Problem]:
    """What the rules find in a file with faults in its shape, apart from what follows from these."""
    file, places = repaired(BoardFile, source.data)
    if file is None or concerns(("target",), places) or concerns(("chip",), places):
        return locate([finding for finding in findings if not concerns(finding.path, places)], source)
    try:
        chip = _chip_of(file, source)
    except FileProblems as err:
        return [*err.problems, *locate(findings, source)]
    findings = [*findings, *check_rules(file, chip, places)]
    return locate([finding for finding in findings if not concerns(finding.path, places)], source)


def _chip_of(file: BoardFile, source: TomlFile) -> Chip:
    chips = load_chips()
    if (file.target, file.chip) in chips:
        chip = chips[file.target, file.chip]
        return chip.with_shift_registers(file.i2so.outputs) if file.i2so else chip
    known = " or ".join(f'target = "{target}", chip = "{chip}"' for target, chip in chips)
    reason = f"no pin table for chip {file.chip!r} of target {file.target!r}"
    raise FileProblems(locate([Finding("unknown-chip", ("chip",), reason, known)], source))


def _first_key(source: TomlFile) -> list[Finding]:
    """A reader of any age must find the schema before anything it may not understand."""
    first = next(iter(source.data), "schema")
    if first == "schema":  # one that is missing is reported with the other keys
        return []
    return [Finding("schema-first", ("schema",), f"must be the first key of the file; {first} is")]
