"""What controllers say: read, written and read again."""

from __future__ import annotations

import pytest
from hypothesis import given
from hypothesis import strategies as st
from wificnc.connection.grbl import (
    LINE_MAX,
    Alarm,
    Banner,
    Bracket,
    Error,
    LineSplitter,
    Message,
    Ok,
    Options,
    Other,
    ProbeResult,
    SettingLine,
    StartupLine,
    Status,
    form,
    parse,
    parse_options,
    parse_probe,
)

CODES = st.integers(0, 9999)
TEXT = st.text(st.characters(min_codepoint=0x20, max_codepoint=0x7E), max_size=60)
POSITIONS = st.lists(st.integers(-(10**8), 10**8), min_size=1, max_size=6).map(lambda v: tuple(i / 1000 for i in v))
PERCENT = st.integers(0, 200)
STATUS = st.builds(
    Status,
    state=st.sampled_from(["Idle", "Run", "Hold", "Jog", "Alarm", "Door", "Check", "Home", "Sleep"]),
    substate=st.none() | st.integers(0, 3),
    mpos=POSITIONS,
    wco=st.none() | POSITIONS,
    feed=st.integers(0, 99999).map(float),
    speed=st.integers(0, 99999).map(float),
    pins=st.sampled_from(["", "P", "XYZ", "PXYZDRHS"]),
    line=st.none() | st.integers(0, 10**7),
    overrides=st.none() | st.tuples(PERCENT, PERCENT, PERCENT),
    accessories=st.sampled_from(["", "SF", "CM"]),
    other=st.lists(st.tuples(st.sampled_from(["SD", "Buf"]), st.from_regex(r"[0-9.]{1,6}", fullmatch=True))).map(tuple),
)
MESSAGES = st.one_of(
    st.just(Ok()),
    st.builds(Error, CODES),
    st.builds(Alarm, CODES),
    st.just(Banner("Grbl", "1.1h")),
    st.builds(SettingLine, st.integers(0, 255), st.from_regex(r"[0-9]{1,6}(\.[0-9]{3})?", fullmatch=True)),
    st.builds(Bracket, st.sampled_from(["MSG", "GC", "G54", "PRB", "VER", "OPT", "HLP", "G59.3"]), TEXT),
    st.builds(StartupLine, TEXT, st.sampled_from(["ok", "error:22"])),
    STATUS,
)


@given(MESSAGES)
def test_round_trip(message: Message) -> None:
    assert parse(form(message)) == message


@given(st.lists(MESSAGES, max_size=8), st.data())
def test_lines_however_they_are_cut(messages: list[Message], data: st.DataObject) -> None:
    wire = b"".join(form(message).encode() + b"\r\n" for message in messages)
    splitter, lines, at = LineSplitter(), [], 0
    while at < len(wire):
        size = data.draw(st.integers(1, len(wire) - at))
        lines += splitter.take(wire[at : at + size])
        at += size
    assert [parse(line) for line in lines] == [parse(form(message).strip()) for message in messages]


@given(st.binary(max_size=200))
def test_nothing_that_comes_is_an_error(data: bytes) -> None:
    for line in LineSplitter().take(data + b"\n"):
        parse(line)


def test_status_report() -> None:
    text = (
        "<Hold:1|WPos:1.000,-2.500,0.000|Bf:14,127|Ln:7|FS:800,12000|Pn:PXZ"
        "|WCO:5.000,0.000,0.000|Ov:100,50,120|A:SF|T:3>"
    )
    assert parse(text) == Status(
        "Hold", 1, None, (1.0, -2.5, 0.0), 14, 127, 7, 800.0, 12000.0, "PXZ", (5.0, 0.0, 0.0), (100, 50, 120), "SF",
        (("T", "3"),),
    )  # fmt: skip


def test_measured_speed_and_current() -> None:
    """As grblHAL: the third number of FS."""
    found = parse("<Run|MPos:0.000,0.000,0.000|FS:800,12000,11950|Amp:3.1>")
    assert isinstance(found, Status)
    assert (found.feed, found.speed, found.measured, found.ampere) == (800.0, 12000.0, 11950.0, 3.1)


@pytest.mark.parametrize(
    "text",
    ["<>", "<Idle>", "<Idle|MPos:1,x,2>", "<Idle|MPos:0,0,0|Ov:1,2>", "error:", "error:x", "ALARM:", "HTTP/1.1 400"],
)
def test_nonsense_is_other(text: str) -> None:
    assert parse(text) == Other(text)


@pytest.mark.parametrize("text", ["Grbl 1.1h ['$' for help]", "GrblHAL 1.1f ['$' or '$HELP' for help]", "Grbl 3.9 [x]"])
def test_banners(text: str) -> None:
    assert isinstance(parse(text), Banner)


def test_endless_line_is_cut() -> None:
    splitter = LineSplitter()
    assert len(splitter.take(b"x" * (LINE_MAX + 1))) == 1
    assert splitter.take(b"ok\n") == ["ok"]


def test_option_sizes() -> None:
    assert parse_options("V,15,128") == Options("V", 15, 128)
    assert parse_options("VNMLS,63,1024,6,0") == Options("VNMLS", 63, 1024)
    assert parse_options("V") is None
    assert parse_options("V,a,b") is None


def test_probe_result() -> None:
    assert parse_probe("1.000,2.000,-3.250:1") == ProbeResult((1.0, 2.0, -3.25), True)
    assert parse_probe("0.000,0.000,0.000:0") == ProbeResult((0.0, 0.0, 0.0), False)
    assert parse_probe("nonsense") is None
