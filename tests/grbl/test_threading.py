"""Motion that follows the spindle, G33, G33.1, G76, and feed per revolution, G95. Tool and spindle are looked at as
they really stand; what is quoted is LinuxCNC's documentation. Virtual time.
"""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
import pytest
from grbl_host import Grbl
from lathe import ACCEL_MM_S2, INDEX_REV, STEP_MM, Course, Lathe

# A step, and the polls that look at the tool between two steps.
EXACT_MM = 2.5 * STEP_MM


@pytest.fixture
def lathe() -> Iterator[Lathe]:
    controller = Lathe()
    yield controller
    controller.close()


def stop_mm(pitch_mm: float, rpm: float) -> float:
    """Way to speed and to a stop, v^2/2a, and a little."""
    return (pitch_mm * rpm / 60) ** 2 / (2 * ACCEL_MM_S2) * 1.05 + 0.02


# --- G33 ---


def test_every_pass_lies_on_the_same_line(lathe: Lathe) -> None:
    """`Spindle-synchronized motions wait for spindle index, so multiple passes line up`"""
    lathe.fine("M3S600")
    for _ in range(20):
        course = lathe.pass_of("G33Z-10K1.5")
        on_line = course.along_z(stop_mm(1.5, 600), 10 - stop_mm(1.5, 600)).off_mm(1.5)
        assert len(on_line) > 500 and np.abs(on_line).max() <= EXACT_MM
        assert lathe.stands()[2] == -10 / STEP_MM
        lathe.fine("G0Z0")


@pytest.mark.parametrize("rpm", [60, 300, 1000, 1600])
def test_at_any_speed_the_line_is_the_same(lathe: Lathe, rpm: int) -> None:
    """A thread can be finished at another speed than it was begun."""
    lathe.fine(f"M3S{rpm}")
    course = lathe.pass_of("G33Z-10K1.5")
    on_line = course.along_z(stop_mm(1.5, rpm), 10 - stop_mm(1.5, rpm)).off_mm(1.5)
    assert len(on_line) > 100 and np.abs(on_line).max() <= EXACT_MM


@pytest.mark.parametrize("load", [10, -10])
def test_a_spindle_that_changes_its_speed_is_followed(lathe: Lathe, load: int) -> None:
    """10 % slower or faster in the middle of a pass: the error stays small, and is corrected."""
    lathe.fine("M3S600")
    lathe.record()
    lathe.put("G33Z-20K1.5\n")
    while lathe.stands()[2] > -8 / STEP_MM:
        lathe.after(0.001)
    lathe.spindle_load(load)
    _, course = lathe.watch("")
    course = course.along_z(8, 20 - stop_mm(1.5, 660))
    off = np.abs(course.off_mm(1.5))
    assert off.max() <= 0.02 and off[course.t > course.t[0] + 0.15].max() <= EXACT_MM
    assert abs(course.rpm[-1] - 600 * (1 - load / 100)) < 1 and lathe.limits_kept()


def test_a_spindle_that_never_turns_evenly_is_followed(lathe: Lathe) -> None:
    lathe.fine("M3S600")
    lathe.record()
    lathe.put("G33Z-20K1.5\n")
    seed = np.random.default_rng(7)
    off = []
    while lathe.stands()[2] > -19 / STEP_MM:
        if lathe.stands()[2] < -1 / STEP_MM:
            lathe.spindle_load(float(seed.uniform(-10, 10)))
        _, course = lathe.watch("", 0.03)
        off.append(course.along_z(1, 19).off_mm(1.5))
    assert 0.002 < np.abs(np.concatenate(off)).max() <= 0.03, "it does change, and is followed"
    lathe.watch("")
    assert lathe.limits_kept() and lathe.stands()[2] == -20 / STEP_MM


def test_with_limited_jerk_too(lathe: Lathe) -> None:
    lathe.settings(s40=20000)
    lathe.fine("M3S600")
    course = lathe.pass_of("G33Z-10K1.5").along_z(1.5, 8.5)
    assert np.abs(course.off_mm(1.5)).max() <= EXACT_MM and lathe.stands()[2] == -10 / STEP_MM


def test_a_spindle_that_turns_the_other_way(lathe: Lathe) -> None:
    lathe.fine("M4S600")
    course = lathe.pass_of("G33Z-10K1.5").along_z(0.5, 9.5)
    assert np.abs(course.off_mm(1.5, sense=-1)).max() <= EXACT_MM


@pytest.mark.parametrize("counts", [1, 4, 100, 60000])
def test_coarse_and_fine_encoders(counts: int) -> None:
    """Between two edges an even spindle is where its speed says."""
    lathe = Lathe(counts)
    try:
        lathe.fine("M3S600", "G4P1.5")
        course = lathe.pass_of("G33Z-10K1.5").along_z(0.5, 9.5)
        within_count = INDEX_REV * counts % 1 / counts  # where in its count the index lies is not seen
        assert np.abs(course.off_mm(1.5) - 1.5 * within_count).max() <= EXACT_MM
    finally:
        lathe.close()


def test_pitch_counts_along_the_drive_line(lathe: Lathe) -> None:
    """`K follows the drive line described by X- Y- Z-`: a tapered thread."""
    lathe.fine("M3S600")
    course = lathe.pass_of("G33X3Z-4K1")
    way = np.hypot(course.x, course.z)
    part = course.part((way > 0.5) & (way < 4.5))
    rate = np.polyfit(part.rev, np.hypot(part.x, part.z), 1)[0]
    assert rate == pytest.approx(1, abs=1e-4) and np.abs(part.x * 4 + part.z * 3).max() <= 5 * STEP_MM


def test_a_pass_waits_for_a_steady_spindle(lathe: Lathe) -> None:
    """`spindle.N.at-speed must be set or driven true for the motion to begin`"""
    lathe.spindle_ramp(300)
    lathe.fine("M3S600")
    course = lathe.pass_of("G33Z-5K1")
    moved = course.part(course.z < 0)
    assert moved.rpm[0] == 600 and np.abs(moved.along_z(0.5, 4.5).off_mm(1)).max() <= EXACT_MM


def test_accelerations_seen_finely(lathe: Lathe) -> None:
    """0.05 um a step: what the axis does in 5 ms, through start, two changes of the spindle's speed, and end."""
    lathe.send("$102=20000\n")  # the board's step rate leaves 25 mm/s
    lathe.fine("M3S600")
    lathe.record()
    lathe.put("G33Z-15K1.5\n")
    lathe.after(0.9)
    lathe.spindle_load(10)
    lathe.after(0.2)
    lathe.spindle_load(-10)
    lathe.after(3)
    reached = np.abs(lathe.accelerations(0.005)[:, 2]).max() / 20000
    assert 0.95 * ACCEL_MM_S2 < reached <= 1.005 * ACCEL_MM_S2 + 4 / 20000 / 0.005**2
    assert lathe.stands()[2] == -15 * 20000


def test_coupled_motors(lathe: Lathe) -> None:
    """CoreXY: the line is the tool's."""
    lathe.settings(s80=1)
    lathe.fine("M3S600")
    lathe.put("G33X10K1\n")
    offs = []
    for _ in range(3000):
        lathe.after(0.001)
        a, b, *_ = lathe.stands()
        x = (a + b) / 2 * STEP_MM
        if 0.5 < x < 9.5:
            offs.append((x - lathe.spindle_angle() + INDEX_REV + 0.5) % 1 - 0.5)
    assert len(offs) > 500 and np.abs(offs).max() <= 2 * EXACT_MM
    assert lathe.stands()[:2] == [10 / STEP_MM] * 2


@pytest.mark.parametrize("kinematics", [2, 3])
def test_arms_and_polar_axes_cannot(lathe: Lathe, kinematics: int) -> None:
    lathe.settings(s80=kinematics)
    lathe.fine("M3S600")
    assert lathe.send("G33Z-1K1\n") == "error:154\r\n"


# --- what it does not do in silence, or for ever ---


@pytest.mark.parametrize("line", ["G33Z-1K1", "G33.1Z-1K1", "G18G76P1Z-5I-1J.1K.5", "G95", "G95F1"])
def test_no_encoder(line: str) -> None:
    for encoder, counts in ((False, 0), (True, 0)):
        lathe = Lathe(counts, encoder)
        try:
            assert lathe.send(f"M3S600\n{line}\n") == "ok\r\nerror:150\r\n"
            assert lathe.stands() == [0] * 6
        finally:
            lathe.close()


@pytest.mark.parametrize("line", ["M5G33Z-1K1", "S0G33.1Z-1K1", "M5G18G76P1Z-5I-1J.1K.5", "G95G1X1F.1M5"])
def test_the_spindle_is_not_turning_when_this_command_is_executed(lathe: Lathe, line: str) -> None:
    """`It is an error if: The spindle is not turning when this command is executed`"""
    lathe.fine("M3S600")
    assert lathe.send(line + "\n") == "error:151\r\n"


@pytest.mark.parametrize("line", ["S3000G33Z-10K2", "S3000G33.1Z-10K2", "S3000G18G76P2Z-10I-1J.2K.5"])
def test_the_motion_exceeds_machine_velocity_limits(lathe: Lathe, line: str) -> None:
    """`It is an error if: The requested linear motion exceeds machine velocity limits due to the spindle speed`"""
    lathe.fine("M3S600")
    assert lathe.send(line + "\n") == "error:153\r\n" and lathe.stands() == [0] * 6


def test_a_spindle_that_does_not_start_is_an_alarm(lathe: Lathe) -> None:
    lathe.spindle_load(100)
    lathe.put("M3S600\nG33Z-10K1\n")
    said = lathe.after(12)
    assert said == "ok\r\nALARM:51\r\n[MSG:Reset to continue]\r\nerror:9\r\n" and lathe.stands() == [0] * 6
    assert lathe.outputs().spindle_direction == 0, "a spindle that may be stuck is switched off"
    lathe.spindle_load(0)
    lathe.send("\x18")
    lathe.send("$X\n")
    lathe.fine("M3S600", "G33Z-10K1")
    assert lathe.stands()[2] == -10 / STEP_MM


def test_a_spindle_that_stalls_takes_the_tool_along(lathe: Lathe) -> None:
    lathe.fine("M3S600")
    lathe.record()
    lathe.put("G33Z-30K1\n")
    lathe.after(1.5)
    lathe.spindle_load(100)
    lathe.after(0.8)
    stood, rev = lathe.stands()[2] * STEP_MM, lathe.spindle_angle()
    assert lathe.after(2) == "ALARM:51\r\n[MSG:Reset to continue]\r\nerror:9\r\n"
    assert lathe.stands()[2] * STEP_MM == stood
    off = (-stood - (rev - INDEX_REV) + 0.5) % 1 - 0.5
    assert -29 < stood < -5 and abs(off) <= 0.02 and lathe.limits_kept()


def test_a_spindle_too_fast_for_the_axes_is_an_alarm(lathe: Lathe) -> None:
    lathe.fine("M3S1200")
    lathe.record()
    lathe.put("G33Z-60K3\n")
    lathe.after(1.0)
    lathe.spindle_load(-90)  # 114 mm/s; the axis can 83
    said = lathe.after(3)
    assert said == "ALARM:52\r\n[MSG:Reset to continue]\r\nerror:9\r\n" and lathe.limits_kept()
    assert -60 / STEP_MM < lathe.stands()[2] < 0


def test_check_mode_follows_nothing(lathe: Lathe) -> None:
    assert "Enabled" in lathe.send("$C\n")
    lathe.fine("M3S600", "G33Z-10K1", "G33.1Z-20K1", "G18", "G76P1Z-20I-1J.1K.5")
    assert lathe.stands() == [0] * 6


# --- holds, door, e-stop, reset ---


def test_a_hold_waits_for_the_end_of_the_pass(lathe: Lathe) -> None:
    lathe.fine("M3S600")
    lathe.put("G33Z-10K1\nG0Z0\n")
    lathe.after(1)
    assert -9 / STEP_MM < lathe.stands()[2] < -0.5 / STEP_MM
    lathe.after(0.01, "!")
    assert lathe.state() == "Run"
    lathe.after(3)
    assert lathe.state() == "Hold:0" and lathe.stands()[2] == -10 / STEP_MM
    lathe.after(3, "~")
    assert lathe.state() == "Idle" and lathe.stands()[2] == 0


def test_before_the_pass_has_begun_a_hold_acts_at_once(lathe: Lathe) -> None:
    lathe.spindle_ramp(300)
    lathe.fine("M3S600")
    lathe.put("G33Z-10K1\n")
    lathe.after(1)
    lathe.after(0.02, "!")
    assert lathe.state() == "Hold:0"
    lathe.after(5)
    assert lathe.stands()[2] == 0
    _, course = lathe.watch("~")
    assert np.abs(course.along_z(0.5, 9.5).off_mm(1)).max() <= EXACT_MM and lathe.stands()[2] == -10 / STEP_MM


def test_in_a_cycle_a_hold_waits_until_the_tool_is_out_of_the_work(lathe: Lathe) -> None:
    lathe.fine("M3S600", "G18")
    lathe.put("G76P1Z-10I-1J.2K.4\n")
    lathe.after(1.5, "")
    assert lathe.stands()[0] == -1.2 / STEP_MM and lathe.stands()[2] < 0
    lathe.after(3, "!")
    assert lathe.state() == "Hold:0" and lathe.stands()[0] == 0 and lathe.stands()[2] == -10 / STEP_MM
    lathe.after(6, "~")
    assert lathe.state() == "Idle" and lathe.stands()[2] == -10 / STEP_MM


@pytest.mark.parametrize("by_byte", [True, False])
def test_the_door_waits_as_a_hold_does(lathe: Lathe, by_byte: bool) -> None:
    lathe.fine("M3S600")
    lathe.put("G33Z-10K1\nG0Z0\n")
    lathe.after(1)
    if by_byte:
        lathe.put("\x84")
    else:
        lathe.input("door", True)
    lathe.after(0.01)
    assert lathe.state() == "Run" and lathe.outputs().spindle_direction == 1, (
        "a tool in the thread of a spindle that stops"
    )
    lathe.after(3)
    assert lathe.state().startswith("Door") and lathe.stands()[2] == -10 / STEP_MM
    assert lathe.outputs().spindle_direction == 0


def test_an_e_stop_and_a_reset_do_not_wait(lathe: Lathe) -> None:
    for act in ("estop", "reset"):
        lathe.fine("M3S600")
        lathe.put("G33Z-40K1\n")
        lathe.after(1.5)
        if act == "estop":
            lathe.input("estop", True)
            said = lathe.after(0.001)
        else:
            said = lathe.after(0.001, "\x18")
        stood = lathe.stands()
        assert ("ALARM:50" if act == "estop" else "ALARM:3") in said and lathe.outputs().spindle_direction == 0
        lathe.after(1)
        assert lathe.stands() == stood and -39 / STEP_MM < stood[2] < 0 and lathe.position() == stood
        lathe.input("estop", False)
        lathe.send("\x18")
        lathe.send("$X\n")
        lathe.fine("G0Z0")


# --- G33.1 ---


def test_rigid_tapping(lathe: Lathe) -> None:
    """`Continued synchronized motion beyond the specified end coordinate until the spindle actually stops and
    reverses`, back beyond the start likewise, then `An unsynchronized move back to the original coordinate`"""
    lathe.fine("M3S600")
    lathe.record()
    course = lathe.pass_of("G33.1Z-8K1")
    overrun = 600**2 / (2 * 2000) / 60  # mm at 1 mm a revolution: the spindle's way to a stop
    assert course.z.min() == pytest.approx(-8 - overrun, abs=0.03)
    assert course.z.max() == pytest.approx(overrun, abs=0.03)
    in_work = course.part(course.z < -0.2)
    off = in_work.off_mm(1)
    assert len(off) > 3000 and np.abs(off).max() <= 0.02, "there, at the turn, and back"
    assert lathe.stands()[2] == 0 and lathe.outputs().spindle_direction == 1 and lathe.limits_kept()


def test_tapping_out_faster(lathe: Lathe) -> None:
    """`I - optional spindle speed multiplier for return move`"""
    lathe.fine("M3S400")
    course = lathe.pass_of("G33.1Z-12K1I2")
    assert course.rpm.min() == -800
    assert np.abs(course.part(course.z < -0.5).off_mm(1)).max() <= 0.02
    lathe.after(1)
    assert lathe.spindle_rpm() == 400 and lathe.stands()[2] == 0


def test_a_spindle_that_does_not_turn_back_is_an_alarm(lathe: Lathe) -> None:
    lathe.fine("M3S600")
    lathe.put("G33.1Z-8K.1\n")
    lathe.spindle_ramp(5)
    said = lathe.after(60)
    assert said == "ALARM:51\r\n[MSG:Reset to continue]\r\nerror:9\r\n"


# --- G76 ---


def in_work(course: Course, peak_mm: float) -> list[Course]:
    """Each time below the peak."""
    deep = np.flatnonzero(course.x < peak_mm)
    runs = np.split(deep, np.flatnonzero(np.diff(deep) > 1) + 1)
    return [course.part(np.isin(np.arange(len(course.x)), run)) for run in runs]


def passes(lathe: Lathe, line: str, peak_mm: float) -> list[tuple[float, float, float, float]]:
    """Of each pass: least x, first and last z in the work, and how far off the line through the start of its z."""
    _, course = lathe.watch(line, 120)
    rows = []
    for part in in_work(course, peak_mm - 0.01):
        moving = part.part((part.z < part.z.max() - 1) & (part.z > part.z.min() + 1))
        off = moving.off_mm(1, start_mm=part.z.max())
        rows.append((part.x.min(), part.z.max(), part.z.min(), float(np.abs(off).max())))
    return rows


def test_threading_cycle(lathe: Lathe) -> None:
    """`R1.0 selects constant depth on successive threading passes. R2.0 selects constant area`, H spring passes"""
    for words, depths in (
        ("J.2K.8", [0.2, 0.4, 0.6, 0.8]),
        ("J.2K.7H2", [0.2, 0.4, 0.6, 0.7, 0.7, 0.7]),
        ("J.4K.8R2", [0.4, 0.4 * 2**0.5, 0.4 * 3**0.5, 0.8]),
    ):
        lathe.fine("M3S600", "G18", "G0X2Z1")
        rows = passes(lathe, f"G76P1Z-9I-1.5{words}", 0.5)
        assert [row[0] for row in rows] == pytest.approx([0.5 - depth for depth in depths], abs=STEP_MM)
        assert all(row[1:3] == (1, -9) and row[3] <= EXACT_MM for row in rows)
        assert lathe.stands()[:3] == [2 / STEP_MM, 0, -9 / STEP_MM], "at the end of the drive line"


def test_a_thread_inside_goes_the_other_way(lathe: Lathe) -> None:
    """`Negative I values are external threads, and positive I values are internal threads`"""
    lathe.fine("M3S600", "G18")
    course = lathe.pass_of("G76P1Z-9I1J.4K.8")
    assert course.x.max() == pytest.approx(1.8, abs=STEP_MM) and course.x.min() == 0


def test_diameters(lathe: Lathe) -> None:
    """`When G7 Lathe Diameter Mode is in force the values for I, J and K are diameter measurements`"""
    lathe.fine("M3S600", "G18", "G7")
    course = lathe.pass_of("G76P1Z-9I-2J.4K.8")
    assert course.x.min() == pytest.approx(-1.4, abs=STEP_MM)


def test_slide_angle(lathe: Lathe) -> None:
    """`A positive Q value causes the leading edge of the tool to cut more heavily`: later passes lie further ahead"""
    lathe.fine("M3S600", "G18")
    rows = passes(lathe, "G76P1Z-9I-1J.2K.8Q30", -1)
    depths = np.array([0.2, 0.4, 0.6, 0.8])
    assert [row[1] for row in rows] == pytest.approx(-depths * np.tan(np.radians(30)), abs=STEP_MM)
    assert [row[2] for row in rows] == pytest.approx(-9 + (0.8 - depths) * np.tan(np.radians(30)), abs=STEP_MM)
    assert all(row[3] <= EXACT_MM for row in rows)


def test_tapers(lathe: Lathe) -> None:
    """`L3 both`: `the last pass tapers to the thread crest over the distance specified with E`"""
    lathe.fine("M3S100", "G18")  # slow: the bends are short
    lathe.record()
    first, last = in_work(lathe.pass_of("G76P1Z-12I-1J.4K.8E1.6L3"), -1.005)
    work = last.part(last.z > -11.99)
    ideal = -1 - 0.8 * np.minimum(1, np.minimum(-work.z / 1.6, (12 + work.z) / 1.6))
    assert work.x.min() == pytest.approx(-1.8, abs=STEP_MM)
    assert (work.x - ideal).min() >= -3 * STEP_MM, "never deeper than the taper"
    assert (work.x - ideal).max() <= 0.01 and lathe.limits_kept()
    assert np.abs(work.part((work.z < -1) & (work.z > -11)).off_mm(1)).max() <= EXACT_MM
    assert first.x.min() == pytest.approx(-1.4, abs=STEP_MM) and first.z.max() < -0.75, "off the work by what is left"


def test_fast_tapers_bend_as_the_axes_can(lathe: Lathe) -> None:
    lathe.fine("M3S900", "G18")
    lathe.record()
    course = lathe.pass_of("G76P1Z-20I-1J.2K.8E1L3")
    assert course.x.min() == pytest.approx(-1.8, abs=STEP_MM) and lathe.limits_kept()


# --- G95 ---


def seconds_of(lathe: Lathe, line: str) -> float:
    begin = lathe.time()
    lathe.after(0.005, line + "\n")
    while lathe.state() != "Idle":
        lathe.after(0.005)
    return lathe.time() - begin


def test_feed_per_revolution(lathe: Lathe) -> None:
    """`an F word is interpreted to mean the controlled point should move a certain number of [mm] per revolution`"""
    lathe.fine("M3S600", "G4P1", "G95F.2")
    assert seconds_of(lathe, "G1X10") == pytest.approx(5, abs=0.1)
    lathe.spindle_load(20)
    lathe.after(1)
    assert seconds_of(lathe, "G1X0") == pytest.approx(10 / 0.2 / 8, abs=0.1)
    lathe.spindle_load(0)
    lathe.fine("S1200", "G4P1")
    assert seconds_of(lathe, "G2X10I5") == pytest.approx(np.pi * 5 / 0.2 / 20, abs=0.1)
    assert "G95" in lathe.send("$G\n") and "F0.200" in lathe.send("$G\n")


def test_feed_override_counts_on_top(lathe: Lathe) -> None:
    lathe.fine("M3S600", "G4P1", "G95F.2")
    lathe.after(0, "\x91" * 5)
    assert seconds_of(lathe, "G1X10") == pytest.approx(10 / 0.3 / 10, abs=0.1)


def test_the_other_feed_modes_stay_what_they_are(lathe: Lathe) -> None:
    lathe.fine("M3S600", "G4P1", "G95F.2", "G1X1", "G94F600")
    assert seconds_of(lathe, "G1X11") == pytest.approx(1, abs=0.1)
    assert seconds_of(lathe, "G93G1X0F30") == pytest.approx(2, abs=0.1)
    assert lathe.send("G95G1X1\n") == "error:22\r\n", "F of another mode is none"
    assert lathe.send("G95F.1G1X1\nM2\nG1X2\n").split() == [*("ok", "[MSG:Pgm", "End]", "ok", "error:22")]


def test_without_a_turning_spindle_no_feed_for_ever(lathe: Lathe) -> None:
    lathe.fine("M3S600", "G4P1", "G95F.2")
    lathe.put("G1X50\n")
    lathe.after(1)
    lathe.spindle_load(100)
    lathe.after(1)
    assert lathe.after(12) == "ALARM:51\r\n[MSG:Reset to continue]\r\n"


def test_speed_is_rpm_and_nothing_else(lathe: Lathe) -> None:
    lathe.fine("G97S500")
    assert lathe.send("G96S100\n") == "error:20\r\n"


# --- inputs and outputs that a board has not ---


@pytest.mark.parametrize("code", ["M62", "M63", "M64", "M65"])
def test_outputs_that_the_board_has_not(code: str) -> None:
    for outputs in (0, 2):
        grbl = Grbl(outputs=outputs)
        try:
            grbl.send("")
            answers = [grbl.send(f"{code}P{number}\n") for number in range(6)]
            assert answers == ["ok\r\n"] * outputs + ["error:131\r\n"] * (6 - outputs)
        finally:
            grbl.close()
