"""The ESP32's controller task as a process of this computer, with its page."""

from __future__ import annotations

import subprocess
from collections.abc import Iterable, Iterator
from contextlib import contextmanager
from functools import cache
from pathlib import Path
from typing import NamedTuple

from patience import HANG_S
from wificnc.board.header import pin_header_text, write_if_changed
from wificnc.board.load import load_board
from wificnc.build.checkout import checkout_root
from wificnc.build.host import build_program
from wificnc.web.embed import EmbeddedFile, page_header_text

BOARD = "esp32s3-devkitc"
FINISH, HOLD, STOP = "0", "1", "2"  # $74
ESP32 = checkout_root() / "targets" / "esp32"
SOURCES = (Path(__file__).parent / "telnet_serve.c", ESP32 / "app" / "controller.c", ESP32 / "net" / "page.c")


class Ports(NamedTuple):
    telnet: int
    page: int


@cache
def program(files: tuple[EmbeddedFile, ...] = ()) -> Path:
    """The program with these files as its page."""
    text = page_header_text(files)
    folder = checkout_root() / "build" / "tests" / f"telnet_serve-{len(files)}"
    write_if_changed(folder / "board" / "pin_config.h", pin_header_text(load_board(BOARD)))
    write_if_changed(folder / "board" / "page_files.h", text)
    return build_program(SOURCES, folder / "telnet_serve", "release", [f"-I{ESP32}", f"-I{folder / 'board'}"])


@contextmanager
def serving_esp32(key: str = "", sender_lost: str = FINISH, files: Iterable[EmbeddedFile] = ()) -> Iterator[Ports]:
    process = subprocess.Popen(
        [program(tuple(files)), key, sender_lost], stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True
    )
    assert process.stdin and process.stdout
    try:
        telnet, page = map(int, process.stdout.readline().split())
        yield Ports(telnet, page)
    finally:
        process.stdin.close()
        assert process.wait(HANG_S) == 0
        process.stdout.close()
