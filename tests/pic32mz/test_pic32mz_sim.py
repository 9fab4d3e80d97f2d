"""`wificnc sim --on-chip`: a job in the real image, compared with the host's."""

from __future__ import annotations

from pathlib import Path

import pytest
from wificnc.app import main
from wificnc.board.model import Board
from wificnc.build.pic32mz import Pic32Build
from wificnc.errors import Exit
from wificnc.simulator.run import SimOptions
from wificnc_chips import Pace, difference, paths, run_on_chip

JOB = "G21G90\nG1X5F1500\nM0\nG2X8Y3I0J3\nG1X0Y0\n"


def sim(file: Path, *options: str) -> int:
    with pytest.raises(SystemExit) as caught:
        main(["sim", str(file), "--board", "pic32mz2048efh100", *options])
    return int(caught.value.code or 0)


@pytest.fixture
def job(tmp_path: Path) -> Path:
    path = tmp_path / "job.nc"
    path.write_text(JOB)
    return path


def test_a_job_makes_the_hosts_steps(build: Pic32Build, job: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert sim(job, "--on-chip", "--set", "$110=3000", "--set", "$111=3000") == Exit.OK
    said = capsys.readouterr().out
    assert "the same steps" in said and "position    0, 0, 0, 0 steps" in said and "0 refused" in said


def test_what_cam_programs_write_around_a_job(build: Pic32Build, job: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """Marks, the program's number, a tool change, and a comment whose bytes would open the safety door."""
    job.write_text("%\nO1000 (STRA\u00c4E! ~)\nT1 M6\nG21G90\nG1X2F1500 ; wow!\nM30\n%\n", encoding="utf-8")
    assert sim(job, "--on-chip") == Exit.OK
    said = capsys.readouterr().out
    assert "the same steps" in said and "0 refused" in said


@pytest.mark.alike(1)
@pytest.mark.slow
@pytest.mark.parametrize("options", [("$3=3",), ("$2=3",), ("$2=1", "$3=5")])
def test_inverted_wires_are_no_difference(
    build: Pic32Build, job: Path, capsys: pytest.CaptureFixture[str], options: tuple[str, ...]
) -> None:
    """`$2` and `$3` turn levels at pins; the axes go the same way."""
    job.write_text("G21G90\nG1X5Y-2F1500\nG1X1Y1\n")
    assert sim(job, "--on-chip", *(word for option in options for word in ("--set", option))) == Exit.OK
    said = capsys.readouterr().out
    assert "the same steps" in said and "position    250, 250, 0, 0 steps" in said


def test_dollar_lines_of_a_file_wait_until_the_axes_stand(
    build: Pic32Build, job: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    job.write_text("G21G90\nG1X5F1500\n$3=1\n$110=900\nG1X1\n$I\n$3=0\nG1Y1F600\n")
    assert sim(job, "--on-chip") == Exit.OK
    said = capsys.readouterr().out
    assert "the same steps" in said and "0 refused" in said and "position    250, 250, 0, 0 steps" in said


@pytest.mark.deep
def test_a_faster_wire_and_a_faster_cpu_make_the_same_steps(board: Board, job: Path) -> None:
    """Nothing in this job waits for either: the same steps, in the same time."""
    job.write_text("G21G90\nG1X2F1500\nG2X4Y2I0J2\nG1X0Y0\n")
    usual, faster = (run_on_chip(board, SimOptions(job, board.id), [], pace=pace) for pace in (None, Pace(16, 4)))
    assert usual.first_difference is faster.first_difference is None and usual.same_path and faster.same_path
    assert faster.events == usual.events > 1000 and faster.seconds == pytest.approx(usual.seconds, abs=1e-6)


def test_the_same_path_at_other_moments() -> None:
    """An axis that steps an event later changes the trace and not the path; a step more changes both."""
    trace = [(1, 0), (3, 2), (1, 0), (2, 2)]
    for other, event, same_path in (
        (trace, None, True),
        ([(3, 2), (1, 0), (1, 0), (2, 2)], 0, True),
        ([*trace, (1, 0)], 4, False),
        ([(1, 1), *trace[1:]], 0, False),
    ):
        assert difference(trace, other) == event and (paths(trace, 2) == paths(other, 2)) is same_path


def test_a_refused_line_is_named(build: Pic32Build, job: Path, capsys: pytest.CaptureFixture[str]) -> None:
    job.write_text("G21\nG1X1\n")
    assert sim(job, "--on-chip") == Exit.JOB
    assert "line 2: error:22" in capsys.readouterr().err


def test_a_refused_setting(build: Pic32Build, job: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert sim(job, "--on-chip", "--set", "$0=2000") == Exit.USAGE
    assert "the controller refuses $0=2000" in capsys.readouterr().err


def test_what_does_not_go_together(job: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert sim(job, "--on-chip", "--json", "-") == Exit.USAGE
    assert "--on-chip can be combined with --machine, --set, --at and --trace only" in capsys.readouterr().err


def test_a_board_without_an_image(job: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert sim(job, "--on-chip", "--board", "host") == Exit.BUILD
    assert "board host has no image" in capsys.readouterr().err


@pytest.mark.slow
def test_the_pins_as_csv_are_the_steps(build: Pic32Build, job: Path, tmp_path: Path) -> None:
    """Every pulse has its two edges, never nearer than the pulse, and X and Y come back to where they began."""
    trace = tmp_path / "pins.csv"
    assert sim(job, "--on-chip", "--trace", str(trace)) == Exit.OK
    rows = [line.split(",") for line in trace.read_text().splitlines()[1:]]
    edges = [(int(t), label, int(level)) for t, label, level in rows]
    assert edges == sorted(edges, key=lambda edge: edge[0])
    position = {"x": 0, "y": 0}
    levels: dict[str, int] = {}
    rose: dict[str, int] = {}
    for t, label, level in edges:
        assert levels.get(label) != level
        levels[label] = level
        kind, _, rest = label.partition("_")
        axis = rest[:1]
        if kind == "step" and level:
            rose[axis] = t
            direction = next((value for name, value in levels.items() if name.startswith(f"dir_{axis}")), 0)
            position[axis] += -1 if direction else 1
        elif kind == "step":
            assert t - rose[axis] >= 1000
    assert position == {"x": 0, "y": 0} and set(rose) == {"x", "y"}


@pytest.mark.deep
def test_the_pins_as_vcd_are_those_of_csv(build: Pic32Build, job: Path, tmp_path: Path) -> None:
    assert sim(job, "--on-chip", "--trace", str(tmp_path / "a.csv")) == Exit.OK
    assert sim(job, "--on-chip", "--trace", str(tmp_path / "a.vcd")) == Exit.OK
    names, now, seen, begun = {}, 0, [], False
    for line in (tmp_path / "a.vcd").read_text().splitlines():
        words = line.split()
        if words[0] == "$var":
            names[words[3]] = words[4]
        elif words[0].startswith("#"):
            now = int(words[0][1:])
        elif words[0] == "$end":
            begun = True
        elif begun and words[0][0] in "01":
            seen.append(f"{now * 5},{names[words[0][1:]]},{words[0][0]}")
    assert seen == (tmp_path / "a.csv").read_text().splitlines()[1:]


def test_a_pin_is_driven_at_its_time(build: Pic32Build, job: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """The e-stop's contact opens in the middle of the job, which ends there."""
    job.write_text("G21G91\nG1X50F600\n")
    assert sim(job, "--on-chip", "--at", "1s estop high") == Exit.JOB
    assert "stopped the job" in capsys.readouterr().err


@pytest.mark.parametrize("event", ["1s RX3 high", "1s RD3 up", "1s limit x", "RD3 high"])
def test_an_event_that_is_none_is_explained(
    build: Pic32Build, job: Path, capsys: pytest.CaptureFixture[str], event: str
) -> None:
    assert sim(job, "--on-chip", "--at", event) == Exit.USAGE
    assert "--at" in capsys.readouterr().err
