"""The commands, each as one process would run it, against the real core."""

from __future__ import annotations

import json
import socket
import threading
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import pytest
from click.testing import CliRunner, Result
from core_bridge import FAST, Bridge
from patience import HANG_S
from wificnc.app import root
from wificnc.connection.client import Client
from wificnc.connection.settings import name_of
from wificnc.errors import Exit, LinkError, ProtocolError, RefusedError, UserError
from wificnc.profile import find_machines, load_machine


def run(*arguments: str, stdin: str | None = None) -> Result:
    """A UserError comes out as itself, as it does before the error boundary."""
    result = CliRunner().invoke(root, list(arguments), input=stdin)
    if isinstance(result.exception, UserError):
        raise result.exception
    assert result.exception is None or isinstance(result.exception, SystemExit), result.exc_info
    return result


def write(file: Path, text: str) -> Path:
    file.write_text(text)
    return file


@pytest.fixture
def target(bridge: Bridge, monkeypatch: pytest.MonkeyPatch) -> Bridge:
    monkeypatch.setenv("WIFICNC_TO", bridge.target)
    return bridge


def test_status(target: Bridge) -> None:
    document = json.loads(run("status", "--json").stdout)
    assert document["state"] == "Idle"
    assert document["machine_position"] == {"X": 0.0, "Y": 0.0, "Z": 0.0}
    assert "Idle" in run("status").stdout


def test_send(target: Bridge, tmp_path: Path) -> None:
    job = tmp_path / "job.nc"
    job.write_text("G21\nG0 X1 Y2 (there)\nM2\n")
    result = run("send", str(job), "--json")
    document = json.loads(result.stdout)
    assert result.exit_code == 0
    assert (document["end"], document["lines_answered"], document["errors"]) == ("finished", 3, [])
    assert document["machine_position"] == {"X": 1.0, "Y": 2.0, "Z": 0.0}


@pytest.mark.parametrize("end", ["M2", "M30", "%", "o<t> call\nM2"])
def test_send_ends_with_the_program_and_says_what_is_left(target: Bridge, tmp_path: Path, end: str) -> None:
    """The tail would run with the spindle off, and in G54."""
    sub = "o<t> sub\no<t> endsub\n" if "call" in end else ""
    head = f"{sub}G21 G90\nG10L2P2X10\nG55\nM3S1000\nG1X1F1000\n{end}\n"
    job = tmp_path / "job.nc"
    job.write_text(head + "G1X5\nG1X6\n")
    result = run("send", str(job), "--json")
    document = json.loads(result.stdout)
    assert result.exit_code == 0 and (document["end"], document["lines_not_run"]) == ("finished", 2)
    assert document["machine_position"]["X"] == 11.0
    first = head.count("\n") + 1
    assert f"2 lines are not run, from line {first} on" in result.stderr
    with pytest.raises(UserError, match=r"not run|parameters"):
        run("send", str(job), "--from-line", str(first), "--yes")


def test_send_says_which_line_was_refused(target: Bridge, tmp_path: Path) -> None:
    job = tmp_path / "job.nc"
    job.write_text("G21\n\nG1 X1\nG0 X5\n")
    result = run("send", str(job), "--json")
    assert result.exit_code == Exit.JOB
    assert json.loads(result.stdout)["errors"] == [{"line": 3, "code": 22, "text": "G1 X1"}]
    assert "job.nc:3: error:22 the feed rate is missing (F)" in result.stderr


def test_resume_needs_somebody_to_ask(target: Bridge, tmp_path: Path) -> None:
    job = tmp_path / "job.nc"
    job.write_text("G21\nG0 X1 Y2\nG0 X5\n")
    with pytest.raises(UserError, match="this is not a terminal") as error:
        run("send", str(job), "--from-line", "3")
    assert error.value.exit_code == Exit.USAGE
    assert run("send", str(job), "--from-line", "3", "--yes").exit_code == 0
    assert target.position_steps()[:2] == [1250, 500]


def test_a_resume_after_a_restart_is_refused(target: Bridge, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """The first part reports the controller's start id, the resume compares it: the position is another one now."""
    job = tmp_path / "job.nc"
    job.write_text("G21\nG0 X1 Y2\nG1 X5\n")
    monkeypatch.setattr(Client, "start_id", lambda client: "0000ABCD")
    first = run("send", str(job))
    assert "--start-id 0000ABCD" in first.stderr
    job.write_text("G21\nG0 X1 Y2\nG0 X5\n")
    resume = ("send", str(job), "--from-line", "3", "--yes")
    before = target.position_steps()
    for found in ("0000ABCF", ""):
        monkeypatch.setattr(Client, "start_id", lambda client, found=found: found)
        with pytest.raises(UserError, match="restarted since the first part") as error:
            run(*resume, "--start-id", "0000ABCD")
        assert error.value.hint and "home it" in error.value.hint and target.position_steps() == before
    monkeypatch.setattr(Client, "start_id", lambda client: "0000ABCD")
    assert "--start-id" in run(*resume).stderr  # not compared: there is a message
    assert "start-id" not in run(*resume, "--start-id", "0000abcd").stderr


def test_a_resume_runs_in_the_work_system_of_the_first_part(target: Bridge, tmp_path: Path) -> None:
    """The stop of the first part was a reset, which leaves G54."""
    job = tmp_path / "job.nc"
    run("send", str(write(tmp_path / "zeros.nc", "G10L2P1X1Y0\nG10L2P2X20Y10\nG55\n")))
    first = run("send", str(write(job, "G0X1Y2\nG1X5\n")))
    assert "--began G55" in first.stderr
    run("send", str(write(tmp_path / "reset.nc", "G54\n")))
    write(job, "G0X1Y2\nG0X5\n")
    resume = ("send", str(job), "--from-line", "2", "--yes")
    for wrong in ("G55M3", "G99", "X5", "G54.5", ""):
        assert run(*resume, "--began", wrong).exit_code == Exit.USAGE
    assert "takes G54" in run(*resume).stderr
    assert target.position_steps()[0] == 6 * 250
    assert "takes" not in run(*resume, "--began", "g55 G21").stderr
    assert target.position_steps()[:2] == [25 * 250, 12 * 250]


def test_settings(target: Bridge, tmp_path: Path) -> None:
    file = tmp_path / "machine.toml"
    assert run("settings", "get", "max_rate_mm_min.x").stdout == "20000.000\n"
    assert json.loads(run("settings", "get", "$120", "homing", "--json").stdout) == {
        "acceleration_mm_s2.x": 2000.0,
        "homing": False,
    }
    run("settings", "export", str(file))
    assert run("settings", "diff", str(file)).exit_code == 0
    run("settings", "set", "max_rate_mm_min.x=3000", "homing=on", "soft_limits=on")
    result = run("settings", "diff", str(file))
    assert result.exit_code == 1
    assert "max_rate_mm_min.x ($110): 20000.000 -> 3000.000 mm/min" in result.stdout
    with pytest.raises(UserError, match="this is not a terminal"):
        run("settings", "import", str(file))
    run("settings", "import", str(file), "--yes")
    assert run("settings", "diff", str(file)).exit_code == 0


@pytest.mark.parametrize("by", ["name", "file"])
def test_a_machine_profile_is_imported(target: Bridge, tmp_path: Path, by: str) -> None:
    """Its own values are those of the controller after it, and nothing else has changed."""
    before = dict(json.loads(run("settings", "get", "--json").stdout))
    profile = "shapeoko3" if by == "name" else str(find_machines()["shapeoko3"])
    assert run("settings", "diff", profile).exit_code == Exit.JOB
    run("settings", "import", profile, "--yes")
    after = json.loads(run("settings", "get", "--json").stdout)
    given = {name_of(number): value for number, value in load_machine("shapeoko3").settings().items()}
    known = {name: value for name, value in given.items() if name in before}
    assert known and after == {**before, **{name: pytest.approx(value) for name, value in known.items()}}
    assert run("settings", "import", profile, "--yes").stderr.endswith("nothing to change\n")


def test_what_another_controller_printed_is_imported(target: Bridge, tmp_path: Path) -> None:
    file = tmp_path / "grbl.txt"
    file.write_text("Grbl 1.1f ['$' for help]\r\n$$\r\n$0=10\r\n$110=750.000 (x max rate, mm/min)\r\n$37=1\r\nok\r\n")
    result = run("settings", "import", str(file), "--yes")
    assert "does not have $37: skipped" in result.stderr
    assert run("settings", "get", "$110").stdout == "750.000\n"
    assert run("settings", "get", "$0").stdout == "10\n"


def test_a_line_that_is_no_setting_changes_nothing(target: Bridge, tmp_path: Path) -> None:
    file = tmp_path / "grbl.txt"
    file.write_text("$0=10\n$110=75O\n")
    with pytest.raises(UserError, match=r":2: '\$110=75O' is not like"):
        run("settings", "import", str(file), "--yes")
    assert run("settings", "get", "$0").stdout != "10\n"


def test_a_profile_that_does_not_exist_is_not_imported(target: Bridge) -> None:
    with pytest.raises(UserError, match="shapeoko4") as refused:
        run("settings", "import", "shapeoko4", "--yes")
    assert "shapeoko3" in (refused.value.hint or "")


def test_homing_is_switched_on_before_soft_limits(target: Bridge, tmp_path: Path) -> None:
    file = tmp_path / "limits.toml"
    file.write_text("schema = 1\n[settings]\nsoft_limits = true\nhoming = true\n")
    assert run("settings", "import", str(file), "--yes").exit_code == 0


def test_import_changes_nothing_when_one_value_is_impossible(target: Bridge, tmp_path: Path) -> None:
    file = tmp_path / "bad.toml"
    file.write_text("schema = 1\n[axis.x]\nmax_rate_mm_min = 1000.0\n[axis.y]\nmax_rate_mm_min = 0.0\n")
    with pytest.raises(UserError, match=r"nothing was changed.*\n.*max_rate_mm_min.y = 0.000: must be 0.001 to"):
        run("settings", "import", str(file), "--yes")
    assert run("settings", "get", "$110").stdout == "20000.000\n"


def test_refused_setting(target: Bridge) -> None:
    with pytest.raises(RefusedError, match=r"max_rate_mm_min.x = -1: error:4 the value must not be negative"):
        run("settings", "set", "max_rate_mm_min.x=-1")
    with pytest.raises(UserError, match="unknown setting max_rat_mm_min") as error:
        run("settings", "set", "max_rat_mm_min.x=5")
    assert error.value.hint == "did you mean max_rate_mm_min.x?"


def test_monitor_of_a_script(target: Bridge) -> None:
    result = run("monitor", stdin="G0X1\nK\n")
    assert result.stdout.splitlines()[-2:] == ["ok", "error:2"]


@pytest.mark.parametrize("value", ["1!", "\u00e4", "1?", "~", "1\x18"])
def test_a_value_that_would_act_as_a_command_is_refused(target: Bridge, value: str) -> None:
    before = run("settings", "get", "$100").stdout
    with pytest.raises(UserError, match="nothing was sent"):
        run("settings", "set", f"$100={value}")
    assert json.loads(run("status", "--json").stdout)["state"] == "Idle"
    assert run("settings", "get", "$100").stdout == before


def test_monitor_keeps_comments_and_refuses_what_would_act(target: Bridge) -> None:
    """The bytes of an umlaut are real-time commands, and so is an exclamation mark."""
    assert run("monitor", stdin="G0X1 (wow! \u00c4 ~\u0085)\n(\u00c4)\n$G ; \u00fc?\n").stdout.count("ok") == 3
    assert json.loads(run("status", "--json").stdout)["state"] == "Idle"
    for line in ("G0X2\u00c4", "G0X2!"):
        with pytest.raises(UserError, match="nothing was sent"):
            run("monitor", stdin=f"{line}\n")
    assert json.loads(run("status", "--json").stdout)["work_position"]["X"] == 1.0


def test_unlock(target: Bridge) -> None:
    assert "not locked: Idle" in run("unlock").stderr
    run("unlock", "--reset")


def test_jog(target: Bridge) -> None:
    document = json.loads(run("jog", "X5", "y-2.5", "--feed", "2000", "--json").stdout)
    assert document["work_position"] == {"X": 5.0, "Y": -2.5, "Z": 0.0}
    assert "at X 1.000  Y -2.500" in run("jog", "X1", "--absolute").stderr
    run("jog", "Z1", "--inch", "--feed", "20")
    assert target.position_steps()[:3] == [250, -625, 6350]
    with pytest.raises(RefusedError, match="error:"):
        run("jog", "A5")


def test_home_without_homing(target: Bridge) -> None:
    with pytest.raises(RefusedError, match="homing is not enabled"):
        run("home")


def test_home_and_an_alarm_that_homing_ends(monkeypatch: pytest.MonkeyPatch) -> None:
    homing = "$22=1\n$24=600\n$25=3000\n$26=5\n$130=50\n$131=50\n$132=50\n"
    with Bridge(settings=FAST + homing) as bridge:
        for axis in range(3):
            bridge.travel(axis, -1000, 2000)
        monkeypatch.setenv("WIFICNC_TO", bridge.target)
        document = json.loads(run("home", "--json").stdout)
        assert document["state"] == "Idle"
        assert document["machine_position"] == {"X": -1.0, "Y": -1.0, "Z": -1.0}


def test_probe_sets_zero_at_the_contact(monkeypatch: pytest.MonkeyPatch) -> None:
    with Bridge() as bridge:
        bridge.surface(-500)
        monkeypatch.setenv("WIFICNC_TO", bridge.target)
        document = json.loads(run("probe", "Z-10", "--feed", "300", "--set", "1.5", "--retract", "4", "--json").stdout)
        assert document["machine_position"]["Z"] == -2.0
        assert document["work_position_now"]["Z"] == pytest.approx(5.5, abs=0.2)  # from where it stood, a bit below
        run("jog", "Z1.5", "--absolute")
        assert bridge.position_steps()[2] == pytest.approx(-500, abs=1)  # 1.5 is the place of contact, exactly
        assert "[GC:G0 G54 G17 G21 G90" in run("monitor", stdin="$G\n").stdout


def test_probe_that_touches_nothing(target: Bridge) -> None:
    with pytest.raises(RefusedError, match="ALARM:5: the probe made no contact"):
        run("probe", "Z-5")
    assert "unlocked: Idle" in run("unlock").stderr
    assert " G90 " in run("monitor", stdin="$G\n").stdout


def test_dry_run_finds_every_error_and_moves_nothing(target: Bridge, tmp_path: Path) -> None:
    job = tmp_path / "job.nc"
    job.write_text("G21\nG1 X1\nG0 X5\nG77\nG0 X7\n")
    result = run("send", str(job), "--dry-run", "--json")
    assert result.exit_code == Exit.JOB
    assert [error["line"] for error in json.loads(result.stdout)["errors"]] == [2, 4]
    assert target.position_steps() == [0] * 6
    assert json.loads(run("status", "--json").stdout)["state"] == "Idle"


def test_bad_axis_words(target: Bridge) -> None:
    for words in (["X"], ["10"], ["X1", "X2"], ["Q5"]):
        assert run("jog", *words).exit_code == Exit.USAGE


def test_no_controller_there() -> None:
    with socket.create_server(("127.0.0.1", 0)) as server:
        port = server.getsockname()[1]
    with pytest.raises(LinkError, match="cannot reach"):
        run("status", "--to", f"tcp://127.0.0.1:{port}")


@pytest.mark.parametrize(
    "target", ["127.0.0", "http://a", "tcp://", "serial://", "tcp://a:x", "serial:///dev/x?baud=y"]
)
def test_no_such_target(target: str) -> None:
    with pytest.raises(UserError) as error:
        run("status", "--to", target)
    assert error.value.exit_code == Exit.USAGE
    assert error.value.hint


@contextmanager
def stranger(says: bytes) -> Iterator[str]:
    """A port where someone says this to everything."""
    with socket.create_server(("127.0.0.1", 0)) as server:

        def serve() -> None:
            connection, _ = server.accept()
            with connection:
                while connection.recv(4096):
                    if says:
                        connection.sendall(says)

        thread = threading.Thread(target=serve)
        thread.start()
        yield f"tcp://127.0.0.1:{server.getsockname()[1]}"
        thread.join(HANG_S)


def test_something_else_answers(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("wificnc.connection.client.CONNECT_S", 0.2)
    with (
        stranger(b"HTTP/1.1 400 Bad Request\r\n") as target,
        pytest.raises(ProtocolError, match="not answer like a Grbl") as error,
    ):
        run("status", "--to", target)
    assert error.value.exit_code == Exit.PROTOCOL


def test_an_alarm_that_only_a_reset_ends(target: Bridge, tmp_path: Path) -> None:
    """The controller answers, and each command says what leads on."""
    job = tmp_path / "job.nc"
    job.write_text("G0 X1\n")
    run("settings", "set", "homing=on", "soft_limits=on")
    assert run("monitor", stdin="G0X500\n").stdout.splitlines()[-1] == "error:9"
    assert json.loads(run("status", "--json").stdout)["state"] == "Alarm"
    for command in ("unlock", "home"):
        with pytest.raises(RefusedError, match="ALARM:2: the target is outside the travel") as error:
            run(command)
        assert error.value.hint and "unlock --reset" in error.value.hint
    with pytest.raises(RefusedError, match="state Alarm"):
        run("send", str(job))
    assert "unlocked: Idle" in run("unlock", "--reset").stderr


@pytest.mark.slow
def test_an_alarm_in_which_grbl_itself_is_mute() -> None:
    with stranger(b"[MSG:Reset to continue]\r\n") as target, pytest.raises(RefusedError) as error:
        run("status", "--to", target)
    assert error.value.hint
    assert "unlock --reset" in error.value.hint
