"""`$` lines in a job: `wificnc sim` and `check` run what `send` runs, and refuse what it refuses, in its words."""

from __future__ import annotations

from pathlib import Path

import pytest
from test_sim_job import run
from wificnc.app import main
from wificnc.errors import JobError
from wificnc.job.program import read_program


def test_a_setting_applies_when_the_axes_stand(library):
    """Rates before and after: 100 mm at 50 mm/s, then 100 mm at 10 mm/s; s/v + v/a each."""
    result = run(library, "G1X100F3000\n$110=600\nG1X0F3000\n")
    assert result.errors == ()
    assert result.job_time_s == pytest.approx(100 / 50 + 50 / 500 + 100 / 10 + 10 / 500, abs=0.05)
    assert result.max_speed_mm_s[0] == pytest.approx(50, rel=0.01)


def test_questions_and_settings_anywhere(library):
    result = run(library, "$110=3000\nG0X5\n$$\n$I\n$#\n$G\nG1X9F900\n $111 = 700 (slow)\nG0Y3\n$X\n")
    assert result.errors == ()
    assert result.final_position_mm == (9.0, 3.0, 0.0)


def test_a_wrong_setting_is_an_error_of_its_line(library):
    result = run(library, "G0X5\n$110=-1\nG0X9\n", keep_going=True)
    assert [(error.line, error.code) for error in result.errors] == [(2, 4)]


def test_steps_per_mm_at_the_begin_are_those_of_the_figures(library):
    result = run(library, "$100=80\nG0X10\n")
    assert result.errors == () and result.final_position_steps[0] == 800
    assert result.final_position_mm[0] == 10.0 and result.box_max_mm[0] == 10.0


def test_steps_per_mm_after_motion_are_named(library):
    result = run(library, "G0X10\n$100=80\nG0X20\n")
    assert any("line 2 changes" in warning for warning in result.warnings)


@pytest.mark.parametrize("line", ["$H", "$HZ", "$h (home)"])
def test_homing_without_switches_is_named_and_left_out(library, line):
    result = run(library, f"G21\n{line}\nG0X5\n")
    assert result.errors == () and result.final_position_mm[0] == 5.0
    assert any("line 2" in warning and "no home switches" in warning for warning in result.warnings)


JOBS = {"$C": "check mode", "$SLP": "sleep", "$RST=$": "default", "$rst=*": "default"}


@pytest.mark.parametrize("line", JOBS)
def test_lines_that_end_a_job_are_refused_by_all_in_the_same_words(line: str, tmp_path: Path, capsys) -> None:
    job = tmp_path / "job.nc"
    job.write_text(f"G21\nG0X5\n{line}\nG0X9\n")
    with pytest.raises(JobError) as refused:
        read_program("job.nc", job.read_bytes())
    assert "job.nc:3: " in refused.value.message and JOBS[line] in refused.value.message
    check_same_words(job, refused.value.message, capsys)


@pytest.mark.parametrize("line", ["G0X1!", "G0X1?", "G0~X1"])
def test_bytes_that_act_are_refused_by_all_in_the_same_words(line: str, tmp_path: Path, capsys) -> None:
    job = tmp_path / "job.nc"
    job.write_text(f"G21\n{line}\n")
    with pytest.raises(JobError) as refused:
        read_program("job.nc", job.read_bytes())
    check_same_words(job, refused.value.message, capsys)


def check_same_words(job: Path, message: str, capsys) -> None:
    for command in (["sim", str(job)], ["check", str(job), "--machine", "baseline"]):
        with pytest.raises(SystemExit) as ended:
            main(command)
        assert ended.value.code == 1
        assert f"error: {message}" in capsys.readouterr().err
