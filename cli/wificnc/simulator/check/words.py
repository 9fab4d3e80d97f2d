"""What is surely wrong with the words of a program, whatever the run says of it. Pure."""

from __future__ import annotations

import re
from collections.abc import Iterable, Iterator, Mapping
from math import hypot

from wificnc.connection.typed import COMMENT
from wificnc.job.program import JobLine, words_of
from wificnc.simulator.check.finding import Finding, Severity

LONGEST_DWELL_S = 100.0  # a longer one was meant in milliseconds
MM_PER_INCH = 25.4
SPINDLE_MAX = 30
RATES = (110, 111, 112)
KINEMATICS = 80  # not 0: rates are of motors or angles, and the run says which feeds are reached
DWELLS = {4.0: "G4", 82.0: "G82", 86.0: "G86", 89.0: "G89"}
PRINTER = re.compile(r"M(?:10[4-9]|140|190|20[0-9]|82|83)(?![0-9])|^G(?:1|01)(?![0-9.]).*E[-0-9.]")

EXPONENT = re.compile(r"(?<=[0-9.])E(?=[-+]?[0-9])", re.IGNORECASE)  # 1e3: a printer's E has a blank before it


def surely_wrong(lines: Iterable[JobLine], settings: Mapping[int, float]) -> Iterator[Finding]:
    """Findings by their first line, and how many lines are like it.

    Args:
        settings: by number, of the machine.
    """
    found: dict[tuple[str, str], list[int]] = {}
    hints: dict[str, str] = {}
    unit_mm, is_per_min, cycle = 1.0, True, 0.0
    for line in lines:
        if line.alone:
            continue
        words = words_of(line.code)
        codes = {number for letter, number in words if letter == "G"}
        unit_mm = MM_PER_INCH if 20.0 in codes else 1.0 if 21.0 in codes else unit_mm
        is_per_min = 94.0 in codes or (is_per_min and not codes & {93.0, 95.0})
        cycle = next((code for code in codes if 80.0 <= code < 90.0), 0.0 if codes & {0.0, 1.0, 2.0, 3.0} else cycle)
        for kind, message, hint in _of_line(line, words, codes, cycle, unit_mm if is_per_min else 0.0, settings):
            found.setdefault((kind, message), []).append(line.number)
            hints[message] = hint
    for (kind, message), numbers in found.items():
        more = f" ({len(numbers)} lines)" if len(numbers) > 1 else ""
        yield Finding(kind, Severity.WARNING, numbers[0], numbers[-1], message + more, hints[message])


def _of_line(
    line: JobLine, words: list[tuple[str, float]], codes: set[float], cycle: float, feed_unit_mm: float,
    settings: Mapping[int, float],
) -> Iterator[tuple[str, str, str]]:  # fmt: skip
    """(kind, message, hint)"""
    if PRINTER.search(line.code) and not EXPONENT.search(COMMENT.sub("", line.text)):
        yield "printer", "this is a program for a 3D printer", "make it again with a post-processor for Grbl"
        return
    values = dict(words)
    dwell = next((name for number, name in DWELLS.items() if number in codes or number == cycle), "")
    if dwell and values.get("P", 0.0) >= LONGEST_DWELL_S and not codes & {10.0, 64.0}:
        hint = f"P is in seconds; if milliseconds were meant, write P{values['P'] / 1000:g}"
        yield "dwell", f"{dwell} P{values['P']:g} waits {values['P'] / 60:.0f} minutes", hint
    speed, most = values.get("S", 0.0), settings.get(SPINDLE_MAX, 0.0)
    if most and speed > most:
        yield "spindle-speed", f"S{speed:g} is above the machine's {most:g} ($30)", "lower S; the spindle turns at $30"
    feed_max = hypot(*(settings.get(rate, 0.0) for rate in RATES))
    if feed_max and not settings.get(KINEMATICS) and values.get("F", 0.0) * feed_unit_mm > feed_max:
        message = f"F{values['F']:g} is above the machine's {feed_max / feed_unit_mm:.0f} along any direction"
        yield "feed-limit", message, "lower F, or raise $110, $111, $112"
