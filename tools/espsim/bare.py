"""Programs without an operating system for the virtual ESP32: LLVM's code, Debian's linker, the chip's memory map."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import replace
from pathlib import Path

from xtensa import windows
from xtensa.compile import compile_all
from xtensa.headers import small_headers
from xtensa.toolchain import Toolchain

# The boot ROM's functions that compilers call: rom.def.
ROM_DEFINITIONS = Path(__file__).parent / "rom.def"
VECTORS, IRAM_SIZE = 0x40080000, 0x20000

# Registers as ESP-IDF's linker scripts name them; the rest of a peripheral is not used.
PERIPHERALS = {"GPIO": 0x3FF44000, "TIMERG0": 0x3FF5F000}

LAYOUT = """ENTRY(main)
MEMORY {{
    iram (rx) : ORIGIN = 0x40080400, LENGTH = 0x1fc00
    dram (rw) : ORIGIN = 0x3ffae000, LENGTH = 0x50000
    code (rx) : ORIGIN = 0x400d0020, LENGTH = 0x32ffe0
    constants (r) : ORIGIN = 0x3f400020, LENGTH = 0x3fffe0
}}
SECTIONS {{
    .iram : SUBALIGN(4) {{
        {iram}
    }} > iram
    .text : SUBALIGN(4) {{ *(.literal .literal.* .text .text.*) }} > code
    .rodata : {{ *(.rodata .rodata.*) }} > constants
    .data : {{ *(.data .data.* .dram1 .dram1.*) }} > dram
    .bss (NOLOAD) : {{ *(.bss .bss.* COMMON .noinit .noinit.*) }} > dram
}}
{symbols}
"""


def rom_functions() -> dict[str, int]:
    """Name -> address on the ESP32."""
    found = {"__nedf2": 0x400636A8}  # the same as __eqdf2
    for line in ROM_DEFINITIONS.read_text().splitlines():
        if line.startswith("ROM("):
            name, address = line[4:].split(",")[:2]
            if int(address, 16) != 0:
                found[name] = int(address, 16)
    return found


def layout(in_iram: Iterable[str]) -> str:
    """The linker script. @param in_iram  objects with code in IRAM: all of theirs goes there, as LLVM gives an object's
    functions one section of literals, which must be near"""
    names = [f"PROVIDE({name} = {address:#x});" for name, address in rom_functions().items()]
    names += [f"{name} = {address:#x};" for name, address in PERIPHERALS.items()]
    literals, code = ".literal .literal.* *.literal", ".text .text.* .iram1 .iram1.*"
    lines = [f"*/{name}({sections})" for sections in (literals, code) for name in in_iram]
    return LAYOUT.format(symbols="\n".join(names), iram="\n        ".join(lines))


def build(tools: Toolchain, root: Path, sources: Sequence[Path], own: Sequence[Path], output: Path) -> Path:
    """An ELF file whose entry is main(). Raises RuntimeError with what a tool said.
    @param sources  of the firmware: their objects stay in its own folder, so that other tests have them, too
    @param own  of the program; they see headers next to them"""
    firmware = root / "build" / "xtensa" / "small" / "esp32"
    plain = small_headers(root, "esp32", firmware)
    texts = windows.texts(compile_all(tools, root, plain, [path for path in sources if path.suffix == ".c"], firmware))
    near = replace(plain, system=(own[0].parent, *plain.system))
    texts += windows.texts(compile_all(tools, root, near, own, output))
    texts += [path for path in sources if path.suffix == ".S"]
    in_iram = [windows.object_name(path) for path in texts if ".iram1" in path.read_text()]
    return windows.link(tools, texts, output, layout(in_iram))
