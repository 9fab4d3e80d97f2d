"""Lines that the server answers itself, among lines of the machine that are sent without waiting for answers."""

from __future__ import annotations

from serve_peer import Serve, connect, serial

SENT = "G4P0.3\n$TRUST\nG999\n$LOGIN=x\n$TRUST=week\nG4P0\n"
ANSWERS = ["ok", "ok", "error:20", "ok", "error:3", "ok"]


def test_answers_come_in_the_order_of_lines(serve: Serve) -> None:
    """By TCP, of the owner; the dwell takes real time."""
    with connect(serve(speed=1.0)) as owner:
        assert owner.ask("G21") == ["ok"]
        owner.send(SENT)
        assert [owner.until("^(ok|error:)")[-1] for _ in ANSWERS] == ANSWERS


def test_answers_come_in_the_order_of_lines_at_a_serial_port(serve: Serve) -> None:
    with serial(serve(speed=1.0, pty=True)) as owner:
        owner.send("G21\n" + SENT)
        answers = [owner.until("^(ok|error:)")[-1] for _ in ["G21", *ANSWERS]]
        assert answers == ["ok", *ANSWERS]
