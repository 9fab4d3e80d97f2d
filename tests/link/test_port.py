"""One home for the port: what `wificnc serve` opens is what a target without a port means."""

from __future__ import annotations

import re
from pathlib import Path

from wificnc.build.host import FOLDERS
from wificnc.connection.port import BOARD_PORT, SERVE_PORT
from wificnc.simulator.serve.options import DEFAULT_TCP, Address, parse_address

ROOT = Path(__file__).parents[2]


def test_serve_listens_where_targets_look() -> None:
    assert parse_address(DEFAULT_TCP) == parse_address("127.0.0.1") == Address("127.0.0.1", SERVE_PORT)


def test_the_number_is_written_once() -> None:
    sources = [*ROOT.glob("cli/**/*.py"), *(path for folder in FOLDERS for path in ROOT.glob(f"{folder}/*.[ch]"))]
    number = re.compile(rf"(?:=|\") *\"?{SERVE_PORT}\"?\s*[,;)\n]")
    homes = [path.name for path in sources if number.search(path.read_text(encoding="utf-8"))]
    assert homes == ["port.py"]


def test_the_port_of_a_board_is_what_its_firmware_opens() -> None:
    opened = re.search(r"TELNET_PORT = (\d+)", (ROOT / "targets/esp32/main/online.c").read_text(encoding="utf-8"))
    assert opened and int(opened[1]) == BOARD_PORT
