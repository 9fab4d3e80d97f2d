"""The ESP32's page that takes updates, as a process of this computer; see update_serve.c."""

from __future__ import annotations

import subprocess
from collections.abc import Iterable, Iterator
from contextlib import contextmanager
from pathlib import Path

import pytest
from esp32_serve import BOARD, ESP32, HERE, PARTS
from patience import HANG_S
from wificnc.board.header import pin_header_text, write_if_changed
from wificnc.board.load import load_board
from wificnc.build.checkout import checkout_root
from wificnc.build.host import build_program
from wificnc.build.signing import key_header_text, signing_key
from wificnc.firmware.page_header import EmbeddedFile, page_header_text

SLOT_SIZE = 200_000


class Receiver:
    """Where its page and its lines are, and the slot that an update fills."""

    def __init__(self, process: subprocess.Popen[str], slot: Path) -> None:
        self._process = process
        self.slot = slot
        assert process.stdout
        self.telnet, self.page = map(int, process.stdout.readline().split())

    def return_to_old(self) -> None:
        """The next update does not stay: the old firmware starts again."""
        assert self._process.stdin
        self._process.stdin.write("o")
        self._process.stdin.flush()

    def is_reached(self) -> bool:
        """Someone who may command is connected over the network."""
        assert self._process.stdin and self._process.stdout
        self._process.stdin.write("\n")
        self._process.stdin.flush()
        return self._process.stdout.readline() == "reached=1\n"


def program(files: tuple[EmbeddedFile, ...]) -> Path:
    """With the mbedTLS of this computer."""
    if not Path("/usr/include/mbedtls/ecdsa.h").exists():
        pytest.skip("no mbedTLS: apt-get install libmbedtls-dev")
    folder = checkout_root() / "build" / "tests" / f"update_serve-{len(files)}"
    write_if_changed(folder / "board" / "pin_config.h", pin_header_text(load_board(BOARD)))
    write_if_changed(folder / "board" / "page_files.h", page_header_text(files))
    write_if_changed(folder / "board" / "signing_key.h", key_header_text(signing_key()))
    parts = (*PARTS, "net/ota.c", "net/signature.c")
    sources = [HERE / "update_serve.c", *(ESP32 / part for part in parts)]
    flags = [f"-I{ESP32}", f"-I{folder / 'board'}", "-Wl,--no-as-needed", "-lmbedcrypto"]
    return build_program(sources, folder / "update_serve", "release", flags)


@contextmanager
def receiver(key: str, slot: Path, files: Iterable[EmbeddedFile] = ()) -> Iterator[Receiver]:
    process = subprocess.Popen(
        [program(tuple(files)), key, slot], stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True
    )
    assert process.stdin and process.stdout
    try:
        yield Receiver(process, slot)
    finally:
        process.stdin.close()
        assert process.wait(HANG_S) == 0
        process.stdout.close()
