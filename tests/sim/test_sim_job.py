"""Jobs through the real core: answers, positions, times, stops."""

from __future__ import annotations

import csv
from decimal import Decimal
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from wificnc.errors import JobError, UserError
from wificnc.simulator.job import At, JobRequest, SimResult, Timing, printable, read_job, run_job
from wificnc.simulator.trace import TraceFile, signal_names

START_S = 0.015  # a controller waits a moment for more moves before it starts, and its first step takes its time
TIMING = Timing(20_000_000, 2500, 1000, 500_000, 3)
SETTINGS = tuple(
    f"${first + axis}={value}" for first, value in ((100, 250), (110, 5000), (120, 500)) for axis in range(3)
)


def run(library, text: str | bytes, **options) -> SimResult:
    data = text if isinstance(text, bytes) else text.encode()
    return run_job(
        library, JobRequest(**{"file": "job.nc", "text": data, "timing": TIMING, "settings": SETTINGS, **options})
    )


def test_a_move_takes_its_time(library):
    result = run(library, "G1X100F3000\n")
    assert result.final_position_steps == (25_000, 0, 0) and result.final_position_mm == (100.0, 0.0, 0.0)
    assert result.steps_per_axis == (25_000, 0, 0)
    assert result.job_time_s == pytest.approx(100 / 50 + 50 / 500, abs=START_S)  # s/v + v/a
    assert result.cutting_time_s == pytest.approx(result.job_time_s, abs=1e-4)
    assert result.rapid_time_s == 0.0
    assert result.max_speed_mm_s[0] == pytest.approx(50, rel=2e-3)
    assert 490 <= result.max_accel_mm_s2[0] <= 500 + result.accel_resolution_mm_s2[0]
    assert result.max_step_rate_hz == pytest.approx(12_500, rel=0.01)
    assert (result.box_min_mm[0], result.box_max_mm[0]) == (0.0, 100.0)


@pytest.mark.parametrize(("pulse_us", "x_mm", "z_mm"), [(30, 60, 60), (75, 161.422, 161.26), (150, 60, 60)])
def test_a_diagonal_as_fast_as_the_pulse_allows_stops_in_time(library, pulse_us, x_mm, z_mm):
    """Where X and Z take turns in having one step more than the other, there are more events than steps of either."""
    rates = tuple(f"${110 + axis}=1000000" for axis in range(3))
    text = f"G91G0X{x_mm}Z{z_mm}\nX-{x_mm / 2}Y{x_mm / 2}Z-{z_mm}\n"
    result = run(library, text, settings=(*SETTINGS, f"$0={pulse_us}", *rates))
    assert result.max_step_rate_hz <= 1e6 / (2 * pulse_us)
    assert all(a <= 1.1 * 500 + g for a, g in zip(result.max_accel_mm_s2, result.accel_resolution_mm_s2, strict=True))


def test_an_axis_that_turns_does_not_slow_the_others_down(library):
    """Y begins to move the other way while X and Z go near the greatest rate: the direction is set up once, for 1.9 us,
    and not before each step of the segment."""
    timing = Timing(20_000_000, 1800, 1900, 250_000, 3)
    fast = tuple(f"${first + axis}={value}" for first, value in ((110, 1e6), (120, 3000)) for axis in range(3))
    text = "G91G0X1200Z1140\nX-600Y600Z-1140\n"
    result = run(library, text, timing=timing, settings=(*SETTINGS, "$0=3", *fast))
    assert result.final_position_steps == (150_000, 150_000, 0)
    assert all(a <= 1.1 * 3000 + g for a, g in zip(result.max_accel_mm_s2, result.accel_resolution_mm_s2, strict=True))


FRACTIONS = "G91G1X.1F60\nX.1\nY.1\nX-.2Y.1Z.1\nG0X.1Y-.2\n"
CORNER = "G91G64P.1\nG1X.05F1000000\nX.05\nY.05\nX-.1Y.05Z.05\nG0X.05Y-.1\n"


@pytest.mark.parametrize(
    ("text", "values"),
    [
        (FRACTIONS, ("$120=0.002", "$121=0.002", "$122=0.002")),
        (FRACTIONS, ("$121=0.002",)),
        (FRACTIONS, ("$40=0.001",)),
        ("G91G0X100\n", ("$100=10", "$120=0.01")),
        ("G91G0X50\n", ("$120=0.001",)),
        (CORNER, ("$121=0.001", "$40=10000000")),
    ],
)
def test_the_slowest_motion_of_all_is_not_slowed_down_further(library, text, values):
    """Its stops take minutes, and must fit into a batch of motion all the same."""
    result = run(library, text, settings=(*SETTINGS, *values))
    assert result.errors == () and result.plan_unmet == 0
    assert not [warning for warning in result.warnings if "busy" in warning and not warning.endswith(": 1 time")]


def test_a_stop_that_has_no_room_is_made_coarser(library):
    """An axis that takes seconds for what others do in milliseconds, and a shaper of half a second: at rest all of the
    spans were not enough for the stop behind the first steps, which was made again for ever."""
    slow = ("$121=0.428", "$40=8441912.766", "$170=3", "$180=5", "$11=5")
    text = "G91G64P.1\nG1X2.1395F60\nX2.1395\nY2.1395\nX-4.279Y2.1395Z2.1395\nG0X2.1395Y-4.279\n"
    result = run(library, text, settings=(*SETTINGS, *slow))
    assert result.errors == () and result.plan_unmet == 0
    assert result.final_position_steps[:3] == tuple(round(mm * 250) for mm in (2.1395, 0.0, 2.1395))
    limits = zip(result.max_accel_mm_s2, (500, 0.428, 500), result.accel_resolution_mm_s2, strict=True)
    assert all(a <= 1.1 * limit + grain for a, limit, grain in limits)


def test_figures_are_those_of_the_job_and_not_of_the_way_to_its_start(library):
    """Lines before the job may move the machine to where it begins."""
    before = (*SETTINGS, "G53G0X-40", "G4P0")
    result = run(library, "G1X-30F600\n", settings=before)
    assert (result.box_min_mm[0], result.box_max_mm[0]) == (-40.0, -30.0)
    assert result.steps_per_axis == (2_500, 0, 0) and result.final_position_mm == (-30.0, 0.0, 0.0)
    assert result.max_speed_mm_s[0] == pytest.approx(10, rel=2e-3)
    assert result.job_time_s == pytest.approx(10 / 10 + 10 / 500, abs=START_S)


@pytest.mark.parametrize("code", ["G38.2", "G38.3"])
def test_a_probe_that_misses_is_cutting_time_and_no_dwell(library, code):
    """5 mm at 5 mm/s with 500 mm/s2: s/v + v/a. After ALARM:5 the controller is quiet for 0.5 s: no part of the job."""
    result = run(library, f"{code}Z-5F300\n")
    assert [error.message[:7] for error in result.errors] == (["ALARM:5"] if code == "G38.2" else [])
    assert result.job_time_s == pytest.approx(5 / 5 + 5 / 500, abs=START_S)
    assert result.cutting_time_s == pytest.approx(result.job_time_s, abs=1e-3)
    assert result.dwell_time_s < 1e-3 and result.rapid_time_s == 0.0


def test_an_alarm_ends_the_job_when_it_comes(library):
    result = run(library, "G4P3\nG1X100F3000\n", events=(At(1.0, "estop"),))
    assert "ALARM:50" in result.errors[0].message
    assert result.job_time_s == pytest.approx(1.0, abs=0.01)


def test_a_slow_axis_does_not_dwell_at_its_end(library):
    """With 10 mm/s2 the last half step takes 20 ms."""
    result = run(library, "G1X1F60\n", settings=("$100=250", "$120=10"))
    assert result.dwell_time_s < 1e-3


def test_a_dwell_at_the_end_is_a_dwell(library):
    result = run(library, "G1X10F600\nG4P2\n")
    assert result.dwell_time_s == pytest.approx(2.0, abs=0.01)


@pytest.mark.parametrize(("spm", "accel"), [(80, 400), (40, 200), (250, 500), (1000, 2000)])
def test_the_figure_of_acceleration_is_not_the_grain_of_steps(library, spm, accel):
    """Found: 902 mm/s2 said of a machine of 400 mm/s2 with 80 steps/mm."""
    values = ((100, spm), (110, 5000), (120, accel))
    settings = tuple(f"${first + axis}={value}" for first, value in values for axis in range(3))
    zigzag = "".join(f"X{n * 1.3:.1f}Y{n % 2 * 2.1}Z{n % 3 * 0.4}\n" for n in range(1, 40))
    result = run(library, "G1F3000\n" + zigzag, settings=settings)
    for axis in range(3):
        most, grain = result.max_accel_mm_s2[axis], result.accel_resolution_mm_s2[axis]
        assert grain == pytest.approx(2 / (spm * result.accel_window_s[axis] ** 2))
        assert grain <= 0.1 * accel
        assert most <= 1.05 * accel + grain


def test_rapids_and_cuts_are_told_apart(library):
    result = run(library, "G0X50\nG1X100F3000\n")
    top, cut, accel = 5000 / 60, 50.0, 500.0  # the rapid brakes to the cut's speed, the cut to a stop
    up_mm, down_mm = top**2 / (2 * accel), (top**2 - cut**2) / (2 * accel)
    rapid_s = top / accel + (top - cut) / accel + (50 - up_mm - down_mm) / top
    assert result.rapid_time_s == pytest.approx(rapid_s, rel=0.02)
    assert result.cutting_time_s == pytest.approx(50 / cut + cut / (2 * accel), rel=0.02)
    assert result.dwell_time_s == pytest.approx(0.0, abs=5e-3)


@pytest.mark.parametrize("text", ["G1X1F600\nG4P2\nG1X2\n", "G4P2\nG1X2F600", "G1X2F600\nG4P2\n\n"])
def test_dwell_counts_for_the_job(library, text):
    result = run(library, text)
    assert result.errors == () and result.final_position_steps[0] == 500
    moves = 2 if text.startswith("G1X1") else 1
    assert result.job_time_s == pytest.approx(2 + 0.2 + moves * 10 / 500, abs=2 * START_S)
    if not text.startswith("G4"):
        assert result.dwell_time_s == pytest.approx(2, abs=2 * START_S)


@pytest.mark.parametrize("newline", ["\n", "\r", "\r\n"])
def test_nothing_behind_the_first_error_moves(library, newline):
    lines = ["%", "G0X1", "G1X2", "G0X3", "G1X9Q"]
    result = run(library, newline.join(lines))
    assert [(e.line, e.code, e.text) for e in result.errors] == [(3, 22, "G1X2")]
    assert result.errors[0].message == "the feed rate is missing (F)"
    assert result.final_position_steps[0] == 250
    assert any("%" in warning for warning in result.warnings)


def test_keep_going_collects_every_error_and_moves_nothing_of_them(library):
    result = run(library, "G0X1\nG1Y9\nG0X2\n\nG2Y5F100\nG0X1e3\nG0X3", keep_going=True)
    assert [(e.line, e.code) for e in result.errors] == [(2, 22), (5, 35), (6, 20)]
    assert result.final_position_steps == (750, 0, 0)


def test_a_program_pause_is_ended_and_told(library):
    result = run(library, "G0X1\nM0\nG0X2\nM0\nM30\n")
    assert result.errors == () and result.final_position_steps[0] == 500
    assert result.warnings == ("2 program pauses (M0) resumed immediately",)


def test_a_line_longer_than_any_buffer(library):
    blanks = " " * 5000
    result = run(library, f"G0{blanks}X1\nG0{'X2' * 3000}\nG0X3\n", keep_going=True)
    assert [(e.line, e.code) for e in result.errors] == [(2, 11)]
    assert result.final_position_steps[0] == 750


def test_binary_garbage_ends_with_errors_and_at_rest(library):
    garbage = np.random.default_rng(5).integers(0, 256, 100_000, dtype=np.uint8).tobytes()
    result = run(library, garbage, keep_going=True)
    assert len(result.errors) > 100
    assert all(error.text.isprintable() or "\t" in error.text for error in result.errors)


@pytest.mark.parametrize("text", ["G0X1e9", "G0X999999999", "G1X1F0", "G0XNAN", "G0X1\x002", "G1X1Fxx"])
def test_impossible_lines_move_nothing(library, text):
    result = run(library, text)
    assert len(result.errors) == 1 and result.steps_per_axis == (0, 0, 0)


def test_no_motion_at_all(library):
    result = run(library, "(nothing)\nG21\nM30\n", samples=True)
    assert result.errors == () and result.warnings == () and result.samples == b""
    assert (result.lines, result.blocks, result.job_time_s) == (3, 0, 0.0)


def test_settings_are_refused_by_name(library):
    with pytest.raises(UserError, match=r"\$999=1: error:3 unknown"):
        run(library, "G0X1", settings=("$999=1",))


def test_a_rate_above_the_board_is_told(library):
    result = run(library, "G0X1", settings=("$100=1000", "$110=60000"))
    assert any(warning.startswith("$110 is limited to") for warning in result.warnings)


def test_leaving_the_travel_is_told(library):
    result = run(library, "G0X-60\nX50", travel_mm=(100.0, None, 10.0, None, None, None))
    assert result.warnings == ("X moves over 110.000 mm; this machine's travel is 100 mm",)


def test_the_same_job_makes_the_same_figures(library):
    text = "".join(f"G1X{n % 7}Y{n % 3}F2000\n" for n in range(200))
    assert run(library, text, samples=True) == run(library, text, samples=True)


def test_progress_reaches_the_end(library):
    seen = []
    text = "".join(f"G0X{n % 2 * 100}\n" for n in range(100)).encode()
    run_job(library, JobRequest("j", text, TIMING, SETTINGS), lambda done, total: seen.append((done, total)))
    assert seen[-1] == (100, 100) and seen == sorted(seen) and len(seen) > 3


def test_traces_hold_the_steps_of_the_counters(library, tmp_path):
    text = "G0X10Y-5\nG2X12I1F500\nG1Z-2.5F100\nG4P0.1\nG0X0Y0Z0\n"
    files = {}
    for suffix in (".csv", ".vcd", ".npz"):
        path = tmp_path / f"t{suffix}"
        trace = TraceFile(path, path, signal_names({}, "XYZ"))
        result = run(library, text, trace=trace)
        trace.complete()
        trace.clean()
        files[suffix] = path
    assert sorted(p.name for p in tmp_path.iterdir()) == ["t.csv", "t.npz", "t.vcd"]
    lines = csv.DictReader(files[".csv"].read_text().splitlines())
    rows = [{key: int(value) for key, value in row.items()} for row in lines]
    assert len(rows) == result.step_events
    with np.load(files[".npz"]) as arrays:
        for key in arrays:
            assert arrays[key].tolist() == [row[key] for row in rows]
    for axis in range(3):
        signs = [1 - 2 * (row["dir_mask"] >> axis & 1) for row in rows if row["step_mask"] >> axis & 1]
        assert sum(signs) == result.final_position_steps[axis] and len(signs) == result.steps_per_axis[axis]
    rises = [line for line in files[".vcd"].read_text().splitlines() if line in ("1!", '1"', "1#")]
    assert len(rises) == sum(result.steps_per_axis)


words = st.integers(-40_000, 40_000).map(lambda n: Decimal(n) / 1000)
lines = st.tuples(
    st.sampled_from(["G0", "G1", "G90G1", "G91G0", "G91G1", "G90G0"]), st.tuples(*[st.none() | words] * 3)
)


@given(st.lists(lines, min_size=1, max_size=30), st.integers(50, 5000))
@settings(max_examples=60)
def test_random_programs_end_on_the_exact_step(library, program, feed):
    text, target, incremental = f"F{feed}\n", [Decimal(0)] * 3, False
    for code, axes in program:
        if not any(value is not None for value in axes):
            continue
        incremental = {"G90": False, "G91": True}.get(code[:3], incremental)
        text += code + "".join(f"{letter}{v:f}" for letter, v in zip("XYZ", axes, strict=True) if v is not None) + "\n"
        for axis, value in enumerate(axes):
            if value is not None:
                target[axis] = value + (target[axis] if incremental else 0)
    result = run(library, text)
    assert result.errors == ()
    for steps, mm in zip(result.final_position_steps, target, strict=True):
        assert abs(Decimal(steps) - mm * 250) <= Decimal("0.5") + Decimal("1e-9")  # a tie may go either way


def test_read_job_says_what_is_wrong(tmp_path: Path):
    cases = {"empty.nc": (b" \n", "is empty"), "wide.nc": ("G0".encode("utf-16"), "UTF-16")}
    for name, (content, said) in cases.items():
        (tmp_path / name).write_bytes(content)
        with pytest.raises(JobError, match=said):
            read_job(tmp_path / name)
    with pytest.raises(JobError, match="file not found"):
        read_job(tmp_path / "missing.nc")
    with pytest.raises(JobError, match="folder"):
        read_job(tmp_path)


def test_printable_keeps_letters_and_escapes_the_rest():
    assert printable("(Ø3 café)".encode()) == "(Ø3 café)"
    assert printable(b"G0\x00X\xff\x1b[31m ") == "G0\\x00Xÿ\\x1b[31m"
