"""`wificnc flash`, `nvs` and `wifi` as a user meets them, at a mock of a chip's loader behind a pty."""

from __future__ import annotations

import io
import json
import re
import subprocess
import sys
from collections.abc import Iterator
from contextlib import redirect_stderr, redirect_stdout
from dataclasses import dataclass
from pathlib import Path

import pytest
from chip import Mock, image, make_build, mock_chip

pytest.importorskip("esptool")
pytest.importorskip("esp32_mock_bootloader")

from patience import HANG_S
from wificnc.app import main
from wificnc.board.load import load_board
from wificnc.commands import wifi
from wificnc.errors import Exit, FlashError
from wificnc.firmware.flash.plan import Chip, Region, check_chip, load_regions, read_partitions
from wificnc.firmware.flash.ports import Port, choose_port

ROOT = Path(__file__).resolve().parents[2]
PARTITIONS = read_partitions((ROOT / "targets/esp32/partitions.csv").read_text())
BOARD = "esp32s3-zero"
APP_AT, NVS_AT = 0x20000, 0x9000


@dataclass(frozen=True)
class Said:
    """What a command printed."""

    stdout: str
    stderr: str


def wificnc(*arguments: object, code: int = 0, stdin: str = "") -> Said:
    """In this process: it starts forty times here, and tests/cli starts it as users do."""
    out, err = (io.TextIOWrapper(io.BytesIO(), encoding="utf-8", write_through=True) for _ in range(2))
    with pytest.MonkeyPatch.context() as patched, redirect_stdout(out), redirect_stderr(err):
        patched.chdir(ROOT)
        patched.setattr("sys.stdin", io.StringIO(stdin))
        with pytest.raises(SystemExit) as ended:
            main([str(argument) for argument in arguments])
    said = Said(*(stream.buffer.getvalue().decode() for stream in (out, err)))  # type: ignore[attr-defined]
    assert int(ended.value.code or 0) == code, said
    return said


@pytest.fixture(scope="module")
def build(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return make_build(tmp_path_factory.mktemp("build"), BOARD, "esp32s3")


@pytest.fixture
def chip(tmp_path: Path) -> Iterator[Mock]:
    with mock_chip("esp32s3", tmp_path / "mock") as mock:
        yield mock


# ---- at the chip ----


def test_a_build_is_written_verified_and_the_settings_stay(chip: Mock, build: Path, tmp_path: Path) -> None:
    machine = ROOT / "examples" / "machines" / "shapeoko3.toml"
    wificnc("nvs", "build", machine, "--ssid", "Werkstatt", "--wifi-password", "12345678", "-o", tmp_path / "a.bin")
    wificnc("nvs", "flash", tmp_path / "a.bin", "--port", chip.port)
    said = wificnc("flash", BOARD, "--from", build, "--port", chip.port, "--wait", "0.2").stderr
    assert "ESP32-S3" in said and "4 MB flash" in said and "verified" in said
    assert "has not printed anything" in said  # the mock has no firmware to start
    kept = wificnc("nvs", "read", "--port", chip.port, "-o", tmp_path / "b.bin", "--json").stdout
    assert json.loads(kept)["wifi_ssid"] == "Werkstatt" and "12345678" not in kept
    assert (tmp_path / "a.bin").read_bytes() == (tmp_path / "b.bin").read_bytes()
    assert wificnc("nvs", "diff", tmp_path / "a.bin", tmp_path / "b.bin").stdout == ""


def test_the_classic_esp32_is_written_too(tmp_path: Path) -> None:
    build = make_build(tmp_path / "build", "esp32-wroom32", "esp32")
    with mock_chip("esp32", tmp_path / "mock") as chip:
        said = wificnc("flash", "esp32-wroom32", "--from", build, "--port", chip.port, "--wait", "0").stderr
    assert "ESP32" in said and "4 MB flash" in said and "verified" in said


def test_erase_forgets_the_settings(chip: Mock, build: Path, tmp_path: Path) -> None:
    wificnc("nvs", "build", "shapeoko3", "-o", tmp_path / "a.bin")
    wificnc("nvs", "flash", tmp_path / "a.bin", "--port", chip.port)
    wificnc("flash", BOARD, "--from", build, "--port", chip.port, "--erase", "--no-verify", "--wait", "0")
    assert json.loads(wificnc("nvs", "read", "--port", chip.port, "--json").stdout) == {}


@pytest.mark.parametrize(
    ("setting", "words"),
    [
        ("p_sx=25", "the ESP32-S3 has no GPIO25"),
        ("p_sx=27", "GPIO27 of the ESP32-S3 is taken by"),
        ("io_p0=22", "no GPIO22"),
    ],
)
def test_an_image_for_another_chip_is_refused(chip: Mock, tmp_path: Path, setting: str, words: str) -> None:
    """Before anything is written: GPIO22 to 25 are the ESP32's alone, and 26 to 32 hold the flash of the ESP32-S3."""
    wificnc("nvs", "build", "shapeoko3", "--set", setting, "-o", tmp_path / "a.bin")
    said = wificnc("nvs", "flash", tmp_path / "a.bin", "--port", chip.port, code=Exit.FLASH).stderr
    assert words in " ".join(said.split()) and setting in said
    assert json.loads(wificnc("nvs", "read", "--port", chip.port, "--json").stdout) == {}


@pytest.mark.parametrize("from_repository", [True, False])
def test_a_board_with_another_chip_is_refused(chip: Mock, tmp_path: Path, from_repository: bool) -> None:
    """Of the repository, and of one's own; nothing in such an image tells the chips apart."""
    text = (ROOT / "boards" / "esp32-wroom32.toml").read_text()
    own = tmp_path / "my-esp32.toml"
    own.write_text(text)
    board = "esp32-wroom32" if from_repository else own
    wificnc("nvs", "build", "shapeoko3", "--board", board, "-o", tmp_path / "a.bin")
    wificnc("nvs", "flash", tmp_path / "a.bin", "--board", board, "--dry-run")
    said = wificnc("nvs", "flash", tmp_path / "a.bin", "--board", board, "--port", chip.port, code=Exit.FLASH).stderr
    assert "this is an ESP32-S3" in " ".join(said.split())
    assert json.loads(wificnc("nvs", "read", "--port", chip.port, "--json").stdout) == {}


def test_wifi_is_set_and_shown_and_other_keys_stay(chip: Mock, tmp_path: Path) -> None:
    wificnc("nvs", "build", "shapeoko3", "-o", tmp_path / "a.bin")
    wificnc("nvs", "flash", tmp_path / "a.bin", "--port", chip.port)
    before = json.loads(wificnc("nvs", "read", tmp_path / "a.bin", "--json", "--show-secrets").stdout)
    wificnc("wifi", "set", "Mein Netz", "--password", "geheim, sehr", "--port", chip.port)
    shown = json.loads(wificnc("wifi", "status", "--port", chip.port, "--json").stdout)
    assert shown["joins"] == "Mein Netz" and shown["own_password"] == before["ap_pass"]
    assert shown["own_network"].startswith("WiFiCNC-") and "geheim" not in json.dumps(shown)
    after = json.loads(wificnc("nvs", "read", "--port", chip.port, "--json", "--show-secrets").stdout)
    assert after == {**before, "wifi_ssid": "Mein Netz", "wifi_pass": "geheim, sehr"}
    wificnc("wifi", "set", "Offen", "--password", "", "--port", chip.port)
    assert "wifi_pass" not in json.loads(wificnc("nvs", "read", "--port", chip.port, "--json").stdout)
    people = wificnc("wifi", "status", "--port", chip.port).stdout
    assert before["ap_pass"] in people and "█" in people  # the QR code


def test_wifi_set_refuses_damaged_storage_and_changes_nothing(chip: Mock, tmp_path: Path) -> None:
    """Whatever is damaged may be the access key or steps/mm: a new image without it would lose it in silence."""
    file = tmp_path / "a.bin"
    wificnc("nvs", "build", "shapeoko3", "--access-key", "k7qf3-x2m9d-0abcd-efghj", "-o", file)
    stored = bytearray(file.read_bytes())
    stored[stored.index(b"k7qf3")] ^= 1
    write_storage(chip, bytes(stored))
    said = wificnc("wifi", "set", "Mein Netz", "--password", "12345678", "--port", chip.port, code=Exit.FLASH).stderr
    words = " ".join(said.split())
    assert "access_key" in words and "nothing was written" in words
    assert "wificnc nvs read" in words and "wificnc nvs build" in words and "wificnc nvs flash" in words
    assert read_storage(chip) == stored


def write_storage(chip: Mock, data: bytes) -> None:
    """Whatever it holds: `wificnc nvs flash` refuses what is damaged."""
    from wificnc.firmware.flash.device import open_device

    with open_device(chip.port) as device:
        device.write([Region("settings", NVS_AT, data)], 115200, lambda *_: None)


def read_storage(chip: Mock) -> bytes:
    from wificnc.firmware.flash.device import open_device

    with open_device(chip.port) as device:
        return device.read(NVS_AT, PARTITIONS["nvs"].size)


def test_the_wrong_chip_is_refused_before_anything_is_written(chip: Mock, tmp_path: Path) -> None:
    build = make_build(tmp_path / "build", "esp32-wroom32", "esp32")
    said = wificnc("flash", "esp32-wroom32", "--from", build, "--port", chip.port, code=Exit.FLASH).stderr
    assert "ESP32-S3" in said and "esp32-wroom32 has an ESP32" in said
    assert is_blank(chip, 0x1000)


def test_an_image_for_more_flash_is_refused_before_anything_is_written(chip: Mock, tmp_path: Path) -> None:
    build = make_build(tmp_path / "build", BOARD, "esp32s3", flash_mb=8)
    said = wificnc("flash", BOARD, "--from", build, "--port", chip.port, code=Exit.FLASH).stderr
    assert "4 MB of flash, and this firmware needs 8 MB" in said
    assert is_blank(chip, 0)


def is_blank(chip: Mock, offset: int) -> bool:
    from wificnc.firmware.flash.device import open_device

    with open_device(chip.port) as device:
        return device.read(offset, 4096) == b"\xff" * 4096


def test_a_port_lost_in_the_middle_is_told_and_the_next_run_succeeds(tmp_path: Path, build: Path) -> None:
    from wificnc.firmware.flash.device import open_device

    regions = load_regions(build, load_board(BOARD), PARTITIONS)
    with mock_chip("esp32s3", tmp_path / "one") as chip, open_device(chip.port) as device:

        def pull_the_plug(name: str, done: int, total: int) -> None:
            if name == "firmware":
                chip.process.kill()

        with pytest.raises(FlashError) as caught:
            device.write(regions, 115200, pull_the_plug)
        assert chip.port in caught.value.message and "again" in str(caught.value.hint)
    with mock_chip("esp32s3", tmp_path / "two") as chip:
        wificnc("flash", BOARD, "--from", build, "--port", chip.port, "--wait", "0")


def test_a_phone_gets_in_by_codes_of_its_camera(chip: Mock, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """The board's own network, and the page with the key; neither when access is open or asked to be silent."""
    made: list[str] = []
    monkeypatch.setattr(wifi, "show_qr", lambda title, text: made.append(text))
    key = ("--access-key", "open sesame & more")
    for more, codes in ((key, 1), ((*key, "--set", "access_open=1"), 0)):
        wificnc("nvs", "build", "baseline", *more, "-o", tmp_path / "a.bin")
        wificnc("nvs", "flash", tmp_path / "a.bin", "--port", chip.port)
        name = json.loads(wificnc("wifi", "status", "--port", chip.port, "--json").stdout)["name"]
        wificnc("wifi", "status", "--port", chip.port)
        assert [code for code in made if "://" in code] == [
            f"http://{name}.local/#key=open%20sesame%20%26%20more"
        ] * codes
        assert re.fullmatch(r"WiFiCNC-[0-9A-F]{4}", name)
        made.clear()
    said = wificnc("wifi", "status", "--port", chip.port, "--no-qr").stdout
    assert "open sesame & more" in said and not made
    assert wifi.wifi_code("WiFiCNC-1A2B", 'a;b"c') == 'WIFI:T:WPA;S:WiFiCNC-1A2B;P:a\\;b\\"c;;'


def test_a_damaged_write_is_noticed(chip: Mock) -> None:
    from wificnc.firmware.flash.device import open_device

    region = Region("firmware", APP_AT, bytes(range(256)) * 64)
    with open_device(chip.port) as device:
        device.write([region], 115200, lambda *_: None)
        device.verify([region])
        with pytest.raises(FlashError, match="firmware was not written correctly"):
            device.verify([Region("firmware", APP_AT, bytes(16384))])


@pytest.mark.slow
def test_a_port_where_nobody_answers_says_what_to_press(monkeypatch: pytest.MonkeyPatch) -> None:
    import os
    import pty

    monkeypatch.delenv("ESPTOOL_CFGFILE")  # whose waits are those for an answer that comes
    ours, theirs = pty.openpty()
    command = [sys.executable, "-m", "wificnc", "nvs", "read", "--port", os.ttyname(theirs)]
    try:  # in another process: in this one esptool has read the file
        run = subprocess.run(command, capture_output=True, text=True, timeout=HANG_S, cwd=ROOT, check=False)
    finally:
        os.close(ours)
        os.close(theirs)
    assert run.returncode == Exit.FLASH
    assert "cannot connect" in run.stderr and "BOOT" in run.stderr and "Traceback" not in run.stderr


def test_a_port_that_is_none_or_busy_is_told(chip: Mock) -> None:
    import serial

    assert "check that it is connected" in wificnc("wifi", "status", "--port", "/dev/ttyNONE", code=Exit.FLASH).stderr
    with serial.Serial(chip.port, exclusive=True):
        assert "another program" in wificnc("wifi", "status", "--port", chip.port, code=Exit.FLASH).stderr


# ---- without one ----


def test_dry_run_says_what_goes_where_and_asks_no_chip(build: Path) -> None:
    said = wificnc("flash", BOARD, "--from", build, "--dry-run", "--port", "/dev/ttyNONE").stdout
    assert "0x000000" in said and "0x020000" in said and "0x00F000" in said and "untouched" in said
    assert "0x009000" not in said


def test_bootloaders_lie_where_each_chip_looks(tmp_path: Path) -> None:
    for board, chip, offset in ((BOARD, "esp32s3", 0), ("esp32-wroom32", "esp32", 0x1000)):
        regions = load_regions(make_build(tmp_path / chip, board, chip), load_board(board), PARTITIONS)
        assert [region.offset for region in regions] == [offset, 0x8000, PARTITIONS["otadata"].offset, APP_AT]
        nvs = PARTITIONS["nvs"]
        assert not any(region.offset < nvs.offset + nvs.size and region.end > nvs.offset for region in regions)


@pytest.mark.parametrize(
    ("harm", "said"),
    [
        (lambda folder: (folder / "firmware.bin").write_bytes(image("esp32s3", 99)), "differs from the build record"),
        (lambda folder: (folder / "firmware.bin").unlink(), "is incomplete"),
        (lambda folder: (folder / "build.json").write_text("{"), "is incomplete"),
        (lambda folder: (folder / "build.json").unlink(), "no build found"),
        (lambda folder: make_build(folder, "esp32s3-devkitc", "esp32s3"), "a build of esp32s3-devkitc"),
        (lambda folder: make_build(folder, BOARD, "esp32"), "is for esp32, not for esp32s3"),
        (lambda folder: make_build(folder, BOARD, "esp32s3", size=0x1E0000), "its slot"),
    ],
)
def test_a_build_that_is_not_right_is_refused(tmp_path: Path, harm: object, said: str) -> None:
    folder = make_build(tmp_path, BOARD, "esp32s3")
    harm(folder)  # type: ignore[operator]
    assert said in wificnc("flash", BOARD, "--from", folder, "--dry-run", code=Exit.FLASH).stderr


def chip_with(flash_mb: float = 8, psram_mb: int = 0, psram_1v8: bool = False) -> Chip:
    return Chip("esp32s3", "ESP32-S3", "v0.2", flash_mb, psram_mb, psram_1v8, "00:00:00:00:00:01")


def test_memory_that_takes_pins_is_noticed(build: Path) -> None:
    quad, octal = load_board("esp32s3-devkitc-quad"), load_board("esp32s3-devkitc")
    regions = load_regions(build, load_board(BOARD), PARTITIONS)
    with pytest.raises(FlashError, match="octal PSRAM"):
        check_chip(chip_with(psram_mb=8), quad, regions, PARTITIONS)
    with pytest.raises(FlashError, match=r"1\.8 V"):
        check_chip(chip_with(psram_mb=8, psram_1v8=True), octal, regions, PARTITIONS)
    assert check_chip(chip_with(psram_mb=8), octal, regions, PARTITIONS) == []
    assert check_chip(chip_with(psram_mb=2), quad, regions, PARTITIONS) == []
    bare = quad.model_copy(update={"memory": quad.memory.model_copy(update={"mode": "flash", "psram_mb": (0,)})})
    assert check_chip(chip_with(), bare, regions, PARTITIONS) == []
    for psram_mb in (2, 8):
        with pytest.raises(FlashError, match="this module has PSRAM"):
            check_chip(chip_with(psram_mb=psram_mb), bare, regions, PARTITIONS)
    assert "more pins" in check_chip(chip_with(), octal, regions, PARTITIONS)[0]
    gantry = load_board("esp32s3-devkitc-gantry")  # there is no such board for quad memory
    assert "-quad" not in "".join(check_chip(chip_with(), gantry, regions, PARTITIONS))
    with pytest.raises(FlashError, match="2 MB of flash"):
        check_chip(chip_with(flash_mb=2), octal, regions, PARTITIONS)


def test_ports_are_chosen_or_asked_for() -> None:
    one, two = Port("/dev/ttyACM0", "Espressif"), Port("/dev/ttyUSB0", "CP210x")
    assert choose_port(None, [one]) == one.device and choose_port("/dev/x", [one, two]) == "/dev/x"
    with pytest.raises(FlashError, match="several ports") as several:
        choose_port(None, [one, two])
    assert "/dev/ttyACM0" in several.value.message and "--port" in str(several.value.hint)
    with pytest.raises(FlashError, match="does not detect a board"):
        choose_port(None, [])


def test_boards_without_an_esp32_are_refused() -> None:
    assert "no ESP32" in wificnc("flash", "host", code=Exit.BUILD).stderr


@pytest.mark.parametrize(
    ("arguments", "said"),
    [
        (("nvs", "build", "shapeoko3", "--ssid", "x" * 33), "wifi_ssid: 33 bytes"),
        (("nvs", "build", "shapeoko3", "--access-key", ""), "access_key: 0 bytes"),
        (("nvs", "build", "shapeoko3", "--access-key", "abc -- ---- ----"), "access_key: 3 bytes"),
        (("nvs", "build", "shapeoko3", "--set", "p_sx=300"), "p_sx"),
        (("nvs", "build", "shapeoko3", "--set", "nonsense=3"), "no such key"),
    ],
)
def test_wrong_values_write_nothing(arguments: tuple[str, ...], said: str, tmp_path: Path) -> None:
    output = tmp_path / "nvs.bin"
    assert said in wificnc(*arguments, "-o", output, code=Exit.USAGE).stderr
    assert not output.exists()


def test_other_files_are_not_flashed_as_settings(build: Path) -> None:
    said = wificnc("nvs", "flash", build / "partitions.bin", "--dry-run", code=Exit.FLASH).stderr
    assert "NVS partition" in said
