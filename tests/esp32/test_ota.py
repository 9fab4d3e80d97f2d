"""`wificnc flash --ota` at the firmware's own receiver, over a socket of this computer."""

from __future__ import annotations

import json
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
from made_key import pem
from patience import HANG_S, wait_until
from wificnc.board.header import write_if_changed
from wificnc.build.checkout import checkout_root
from wificnc.build.host import build_program
from wificnc.build.signing import VARIABLE, key_header_text, raw_signature, signing_key
from wificnc.errors import Exit, FlashError
from wificnc.firmware.flash.ota import Signed, Upload, greeted
from wificnc.firmware.flash.reach import Patience, wait_until_kept

HERE = Path(__file__).parent
ESP32 = checkout_root() / "targets" / "esp32"
BOARD, PASSWORD = "esp32s3-zero", "correct horse"
OLD = "0ld0ld0ld0ld0ld0"  # as ota_serve.c has it


@cache
def program() -> Path:
    """With the mbedTLS of this computer."""
    if not Path("/usr/include/mbedtls/ecdsa.h").exists():
        pytest.skip("no mbedTLS: apt-get install libmbedtls-dev")
    folder = checkout_root() / "build" / "tests"
    write_if_changed(folder / "signing" / "signing_key.h", key_header_text(signing_key()))
    sources = [HERE / "ota_serve.c", ESP32 / "net" / "ota.c", ESP32 / "net" / "signature.c"]
    flags = [f"-I{ESP32}", f"-I{folder / 'signing'}", "-Wl,--no-as-needed", "-lmbedcrypto"]
    return build_program(sources, folder / "ota_serve", "release", flags)


@dataclass
class Receiver:
    port: int
    slot: Path
    process: subprocess.Popen[str]


@contextmanager
def receiver(folder: Path, fate: str = "kept", chip_id: int = 9) -> Iterator[Receiver]:
    slot = folder / "slot.bin"
    command = [program(), PASSWORD, str(slot), str(chip_id), fate]
    process = subprocess.Popen(command, stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True)
    assert process.stdin and process.stdout
    try:
        yield Receiver(int(process.stdout.readline()), slot, process)
    finally:
        process.stdin.close()
        process.stdout.close()
        process.wait(HANG_S)


@contextmanager
def answering(text: bytes) -> Iterator[int]:
    """A port where the first one who comes gets this text."""
    with socket.create_server(("127.0.0.1", 0)) as server:

        def answer() -> None:
            connection, _ = server.accept()
            connection.sendall(text)
            connection.close()

        thread = threading.Thread(target=answer)
        thread.start()
        yield server.getsockname()[1]
        thread.join()


def signed(data: bytes) -> Signed:
    return Signed(data, raw_signature(signing_key().sign(data) or b""))


def flash(build: Path, port: int, key: str, *more: str, board: str = BOARD) -> subprocess.CompletedProcess[str]:
    command = [sys.executable, "-m", "wificnc", "flash", board, "--from", str(build)]
    command += ["--ota", f"127.0.0.1:{port}", "--key", key, *more]
    return subprocess.run(command, capture_output=True, text=True, timeout=HANG_S, cwd=HERE, check=False)


def test_an_update_arrives_whole(tmp_path: Path) -> None:
    build = make_build(tmp_path / "build", BOARD, "esp32s3", size=900_000)
    with receiver(tmp_path) as there:
        run = flash(build, there.port, PASSWORD)
        assert run.returncode == 0, run.stderr
    assert there.slot.read_bytes() == (build / "firmware.bin").read_bytes()
    assert "leave the power on" in run.stderr and "the new firmware runs and is kept" in run.stderr


@pytest.mark.parametrize("fate", ["old", "crash"])
def test_the_old_firmware_that_has_returned_is_no_success(tmp_path: Path, fate: str) -> None:
    """The power was cut before the new one ran, or while it was on trial."""
    build = make_build(tmp_path / "build", BOARD, "esp32s3")
    with receiver(tmp_path, fate) as there:
        run = flash(build, there.port, PASSWORD, "--json")
    assert run.returncode == Exit.FLASH and "the old firmware has returned" in run.stderr
    assert run.stdout == "" and "is kept:" not in run.stderr and "hint" in run.stderr


@pytest.mark.parametrize(("fate", "why"), [("trial", "does not confirm"), ("gone", "cannot reach")])
def test_a_firmware_that_is_not_kept_is_no_success(tmp_path: Path, fate: str, why: str) -> None:
    data = image("esp32s3", 40000)
    patience = Patience(silent_s=0, trial_s=0, again_s=0)
    with receiver(tmp_path, fate) as there:
        upload, hello = greeted("127.0.0.1", there.port)
        upload.send(hello, signed(data), PASSWORD, lambda *_: None)
        upload.close()
        wait_until(lambda: not is_old(there.port), "the new firmware runs")
        with pytest.raises(FlashError, match=f"does not come back with the new firmware: .*{why}") as lost:
            wait_until_kept("127.0.0.1", there.port, PASSWORD, signed(data).digest, patience)
    assert "wificnc login 127.0.0.1" in (lost.value.hint or "")


def is_old(port: int) -> bool:
    """The firmware from before answers, perhaps that it restarts."""
    try:
        upload = Upload("127.0.0.1", port)
        try:
            return upload.hello().digest == OLD
        finally:
            upload.close()
    except FlashError as err:
        return "restart" in err.message


def test_a_firmware_that_does_not_say_which_it_is_is_no_success() -> None:
    hello = b"WIFICNC-OTA 3 esp32s3-zero " + b"0" * 32 + b" " + b"0" * 32 + b" 2000\n"
    with answering(hello) as port, pytest.raises(FlashError, match="does not report which firmware runs"):
        wait_until_kept("127.0.0.1", port, PASSWORD, "0123456789abcdef", Patience(0, 0, 0))


def test_a_build_without_a_digest_is_not_sent(tmp_path: Path) -> None:
    build = make_build(tmp_path / "build", BOARD, "esp32s3", elf=b"")
    run = flash(build, 1, PASSWORD)
    assert run.returncode == Exit.FLASH and "does not contain the digest of its ELF file" in run.stderr


def test_a_stranger_without_the_key_does_not_keep_an_update_out(tmp_path: Path) -> None:
    build = make_build(tmp_path / "build", BOARD, "esp32s3")
    with receiver(tmp_path) as there, socket.create_connection(("127.0.0.1", there.port), HANG_S) as stranger:
        assert stranger.recv(100).startswith(b"WIFICNC-OTA 3 ")
        stranger.sendall(b"1")
        run = flash(build, there.port, PASSWORD)
        assert run.returncode == 0, run.stderr
        assert b"ERROR another sender has connected" in stranger.recv(300)


def test_one_who_comes_while_the_place_is_taken_tries_again(tmp_path: Path) -> None:
    """For as long as someone without the key can hold it."""
    data = image("esp32s3", 40000)
    with receiver(tmp_path) as there:
        first, hello = greeted("127.0.0.1", there.port)
        first._put(f"9999 {'0' * 64}".encode())
        second = Upload("127.0.0.1", there.port)  # displaces the first, whose address may not return meanwhile
        second.hello()
        timer = threading.Timer(1.0, second.close)
        timer.start()
        upload, hello = greeted("127.0.0.1", there.port)
        upload.send(hello, signed(data), PASSWORD, lambda *_: None)
        upload.close()
        timer.join()
        first.close()


def test_a_wrong_key_is_told_and_writes_nothing(tmp_path: Path) -> None:
    build = make_build(tmp_path / "build", BOARD, "esp32s3")
    with receiver(tmp_path) as there:
        run = flash(build, there.port, "wrong horse")
        assert run.returncode == Exit.FLASH and "wrong access key" in run.stderr and "hint" in run.stderr
        assert not there.slot.exists()


def test_only_who_has_built_the_running_firmware_updates_it(tmp_path: Path) -> None:
    """The access key is right each time: a program on a trusted computer may have it, too."""
    build = make_build(tmp_path / "build", BOARD, "esp32s3")
    firmware = (build / "firmware.bin").read_bytes()
    good, stranger = signing_key().sign(firmware), signing_key({VARIABLE: pem(21)}).sign(firmware)
    half = raw_signature(good or b"")[:32]
    bad = [raw_signature(stranger or b""), half + half, half + bytes(32), bytes(64), b"\xff" * 64]
    with receiver(tmp_path) as there:
        for signature in bad:
            upload = Upload("127.0.0.1", there.port)
            with pytest.raises(FlashError, match="not signed with the key") as refused:
                upload.send(upload.hello(), Signed(firmware, signature), PASSWORD, lambda *_: None)
            assert "docs/security.md" in str(refused.value.hint)
            upload.close()
            assert not there.slot.exists()


@pytest.mark.parametrize(("signature", "why"), [(None, "missing"), (b"nothing", "damaged")])
def test_what_is_not_signed_is_not_sent(tmp_path: Path, signature: bytes | None, why: str) -> None:
    """A build with a public key alone, or of an earlier version."""
    build = make_build(tmp_path / "build", BOARD, "esp32s3")
    record = json.loads((build / "build.json").read_text())
    record["artefacts"] = [row for row in record["artefacts"] if row["name"] != "firmware.sig"]
    (build / "build.json").write_text(json.dumps(record))
    (build / "firmware.sig").unlink()
    if signature is not None:
        (build / "firmware.sig").write_bytes(signature)
    run = flash(build, 1, PASSWORD, "--dry-run")
    assert run.returncode == Exit.FLASH and f"signature of this firmware is {why}" in run.stderr


def test_another_board_is_refused_before_a_key_is_asked_for(tmp_path: Path) -> None:
    build = make_build(tmp_path / "build", "esp32s3-devkitc", "esp32s3")
    with receiver(tmp_path) as there:
        run = flash(build, there.port, PASSWORD, board="esp32s3-devkitc")
    assert run.returncode == Exit.FLASH and "esp32s3-zero" in run.stderr


def test_the_receiver_refuses_the_firmware_of_another_board_of_the_chip(tmp_path: Path) -> None:
    """It was signed by the same project, and would drive the wrong pins."""
    firmware = image("esp32s3", 300_000, board="esp32s3-devkitc")
    with receiver(tmp_path) as there:
        upload = Upload("127.0.0.1", there.port)
        with pytest.raises(FlashError, match=f"for the board esp32s3-devkitc, and this board is {BOARD}") as refused:
            upload.send(upload.hello(), signed(firmware), PASSWORD, lambda *_: None)
        assert "--other-board" in str(refused.value.hint)
        upload.close()
        assert not there.slot.exists()
    with receiver(tmp_path) as there:
        own = Upload("127.0.0.1", there.port)
        own.send(own.hello(), signed(image("esp32s3", 300_000, board=BOARD)), PASSWORD, lambda *_: None)
        own.close()
        assert there.slot.exists()


def test_another_board_can_be_meant(tmp_path: Path) -> None:
    build = make_build(tmp_path / "build", "esp32s3-devkitc", "esp32s3", named=True)
    with receiver(tmp_path) as there:
        run = flash(build, there.port, PASSWORD, board="esp32s3-devkitc")
        assert run.returncode == Exit.FLASH and "--other-board" in run.stderr and not there.slot.exists()
        run = flash(build, there.port, PASSWORD, "--other-board", board="esp32s3-devkitc")
        assert run.returncode == 0, run.stderr
    assert there.slot.read_bytes() == (build / "firmware.bin").read_bytes()


def test_a_build_whose_record_is_of_another_board_is_refused(tmp_path: Path) -> None:
    """Before anyone is connected to, over the network and over USB."""
    build = make_build(tmp_path / "build", "esp32s3-devkitc", "esp32s3", named=True)
    record = (build / "build.json").read_text().replace("esp32s3-devkitc", BOARD)
    (build / "build.json").write_text(record)
    run = flash(build, 1, PASSWORD)
    assert run.returncode == Exit.FLASH and f"is for the board esp32s3-devkitc, not for {BOARD}" in run.stderr
    usb = [sys.executable, "-m", "wificnc", "flash", BOARD, "--from", str(build), "--dry-run"]
    run = subprocess.run(usb, capture_output=True, text=True, timeout=HANG_S, cwd=HERE, check=False)
    assert run.returncode == Exit.FLASH and f"is for the board esp32s3-devkitc, not for {BOARD}" in run.stderr


def test_a_firmware_for_another_chip_is_refused_by_the_receiver(tmp_path: Path) -> None:
    with receiver(tmp_path) as there:
        upload = Upload("127.0.0.1", there.port)
        with pytest.raises(FlashError, match="another chip"):
            upload.send(upload.hello(), signed(image("esp32", 300_000)), PASSWORD, lambda *_: None)
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
            upload.send(upload.hello(), signed(firmware), PASSWORD, cut)
        upload.close()
        assert flash(build, there.port, PASSWORD).returncode == 0
    assert there.slot.read_bytes() == firmware


def test_nobody_there_and_somebody_else_there_are_told(tmp_path: Path) -> None:
    build = make_build(tmp_path / "build", BOARD, "esp32s3")
    with answering(b"Grbl 1.1h ['$' for help]\r\n") as port:
        run = flash(build, port, PASSWORD)
        assert run.returncode == Exit.FLASH and "does not support the updates" in run.stderr
    run = flash(build, port, PASSWORD)
    assert run.returncode == Exit.FLASH and "discover" in run.stderr


def test_dry_run_connects_to_nobody(tmp_path: Path) -> None:
    build = make_build(tmp_path / "build", BOARD, "esp32s3")
    run = flash(build, 1, PASSWORD, "--dry-run")
    assert run.returncode == 0 and "127.0.0.1:1" in run.stdout
