"""Python's copy of the C structures is laid out as C's: a missing field is whatever lies behind it in memory."""

from __future__ import annotations

import re
import subprocess
from ctypes import Structure, sizeof
from pathlib import Path

import pytest
from wificnc.build.host import build_program
from wificnc.sim.native import HostBoard, HostCounters

HEADER = Path(__file__).resolve().parents[2] / "targets" / "pc" / "host.h"


def c_fields(name: str) -> list[str]:
    """As the header declares them."""
    body = re.search(rf"struct {name} {{(.*?)\n}};", HEADER.read_text(encoding="utf-8"), re.DOTALL)
    assert body
    text = re.sub(r"/\*.*?\*/", "", body[1], flags=re.DOTALL)
    return [word for line in text.split(";") for word in re.findall(r"(\w+)\s*(?:,|$)", line.strip())]


@pytest.mark.parametrize(("ours", "name"), [(HostBoard, "host_board"), (HostCounters, "host_counters")])
def test_a_structure_is_laid_out_as_in_c(tmp_path: Path, ours: type[Structure], name: str) -> None:
    fields = [field[0] for field in ours._fields_]
    assert fields == c_fields(name)
    values = [f"sizeof(struct {name})", *(f"offsetof(struct {name}, {field})" for field in fields)]
    prints = "".join(f'    printf("%zu ", {value});\n' for value in values)
    source = tmp_path / "layout.c"
    source.write_text(
        f'#include "host.h"\n#include <stddef.h>\n#include <stdio.h>\nint main(void) {{\n{prints}    return 0;\n}}\n'
    )
    program = build_program([source], tmp_path / "layout")
    said = subprocess.run([str(program)], capture_output=True, text=True, check=True).stdout
    assert [int(word) for word in said.split()] == [sizeof(ours), *(getattr(ours, field).offset for field in fields)]
