"""Programs without an operating system for the virtual ESP32: LLVM's code, Debian's linker, the chip's memory map."""

from __future__ import annotations

import re
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

from wificnc.board.model import Board
from wificnc_chips.esp32.chip import Chip
from xtensa import windows
from xtensa.compile import BOTH, Kind, compile_all
from xtensa.headers import small_headers
from xtensa.toolchain import Toolchain

# The boot ROM's functions that compilers call: rom.def.
EMULATORS = Path(__file__).resolve().parents[1]
ROM_DEFINITIONS = EMULATORS / "wificnc_chips" / "espsim" / "rom.def"
FRAGMENTS = EMULATORS.parent / "targets" / "esp32" / "components" / "core" / "linker.lf"


@dataclass(frozen=True)
class Places:
    """Of a chip: memories, and registers as ESP-IDF's linker scripts name them."""

    name: str
    vectors: int  # in instruction RAM, whose rest is for code
    iram_end: int
    dram: int
    dram_size: int  # data alone: the S3's instruction RAM is the rest of it
    code: int
    constants: int  # of the S3: in another page than code, as one table maps both buses
    peripherals: dict[str, int]


ESP32_REGISTERS = {"GPIO": 0x3FF44000, "TIMERG0": 0x3FF5F000}
S3_REGISTERS = {"GPIO": 0x60004000, "TIMERG0": 0x6001F000}
PLACES = {
    Chip.ESP32: Places("esp32", 0x40080000, 0x400A0000, 0x3FFAE000, 0x50000, 0x400D0020, 0x3F400020, ESP32_REGISTERS),
    Chip.ESP32S3: Places("esp32s3", 0x403C0000, 0x403E0000, 0x3FC88000, 0x48000, 0x42000020, 0x3C100020, S3_REGISTERS),
}
VECTORS_SIZE, FLASH_SIZE = 0x400, 0x300000

LAYOUT = """ENTRY(main)
MEMORY {{
    iram (rx) : ORIGIN = {iram:#x}, LENGTH = {iram_size:#x}
    dram (rw) : ORIGIN = {dram:#x}, LENGTH = {dram_size:#x}
    code (rx) : ORIGIN = {code:#x}, LENGTH = {flash_size:#x}
    constants (r) : ORIGIN = {constants:#x}, LENGTH = {flash_size:#x}
}}
SECTIONS {{
    .iram : SUBALIGN(4) {{
        {in_iram}
    }} > iram
    .text : SUBALIGN(4) {{ *(.literal .literal.* .text .text.*) }} > code
    .data : {{
        *(.data .data.* .dram1 .dram1.*)
        {in_dram}
    }} > dram
    .rodata : {{ *(.rodata .rodata.*) }} > constants
    .bss (NOLOAD) : {{ *(.bss .bss.* COMMON .noinit .noinit.*) }} > dram
}}
{symbols}
"""


def rom_functions(chip: Chip) -> dict[str, int]:
    """Name -> address."""
    found = {"__nedf2": 0x400636A8} if chip == Chip.ESP32 else {}  # the same as __eqdf2
    for line in ROM_DEFINITIONS.read_text().splitlines():
        if line.startswith("ROM("):
            name, *addresses = line[4:].split(",")[:3]
            if (address := int(addresses[chip], 16)) != 0:
                found[name] = address
    if "ets_delay_us" in found:
        found["esp_rom_delay_us"] = found["ets_delay_us"]  # ESP-IDF's name
    return found


def in_ram(texts: Iterable[Path], own: Path) -> list[str]:
    """Objects whose code and constants lie in RAM: those with a function marked for it, those that the firmware's
    linker.lf names, and the program's own, which stands for tasks and FreeRTOS. All of an object goes there, as LLVM
    gives an object's functions one section of literals, which must be near."""
    named = {
        found[1] for found in re.finditer(r"^    (\w+)(?::\w+)? \(noflash\)$", FRAGMENTS.read_text(), re.MULTILINE)
    }
    return [
        windows.object_name(path)
        for path in texts
        if ".iram1" in path.read_text()
        or own in path.parents
        or ("core" in path.parts and path.stem.split(".")[0] in named)
    ]


def layout(chip: Chip, in_iram: Sequence[str]) -> str:
    """The linker script. @param in_iram  objects that lie in RAM"""
    at = PLACES[chip]
    names = [f"PROVIDE({name} = {address:#x});" for name, address in rom_functions(chip).items()]
    names += [f"{name} = {address:#x};" for name, address in at.peripherals.items()]
    literals, code = ".literal .literal.* *.literal", ".text .text.* .iram1 .iram1.*"
    lines = [f"*/{name}({sections})" for sections in (literals, code) for name in in_iram]
    iram = at.vectors + VECTORS_SIZE
    return LAYOUT.format(
        iram=iram,
        iram_size=at.iram_end - iram,
        dram=at.dram,
        dram_size=at.dram_size,
        code=at.code,
        constants=at.constants,
        flash_size=FLASH_SIZE,
        symbols="\n".join(names),
        in_iram="\n        ".join(lines),
        in_dram="\n        ".join(f"*/{name}(.rodata .rodata.*)" for name in in_iram),
    )


def build(
    tools: Toolchain,
    root: Path,
    chip: Chip,
    sources: Sequence[Path],
    own: Sequence[Path],
    output: Path,
    board: Board | None = None,
) -> Path:
    """An ELF file whose entry is main(). Raises RuntimeError with what a tool said.
    @param sources  of the firmware: their objects stay in its own folder, so that other tests have them, too
    @param own  of the program; they see headers next to them
    @param board  None: that of the chip's tests"""
    name = PLACES[chip].name
    firmware = root / "build" / "xtensa" / "small" / (name if board is None else f"{name}-{board.id}")
    twin = firmware.with_name("esp32") if chip != Chip.ESP32 or board is not None else None
    plain = small_headers(root, name, firmware, board)
    c_files = [path for path in sources if path.suffix == ".c"]
    # The folder of a chip has what other tests need, too.
    kinds: tuple[Kind, ...] = BOTH if board is None else ("asm",)
    texts = windows.texts(compile_all(tools, root, plain, c_files, firmware, twin, kinds=kinds))
    near = replace(plain, system=(own[0].parent, *plain.system))
    texts += windows.texts(compile_all(tools, root, near, own, output, kinds=("asm",)))
    texts += [path for path in sources if path.suffix == ".S"]
    return windows.link(tools, texts, output, layout(chip, in_ram(texts, output)))
