"""docs/example.md, done: its commands in their order, each with the output that the page has.

Blocks of `console` are commands with their output, those with a title are files. `…` is any text. A comment
`hand: LINE` is what the reader does at the machine: that line goes to the control port of the simulated one.
"""

from __future__ import annotations

import os
import re
import socket
import subprocess
import sys
from collections.abc import Callable, Iterator
from contextlib import ExitStack
from dataclasses import dataclass
from pathlib import Path

import pytest
from chip import make_build, mock_chip
from patience import HANG_S
from wificnc.board.load import load_board
from wificnc.build.checkout import checkout_root
from wificnc.simulator.serve.options import Address, ServeOptions
from wificnc.simulator.serve.server import Server

pytest.importorskip("esp32_mock_bootloader")
ROOT = checkout_root()
BOARD = "esp32s3-zero"
TEXT = (ROOT / "docs" / "example.md").read_text(encoding="utf-8")
PART = re.compile(r'<!-- hand: (.+?) -->|^```(\w+)(?: title="(.+?)")?\n(.*?)^```$', re.DOTALL | re.MULTILINE)
OF_A_CHIP = ("wificnc flash ",)
OF_THE_MOCK = "WARNING: Chip was NOT reset."  # a pseudo-terminal has no RTS


@dataclass(frozen=True)
class Command:
    """A line after `$`, and the lines that it prints."""

    line: str
    output: str


def commands(block: str) -> list[Command]:
    parts = re.split(r"^\$ (.+)\n", block, flags=re.MULTILINE)
    assert parts[0] == "", "output without its command"
    return [Command(line, output) for line, output in zip(parts[1::2], parts[2::2], strict=True)]


def pattern_of(output: str) -> re.Pattern[str]:
    """`…` alone on a line is any lines, also none; within a line it is any text."""
    escaped = [re.escape(line) for line in output.splitlines()]
    lines = [r"(?:[^\n]*\n)*?" if line == "…" else line.replace("…", r"[^\n]*") + "\n" for line in escaped]
    return re.compile("".join(lines))


@pytest.mark.parametrize(
    ("output", "said", "fits"),
    [
        ("a\nb\n", "a\nb\n", True), ("a\nb\n", "a\n", False), ("a\n", "a\nb\n", False), ("a …!\n", "a 1!\n", True),
        ("a\n…\nb\n", "a\n1\n2\nb\n", True), ("a\n…\nb\n", "a\nb\n", True), ("a\n…\n", "a\n1\n", True),
        ("a …\n", "a 1\n2\n", False), ("…\nb\n", "b\nc\n", False), ("a (1)\n", "a (1)\n", True),
    ],
)  # fmt: skip
def test_a_difference_is_found(output: str, said: str, fits: bool) -> None:
    assert bool(pattern_of(output).fullmatch(said)) is fits


@pytest.fixture
def server() -> Iterator[Server]:
    """A board as it is after flashing: its own defaults, without a profile."""
    options = ServeOptions(board=load_board(BOARD), tcp=Address("127.0.0.1", 0), control=0, speed=0.0)
    with Server(options) as served:
        yield served


@pytest.fixture
def shell(tmp_path: Path) -> Iterator[Callable[[str, str], str]]:
    """Run a line in a folder of its own, for a controller; what it prints on both streams."""
    with ExitStack() as stack:
        build = make_build(tmp_path / "build", BOARD, "esp32s3")
        mock = stack.enter_context(mock_chip("esp32s3", tmp_path / "mock"))
        environment = {**os.environ, "COLUMNS": "100", "WIFICNC_PORT": mock.port}
        environment["PATH"] = f"{Path(sys.executable).parent}{os.pathsep}{environment['PATH']}"

        def run(line: str, to: str) -> str:
            if line.startswith(OF_A_CHIP):
                line += f" --from {build} --wait 0"
            done = subprocess.run(
                ["sh", "-c", line], cwd=tmp_path, env=environment | {"WIFICNC_TO": to}, timeout=HANG_S, text=True,
                stdin=subprocess.DEVNULL, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, check=False,
            )  # fmt: skip
            lines = [said.rstrip() for said in done.stdout.splitlines() if not said.startswith(OF_THE_MOCK)]
            return "".join(f"{said}\n" for said in lines)

        yield run


def hand(server: Server, line: str) -> None:
    host, _, port = server.control.rpartition(":")
    with socket.create_connection((host, int(port)), timeout=HANG_S) as control:
        control.sendall(line.encode() + b"\n")
        assert control.recv(100) == b"ok\n", line


def test_every_command_prints_what_the_page_has(
    server: Server, shell: Callable[[str, str], str], tmp_path: Path
) -> None:
    done = 0
    for doing, language, title, block in PART.findall(TEXT):
        if doing:
            hand(server, doing)
        elif title:
            (tmp_path / title).write_text(block, encoding="utf-8")
        for command in commands(block) if language == "console" else []:
            said = shell(command.line, server.tcp)
            assert pattern_of(command.output).fullmatch(said), f"$ {command.line}\n{said}"
            done += 1
    assert done > 20
