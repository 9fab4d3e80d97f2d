"""protocol/vfd.toml: a row that cannot be is refused, with its place and the reason."""

from __future__ import annotations

import re

import pytest
from wificnc.tables.vfd import VFD_PATH, load_vfds, parse_vfds

GOOD = """
schema = 1
[[vfd]]
number = 1
name = "drive"
title = "A drive"
framing = "modbus"
baud = 9600
parity = "none"
clockwise = { send = "06 20 00 00 01", answer = "echo" }
counter_clockwise = { send = "06 20 00 00 02", answer = "echo" }
stop = { send = "06 20 00 00 06", answer = "echo" }
set_speed = { send = "06 20 01 VV VV", answer = "echo", scale = "hz*10" }
read_speed = { send = "03 20 0B 00 01", answer = "03 02 VV VV", scale = "hz*10" }
settings = [["P0", "1"]]
source = "none"
"""


def test_the_table_is_good() -> None:
    assert parse_vfds(GOOD).vfd[0].name == "drive"
    assert parse_vfds(VFD_PATH.read_text(encoding="utf-8")) == load_vfds()


@pytest.mark.parametrize(
    ("old", "new", "reason"),
    [
        ('"06 20 00 00 01"', '"06 20 00 00 0x1"', "'0x1' is not a byte"),
        ('"06 20 00 00 01"', '"06 20 00 00"', "function 06 has a register and a value, 5 bytes; these are 4"),
        ('"06 20 00 00 01"', '"06 20 00 VV VV"', "a command has no value"),
        ('"06 20 00 00 01"', '"07 20 00 00 01"', "07 is not a function code"),
        ('"06 20 00 00 01"', '"06 20 00 00 02"', "must be different frames"),
        ('"06 20 00 00 01"', '"06 RR RR 00 01"', "RR stands for a setting"),
        ('"06 20 00 00 01"', '"06"', "1 bytes; a frame has 2 to 8"),
        ('"06 20 01 VV VV"', '"06 20 01 00 10"', "the value VV VV is missing"),
        ('"06 20 01 VV VV"', '"06 20 VV 01 VV"', "a value is VV VV, once"),
        ('"06 20 01 VV VV"', '"06 20 01 .. .."', ".. is any byte"),
        ('scale = "hz*10" }\nread', 'scale = "kHz" }\nread', "'kHz' is unknown"),
        ('"03 02 VV VV"', '"03 04 VV VV"', "1 registers are a count of 02"),
        ('"03 02 VV VV"', '"03 02 VV VV .. .."', "1 registers are a count of 02"),
        ('"03 02 VV VV"', '"04 02 VV VV"', "begins with another function code"),
        ('"03 20 0B 00 01"', '"03 20 0B 00 00"', "count of registers above 0"),
        ('framing = "modbus"', 'framing = "huanyang"', "the second byte must be the count"),
        ("baud = 9600", "baud = 9601", "9601 baud"),
        ("number = 1", "number = 2", "number 2, and 1 comes next"),
        ('name = "drive"', 'name = "Drive 1"', "pattern"),
    ],
)
def test_an_impossible_row(old: str, new: str, reason: str) -> None:
    assert old in GOOD
    with pytest.raises(ValueError, match=re.escape(reason)):
        parse_vfds(GOOD.replace(old, new, 1))


def test_a_reading_that_looks_like_its_echo() -> None:
    """Huanyang's: without another reading a bus that returns what is sent would pass for a drive."""
    text = VFD_PATH.read_text(encoding="utf-8")
    line = next(
        line for line in text.splitlines(keepends=True) if line.startswith("read_maximum") and "01 03 05" in line
    )
    with pytest.raises(ValueError, match=r"huanyang_v1\.read_speed: its answer at rest is the request"):
        parse_vfds(text.replace(line, ""))
