"""`wificnc login`: a sender that cannot log in commands when someone has logged in from its computer."""

from __future__ import annotations

import json
from pathlib import Path

import pytest
from serve_peer import Peer, Serve, connect, stream
from wificnc.commands.login import command
from wificnc.commands.status import command as status_command
from wificnc.commands.unlock import command as unlock_command
from wificnc.connection.access import login_proof, normal_key
from wificnc.connection.transport import SocketTransport
from wificnc.errors import RefusedError, UserError

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


def test_a_sender_that_was_connected_before_the_login_is_told_to_connect_again(serve: Serve) -> None:
    """It was asked to log in, although its address was trusted. What it has sent is lost, so it must restart."""
    server = serve(key=KEY)
    with connect(server) as sender:
        assert "[MSG:Locked" in sender.until("MSG:")[-1]
        sender.send(b"G0X1\n")
        assert "[MSG:Locked" in sender.until("MSG:")[-1]
        login(server.tcp, "--key", KEY)
        told = "[MSG:This address is trusted now: connect again]"
        assert sender.until("MSG:")[-1] == told
        sender.send(b"G0X2\n")
        assert sender.until("MSG:")[-1] == told
    with connect(server) as sender:
        assert sender.ask("G0X1") == ["ok"]


def test_a_locked_senders_lines_have_one_answer_each(serve: Serve) -> None:
    """A sender that gets none waits for ever."""
    with connect(serve(key=KEY)) as sender:
        assert "[MSG:Locked" in sender.until("MSG:")[-1]
        assert stream(sender, ["G0X1", "", "$$", *["G1X2F100"] * 300]) == ["error:180", "ok", *["error:180"] * 301]


def test_the_status_of_a_locked_controller_says_how_to_log_in(serve: Serve, capfd: pytest.CaptureFixture[str]) -> None:
    """It showed the state alone."""
    tcp = serve(key=KEY).tcp

    def shown(*arguments: str) -> str:
        status_command.main(["--to", *arguments], standalone_mode=False)
        return capfd.readouterr().out

    assert f"`wificnc login {tcp}`" in (said := " ".join(shown(str(tcp)).split())) and "locked" in said
    assert json.loads(shown(str(tcp), "--json"))["logged_in"] is False
    assert json.loads(shown(f":{KEY}@{tcp}", "--json"))["logged_in"] is True
    assert "log in" not in shown(f":{KEY}@{tcp}")


def test_trust_for_ever_survives_a_restart_and_is_listed_and_revoked(
    serve: Serve, tmp_path: Path, capfd: pytest.CaptureFixture[str]
) -> None:
    store = tmp_path / "machine.store"
    server = serve(key=KEY, store=store)
    login(server.tcp, "--key", KEY, "--for", "always")
    with connect(server) as sender:
        assert sender.ask("$TRUST") == ["[TRUST:1,127.0.0.1,always]", "ok"]
    server.stop()
    server = serve(key=KEY, store=store)
    with connect(server) as sender:
        assert sender.ask("G0X1") == ["ok"]
    login(server.tcp, "--key", KEY, "--list")
    assert capfd.readouterr().out.split() == ["127.0.0.1", "always"]
    with pytest.raises(UserError, match=r"10\.0\.0\.9 is not trusted"):
        login(server.tcp, "--key", KEY, "--revoke", "10.0.0.9")
    login(server.tcp, "--key", KEY, "--revoke", "127.0.0.1")
    login(server.tcp, "--key", KEY, "--list", "--json")
    assert json.loads(capfd.readouterr().out) == []
    server.stop()
    with connect(serve(key=KEY, store=store)) as sender:
        assert "[MSG:Locked" in sender.until("MSG:")[-1]


def test_trust_for_a_day_ends_with_the_controller_and_all_is_revoked(serve: Serve, tmp_path: Path) -> None:
    store = tmp_path / "machine.store"
    server = serve(key=KEY, store=store)
    login(server.tcp, "--key", KEY)
    server.stop()
    server = serve(key=KEY, store=store)
    with connect(server) as sender:
        assert "[MSG:Locked" in sender.until("MSG:")[-1]
    login(server.tcp, "--key", KEY)
    login(server.tcp, "--key", KEY, "--revoke", "all")
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


@pytest.mark.parametrize("rounds", ["99999999", "-1", "2000,1", "0", "1", "999"])
def test_a_question_that_is_none_is_not_answered(rounds: str) -> None:
    """A rogue controller cannot make a client calculate for hours, nor guess the key from a proof that took no time."""
    assert login_proof(KEY, b"[LOGIN:%s,%s,%s]" % (b"0" * 32, b"1" * 32, rounds.encode())) is None


def test_the_start_button_lets_in_a_sender_that_cannot_log_in(serve: Serve) -> None:
    server = serve(key=KEY, control=0)
    assert server.control
    with connect(server) as sender, Peer.tcp(server.control, line_end=b"\n") as hands:
        assert "[MSG:Locked" in sender.until("MSG:")[-1]
        sender.send(b"G0X1\n")
        assert "[MSG:Locked" in sender.until("MSG:")[-1]
        hands.send(b"start\n")
        assert "start button" in sender.until("Let in")[-1]
        assert sender.ask("G1F100") == ["ok"]
    with connect(server) as sender:
        assert sender.ask("$TRUST")[0].startswith("[TRUST:1,127.0.0.1,"), "its address is trusted"


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


def unlock(address: object, *arguments: str) -> None:
    unlock_command.main(["--to", str(address), "--reset", *arguments], standalone_mode=False)


def test_a_reset_of_a_client_that_may_not_reset_says_why(serve: Serve, capfd: pytest.CaptureFixture[str]) -> None:
    """It said that the controller does not answer, and to check the baud rate."""
    with pytest.raises(RefusedError, match="is locked"):
        unlock(serve(key=KEY).tcp)
    server = serve()
    with connect(server) as owner:
        assert owner.ask("G0X1") == ["ok"]
        with pytest.raises(RefusedError, match="another client is in control"):
            unlock(server.tcp)
        unlock(server.tcp, "--take")
    assert "not locked: Idle" in capfd.readouterr().err
