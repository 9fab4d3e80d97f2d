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
from wificnc.firmware.page_header import EmbeddedFile, page_header_text

BOARD = "esp32s3-devkitc"
FINISH, HOLD, STOP = "0", "1", "2"  # $74
ESP32 = checkout_root() / "targets" / "esp32"
HERE = Path(__file__).parent


class Ports(NamedTuple):
    telnet: int
    page: int


PARTS = ("app/controller.c", "net/page.c")
CONTACT = ("net/light.c", "net/portal.c", "net/wifi_policy.c", "net/wiring_page.c")


@cache
def program(files: tuple[EmbeddedFile, ...] = (), name: str = "telnet_serve") -> Path:
    """The program with these files as its page."""
    text = page_header_text(files)
    folder = checkout_root() / "build" / "tests" / f"{name}-{len(files)}"
    parts = PARTS if name == "telnet_serve" else (*PARTS, *CONTACT)
    sources = [HERE / f"{name}.c", *(ESP32 / part for part in parts)]
    write_if_changed(folder / "board" / "pin_config.h", pin_header_text(load_board(BOARD)))
    write_if_changed(folder / "board" / "page_files.h", text)
    return build_program(sources, folder / name, "release", [f"-I{ESP32}", f"-I{folder / 'board'}"])


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


class Contact:
    """A controller fresh from the box, the networks around it, and the phone's place among them; see
    first_contact.c."""

    def __init__(self, process: subprocess.Popen[str]) -> None:
        self._process = process
        assert process.stdout
        self.page, self.names = map(int, process.stdout.readline().split())

    def tell(self, line: str) -> str:
        """@return the network that is stored, + when it is on trial; whether the own one is up; the status light"""
        assert self._process.stdin and self._process.stdout
        self._process.stdin.write(f"{line}\n")
        self._process.stdin.flush()
        return self._process.stdout.readline().strip()

    def pass_s(self, seconds: float) -> str:
        return self.tell(f"pass {1000 * seconds:.0f}")


@contextmanager
def first_contact(key: str, files: Iterable[EmbeddedFile] = ()) -> Iterator[Contact]:
    process = subprocess.Popen(
        [program(tuple(files), "first_contact"), key], stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True
    )
    assert process.stdin and process.stdout
    try:
        yield Contact(process)
    finally:
        process.stdin.close()
        assert process.wait(HANG_S) == 0
        process.stdout.close()
