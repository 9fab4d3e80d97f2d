"""`wificnc flash --ota` at the firmware's own receiver, over a socket of this computer."""

from __future__ import annotations

import socket
import subprocess
import sys
import threading
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from functools import cache
from pathlib import Path

import pytest
from chip import image, make_build
from patience import HANG_S
from wificnc.build.checkout import checkout_root
from wificnc.build.host import build_program
from wificnc.errors import Exit, FlashError
from wificnc.flash.ota import Upload

HERE = Path(__file__).parent
ESP32 = checkout_root() / "targets" / "esp32"
BOARD, PASSWORD = "esp32s3-zero", "correct horse"


@cache
def program() -> Path:
    sources = [HERE / "ota_serve.c", ESP32 / "net" / "ota.c"]
    return build_program(sources, checkout_root() / "build" / "tests" / "ota_serve", "release", [f"-I{ESP32}"])


@dataclass
class Receiver:
    port: int
    slot: Path
    process: subprocess.Popen[str]


@contextmanager
def receiver(folder: Path, chip_id: int = 9) -> Iterator[Receiver]:
    slot = folder / "slot.bin"
    process = subprocess.Popen(
        [program(), PASSWORD, str(slot), str(chip_id)], stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True
    )
    assert process.stdin and process.stdout
    try:
        yield Receiver(int(process.stdout.readline()), slot, process)
    finally:
        process.stdin.close()
        process.stdout.close()
        process.wait(HANG_S)


def flash(build: Path, port: int, key: str, *more: str, board: str = BOARD) -> subprocess.CompletedProcess[str]:
    command = [sys.executable, "-m", "wificnc", "flash", board, "--from", str(build)]
    command += ["--ota", f"127.0.0.1:{port}", "--key", key, *more]
    return subprocess.run(command, capture_output=True, text=True, timeout=HANG_S, cwd=HERE, check=False)


def test_an_update_arrives_whole(tmp_path: Path) -> None:
    build = make_build(tmp_path / "build", BOARD, "esp32s3", size=900_000)
    with receiver(tmp_path) as there:
        run = flash(build, there.port, PASSWORD)
        assert run.returncode == 0, run.stderr
        assert there.process.wait(HANG_S) == 0
    assert there.slot.read_bytes() == (build / "firmware.bin").read_bytes()
    assert "returns to the old firmware" in run.stderr


def test_a_wrong_key_is_told_and_writes_nothing(tmp_path: Path) -> None:
    build = make_build(tmp_path / "build", BOARD, "esp32s3")
    with receiver(tmp_path) as there:
        run = flash(build, there.port, "wrong horse")
        assert run.returncode == Exit.FLASH and "wrong access key" in run.stderr and "hint" in run.stderr
        assert not there.slot.exists()


def test_another_board_is_refused_before_a_key_is_asked_for(tmp_path: Path) -> None:
    build = make_build(tmp_path / "build", "esp32s3-devkitc", "esp32s3")
    with receiver(tmp_path) as there:
        run = flash(build, there.port, PASSWORD, board="esp32s3-devkitc")
    assert run.returncode == Exit.FLASH and "esp32s3-zero" in run.stderr


def test_a_firmware_for_another_chip_is_refused_by_the_receiver(tmp_path: Path) -> None:
    with receiver(tmp_path) as there:
        upload = Upload("127.0.0.1", there.port)
        with pytest.raises(FlashError, match="another chip"):
            upload.send(upload.hello(), image("esp32", 300_000), PASSWORD, lambda *_: None)
        upload.close()
        assert not there.slot.exists()


def test_a_connection_cut_in_the_middle_leaves_nothing_and_the_next_one_works(tmp_path: Path) -> None:
    build = make_build(tmp_path / "build", BOARD, "esp32s3", size=900_000)
    firmware = (build / "firmware.bin").read_bytes()
    with receiver(tmp_path) as there:
        upload = Upload("127.0.0.1", there.port)

        def cut(done: int, total: int) -> None:
            if done > total // 2:
                upload._socket.shutdown(socket.SHUT_RDWR)

        with pytest.raises(FlashError):
            upload.send(upload.hello(), firmware, PASSWORD, cut)
        upload.close()
        assert flash(build, there.port, PASSWORD).returncode == 0
        assert there.process.wait(HANG_S) == 0
    assert there.slot.read_bytes() == firmware


def test_nobody_there_and_somebody_else_there_are_told(tmp_path: Path) -> None:
    build = make_build(tmp_path / "build", BOARD, "esp32s3")
    with socket.create_server(("127.0.0.1", 0)) as server:
        port = server.getsockname()[1]

        def answer() -> None:
            connection, _ = server.accept()
            connection.sendall(b"Grbl 1.1h ['$' for help]\r\n")
            connection.close()

        thread = threading.Thread(target=answer)
        thread.start()
        run = flash(build, port, PASSWORD)
        thread.join()
        assert run.returncode == Exit.FLASH and "does not support the updates" in run.stderr
    run = flash(build, port, PASSWORD)
    assert run.returncode == Exit.FLASH and "discover" in run.stderr


def test_dry_run_connects_to_nobody(tmp_path: Path) -> None:
    build = make_build(tmp_path / "build", BOARD, "esp32s3")
    run = flash(build, 1, PASSWORD, "--dry-run")
    assert run.returncode == 0 and "127.0.0.1:1" in run.stdout
