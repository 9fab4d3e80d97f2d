"""`wificnc sim` as the user meets it: exit codes, words, files."""

from __future__ import annotations

import json
import math
import os
import sys
from pathlib import Path

import numpy as np
import pytest
from wificnc.app import main

STEPS_PER_MM = 250  # of the simulated machine

KEYS = [
    "file", "lines", "lines_not_run", "blocks", "segments", "steps_per_axis", "final_position_mm",
    "final_position_steps",
    "bounding_box_mm", "job_time_s", "cutting_time_s", "rapid_time_s", "max_speed_mm_s", "max_accel_mm_s2",
    "max_accel_window_s", "max_accel_resolution_mm_s2",
    "max_step_rate_hz", "lookahead_starved", "underruns", "plan_unmet", "tool_changes", "errors", "laser", "warnings",
    "events",
]  # fmt: skip


@pytest.fixture
def cli(capsys):
    """Run the command line as a process would: exit code, stdout, stderr."""

    def run(*args: object) -> tuple[int, str, str]:
        with pytest.raises(SystemExit) as ended:
            main(["sim", *map(str, args)])
        out, err = capsys.readouterr()
        code = ended.value.code
        return int(code or 0), out, err

    return run


def test_json_on_stdout_has_the_agreed_keys(cli, job):
    path = job("G0X1\nG1X2Y3F100\n")
    code, out, err = cli(path, "--json", "-")
    report = json.loads(out)
    assert code == 0 and list(report) == KEYS and err == ""
    assert report["file"] == str(path) and report["lines"] == 2 and report["errors"] == []
    assert list(report["steps_per_axis"]) == list("XYZABC")
    assert set(report["bounding_box_mm"]) == {"min", "max"}
    assert report["final_position_mm"]["X"] == pytest.approx(2.0, abs=0.01)
    numbers = [report[key] for key in KEYS if key.endswith(("_s", "_hz")) and not isinstance(report[key], dict)]
    assert all(math.isfinite(number) for number in numbers)


def test_machine_board_and_set_reach_the_controller(cli, job):
    path = job("G0X10\n")
    _, out, _ = cli(path, "--json", "-", "--machine", "baseline", "--set", "$100=80", "--set", "110=600")
    report = json.loads(out)
    assert report["final_position_steps"]["X"] == 800
    assert report["max_speed_mm_s"]["X"] == pytest.approx(10.0, rel=0.02)
    _, out, _ = cli(path, "--json", "-", "--board", "esp32-wroom32", "--machine", "baseline")
    assert json.loads(out)["final_position_steps"]["X"] == 2500


def test_tool_changes_are_listed_and_passed(cli, job):
    """What nearly every CAM program begins with."""
    path = job("%\nO1000 (BRACKET)\nT1 M6\nS1000 M3\nG1X5F600\nM0\nT12M6\nG1X10\nM30\n%\n")
    code, out, err = cli(path, "--json", "-")
    report = json.loads(out)
    assert code == 0 and report["errors"] == [] and report["final_position_mm"]["X"] == 10.0
    assert [(change["line"], change["tool"]) for change in report["tool_changes"]] == [(3, 1), (7, 12)]
    # $120 = 10 mm/s2: 5 mm are a triangle of speed, and the change itself takes no time.
    times = [change["time_s"] for change in report["tool_changes"]]
    assert times[0] == pytest.approx(0.0, abs=0.1) and times[1] == pytest.approx(2 * math.sqrt(5 / 10), abs=0.1)
    assert "1 program pause (M0) resumed immediately" in err and "Tool change" not in err
    code, out, err = cli(path)
    assert code == 0 and "T1 in line 3, T12 in line 7" in out


def test_a_tool_change_that_needs_homing_is_passed_in_its_place(cli, job):
    """$341=3 of the machine must not make a preflight refuse M6."""
    path = job("T1M6\nG1X5F600\nT2M6 (6 mm)\nG1X10\nM30\n")
    code, out, err = cli(path, "--json", "-", "--set", "$341=3")
    report = json.loads(out)
    assert code == 0 and not report["errors"]
    assert [change["tool"] for change in report["tool_changes"]] == [1, 2]
    assert report["final_position_mm"]["X"] == 10 and "Tool change" not in err


def test_the_table_is_for_people(cli, job):
    code, out, err = cli(job("G0X10\n"), "--set", "$100=100", "--set", "$120=500")
    assert code == 0 and err == ""
    assert "X over 20 ms (±50 mm/s² of single steps)" in " ".join(out.split())  # W = sqrt(20 / (100 * 500))
    assert "job time" in out and "10.000" in out and "1,000" in out


def test_an_error_names_line_text_and_reason(cli, job):
    path = job("G0X1\nG1 X2 (no feed)\nG0X3\n")
    code, _, err = cli(path)
    assert code == 1
    assert f"{path}:2: error:22 the feed rate is missing (F)" in err
    assert "    G1 X2 (no feed)" in err


def test_errors_are_in_the_json_too(cli, job):
    code, out, _ = cli(job("G1X1\nG2X1F1\n"), "--keep-going", "--json", "-")
    errors = json.loads(out)["errors"]
    assert code == 1
    assert [(e["line"], e["code"], e["text"]) for e in errors] == [(1, 22, "G1X1"), (2, 35, "G2X1F1")]
    assert all(set(e) == {"line", "code", "message", "text"} for e in errors)


@pytest.mark.parametrize(
    ("content", "code", "said"),
    [
        (None, 1, "file not found"),
        (b"", 1, "is empty"),
        ("G0X1".encode("utf-16"), 1, "UTF-16"),
        (b"\x7fELF\x00\x01\xff", 1, "is not a text file"),
    ],
)
def test_files_that_are_no_jobs(cli, job, tmp_path, content, code, said):
    path = tmp_path / "missing.nc" if content is None else job(content)
    got, _, err = cli(path)
    assert got == code and said in err


@pytest.mark.skipif(sys.platform == "win32" or os.geteuid() == 0, reason="root reads everything")
def test_a_file_that_may_not_be_read(cli, job):
    path = job("G0X1\n")
    path.chmod(0)
    code, _, err = cli(path)
    assert code == 1 and "cannot read" in err


@pytest.mark.parametrize(
    ("options", "said"),
    [
        (["--set", "110:5"], "a setting looks like"),
        (["--set", "$110=fast"], "a setting looks like"),
        (["--set", "$999=1"], "error:3"),
        (["--set", "$110=-5"], "error:4"),
        (["--trace", "t.bin"], "--trace t.bin: supported formats are .csv, .vcd and .npz"),
        (["--plot", "p.jpg"], "--plot p.jpg: supported formats are .png and .svg"),
        (["--json", "no/such/folder/x.json"], "cannot write"),
        (["--trace", "no/such/folder/x.csv"], "cannot write"),
        (["--machine", "no_such_machine"], "no_such_machine"),
        (["--plot"], "requires an argument"),
    ],
)
def test_bad_options_are_refused_before_the_run(cli, job, monkeypatch, options, said):
    monkeypatch.chdir(job("").parent)
    code, out, err = cli(job("G1X1\n"), *options)
    assert code == 2 and said in err and "error:22" not in err and out == ""


def test_an_unknown_board_has_its_own_code(cli, job):
    code, _, err = cli(job("G0X1"), "--board", "no_such_board")
    assert code == 3 and "no_such_board" in err


def test_all_outputs_at_once_and_nothing_else(cli, job, tmp_path):
    path = job("G0X10\nG1Y5F600\n")
    for trace in ("t.csv", "t.vcd", "t.npz"):
        options = ["--json", tmp_path / "r.json", "--plot", tmp_path / "p.svg", "--trace", tmp_path / trace]
        code, _, err = cli(path, *options)
        assert code == 0 and f"wrote {tmp_path / trace}" in err.replace("\n", "")
    assert sorted(p.name for p in tmp_path.iterdir()) == ["job.nc", "p.svg", "r.json", "t.csv", "t.npz", "t.vcd"]
    report = json.loads((tmp_path / "r.json").read_text())
    with np.load(tmp_path / "t.npz") as arrays:
        assert len(arrays["t_ns"]) == len((tmp_path / "t.csv").read_text().splitlines()) - 1
        assert int((arrays["step_mask"] & 1).sum()) == report["steps_per_axis"]["X"]


def test_a_refused_run_leaves_old_outputs_alone(cli, job, tmp_path):
    old = tmp_path / "r.json"
    old.write_text("old")
    code, _, _ = cli(job("G0X1"), "--json", old, "--trace", tmp_path / "t.csv", "--set", "$999=1")
    assert code == 2 and old.read_text() == "old"
    assert sorted(p.name for p in tmp_path.iterdir()) == ["job.nc", "r.json"]


@pytest.mark.skipif(not Path("/dev/full").exists(), reason="no /dev/full")
@pytest.mark.parametrize("name", ["f.csv", "f.vcd"])
def test_a_full_disk_is_told(cli, job, tmp_path, name):
    (tmp_path / name).symlink_to("/dev/full")
    code, _, err = cli(job("G0X100\n"), "--trace", tmp_path / name)
    assert code == 1 and "No space left" in err


def test_picture_without_matplotlib_says_how_to_get_it(cli, job, monkeypatch):
    monkeypatch.setattr("importlib.util.find_spec", lambda name: None)
    code, _, err = cli(job("G0X1"), "--plot", "p.png")
    assert code == 2 and "pip install matplotlib" in err


def test_help_needs_neither_numpy_nor_matplotlib(tmp_path):
    import subprocess

    program = (
        "import sys; sys.modules['numpy'] = sys.modules['matplotlib'] = None\n"
        "from wificnc.app import main; main(['sim', 'j.nc', '--json', 'r.json', '--trace', 't.npz'])"
    )
    (tmp_path / "j.nc").write_text("G0X1\n")
    done = subprocess.run([sys.executable, "-c", program], capture_output=True, text=True, cwd=tmp_path)
    assert done.returncode == 0, done.stderr
    assert (tmp_path / "t.npz").stat().st_size > 0


def test_both_ways_along_a_row_the_power_changes_at_the_same_step(cli, job, tmp_path):
    """Pixels of 8 steps, of random power: each edge is half a step below its place."""
    power = np.random.default_rng(1).integers(1, 1000, 200)
    there = "".join(f"X{5 + 0.1 * (n + 1):.1f}S{s}\n" for n, s in enumerate(power))
    back = "".join(f"X{5 + 0.1 * n:.1f}S{s}\n" for n, s in reversed(list(enumerate(power))))
    path = job(f"G21 G90\nM4 S0 F6000\nG1 X5\n{there}X30S0\nX25S0\n{back}X0S0\n")
    settings = [f"${number}={value}" for number, value in ((32, 1), (100, 80), (110, 20_000), (120, 3000))]
    code, _, err = cli(path, *(each for one in settings for each in ("--set", one)), "--trace", tmp_path / "t.npz")
    assert code == 0, err
    with np.load(tmp_path / "t.npz") as rows:
        falls, duty = (rows["dir_mask"] & 1) != 0, rows["duty"]
    after = np.cumsum(np.where(falls, -1, 1))
    switched = np.flatnonzero(np.diff(duty)) + 1
    place = after[switched] - np.where(falls[switched], -0.5, 0.5)
    edges = np.flatnonzero(np.diff(np.concatenate(([0], power, [0])))) * 8 + 5 * 80 - 0.5
    assert np.array_equal(place, np.concatenate((edges, edges[::-1])))


@pytest.mark.parametrize("mode", ["M3", "M4"])
def test_a_trace_has_the_lasers_duty(cli, job, tmp_path, mode):
    """The edges of 5 to 10 mm burn with half power, all others are dark; and so it is in each format."""
    path = job(f"G21 G90\n{mode} S0 F3000\nG1 X5 S0\nG1 X10 S500\nG1 X15 S0\n")
    for suffix in ("csv", "vcd", "npz"):
        trace = tmp_path / f"t.{suffix}"
        code, _, err = cli(
            path, "--set", "$32=1", "--set", "$30=1000", "--set", "$110=5000", "--set", "$120=5000", "--trace", trace
        )
        assert code == 0, err
    rows = np.genfromtxt(tmp_path / "t.csv", delimiter=",", names=True)
    steps = len(rows)
    lit = np.flatnonzero(rows["duty"] == 32768)
    assert set(rows["duty"]) == {0, 32768} and abs(len(lit) - steps / 3) <= 1
    assert lit[0] == pytest.approx(steps / 3, abs=1) and np.all(np.diff(lit) == 1)
    with np.load(tmp_path / "t.npz") as arrays:
        assert np.array_equal(arrays["duty"], rows["duty"])
    # each row has the power from its edge on: half a step below 5 mm, to half a step below 10 mm
    assert (lit[0], len(lit)) == (5 * STEPS_PER_MM - 1, 5 * STEPS_PER_MM)
    vcd = (tmp_path / "t.vcd").read_text()
    changes = [int(line.split()[0][1:], 2) for line in vcd.splitlines() if line.startswith("b")]
    assert changes == [0, 32768, 0]
