"""The direction of #include is the direction of the data (docs/ARCHITECTURE.md).

A room of the core may include itself and the rooms listed next to its name below, and nothing else; a target may
include the core, itself and the targets listed next to its name.
"""

from __future__ import annotations

import re
from pathlib import Path

from lint.problem import Problem, source_files

# room -> what its files may include besides their own room, core/config.h and base/
ALLOWED: dict[str, tuple[str, ...]] = {
    "access": (),
    "base": (),
    "input": (),
    "wire": (),
    "channels": (),
    "device": (),
    "gcode": (),
    "motion": ("segment", "hal/core_sizes.h"),
    "segment": (),
    "step": ("segment", "hal"),
    "hal": (),
    "spindle": ("hal",),
    "drivers": ("hal",),
    "settings": ("gcode/status.h", "hal"),
    "machine": ("input", "gcode", "motion", "segment", "step", "hal", "settings", "spindle", "drivers"),
    "session": ("access", "wire", "channels", "device", "machine", "segment", "settings", "gcode/status.h", "hal"),
}

# target -> other targets that it may include, besides itself and the core. A header that several targets have is found
# by include path: each supplies its own. A target that is not here may include no other one.
TARGETS: dict[str, tuple[str, ...]] = {
    "chip": (),
    "net": (),
    "esp32": ("chip", "net"),
    "pic32mz": ("chip",),
    "pc": ("chip", "net"),
    "sim": ("pc",),
}

# What linuxcnc/ may include of the core.
COMPONENT = (
    "access/key.h",
    "base/version.h",
    "wire/bytes.h",
    "wire/packet.h",
    "wire/seal.h",
    "wire/wire_gen.h",
)

# The hot tier of the HAL: in targets/<target>/hal/, found by include path.
HOT_HAL = ("hal/hal_step.h", "hal/core_sizes.h")

FORBIDDEN_SYSTEM = {
    "stdio.h": "the core prints nothing by itself",
    "stdlib.h": "the core does not allocate",
    "malloc.h": "the core does not allocate",
    "time.h": "the core asks the HAL for time",
    "unistd.h": "the core knows no operating system",
    "pthread.h": "the core knows no operating system",
    "errno.h": "the core knows no operating system",
}

FORBIDDEN_CALLS = re.compile(r"\b(malloc|calloc|realloc|free|printf|abort|exit)\s*\(")
INCLUDE = re.compile(r'^\s*#\s*include\s*(?:"([^"]+)"|<([^>]+)>)')


def check_includes(root: Path) -> list[Problem]:
    """Every include of the core and of targets against the tables above."""
    problems = []
    for path in source_files(root, ".c", ".h", ".def"):
        if path.parts[0] == "core" and len(path.parts) > 2:
            problems += _check_file(root, path)
        elif path.parts[0] == "targets" and "test" not in path.parts:
            problems += _check_target(root, path)
        elif path.parts[0] == "linuxcnc":
            problems += _check_component(root, path)
    return problems


def _check_component(root: Path, path: Path) -> list[Problem]:
    """The LinuxCNC component becomes one file: its own folder, and what COMPONENT says of the core."""
    problems = []
    for number, line in enumerate((root / path).read_text().splitlines(), 1):
        match = INCLUDE.match(line)
        if match and match[1] and match[1] not in COMPONENT and not (root / path.parent / match[1]).is_file():
            allowed = ", ".join(COMPONENT)
            message = f'"{match[1]}" is not in linuxcnc/, and of the core it may include: {allowed}'
            problems.append(Problem(path, number, message))
    return problems


def _check_target(root: Path, path: Path) -> list[Problem]:
    """Headers that are neither its own nor the core's, and those of a target that it may not include."""
    target = path.parts[1]
    allowed = TARGETS.get(target, ())
    problems = []
    for number, line in enumerate((root / path).read_text().splitlines(), 1):
        match = INCLUDE.match(line)
        if not match or not match[1] or _is_file_of(root, path.parent, f"targets/{target}", "core", name=match[1]):
            continue
        others = [other for other in TARGETS if _is_file_of(root, f"targets/{other}", name=match[1])]
        if len(others) == 1 and others[0] not in allowed:
            rooms = ", ".join(("core", target, *allowed))
            message = f'targets/{target} may not include "{match[1]}" of {others[0]}; it may include: {rooms}'
            problems.append(Problem(path, number, message))
    return problems


def _is_file_of(root: Path, *folders: Path | str, name: str) -> bool:
    return any((root / folder / name).is_file() for folder in folders)


def _check_file(root: Path, path: Path) -> list[Problem]:
    room = path.parts[1]
    if room not in ALLOWED:
        return [Problem(path, 1, f"core/{room} is no known room: give it a line in tools/lint/includes.py")]
    problems = []
    for number, line in enumerate((root / path).read_text().splitlines(), 1):
        if match := INCLUDE.match(line):
            message = _own(root, room, match[1]) if match[1] else _system(match[2])
        elif match := FORBIDDEN_CALLS.search(line.split("/*")[0]):
            message = f"{match[1]}() has no place in the core" if not line.lstrip().startswith("*") else ""
        else:
            continue
        if message:
            problems.append(Problem(path, number, message))
    return problems


def _own(root: Path, room: str, name: str) -> str:
    """Why this room may not include this header, or nothing."""
    target = name.split("/")[0]
    if name == "config.h" or target in (room, "base"):
        return (
            ""
            if name in HOT_HAL or (root / "core" / name).is_file()
            else f'"{name}" is not in core/: write it as room/file.h'
        )
    if name in ALLOWED[room] or target in ALLOWED[room]:
        return ""
    if target not in ALLOWED:
        return f"\"{name}\" is not the core's: a target's header may only be reached by the names of core/hal/README.md"
    allowed = ", ".join(("base", *ALLOWED[room]))
    return f'core/{room} may not include "{name}"; it may include: {room}, {allowed}'


def _system(name: str) -> str:
    reason = FORBIDDEN_SYSTEM.get(name)
    return f"<{name}> is not for the core: {reason}" if reason else ""
