"""`--on-chip` and `--verify-boot` of a board with an ESP32-S3; test_on_chip_cli.py has what both chips share."""

from __future__ import annotations

from pathlib import Path

import images
import pytest
import talking
from on_chip import wificnc
from wificnc.board.load import load_board
from wificnc.errors import Exit
from wificnc_chips import greet, pin_numbers
from wificnc_chips.esp32 import Chip, EspMachine, load_image
from xtensa import windows
from xtensa.toolchain import Toolchain

pytestmark = pytest.mark.slow  # compiles a program for the virtual chip

BOARD, KIND = "esp32s3-devkitc", Chip.ESP32S3
NVS_SIZE = 0x6000  # partitions.csv


@pytest.fixture(scope="module")
def build(tools: Toolchain, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder as `wificnc build` leaves it."""
    if said := windows.missing(tools):
        pytest.skip(said)
    elf = talking.build(tools, kind=KIND).read_bytes()
    folder = tmp_path_factory.mktemp("build") / BOARD
    return talking.make_folder(folder, elf, talking.application(elf, kind=KIND), kind=KIND)


@pytest.mark.usefixtures("cycle_each")
def test_a_job_makes_the_hosts_steps(build: Path, job: Path, capsys: pytest.CaptureFixture[str]) -> None:
    options = ("--board", BOARD, "--on-chip", build, "--set", "$110=3000", "--set", "$120=500")
    assert wificnc("sim", job, *options) == Exit.OK
    said = capsys.readouterr().out
    assert "the same steps" in said and "position    0, 0, 250, 250, 0, 0 steps" in said and "0 refused" in said


def test_a_job_with_o_words_is_executed_as_send_does_it(
    build: Path, job: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """A controller refuses O words in a stream; errors have the file's line."""
    job.write_text("G21G91\nO100 repeat [3]\nG1X1F1500\nO100 endrepeat\n")
    assert wificnc("sim", job, "--board", BOARD, "--on-chip", build) == Exit.OK
    said = capsys.readouterr().out
    assert "the same steps" in said and "position    750, 0, 0, 0, 0, 0 steps" in said
    job.write_text("G21G91\nO100 repeat [2]\n(a pause)\nG1X1\nO100 endrepeat\n")
    assert wificnc("sim", job, "--board", BOARD, "--on-chip", build) == Exit.JOB
    assert "line 4: error:22" in capsys.readouterr().err


@pytest.mark.parametrize("form", ["merged", "application"])
def test_files_of_a_release(
    build: Path, job: Path, form: str, capsys: pytest.CaptureFixture[str], tmp_path: Path
) -> None:
    application = (build / "firmware.bin").read_bytes()
    image = tmp_path / f"{form}.bin"
    image.write_bytes(images.merged(KIND, application) if form == "merged" else application)
    job.write_text("G21G91\nG1X1F1500\n")
    assert wificnc("sim", job, "--board", BOARD, "--on-chip", image) == Exit.OK
    assert "the same steps" in capsys.readouterr().out


def test_an_image_that_boots_is_flashed(build: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """At the S3's places: the bootloader at 0."""
    assert wificnc("flash", BOARD, "--from", build, "--verify-boot", "--dry-run") == Exit.OK
    said = capsys.readouterr()
    assert "Grbl 1.1h" in said.err and "[VER:1.1h" in said.err and "500 exact step events of a G1" in said.err
    assert "0x000000" in said.out and "0x020000" in said.out


def test_the_other_chips_board_refuses_it(build: Path, job: Path, capsys: pytest.CaptureFixture[str]) -> None:
    image = build / "firmware.bin"
    assert wificnc("sim", job, "--board", "esp32-wroom32", "--on-chip", image) != Exit.OK
    assert "this image is for the ESP32-S3, not for the ESP32" in capsys.readouterr().err


def test_a_bootloader_alone_is_named(
    build: Path, job: Path, capsys: pytest.CaptureFixture[str], tmp_path: Path
) -> None:
    image, code = tmp_path / "bootloader.bin", images.BOOTLOADER_CODE[KIND]
    image.write_bytes(images.image(code, [(code, bytes(300))], chip=images.CHIP_IDS[KIND]))
    assert wificnc("sim", job, "--board", BOARD, "--on-chip", image) == Exit.USAGE
    assert "is not an application: it has no description" in capsys.readouterr().err


def test_pins_of_the_chip_and_its_settings(build: Path, tmp_path: Path) -> None:
    """GPIO0 to GPIO48; switches rest; the settings' partition is kept over a start."""
    board = load_board(BOARD)
    assert set(pin_numbers(board).values()) == set(range(49))
    chip = EspMachine(board, load_image(build, board))
    try:
        assert all(chip.level(int(pin.removeprefix("GPIO"))) == 1 for pin in ("GPIO5", "GPIO14"))
        kept = bytes(range(256)) * (NVS_SIZE // 256)
        chip.set_settings(kept, tmp_path / "settings.bin")
        chip.power_on()
        assert "Grbl 1.1h" in greet(chip) and chip.settings() == kept
    finally:
        chip.close()
