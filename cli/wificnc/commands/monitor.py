"""`wificnc monitor`: talk to a controller by hand, or from a script's stdin."""

from __future__ import annotations

import os
import select
import sys
import time
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path

import rich_click as click

from wificnc import ui
from wificnc.build.esp32 import core_directory
from wificnc.commands._target import target_option
from wificnc.connection.backtrace import Decoder, find_tool
from wificnc.connection.client import ANSWER_S
from wificnc.connection.grbl import Error, LineSplitter, Ok, parse
from wificnc.connection.transport import Transport, open_transport
from wificnc.connection.typed import typed_line
from wificnc.console import ConsoleKeys, allow_escapes
from wificnc.errors import LinkError, UserError

REALTIME = frozenset("!~?\x18")
GONE = "\x04"
END_KEYS = frozenset(f"\x03{GONE}\x1d")  # Ctrl-C, Ctrl-D, Ctrl-]
ERASE_KEYS = frozenset("\x7f\x08")
READ_EVERY_S = 0.1

if sys.platform != "win32":
    import termios


@click.command()
@target_option
@click.option("--time", "stamps", is_flag=True, help="Put the time in front of every line.")
@click.option("--elf", type=click.Path(path_type=Path, dir_okay=False, exists=True),
              help="build/BOARD/firmware.elf: names the functions in a crash backtrace.")  # fmt: skip
def command(target: str, stamps: bool, elf: Path | None) -> None:
    """Show all output of a controller, and send it what is typed.

    A line is sent with Enter; ! ~ ? and Ctrl-X act immediately. Ctrl-C ends the monitor and does not affect the
    machine.
    Lines from a pipe are sent one by one, each after the answer to the previous one.
    """
    decoder = Decoder(elf, find_tool(core_directory() / "packages")) if elf is not None else None
    transport = open_transport(target)
    try:
        if sys.stdin.isatty():
            ui.note(f"{transport.name}: Enter sends, ! ~ ? Ctrl-X act immediately, Ctrl-C ends")
            with single_keys() as keys, suppress(KeyboardInterrupt):
                Typing(transport, keys, stamps, decoder).run()
        else:
            feed_lines(transport, sys.stdin.read().splitlines(), stamps, decoder)
    finally:
        transport.close()


def stamped(line: str, stamps: bool) -> str:
    now = time.time()
    clock = time.strftime("%H:%M:%S", time.localtime(now))
    return f"{clock}.{int(now * 1000) % 1000:03d}  {line}" if stamps else line


def explained(line: str, decoder: Decoder | None) -> list[str]:
    """A line, and what it means when it is a backtrace."""
    return [line, *(decoder.decode(line) if decoder is not None else [])]


def feed_lines(transport: Transport, lines: list[str], stamps: bool, decoder: Decoder | None = None) -> None:
    """Each line after the answer to the one before. Raises LinkError when one is not answered."""
    splitter = LineSplitter()
    for line in lines:
        transport.send(line.encode() if _is_realtime(line) else typed_line(line))
        deadline = time.monotonic() + (READ_EVERY_S if _is_realtime(line) else ANSWER_S)
        answered = False
        while not answered and time.monotonic() < deadline:
            transport.wait(deadline - time.monotonic())
            for said in splitter.take(transport.receive()):
                for text in explained(said, decoder):
                    print(stamped(text, stamps), flush=True)
                answered = answered or isinstance(parse(said), (Ok, Error))
        if not answered and not _is_realtime(line):
            raise LinkError(f"{transport.name} has not answered {line!r}")


def _is_realtime(line: str) -> bool:
    return len(line) == 1 and line in REALTIME


class TerminalKeys:
    """A terminal in the mode of single_keys()."""

    def __init__(self, fd: int) -> None:
        self._fd = fd

    def fileno(self) -> int:
        return self._fd

    def read(self) -> str:
        """Keys since the last call. A terminal that went away is a request to end."""
        if not select.select([self._fd], [], [], 0)[0]:
            return ""
        return os.read(self._fd, 256).decode("utf-8", "replace") or GONE


@contextmanager
def single_keys() -> Iterator[TerminalKeys | ConsoleKeys]:
    """Every key immediately and unseen, Ctrl-C too; the terminal is given back as it was."""
    if sys.platform == "win32":
        allow_escapes()
        with ConsoleKeys() as keys:
            yield keys
    else:
        fd = sys.stdin.fileno()
        saved = termios.tcgetattr(fd)
        mode = termios.tcgetattr(fd)
        mode[0] &= ~termios.IXON
        mode[3] &= ~(termios.ICANON | termios.ECHO | termios.ISIG)
        mode[6][termios.VMIN], mode[6][termios.VTIME] = 1, 0
        termios.tcsetattr(fd, termios.TCSANOW, mode)
        try:
            yield TerminalKeys(fd)
        finally:
            termios.tcsetattr(fd, termios.TCSANOW, saved)


class Typing:
    """A line editor of one line below what the controller says."""

    def __init__(
        self, transport: Transport, keys: TerminalKeys | ConsoleKeys, stamps: bool, decoder: Decoder | None = None
    ) -> None:
        self.transport = transport
        self.keys = keys
        self.decoder = decoder
        self.stamps = stamps
        self.typed = ""
        self.splitter = LineSplitter()

    def run(self) -> None:
        while True:
            self.transport.wait(60.0, [self.keys.fileno()])
            for line in self.splitter.take(self.transport.receive()):
                for text in explained(line, self.decoder):
                    self._show(stamped(text, self.stamps))
            keys = self.keys.read()
            if END_KEYS & frozenset(keys):
                self._show("")
                return
            for key in keys:
                self._take(key)

    def _take(self, key: str) -> None:
        if key in REALTIME:
            self.transport.send(key.encode())
        elif key in "\r\n":
            line, self.typed = self.typed, ""
            try:
                self.transport.send(typed_line(line))
            except UserError as err:
                self._show(stamped(err.message, self.stamps))
            else:
                self._show(stamped(f"> {line}", self.stamps))
        elif key in ERASE_KEYS:
            self.typed = self.typed[:-1]
            self._show(None)
        elif key.isprintable():
            self.typed += key
            self._show(None)

    def _show(self, line: str | None) -> None:
        """Put a line above the one that is being typed."""
        said = "" if line is None else f"{line}\n"
        sys.stdout.write(f"\r\x1b[K{said}{self.typed}")
        sys.stdout.flush()
