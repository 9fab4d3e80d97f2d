"""Stand-ins for a board: a made-up build, and PyPI's mock of an ESP32's loader behind a pty."""

from __future__ import annotations

import hashlib
import json
import os
import struct
import subprocess
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path

from patience import wait_until
from wificnc.build.signing import signing_key

CHIP_IDS = {"esp32": 0, "esp32s3": 9}
SIZES = {1: 0, 2: 1, 4: 2, 8: 3, 16: 4}
os.environ["ESPTOOL_CFGFILE"] = str(Path(__file__).with_name("esptool.cfg"))  # esptool reads it when it is imported

# The mock forgets its state three seconds after a write, also in the middle of what comes next over the same pty; and
# while its flash is read it gives up when a word of the reader is 50 ms late, as on a busy computer each one may be.
RUN_MOCK = """\
import sys
from esp32_mock_bootloader import cli, server
server._FLASH_END_IDLE_SEC = 1e9
read = server.perform_read_flash_stream
def patient_read(connection, *arguments):
    connection.set_timeout(1e3)
    try:
        read(connection, *arguments)
    finally:
        connection.set_timeout(server._CLIENT_RECV_TIMEOUT)
server.perform_read_flash_stream = patient_read
sys.exit(cli.main())
"""


def image(
    chip: str, size: int, flash_mb: int = 4, project: bytes = b"wificnc", board: str = "", elf: bytes = b"ELF"
) -> bytes:
    """An image with the head, app descriptor, signing key and digest of a real one. @param elf  what it is made of

    It compresses, as firmware does: what does not is sent in whole blocks, and the mock writes all of them.
    """
    head = bytearray(struct.pack("<BBBBI", 0xE9, 1, 2, SIZES[flash_mb] << 4, 0x40374000) + bytes(16))
    struct.pack_into("<H", head, 12, CHIP_IDS[chip])
    head[23] = 1  # a digest follows
    body = struct.pack("<II", 0x3C000020, size) + struct.pack("<I12x32s32s64x", 0xABCD5432, b"1.0", project)
    body += hashlib.sha256(elf).digest() if elf else bytes(32)
    body += signing_key().point
    body += f'{{"name": "%s", "board": "{board}", "axes": %u}}'.encode() if board else b""
    data = bytes(head) + body + (hashlib.sha256(chip.encode()).digest() * 4 + bytes(64)) * (size // 192)
    return data + hashlib.sha256(data).digest()


def make_build(
    folder: Path, board: str, chip: str, size: int = 40000, flash_mb: int = 4, named: bool = False, elf: bytes = b"ELF"
) -> Path:
    """What `wificnc build` leaves in build/BOARD. @param named  the firmware has the board's name"""
    folder.mkdir(parents=True, exist_ok=True)
    files = {
        "bootloader.bin": image(chip, 8000, flash_mb),
        "partitions.bin": hashlib.sha256(b"table").digest() * 5 + b"\xff" * 2912,
        "firmware.bin": image(chip, size, flash_mb, board=board if named else "", elf=elf),
        "firmware.elf": b"\x7fELF",
    }
    files["firmware.sig"] = signing_key().sign(files["firmware.bin"]) or b""
    for name, data in files.items():
        (folder / name).write_bytes(data)
    sums = [
        {"name": name, "size": len(data), "sha256": hashlib.sha256(data).hexdigest()} for name, data in files.items()
    ]
    (folder / "build.json").write_text(json.dumps({"board": board, "artefacts": sums}))
    return folder


@dataclass
class Mock:
    """A chip in its loader."""

    port: str
    process: subprocess.Popen[bytes]


def _has_text(path: Path) -> bool:
    return path.exists() and path.read_text().strip() != ""


@contextmanager
def mock_chip(chip: str, folder: Path) -> Iterator[Mock]:
    """A 4 MB chip; it ends with the block."""
    folder.mkdir(parents=True, exist_ok=True)
    port_file = folder / "port"
    port_file.unlink(missing_ok=True)
    environment = {**os.environ, "TMPDIR": str(folder), "ESP32_MOCK_BOOTLOADER_STATE_DIR": str(folder)}
    command = [sys.executable, "-c", RUN_MOCK, "run", "--pty", "--chip", chip, "--port-file", str(port_file)]
    process = subprocess.Popen(command, env=environment, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
    try:
        wait_until(lambda: process.poll() is not None or _has_text(port_file), "the mock has not started")
        assert process.poll() is None, "the mock has ended"
        yield Mock(port_file.read_text().strip(), process)
    finally:
        process.kill()
        process.wait()
