"""The component as one C file, as halcompile wants it: linuxcnc/*.c, and what they include of the core. Reads only."""

from __future__ import annotations

import re
from collections.abc import Iterator
from pathlib import Path

from wificnc import __version__
from wificnc.errors import BuildError

PROGRAM = "wificnc-hal"  # `wificnc` is the command
FILE_NAME = f"{PROGRAM}.c"  # halcompile calls the program as its file
LINKED = "--extra-link-args=-lm"  # halcompile links nothing but HAL by itself
FOLDERS = ("linuxcnc", "core")  # where a name in quotes is looked for, behind the folder of who includes it
INCLUDE = re.compile(r'\s*#\s*include\s*"([^"]+)"')
BLANKS = re.compile(r"\n{3,}")
FEATURE = re.compile(r"\s*#\s*define\s+_\w+_SOURCE\b")  # such a macro must come before every header of the system
LICENCE_LINE = re.compile(r"/\* SPDX-License-Identifier: \S+(?: \*/\n|\n \*)")  # the head's only line, or its first

TITLE = "LinuxCNC's HAL component for WiFiCNC"

HEAD = """\
/* SPDX-License-Identifier: MIT
 * {title} {version}. docs/linuxcnc.md has its pins.
 *
 *     sudo {command}
 *
 * `wificnc linuxcnc component` made this file; a comment names the source of each part.
 *
{licence} */
"""


def component_source(root: Path) -> str:
    """The file's text; the same for the same files. @param root  of the tree that has core/ and linuxcnc/

    Raises:
        BuildError: linuxcnc/ is not there, or includes a file in quotes that is not.
    """
    licence = "".join(f" * {line}".rstrip() + "\n" for line in (root / "LICENSE").read_text("utf-8").splitlines())
    command = " ".join(build_command("install", FILE_NAME))
    head = HEAD.format(title=TITLE, version=__version__, command=command, licence=licence)
    done: set[Path] = set()
    lines = [line for path in _sources(root) for line in _inlined(root, path, done)]
    features = dict.fromkeys(line for line in lines if FEATURE.match(line))
    rest = [line for line in lines if line not in features]
    return head + BLANKS.sub("\n\n", "\n".join([*features, *rest, ""]))


def build_command(how: str, file: str, *more: str) -> list[str]:
    """@param how  install, which root does where LinuxCNC is a package of the system; or compile, next to the file"""
    return ["halcompile", f"--{how}", "--userspace", LINKED, *more, file]


def is_component(text: bytes) -> bool:
    """Whether a file is one of ours, of whatever version."""
    return TITLE.encode() in b"".join(text.splitlines(keepends=True)[:2])


def _sources(root: Path) -> list[Path]:
    """The component's C files, behind those of each header that they reach: x.c defines what x.h declares."""
    waiting = sorted((root / "linuxcnc").glob("*.c"))
    if not waiting:
        raise BuildError(f"the component's C files are missing in {root / 'linuxcnc'}", hint="install wificnc again")
    found: set[Path] = set()
    while waiting:
        path = waiting.pop()
        if path not in found:
            found.add(path)
            headers = [_find(root, path, name) for name in INCLUDE.findall(path.read_text("utf-8"))]
            waiting += headers + [twin for header in headers if (twin := header.with_suffix(".c")).is_file()]
    return sorted(path for path in found if path.suffix == ".c")


def _inlined(root: Path, path: Path, done: set[Path]) -> Iterator[str]:
    """Lines of a file. Headers take their include's place, once; what is not a header (a table) each time."""
    name = path.relative_to(root).as_posix()
    behind = ""
    yield from ("", f"/* ---- {name} ---- */")
    for line in LICENCE_LINE.sub(_head_of, path.read_text("utf-8"), count=1).splitlines():
        include = INCLUDE.match(line)
        if not include:
            if behind and line.strip():
                yield from ("", behind, "")
                behind = ""
            yield line
            continue
        wanted = _find(root, path, include[1])
        if wanted not in done:
            if wanted.suffix == ".h":
                done.add(wanted)
            yield from _inlined(root, wanted, done)
            behind = f"/* ---- {name} ---- */"


def _head_of(licence: re.Match[str]) -> str:
    """What is left of a head without its licence: the begin of what it says."""
    return "" if licence[0].endswith("*/\n") else "/*"


def _find(root: Path, path: Path, name: str) -> Path:
    """The file that an include in `path` means. Raises BuildError."""
    for folder in (path.parent, *(root / each for each in FOLDERS)):
        if (folder / name).is_file():
            return folder / name
    where = path.relative_to(root).as_posix()
    raise BuildError(f'{where} includes "{name}", which is missing', hint="#include <...> is for the system's headers")
