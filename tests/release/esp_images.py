"""Builds of an ESP32 board as PlatformIO leaves them: whole images, made by esptool from small ELF files.

They pass every check that esptool and a chip's loaders make of an image. They are no firmware: the code does nothing.
"""

from __future__ import annotations

import hashlib
import json
import struct
from pathlib import Path

from wificnc.build.signing import signing_key
from wificnc.firmware.flash.device import quiet_esptool

XTENSA = 94
ADDRESSES = {  # data in flash, code in RAM (the chips' technical reference manuals, memory maps)
    "esp32s3": (0x3C000020, 0x40374000),
    "esp32": (0x3F400020, 0x40080000),
}
CODE = bytes.fromhex("36410000f00000f01df0")  # entry a1, 32; nop; nop; retw.n
TABLE_ROWS = [  # name, type, subtype, offset, size, of targets/esp32/partitions.csv
    ("nvs", 1, 2, 0x9000, 0x6000),
    ("otadata", 1, 0, 0xF000, 0x2000),
    ("phy_init", 1, 1, 0x11000, 0x1000),
    ("ota_0", 0, 0x10, 0x20000, 0x1E0000),
    ("ota_1", 0, 0x11, 0x200000, 0x1E0000),
    ("coredump", 1, 3, 0x3E0000, 0x20000),
]


def elf(chip: str, project: bytes | None, size: int) -> bytes:
    """An ELF with an application's description (ESP-IDF, esp_app_desc_t) and a little code.

    @param project  None: a bootloader, which has no description. @param size  of its data, bytes
    """
    data_at, code_at = ADDRESSES[chip]
    filler = b"".join(hashlib.sha256(n.to_bytes(4, "little")).digest() for n in range(size // 32))
    rows = [(".text", 6, code_at, CODE + bytes(-len(CODE) % 4) + (filler if project is None else b""))]
    if project is not None:
        described = struct.pack("<II8x32s32s16s16s32s32s80x", 0xABCD5432, 0, b"1.0", project, b"", b"", b"v5.5.3", b"")
        point = signing_key().point + bytes(3)
        rows.insert(0, (".flash.appdesc", 2, data_at, described + point + filler))
    names = b"\0" + b"".join(name.encode() + b"\0" for name, *_ in rows) + b".shstrtab\0"
    body, headers = b"", [bytes(40)]
    for name, flags, address, data in rows:
        headers.append(_section(names.index(name.encode()), 1, flags, address, 52 + len(body), len(data)))
        body += data
    headers.append(_section(names.index(b".shstrtab"), 3, 0, 0, 52 + len(body), len(names)))
    body += names + bytes(-len(names) % 4)
    head = struct.pack(
        "<4sBBB9xHHIIIIIHHHHHH", b"\x7fELF", 1, 1, 1, 2, XTENSA, 1, code_at, 0, 52 + len(body), 0, 52, 0, 0, 40,
        len(headers), len(headers) - 1,
    )  # fmt: skip
    return head + body + b"".join(headers)


def _section(name: int, kind: int, flags: int, address: int, offset: int, size: int) -> bytes:
    return struct.pack("<10I", name, kind, flags, address, offset, size, 0, 0, 4, 0)


def image(folder: Path, name: str, chip: str, elf_file: bytes, flash_mb: int = 4) -> bytes:
    """esptool's elf2image."""
    source, output = folder / f"{name}.elf", folder / f"{name}.bin"
    source.write_bytes(elf_file)
    quiet_esptool().cmds.elf2image(
        str(source), chip, str(output), flash_freq="80m", flash_mode="dio", flash_size=f"{flash_mb}MB"
    )
    return output.read_bytes()


def partition_table(rows: list[tuple[str, int, int, int, int]] = TABLE_ROWS) -> bytes:
    """As ESP-IDF's gen_esp32part.py writes it: rows of 32 bytes, an MD5 of them, blank to 3 KB."""
    packed = b"".join(
        struct.pack("<HBBII16sI", 0x50AA, kind, subtype, offset, size, name.encode(), 0)
        for name, kind, subtype, offset, size in rows
    )
    md5 = b"\xeb\xeb" + b"\xff" * 14 + hashlib.md5(packed).digest()
    return (packed + md5).ljust(0xC00, b"\xff")


def make_build(
    folder: Path,
    board: str,
    chip: str,
    revision: str,
    *,
    flash_mb: int = 4,
    project: bytes = b"wificnc",
    size: int = 60_000,
) -> Path:
    """What `wificnc build` leaves in build/BOARD."""
    folder.mkdir(parents=True, exist_ok=True)
    app = elf(chip, project, size)
    image(folder, "firmware", chip, app, flash_mb)
    image(folder, "bootloader", chip, elf(chip, None, 8000), flash_mb)
    (folder / "bootloader.elf").unlink()
    (folder / "partitions.bin").write_bytes(partition_table())
    write_record(folder, board, revision)
    return folder


def write_record(folder: Path, board: str, revision: str) -> None:
    """build.json of what is there now, and its signature."""
    if (folder / "firmware.bin").exists():
        (folder / "firmware.sig").write_bytes(signing_key().sign((folder / "firmware.bin").read_bytes()) or b"")
    names = [
        name
        for name in ("firmware.bin", "firmware.elf", "bootloader.bin", "partitions.bin", "firmware.sig")
        if (folder / name).exists()
    ]
    rows = [
        {
            "name": name,
            "size": (folder / name).stat().st_size,
            "sha256": hashlib.sha256((folder / name).read_bytes()).hexdigest(),
        }
        for name in names
    ]
    (folder / "build.json").write_text(json.dumps({"board": board, "revision": revision, "artefacts": rows}))
