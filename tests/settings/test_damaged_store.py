"""Damage to what is stored: it is never silent, nothing moves until it is acknowledged, and the copy is kept."""

from __future__ import annotations

import re
import struct
import zlib
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import pytest
from grbl_host import BANNER, Grbl
from slow import deep_but

VALUES = ["$100=640", "$110=1234.5", "$22=1", "$20=1", "G10L2P3X1.5Y-2", "G10L1P5Z-3", "$N0=G21", "$I=SHOP"]
EVERY = 5
DAMAGED = "[MSG:Stored data is damaged: "
ACKNOWLEDGE = ". Check $$ $# $N, then $ACK]\r\n"
SETTINGS, OFFSETS, STARTUP, INFO, MORE, TOOLS = range(1, 7)


@contextmanager
def started(store: Path) -> Iterator[tuple[Grbl, str]]:
    """A controller with this store, and what it says at power-on."""
    controller = Grbl(store=store)
    try:
        yield controller, controller.send("")
    finally:
        controller.close()


def values(controller: Grbl) -> str:
    said = controller.send("$$\n$#\n$N\n")
    return "".join(line + "\n" for line in said.splitlines() if re.match(r"\$|\[(G5|G28|G30|T)", line))


@pytest.fixture
def store(tmp_path: Path) -> Path:
    """Settings, offsets, a tool and a startup line; each was stored more than once."""
    path = tmp_path / "kept"
    with started(path) as (controller, _):
        controller.send("$100=77\nG10L2P3X9\n")
        assert "error" not in controller.send("$X\n" + "\n".join(VALUES) + "\n")
    return path


def records(image: bytes) -> dict[int, bytes]:
    found, at = {}, 0
    while at < len(image):
        count = struct.unpack_from("<H", image, at + 2)[0]
        found[image[at]] = image[at + 4 : at + 4 + count]
        at += 4 + count
    return found


def file_of(values: dict[int, bytes]) -> bytes:
    return b"".join(struct.pack("<BBH", key, key ^ 0xFF, len(value)) + value for key, value in values.items())


def sealed(payload: bytes, version: int = 1) -> bytes:
    """A value as core/settings/store.c writes it."""
    rest = struct.pack("<HH", version, len(payload)) + payload
    return struct.pack("<I", zlib.crc32(rest)) + rest


@pytest.mark.slow
@pytest.mark.parametrize("first", deep_but((0).__eq__, range(EVERY)))
def test_no_flipped_bit_is_silent(store: Path, first: int) -> None:
    """Each bit of the file in turn, in CI every fifth: all values are as they were, or the machine is locked and says
    why."""
    whole = store.read_bytes()
    with started(store) as (controller, said):
        assert DAMAGED not in said
        right = values(controller)
    for bit in range(first, 8 * len(whole), EVERY):
        image = bytearray(whole)
        image[bit // 8] ^= 1 << bit % 8
        store.write_bytes(image)
        with started(store) as (controller, said):
            if DAMAGED in said:
                assert "<Alarm|" in controller.send("?")
                assert "error:7" in controller.send("$X\n")
            else:
                assert values(controller) == right, f"bit {bit} of byte {bit // 8}"


@pytest.mark.parametrize("keep", range(0, 100, 3))
def test_a_file_that_ends_early_is_damage(store: Path, keep: int) -> None:
    whole = store.read_bytes()
    store.write_bytes(whole[: len(whole) * keep // 100])
    with started(store) as (_, said):
        assert (DAMAGED in said) == (keep > 0)  # an empty file is a new one


def damage(store: Path, key: int, at: int = -1) -> None:
    """One bit of the value of a key."""
    kept = records(store.read_bytes())
    value = bytearray(kept[key])
    value[at] ^= 1
    store.write_bytes(file_of({**kept, key: bytes(value)}))


def damage_setting(store: Path, number: int) -> None:
    payload = records(store.read_bytes())[SETTINGS][8:]
    index = next(i for i in range(0, len(payload), 8) if struct.unpack_from("<H", payload, i)[0] == number)
    damage(store, SETTINGS, 8 + index + 5)


def test_one_damaged_setting_does_not_take_the_others_along(store: Path) -> None:
    damage_setting(store, 110)
    with started(store) as (controller, said):
        assert said.endswith(BANNER + DAMAGED + "settings $110" + ACKNOWLEDGE)
        shown = controller.send("$$\n")
        assert "$100=640.000" in shown and "$20=1" in shown and "$110=500.000" in shown
        assert "[G56:1.500,-2.000,0.000]" in controller.send("$#\n")


@pytest.mark.parametrize(
    ("key", "name"),
    [(OFFSETS, "work offsets"), (STARTUP, "startup lines"), (INFO, "$I text"), (MORE, "G59.1"), (TOOLS, "tool table")],
)
def test_a_damaged_value_is_named(store: Path, key: int, name: str) -> None:
    damage(store, key)
    with started(store) as (controller, said):
        assert DAMAGED + name in said
        assert "$100=640.000" in controller.send("$$\n")


def test_it_is_said_until_it_is_acknowledged(store: Path) -> None:
    """To whoever comes later, too: no one listens at power-on."""
    damage_setting(store, 100)
    with started(store) as (controller, _):
        for line in ("$$\n", "$I\n", "$X\n", "$H\n", "\x18"):
            assert DAMAGED + "settings $100" in controller.send(line), line
        assert controller.send("$ACK\n").endswith("[MSG:'$H'|'$X' to unlock]\r\nok\r\n")
        for line in ("$$\n", "$I\n", "\x18", "$X\n"):
            assert DAMAGED not in controller.send(line), line
    with started(store) as (_, said):
        assert DAMAGED not in said and "error" not in said


@pytest.mark.parametrize("line", ["$X", "$H", "$100=640", "$I=X", "$22=0"])
def test_nothing_but_questions_before_that(store: Path, line: str) -> None:
    damage_setting(store, 100)
    before = store.read_bytes()
    with started(store) as (controller, _):
        shown = values(controller)
        assert controller.send(line + "\n").endswith("error:7\r\n")
        assert "<Alarm|" in controller.send("?") and values(controller) == shown
        for other, answer in (
            ("G0X1", "error:9"),
            ("$J=G91X1F100", "error:8"),
            ("$C", "error:8"),
            ("$N0=G20", "error:8"),
        ):
            assert controller.send(other + "\n") == answer + "\r\n"
        assert controller.send("$G\n").endswith("ok\r\n") and controller.send("\n") == "ok\r\n"
        assert controller.send("$SLP\n\x18").endswith(ACKNOWLEDGE)
        assert "<Alarm|" in controller.send("?")
    assert store.read_bytes() == before


@pytest.mark.parametrize("line", ["$ACK", "$RST=$", "$RST=#", "$RST=*"])
def test_the_damaged_copy_is_kept(store: Path, line: str) -> None:
    damage_setting(store, 100)
    before = store.read_bytes()
    with started(store) as (controller, _):
        assert "[MSG:Saved a copy of the damaged data]" in controller.send(line + "\n")
        assert "<Alarm|" in controller.send("?") or line == "$RST=$" or line == "$RST=*"
    assert store.with_name("kept.damaged").read_bytes() == before
    with started(store) as (controller, said):
        assert DAMAGED not in said
        assert ("$110=1234.500" in controller.send("$$\n")) == (line in ("$ACK", "$RST=#"))


@pytest.mark.parametrize("key", [OFFSETS, MORE])
@pytest.mark.parametrize("mm", [1e10, -1e10, float("nan"), float("inf")])
def test_a_stored_offset_out_of_range_is_damage(store: Path, key: int, mm: float) -> None:
    """Its CRC is right: a version with a fault has stored it."""
    kept = records(store.read_bytes())
    count = len(kept[key]) // 8 - 1
    for place in (0, count - 1):
        row = [0.0] * count
        row[place] = mm
        store.write_bytes(file_of({**kept, key: sealed(struct.pack(f"<{count}d", *row))}))
        with started(store) as (controller, said):
            assert DAMAGED in said
            assert "nan" not in controller.send("$#\n")


def test_a_stored_tool_out_of_range_is_damage(store: Path) -> None:
    kept = records(store.read_bytes())
    count = len(kept[TOOLS]) // 4 - 2
    store.write_bytes(file_of({**kept, TOOLS: sealed(struct.pack(f"<{count}f", *[0.0] * (count - 1), 1e9))}))
    with started(store) as (_, said):
        assert DAMAGED + "tool table" in said


@pytest.mark.parametrize("key", [SETTINGS, OFFSETS, STARTUP, TOOLS])
@pytest.mark.parametrize("fault", ["longer", "count", "version", "size"])
def test_a_value_of_another_size_is_damage(store: Path, key: int, fault: str) -> None:
    kept = records(store.read_bytes())
    payload, version = kept[key][8:], kept[key][4]
    wrong = {
        "longer": kept[key] + b"\0",
        "count": sealed(payload[:-8], version) + payload[-8:],
        "version": sealed(payload, version=7),
        "size": sealed(payload + bytes(3), version),
    }
    store.write_bytes(file_of({**kept, key: wrong[fault]}))
    with started(store) as (_, said):
        assert DAMAGED in said


@pytest.mark.parametrize(
    "line", ["$100=640", "$110=1234.5", "G10L2P3X1.5Y-2", "G10L1P5Z-3", "$N0=G21", "$I=SHOP", "G28.1"]
)
def test_what_is_stored_already_is_not_written_again(store: Path, line: str) -> None:
    with started(store) as (controller, _):
        controller.send("$X\nG28.1\n")
        before = (store.stat().st_ino, store.stat().st_mtime_ns)
        assert controller.send(line + "\n").endswith("ok\r\n")
        assert (store.stat().st_ino, store.stat().st_mtime_ns) == before
        controller.send("$101=99\n")
        assert (store.stat().st_ino, store.stat().st_mtime_ns) != before
