"""`wificnc sim --on-chip IMAGE` of a board with an ESP32: one clear line for each image that cannot be run."""

from __future__ import annotations

import hashlib
import struct
from pathlib import Path

import images
import pytest
from talking import RTC_SLOW, description
from wificnc.app import main
from wificnc.errors import Exit
from wificnc_chips.esp32.image import RADIO_MARK
from xtensa_programs import code as c

BOARD = "esp32-wroom32"
START = 0x40080400
WAITI = c.wide(0, 0, 0, 7)
RADIO, RTC_OPTIONS = 0x60033C00, 0x3FF48000
SYSTEM_RESET = 1 << 31


def app(
    code: bytes,
    *,
    project: bytes = b"wificnc",
    elf: bytes = b"",
    chip: int = 0,
    flash_size: int = 2,
    described: bool = True,
) -> bytes:
    """An application that does this."""
    first = [(RTC_SLOW, description(project, hashlib.sha256(elf).digest()))] if described else []
    return images.image(START, [*first, (START, code)], chip=chip, flash_size=flash_size)


def with_literals(values: list[int], body: bytes) -> bytes:
    """A function whose body begins at START; its literals come before it: a jump over them is the entry."""
    table = struct.pack(f"<{len(values)}I", *values)
    begin = c.jump(4 + len(table)) + b"\0"
    return begin + table + body


def at_body(values: int) -> int:
    return START + 4 + 4 * values


def quiet() -> bytes:
    """Waits for ever."""
    return WAITI + c.jump(-3) + bytes(2)


def touches_the_radio() -> bytes:
    place = at_body(1)
    return with_literals([RADIO], c.l32r(2, place, START + 4) + c.l32i(3, 2, 0) + bytes(2))


def starts_its_radio(mark: bytes) -> bytes:
    """Calls the function that touches it, whose address lies behind the mark, and waits."""
    table = 8 + len(mark) + 4
    body_at = START + table
    touch = body_at + 12
    body = c.entry(1, 64) + c.call(8, body_at + 3, touch) + WAITI + c.jump(-3)
    load = c.entry(1, 32) + c.l32r(2, touch + 3, START + 4) + c.l32i(3, 2, 0) + c.RETW
    return c.jump(table) + b"\0" + struct.pack("<I", RADIO) + mark + struct.pack("<I", touch) + body + load


def restarts() -> bytes:
    place = at_body(2)
    body = c.l32r(2, place, START + 4) + c.l32r(3, place + 3, START + 8) + c.s32i(3, 2, 0) + c.jump(0)
    return with_literals([RTC_OPTIONS, SYSTEM_RESET], body)


def named(code: bytes) -> bytes:
    """An ELF file with the name of the function at START and nothing else."""
    names, size = b"\0start_radio\0", 52 + 3 * 40
    symbols = bytes(16) + struct.pack("<3I2BH", 1, START, len(code), 2, 0, 0)
    sections = bytes(40) + struct.pack("<10I", 0, 3, 0, 0, size, len(names), 0, 0, 1, 0)
    sections += struct.pack("<10I", 0, 2, 0, 0, size + len(names), len(symbols), 1, 0, 4, 16)
    head = b"\x7fELF\x01\x01\x01".ljust(16, b"\0") + struct.pack("<2H5I6H", 2, 94, 1, 0, 0, 52, 0, 52, 0, 0, 40, 3, 1)
    return head + sections + names + symbols


def flipped(data: bytes, at: int) -> bytes:
    return data[:at] + bytes((data[at] ^ 1,)) + data[at + 1 :]


def merged(application: bytes) -> bytes:
    return images.merged(0, application)


def small() -> bytes:
    """For 1 MB, which the partitions do not fit."""
    return app(quiet(), flash_size=0)


DAMAGED = "`wificnc build` makes one that the virtual chip runs"
REFUSED = {
    "nothing": (b"", "it is empty"),
    "a text": (b"G1X10\n", "not an image of an ESP32: its first byte is 47, not e9"),
    "encrypted": (b"\x12\x34" * 100, "an encrypted image cannot be run"),
    "an ELF file": (named(quiet()), "is an ELF file, not an image of an ESP32"),
    "UF2": (b"UF2\n" + bytes(508), "is a UF2 file, for an ESP USB Bridge"),
    "an archive": (b"PK\x03\x04" + bytes(60), "unpack it first"),
    "Intel HEX": (b":020000041D00DD\n", "is an Intel HEX file, as of a PIC32MZ"),
    "a partition table": (images.table(), "is a partition table alone"),
    "a bootloader": (images.image(START, [(START, bytes(200))]), "is not an application: it has no description"),
    "cut off in its head": (app(quiet())[:100], "is damaged: it ends after 100 bytes"),
    "cut off in a segment": (
        app(quiet() + bytes(4000))[:2000],
        "is damaged: it ends after 2000 bytes, in segment 2 of 2",
    ),
    "cut off in a merged image": (
        merged(app(quiet() + bytes(4000)))[:-3000],
        "is damaged: its application ends after",
    ),
    "cut off": (app(quiet())[:-40], "the image is damaged"),
    "checksum": (flipped(app(quiet()), 250), "the image is damaged: its checksum is"),
    "hash": (flipped(app(quiet()), 8), "the image is damaged: its SHA-256 is another one"),
    "damaged in a merged image": (flipped(merged(app(quiet())), images.OTA_0 + 250), DAMAGED),
    "damaged table": (flipped(merged(app(quiet())), 0x8004), "the partition table is damaged"),
    "encrypted application": (merged(bytes(range(1, 250))), "encrypted images cannot be run"),
    "signed": (merged(app(quiet()).ljust(0x1000, b"\xff") + b"\xe7\x02" + bytes(1214)), "signed for secure boot"),
    "ESP32-S3": (app(quiet(), chip=9), "this image is for the ESP32-S3, not for the ESP32"),
    "ESP32-C3": (app(quiet(), chip=5), "this image is for the ESP32-C3, not for the ESP32"),
    "another program": (app(quiet(), project=b"blink"), "is not a WiFiCNC firmware, but 'blink'"),
    "another table": (
        images.merged(0, app(quiet()), parts=images.table(images.TABLE[2:])),
        "its partition table has no nvs",
    ),
    "too small flash": (small(), "but the flash has 100000 bytes (1 MB); build for this size"),
    "not emulated": (app(touches_the_radio()), f"load from {RADIO:x}, where nothing is emulated"),
    "not emulated, why": (app(touches_the_radio()), "its ELF file is not next to it"),
    "boot loop": (app(restarts()), "an endless boot loop"),
    "silent": (app(quiet()), "has not said Grbl's banner in 5 s of the chip's time, but: nothing"),
}


def refused(capsys: pytest.CaptureFixture[str], folder: Path, *options: str) -> tuple[int, str]:
    """Exit code, and what stderr has, as one line."""
    job = folder / "job.nc"
    job.write_text("G21G91\nG1X1F600\n")
    with pytest.raises(SystemExit) as ended:
        main(["sim", str(job), *options])
    said = capsys.readouterr().err
    assert said.startswith("error: ") and "Traceback" not in said
    assert len(said.splitlines()) <= 2, said
    return int(ended.value.code or 0), " ".join(said.split())


@pytest.mark.parametrize("name", REFUSED)
def test_images_that_are_refused(name: str, capsys: pytest.CaptureFixture[str], tmp_path: Path) -> None:
    """By one line and one with what to do."""
    data, says = REFUSED[name]
    image = tmp_path / "image.bin"
    image.write_bytes(data)
    code, said = refused(capsys, tmp_path, "--board", BOARD, "--on-chip", str(image))
    assert code != Exit.OK and says in said and code != Exit.BUG


def test_the_function_is_named(capsys: pytest.CaptureFixture[str], tmp_path: Path) -> None:
    """When the ELF file of this very image is next to it, and only then."""
    code = touches_the_radio()
    elf = named(code)
    (tmp_path / "image.bin").write_bytes(app(code, elf=elf))
    (tmp_path / "other.elf").write_bytes(elf)
    options = ("--board", BOARD, "--on-chip", str(tmp_path / "image.bin"))
    assert "start_radio" in refused(capsys, tmp_path, *options)[1]
    (tmp_path / "a folder.elf").mkdir()
    (tmp_path / "gone.elf").symlink_to(tmp_path / "nowhere")
    (tmp_path / "other.elf").write_bytes(elf + b"\0")
    said = refused(capsys, tmp_path, *options)[1]
    assert "start_radio" not in said and "nothing is emulated" in said


def test_a_marked_radio_is_answered(capsys: pytest.CaptureFixture[str], tmp_path: Path) -> None:
    """Without an ELF file; an image without the mark touches what is not there."""
    for mark, says in ((RADIO_MARK, "Grbl's banner"), (RADIO_MARK.swapcase(), "where nothing is emulated")):
        (tmp_path / "image.bin").write_bytes(app(starts_its_radio(mark)))
        assert says in refused(capsys, tmp_path, "--board", BOARD, "--on-chip", str(tmp_path / "image.bin"))[1]


@pytest.mark.parametrize(
    ("board", "says", "code"),
    [
        ("esp32s3-devkitc", "this image is for the ESP32, not for the ESP32-S3", Exit.USAGE),
        ("host", "board host has no image", Exit.BUILD),
    ],
)
def test_boards_that_cannot_run_an_image(
    board: str, says: str, code: Exit, capsys: pytest.CaptureFixture[str], tmp_path: Path
) -> None:
    (tmp_path / "image.bin").write_bytes(app(quiet()))
    ended, said = refused(capsys, tmp_path, "--board", board, "--on-chip", str(tmp_path / "image.bin"))
    assert ended == code and says in said


def test_an_image_that_is_not_there(capsys: pytest.CaptureFixture[str], tmp_path: Path) -> None:
    code, said = refused(capsys, tmp_path, "--board", BOARD, "--on-chip", str(tmp_path / "none.bin"))
    assert code == Exit.USAGE and "cannot read the image" in said and "wificnc build esp32-wroom32" in said


def test_a_folder_without_a_build(capsys: pytest.CaptureFixture[str], tmp_path: Path) -> None:
    code, said = refused(capsys, tmp_path, "--board", BOARD, "--on-chip", str(tmp_path))
    assert code == Exit.FLASH and "no build found for esp32-wroom32" in said
