"""`wificnc flash --verify-boot` of what is no build: the error names the file, and no port is opened."""

from __future__ import annotations

import hashlib
import json
from collections.abc import Callable
from pathlib import Path

import pytest
from chip import make_build
from wificnc.errors import Exit

Cli = Callable[..., tuple[int, str, str]]

S3, PIC = "esp32s3-zero", "pic32mz2048efh100"
HEX_END = ":00000001FF\n"


def recorded(folder: Path) -> None:
    """The record is of the files as they are now: only their content is wrong."""
    record = json.loads((folder / "build.json").read_text())
    for row in record["artefacts"]:
        row["sha256"] = hashlib.sha256((folder / row["name"]).read_bytes()).hexdigest()
    (folder / "build.json").write_text(json.dumps(record))


def image_of(change: Callable[[bytes], bytes]) -> Callable[[Path], None]:
    def make(folder: Path) -> None:
        firmware = make_build(folder, S3, S3.split("-")[0]) / "firmware.bin"
        firmware.write_bytes(change(firmware.read_bytes()))
        recorded(folder)

    return make


def written(path: Path, content: bytes) -> None:
    path.write_bytes(content)


def record_of(content: bytes) -> Callable[[Path], None]:
    return lambda folder: written(make_build(folder, S3, "esp32s3") / "build.json", content)


def a_folder_for_a_file(folder: Path) -> None:
    make_build(folder, S3, "esp32s3")
    (folder / "firmware.bin").unlink()
    (folder / "firmware.bin").mkdir()


def another_chip(folder: Path) -> None:
    make_build(folder, "esp32-wroom32", "esp32")


def hex_of(content: bytes) -> Callable[[Path], None]:
    return lambda folder: written(folder / "wificnc.hex", content)


CASES: dict[str, tuple[str, Callable[[Path], None], str]] = {
    "an empty folder": (S3, lambda folder: None, f"no build found for {S3} in "),
    "text": (S3, image_of(lambda _: b"hello\n" * 50), "firmware.bin is not an ESP32 image"),
    "nothing": (S3, image_of(lambda _: b""), "firmware.bin is not an ESP32 image"),
    "a cut image": (S3, image_of(lambda data: data[:9000]), "firmware.bin is damaged: its SHA-256 differs"),
    "another chip": (
        S3,
        another_chip,
        "a build of esp32-wroom32",
    ),
    "a folder for a file": (S3, a_folder_for_a_file, "cannot read firmware.bin: Is a directory"),
    "a record of text": (S3, record_of(b"hello\n"), "build.json is damaged: not the record of a build"),
    "a record of bytes": (S3, record_of(b"\xff\xfe\0"), "build.json is damaged: not the record of a build"),
    "a record of another form": (S3, record_of(b"[1]"), "build.json is damaged: not the record of a build"),
    "PIC32MZ, an empty folder": (PIC, lambda folder: None, f"no build found for {PIC} in "),
    "PIC32MZ, text": (PIC, hex_of(b"hello\n"), "wificnc.hex: line 1 of the HEX file is damaged"),
    "PIC32MZ, bytes": (PIC, hex_of(b"\xff\xfe\x80" * 99), "wificnc.hex: not an Intel HEX file"),
    "PIC32MZ, a cut image": (PIC, hex_of(b":020000041D00DD\n"), "wificnc.hex: the HEX file has no end record"),
    "PIC32MZ, no program": (PIC, hex_of(HEX_END.encode()), "wificnc.hex: the HEX file has no data"),
    "PIC32MZ, a folder for a file": (PIC, lambda folder: (folder / "wificnc.hex").mkdir(), f"no build found for {PIC}"),
}


@pytest.mark.parametrize("case", CASES)
def test_what_is_no_build_is_refused(cli: Cli, tmp_path: Path, case: str) -> None:
    board, make, says = CASES[case]
    folder = tmp_path / "build"
    folder.mkdir()
    make(folder)
    code, out, err = cli("flash", board, "--verify-boot", "--from", str(folder))
    text = " ".join(err.split())
    assert code == Exit.FLASH and out == "", err
    assert says in text and "Traceback" not in text
    assert "fails in the virtual chip" not in text, "nothing has run"


@pytest.mark.parametrize(
    ("arguments", "code", "says"),
    [
        (("no-such-board",), Exit.BOARD, "unknown board"),
        ((), Exit.USAGE, "Missing argument 'BOARD'"),
        (("host",), Exit.BUILD, "has no image for a virtual chip"),
        ((S3, "--from", "{folder}/none"), Exit.USAGE, "does not exist"),
        ((S3, "--from", "{folder}/text"), Exit.USAGE, "is a file"),
    ],
)
def test_arguments_that_are_wrong(cli: Cli, tmp_path: Path, arguments: tuple[str, ...], code: Exit, says: str) -> None:
    (tmp_path / "text").write_text("hello\n")
    found, _, err = cli("flash", "--verify-boot", *(word.format(folder=tmp_path) for word in arguments))
    assert found == code and says in " ".join(err.replace("│", " ").split()) and "Traceback" not in err
