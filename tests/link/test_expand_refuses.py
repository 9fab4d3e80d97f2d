"""`wificnc expand` refuses the lines that `check` refuses: no other controller gets what ours does not understand."""

from __future__ import annotations

import json
from pathlib import Path

import pytest
from click.testing import CliRunner, Result
from wificnc.app import root
from wificnc.errors import Exit, JobError

REFUSED = [
    "G84 X1 Z-1 R1 F100", "M99", "M98 P1000", "G41 D1", "G0 G1 X1", "G1 X2", "X1 X2", "G0 X", "G2 X1", "G2 X9 I1 F9",
    "G33 Z-1 K1", "$FOO", "$130=-1", "$J=X1", "G4", "G59.9", "M72", "(c) G999", "N5 G84", "#1=2 G999", "M62 P99",
]  # fmt: skip
TAKEN = [
    "G0 X1", "G81 X1 Z-1 R1 F100", "G80", "M6 T1", "G43 H0", "G38.2 Z-5 F10", "$H", "$130=200", "M0",
    "G2 X2 I1 F100", "M70", "G10 L1 P1 Z2", "G28", "(only a comment) G0", "M66 P0 L0", "$341=1",
]  # fmt: skip


def run(*arguments: str) -> Result:
    return CliRunner().invoke(root, list(arguments))


def job(tmp_path: Path, line: str) -> str:
    path = tmp_path / "job.nc"
    path.write_text(f"G21 G90 G0 X0 Y0\n\n{line}\nG0 X0\n")
    return str(path)


@pytest.mark.parametrize("line", [*REFUSED, *TAKEN])
def test_expand_refuses_what_check_refuses(line: str, tmp_path: Path) -> None:
    file = job(tmp_path, line)
    found = json.loads(run("check", file, "--json").stdout)["findings"]
    checked = [f"job.nc:{each['first_line']}: {each['message']}" for each in found if each["kind"] == "refused"]
    checked = [each for each in checked if "ALARM" not in each]  # nothing to probe in the simulation
    assert bool(checked) is (line in REFUSED)
    done = run("expand", file, "-o", str(tmp_path / "out.nc"))
    if not checked:
        assert done.exit_code == Exit.OK
        return
    assert isinstance(done.exception, JobError) and done.exception.exit_code == Exit.JOB
    assert done.exception.message.split("\n") == checked
    assert done.exception.hint and not (tmp_path / "out.nc").exists()


def test_a_line_that_runs_often_is_refused_once(tmp_path: Path) -> None:
    path = tmp_path / "job.nc"
    path.write_text("o1 repeat [9]\nG84 X[1+1]\no1 endrepeat\n" + "M99\n" * 9)
    error = run("expand", str(path), "-o", "-").exception
    assert isinstance(error, JobError)
    assert error.message.split("\n") == [
        "job.nc:2: error:20 unsupported code or word: G84 X[1+1]",
        *(f"job.nc:{number}: error:20 unsupported code or word: M99" for number in range(4, 8)),
        "and 5 more lines like these",
    ]


def test_an_arc_after_a_move_that_is_not_made_is_left_to_the_controller(tmp_path: Path) -> None:
    """Where the machine is after a probe or homing, only the machine knows."""
    for line in ("G38.2 X-20 F10", "$H"):
        file = job(tmp_path, f"{line}\nG2 X30 I3 F100")
        assert run("expand", file, "-o", "-").exit_code == Exit.OK


def test_a_line_that_is_too_long_is_cut_in_messages(tmp_path: Path) -> None:
    file = job(tmp_path, f"G0 X{'9' * 5000}")
    error = run("expand", file, "-o", "-").exception
    assert isinstance(error, JobError) and "error:11" in error.message and error.hint
    found = json.loads(run("check", file, "--json").stdout)["findings"]
    assert found[0]["message"].endswith("9…") and len(found[0]["message"]) < 320
