"""The boot ROM's code.c as bytes of the processor, into code.h: `python -m xtensa_programs.romcode`, in tools/."""

from __future__ import annotations

import subprocess
import tempfile
from pathlib import Path

from xtensa import windows
from xtensa.compile import compile_all
from xtensa.headers import small_headers
from xtensa.toolchain import find_toolchain

ROOT = Path(__file__).resolve().parents[2]
SOURCE = Path(__file__).parents[1] / "wificnc_chips" / "espsim" / "romcode" / "code.c"
OUTPUT = SOURCE.with_name("code.h")
PLACE, WIDTH = 0x4006F000, 16
LAYOUT = """ENTRY(rom_qsort)
SECTIONS {{
    .text {place:#x} : SUBALIGN(4) {{ *(.literal .literal.* *.literal) *(.text .text.*) }}
}}
"""
HEAD = """/* SPDX-License-Identifier: MIT
 * Made by xtensa_programs/romcode.py out of code.c: do not edit. */
"""


def build(output: Path) -> Path:
    """The program. Raises RuntimeError with what a tool said."""
    tools = find_toolchain()
    headers = small_headers(ROOT, "esp32", output / "headers")
    texts = windows.texts(compile_all(tools, ROOT, headers, [SOURCE], output))
    return windows.link(tools, texts, output, LAYOUT.format(place=PLACE))


def run(command: list[str]) -> str:
    return subprocess.run(command, check=True, capture_output=True, text=True).stdout


def header(program: Path) -> str:
    """Addresses of the functions, and all bytes."""
    names = [line.split() for line in run(["xtensa-lx106-elf-nm", "-n", str(program)]).splitlines()]
    places = [f"#define {name.upper():<12} 0x{address}u\n" for address, kind, name in names if kind == "T"]
    raw = program.with_suffix(".bin")
    run(["xtensa-lx106-elf-objcopy", "-O", "binary", "-j", ".text", str(program), str(raw)])
    code = raw.read_bytes()
    rows = [code[at : at + WIDTH] for at in range(0, len(code), WIDTH)]
    lines = ",\n".join("    " + ", ".join(f"0x{byte:02x}" for byte in row) for row in rows)
    return f"{HEAD}{''.join(places)}\n/* clang-format off */\nstatic const unsigned char rom_code[] = {{\n{lines}}};\n"


if __name__ == "__main__":
    with tempfile.TemporaryDirectory() as folder:
        OUTPUT.write_text(header(build(Path(folder))), encoding="utf-8")
