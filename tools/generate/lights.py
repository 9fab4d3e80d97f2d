"""The table of the status light in docs/esp32.md, from targets/net/net_light.def."""

from __future__ import annotations

import re
from dataclasses import dataclass
from pathlib import Path

from generate.files import with_region

SOURCE = "targets/net/net_light.def"
OUTPUT = "docs/esp32.md"
ROW = re.compile(r'^LIGHT\(([A-Z_]+),\s*([A-Z]+),\s*(\d+),\s*(\d+),\s*(\d+),\s*(\d+),\s*"([^"]*)"\)$', re.MULTILINE)


@dataclass(frozen=True)
class Light:
    """A row of net_light.def."""

    name: str
    colour: str
    blink: tuple[int, int]  # ms on, off
    plain: tuple[int, int]
    text: str


def read_lights(table: str) -> list[Light]:
    """Every row. Raises ValueError for one that cannot be read."""
    rows = [
        Light(name, colour.lower(), (int(on), int(off)), (int(plain_on), int(plain_off)), text)
        for name, colour, on, off, plain_on, plain_off, text in ROW.findall(table)
    ]
    if not rows or len(rows) != len(re.findall(r"^LIGHT\(", table, re.MULTILINE)):
        raise ValueError(f"{SOURCE} has rows that cannot be read, or none")
    return rows


def words(on_ms: int, off_ms: int) -> str:
    """`0.5 s on, 0.5 s off`."""
    if off_ms == 0:
        return "on"
    return f"{on_ms / 1000:g} s on, {off_ms / 1000:g} s off" if on_ms else "off"


def texts(root: Path) -> dict[str, str]:
    lights = read_lights((root / SOURCE).read_text(encoding="utf-8"))
    head = "| | WS2812 | plain LED |\n|---|---|---|\n"
    rows = [f"| {one.text} | {one.colour}: {words(*one.blink)} | {words(*one.plain)} |\n" for one in lights]
    page = (root / OUTPUT).read_text(encoding="utf-8")
    return {OUTPUT: with_region(page, "status light", head + "".join(rows))}
