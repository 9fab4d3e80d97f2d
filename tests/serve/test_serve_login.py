"""`wificnc login`: a sender that cannot log in commands when someone has logged in from its computer."""

from __future__ import annotations

import pytest
from serve_peer import Serve, connect
from wificnc.commands.login import command
from wificnc.errors import RefusedError, UserError
from wificnc.link.access import login_proof, normal_key
from wificnc.link.transport import SocketTransport

KEY = "k7qf3-x2m9d-0abcd-efghj"


def login(address: object, *arguments: str) -> None:
    command.main([str(address), *arguments], standalone_mode=False)


def test_a_login_lets_the_senders_of_this_computer_in_until_it_is_revoked(serve: Serve) -> None:
    server = serve(key=KEY)
    assert server.tcp
    with connect(server) as sender:
        assert "[MSG:Locked" in sender.until("MSG:")[-1]
    login(server.tcp, "--key", KEY.upper())
    with connect(server) as sender:
        assert sender.ask("G0X1") == ["ok"]
    login(server.tcp, "--key", KEY, "--for", "no")
    with connect(server) as sender:
        assert "[MSG:Locked" in sender.until("MSG:")[-1]


def test_the_key_is_not_sent_and_what_is_sent_is_worth_nothing_again(
    serve: Serve, monkeypatch: pytest.MonkeyPatch
) -> None:
    server, sent, send = serve(key=KEY), bytearray(), SocketTransport.send

    def record(transport: SocketTransport, data: bytes) -> None:
        sent.extend(data)
        send(transport, data)

    monkeypatch.setattr(SocketTransport, "send", record)
    login(server.tcp, "--key", KEY, "--for", "no")
    assert b"$LOGIN=" in sent and normal_key(KEY) not in normal_key(sent.decode())
    with connect(server) as listener:
        listener.send(bytes(sent))
        assert "Wrong access key" in listener.until("Wrong")[-1]
        listener.send(b"G0X1\n")
        assert "[MSG:Locked" in listener.until("MSG:")[-1]


@pytest.mark.parametrize("rounds", ["99999999", "-1", "2000,1"])
def test_a_question_that_is_none_is_not_answered(rounds: str) -> None:
    """A rogue controller has nobody calculate for hours."""
    assert login_proof(KEY, b"[LOGIN:%s,%s,%s]" % (b"0" * 32, b"1" * 32, rounds.encode())) is None


def test_a_wrong_key_is_refused(serve: Serve) -> None:
    server = serve(key=KEY)
    with pytest.raises(RefusedError, match="access key"):
        login(server.tcp, "--key", "a guess at it")


def test_open_access_needs_no_trust(serve: Serve) -> None:
    with pytest.raises(RefusedError, match="open"):
        login(serve().tcp, "--key", KEY)


def test_a_serial_port_needs_no_login() -> None:
    with pytest.raises(UserError, match="serial port"):
        login("/dev/ttyUSB0", "--key", KEY)
