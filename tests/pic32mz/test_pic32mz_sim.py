"""`wificnc sim --on-chip`: a job in the real image, compared with the host's."""

from __future__ import annotations

from pathlib import Path

import pytest
from wificnc.app import main
from wificnc.build.pic32mz import Pic32Build
from wificnc.errors import Exit

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
    assert "the same steps" in said and "stands at   0, 0, 0, 0 steps" in said and "0 refused" in said


def test_a_refused_line_is_named(build: Pic32Build, job: Path, capsys: pytest.CaptureFixture[str]) -> None:
    job.write_text("G21\nG1X1\n")
    assert sim(job, "--on-chip") == Exit.JOB
    assert "line 2: error:22" in capsys.readouterr().err


def test_a_refused_setting(build: Pic32Build, job: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert sim(job, "--on-chip", "--set", "$0=2000") == Exit.USAGE
    assert "the controller refuses $0=2000" in capsys.readouterr().err


def test_what_does_not_go_together(job: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert sim(job, "--on-chip", "--json", "-") == Exit.USAGE
    assert "--on-chip goes with --machine and --set alone" in capsys.readouterr().err


def test_a_board_without_an_image(job: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert sim(job, "--on-chip", "--board", "host") == Exit.BUILD
    assert "board host has no image" in capsys.readouterr().err
