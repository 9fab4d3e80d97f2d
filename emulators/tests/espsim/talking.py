"""An application of ESP-IDF's form that answers at UART 0 and moves: our core, without ESP-IDF. For `--on-chip`."""

from __future__ import annotations

import hashlib
import json
import struct
from pathlib import Path

import images
from wificnc.board.model import Board
from wificnc.build.image import elf_symbols
from wificnc_chips.esp32.chip import Chip
from xtensa.toolchain import Toolchain
from xtensa_programs import bare
from xtensa_programs import code as c
from xtensa_programs.program import BARE, BOARDS, LEVEL5_VECTOR, REAL, ROOT, SHIFTED, USER_VECTOR, timer_handler

TALK = BARE.with_name("talk")
LITERALS, START = 0x378, 0x380  # behind the vectors
RTC_SLOW = 0x50000000  # where the description lies
FLASH_DATA = {Chip.ESP32: (0x3F400000, 0x3FF80000), Chip.ESP32S3: (0x3C000000, 0x3E000000)}
FLASH_CODE = {Chip.ESP32: 0x400D0000, Chip.ESP32S3: 0x42000000}
CALLX8_A8 = c.wide(0, 14, 8)
PT_LOAD = 1


def build(tools: Toolchain, board: Board | None = None, kind: Chip = Chip.ESP32) -> Path:
    """The ELF file. @param board  None: that of BOARDS"""
    real = (*REAL, *SHIFTED) if board is not None and board.step.engine == "i2s" else REAL
    sources = [*sorted((ROOT / "core").rglob("*.c")), *(ROOT / name for name in real)]
    own = [*(path for path in sorted(BARE.glob("*.c")) if path.name != "main.c"), TALK / "main.c"]
    output = ROOT / "build" / "espsim" / (f"talk-{BOARDS[kind]}" if board is None else f"talk-{board.id}")
    return bare.build(tools, ROOT, kind, sources, own, output, board)


def application(elf: bytes, project: bytes = b"wificnc", kind: Chip = Chip.ESP32) -> bytes:
    """What esptool would make of it; vectors and start are by hand."""
    place = bare.PLACES[kind].vectors
    pieces = [(RTC_SLOW, description(project, hashlib.sha256(elf).digest()))]
    pieces.append((place, vectors(elf_symbols(elf), place)))
    at = 24 + sum(8 + len(data) for _, data in pieces)
    first, end = FLASH_DATA[kind]
    for address, data in segments(elf):
        piece = (address, data + bytes(-len(data) % 4))
        more = images.mapped(piece, at) if first <= address < end or address >= FLASH_CODE[kind] else [piece]
        pieces += more
        at += sum(8 + len(data) for _, data in more)
    return images.image(place + START, pieces, chip=images.CHIP_IDS[kind])


def description(project: bytes, elf_hash: bytes) -> bytes:
    """esp_app_desc_t."""
    return struct.pack("<I12x32s32s16s16s32s32s80x", 0xABCD5432, b"test", project, b"", b"", b"", elf_hash)


def vectors(symbols: dict[str, int], place: int) -> bytes:
    """Exceptions, level 5, and the start: a function that the boot ROM calls."""
    code = bytearray(START + 0x40)
    step = c.wsr(0, c.EXCSAVE1 + 4) + c.call0(place + LEVEL5_VECTOR + 3, symbols["xt_highint5"])
    start = place + START
    begin = c.entry(1, 64)
    begin += c.l32r(2, start + len(begin), place + LITERALS) + c.wsr(2, c.VECBASE) + c.RSYNC
    begin += c.movi(2, 1) + c.wsr(2, c.CPENABLE) + c.RSYNC
    begin += c.l32r(8, start + len(begin), place + LITERALS + 4) + CALLX8_A8
    literals = struct.pack("<2I", place, symbols["main"])
    places = ((0, c.window_vectors()), (LEVEL5_VECTOR, step), (USER_VECTOR, timer_handler()), (LITERALS, literals))
    for at, part in (*places, (START, begin)):
        code[at : at + len(part)] = part
    return bytes(code)


def segments(elf: bytes) -> list[tuple[int, bytes]]:
    """What is loaded, by address."""
    headers, size, count = struct.unpack_from("<I", elf, 28)[0], *struct.unpack_from("<2H", elf, 42)
    rows = [struct.unpack_from("<5I", elf, headers + index * size) for index in range(count)]
    return sorted((address, elf[at : at + n]) for kind, at, address, _, n in rows if kind == PT_LOAD and n)


def make_folder(folder: Path, elf: bytes, app: bytes, board: str | None = None, kind: Chip = Chip.ESP32) -> Path:
    """As `wificnc build` leaves it. @param board  None: that of BOARDS"""
    merged = images.merged(kind, app)
    code = images.BOOTLOADER_CODE[kind]
    files = {
        "firmware.bin": app,
        "firmware.elf": elf,
        "bootloader.bin": images.image(code, [(code, bytes(64))], chip=images.CHIP_IDS[kind]),
        "partitions.bin": merged[images.TABLE_AT : images.TABLE_AT + len(images.table())],
    }
    folder.mkdir(parents=True, exist_ok=True)
    for name, data in files.items():
        (folder / name).write_bytes(data)
    rows = [
        {"name": name, "size": len(data), "sha256": hashlib.sha256(data).hexdigest()} for name, data in files.items()
    ]
    (folder / "build.json").write_text(json.dumps({"board": board or BOARDS[kind], "artefacts": rows}))
    return folder
