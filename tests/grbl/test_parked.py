"""A parked hold: between 0xA3 and ~ the lines are the operator's, and ~ returns to the step where the job was left."""

from __future__ import annotations

import pytest
from grbl_host import Grbl

PARK = "\xa3"
PARKED = "[MSG:Parked: jog, probe, set zero; ~ returns to the job]\r\n"
QUICK = [f"${base + axis}={value}" for base, value in ((110, 3000), (120, 300)) for axis in range(3)]
LIFT = "$J=G91Z5F2000\n"
STEPS = 250  # per mm


def started(grbl: Grbl, job: str, seconds: float = 0.4, *settings: str) -> str:
    grbl.fine(*QUICK, *settings)
    return grbl.after(seconds, job)


def hold(grbl: Grbl) -> str:
    """A feed hold at rest, and the operator's."""
    said = grbl.after(0.5, "!")
    assert grbl.state() == "Hold:0"
    return said + grbl.after(0.02, PARK)


def park(grbl: Grbl, job: str, seconds: float = 0.4, *settings: str) -> list[int]:
    """A job that is parked. Returns where it was left."""
    started(grbl, job, seconds, *settings)
    assert hold(grbl).endswith(PARKED)
    return grbl.position()


def trace(grbl: Grbl) -> list[tuple[int, ...]]:
    """Places of X Y Z after each step event since record()."""
    at, places = [0, 0, 0], []
    for event in grbl.step_events():
        for axis in range(3):
            if event["step"] >> axis & 1:
                at[axis] += -1 if event["dir"] >> axis & 1 else 1
        places.append(tuple(at))
    return places


def test_a_reset_in_the_return_to_a_dwell_is_one_in_motion() -> None:
    """The job's line is a dwell, in which nothing is cut off; the axes were on their way back to it."""
    grbl = Grbl()
    grbl.send("")
    park(grbl, "G1X2F3000\nG4P5\n", 0.6)
    assert "error" not in grbl.after(1.0, "$J=G91X60F3000\n")
    grbl.after(0.5, "~")
    assert grbl.state() == "Run"
    assert "ALARM:3" in grbl.after(0.1, "\x18")


@pytest.mark.parametrize("accel_mm_s2", [2, 5, 10, 50])
def test_a_slow_machine_is_as_fast_in_a_parked_hold_as_elsewhere(accel_mm_s2: int) -> None:
    """10 mm/s2 are Grbl's default. A stop from 500 mm/min takes up to 4 s then, and is in each batch of motion."""
    grbl = Grbl()
    grbl.send("")
    grbl.fine("$21=0", "$112=500", f"$122={accel_mm_s2}")
    grbl.after(0.5, "M0\n")
    assert grbl.after(0.1, PARK) == PARKED
    v_mm_s, way_mm = 500 / 60, 60
    said = grbl.after(way_mm / v_mm_s + v_mm_s / accel_mm_s2 + 0.1, f"$J=G91Z{way_mm}F500\n")
    assert said == "ok\r\n" and grbl.position()[2] == way_mm * STEPS


JOBS = {
    "lines": "G1X4F1200\nY4\nX0\nY0\n",
    "arc": "G2X0Y0I3J0F900\nG1X1\n",
    "helix of a few chords": "G17G2X0Y6Z1I0J3F900\nG1Z0\n",
    "G91": "G91G1X3F900\nY3\nX-3\nY-3\n",
    "G93": "G93G1X6F30\nG1Y2F60\n",
    "spline": "G5X6Y6I0J3P0Q-3F900\nG1X0\n",
    "cycle": "G99G81X3Y3Z-2R1F600\nX5\nX7\nG80\n",
    "dwell": "G1X2F900\nG4P1\nG1X4\n",
}


@pytest.mark.parametrize("job", JOBS.values(), ids=JOBS)
@pytest.mark.parametrize("seconds", [0.15, 0.5])
def test_a_job_goes_on_at_the_step_where_it_was_left(job: str, seconds: float) -> None:
    """Its steps, and their order, are those of a job that was only held."""
    traces = []
    for parks in (False, True):
        grbl = Grbl()
        grbl.send("")
        grbl.record()
        started(grbl, job, seconds)
        grbl.after(0.5, "!")
        left, way = grbl.position()[:3], 0
        before = trace(grbl)
        if parks:
            assert grbl.after(3, PARK + LIFT + "$J=G91X-4Y2F2000\nM5\n") == PARKED + "ok\r\nok\r\nok\r\n"
            assert grbl.position()[:3] == [left[0] - 4 * STEPS, left[1] + 2 * STEPS, left[2] + 5 * STEPS]
            way = 2 * (5 + 4 + 2) * STEPS  # up, there and back
        said = grbl.send("~")
        assert "error" not in said and grbl.state() == "Idle" and grbl.position() == grbl.stands()
        traces.append(before + trace(grbl)[len(before) + way :])
        grbl.close()
    assert traces[0] == traces[1] and len(traces[0]) > 100


def test_the_way_back_is_up_across_and_down(grbl: Grbl) -> None:
    """The highest place that the operator went to is the one at which X and Y return; the spindle turns before Z goes
    down, at $57."""
    left = park(grbl, "M3S1000\nG1X20F600\n", 0.6, "$57=60", "$394=2")
    grbl.after(3, "$J=G91Z10F2000\nM5\n$J=G91X-8F2000\n$J=G91Z-6F2000\n")
    assert grbl.outputs().spindle_direction == 0
    grbl.record()
    grbl.after(0.01, "~")
    seen = []
    for _ in range(3000):
        grbl.after(0.01)
        seen.append((*grbl.position()[:3], grbl.outputs().spindle_direction, round(grbl.time(), 2)))
        if grbl.position()[0] > left[0]:
            break
    across = [z for x, _, z, *_ in seen if left[0] - 8 * STEPS < x < left[0]]
    assert across and set(across) == {10 * STEPS}
    starts = next(at for *_, turns, at in seen if turns)
    down = [(z, at) for x, _, z, _, at in seen if x == left[0] and 0 < z < 10 * STEPS]
    assert down[0][1] >= starts + 2
    assert (down[0][0] - down[-1][0]) / (down[-1][1] - down[0][1]) / STEPS == pytest.approx(1.0, rel=0.02)
    grbl.send("")
    assert grbl.position() == [20 * STEPS, 0, 0, 0, 0, 0]


def test_lines_of_the_job_wait_behind_those_of_the_operator(grbl: Grbl) -> None:
    """The receive buffer is full of them, and each line gets its answer: the operator's first."""
    grbl.fine(*QUICK)
    job = "".join(f"G1X{0.1 * i:.1f}F600\n" for i in range(1, 400))
    sent = len(job)
    said = grbl.after(0.2, job[:1900])
    said += grbl.after(0.5, "!")
    half = grbl.after(0.1, PARK + "G4P1\n$J=G91")  # a line that is not whole yet
    assert half == PARKED + "error:170\r\n"
    assert grbl.after(1, "Z2F2000\n") == "ok\r\n" and grbl.position()[2] == 2 * STEPS
    for _ in range(60):  # many times the buffer
        assert grbl.after(0.01, "G92.1 (" + "x" * 60 + ")\n") == "ok\r\n"
    said += grbl.after(8, "~")
    said += grbl.send(job[1900:sent])
    assert said.count("ok\r\n") == 399 and "error" not in said
    assert grbl.position() == [round(39.9 * STEPS), 0, 0, 0, 0, 0]


def test_the_operators_lines_before_the_resume_are_done_first(grbl: Grbl) -> None:
    park(grbl, "G1X10F600\nY1\n")
    assert grbl.after(0.3, "$J=G91Z1F200\nG10L20P1Y5\n~") == "ok\r\n"
    assert grbl.state() == "Hold:1"  # the jog moves; the offset waits for its end
    assert grbl.after(0.5) == "ok\r\n"
    grbl.send("")
    assert grbl.position() == [2500, -4 * STEPS, 0, 0, 0, 0]  # Y0 is at -5 now, and the job's Y1 at -4


def test_a_new_zero_moves_what_is_planned_and_what_is_not(grbl: Grbl) -> None:
    """A cutter broke in the middle of an arc. The new one is 3.2 mm longer."""
    park(grbl, "G2X0Y0I5J0F900\nG1X2Z-1\nG91X1\nG90Z0\n", 0.6)
    grbl.after(2, LIFT)
    assert grbl.after(0.5, "G43.1Z3.2\n") == "ok\r\n"
    grbl.after(0.1, "~")
    while grbl.position()[2] != 800:
        grbl.after(0.01)
    levels = set()
    while grbl.state() == "Run":
        grbl.after(0.01)
        levels.add(grbl.position()[2])
    assert min(levels) == pytest.approx(800 - 250, abs=3) and max(levels) == 800  # Z0 and Z-1, all of it 3.2 mm higher
    grbl.send("")
    assert grbl.position() == [3 * STEPS, 0, 800, 0, 0, 0]


CHANGES = {
    "cycle": ("G99G81X3Y3Z-2R1F600\nX5\nX7\nG80\n", "G92X-1\n"),
    "spline": ("G5X6Y6I0J3P0Q-3F900\nG1X0\n", "G10L2P1X1Y1\n"),
    "arc in XZ": ("G18G2X6Z0I3K0F900\n", "G10L2P1X1Z1\n"),
}


@pytest.mark.parametrize(("job", "change"), CHANGES.values(), ids=CHANGES)
def test_the_job_ends_where_the_new_zero_says(grbl: Grbl, job: str, change: str) -> None:
    park(grbl, job, 0.3)
    assert grbl.after(1, LIFT + change) == "ok\r\nok\r\n"
    grbl.after(0.1, "~")
    grbl.send("")
    after = grbl.position()
    grbl.send("G90G0X0Y0Z0\n" + job)
    assert after == grbl.position() == grbl.stands()


def test_a_shift_out_of_the_travel_is_refused(grbl: Grbl) -> None:
    """With soft limits the moves that are planned count, too: they were checked before the tool was longer."""
    grbl.fine(*QUICK, "$22=1", "$20=1", *(f"$13{axis}=100" for axis in range(3)))
    grbl.send("$X\n")
    grbl.send("G53G0X-50Y-50Z-20\n")
    grbl.after(1.5, "G1X-40F600\nZ-2\nX-30\n")
    assert hold(grbl).endswith(PARKED)
    assert grbl.after(1, "$J=G91Z30F1000\n") == "error:15\r\n"
    assert grbl.after(1, "G91G38.2Z30F100\n") == "error:15\r\n"
    assert grbl.after(1, "G43.1Z3\n") == "ok\r\n"
    assert grbl.after(1, "~") == "[MSG:Not resumed: with the new offsets the job leaves the travel]\r\n"
    assert grbl.state() == "Hold:0"
    assert grbl.after(1, PARK + "G43.1Z0.5\n") == PARKED + "ok\r\n"
    grbl.after(0.1, "~")
    grbl.send("")
    assert grbl.state() == "Idle" and grbl.position()[2] == round(-1.5 * STEPS)


@pytest.mark.parametrize("stop", ["M0", "M6", "T2M6"])
def test_a_tool_is_changed_and_probed(grbl: Grbl, stop: str) -> None:
    """M6 at Z5; the plate is touched; the job's Z0 is there, and it returns to its Z5."""
    grbl.surface(-3 * STEPS)
    started(grbl, f"G0Z5\n{stop}\nG0X1\nG1Z0F600\n", 3)
    assert grbl.state() == "Hold:0"
    said = grbl.after(8, PARK + "G91G38.2Z-20F200\n")
    assert said == PARKED + "[PRB:0.000,0.000,-3.000:1]\r\nok\r\n"
    assert grbl.after(3, "G10L20P1Z0\n$J=G91Z20F1000\n") == "ok\r\nok\r\n"
    rested = grbl.position()[2]
    zero = rested - 20 * STEPS
    assert grbl.after(0.1, "~") == ""
    said = grbl.send("")
    assert said == "ok\r\nok\r\nok\r\n" and grbl.position() == [STEPS, 0, zero, 0, 0, 0]


def test_a_probe_that_finds_nothing_is_an_error_and_keeps_the_job(grbl: Grbl) -> None:
    park(grbl, "G1X10F600\n")
    assert grbl.after(2, "G91G38.2Z-1F200\n") == "[PRB:0.000,0.000,0.000:0]\r\nerror:171\r\n"
    assert grbl.after(2, "G38.3Z1\n") == f"[PRB:{grbl.position()[0] / STEPS:.3f},0.000,0.000:0]\r\nok\r\n"
    grbl.input("probe", True)
    assert grbl.after(2, "G38.2Z-1\n") == "error:171\r\n"
    grbl.input("probe", False)
    grbl.after(0.1, "~")
    grbl.send("")
    assert grbl.state() == "Idle" and grbl.position() == [2500, 0, 0, 0, 0, 0]


REFUSED = {
    170: ["G1X1F100", "G0X1", "X1", "G28", "G28X1", "G53G0Z0", "G4P0", "M0", "M1", "M2", "M30", "T1M6", "T3", "G93",
          "M70", "M50P0", "M66P0L0", "G81X1Z-1R0F100", "G5.1X1Y1I1J0"],
    8: ["$H", "$HX", "$C", "$SLP", "$RST=#", "$110=100", "$N0=G21", "$I=x", "$ACK"],
}  # fmt: skip


@pytest.mark.parametrize("error", REFUSED)
def test_what_is_no_operators_is_refused_and_changes_nothing(grbl: Grbl, error: int) -> None:
    left = park(grbl, "G1X10F600\n")
    for line in REFUSED[error]:
        assert grbl.after(0.1, line + "\n") == f"error:{error}\r\n", line
    assert grbl.position() == left and grbl.state() == "Hold:0"
    grbl.after(0.1, "~")
    assert grbl.send("") == "" and grbl.position() == [2500, 0, 0, 0, 0, 0]


@pytest.mark.parametrize("stop", ["!", "\x85"])
def test_a_jog_of_the_operator_can_be_stopped(grbl: Grbl, stop: str) -> None:
    left = park(grbl, "G1X10F600\n")
    assert grbl.after(0.3, "$J=G91Y-50F600\n") == "ok\r\n"
    assert grbl.state() == "Hold:1"
    assert grbl.after(0.5, stop) == "" and grbl.state() == "Hold:0"
    stopped = grbl.position()
    assert -5 * STEPS < stopped[1] < 0 and stopped == grbl.stands()
    assert grbl.after(1, "$J=G90Y0F600\n") == "ok\r\n" and grbl.position()[1] == left[1]
    grbl.after(0.1, "~")
    grbl.send("")
    assert grbl.position() == [2500, 0, 0, 0, 0, 0]


def test_a_hold_on_the_way_back_and_another_parking(grbl: Grbl) -> None:
    left = park(grbl, "M3S1000\nG1X10F600\nY1\n", 0.5)
    grbl.after(3, "$J=G91Z10F2000\n$J=G91Y20F2000\n")
    grbl.after(0.5, "~")
    assert grbl.state() == "Run"
    grbl.after(0.5, "!")
    held = grbl.position()
    assert grbl.state() == "Hold:0" and left[1] < held[1] < 20 * STEPS
    assert grbl.after(1, PARK + "$J=G91X-5F2000\n") == PARKED + "ok\r\n"
    assert grbl.position()[0] == held[0] - 5 * STEPS
    grbl.after(0.1, "~~")
    grbl.send("")
    assert grbl.position() == [2500, STEPS, 0, 0, 0, 0] and grbl.outputs().spindle_direction == 1


def test_a_plain_resume_in_the_hold_of_the_way_back(grbl: Grbl) -> None:
    park(grbl, "G1X10F600\n", 0.5)
    grbl.after(3, "$J=G91Z10F2000\n$J=G91Y20F2000\n")
    grbl.after(0.3, "~")
    for _ in range(8):
        grbl.after(0.3, "!")
        grbl.after(0.7, "~")
    grbl.send("")
    assert grbl.position() == [2500, 0, 0, 0, 0, 0]


@pytest.mark.parametrize("when", ["parked", "jogging", "probing", "up", "down"])
@pytest.mark.parametrize("end", ["reset", "limit", "estop"])
def test_what_ends_the_job_ends_it_at_every_stage(grbl: Grbl, when: str, end: str) -> None:
    """Every line is answered, the position is the pulses, and nothing of the job comes later."""
    park(grbl, "T1M6\n" if when == "probing" else "G1X10F600\nG4P1\n", 0.5, "$21=1", "$57=60")
    grbl.after(1.5, LIFT)
    grbl.after(0.3, {"jogging": "$J=G91X-50F600\n", "probing": "G91G38.2Z-20F100\n"}.get(when, ""))
    if when in ("up", "down"):
        grbl.after(1, "$J=G91X3F2000\n")
        grbl.after(0.1 if when == "up" else 6, "~")
    if end == "reset":
        said = grbl.after(2, "\x18")
    else:
        grbl.input({"limit": "limit-y", "estop": "estop"}[end], True)
        said = grbl.after(1)
        grbl.input({"limit": "limit-y", "estop": "estop"}[end], False)
        said += grbl.after(2, "\x18")
    assert "Grbl 1.1h" in said
    grbl.after(1, "$X\n")
    at = grbl.position()
    assert grbl.after(2, PARK) == "[MSG:Not parked: 0xA3 acts in a hold]\r\n"
    assert grbl.after(2, "~") == "" and grbl.position() == at == grbl.stands()
    assert grbl.send("G91G1X1F600\n") == "ok\r\n" and grbl.position()[0] == at[0] + STEPS


def test_the_door_stops_the_operator_too(grbl: Grbl) -> None:
    """~ behind the closed door leads back to the parked hold, and 0xA3 parks a job that a door has held."""
    park(grbl, "M3S1000\nG1X10F600\n", 0.5)
    grbl.after(0.3, "$J=G91Z20F600\n")
    grbl.input("door", True)
    assert grbl.after(1) == "[MSG:Check Door]\r\n" and grbl.state() == "Door:1"
    up = grbl.position()
    assert grbl.after(1, PARK) == "[MSG:Not parked: close the door first]\r\n"
    grbl.input("door", False)
    assert grbl.after(0.2, "~") == "" and grbl.state() == "Door:3"
    grbl.after(6)
    assert grbl.state() == "Hold:0" and grbl.position() == up
    assert grbl.after(1, PARK + "$J=G91Z1F600\n") == PARKED + "ok\r\n"
    grbl.after(0.5, "\x84")
    assert grbl.state() == "Door:0" and grbl.outputs().spindle_direction == 0
    assert grbl.after(1, PARK + "$J=G91Z1F600\n") == PARKED + "ok\r\n" and grbl.state() == "Hold:0"
    assert grbl.outputs().spindle_direction == 0
    grbl.after(0.1, "~")
    grbl.send("")
    assert grbl.position() == [2500, 0, 0, 0, 0, 0] and grbl.outputs().spindle_direction == 1


def test_a_lost_sender_stops_the_operators_motion(grbl: Grbl) -> None:
    """Its lines are dropped; the next sender's lines wait for ~."""
    park(grbl, "G1X10F600\nY1\n", 0.5, "$75=0.1")
    grbl.after(0.3, "$J=G91Y30F600\n$J=G91Y30F600\nG92Z5\n")
    grbl.lose_sender()
    assert "Sender lost: feed hold" in grbl.after(2) and grbl.state() == "Hold:0"
    at = grbl.position()
    assert 0 < at[1] < 10 * STEPS
    assert grbl.after(1, "G1Y2\n") == "" and grbl.position() == at
    assert grbl.after(1, PARK + "$J=G91Z1F600\n") == PARKED + "ok\r\n"
    grbl.after(0.1, "~")
    grbl.send("")
    assert grbl.position() == [2500, 2 * STEPS, 0, 0, 0, 0]


@pytest.mark.parametrize("seconds", [0.001, 0.5, 3])
def test_parking_while_a_lost_senders_tools_come_back(grbl: Grbl, seconds: float) -> None:
    """They stop again, both: none runs alone next to the operator."""
    started(grbl, "M3S1000M8\nG1X10F600\n", 0.5, "$75=0.1")
    grbl.lose_sender()
    grbl.after(2)
    assert grbl.outputs().spindle_direction == 0 and grbl.after(seconds, "~") == ""
    assert grbl.outputs().spindle_direction == 1 and grbl.outputs().coolant == 0
    assert grbl.after(8, PARK) == PARKED and grbl.state() == "Hold:0"
    assert grbl.outputs().spindle_direction == 0 and grbl.outputs().coolant == 0
    grbl.after(0.1, "~")
    grbl.send("")
    assert grbl.outputs().spindle_direction == 1 and grbl.outputs().coolant == 2
    assert grbl.position() == [2500, 0, 0, 0, 0, 0]


@pytest.mark.parametrize("stop", ["door", "lost"])
def test_tools_that_were_stopped_start_above_the_job(grbl: Grbl, stop: str) -> None:
    """Not where the operator has the tool: it may touch a clamp or a probe."""
    started(grbl, "M3S1000M8\nG1X10F600\n", 0.5, "$75=0.1")
    if stop == "door":
        grbl.after(2, "\x84")
    else:
        grbl.lose_sender()
        grbl.after(2)
    left = grbl.position()
    said = grbl.after(4, PARK + "$J=G91Z10F2000\n$J=G91Y20F2000\n")
    assert said == PARKED + "ok\r\nok\r\n" and grbl.outputs().spindle_direction == 0
    grbl.after(0.2, "~")
    for _ in range(100):
        if grbl.outputs().spindle_direction != 0:
            break
        grbl.after(0.1)
    assert grbl.position()[:2] == left[:2] == grbl.stands()[:2] and grbl.position()[2] == left[2] + 10 * STEPS
    grbl.send("")
    assert grbl.outputs().spindle_direction == 1 and grbl.outputs().coolant == 2
    assert grbl.position() == [2500, 0, 0, 0, 0, 0]


def test_a_laser_stays_dark_while_it_is_parked(grbl: Grbl) -> None:
    """The monitor of every test looks at the beam after each poll; here the operator asks for it, too."""
    raster = "".join(f"G1X{i / 10}S{i % 2 * 900 + 50}\n" for i in range(1, 80))
    park(grbl, "G91M3F600\nG90\n" + raster, 0.5, "$32=1", "$89=5")
    grbl.after(0.02, "M3S500\n" + LIFT + "$J=G91X-3F1000\nG91G38.3Y-1F300\n$J=G91X1F100\n")
    for _ in range(100):
        assert grbl.outputs().spindle_duty == 0
        grbl.after(0.02)
    grbl.after(0.05, "~")
    while grbl.position()[2] > 0:
        assert grbl.outputs().spindle_duty == 0
        grbl.after(0.01)
    grbl.send("")
    assert grbl.position()[0] == round(7.9 * STEPS)


def test_what_keeps_a_job_at_its_place(grbl: Grbl) -> None:
    grbl.fine(*QUICK)
    assert grbl.after(0.1, PARK) == "[MSG:Not parked: 0xA3 acts in a hold]\r\n"
    grbl.after(0.3, "G91G38.3Z-5F100\n")
    assert grbl.after(1, "!" + PARK) == "[MSG:Not parked: the program is probing]\r\n"
    grbl.after(5, "~")
    grbl.after(0.3, "M66P0L3Q5\n")
    assert grbl.after(1, "!" + PARK) == "[MSG:Not parked: the program waits for an input or the spindle]\r\n"
    grbl.send("~")
    assert grbl.state() == "Idle"


def test_a_line_in_a_hold_without_it_waits_as_ever(grbl: Grbl) -> None:
    started(grbl, "G1X10F600\n")
    grbl.after(0.5, "!")
    assert grbl.after(1, "$J=G91Z5F1000\n") == ""
    assert grbl.after(0.2, "~") == "error:8\r\n"


def test_overrides_and_keys_act_as_in_any_hold(grbl: Grbl) -> None:
    """The job gets what the operator has switched by a key, not what lines of the parked hold have switched."""
    park(grbl, "M3S1000M8\nG1X10F600\n", 0.5)
    grbl.after(0.2, "\x9e\x91\x95\xa0")
    assert grbl.outputs().spindle_direction == 0 and grbl.outputs().coolant == 0
    grbl.after(0.2, "\x9e")
    assert grbl.outputs().spindle_direction == 1
    grbl.after(2, "M5M8\n" + LIFT)
    assert grbl.outputs().spindle_direction == 0 and grbl.outputs().coolant == 2
    grbl.after(10, "~")
    assert grbl.outputs().spindle_direction == 1 and grbl.outputs().coolant == 0
    assert "|Ov:110,100,100|A:S" in grbl.send("\x87")
    grbl.send("")
    assert grbl.position() == [2500, 0, 0, 0, 0, 0]


def test_the_bytes_may_come_together(grbl: Grbl) -> None:
    """! 0xA3 lines ~ and the next lines of the job in one packet: each is where it belongs."""
    started(grbl, "G1X10F600\n")
    said = grbl.after(0.02, "!" + PARK + "G10L20P1Y3\n" + LIFT + "~G0Y4\n")
    assert said == "" and grbl.state() == "Hold:1"
    said = grbl.send("")
    assert said == PARKED + "ok\r\nok\r\nok\r\n"
    assert grbl.position() == [2500, STEPS, 0, 0, 0, 0]


def test_a_resume_that_a_hold_takes_back(grbl: Grbl) -> None:
    """The lines before ~ are done, the job's after it wait, and 0xA3 is needed again."""
    left = park(grbl, "G1X10F600\n")
    assert grbl.after(0.1, "$J=G91Z5F300\n~!G1Y1\n") == "ok\r\n"
    grbl.after(2)
    assert grbl.state() == "Hold:0" and grbl.position()[:2] == left[:2]
    assert grbl.after(0.5, "$J=G91Z1F600\n") == ""
    assert grbl.after(0.5, PARK + "$J=G90Z2F600\n") == PARKED + "ok\r\n" and grbl.position()[2] == 2 * STEPS
    grbl.after(0.1, "~")
    assert grbl.send("") == "ok\r\nerror:8\r\n"
    assert grbl.position() == [2500, STEPS, 0, 0, 0, 0]


def test_a_sender_that_is_lost_with_its_last_byte(grbl: Grbl) -> None:
    """0xA3 was not taken yet: nothing is parked, and its lines wait as those of any lost sender."""
    started(grbl, "M3S1000\nG1X10F600\n", 0.5, "$75=0.1")
    grbl.after(0.5, "!")
    grbl.put(PARK + "M3S500\n$J=G91X-50F600\n")
    grbl.lose_sender()
    assert grbl.after(3) == "[MSG:Sender lost: feed hold]\r\n"
    assert grbl.state() == "Hold:0" and grbl.outputs().spindle_direction == 0
    at = grbl.position()
    assert grbl.after(1) == "" and grbl.position() == at
