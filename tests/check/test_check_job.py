"""What `wificnc check` finds, against what geometry and the machine's figures say it must find."""

from __future__ import annotations

import re
from math import hypot, sqrt

import pytest
from wificnc.app import main
from wificnc.errors import JobError
from wificnc.job.program import read_program

NO_FLOOD = "esp32s3-devkitc-quad"


def test_a_good_job_has_nothing_to_say(check):
    code, report = check("G21 G90\nG0 X10 Y20\nG1 Z-1 F300\nX100 F3000\nM2\n")
    assert code == 0 and report["ok"] and report["findings"] == []
    assert report["extent"]["X"] == {"min_mm": 10, "max_mm": 100, "travel_mm": 200, "work_zero_mm": [-210, -100]}


def test_tool_changes_are_notes_and_nothing_is_refused(check, kinds):
    code, report = check("%\nO1000\nT3 M6\nG0X10\nT4M6\nG0X30\nM2\n%\n")
    assert code == 0 and report["ok"] and report["extent"]["X"]["max_mm"] == 30
    assert [(change["line"], change["tool"]) for change in report["tool_changes"]] == [(3, 3), (5, 4)]
    assert [kind for kind in kinds(report) if kind[0] == "tool-change"] == [
        ("tool-change", 3, 3),
        ("tool-change", 5, 5),
    ]


def test_the_time_is_that_of_a_trapezoid(check):
    """100 mm at 50 mm/s with 500 mm/s2: s/v + v/a; and the wait for more look-ahead before it starts."""
    _, report = check("G1 X100 F3000\n")
    assert report["job_time_s"] == pytest.approx(100 / 50 + 50 / 500, abs=0.02)


@pytest.mark.parametrize(
    ("zero", "line", "moves"),
    [
        ("X-300 Y-50 Z-20", 1, r"\+100\.000 mm in X"),  # -300 .. -100 of -200 .. 0
        ("X10, Y-50, Z-20", 1, r"-210\.000 mm in X"),
        ("X-200Y-50Z-20", 0, ""),
    ],
)
def test_lines_beyond_the_travel_are_named_with_the_way_back(check, kinds, zero, line, moves):
    code, report = check("G0 X0\nG0 X200\n", "--work-zero", zero)
    assert code == (1 if line else 0)
    assert [kind for kind, _, _ in kinds(report)] == (["travel"] if line else [])
    if line:
        assert re.search(moves, report["findings"][0]["hint"])


def test_the_same_lines_are_refused_by_the_machine_itself(check, tmp_path, capsys):
    """The soft limits of the controller and the check agree about the last line that is still inside."""
    job = "G0 X-20 Y-20 Z-5\nG2 X-20 Y-20 I9.99 F600\nG2 X-20 Y-20 I10.01\n"
    _, report = check(job, "--work-zero", "X0Y0Z0")
    assert [(f["kind"], f["first_line"]) for f in report["findings"]] == [("travel", 3)]
    bench = tmp_path / "bench.toml"
    bench.write_text(bench.read_text() + "[homing]\nenabled = true\n[limits]\nsoft = true\n")
    with pytest.raises(SystemExit):
        main(["sim", str(tmp_path / "job.nc"), "--machine", str(bench)])
    assert re.search(r"job\.nc:3: ALARM:2", capsys.readouterr().err)


def test_a_job_that_fits_nowhere(check, kinds):
    code, report = check("G0 X0\nG0 X200.1\n")
    assert code == 1 and kinds(report) == [("travel", 0, 0)]
    assert report["extent"]["X"]["work_zero_mm"] is None
    assert check("G0 X0\nG0 X200\n")[0] == 0


def test_all_refused_lines_are_found_not_only_the_first(check, kinds):
    code, report = check("G1 X1\nG0 X2\nG99.5\nG0 X3\n")
    assert code == 1
    assert kinds(report) == [("refused", 1, 1), ("refused", 3, 3)]


def words(hint: str) -> dict[str, float]:
    return {letter: float(number) for letter, number in re.findall(r"\b([IJKR])(-?\d+\.\d+)", hint)}


@pytest.mark.parametrize(("code", "kind"), [("M7", "mist"), ("M8", "flood"), ("G1X5F600M08", "flood")])
def test_coolant_that_the_board_lacks_is_a_warning_at_its_first_line(check, code, kind):
    """The controller takes the line, and nothing flows: the job ends without an error."""
    job = f"G0 X1 (M7 M8)\nM9\n{code}\nG1 X2 F600\n{code}\nM2\n"
    exit_code, report = check(job, "--board", "esp32s3-zero" if kind == "mist" else NO_FLOOD)
    found = [finding for finding in report["findings"] if finding["kind"] == "coolant"]
    assert exit_code == 0 and [(f["severity"], f["first_line"]) for f in found] == [("warning", 3)]
    assert found[0]["message"] == f"This board has no {kind} output"
    assert check(job, "--board", NO_FLOOD if kind == "flood" else "esp32s3-zero", "--strict")[0] == 1
    assert not [f for f in check(job)[1]["findings"] if f["kind"] == "coolant"], "the simulator's board has both"


@pytest.mark.parametrize(("plane", "axes"), [("G17", "XYIJ"), ("G18", "ZXKI"), ("G19", "YZJK")])
def test_the_fix_of_an_arc_is_an_arc(check, plane, axes):
    """A centre that is not equally far from both ends: the hint's centre is, to the decimals it is written with."""
    a, b, i, j = axes
    start = f"{plane} G90 G0 {a}-5 {b}-4\n"
    code, report = check(start + f"G2 {a}5 {b}6 {i}9 {j}2 F600\n")
    hint = report["findings"][0]["hint"]
    center = words(hint)
    assert code == 1 and report["findings"][0]["first_line"] == 2
    assert hypot(center[i], center[j]) == pytest.approx(hypot(10 - center[i], 10 - center[j]), abs=1e-3)
    assert check(start + f"G2 {a}5 {b}6 {i}{center[i]} {j}{center[j]} F600\n")[0] == 0


def test_the_fix_of_an_absolute_arc_in_inches_is_in_its_own_words(check):
    head = "G20 G90.1 G92 X1 Y1\nG0 X1 Y1\n"
    _, report = check(head + "G3 X2 Y1 I1.6 J1 F20\n")
    center = words(report["findings"][0]["hint"])
    assert center == {"I": pytest.approx(1.5, abs=1e-4), "J": pytest.approx(1, abs=1e-4)}
    assert check(head + f"G3 X2 Y1 I{center['I']} J{center['J']} F20\n")[0] == 0


def test_the_fix_of_a_radius_is_half_the_chord(check):
    _, report = check("G0 X0 Y0\nG2 X10 Y10 R3 F600\n")
    radius = words(report["findings"][0]["hint"])["R"]
    assert sqrt(200) / 2 <= radius <= sqrt(200) / 2 + 2e-4
    assert check(f"G0 X0 Y0\nG2 X10 Y10 R{radius} F600\n")[0] == 0


def test_an_arc_behind_a_missing_move_says_so(check):
    _, report = check("G0 X0 Y0 F600\nG2 X10 Y0 R1\nG2 X20 Y0 R5\n")
    assert "may follow from line 2" in report["findings"][1]["hint"]


def test_a_feed_that_an_axis_cannot_keep_names_lines_and_axis(check, kinds):
    code, report = check("G1 X50 F3000\nG1 Z-20 F3000\nG1 Z-40\nG1 X100\n")
    assert kinds(report) == [("feed-rate", 2, 3)]
    found = report["findings"][0]
    assert "Z runs at its maximum rate" in found["message"] and "$112" in found["hint"]
    assert re.search(r"at most 600\b", found["message"])  # not 601 by the grain of the measurement
    assert code == 0 and check("G1 Z-20 F3000\n", "--strict")[0] == 1


def test_a_slope_is_limited_by_its_slow_axis(check):
    """X and Z 1:1 with Z at 600 mm/min: 600 sqrt(2) along the way."""
    _, report = check("G1 X40 Z-40 F3000\n")
    reached = int(re.search(r"at most (\d+)", report["findings"][0]["message"])[1])
    assert reached == pytest.approx(600 * sqrt(2), rel=0.005)


def test_short_lines_are_short_of_acceleration(check, kinds):
    """2 mm with stops: the peak is sqrt(a s) = 31.6 mm/s."""
    _, report = check("G61.1\nG1 X2 F6000\nX0\nX2\nX100\n")
    assert kinds(report) == [("feed-acceleration", 2, 4)]
    reached = int(re.search(r"at most (\d+)", report["findings"][0]["message"])[1])
    assert reached == pytest.approx(60 * sqrt(500 * 2), rel=0.1)


def test_a_rate_beyond_the_board_is_told(check, kinds):
    fast = "max_rate_mm_min = 6000\n"
    _, report = check("G0 X100\n", "--board", "esp32-wroom32", "--set", "$100=5000")
    assert kinds(report) == [("step-rate", 0, 0)] and fast not in report["findings"][0]["message"]
    limit_hz, timer_hz = report["step_rate_limit_hz"], 20e6  # a single interval may be a tick of the timer shorter
    assert report["max_step_rate_hz"] <= 1.001 / (1 / limit_hz - 1 / timer_hz)


def test_moves_in_machine_coordinates_ask_for_the_work_zero(check, kinds):
    _, report = check("G0 X1\nG53 G0 Z0\n")
    assert kinds(report) == [("work-zero", 2, 2)]
    assert kinds(check("G0 X1\nG53 G0 Z0\n", "--work-zero", "X-50Y-50Z-10")[1]) == []


def test_a_loop_counts_for_its_lines(check, kinds):
    _, report = check("o1 repeat [3]\nG91 G1 Z-5 F3000\no1 endrepeat\nM2\n")
    assert kinds(report) == [("feed-rate", 2, 2)]
    assert report["extent"]["Z"]["min_mm"] == pytest.approx(-15)


def test_people_get_lines_and_hints(check, tmp_path, capsys):
    check("G1 Z-20 F3000\n")
    with pytest.raises(SystemExit):
        main(["check", str(tmp_path / "job.nc"), "--machine", str(tmp_path / "bench.toml")])
    out = capsys.readouterr().out
    assert "job.nc:1: warning: F3000 is never reached" in out and "hint: " in out and "1 warning" in out


@pytest.mark.parametrize("zero", ["here", "X1Q2", "100", ""])
def test_a_work_zero_that_is_none(tmp_path, capsys, zero):
    (tmp_path / "job.nc").write_text("G0X1\n")
    with pytest.raises(SystemExit) as ended:
        main(["check", str(tmp_path / "job.nc"), "--machine", "mpcnc", f"--work-zero={zero}"])
    assert ended.value.code == (2 if zero else 0)


def test_lines_after_the_end_of_the_program_are_a_finding(check, kinds):
    code, report = check("%\nG21G90\nG1X10F100\nM30\n%\n%\nO2\nG0X500\nM30\n%\n")
    assert code == 0 and report["extent"]["X"]["max_mm"] == 10
    (found,) = [finding for finding in report["findings"] if finding["kind"] == "not-run"]
    assert (found["severity"], found["first_line"], found["last_line"]) == ("warning", 8, 10)
    assert "another program begins in line 6" in found["message"] and "line 6" in found["hint"]


@pytest.mark.parametrize(
    ("text", "kind", "line", "words"),
    [
        ("G21\nG4 P4000\nG0X1\n", "dwell", 2, "P4"),
        ("F100\nG0Z5\nG82X1Y1Z-1R1P500\nX2\nG80\n", "dwell", 3, "P0.5"),
        ("F100\nG0Z5\nG89X1Z-1R1P.2\nX2P1000\nG80\n", "dwell", 4, "P1"),
        ("M3 S90000\nG0X1\nM5\n", "spindle-speed", 1, r"\$30"),
        ("G1X10F99999\n", "feed-limit", 1, r"\$110"),
        ("G20\nG1X.1F5000\n", "feed-limit", 2, r"\$110"),
        ("M104 S200\nG1 X1 E0.5 F600\n", "printer", 1, "post-processor"),
        ("G1 X1 F600 E0.5\n", "printer", 1, "post-processor"),
        ("G1 X1 F600 E0.5 (1e3)\n", "printer", 1, "post-processor"),
    ],
)
def test_what_is_surely_wrong_is_a_warning(check, text, kind, line, words):
    _, report = check(text)
    (found,) = [finding for finding in report["findings"] if finding["kind"] == kind]
    assert (found["severity"], found["first_line"]) == ("warning", line)
    assert re.search(words, found["hint"])


@pytest.mark.parametrize(
    "text",
    [
        "G4 P5\nG0X1\n",
        "G10 L20 P1 X0\nG0X1\n",
        "F6000\nG0X1\nG3X1I-1P200\nG80\n",
        "G93\nG1X1F90000\nG94\n",
        "M3S1000\nG0X1\n",
        "(M104 E1)G0X1\n",
        "G1 X1e3 F100\n",
        "G1 X.5E-1 F1.e+2 ; E5\n",
    ],
)
def test_what_may_be_right_is_not(check, kinds, text):
    _, report = check(text)
    assert not {kind for kind, _, _ in kinds(report)} & {"dwell", "spindle-speed", "feed-limit", "printer"}


def test_a_bracket_within_a_comment_is_named():
    with pytest.raises(JobError, match=r"job.nc:2: a comment ends at its first \)"):
        read_program("job.nc", b"G21 G90\n(2D Contour1 (2))\nT1 M6 (6MM (1/4) END MILL)\nG0 X10\n")


def test_without_a_machine_only_what_no_machine_can_do_is_found(check, kinds):
    """Travel and rates of a machine that is not named are not judged, even those of Grbl's defaults."""
    job = "G21G90\nG1X5000F9000\nG4P400\nS99999M3\nG1X\nG0X0\n"
    code, report = check(job, machine=None)
    assert (code, report["machine"]) == (1, None)
    assert kinds(report) == [("refused", 5, 5), ("dwell", 3, 3)]
    assert report["extent"]["X"]["travel_mm"] is None
    code, report = check(job, "--set", "spindle_max_rpm=10000", machine=None)
    assert ("spindle-speed", 4, 4) in kinds(report)
