"""Words beyond Grbl on the running controller: cycles, tool change, tool table, switches, outputs. Virtual time."""

from __future__ import annotations

import re
from pathlib import Path

import pytest
from generate.codes import codes
from grbl_host import Grbl

STEPS_MM = 250
ROOT = Path(__file__).parents[2]


def mm(grbl: Grbl) -> list[float]:
    return [steps / STEPS_MM for steps in grbl.position()[:3]]


def run_out(grbl: Grbl, *lines: str, seconds: float = 60) -> None:
    """All of them answered ok, and everything done."""
    for line in lines:
        assert grbl.after(seconds, line + "\n") == "ok\r\n", line
    assert grbl.state() == "Idle"


# -- canned cycles


def test_a_cycle_drills_and_returns(grbl: Grbl) -> None:
    run_out(grbl, "F600", "G0Z3", "G99G83X4Y5Z-2R1Q1.5")
    assert mm(grbl) == [4, 5, 1]
    run_out(grbl, "G98X6")
    assert mm(grbl) == [6, 5, 3]
    assert grbl.after(1, "$G\n").startswith("[GC:G83 G54 ")


def test_the_bottom_is_really_reached(grbl: Grbl) -> None:
    """A probe surface just at the bottom touches; half a step above it does not."""
    grbl.fine("F60", "G0Z3")
    grbl.surface(round(-2 * STEPS_MM))
    grbl.put("G81X1Z-2R1\n")
    grbl.after(2.8)  # 3 mm at 1 mm/s
    seen = [grbl.after(0.002, "?") for _ in range(400)]
    touched = [report for report in seen if "Pn:P" in report]
    assert touched and all(",-2.000|" in report or ",-1.99" in report for report in touched[:1])
    assert "Idle" in seen[-1]


def test_a_dwell_at_the_bottom_takes_its_time(grbl: Grbl) -> None:
    def seconds(line: str) -> float:
        start = grbl.time()
        grbl.put(line + "\n")
        while grbl.state() != "Idle" or grbl.time() == start:
            grbl.after(0.01)
        return grbl.time() - start

    grbl.fine("F600")
    seconds("G82X0Z-2R1P0")
    without = seconds("G82X0Z-2R1P0")
    assert seconds("G82X0Z-2R1P2.5") - without == pytest.approx(2.5, abs=0.05)


def test_g86_stops_the_spindle_on_the_way_out(grbl: Grbl) -> None:
    grbl.fine("F600", "M4S500", "G0Z2")
    grbl.put("G86X1Z-1R1P0.2\n")
    seen = []
    for _ in range(400):
        grbl.after(0.01)
        seen.append((grbl.outputs().spindle_direction, mm(grbl)[2]))
    stopped = [z for direction, z in seen if direction == 0]
    assert stopped and min(stopped) == -1 and max(stopped) > 1
    assert seen[0][0] == -1 and seen[-1] == (-1, 2)


def test_a_hold_inside_a_cycle(grbl: Grbl) -> None:
    grbl.fine("F300", "G0Z2")
    grbl.put("G91G83X1Z-3R-1Q1L3\n")
    grbl.after(2, "!")
    grbl.after(1)
    assert grbl.state() == "Hold:0"
    stands = mm(grbl)
    grbl.after(5)
    assert mm(grbl) == stands
    grbl.after(60, "~")
    assert (grbl.state(), mm(grbl)) == ("Idle", [3, 0, 2])


def test_soft_limits_see_the_bottom_before_anything_moves(grbl: Grbl) -> None:
    grbl.put("$22=1\n$20=1\n$130=100\n$131=100\n$132=50\n")
    grbl.after(1)
    grbl.fine("F600", "G90G0X-10Y-10Z-10")
    grbl.after(10)
    before = mm(grbl)
    assert "ALARM:2" in grbl.after(2, "G81X-20Z-60R-5\n")
    assert mm(grbl) == before


def test_a_cycle_in_check_mode(grbl: Grbl) -> None:
    grbl.after(0.1, "$C\n")
    grbl.fine("F600", "M3S10", "G86X1Z-1R1P100L5")
    assert (grbl.state(), mm(grbl)) == ("Check", [0, 0, 0])


# -- tool change


def test_m6_waits_for_the_operator(grbl: Grbl) -> None:
    """Motion finishes, spindle and coolant go off, Hold; ~ continues with what else is in the line."""
    grbl.fine("F600", "M3S500", "M8")
    grbl.put("G1X1\nT3M6M4\n")
    assert grbl.after(0.05) == "ok\r\n"
    assert (grbl.state(), grbl.outputs().spindle_direction) == ("Run", 1), "the move comes first"
    assert grbl.after(5) == "[MSG:Tool change: T3]\r\n", "its ok comes when it is done"
    assert (grbl.state(), mm(grbl)[0]) == ("Hold:0", 1)
    assert (grbl.outputs().spindle_direction, grbl.outputs().coolant) == (0, 0)
    grbl.after(5, "G0X0\n")
    assert mm(grbl)[0] == 1, "the next line waits"
    assert grbl.after(5, "~").count("ok\r\n") >= 2
    assert (grbl.state(), mm(grbl)[0], grbl.outputs().spindle_direction) == ("Idle", 0, -1)
    assert " M4 M9 T3 " in grbl.after(0.1, "$G\n")


def test_a_reset_ends_the_tool_change(grbl: Grbl) -> None:
    grbl.after(1, "T1M6\n")
    said = grbl.after(1, "\x18")
    assert "Grbl 1.1h" in said and grbl.state() == "Idle"
    assert " T0 " in grbl.after(0.1, "$G\n")


def test_m6_in_check_mode_goes_on(grbl: Grbl) -> None:
    grbl.after(0.1, "$C\n")
    grbl.fine("T1M6")


# -- tool table and coordinate systems


def test_tool_table_and_more_systems_are_kept(tmp_path: Path) -> None:
    store = tmp_path / "store"
    first = Grbl(store=store)
    first.send("")
    first.fine("G10L1P1Z12.5", "G10L1P96Z-3", "G10L2P7X1Y2Z3", "G10L2P1X9")
    first.close()
    second = Grbl(store=store)
    second.send("")
    listed = second.send("$#\n")
    second.fine("G59.1G43H1", "G0X0Y0Z0")
    second.after(10)
    assert mm(second) == [1, 2, 15.5]
    second.close()
    tools = ("[T:1|0.000,0.000,12.500|0.000]", "[T:96|0.000,0.000,-3.000|0.000]")
    for row in ("[G54:9.000,", "[G59.1:1.000,2.000,3.000]", *tools):
        assert row in listed


def test_without_them_the_list_is_grbls(grbl: Grbl) -> None:
    listed = grbl.send("$#\n")
    assert "G59.1" not in listed and "[T" not in listed.replace("[TLO", "")


def test_restore_clears_them(grbl: Grbl) -> None:
    grbl.fine("G10L1P1Z12.5", "G10L2P9X1")
    grbl.after(1, "$RST=#\n")
    listed = grbl.send("$#\n")
    assert "G59.3" not in listed and "[T:" not in listed


def test_g59_3_in_the_modes(grbl: Grbl) -> None:
    grbl.fine("G59.3")
    assert " G59.3 " in grbl.send("$G\n")


# -- override switches


def speed(grbl: Grbl) -> float:
    return float(grbl.status().split("|FS:")[1].split(",")[0])


def test_m49_switches_feed_and_spindle_overrides_off(grbl: Grbl) -> None:
    grbl.fine("M3S500", "F600")
    grbl.put("G1X50\nG1X51\nM49G1X100\nM48G1X150\n")
    grbl.after(1, "\x91\x91\x9a\x9a")
    assert (speed(grbl), grbl.outputs().spindle_rpm) == (pytest.approx(720, rel=0.01), pytest.approx(600))
    while mm(grbl)[0] < 60:
        grbl.after(0.5)
    assert (speed(grbl), grbl.outputs().spindle_rpm) == (pytest.approx(600, rel=0.01), pytest.approx(500))
    while mm(grbl)[0] < 110:
        grbl.after(0.5)
    assert (speed(grbl), grbl.outputs().spindle_rpm) == (pytest.approx(720, rel=0.01), pytest.approx(600))


def test_a_hold_waits_for_m53(grbl: Grbl) -> None:
    """With M53 P0 a hold comes as soon as M53 allows it, not in the moves between."""
    grbl.put("F600\nM53P0\nG1X10\nM53P1\nG1X20\n")
    grbl.after(0.3)
    grbl.after(5, "!")
    assert (grbl.state(), mm(grbl)[0]) == ("Hold:0", 10)
    grbl.after(5, "~")
    assert (grbl.state(), mm(grbl)[0]) == ("Idle", 20)


def test_a_reset_works_while_holds_wait(grbl: Grbl) -> None:
    grbl.put("F600\nM53P0\nG1X10\n")
    grbl.after(0.3)
    assert grbl.after(0.1, "!") == "" and grbl.state() == "Run"
    assert "ALARM:3" in grbl.after(0.5, "\x18")


# -- outputs


def test_m62_switches_when_motion_has_come_there(grbl: Grbl) -> None:
    grbl.put("F600\nG1X5\nM62P3\nG1X10\nM63P3\n")
    seen = []
    for _ in range(300):
        grbl.after(0.01)
        seen.append((grbl.outputs().digital, mm(grbl)[0]))
    on = [x for digital, x in seen if digital == 8]
    assert min(on) >= 5 and max(on) <= 10 and seen[-1] == (0, 10)
    assert all(x <= 5 for digital, x in seen[: seen.index((8, on[0]))])


def test_m64_switches_at_once(grbl: Grbl) -> None:
    grbl.put("F600\nG1X5\nM64P0\nM64P4\n")
    grbl.after(0.1)
    assert (grbl.outputs().digital, mm(grbl)[0] < 5) == (17, True)
    grbl.after(5, "M65P0\n")
    assert grbl.outputs().digital == 16
    grbl.after(1, "\x18")
    assert grbl.outputs().digital == 16, "a reset leaves a vacuum table on"


# -- arcs whose radii differ


def test_a_setting_bends_an_arc_to_its_end(grbl: Grbl) -> None:
    """$41, not $13: as far as it allows the arc ends exactly at the programmed point."""
    grbl.fine("F600")
    assert grbl.send("G2X10.5Y0I5\n") == "error:33\r\n"
    grbl.fine("$41=0.5")
    run_out(grbl, "G2X10.5Y0I5")
    assert mm(grbl) == [10.5, 0, 0]
    grbl.fine("$41=0.1")
    assert grbl.send("G2X20.5Y0I4.8\n") == "error:33\r\n"


# -- the table of codes


def test_the_extended_build_info_lists_every_code(grbl: Grbl) -> None:
    """`$I` is Grbl's; `$I+` adds [CAPS:] from the one table of codes."""
    plain = grbl.send("$I\n")
    extended = grbl.send("$I+\n")
    assert extended.startswith(plain.removesuffix("ok\r\n"))
    said = re.search(r"^\[CAPS:(.*)\]\r$", extended, re.MULTILINE)
    table = codes((ROOT / "core/gcode/codes.def").read_text(encoding="utf-8"))
    assert said and said[1].split(",") == [code.name for code in table]
    assert grbl.send("$I+1\n") == "error:3\r\n"


def test_a_code_that_is_not_in_the_table_is_refused(grbl: Grbl) -> None:
    """`an unsupported code is always error:20, never ignored` (error:23 for a fraction that Grbl refuses so)."""
    known = {code.name for code in codes((ROOT / "core/gcode/codes.def").read_text(encoding="utf-8"))}
    names = [f"{letter}{n}" for letter in "GM" for n in range(0, 210)] + [
        f"G{n}.{t}" for n in range(100) for t in (1, 9)
    ]
    for name in names:
        if name not in known:
            assert grbl.send(name + "\n") in ("error:20\r\n", "error:23\r\n"), name


# -- splines


def test_splines_are_driven_to_their_end(grbl: Grbl) -> None:
    run_out(grbl, "F600", "G5I0J3P0Q-3X10Y10", "G5P0Q-3X20Y20")
    assert mm(grbl) == [20, 20, 0]
    run_out(grbl, "G5.1X25Y20I2J5")
    assert mm(grbl) == [25, 20, 0]
    assert grbl.after(1, "$G\n").startswith("[GC:G5.1 G54 ")


def test_a_spline_knows_the_travel(grbl: Grbl) -> None:
    """Its end lies inside, its middle does not: soft limits see every chord."""
    grbl.put("$22=1\n$20=1\n$130=100\n$131=100\n$132=50\n")
    grbl.after(1)
    grbl.fine("F600", "G90G0X-10Y-10Z-10")
    grbl.after(10)
    assert "ALARM:2" in grbl.after(20, "G5X-20Y-10I0J40P0Q40\n")
