"""Who may command a device that has an access key: connections that prove it, datagrams with their seal, addresses
that are trusted; and what an attacker who knows the protocol but not the key can do. Virtual time."""

from __future__ import annotations

import ctypes
import os
import random
import subprocess
import sys
from collections.abc import Callable

import pytest
from c_library import LIB
from test_motion import segment
from test_requests import configure
from test_session import reason, statistics
from wificnc.connection.access import key_secret
from wificnc.connection.wmc3.layout import (
    Authenticate,
    Authenticated,
    Challenge,
    ChallengeResponse,
    ChannelOutputs,
    ConfigSave,
    Estop,
    Handshake,
    HandshakeResponse,
    Hold,
    Home,
    IoControl,
    Jog,
    JogStop,
    Motion,
    Refusal,
    Reset,
    Resume,
    State,
    Statistics,
    StatisticsResponse,
    Status,
    StreamOpen,
    StreamOpened,
    StreamSegments,
    Type,
    ValueType,
)
from wificnc.connection.wmc3.packet import build
from wificnc.connection.wmc3.packing import Layout
from wificnc.connection.wmc3.seal import Sealer, proof, siphash
from wire_device import HOST, OTHER, TRUST_DAY, TRUST_NOT, Device

OURS = bytes(range(16))  # a nonce
KEY = "k7qf3-x2m9d-0abcd-efghj"
WINDOW = 64  # datagrams may come in another order within so many


def steps_of_x(device: Device, packet: bytes, address: str = HOST) -> int:
    """What this datagram moves."""
    before = device.pulses[0]
    device.raw(packet, address)
    device.run(0.3)
    return device.pulses[0] - before


def motion(device: Device, steps: int = 100) -> bytes:
    """A datagram that nothing like it has come before: another number."""
    device.sequence += 1
    return build(Motion(count=1), device.sequence, round(device.now * 1e6) + 1, (segment(steps),))


@pytest.fixture
def locked(make_device: Callable[..., Device]) -> Device:
    return make_device(key=KEY)


# ---- seals ----


def pythons_key(seed: int) -> bytes:
    """The key of hash() that PYTHONHASHSEED leads to (CPython, Python/bootstrap_hash.c)."""
    key = bytearray()
    for _ in range(16 if seed else 0):
        seed = seed * 214013 + 2531011 & 0xFFFFFFFF
        key.append(seed >> 16 & 0xFF)
    return bytes(key) or bytes(16)


@pytest.mark.skipif(sys.hash_info.algorithm != "siphash13", reason="hash() of this Python is no SipHash-1-3")
@pytest.mark.parametrize("seed", [0, 77])
def test_a_siphash_is_that_of_another_implementation(seed: int) -> None:
    """Python's hash() of bytes."""
    lengths = [*range(1, 26), 390]
    code = f"print(*(hash(bytes(n * 37 & 255 for n in range(count))) for count in {lengths}))"
    environment = {**os.environ, "PYTHONHASHSEED": str(seed)}
    run = subprocess.run([sys.executable, "-c", code], env=environment, capture_output=True, text=True, check=True)
    for count, theirs in zip(lengths, run.stdout.split(), strict=True):
        ours = siphash(pythons_key(seed), bytes(n * 37 & 255 for n in range(count)))
        assert ours == int(theirs) % 2**64, count


def test_the_cores_siphash_is_that_wherever_the_bytes_lie() -> None:
    """Words are read in one go where they are aligned."""
    key = bytes(range(16))
    for count in (*range(26), 390):
        text = bytes(n * 37 & 255 for n in range(count))
        for at in range(8):
            buffer = (ctypes.c_uint8 * (at + count + 1))(*bytes(at), *text)
            there = ctypes.cast(ctypes.addressof(buffer) + at, ctypes.POINTER(ctypes.c_uint8))
            assert LIB.siphash((ctypes.c_uint8 * 16)(*key), there, count) == siphash(key, text)


def test_only_the_seal_counts_not_the_address(locked: Device) -> None:
    """Once datagrams of an authenticated host's address were believed, whoever had sent them."""
    assert locked.prove(locked.connect(), KEY) == Refusal.NONE
    assert locked.sealer is not None
    assert steps_of_x(locked, motion(locked)) == 0, "from the same address, but without a seal"
    assert steps_of_x(locked, locked.sealer.seal(motion(locked))) == 100


def test_a_sealed_datagram_counts_once_whenever_it_is_played_again(locked: Device) -> None:
    assert locked.prove(locked.connect(), KEY) == Refusal.NONE
    assert locked.sealer is not None
    sealed = locked.sealer.seal(motion(locked))
    assert steps_of_x(locked, sealed) == 100
    locked.run(30)
    assert steps_of_x(locked, sealed) == 0
    for _ in range(2 * WINDOW):
        locked.raw(locked.sealer.seal(motion(locked, 0)))
        locked.run(0.01)
    assert steps_of_x(locked, sealed) == 0


def test_a_sealed_datagram_from_another_address_takes_nothing(locked: Device) -> None:
    """Who caught the first one and sent it on had become the owner, and the host was refused."""
    client = locked.connect()
    assert locked.prove(client, KEY) == Refusal.NONE
    assert locked.sealer is not None
    caught = locked.sealer.seal(motion(locked))
    assert steps_of_x(locked, caught, OTHER) == 0
    assert steps_of_x(locked, caught) == 100, "its number is not used up"
    counts = locked.request(client, Statistics()).payload
    assert isinstance(counts, StatisticsResponse) and ".".join(map(str, counts.owner)) == HOST


def test_late_datagrams_count_within_the_window_and_not_beyond(locked: Device) -> None:
    assert locked.prove(locked.connect(), KEY) == Refusal.NONE
    assert locked.sealer is not None
    jogs = [locked.sealer.seal(build(Jog(0, 1, 2000), n + 1, (n + 1) * 1000)) for n in range(WINDOW + 1)]
    locked.raw(jogs[WINDOW])
    locked.run(0.2)
    assert locked.pulses[0] > 0
    locked.send(Estop())
    locked.run(0.1)
    locked.send(Reset())
    locked.run(0.1)
    before = locked.pulses[0]
    locked.raw(jogs[0])
    locked.run(0.3)
    assert locked.pulses[0] == before


@pytest.mark.parametrize("bit", range(0, 8 * 34, 5))
def test_a_changed_bit_breaks_the_seal(locked: Device, bit: int) -> None:
    assert locked.prove(locked.connect(), KEY) == Refusal.NONE
    assert locked.sealer is not None
    sealed = bytearray(locked.sealer.seal(motion(locked)))
    at = len(sealed) - 34 + bit // 8  # some of the segment, the seal
    sealed[at] ^= 1 << bit % 8
    assert steps_of_x(locked, bytes(sealed)) == 0


def test_a_session_ends_with_its_connection(locked: Device) -> None:
    client = locked.connect()
    assert locked.prove(client, KEY) == Refusal.NONE
    assert locked.sealer is not None
    locked.disconnect(client)
    assert steps_of_x(locked, locked.sealer.seal(motion(locked))) == 0
    assert locked.prove(locked.connect(), KEY) == Refusal.NONE
    assert steps_of_x(locked, locked.sealer.seal(motion(locked))) == 100


def test_sessions_have_keys_of_their_own(locked: Device) -> None:
    assert locked.prove(locked.connect(), KEY) == Refusal.NONE
    first = locked.sealer
    assert first is not None and locked.prove(locked.connect(), KEY) == Refusal.NONE
    second = locked.sealer
    assert second is not None and second.key != first.key and second.session != first.session
    mixed = Sealer(first.session, second.key)
    assert steps_of_x(locked, mixed.seal(motion(locked))) == 0


# ---- trusted addresses ----


def test_a_trusted_address_needs_no_seal_until_that_is_revoked(locked: Device) -> None:
    """How a host that knows nothing of keys works: someone logs in from its computer."""
    locked.trust(HOST)
    assert steps_of_x(locked, motion(locked), OTHER) == 0
    assert steps_of_x(locked, motion(locked)) == 100
    hello = locked.request(locked.connect(), Handshake()).payload
    assert isinstance(hello, HandshakeResponse) and not hello.capabilities & 0x80
    locked.trust(HOST, TRUST_NOT)
    assert steps_of_x(locked, motion(locked)) == 0


def test_trust_for_a_day_needs_no_login(make_device: Callable[..., Device]) -> None:
    """How long that is: tests/esp32/gate.c."""
    locked = make_device(key=KEY)
    locked.trust(HOST, TRUST_DAY)
    locked.run(10)
    assert steps_of_x(locked, motion(locked)) == 100


# ---- an attacker ----


def attack(rng: random.Random) -> bytes:
    """A well-formed packet, with or without something like a seal."""
    payload = rng.choice([Jog(0, 1, 5000), Home(1), Reset(), Resume(), IoControl(spindle=1, rpm=900), Motion(count=1)])
    some = (segment(rng.randint(1, 500)),) if isinstance(payload, Motion) else ()
    packet = build(payload, rng.getrandbits(32), rng.getrandbits(32), some)
    return packet + rng.randbytes(rng.choice([0, 16, 16, 5, 40]))


@pytest.mark.parametrize("seed", range(4))
def test_without_the_key_nothing_moves_switches_or_changes_hands(locked: Device, seed: int) -> None:
    rng = random.Random(seed)
    assert locked.prove(locked.connect(), KEY) == Refusal.NONE
    assert locked.sealer is not None
    recorded = []
    for _ in range(20):
        recorded.append(locked.sealer.seal(motion(locked, 5)))
        locked.raw(recorded[-1])
        locked.run(0.05)
    stranger = locked.connect(OTHER)
    before = locked.pulses
    for _ in range(300):
        address = rng.choice([HOST, OTHER])
        locked.raw(rng.choice(recorded) if rng.random() < 0.3 else attack(rng), address)
        if rng.random() < 0.2:
            assert reason(locked, stranger, rng.choice([Jog(0, 1, 500), Home(1), Reset()])) == Refusal.AUTHENTICATION
        locked.run(0.01)
    locked.run(1)
    assert locked.pulses == before
    assert (locked.status.state, locked.status.spindle, locked.status.rpm) == (State.IDLE, 0, 0)
    assert steps_of_x(locked, locked.sealer.seal(motion(locked))) == 100, "the owner is still the owner"


def test_a_stranger_may_hold_and_stop(locked: Device) -> None:
    assert locked.prove(locked.connect(), KEY) == Refusal.NONE
    locked.motion(segment(5000))
    locked.run(0.1)
    locked.send(Hold(), address=OTHER)
    locked.run(1)
    assert locked.status.state == State.HOLD
    locked.send(Resume(), address=OTHER)
    locked.run(0.5)
    assert locked.status.state == State.HOLD


# ---- proofs ----


@pytest.mark.parametrize("key", ["x", "correct horse battery staple", "p" * 63])
def test_a_key_locks_all_that_changes_and_moves(make_device: Callable[..., Device], key: str) -> None:
    device = make_device(key=key)
    client = device.connect()
    hello = device.request(client, Handshake()).payload
    assert isinstance(hello, HandshakeResponse) and hello.capabilities & 0x80
    assert configure(device, client, 0x0103, ValueType.U16, 100) == Refusal.AUTHENTICATION
    assert reason(device, client, ConfigSave()) == Refusal.AUTHENTICATION
    opened = device.request(client, StreamOpen()).payload
    assert isinstance(opened, StreamOpened) and opened.refusal == Refusal.AUTHENTICATION
    device.motion(segment(100))
    device.send(Jog(0, 1, 100))
    device.run(0.5)
    assert device.pulses == [0] * 6
    assert device.prove(client, key) == Refusal.NONE
    assert configure(device, client, 0x0103, ValueType.U16, 100) == Refusal.NONE
    device.motion(segment(100))
    device.motion(segment(0, 100), address=OTHER)
    device.run(0.5)
    assert device.pulses[:2] == [100, 0]
    device.disconnect(client)
    device.motion(segment(100))
    device.run(0.5)
    assert device.pulses[0] == 100, "with the connection the right ends"


def test_everybody_may_still_stop(make_device: Callable[..., Device]) -> None:
    device = make_device(key="secret")
    device.connect()  # to see it
    device.send(Estop())
    device.run(0.1)
    assert device.status.state == State.ESTOP


def test_where_access_is_open_any_is_right(device: Device) -> None:
    client = device.connect()
    for _ in range(3):
        assert device.prove(client, "of another device") == Refusal.NONE


def test_guessing_becomes_slower_and_the_right_key_is_late_but_accepted(make_device: Callable[..., Device]) -> None:
    device = make_device(key="secret")
    client = device.connect()
    for wait_s in (0, 1, 2, 4, 4, 4):
        refusal, waited_s = device.prove_later(client, "wrong")
        assert refusal == Refusal.AUTHENTICATION and waited_s == pytest.approx(wait_s, abs=0.011)
    refusal, waited_s = device.prove_later(client, "secret")
    assert refusal == Refusal.NONE and waited_s == pytest.approx(4, abs=0.011), "late, and not refused"


def test_a_guesser_holds_nobody_else_up(make_device: Callable[..., Device]) -> None:
    device = make_device(key="secret")
    guesser, other = device.connect("10.0.0.66"), device.connect("10.0.0.67")
    assert device.prove(guesser, "wrong") == Refusal.AUTHENTICATION
    assert device.prove_later(other, "secret") == (Refusal.NONE, 0.0)
    refusal, waited_s = device.prove_later(device.connect("10.0.0.66"), "secret")
    assert refusal == Refusal.NONE and waited_s == pytest.approx(1, abs=0.011), "another connection of it"


def test_a_connection_authenticates_for_itself(make_device: Callable[..., Device]) -> None:
    """Another program of the same computer, or behind the same router, does not know the key."""
    device = make_device(key="secret")
    good, other = device.connect(), device.connect()
    assert device.prove(good, "secret") == Refusal.NONE
    assert configure(device, other, 0x0103, ValueType.U16, 100) == Refusal.AUTHENTICATION
    assert reason(device, other, Jog(0, 1, 1000)) == Refusal.AUTHENTICATION
    opened = device.request(other, StreamOpen()).payload
    assert isinstance(opened, StreamOpened) and opened.refusal == Refusal.AUTHENTICATION
    assert configure(device, good, 0x0103, ValueType.U16, 100) == Refusal.NONE
    device.run(0.5)
    assert device.pulses == [0] * 6


def test_a_wrong_key_and_a_replay(make_device: Callable[..., Device]) -> None:
    device = make_device(key="secret")
    client = device.connect()
    assert device.prove(client, "Secrets") == Refusal.AUTHENTICATION
    device.run(1.1)
    nonce = device.request(client, Challenge()).payload
    assert isinstance(nonce, ChallengeResponse)
    proven = Authenticate(OURS, proof(key_secret("secret", nonce.salt, nonce.rounds), nonce.nonce, OURS))
    assert isinstance(device.request(client, proven).payload, Authenticated)
    device.disconnect(client)
    client = device.connect()
    assert reason(device, client, proven) == Refusal.AUTHENTICATION, "a nonce serves once"
    again = device.request(client, Challenge()).payload
    assert isinstance(again, ChallengeResponse) and again.nonce != nonce.nonce
    assert reason(device, client, proven) == Refusal.AUTHENTICATION, "and for no other challenge"


# ---- what a forged source address is good for ----

UDP_PACKETS = (
    JogStop(axis=0xFF), Estop(), Hold(), Resume(), Reset(), Home(axes=1), IoControl(), Jog(0, 1, 100), Motion(count=0),
    StreamSegments(1, 0, 0), StreamSegments(0, 0, 0), ChannelOutputs(),
)  # fmt: skip


@pytest.mark.parametrize("padding", [0, 20, 100])
@pytest.mark.parametrize("payload", UDP_PACKETS, ids=lambda payload: type(payload).__name__)
def test_a_stranger_gets_no_more_bytes_than_it_sends(locked: Device, payload: Layout, padding: int) -> None:
    """Once 22 bytes from a forged address brought 200 reports of 80 bytes to its owner."""
    asked = 0
    for _ in range(500):
        question = build(payload, locked.sequence, round(locked.now * 1e6)) + bytes(padding)
        locked.sequence += 1
        asked += len(question)
        locked.raw(question, OTHER)
        locked.run(0.001)
        assert sum(len(sent.data) for sent in locked.sent) <= asked
    answered = len(locked.sent)
    assert answered <= 11
    locked.run(60)
    assert len(locked.sent) == answered, "and nothing later"


def test_a_stranger_that_asks_with_as_many_bytes_sees_the_state(locked: Device) -> None:
    """So a device that needs a key is found."""
    locked.raw(build(JogStop(axis=0xFF), 1, 1).ljust(80, b"\0"), OTHER)
    assert [sent.packet.payload.TYPE for sent in locked.sent] == [Status.TYPE]


@pytest.mark.parametrize("how", ["connected", "trusted"])
def test_a_host_that_is_known_or_connected_gets_reports_for_a_short_question(locked: Device, how: str) -> None:
    if how == "connected":
        locked.connect(OTHER)
    else:
        locked.trust(OTHER)
    locked.raw(build(JogStop(axis=0xFF), 1, 1), OTHER)
    locked.run(1)
    assert len(locked.of_type(Type.STATUS, OTHER)) >= 20


def test_a_forged_sign_of_life_keeps_no_stream_of_a_host_that_hangs(locked: Device) -> None:
    client = locked.connect()
    assert locked.prove(client, KEY) == Refusal.NONE
    opened = locked.request(client, StreamOpen()).payload
    assert isinstance(opened, StreamOpened) and opened.stream
    for first in range(8):
        locked.send(StreamSegments(opened.stream, first, 1), (segment(1000, us=1_000_000),))
    for _ in range(50):
        locked.raw(build(JogStop(axis=0), locked.sequence + 1, 0))
        locked.run(0.1)
    assert locked.state == "Hold:0"


# ---- a forged source address: what is not sealed says nothing about the host that it names ----


def forge(device: Device, payload: Layout, ahead: int = 500, later_s: float = 5.0) -> None:
    """Of the owner's address, with a number and a time stamp that it comes to later."""
    device.raw(build(payload, device.sequence + ahead, round((device.now + later_s) * 1e6)))


def log_in(device: Device) -> None:
    assert device.prove(device.connect(), KEY) == Refusal.NONE


@pytest.mark.parametrize("order", [JogStop(axis=0xFF), Hold(), Estop()], ids=["jog_stop", "hold", "estop"])
def test_a_forged_stop_overtakes_nothing_of_the_host(locked: Device, order: Layout) -> None:
    """It stops, as everyone may. The host's next orders count, though their numbers are lower."""
    log_in(locked)
    locked.jog(Jog(0, 1, 1000), 0.2)
    forge(locked, order)
    locked.run(0.2)
    for _ in range(2):  # out of the e-stop or the hold, and then out of motion of a host
        locked.send(Resume())
        locked.send(Reset())
        locked.run(0.7)
    before = locked.pulses[0]
    locked.jog(Jog(0, 1, 1000), 0.2)
    assert locked.pulses[0] > before


@pytest.mark.parametrize("setting", [1, 2])
def test_a_forged_number_is_no_gap_in_the_hosts(make_device: Callable[..., Device], setting: int) -> None:
    """$78: motion is held where a number is missing."""
    device = make_device(key=KEY, settings={78: setting})
    log_in(device)
    device.motion(segment(100), segment(100))
    forge(device, JogStop(axis=0xFF), ahead=20, later_s=0)
    device.motion(segment(100), segment(100))
    device.run(1)
    assert device.pulses[0] == 400
    assert statistics(device).missing == 0
