"""Comments for the operator appear as they are written, whatever letters they have and in whichever code."""

from __future__ import annotations

import json
from pathlib import Path

import pytest
from click.testing import CliRunner
from core_bridge import Bridge
from wificnc.app import root

JOB = """G21 G90 (Größe)
(MSG, Größe prüfen!)
(print,Länge [mm] = #5420 é #<_x> ?)
M1 ; nichts
(DEBUG,ö %.1f#5420 #5421ü)
G0 X1 (MSG,a|b [ä])
"""
LOOP = """#2=0
o100 sub
  (MSG,Größe 6 × 4)
  G1 X[#1] F6000 (PRINT,Länge #1 mm, %.1f#1)
o100 endsub
o101 while [#2 lt 2]
  (debug, #2 [é])
  o100 call [#2*2]
  #2=[#2+1]
  G0 X0 (no message)
o101 endwhile
M1 ; nichts
(MSG, Ende)
M2
(MSG, nie)
"""
ROUNDS = [
    *("0.000000 [é]", "Größe 6 × 4", "Länge 0.000000 mm, 0.0"),
    *("1.000000 [é]", "Größe 6 × 4", "Länge 2.000000 mm, 2.0"),
    "Ende",
]
SHOWN = ["Größe prüfen!", "Länge [mm] = 0.000000 é 0.000000 ?", "ö 0.0 0.0ü", "a|b [ä]"]


@pytest.fixture(params=["utf-8", "cp1252", "utf-8-sig"])
def job(request: pytest.FixtureRequest, tmp_path: Path) -> str:
    path = tmp_path / "job.nc"
    path.write_bytes(JOB.encode(request.param))
    return str(path)


def run(*arguments: str) -> tuple[str, str]:
    done = CliRunner().invoke(root, list(arguments))
    assert done.exit_code == 0, done.stderr
    return done.stdout, done.stderr


def test_sim_shows_them(job: str) -> None:
    assert json.loads(run("sim", job, "--json", "-")[0])["warnings"] == SHOWN
    assert [f"warning: {each}" for each in SHOWN] == run("sim", job)[1].splitlines()


def test_check_shows_them(job: str) -> None:
    found = json.loads(run("check", job, "--json")[0])["findings"]
    assert [each["message"] for each in found] == SHOWN
    lines = [line.partition("note: ")[2] for line in run("check", job)[0].splitlines() if "note: " in line]
    assert lines == SHOWN


def test_send_shows_them(job: str, bridge: Bridge, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("WIFICNC_TO", bridge.target)
    stdout, stderr = run("send", job, "--json")
    assert [each for each in json.loads(stdout)["messages"] if each in SHOWN] == SHOWN
    assert all(each in stderr for each in SHOWN)


@pytest.fixture
def loop(tmp_path: Path) -> str:
    """A program whose comments are executed several times."""
    path = tmp_path / "loop.ngc"
    path.write_text(LOOP, encoding="utf-8")
    return str(path)


def test_sim_and_check_show_them_each_time_that_a_loop_runs_them(loop: str) -> None:
    assert json.loads(run("sim", loop, "--json", "-")[0])["warnings"] == [*ROUNDS]
    assert [each["message"] for each in json.loads(run("check", loop, "--json")[0])["findings"]] == [*ROUNDS]


def test_send_shows_them_each_time(loop: str, bridge: Bridge, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("WIFICNC_TO", bridge.target)
    messages = json.loads(run("send", loop, "--json")[0])["messages"]
    assert [each for each in messages if each in ROUNDS] == ROUNDS


def test_expand_keeps_them_with_their_values(loop: str) -> None:
    assert run("expand", loop, "-o", "-")[0].splitlines() == [
        *("(debug, 0.000000 [e])", "(MSG,Groe 6  4)", "G1X0F6000(PRINT,Lange 0.000000 mm, 0.0)", "G0X0"),
        *("(debug, 1.000000 [e])", "(MSG,Groe 6  4)", "G1X2F6000(PRINT,Lange 2.000000 mm, 2.0)", "G0X0"),
        *("M1(nichts)", "(MSG, Ende)", "M2"),
    ]


def test_letters_without_a_likeness_in_ascii(tmp_path: Path) -> None:
    path = tmp_path / "job.nc"
    path.write_text("(MSG,Привет)\n(MSG,尺寸 {{0}})\nG0 X1\n", encoding="utf-8")
    assert json.loads(run("sim", str(path), "--json", "-")[0])["warnings"] == ["Привет", "尺寸 {{0}}"]


def test_an_error_shows_the_line_as_written(tmp_path: Path) -> None:
    path = tmp_path / "job.nc"
    path.write_bytes("G84 (Größe)\nG0 X1\n".encode("cp1252"))
    for arguments in (("sim", str(path)), ("check", str(path)), ("expand", str(path), "-o", "-")):
        done = CliRunner().invoke(root, list(arguments))
        assert "G84 (Größe)" in done.output + str(done.exception)
