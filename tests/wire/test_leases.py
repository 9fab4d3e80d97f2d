"""How long an address gets status reports: not after its system has answered that no program listens there. Anyone can
forge that answer, so it ends no reports of who controls the machine or has logged in."""

# ruff: noqa: F401, F811  fixtures of other files

from __future__ import annotations

import socket
import sys
from collections.abc import Callable
from pathlib import Path

import pytest
from patience import HANG_S
from test_module import Make, Module, make
from test_motion import segment
from test_serve_wire import ADDRESS, serve
from wificnc.connection.wmc3.layout import IO_STATUS_PORT, STATUS_PORT, UDP_PORT, Jog, JogStop, Refusal, Type
from wificnc.connection.wmc3.packet import build
from wificnc.simulator.serve.server import Server
from wire_device import HOST, OTHER, Device, number

KEY = "k7qf3-x2m9d-0abcd-efghj"
REGISTER = JogStop(axis=0xFF)
CLOSED, LISTENS = "127.0.0.71", "127.0.0.72"  # hosts of the tests over real sockets


@pytest.fixture
def locked(make_device: Callable[..., Device]) -> Device:
    return make_device(key=KEY)


def no_one_listens(device: Device, address: str = HOST, port: int = STATUS_PORT) -> None:
    """ICMP: the datagram to there has not found a program."""
    device.lib.host_wire_unreachable(device.wire, number(address), port)


def reports(device: Device, seconds: float, address: str = HOST) -> int:
    device.sent.clear()
    device.run(seconds)
    return len(device.of_type(Type.STATUS, address))


def test_reports_end_where_no_program_listens(device: Device) -> None:
    device.send(REGISTER)
    device.send(REGISTER, address=OTHER)
    assert reports(device, 1) == pytest.approx(20, abs=1)
    no_one_listens(device)
    assert reports(device, 1) == 0
    assert len(device.of_type(Type.STATUS, OTHER)) == pytest.approx(20, abs=1), "another host's continue"
    device.send(REGISTER)
    assert reports(device, 1) == pytest.approx(20, abs=1), "a program that listens now registers as before"


def test_an_answer_from_another_port_says_nothing(device: Device) -> None:
    """Acks of a stream go to the port that it came from."""
    device.send(REGISTER)
    no_one_listens(device, port=40000)
    no_one_listens(device, "10.9.9.9")
    assert reports(device, 1) == pytest.approx(20, abs=1)


def test_the_host_in_control_keeps_its_reports(device: Device) -> None:
    device.motion(segment(10))
    no_one_listens(device)
    assert reports(device, 1) == pytest.approx(20, abs=1)


def test_a_host_that_is_logged_in_keeps_its_reports(locked: Device) -> None:
    assert locked.prove(locked.connect(), KEY) == Refusal.NONE
    locked.send(REGISTER)
    no_one_listens(locked)
    assert reports(locked, 1) == pytest.approx(20, abs=1)


def test_a_connection_or_a_trusted_address_alone_does_not_keep_them(locked: Device) -> None:
    """Neither is a proof of who sends datagrams."""
    locked.connect()
    locked.trust(OTHER)
    for address in (HOST, OTHER):
        locked.send(REGISTER, address=address)
        assert reports(locked, 1, address) == pytest.approx(20, abs=1)
        no_one_listens(locked, address)
        assert reports(locked, 1, address) == 0


def test_registering_again_and_again_brings_no_more_reports(device: Device) -> None:
    """A forger of this address, against which it defends itself by its answers."""
    device.send(REGISTER)
    device.sent.clear()
    for _ in range(1000):
        device.send(REGISTER)
        no_one_listens(device)
        device.run(0.001)
    assert len(device.of_type(Type.STATUS)) <= 21, "one each 50 ms"


def test_its_place_is_free(device: Device) -> None:
    for last in range(4):
        device.send(REGISTER, address=f"10.1.0.{last}")
    no_one_listens(device, "10.1.0.2")
    device.send(REGISTER)
    assert reports(device, 1) == pytest.approx(20, abs=1)


@pytest.mark.parametrize(("first", "second"), [(STATUS_PORT, IO_STATUS_PORT), (IO_STATUS_PORT, STATUS_PORT)])
def test_a_module_reports_while_one_of_its_two_ports_is_open(make: Make, first: int, second: int) -> None:
    module: Module = make()
    module.send(REGISTER)
    no_one_listens(module, port=first)
    assert reports(module, 1) > 20
    module.send(REGISTER)
    no_one_listens(module, port=second)
    assert reports(module, 1) > 20, "since it registered again, one alone"
    no_one_listens(module, port=first)
    assert reports(module, 1) == 0


# ---- real sockets ----

on_linux = pytest.mark.skipif(sys.platform != "linux", reason="Linux tells it there")


def listener(address: str) -> socket.socket:
    opened = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
    opened.bind((address, STATUS_PORT))
    opened.settimeout(HANG_S)
    return opened


def post(address: str, payload: Jog | JogStop, sequence: int = 1) -> None:
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as sender:
        sender.bind((address, 0))
        sender.sendto(build(payload, sequence, sequence), (ADDRESS, UDP_PORT))


def heard(listening: socket.socket, count: int) -> None:
    for _ in range(count):
        listening.recv(600)


@on_linux
def test_a_closed_port_ends_its_reports(serve: Callable[..., Server]) -> None:
    """A round of reports goes to all hosts, in the order in which they came: what the second one has heard, the first
    one would have heard before."""
    serve()
    with listener(LISTENS) as other:
        with listener(CLOSED) as first:
            post(CLOSED, REGISTER)
            heard(first, 2)
            post(LISTENS, REGISTER)
            heard(other, 1)
        heard(other, 3)  # its system has answered by now
        with listener(CLOSED) as again:
            again.setblocking(False)
            heard(other, 5)
            with pytest.raises(BlockingIOError):
                again.recv(600)
            again.settimeout(HANG_S)
            post(CLOSED, REGISTER, 2)
            heard(again, 2)
        heard(other, 5)  # not one that is sent to it was lost to that answer: they come on


@on_linux
def test_a_closed_port_does_not_end_those_of_the_host_in_control(serve: Callable[..., Server]) -> None:
    serve()
    with listener(LISTENS) as other:
        post(CLOSED, Jog(0, 1, 100))
        post(LISTENS, REGISTER)
        heard(other, 5)
        with listener(CLOSED) as again:
            heard(again, 2)


@on_linux
def test_an_answer_that_waits_costs_no_processor_time(serve: Callable[..., Server]) -> None:
    """poll() returns as long as one waits."""
    server = serve()
    post(CLOSED, REGISTER)
    with listener(LISTENS) as other:
        post(LISTENS, REGISTER)
        heard(other, 2)
        before = used_ticks(server)
        heard(other, 20)  # a second
        assert used_ticks(server) - before < 50, "of 100 a second"


def used_ticks(server: Server) -> int:
    """Processor time of the server, 1/100 s."""
    fields = Path(f"/proc/{server.pid}/stat").read_text().rsplit(")", 1)[1].split()
    return int(fields[11]) + int(fields[12])
