"""`wificnc login`: a sender that cannot log in commands when someone has logged in from its computer."""

from __future__ import annotations

import pytest
from serve_peer import Serve, connect
from wificnc.commands.login import command
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
