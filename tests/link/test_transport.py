"""Bytes over TCP and over a pseudo-terminal."""

from __future__ import annotations

import os
import pty
import socket
import tty

import pytest
from patience import HANG_S
from wificnc.connection.transport import Transport, open_transport, socket_pair
from wificnc.errors import LinkError


def receive(transport: Transport, count: int) -> bytes:
    """As many bytes as are sure to come."""
    data = b""
    while len(data) < count:
        transport.wait(HANG_S)
        data += transport.receive()
    return data


def test_serial_port() -> None:
    master, slave = pty.openpty()
    tty.setraw(slave)
    transport = open_transport(f"serial://{os.ttyname(slave)}?baud=250000")
    transport.send(b"G0X1\n?")
    assert os.read(master, 100) == b"G0X1\n?"
    os.write(master, b"ok\r\n")
    assert receive(transport, 4) == b"ok\r\n"
    assert transport.receive() == b""
    os.close(slave)
    os.close(master)
    with pytest.raises(LinkError, match="is lost"):
        receive(transport, 1)
    transport.close()


def test_serial_port_that_is_not_there() -> None:
    with pytest.raises(LinkError, match="cannot open") as error:
        open_transport("serial:///dev/wificnc-has-no-such-port")
    assert error.value.hint
    assert "connected" in error.value.hint


def test_tcp_and_its_end() -> None:
    with socket.create_server(("127.0.0.1", 0)) as server:
        transport = open_transport(f"tcp://127.0.0.1:{server.getsockname()[1]}")
        peer, _ = server.accept()
        transport.send(b"?")
        assert peer.recv(10) == b"?"
        peer.sendall(b"ok\r\n")
        assert receive(transport, 4) == b"ok\r\n"
        peer.close()
        with pytest.raises(LinkError, match="closed the connection"):
            receive(transport, 1)
        transport.close()
        transport.close()


def test_peer_that_takes_nothing(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("wificnc.connection.transport.SEND_TIMEOUT_S", 0.05)
    transport, peer = socket_pair()
    with pytest.raises(LinkError, match="has accepted no data"):
        transport.send(b"x" * 10_000_000)
    transport.close()
    peer.close()


def test_others_wake_it_up() -> None:
    transport, peer = socket_pair()
    read, write = os.pipe()
    os.write(write, b"!")
    transport.wait(HANG_S, [read])
    assert transport.receive() == b""
    os.close(read)
    os.close(write)
    transport.close()
    peer.close()


@pytest.mark.parametrize(
    ("target", "error", "hint"),
    [
        ("nohost.local", socket.gaierror(-2, "Name or service not known"), "`wificnc discover` lists the controllers"),
        ("192.0.2.1", TimeoutError("timed out"), "`wificnc discover` searches for it"),
        ("192.0.2.1", OSError(113, "No route to host"), "`wificnc discover` searches for it"),
        ("192.0.2.1", ConnectionRefusedError(111, "refused"), "`wificnc serve` on that computer listens at 192.0.2.1:"),
        ("192.0.2.1:99", ConnectionRefusedError(111, "refused"), "a board listens at 192.0.2.1:23"),
        ("localhost", ConnectionRefusedError(111, "refused"), "`wificnc serve` simulates a controller"),
    ],
)
def test_where_to_look_for_a_controller(
    monkeypatch: pytest.MonkeyPatch, target: str, error: OSError, hint: str
) -> None:
    """Not for a simulator where there is a name in a network."""

    def refuse(*_: object) -> None:
        raise error

    monkeypatch.setattr(socket, "create_connection", refuse)
    with pytest.raises(LinkError, match="cannot reach") as lost:
        open_transport(target)
    assert hint in (lost.value.hint or "")
    assert ("wificnc serve" in (lost.value.hint or "")) == ("serve" in hint)
