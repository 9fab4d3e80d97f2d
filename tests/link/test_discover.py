"""Multicast DNS: our responder's packets read by zeroconf, its questions answered, and one found by the other."""

from __future__ import annotations

import ctypes
import io
import os
import random
import socket
import struct
import threading

import pytest
import segno
from c_library import LIB
from click.testing import CliRunner
from layouts import HOST
from wificnc.commands.discover import command
from wificnc.connection.discover import SERVICE, TYPE_PTR, Found, controllers, discover, question

PACKET = 960
PAGE, LIST = "_http._tcp.local", "_services._dns-sd._udp.local"
A, PTR, TXT, SRV, ANY = 1, 12, 16, 33, 255
UNICAST = 0x8000


class Responder:
    """net_mdns.c by ctypes."""

    def __init__(self, address: str = "192.168.4.7", port: int = 23, page: int = 80) -> None:
        quads = (ctypes.c_uint8 * 4)(*map(int, address.split(".")))
        self.me = HOST.struct("net_mdns")(b"WiFiCNC-1A2B", b"7cdfa1001a2b", b"esp32s3-zero", quads, port, page)
        self.unicast = False

    def answer(self, query: bytes, legacy: bool = False) -> bytes:
        out = ctypes.create_string_buffer(PACKET)
        unicast = ctypes.c_bool()
        size = LIB.net_mdns_answer(ctypes.byref(self.me), query, len(query), legacy, out, ctypes.byref(unicast))
        self.unicast = unicast.value
        return out.raw[:size]

    def announce(self, leaves: bool = False) -> bytes:
        out = ctypes.create_string_buffer(PACKET)
        size = LIB.net_mdns_announce(ctypes.byref(self.me), leaves, out)
        return out.raw[:size]


def test_a_flood_of_questions_is_not_answered_by_a_larger_one() -> None:
    """A question can have the address of someone else; the clock wraps."""
    responder = Responder()
    start_us = 2**32 - 300_000
    sent = [
        us // 1_000_000
        for us in range(0, 3_000_000, 1_000)
        if LIB.net_mdns_may_answer(ctypes.byref(responder.me), ctypes.c_uint32(start_us + us))
    ]
    assert [sent.count(second) for second in range(3)] == [10, 10, 10]


def zeroconf_question(*asked: tuple[str, int]) -> bytes:
    const = pytest.importorskip("zeroconf.const")
    zeroconf = pytest.importorskip("zeroconf")
    query = zeroconf.DNSOutgoing(const._FLAGS_QR_QUERY)
    for name, kind in asked:
        query.add_question(zeroconf.DNSQuestion(name + ".", kind, const._CLASS_IN))
    return query.packets()[0]


def records(packet: bytes) -> dict[tuple[str, int], object]:
    """As zeroconf reads them: (name, type) -> record."""
    zeroconf = pytest.importorskip("zeroconf")
    incoming = zeroconf.DNSIncoming(packet)
    assert incoming.valid and incoming.is_response()
    return {(record.name.lower(), record.type): record for record in incoming.answers()}


def test_a_question_for_the_service_gets_all_that_a_client_needs() -> None:
    responder = Responder()
    found = records(responder.answer(zeroconf_question((SERVICE, PTR))))
    instance, host = "wificnc-1a2b._telnet._tcp.local.", "wificnc-1a2b.local."
    assert found[SERVICE + ".", PTR].alias.lower() == instance
    assert found[instance, SRV].port == 23 and found[instance, SRV].server.lower() == host
    assert found[instance, TXT].text == b"\x14wificnc=esp32s3-zero"
    assert socket.inet_ntoa(found[host, A].address) == "192.168.4.7"
    assert not responder.unicast


def test_browsers_for_web_servers_find_the_page() -> None:
    """RFC 6763, 6: strings of key=value; `path` is that of HTTP."""
    found = records(Responder().answer(zeroconf_question((PAGE, PTR))))
    instance, host = "wificnc-1a2b._http._tcp.local.", "wificnc-1a2b.local."
    assert set(found) == {(PAGE + ".", PTR), (instance, SRV), (instance, TXT), (host, A)}
    assert found[PAGE + ".", PTR].alias.lower() == instance
    assert found[instance, SRV].port == 80 and found[instance, SRV].server.lower() == host
    zeroconf = pytest.importorskip("zeroconf")
    info = zeroconf.ServiceInfo(PAGE + ".", "x." + PAGE + ".", properties=found[instance, TXT].text)
    assert info.decoded_properties == {"path": "/", "board": "esp32s3-zero", "id": "7cdfa1001a2b"}


def test_the_list_has_each_service_that_exists() -> None:
    def listed(responder: Responder) -> set[str]:
        packet = responder.answer(zeroconf_question((LIST, PTR)))
        zeroconf = pytest.importorskip("zeroconf")
        return {record.alias for record in zeroconf.DNSIncoming(packet).answers()} if packet else set()

    assert listed(Responder()) == {SERVICE + ".", PAGE + "."}
    assert listed(Responder(page=0)) == {SERVICE + "."} and listed(Responder(port=0)) == {PAGE + "."}
    assert listed(Responder(port=0, page=0)) == set()


def test_the_largest_answer_fits() -> None:
    """Every record that exists, with the longest texts, to a simple resolver that gets its question back."""
    responder = Responder()
    responder.me.name, responder.me.id, responder.me.board = b"N" * 31, b"i" * 31, b"b" * 63
    name = "n" * 31
    asked = [(LIST, ANY), (SERVICE, ANY), (PAGE, ANY), (f"{name}.local", ANY), (f"{name}.{SERVICE}", ANY)]
    packet = responder.answer(zeroconf_question(*asked), legacy=True)
    zeroconf = pytest.importorskip("zeroconf")
    incoming = zeroconf.DNSIncoming(packet)
    assert incoming.valid and len(incoming.answers()) == 9 and len(packet) <= PACKET


@pytest.mark.parametrize(
    ("name", "kind", "types"),
    [
        ("wificnc-1a2b.local", A, {A}),
        ("WIFICNC-1A2B.LOCAL", ANY, {A}),
        ("wificnc-1a2b._telnet._tcp.local", SRV, {SRV, A}),
        ("wificnc-1a2b._telnet._tcp.local", TXT, {TXT}),
        ("_services._dns-sd._udp.local", PTR, {PTR}),
        ("wificnc-1a2c.local", A, set()),
        ("wificnc-1a2b.local", 28, set()),
        ("wificnc-1a2b._http._tcp.local", SRV, {SRV, A}),
        ("_ipp._tcp.local", PTR, set()),
    ],
)
def test_each_question_gets_its_records_and_others_silence(name: str, kind: int, types: set[int]) -> None:
    packet = Responder().answer(zeroconf_question((name, kind)))
    assert ({key[1] for key in records(packet)} if packet else set()) == types


def test_an_io_module_has_a_name_and_no_service() -> None:
    module = Responder(port=0, page=0)
    assert {key[1] for key in records(module.answer(zeroconf_question(("wificnc-1a2b.local", A))))} == {A}
    for name in (SERVICE, PAGE, LIST, "wificnc-1a2b._telnet._tcp.local", "wificnc-1a2b._http._tcp.local"):
        assert module.answer(zeroconf_question((name, ANY))) == b""
    assert {key[1] for key in records(module.announce())} == {A}


def test_several_questions_with_compressed_names() -> None:
    query = zeroconf_question(("printer._ipp._tcp.local", ANY), ("wificnc-1a2b.local", A), (SERVICE, PTR))
    assert {key[1] for key in records(Responder().answer(query))} == {A, PTR, TXT, SRV}


def test_simple_resolvers_get_their_question_back_and_short_lives() -> None:
    zeroconf = pytest.importorskip("zeroconf")
    query = struct.pack(">H", 0x1234) + question("wificnc-1a2b.local", A)[2:]
    responder = Responder()
    packet = responder.answer(query, legacy=True)
    assert packet[:2] == b"\x12\x34" and responder.unicast
    incoming = zeroconf.DNSIncoming(packet)
    (record,) = incoming.answers()
    assert [asked.name for asked in incoming.questions] == ["wificnc-1a2b.local."]
    assert record.ttl <= 10 and not record.unique


def test_who_wants_unicast_gets_it() -> None:
    responder = Responder()
    query = question("wificnc-1a2b.local", A)[:-2] + struct.pack(">H", UNICAST | 1)
    assert responder.answer(query) and responder.unicast


def test_an_announcement_holds_everything_and_without_address_there_is_none() -> None:
    assert {key[1] for key in records(Responder().announce())} == {A, PTR, TXT, SRV}
    silent = Responder("0.0.0.0")
    assert silent.announce() == b"" and silent.answer(question(SERVICE, TYPE_PTR)) == b""


def test_who_leaves_takes_every_record_out_of_the_caches() -> None:
    """RFC 6762, 10.1: a time to live of 0."""
    here, gone = records(Responder().announce()), records(Responder().announce(leaves=True))
    assert set(here) == set(gone) and len(gone) == 7
    assert {record.ttl for record in gone.values()} == {0} and 0 not in {record.ttl for record in here.values()}


def test_responses_are_not_answered() -> None:
    responder = Responder()
    assert responder.answer(responder.announce()) == b""


def test_no_packet_does_harm() -> None:
    responder, rng = Responder(), random.Random(4)
    good = zeroconf_question((SERVICE, PTR), ("wificnc-1a2b.local", A))
    for length in range(len(good)):
        responder.answer(good[:length])
        controllers(responder.announce()[:length])
    for _ in range(20000):
        packet = bytearray(good)
        for _ in range(rng.randrange(1, 5)):
            packet[rng.randrange(len(packet))] = rng.randrange(256)
        assert len(responder.answer(bytes(packet), legacy=bool(rng.randrange(2)))) <= PACKET
        controllers(os.urandom(60))
    loop = question("a", A)[:12] + b"\xc0\x0c" + struct.pack(">2H", A, 1)
    assert responder.answer(loop) == b""


def test_the_finder_finds_the_responder() -> None:
    responder = Responder("10.1.2.3")
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as here:
        here.bind(("127.0.0.1", 0))

        def serve() -> None:
            query, asker = here.recvfrom(PACKET)
            here.sendto(b"\0\1damaged", asker)
            here.sendto(responder.answer(query, legacy=True), asker)

        thread = threading.Thread(target=serve)
        thread.start()
        (found,) = discover(0.5, here.getsockname())
        thread.join()
    assert (found.name, found.target, found.text["wificnc"]) == ("wificnc-1a2b", "tcp://10.1.2.3:23", "esp32s3-zero")


@pytest.mark.parametrize(("options", "shown"), [(["--qr"], True), ([], False), (["--no-qr"], False)])
def test_the_command_shows_the_address_of_the_page_for_a_phone(
    monkeypatch: pytest.MonkeyPatch, options: list[str], shown: bool
) -> None:
    """No key in it: the network has not told one. Not in a pipe, unless it is asked for."""
    found = Found("wificnc-1a2b", "10.1.2.3", 23, {"wificnc": "esp32s3-zero"})
    monkeypatch.setattr("wificnc.commands.discover.discover", lambda seconds: [found])
    said = CliRunner().invoke(command, options).stdout
    code = io.StringIO()
    segno.make("http://10.1.2.3/").terminal(out=code, compact=True)
    assert "tcp://10.1.2.3:23" in said and (code.getvalue() in said) is shown
