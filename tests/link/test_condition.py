"""Why the machine does not work, and what leads on: in words, over the network and on a serial port."""

from __future__ import annotations

import json
from collections.abc import Iterator
from pathlib import Path

import pytest
from click.testing import CliRunner
from generate.states_table import load_states
from wificnc.app import main, root
from wificnc.board.load import load_board
from wificnc.connection.client import connected
from wificnc.connection.condition import STATES, condition
from wificnc.connection.grbl import Status, parse
from wificnc.connection.words import ALARMS
from wificnc.errors import EXIT_WORDS, Exit
from wificnc.simulator.serve.options import Address, ServeOptions
from wificnc.simulator.serve.server import Server

RESET_ALARMS = (1, 2, 50, 51, 52, 53, 54, 57)  # docs/errors.md


def status(state: str) -> Status:
    found = parse(f"<{state}|MPos:0.000,0.000,0.000|FS:0,0>")
    assert isinstance(found, Status)
    return found


LOCKED_56 = "Locked by ALARM:56: '$H'|'$X' to unlock"


@pytest.mark.parametrize("code", [code for code in ALARMS if code != 55])
def test_an_alarm_has_its_number_its_meaning_and_a_way_out(code: int) -> None:
    way_out = "reset to continue" if code in RESET_ALARMS else "'$H'|'$X' to unlock"
    found = condition(status("Alarm"), [f"Locked by ALARM:{code}: {way_out}"])
    assert f"ALARM:{code}" in found.why
    assert ALARMS[code] in found.why
    assert ("unlock --reset" in found.next) == (code in RESET_ALARMS)
    assert "wificnc home" in found.next


@pytest.mark.parametrize(
    ("state", "notices", "why", "lead"),
    [
        ("Idle", [], "", ""),
        ("Alarm", [], "does not report", "wificnc home"),
        ("Alarm", ["Locked since start or reset: '$H'|'$X' to unlock"], "started or reset", "wificnc home"),
        ("Alarm", ["Locked, check limits: '$H'|'$X' to unlock"], "limit switch was closed", "wificnc jog"),
        ("Alarm", ["Locked by ALARM:50: release the emergency stop"], "ALARM:50", "release the emergency stop, then"),
        ("Alarm", ["Stored data is damaged: settings $1. Check $$ $# $N, then $ACK"], "damaged: settings $1", "$ACK"),
        ("Alarm", ["Restarted by fault at 0x9D001234", LOCKED_56], "(fault at 0x9D001234)", "wificnc home"),
        ("Hold:0", [], "feed hold", "~ resume"),
        ("Hold:0", ["Sender lost: feed hold"], "connection of the sender", "wificnc monitor"),
        ("Hold:0", ["Sender lost: feed hold", "Program pause"], "connection of the sender", "wificnc monitor"),
        ("Hold:0", ["Program pause"], "M0", "~"),
        ("Hold:0", ["Tool change: T4"], "tool T4", "~"),
        ("Tool", [], "a tool change", "$TPW"),
        ("Tool", ["Tool change: T4 6 mm flat"], "tool T4", "$TPW"),
        ("Hold:1", [], "slow down", "wait"),
        ("Door:0", [], "closed now", "~"),
        ("Door:1", [], "is open", "close it"),
        ("Door:3", [], "start again", "wait"),
        ("Sleep", [], "$SLP", "unlock --reset"),
        ("Check", [], "check mode", "$C"),
        ("Run", ["Remote host controls motion"], "remote host", "wait"),
    ],
)
def test_words_of_a_state(state: str, notices: list[str], why: str, lead: str) -> None:
    found = condition(status(state), notices)
    assert why in found.why
    assert lead in found.next
    assert bool(found.why) == (state != "Idle")


def test_every_state_of_the_reports_has_words() -> None:
    """The names are those of protocol/states.toml."""
    names = {state.report for state in load_states().state}
    assert {"Hold:0", "Door:1", "Alarm"} < names
    for name in names - {"Idle"}:
        assert name in STATES or name.partition(":")[0] in STATES


def test_every_exit_code_has_words_and_stands_in_the_documents() -> None:
    assert list(EXIT_WORDS) == list(Exit)
    page = (Path(__file__).parents[2] / "docs" / "errors.md").read_text(encoding="utf-8")
    assert all(f"| {int(code)} | {text} |" in page for code, text in EXIT_WORDS.items())


# ---- against a controller ----


@pytest.fixture
def server(tmp_path: Path) -> Iterator[Server]:
    fast = tuple(f"${number}={value}" for number, value in ((110, 5000), (120, 500)))
    options = ServeOptions(board=load_board("host"), tcp=Address("127.0.0.1", 0), pty=tmp_path / "tty", settings=fast)
    with Server(options) as one:
        yield one


@pytest.fixture(params=["tcp", "serial"])
def to(request: pytest.FixtureRequest, server: Server) -> str:
    return f"tcp://{server.tcp}" if request.param == "tcp" else f"serial://{server.options.pty}"


@pytest.fixture
def command(capsys: pytest.CaptureFixture[str]):
    """A command with its exit code, as a process ends."""

    def run(*arguments: str) -> tuple[int, str, str]:
        with pytest.raises(SystemExit) as ended:
            main(list(arguments))
        said = capsys.readouterr()
        return int(ended.value.code or 0), said.out, said.err

    return run


@pytest.mark.slow
def test_an_alarm_that_somebody_else_has_caused(server: Server, to: str, tmp_path: Path, command) -> None:
    with connected(f"tcp://{server.tcp}") as first:
        first.synchronise()
        first.send(b"G38.2Z-1F600\n")
        while first.look().status.state != "Alarm":
            pass
    code, out, _ = command("status", "--to", to)
    assert code == Exit.OK
    assert "ALARM:5: the probe made no contact within its travel" in out
    assert "wificnc unlock" in out
    (tmp_path / "job.nc").write_text("G0X1\n")
    for arguments in (("jog", "X1"), ("send", str(tmp_path / "job.nc")), ("probe", "Z-1")):
        code, _, err = command(*arguments, "--to", to)
        assert code == Exit.JOB, arguments
        assert "ALARM:5" in err
        assert "wificnc unlock" in err
    assert command("unlock", "--to", to)[0] == Exit.OK
    assert json.loads(command("status", "--to", to, "--json")[1])["why"] == ""


def test_a_hold_is_not_called_unlocked(server: Server, tmp_path: Path, command) -> None:
    to = f"tcp://{server.tcp}"
    with connected(to) as first:
        first.synchronise()
        first.send(b"G1X100F300\n")
        while first.look().status.state != "Run":
            pass
        first.send(b"!")
        while first.look().state != "Hold:0":
            pass
        code, _, err = command("unlock", "--to", to)
        assert code == Exit.JOB
        assert "not locked, but in state Hold:0: a feed hold" in err
        assert "~ resume" in err
        assert "unlock --reset" in err
        document = json.loads(command("status", "--to", to, "--json")[1])
        assert document["commanded_by"]
        assert "feed hold" in document["why"]
    document = json.loads(command("status", "--to", to, "--json")[1])
    assert "connection of the sender" in document["why"]
    assert document["commanded_by"] is None
    (tmp_path / "job.nc").write_text("G0X1\n")
    code, _, err = command("send", str(tmp_path / "job.nc"), "--to", to)
    assert code == Exit.JOB
    assert "connection of the sender" in err
    assert command("unlock", "--reset", "--to", to)[0] == Exit.OK
    assert json.loads(command("status", "--to", to, "--json")[1])["state"] == "Idle"


def test_what_another_client_commands_is_a_refusal(server: Server, command) -> None:
    to = f"tcp://{server.tcp}"
    with connected(to) as first:
        first.synchronise()
        code, _, err = command("jog", "X1", "--to", to)
    assert code == Exit.JOB
    assert "another client is in control" in err
    assert "--take" in err


def test_axes_that_are_not_homed(server: Server) -> None:
    to = f"tcp://{server.tcp}"
    with connected(to) as first:
        first.synchronise()
        first.must("$22=1")
    out = CliRunner().invoke(root, ["status", "--to", to]).stdout
    assert "not homed: X Y Z" in " ".join(out.split())
