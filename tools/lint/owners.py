"""Each part of struct machine is written by its owners alone, and no one outside of core/machine looks into one.

The parts are those of core/machine/parts.h. Others change a part by a function of its header, which gets the part.
"""

from __future__ import annotations

import re
from pathlib import Path

from lint.problem import Problem, source_files

# member of struct machine -> files of core/machine that may write it; the longest name that fits counts
OWNERS: dict[str, tuple[str, ...]] = {
    "interp": ("interp", "lines"),
    "interp.params": ("await", "probe"),
    "interp.gcode.offsets": ("stored",),
    "interp.gcode.ports": ("configure", "wiring"),
    "interp.gcode.arc_radius_tolerance_mm": ("configure",),
    "lines": ("lines", "answer"),
    "task": ("task", "await", "drill", "lines"),
    "task.command": ("task", "jog", "outputs", "interp", "tool_change"),
    "drive": ("drive", "machine"),
    "drive.motion.emit": ("configure", "spindle_sync"),
    "drive.prep.timing": ("configure",),
    "life": ("reset", "state"),
    "trust": ("drive", "homing", "place"),
    "suspend": ("suspend",),
    "clock": ("timer",),
    "overrides": ("overrides",),
    "outputs": ("laser", "outputs"),
    "run_up": ("run_up",),
    "ports": ("servo", "motor_current"),
    "motor_current": ("motor_current",),
    "motors": ("motors",),
    "edges": ("inputs", "square"),
    "inputs": ("guard", "inputs"),
    "idle_starts": ("guard",),
    "homing": ("homing", "square"),
    "probe": ("probe",),
    "spindle_sync": ("spindle_sync",),
    "notes": ("notes",),
    "client": ("sender",),
    "host": ("host", "host_motion", "preempt"),
    "park": ("park", "parking"),
    "tool_change": ("tool_change",),
    "aside": ("interp", "park"),
    "reports": ("report", "status"),
    "reports.coolant_told": ("wiring",),
    "stored": ("answer", "stored", "stored_write"),
}

# Where struct machine may be seen: its own room; who makes one; and what measures one from inside.
INSIDE = (
    "core/machine/",
    "targets/pc/",
    "targets/sim/",
    "targets/esp32/main/",
    "tests/",
    "emulators/tests/",
)
MAIN = re.compile(r"targets/\w+/(?:app/)?main\.c")  # which makes one

PLACE = r"machine->(\w+(?:(?:\.\w+)|(?:\[[^\]]*\]))*)"
WRITE = re.compile(PLACE + r"\s*(?:=(?!=)|\+\+|--|[-+|&^]=)")
HANDLE = re.compile(r"^\s*(?!const )(?:struct|enum) \w+ \*\w+ = &" + PLACE + ";")
HOUSE = "machine/parts.h"


def check_owners(root: Path) -> list[Problem]:
    """Writes by others, and looks from outside."""
    problems = []
    for path in source_files(root, ".c", ".h"):
        name = path.as_posix()
        text = (root / path).read_text()
        if name.startswith("core/machine/") and path.suffix == ".c":
            problems += _writes(path, text)
        if not name.startswith(INSIDE) and not MAIN.fullmatch(name) and HOUSE in text:
            line = text[: text.index(HOUSE)].count("\n") + 1
            problems.append(Problem(path, line, f"{HOUSE} is for core/machine: use the functions of machine/machine.h"))
    return problems


def _writes(path: Path, text: str) -> list[Problem]:
    problems = []
    for number, line in enumerate(text.splitlines(), 1):
        for match in (*WRITE.finditer(line), *filter(None, [HANDLE.match(line)])):
            member = re.sub(r"\[[^\]]*\]", "", match[1])
            owners = owners_of(member)
            if owners is not None and path.stem not in owners:
                whose = ", ".join(f"{owner}.c" for owner in owners)
                problems.append(
                    Problem(path, number, f"machine->{member} belongs to {whose}: change it by a function there")
                )
    return problems


def owners_of(member: str) -> tuple[str, ...] | None:
    """Who may write this member; None: it is no part, but something that machine_init() sets."""
    parts = member.split(".")
    for end in range(len(parts), 0, -1):
        if owners := OWNERS.get(".".join(parts[:end])):
            return owners
    return None
