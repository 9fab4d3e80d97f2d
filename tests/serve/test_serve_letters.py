"""Letters of UTF-8 in what clients of the network send: no command, whoever sends them and however they are cut."""

from __future__ import annotations

import re

import pytest
from serve_peer import Serve, connect
from wificnc.simulator.serve.server import Server


@pytest.fixture
def server(serve: Serve) -> Server:
    return serve()


def overrides(report: str) -> str:
    found = re.search(r"\|Ov:([0-9,]+)", report)
    return found[1] if found else ""


@pytest.mark.parametrize("cut", [1, 2, 3, 1000])
def test_a_raw_stream_with_letters_changes_nothing(server: Server, cut: int) -> None:
    """shared by nc, UGS and all who send a file as it is."""
    job = "G21 G90\n(Größe 6 × 4 mm, Äußeres)\nG0 X10 ; Ä\n".encode()
    with connect(server) as owner:
        owner.status()
        for at in range(0, len(job), cut):
            owner.send(job[at : at + cut])
        for _ in range(3):
            assert owner.line() == "ok"
        assert owner.idle_position_mm()[0] == 10.0
        reports = [owner.status() for _ in range(30)]
        assert {overrides(report) for report in reports} <= {"", "100,100,100"}
        assert not any("Door" in report for report in reports)


@pytest.mark.parametrize("line", ["G0X−5", "Ä", "G0X5Ä"])
def test_letters_in_code_are_refused(server: Server, line: str) -> None:
    with connect(server) as owner:
        owner.send(f"{line}\n".encode())
        assert owner.line().startswith("error:")
        assert owner.idle_position_mm()[0] == 0.0


def test_an_observers_letters_do_nothing(server: Server) -> None:
    with connect(server) as owner, connect(server) as observer:
        assert owner.ask("G0X1") == ["ok"]
        observer.until("^ok$")
        observer.send("(Ä)\n".encode())
        observer.until("^error:181$")
        assert owner.idle_position_mm()[0] == 1.0
        assert owner.status().startswith("<Idle")


def test_half_a_letter_of_one_client_keeps_no_command_of_another(server: Server) -> None:
    with connect(server) as owner, connect(server) as observer:
        assert owner.ask("G0X1") == ["ok"]
        observer.until("^ok$")
        owner.send(b"(\xc3")
        observer.send(b"\x84")
        assert observer.until("Check Door")
