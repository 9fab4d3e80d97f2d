"""An application of ESP-IDF's form that answers at UART 0 and moves: our core, without ESP-IDF. For `--on-chip`."""

from __future__ import annotations

import hashlib
import json
import struct
from pathlib import Path

import images
from espsim import bare
from espsim import code as c
from espsim.program import BARE, LEVEL5_VECTOR, REAL, ROOT, SHIFTED, USER_VECTOR, timer_handler
from wificnc.board.model import Board
from wificnc.chip.espsim import Chip
from wificnc.chip.image import elf_symbols
from xtensa.toolchain import Toolchain

TALK = ROOT / "tests" / "espsim" / "talk"
VECTORS = bare.PLACES[Chip.ESP32].vectors
LITERALS, START = 0x378, 0x380  # behind the vectors
RTC_SLOW = 0x50000000  # where the description lies
FLASH_DATA, RAM, FLASH_CODE = 0x3F400000, 0x3FF80000, 0x400D0000
CALLX8_A8 = c.wide(0, 14, 8)
PT_LOAD = 1


def build(tools: Toolchain, board: Board | None = None) -> Path:
    """The ELF file. @param board  None: esp32-wroom32"""
    real = (*REAL, *SHIFTED) if board is not None and board.step.engine == "i2s" else REAL
    sources = [*sorted((ROOT / "core").rglob("*.c")), *(ROOT / name for name in real)]
    own = [*(path for path in sorted(BARE.glob("*.c")) if path.name != "main.c"), TALK / "main.c"]
    output = ROOT / "build" / "espsim" / ("talk" if board is None else f"talk-{board.id}")
    return bare.build(tools, ROOT, Chip.ESP32, sources, own, output, board)


def application(elf: bytes, project: bytes = b"wificnc") -> bytes:
    """What esptool would make of it; vectors and start are by hand."""
    pieces = [(RTC_SLOW, description(project, hashlib.sha256(elf).digest()))]
    pieces.append((VECTORS, vectors(elf_symbols(elf))))
    at = 24 + sum(8 + len(data) for _, data in pieces)
    for address, data in segments(elf):
        piece = (address, data + bytes(-len(data) % 4))
        more = images.mapped(piece, at) if FLASH_DATA <= address < RAM or address >= FLASH_CODE else [piece]
        pieces += more
        at += sum(8 + len(data) for _, data in more)
    return images.image(VECTORS + START, pieces)


def description(project: bytes, elf_hash: bytes) -> bytes:
    """esp_app_desc_t."""
    return struct.pack("<I12x32s32s16s16s32s32s80x", 0xABCD5432, b"test", project, b"", b"", b"", elf_hash)


def vectors(symbols: dict[str, int]) -> bytes:
    """Exceptions, level 5, and the start: a function that the boot ROM calls."""
    code = bytearray(START + 0x40)
    step = c.wsr(0, c.EXCSAVE1 + 4) + c.call0(VECTORS + LEVEL5_VECTOR + 3, symbols["xt_highint5"])
    start = VECTORS + START
    begin = c.entry(1, 64)
    begin += c.l32r(2, start + len(begin), VECTORS + LITERALS) + c.wsr(2, c.VECBASE) + c.RSYNC
    begin += c.movi(2, 1) + c.wsr(2, c.CPENABLE) + c.RSYNC
    begin += c.l32r(8, start + len(begin), VECTORS + LITERALS + 4) + CALLX8_A8
    literals = struct.pack("<2I", VECTORS, symbols["main"])
    places = ((0, c.window_vectors()), (LEVEL5_VECTOR, step), (USER_VECTOR, timer_handler()), (LITERALS, literals))
    for at, part in (*places, (START, begin)):
        code[at : at + len(part)] = part
    return bytes(code)


def segments(elf: bytes) -> list[tuple[int, bytes]]:
    """What is loaded, by address."""
    headers, size, count = struct.unpack_from("<I", elf, 28)[0], *struct.unpack_from("<2H", elf, 42)
    rows = [struct.unpack_from("<5I", elf, headers + index * size) for index in range(count)]
    return sorted((address, elf[at : at + n]) for kind, at, address, _, n in rows if kind == PT_LOAD and n)


def make_folder(folder: Path, elf: bytes, app: bytes, board: str = "esp32-wroom32") -> Path:
    """As `wificnc build` leaves it."""
    merged = images.merged(0, app)
    code = images.BOOTLOADER_CODE[0]
    files = {
        "firmware.bin": app,
        "firmware.elf": elf,
        "bootloader.bin": images.image(code, [(code, bytes(64))]),
        "partitions.bin": merged[images.TABLE_AT : images.TABLE_AT + len(images.table())],
    }
    folder.mkdir(parents=True, exist_ok=True)
    for name, data in files.items():
        (folder / name).write_bytes(data)
    rows = [
        {"name": name, "size": len(data), "sha256": hashlib.sha256(data).hexdigest()} for name, data in files.items()
    ]
    (folder / "build.json").write_text(json.dumps({"board": board, "artefacts": rows}))
    return folder
