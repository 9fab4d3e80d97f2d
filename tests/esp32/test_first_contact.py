"""First contact without a page: names that lead to the controller, and /api/network with its trial."""

from __future__ import annotations

import http.client
import json
import socket
import struct
from collections.abc import Iterator
from contextlib import contextmanager

import pytest
from esp32_serve import Contact, first_contact
from patience import HANG_S
from websockets.sync.client import connect

KEY = "correct horse"
GOOD = {"ssid": "Werkstatt", "password": "half past eight!"}
A, AAAA, ANY, NOT_IMPLEMENTED = 1, 28, 255, 4
Answer = tuple[int, dict[str, object], dict[str, str]]


@pytest.fixture
def contact() -> Iterator[Contact]:
    with first_contact(KEY) as running:
        yield running


def ask(contact: Contact, body: object = None, path: str = "/api/network", **headers: str) -> Answer:
    connection = http.client.HTTPConnection("127.0.0.1", contact.page, timeout=HANG_S)
    try:
        if body is None:
            connection.request("GET", path, headers=headers)
        else:
            text = body if isinstance(body, str) else json.dumps(body)
            connection.request("POST", path, text, {"Content-Type": "application/json", **headers})
        answer = connection.getresponse()
        data = answer.read().decode()
        is_json = answer.getheader("Content-Type") == "application/json"
        return answer.status, json.loads(data) if is_json else {"text": data}, dict(answer.getheaders())
    finally:
        connection.close()


# ---- names ----


def question(name: str, kind: int = A, flags: int = 0x0100, count: int = 1) -> bytes:
    labels = b"".join(bytes([len(label)]) + label.encode() for label in name.split("."))
    return struct.pack(">6H", 0x1234, flags, count, 0, 0, 0) + labels + struct.pack(">xHH", kind, 1)


def resolve(contact: Contact, query: bytes) -> bytes:
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as one:
        one.settimeout(HANG_S)
        one.sendto(query, ("127.0.0.1", contact.names))
        return one.recv(2048)


@pytest.mark.parametrize("name", ["connectivitycheck.gstatic.com", "captive.apple.com", "a.b", "x" * 63 + ".example"])
@pytest.mark.parametrize("kind", [A, ANY])
def test_every_name_leads_to_the_controller(contact: Contact, name: str, kind: int) -> None:
    """Read as RFC 1035, 4.1 says: the question again, one A record with a pointer to its name, not to be kept."""
    query = question(name, kind)
    answer = resolve(contact, query)
    number, flags, *counts = struct.unpack(">6H", answer[:12])
    assert number == 0x1234 and flags & 0x8000 and flags & 0x000F == 0 and counts == [1, 1, 0, 0]
    assert answer[12 : len(query)] == query[12:]
    record = struct.unpack(">HHHIH4s", answer[len(query) :])
    assert record == (0xC00C, A, 1, 0, 4, bytes([127, 0, 0, 1]))


def test_other_types_have_no_record_and_no_error(contact: Contact) -> None:
    """An error would make a phone wait, or ask elsewhere."""
    answer = resolve(contact, question("www.example.com", AAAA))
    _, flags, *counts = struct.unpack(">6H", answer[:12])
    assert flags & 0x000F == 0 and counts == [1, 0, 0, 0]


def test_what_is_no_question_has_no_answer(contact: Contact) -> None:
    """The next good one is answered, so the server is still there, and has answered nothing else."""
    good = question("example.com")
    bad = (
        b"",
        good[:11],
        good[:-1],
        question("example.com", flags=0x8100),
        question("example.com", count=2),
        good[:12] + b"\xc0\x0c" + good[-4:],
        good[:12] + b"\x3f" + good[13:],
        good[:12] + (b"\x3f" + b"x" * 63) * 5 + b"\0\0\x01\0\x01",
    )
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as one:
        one.settimeout(HANG_S)
        for query in (*bad, good):
            one.sendto(query, ("127.0.0.1", contact.names))
        assert one.recv(2048)[12 : len(good)] == good[12:]
    refused = resolve(contact, question("example.com", flags=0x2900))  # an update
    assert struct.unpack(">6H", refused[:12])[1] & 0x000F == NOT_IMPLEMENTED


# ---- the phone is led to the page ----


@pytest.mark.parametrize("path", ["/generate_204", "/hotspot-detect.html", "/connecttest.txt", "/"])
def test_a_phone_that_looks_for_the_internet_finds_the_page(contact: Contact, path: str) -> None:
    status, _, headers = ask(contact, path=path, Host="connectivitycheck.gstatic.com")
    assert (status, headers["Location"]) == (302, "http://192.168.4.1/setup.html")
    assert headers["Cache-Control"] == "no-store"


def test_in_other_networks_no_foreign_name_is_served(contact: Contact) -> None:
    """DNS rebinding: the page of another site may not command."""
    contact.tell("phone other")
    assert ask(contact, path="/", Host="evil.example")[0] == 421
    assert ask(contact, GOOD, Host="evil.example")[0] == 421


def test_a_foreign_name_cannot_set_the_network_from_within(contact: Contact) -> None:
    assert ask(contact, GOOD, Host="evil.example", Origin="http://evil.example")[0] == 421
    assert contact.tell("state").startswith("none")


# ---- who may ----


def test_a_page_of_another_origin_is_refused(contact: Contact) -> None:
    assert ask(contact, GOOD, Origin="http://evil.example")[0] == 403
    assert ask(contact, GOOD, Origin="null")[0] == 403
    assert ask(contact, GOOD, Origin=f"http://127.0.0.1:{contact.page}")[0] == 200


@pytest.mark.parametrize("kind", ["text/plain", "application/x-www-form-urlencoded", ""])
def test_a_form_is_refused(contact: Contact, kind: str) -> None:
    assert ask(contact, GOOD, **{"Content-Type": kind})[0] == 415
    assert contact.tell("state").startswith("none")


def test_from_elsewhere_the_access_key_is_needed(contact: Contact) -> None:
    contact.tell("phone other")
    assert ask(contact)[1]["may"] is False
    assert ask(contact, GOOD)[:2] == (401, {"error": "The access key of the controller is missing.", "field": "key"})
    assert ask(contact, {**GOOD, "key": "wrong"})[:2] == (401, {"error": "This is not the access key.", "field": "key"})
    assert contact.tell("state").startswith("none")
    assert ask(contact, {**GOOD, "key": "Correct-Horse"})[0] == 200
    assert contact.tell("state").startswith("Werkstatt+")


def test_nothing_changes_while_the_machine_moves(contact: Contact) -> None:
    contact.tell("moves 1")
    assert ask(contact, GOOD)[0] == 409 and ask(contact, {"scan": True})[0] == 409
    assert contact.tell("moves 0").startswith("none")
    assert ask(contact, GOOD)[0] == 200


# ---- what is refused ----


@pytest.mark.parametrize(
    ("change", "field"),
    [
        ({"password": "short"}, "password"),
        ({"ssid": "x" * 33}, "ssid"),
        ({"ssid": "ä" * 17}, "ssid"),
        ({"name": "my mill"}, "name"),
        ({"mode": "maybe"}, "mode"),
        ({"mode": "static", "address": "192.168.1"}, "address"),
        ({"mode": "static", "address": "192.168.1.20", "netmask": "255.0.255.0"}, "address"),
        ({"mode": "static", "address": "192.168.1.20", "netmask": "255.255.255.0", "gateway": "10.0.0.1"}, "address"),
        ({"password": None}, ""),
    ],
)
def test_what_cannot_be_is_refused_with_its_place_and_changes_nothing(
    contact: Contact, change: dict[str, object], field: str
) -> None:
    status, said, _ = ask(contact, {**GOOD, **change})
    assert status == 400 and said["field"] == field and said["error"]
    assert contact.tell("state").startswith("none")
    assert ask(contact, GOOD)[0] == 200  # nothing of it is left


@pytest.mark.parametrize(
    "body",
    [
        "",
        "[]",
        "{",
        '{"ssid"}',
        '{"ssid": "x",}',
        '{"ssid": "x"} x',
        '{"ssid": "\\ud800"}',
        '{"ssid": "a\nb"}',
        '{"ssid": "x", "ssid": "y", "password": ""}',
        '{"unknown": "x"}',
        '{"ssid": 1}',
        '{"scan": "true"}',
        '{"scan": false}',
        '{"ssid": "' + 100 * "x" + '"}',
        '{"ssid": "a\\u0000b", "password": ""}',
    ],
)
def test_what_is_not_understood_is_refused(contact: Contact, body: str) -> None:
    assert ask(contact, body)[0] == 400
    assert contact.tell("state").startswith("none")


def test_a_name_of_any_letters_is_stored_as_utf8(contact: Contact) -> None:
    """JSON may escape what it likes (RFC 8259, 7)."""
    assert ask(contact, '{"ssid": "W\\u00e4\\ud83d\\ude00 \\"\\\\\\/", "password": ""}')[0] == 200
    assert ask(contact)[1]["ssid"] == 'Wä😀 "\\/'


def test_a_body_must_say_its_length_and_be_short(contact: Contact) -> None:
    with socket.create_connection(("127.0.0.1", contact.page), HANG_S) as one:
        one.sendall(b"POST /api/network HTTP/1.1\r\nHost: 127.0.0.1\r\nContent-Type: application/json\r\n\r\n")
        assert one.recv(100).startswith(b"HTTP/1.1 411 ")
    with socket.create_connection(("127.0.0.1", contact.page), HANG_S) as one:
        one.sendall(b"POST /api/network HTTP/1.1\r\nHost: 127.0.0.1\r\nContent-Length: 999999\r\n\r\n")
        assert one.recv(100).startswith(b"HTTP/1.1 413 ")


def test_a_body_may_come_in_pieces(contact: Contact) -> None:
    body = json.dumps(GOOD).encode()
    head = f"Host: 127.0.0.1\r\nContent-Type: application/json\r\nContent-Length: {len(body)}\r\n\r\n".encode()
    with socket.create_connection(("127.0.0.1", contact.page), HANG_S) as one:
        one.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
        for byte in b"POST /api/network HTTP/1.1\r\n" + head + body:
            one.sendall(bytes([byte]))
        assert one.recv(100).startswith(b"HTTP/1.1 200 ")


# ---- the trial ----


def test_networks_are_searched_for(contact: Contact) -> None:
    assert ask(contact)[1]["networks"] == []
    assert ask(contact, {"scan": True})[0] == 200
    assert ask(contact)[1]["scanning"] is True and ask(contact, {"scan": True})[0] == 409
    contact.pass_s(3)
    said = ask(contact)[1]
    assert said["scanning"] is False
    assert [net["name"] for net in said["networks"]] == ["Werkstatt", 'Nachbar "5G"', "Freifunk"]  # type: ignore[attr-defined]


@pytest.mark.parametrize(
    ("change", "state"),
    [
        ({}, "joined"),
        ({"password": "half past nine"}, "wrong_password"),
        ({"ssid": "Nowhere"}, "not_found"),
        ({"ssid": "Freifunk", "password": ""}, "joined"),
    ],
)
def test_a_phone_in_the_own_network_is_told_how_it_went(contact: Contact, change: dict[str, str], state: str) -> None:
    assert ask(contact, {**GOOD, **change})[0] == 200
    assert ask(contact)[1]["state"] == "joining"
    assert "own=1" in contact.pass_s(5)
    said = ask(contact)[1]
    assert said["state"] == state and (said["joined"] == "192.168.1.20") == (state == "joined")


@pytest.mark.parametrize("key", ["", KEY])
def test_without_contact_the_network_before_returns_after_two_minutes(key: str) -> None:
    """The own network does not show that the other one can be used, and the open page there is no contact."""
    with first_contact(key) as contact:
        assert ask(contact, GOOD)[0] == 200
        assert contact.pass_s(120).startswith("Werkstatt+ own=1 joined=1")
        assert ask(contact, {"keep": True})[0] == 409
        assert contact.pass_s(2).startswith("none own=1 joined=0")
        assert ask(contact)[1]["state"] == "none"


@pytest.mark.parametrize("body", [{"ticket": True}, {"key": KEY}])
def test_who_comes_through_the_new_network_keeps_it(contact: Contact, body: dict[str, object]) -> None:
    ticket = ask(contact, GOOD)[1]["ticket"]
    contact.pass_s(5)
    contact.tell("phone other")
    proof = {"ticket": ticket} if "ticket" in body else body
    assert ask(contact, {"keep": True, "ticket": "0" * 32})[0] == 401
    assert ask(contact, {"keep": True})[0] == 401
    assert ask(contact, {"keep": True, **proof})[0] == 200
    assert contact.pass_s(1).startswith("Werkstatt own=0 joined=1")
    assert contact.pass_s(200).startswith("Werkstatt own=0 joined=1")
    assert ask(contact, {"keep": True, **proof})[0] in (401, 409)


def test_a_sender_that_logs_in_through_the_new_network_keeps_it(contact: Contact) -> None:
    @contextmanager
    def client(said: str, until: bytes) -> Iterator[None]:
        with connect(f"ws://127.0.0.1:{contact.page}/grbl", compression=None) as one:
            one.send(said.encode())
            while until not in bytes(one.recv(HANG_S)):  # type: ignore[arg-type]
                pass
            yield

    login = f"$LOGIN={KEY}\n"
    with client(login, b"ok\r\n"):
        assert ask(contact, GOOD)[0] == 200
        contact.pass_s(5)
        contact.tell("phone other")
        assert contact.pass_s(1).startswith("Werkstatt+")  # it was there before
        with client("?", b"<"):
            assert contact.pass_s(1).startswith("Werkstatt+")  # it only looks
        with client(login, b"ok\r\n"):
            assert contact.pass_s(1).startswith("Werkstatt own=0 joined=1")


def test_the_first_of_two_changes_is_the_one_that_returns(contact: Contact) -> None:
    """Only that one is known to work."""
    assert ask(contact, {"ssid": "Nowhere", "password": ""})[0] == 200
    contact.pass_s(60)
    assert ask(contact, GOOD)[0] == 200
    assert contact.pass_s(100).startswith("Werkstatt+")
    assert contact.pass_s(30).startswith("none own=1")


def test_what_is_in_use_already_is_said(contact: Contact) -> None:
    assert ask(contact, {"ssid": "", "password": ""})[0] == 409


# ---- the status light ----


def light(state: str) -> str:
    return state.split("light=")[1].split()[0]


def test_the_status_light_tells_how_first_contact_goes(contact: Contact) -> None:
    assert light(contact.tell("state")) == "OWN_NETWORK"
    assert ask(contact, GOOD)[0] == 200
    assert light(contact.pass_s(1.2)) == "JOINING"  # behind the answer, a second later
    assert light(contact.pass_s(2)) == "JOINED"
    assert light(contact.tell("moves 1")) == "RUNNING"
    contact.tell("moves 0")
    assert light(contact.pass_s(130)) == "OWN_NETWORK"  # no one came: as before
    assert ask(contact, {**GOOD, "password": "wrong wrong"})[0] == 200
    assert light(contact.pass_s(2)) == "OWN_NETWORK"


# ---- pins ----

PINS = "/api/pins"
PINS_BEFORE = {"p_sx": 1, "p_sy": 2, "p_sz": 42, "p_prb": 14}


def test_pins_are_read_by_all_and_changed_with_the_key(contact: Contact) -> None:
    """Also in the own network: its password is for the choice of a network."""
    status, said, _ = ask(contact, path=PINS)
    assert status == 200 and said == {"may": False, "pins": PINS_BEFORE}
    assert ask(contact, {"p_sx": 6}, PINS)[0] == 401
    assert ask(contact, {"p_sx": 6, "key": "wrong horse"}, PINS)[0] == 401
    assert ask(contact, {"restart": True}, PINS)[0] == 401
    assert "pin=0 restarts=0" in contact.tell("state")
    contact.pass_s(2)  # after a wrong key
    assert ask(contact, {"p_sx": 6, "key": KEY}, PINS)[0] == 200
    assert "pin=1 restarts=0" in contact.tell("state")  # the pin that returns if no one comes
    assert ask(contact, path=PINS)[1]["pins"] == {**PINS_BEFORE, "p_sx": 6}
    assert ask(contact, {"restart": True, "key": KEY}, PINS)[0] == 200
    assert "restarts=1" in contact.tell("state")


def test_two_signals_swap_their_pins_in_one_request(contact: Contact) -> None:
    assert ask(contact, {"p_sx": 2, "p_sy": 1, "restart": True, "key": KEY}, PINS)[0] == 200
    assert ask(contact, path=PINS)[1]["pins"] == {**PINS_BEFORE, "p_sx": 2, "p_sy": 1}
    assert "pin=1 restarts=1" in contact.tell("state")


@pytest.mark.parametrize(
    ("body", "status", "why"),
    [
        ({"p_sx": 2}, 400, "same pin"),
        ({"p_sx": 12}, 400, "do not allow this pin"),
        ({"p_sx": 255}, 400, "do not allow this pin"),
        ({"p_sy": 1, "p_sx": 2, "p_sz": 6}, 400, "cannot be moved"),  # the good ones are not stored, either
        ({"p_sx": 256}, 400, "Not understood"),
        ({"p_sx": "6"}, 400, "Not understood"),
        ({"p_sx": -1}, 400, "Not understood"),
        ({"p_qq": 6}, 400, "Not understood"),
        ({"restart": False}, 400, "Not understood"),
        ('{"p_sx": 6, "p_sx": 1, "key": "correct horse"}', 400, "Not understood"),
    ],
)
def test_pins_that_cannot_be_change_nothing(contact: Contact, body: object, status: int, why: str) -> None:
    sent = {**body, "key": KEY} if isinstance(body, dict) else body
    answered = ask(contact, sent, PINS)
    assert answered[0] == status and why in str(answered[1]["error"])
    assert ask(contact, path=PINS)[1]["pins"] == PINS_BEFORE
    assert "pin=0 restarts=0" in contact.tell("state")


def test_pins_stay_while_the_machine_moves(contact: Contact) -> None:
    contact.tell("moves 1")
    status, said, _ = ask(contact, {"p_sx": 6, "restart": True, "key": KEY}, PINS)
    assert status == 409 and "a job is running or held" in str(said["error"])
    assert "pin=0 restarts=0" in contact.tell("state")


def test_pins_obey_the_rules_of_origin_and_type(contact: Contact) -> None:
    body = {"p_sx": 6, "key": KEY}
    assert ask(contact, body, PINS, Origin="http://evil.example")[0] == 403
    assert ask(contact, body, PINS, **{"Content-Type": "text/plain"})[0] == 415
    assert "pin=0" in contact.tell("state")
