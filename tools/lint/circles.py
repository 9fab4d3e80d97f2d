"""Rooms of the core that call each other in a circle: what one of them does can be understood only with all of them.
And files of the core that no firmware calls.

A room is a file with its header, so a function that the header defines inline calls for its room. Read from the text: a
room calls those whose functions it names.
"""

from __future__ import annotations

import re
from pathlib import Path

import networkx

from lint.callers import blanked
from lint.problem import Problem, source_files

# The largest circle of a folder: the shape of command (docs/ARCHITECTURE.md) takes that of core/machine apart.
LARGEST = {Path("core/machine"): 21, Path("core/gcode"): 11, Path("core/motion"): 5}
LARGEST_ELSEWHERE = 2
FIRMWARE = ("targets/chip/", "targets/net/", "targets/esp32/", "targets/pic32mz/")
WORD = re.compile(r"\w+")
PROTOTYPE = re.compile(r"^[A-Za-z_][\w \t*]*?\b\w+\([^;{}]*\)[\w\s()]*;", re.MULTILINE)
FUNCTION = re.compile(
    r"^(?!static (?!inline)|else|typedef)[A-Za-z_][\w \t*]*?\b(?P<name>\w+)\([^;{}]*\)\s*\{", re.MULTILINE
)
COMPILED_ONLY = Path("core/hal/contract")  # checks signatures

Rooms = dict[Path, str]


def check_circles(root: Path) -> list[Problem]:
    """Circles of more rooms than their folder may have."""
    circles = sorted(sorted(circle) for circle in networkx.strongly_connected_components(_calls(_rooms(root))))
    return [
        Problem(circle[0], 1, f"these {len(circle)} files call each other in a circle: {', '.join(map(str, circle))}")
        for circle in circles
        if len(circle) > LARGEST.get(circle[0].parent, LARGEST_ELSEWHERE)
    ]


def check_firmware(root: Path) -> list[Problem]:
    """Files of the core that no firmware gets to, by what its own files name."""
    rooms = _rooms(root)
    calls = _calls(rooms)
    sources = [path for path in source_files(root, ".c", ".h", ".S") if str(path).startswith(FIRMWARE)]
    words = {word for path in sources for word in WORD.findall((root / path).read_text())}
    reached = {room for name, room in _homes(rooms).items() if name in words}
    for room in list(reached):
        reached |= networkx.descendants(calls, room)
    idle = sorted(set(_homes(rooms).values()) - reached - {COMPILED_ONLY})
    return [
        Problem(room.with_suffix(".c"), 1, "no firmware calls this file: it belongs to targets/pc or targets/sim")
        for room in idle
    ]


def _rooms(root: Path) -> Rooms:
    """Of the core, by name without a suffix: header and source, without prototypes."""
    rooms: Rooms = {}
    for path in source_files(root, ".c", ".h"):
        if path.parts[0] == "core":
            text = PROTOTYPE.sub("", blanked((root / path).read_text()))
            rooms[path.with_suffix("")] = rooms.get(path.with_suffix(""), "") + text
    return rooms


def _homes(rooms: Rooms) -> dict[str, Path]:
    """The room of each function that others can call."""
    return {match["name"]: room for room, text in rooms.items() for match in FUNCTION.finditer(text)}


def _calls(rooms: Rooms) -> networkx.DiGraph[Path]:
    """Which room calls which."""
    home = _homes(rooms)
    calls: networkx.DiGraph[Path] = networkx.DiGraph()
    calls.add_nodes_from(rooms)
    for room, text in rooms.items():
        calls.add_edges_from((room, home[name]) for name in set(WORD.findall(text)) if home.get(name, room) != room)
    return calls
