"""A gantry in random order: skews, pull-offs, directions, one switch or two, task periods and stalls of each chip, and
what stops homing at random moments. Afterwards both motors make the same steps, and homing is square to the step."""

from __future__ import annotations

import random

import pytest
from grbl_host import Grbl
from wificnc.simulator.library import HostBoard, Tasks

HIGH, LOW, STEPS_PER_MM = 1007, -10003, 250
Y, GANGED, SECOND_LIMIT = 1, 2, 1 << 6 + 1
INPUTS = ("estop", "reset", "door", "hold")
GLITCHES = ("limit-max-y", "second-max-y", "second-min-y")
LINES = ("!", "~", "\x18", "\x85", "\x84", "\x90", "G0X1\n", "$X\n", "$SLP\n", "$H\n", "$206=0\n")


def interrupt(gantry: Grbl, rng: random.Random) -> None:
    what = rng.choice((*INPUTS, *GLITCHES, *LINES))
    if what in LINES:
        gantry.after(rng.uniform(0, 1), what)
        return
    gantry.input(what, True)
    gantry.after(rng.uniform(0, 0.003 if what in GLITCHES else 0.5))
    gantry.input(what, False)
    gantry.after(rng.uniform(0, 0.5))


def bring_back(gantry: Grbl) -> None:
    gantry.send("~\x18")
    gantry.after(0.6)  # after an alarm a reset needs this time
    gantry.send("\x18")
    gantry.send("$X\n")


def stand(gantry: Grbl) -> tuple[int, int]:
    return gantry.stands()[Y], gantry.second_stands()[Y]


@pytest.mark.slow
@pytest.mark.parametrize("seed", range(40))
def test_a_gantry_is_square_after_whatever_stopped_it(seed: int) -> None:
    rng = random.Random(seed)
    one_switch, by_board, to_min = rng.random() < 0.3, rng.random() < 0.5, rng.random() < 0.5
    own_mm, second_mm = rng.choice([0.3, 1, 2]), rng.choice([0.5, 1, 3, 4])
    switchless = SECOND_LIMIT if one_switch and by_board else 0
    tasks = rng.choice(list(Tasks))
    gantry = Grbl(board=HostBoard(20_000_000, 1000, 500, 500_000, 3, GANGED, switchless=switchless, tasks=tasks))
    gantry.send("")
    gantry.settings(
        s111=5000, s121=500, s131=100, s22=1, s23=GANGED * to_min, s24=100, s25=rng.choice([800, 2000, 5000])
    )
    gantry.settings(s26=rng.choice([0, 5, 25]), s27=own_mm, s44=2, s45=0, s201=second_mm)
    gantry.travel(Y, LOW, HIGH)
    gantry.send("$X\n")
    if rng.random() < 0.4:
        gantry.stall_randomly(seed=seed)
    for _ in range(2):
        gantry.place([0, rng.randint(LOW + 200, HIGH - 200), 0, 0, 0, 0])
        gantry.skew(Y, 0 if one_switch else rng.randint(-1100, 1100))
        gantry.settings(s206=GANGED * (one_switch and not by_board))
        gantry.after(rng.uniform(0, 5), "$HY\n")
        for _ in range(rng.randint(1, 3)):
            interrupt(gantry, rng)
        bring_back(gantry)
        gantry.settings(s206=GANGED * (one_switch and not by_board))
        before = stand(gantry)
        gantry.fine("G91G0Y-1", "G90")
        assert [now - then for now, then in zip(stand(gantry), before, strict=True)] == [-STEPS_PER_MM] * 2
        gantry.place([0] * 6)
        gantry.skew(Y, 0 if one_switch else rng.randint(-900, 900))
        said = gantry.send("$HY\n")
        assert "ALARM" not in said and "error" not in said, said
        ends = [(LOW + back if to_min else HIGH - back) for back in (own_mm * STEPS_PER_MM, second_mm * STEPS_PER_MM)]
        assert stand(gantry)[0] == ends[0]
        if not one_switch:
            assert stand(gantry)[1] == ends[1]
    gantry.after(0.1)
    gantry.close()
