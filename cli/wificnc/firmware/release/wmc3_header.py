"""The binary protocol for a host in C: one file to copy, with nothing of the controller's."""

from __future__ import annotations

import re
from pathlib import Path

DECLARATIONS = ("core/wire/wire_gen.h", "core/wire/packet.h")
DEFINITIONS = ("core/wire/bytes.h", "core/wire/wire_gen.c", "core/wire/packet.c")
OWN_INCLUDE = re.compile(r'^#include "[^"]+"\n', re.MULTILINE)

HEAD = """\
/* SPDX-License-Identifier: MIT
 * WiFiCNC {version}: the binary protocol of network hosts, in one file. docs/protocol.md says what it all means.
 *
 * Include it where it is needed; in one C file of a program write before it:
 *     #define WIFICNC_PROTOCOL_IMPLEMENTATION */
"""


def protocol_header(root: Path, version: str) -> str:
    """Declarations, and behind a macro the definitions."""
    parts = [HEAD.format(version=version), *(_text(root / name) for name in DECLARATIONS)]
    parts += ["#if defined WIFICNC_PROTOCOL_IMPLEMENTATION && !defined WIFICNC_PROTOCOL_IMPLEMENTED\n"]
    parts += ["#define WIFICNC_PROTOCOL_IMPLEMENTED\n", *(_text(root / name) for name in DEFINITIONS), "#endif\n"]
    return "\n".join(parts)


def _text(path: Path) -> str:
    """Without includes of ours: all of it is here."""
    return OWN_INCLUDE.sub("", path.read_text(encoding="utf-8"))
