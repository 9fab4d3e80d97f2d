"""What waits for the end of motion, or interrupts it, while sides of the firmware stall.

Outputs, offsets and dwells come exactly where the program has them; a hold, the door, a jog cancel and overrides keep
the limits and the path; nothing hangs.
"""

from __future__ import annotations

import random
import re

import numpy as np
import pytest
import stalls
from grbl_host import HZ, Grbl
from stalled import ANSWER, SMOOTH, SPM, assert_legal, recorded, until_answered, ways


def machine(late: str, rng: random.Random, count: int = 80, smooth: dict[str, float] | None = None) -> Grbl:
    grbl = recorded(**smooth or {})
    grbl.record_outputs()
    grbl.stall_often(rng, stalls.LATE[late], count)
    return grbl


def settle(grbl: Grbl, most_s: float = 200) -> None:
    end_s = grbl.time() + most_s
    while "Idle" not in grbl.after(0.5, "?"):
        assert grbl.time() < end_s, "it does not come to rest"


def places_of_changes(grbl: Grbl) -> list[list[int]]:
    """Where it was whenever spindle or coolant changed."""
    t, way = ways(grbl)
    at = np.searchsorted(t, grbl.output_changes()["t"], side="right")
    return [way[n - 1].tolist() for n in at[1:]]


@pytest.mark.parametrize("feed", [120, 600, 4000])
@pytest.mark.parametrize("late", stalls.LATE)
@pytest.mark.parametrize("seed", stalls.seeds(4))
def test_outputs_come_where_the_program_has_them(seed: int, late: str, feed: int) -> None:
    rng = random.Random(f"{seed} {late} {feed}")
    grbl = machine(late, rng, smooth=rng.choice(SMOOTH))
    x, y, z = (rng.randrange(1, 2500) / SPM for _ in range(3))
    lines = [f"G1F{feed}X{x:.3f}", "M3S1000", f"Y{y:.3f}", "M8", f"G2X0Y0R{max(x, y):.3f}", "M5", f"G0Z{z:.3f}", "M9"]
    lines += ["G4P0.05", f"G1X{x:.3f}", "M3", "G0X0Y0", "M5"]
    assert until_answered(grbl, "\n".join(lines) + "\n", len(lines)).count("ok\r\n") == len(lines)
    settle(grbl)
    x, y, z = (round(mm * SPM) for mm in (x, y, z))
    assert places_of_changes(grbl) == [[x, 0, 0], [x, y, 0], [0, 0, 0], [0, 0, z], [x, 0, z], [0, 0, z]]
    assert_legal(grbl)
    grbl.close()


@pytest.mark.parametrize("late", stalls.LATE)
@pytest.mark.parametrize("seed", stalls.seeds(4))
def test_dwells_last_at_least_as_long_as_they_should(seed: int, late: str) -> None:
    rng = random.Random(f"{seed} {late}")
    grbl = machine(late, rng)
    dwell_s = rng.choice([0.03, 0.2, 1.1])
    until_answered(grbl, f"G1X2F600\nG4P{dwell_s}\nX4\nG4P{dwell_s}\nX1\n", 5)
    settle(grbl)
    t, way = ways(grbl)
    for place in (2 * SPM, 4 * SPM):
        there = int(np.argmax(way[:, 0] == place))
        assert (t[there + 1] - t[there]) / HZ >= dwell_s
    assert_legal(grbl)
    grbl.close()


@pytest.mark.parametrize("late", stalls.LATE)
@pytest.mark.parametrize("seed", stalls.seeds(4))
def test_offsets_count_from_where_the_program_has_them(seed: int, late: str) -> None:
    """G92, G10 L20 and a tool length between moves that are under way."""
    rng = random.Random(f"{seed} {late}")
    grbl = machine(late, rng)
    length = rng.randrange(1, 500) / SPM
    lines = [f"G1X5F{rng.choice([300, 3000])}", "G92X0", "X5", "G92.1", "X1", "G10L20P1X0", "X2", f"G43.1Z{length:.3f}"]
    lines += ["Z0", "G49", "G0Z1", "G10L20P1Z0", "G1Z1"]
    assert until_answered(grbl, "\n".join(lines) + "\n", len(lines)).count("ok\r\n") == len(lines)
    settle(grbl)
    _, way = ways(grbl)
    turns = [way[n].tolist() for n in range(len(way) - 1) if (way[n + 1] - way[n] != way[n] - way[n - 1]).any()]
    assert way[:, 0].max() == 10 * SPM and [10 * SPM, 0, 0] in turns
    assert way[-1].tolist() == [3 * SPM, 0, 2 * SPM] == grbl.position()[:3]
    # Its corner is rounded by up to $11.
    assert np.abs(way - [3 * SPM, 0, round(length * SPM)]).max(axis=1).min() <= 0.01 * SPM
    assert_legal(grbl)
    grbl.close()


@pytest.mark.parametrize("late", stalls.LATE)
@pytest.mark.parametrize("seed", stalls.seeds(8))
def test_jogs_are_cancelled(seed: int, late: str) -> None:
    """Also some in a row, cancelled at any time; what is left of them never moves."""
    rng = random.Random(f"{seed} {late}")
    grbl = machine(late, rng, smooth=rng.choice(SMOOTH))
    said, sent = "", 0
    for _ in range(6):
        count = rng.choice([1, 1, 3])
        axis, way = rng.choice("XYZ"), rng.choice([-1, 1]) * rng.choice([0.4, 5, 200])
        grbl.put(f"$J=G91{axis}{way}F{rng.choice([200, 5000])}\n" * count)
        sent += count
        said += grbl.after(rng.uniform(0.0, 1.0))
        said += grbl.after(rng.choice([0.0, 0.01, 1.5]), rng.choice(["\x85", "!"]))
        grbl.put("~")  # `!` is a hold where nothing jogs
    until_answered(grbl, "\x85~", sent - len(ANSWER.findall(said)))  # a stop takes back the ~ before it
    settle(grbl)
    at = grbl.position()
    grbl.after(30)
    assert grbl.position() == at
    assert_legal(grbl)
    assert "ok" in until_answered(grbl, "G90G1X0Y0Z0F5000\n")
    settle(grbl)
    assert grbl.stands()[:3] == [0, 0, 0], "its position is known to the step"
    assert_legal(grbl)
    grbl.close()


INTERRUPTIONS = ["!", "~", "!~", "\x84", "\x91", "\x92\x92", "\x90", "\x97", "\x95", "\x9e", "door", "\x99", "?"]


@pytest.mark.alike(8)
@pytest.mark.parametrize("smooth", [{}, SMOOTH[1], SMOOTH[2]], ids=["as fast as can be", "jerk", "shapers"])
@pytest.mark.parametrize("late", stalls.LATE)
@pytest.mark.parametrize("seed", stalls.seeds(8))
def test_a_job_that_is_interrupted_ends_where_it_should(seed: int, late: str, smooth: dict[str, float]) -> None:
    rng = random.Random(f"{seed} {late} {smooth}")
    grbl = machine(late, rng, smooth=smooth)
    lines = ["M3S1000", "G1X20F3000", "Y20", "G2X0Y0R20", "G0X5Z1", "G4P0.1", "M8", "G1X30Y3F600", "X0Y0Z0F4000", "M5"]
    grbl.put("\n".join(lines) + "\n")
    said = ""
    for _ in range(16):
        said += grbl.after(rng.expovariate(4))
        what = rng.choice(INTERRUPTIONS)
        if what == "door":
            grbl.input("door", True)
            said += grbl.after(rng.choice([0.002, 0.3, 2]))
            grbl.input("door", False)
        else:
            grbl.put(what)
    end_s = grbl.time() + 200
    while not ("<Idle" in said and len(re.findall(r"^ok\r$", said, re.MULTILINE)) == len(lines)):
        assert grbl.time() < end_s, said
        said = said.replace("<Idle", "") + grbl.after(0.7, "~?")
    _, way = ways(grbl)
    assert way[-1].tolist() == [0, 0, 0] and grbl.outputs().spindle_direction == 0
    assert_legal(grbl)
    assert way.min() >= -1 - 250 and "error" not in said and "ALARM" not in said
    grbl.close()
