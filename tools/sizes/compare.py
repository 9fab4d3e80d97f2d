"""Sizes as JSON: {"BOARD by BUILDER": {"image": bytes, "IRAM": bytes}}."""

from __future__ import annotations

import json
from collections.abc import Iterable
from pathlib import Path

from wificnc.build.esp32_size import firmware_sizes
from wificnc.errors import BuildError

GROWTH_MAX = 0.05

Sizes = dict[str, dict[str, int]]


def measure(name: str, folder: Path, chip: str, slot: int) -> tuple[Sizes, list[str]]:
    """Of firmware.bin and firmware.elf in a folder. @return the sizes, and what is over its budget"""
    found = firmware_sizes(folder, chip, slot)
    over = [f"{name}: {size.name} is over its budget: {size}" for size in found if size.is_over]
    return {name: {size.name: size.used for size in found}}, over


def read(files: Iterable[Path]) -> Sizes:
    """Several files in one. Raises BuildError: a name occurs twice, or a file is none of these."""
    sizes: Sizes = {}
    for file in files:
        try:
            new = {name: {key: int(value) for key, value in row.items()}
                   for name, row in json.loads(file.read_text(encoding="utf-8")).items()}  # fmt: skip
        except (ValueError, AttributeError, TypeError) as err:
            raise BuildError(f"{file} is not a file of sizes: {err}") from err
        if twice := sizes.keys() & new.keys():
            raise BuildError(f"{file}: sizes of {', '.join(sorted(twice))} are there already")
        sizes |= new
    return sizes


def growth(before: Sizes, now: Sizes) -> tuple[list[str], list[str]]:
    """All figures as lines, and those that have grown too much. What is new, or gone, has not grown."""
    lines, grown = [], []
    for name, row in sorted(now.items()):
        for key, value in sorted(row.items()):
            old = before.get(name, {}).get(key)
            if not old:
                lines.append(f"{name}: {key} {value:,} bytes, new")
                continue
            line = f"{name}: {key} {value:,} bytes, {(value - old) / old:+.2%}"
            lines.append(line)
            if value > old * (1 + GROWTH_MAX):
                grown.append(f"{line}; more than {GROWTH_MAX:.0%} above {old:,} bytes of the last build of main")
    return lines, grown
