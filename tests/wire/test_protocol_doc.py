"""docs/protocol.md says all of protocol/wmc3.toml, and its examples are what they say, to both codecs."""

from __future__ import annotations

import hashlib
import hmac
import re
from dataclasses import fields, replace
from pathlib import Path

import pytest
from generate.examples import parse_examples
from generate.wire_table import Enum, Packet, WireStruct, parse_wire
from wificnc.connection.wmc3.keys import KEYS
from wificnc.connection.wmc3.layout import PACKETS, Authenticate, ChallengeResponse, Ping, Refusal
from wificnc.connection.wmc3.packet import build, parse
from wificnc.connection.wmc3.packing import Layout
from wificnc.connection.wmc3.remedies import REMEDIES
from wificnc.tables.nvs import load_nvs
from wificnc.tables.settings import load_settings
from wire_core import c_name, opens, rebuild

ROOT = Path(__file__).resolve().parents[2]
TEXT = (ROOT / "docs/protocol.md").read_text(encoding="utf-8")
TABLE = parse_wire((ROOT / "protocol/wmc3.toml").read_text(encoding="utf-8"), load_settings(), load_nvs())
BLOCKS = [block for block in re.findall(r"```text\n(.*?)\n *```", TEXT, re.S) if "header: 0x" in block]
NAMES = [re.findall(r"header: 0x\w\w (\w+)", block)[0] for block in BLOCKS]


def bytes_of(block: str) -> bytes:
    """The left column: hex, and so many zeros."""
    data = b""
    for line in block.splitlines():
        shown = re.split(r"  +", line.strip())[0]
        for token in re.findall(r"\d+ x 00|[0-9a-f]+", shown):
            zeros = re.fullmatch(r"(\d+) x 00", token)
            data += bytes(int(zeros[1])) if zeros else bytes.fromhex(token)
    return data


def said(block: str) -> list[tuple[str, str]]:
    """The right column: (field, value) of each line that has a value."""
    words = [re.split(r"  +", line.strip())[1] for line in block.splitlines()]
    return [(name, value) for word in words if " = " in word for name, value in [word.split(" = ", 1)]]


def shows(field: str, value: object, text: str) -> bool:
    """A number may be followed by its name, bytes stand in the left column."""
    if isinstance(value, bytes):
        return text == "bytes"
    if isinstance(value, tuple):
        return text == ", ".join(map(str, value))
    return re.sub(r" \(.*\)$", "", text) == str(value)


def layout_values(payload: Layout, prefix: str = "") -> list[tuple[str, object]]:
    return [(prefix + field.name, getattr(payload, field.name)) for field in fields(payload)]


@pytest.mark.parametrize(("name", "block"), [*zip(NAMES, BLOCKS, strict=True)], ids=NAMES)
def test_an_example_is_what_it_says(name: str, block: str) -> None:
    data = bytes_of(block)
    if "size of the packet" in block:
        assert int.from_bytes(data[:2], "little") == len(data) - 2
        assert f"size of the packet = {len(data) - 2}" in block
        data, block = data[2:], block.split("\n", 1)[1]
    packet = parse(data)
    assert packet is not None and opens(data) and rebuild(data) == data
    assert c_name(type(packet.payload)) == name
    head = f"0x{packet.header.type:02X} {name}, sequence {packet.header.sequence}, {packet.header.timestamp_us} us"
    assert f"header: {head}" in block
    values = layout_values(packet.payload)
    for n, segment in enumerate(packet.segments):
        values += layout_values(segment, f"segment {n}: ")
    assert [field for field, _ in said(block)] == [field for field, _ in values]
    assert [
        field for (field, value), (_, text) in zip(values, said(block), strict=True) if not shows(field, value, text)
    ] == []


def test_every_packet_has_its_example() -> None:
    assert set(NAMES) == {c_name(kind) for kind in PACKETS.values()}


def test_the_proof_of_the_example_is_that_of_its_nonce() -> None:
    packets = {name: parse(bytes_of(block)) for name, block in zip(NAMES, BLOCKS, strict=True)}
    nonce, proof = packets["challenge_response"], packets["authenticate"]
    assert nonce is not None and isinstance(nonce.payload, ChallengeResponse)
    assert proof is not None and isinstance(proof.payload, Authenticate)
    secret = hashlib.pbkdf2_hmac("sha256", b"secret", nonce.payload.salt, nonce.payload.rounds)
    message = b"WMC3 host proof".ljust(16, b"\0") + nonce.payload.nonce + proof.payload.nonce
    assert hmac.digest(secret, message, hashlib.sha256) == proof.payload.proof
    assert "is the key `secret`" in TEXT


def test_the_header_of_the_document_is_a_packet() -> None:
    rows = re.findall(r"^\| \d+ \|.*\| `([0-9a-f]+)` \|$", TEXT, re.M)
    packet = parse(bytes.fromhex("".join(rows)))
    assert packet is not None and c_name(type(packet.payload)) == "jog_stop"


# ---- all of the table ----


def section(name: str) -> str:
    """From a heading of this name to the next of any kind."""
    found = re.search(rf"^###? {re.escape(name)}\n(.*?)(?=^##|\Z)", TEXT, re.S | re.M)
    assert found, f"no section {name}"
    return found[1]


@pytest.mark.parametrize("item", [*TABLE.packet, *TABLE.struct[1:]], ids=lambda item: item.name)
def test_every_field_of_every_packet_is_there(item: Packet | WireStruct) -> None:
    text = section(item.name)
    for field in item.fields:
        assert re.search(rf"^\| {field.offset} \| .*\| `{field.name}` \|.*\| \S.* \|$", text, re.M), field.name


@pytest.mark.parametrize("enum", TABLE.enum, ids=lambda enum: enum.name)
def test_every_number_is_there(enum: Enum) -> None:
    text = section("Refusals" if enum.name == "refusal" else enum.name.replace("_", " "))
    for value in enum.values:
        assert re.search(rf"^\| (0x)?\w+ \| {value.name} \| \S.* \|$", text, re.M), value.name


def test_every_key_is_there() -> None:
    for key in KEYS:
        assert re.search(rf"^\| 0x{key.key:04X}[^|]* \| `{key.name}` \|.*\| \S.* \|$", TEXT, re.M), key


def test_no_table_has_an_empty_description() -> None:
    assert [item.name for item in (*TABLE.packet, *TABLE.struct) if not item.help] == []
    assert [f"{i.name}.{f.name}" for i in (*TABLE.packet, *TABLE.struct) for f in i.fields if not f.help] == []
    assert [key.name for key in TABLE.key if not key.help] == []


def test_every_refusal_says_what_a_host_does_then() -> None:
    assert set(REMEDIES) == set(Refusal) - {Refusal.NONE}
    assert all(REMEDIES.values())


def test_every_link_leads_somewhere() -> None:
    headings = re.findall(r"^##+ (.*)$", TEXT, re.M)
    anchors = {re.sub(r"[^\w\- ]", "", heading.lower()).replace(" ", "-") for heading in headings}
    links = set(re.findall(r"\]\(#([^)]*)\)", TEXT))
    assert links - anchors == set()


def test_a_packet_without_a_vector_or_an_example_is_an_error() -> None:
    with pytest.raises(ValueError, match=r"no vector .*: ack, authenticate"):
        parse_examples('[[vector]]\nname = "estop"\nhex = "33434d5701040000000000000000000058dc"\n', TABLE)


def test_an_example_is_made_as_the_vectors_are() -> None:
    source = (ROOT / "protocol/vectors/packets.toml").read_text(encoding="utf-8")
    without = "".join(part for part in source.split("[[vector]]") if 'name = "ping"' not in part)
    ping = next(packet for packet in TABLE.packet if packet.name == "ping")
    rest = tuple(packet for packet in TABLE.packet if packet.name != "ping")
    table = TABLE.model_copy(update={"packet": (*rest, ping.model_copy(update={"example": (7,)}))})
    made = parse_examples(re.sub(r"^(?=name)", "[[vector]]\n", without, flags=re.M), table)["ping"]
    assert made.data == build(Ping(7)) and opens(made.data)


def test_the_examples_need_no_hand() -> None:
    """A changed vector changes the document."""
    source = (ROOT / "protocol/vectors/packets.toml").read_text(encoding="utf-8")
    for name, example in parse_examples(source, TABLE).items():
        assert example.text in TEXT, name
        assert replace(example, name="").data == bytes_of(example.text)
