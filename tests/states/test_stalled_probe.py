"""Probes of the text side while sides of the firmware stall: the contact is exact, and nothing pushes on after it."""

from __future__ import annotations

import random
import re

import numpy as np
import pytest
import stalls
from grbl_host import Grbl
from numpy.typing import NDArray
from stalled import COMMITTED_S, SMOOTH, SPM, assert_legal, recorded, stop_steps, until_answered, ways

LOOK_S = 0.02


def contact(said: str) -> tuple[list[int], int]:
    found = re.search(r"\[PRB:([-\d.,]+):([01])\]", said)
    assert found, said
    return [round(float(mm) * SPM) for mm in found[1].split(",")], int(found[2])


def z_way(grbl: Grbl) -> NDArray[np.int64]:
    return ways(grbl)[1][:, 2]


@pytest.mark.parametrize("feed", [50, 300, 1200, 4000])
@pytest.mark.parametrize("kind", stalls.LATE)
@pytest.mark.parametrize("seed", stalls.seeds(6))
def test_the_contact_is_exact_and_nothing_pushes_on(seed: int, kind: str, feed: int) -> None:
    rng = random.Random(f"{seed} {kind} {feed}")
    grbl = recorded()
    speed = feed / 60 * SPM
    surface = -rng.randrange(1, round(min(4000, 3 * speed)))
    grbl.surface(surface)
    grbl.stall_often(rng, stalls.LATE[kind], 60)
    slant = rng.choice(["", "X7Y-3"])
    said = until_answered(grbl, f"G38.{rng.choice([2, 3])}Z{surface / SPM - 30:.3f}{slant}F{feed}\n", look_s=LOOK_S)
    assert said.count("ok\r\n") == 1
    (_, _, z, *_), found = contact(said)
    assert (z, found) == (surface, 1)
    stops = grbl.position()[2]
    assert grbl.position() == grbl.stands()
    assert surface - stops <= stop_steps(speed)
    grbl.after(20)
    assert grbl.position()[2] == stops == grbl.stands()[2]
    assert z_way(grbl).min() == stops, "never deeper"
    assert_legal(grbl)
    answer = until_answered(grbl, "G91G0Z5\n", look_s=LOOK_S) + until_answered(grbl, "G90\n", look_s=LOOK_S)
    assert answer.count("ok\r\n") == 2
    grbl.after(20)
    assert grbl.position()[2] == grbl.stands()[2] == stops + 5 * SPM, "away from where it really is"
    grbl.close()


@pytest.mark.parametrize("kind", stalls.LATE)
@pytest.mark.parametrize("seed", stalls.seeds(8))
def test_the_loss_of_contact(seed: int, kind: str) -> None:
    rng = random.Random(f"{seed} {kind}")
    grbl = recorded()
    leaves, feed = rng.randrange(1, 500), rng.choice([50, 300, 1200])
    grbl.surface(leaves - 1)
    grbl.stall_often(rng, stalls.LATE[kind], 60)
    said = until_answered(grbl, f"G38.{rng.choice([4, 5])}Z20F{feed}\n", look_s=LOOK_S)
    (_, _, z, *_), found = contact(said)
    assert (z, found) == (leaves, 1)
    speed = feed / 60 * SPM
    assert grbl.position()[2] - leaves <= stop_steps(speed)
    assert grbl.position() == grbl.stands()
    grbl.close()


@pytest.mark.parametrize("probe", [2, 3])
@pytest.mark.parametrize("kind", stalls.LATE)
@pytest.mark.parametrize("seed", stalls.seeds(6))
def test_a_miss_goes_all_the_way(seed: int, kind: str, probe: int) -> None:
    """Alarm 5 and [PRB:...:0] come when the way is done, not at a stop on the way."""
    rng = random.Random(f"{seed} {kind} {probe}")
    grbl = recorded()
    way_mm = rng.randrange(1, 3000) / 250
    grbl.stall_often(rng, stalls.LATE[kind], 60)
    said = until_answered(grbl, f"G38.{probe}Z-{way_mm:.3f}F{rng.choice([120, 300, 1200, 4000])}\n", look_s=LOOK_S)
    assert ("ALARM:5" in said) == (probe == 2)
    assert grbl.stands()[2] == grbl.position()[2] == -round(way_mm * SPM)
    grbl.close()


@pytest.mark.parametrize("command", ["!~", "\x84~"])
@pytest.mark.parametrize("kind", stalls.LATE)
@pytest.mark.parametrize("seed", stalls.seeds(6))
def test_a_hold_on_the_way_changes_nothing(seed: int, kind: str, command: str) -> None:
    rng = random.Random(f"{seed} {kind} {command}")
    grbl = recorded(**SMOOTH[seed % 4])
    surface = -rng.randrange(300, 3000)
    grbl.surface(surface)
    grbl.stall_often(rng, stalls.LATE[kind], 80)
    said = grbl.after(rng.uniform(0.05, 3), "G38.2Z-30F300\n")
    said += grbl.after(rng.choice([0, 0.003, 0.5]), command[0])
    end_s = grbl.time() + 120
    while "ok\r\n" not in said:  # a hold that is not complete yet does not resume
        assert grbl.time() < end_s, f"hangs: {said}"
        said += grbl.after(0.5, command[1])
    (_, _, z, *_), found = contact(said)
    assert (z, found) == (surface, 1)
    assert z_way(grbl).min() == grbl.position()[2] == grbl.stands()[2]
    assert surface - grbl.position()[2] <= 1250 * (COMMITTED_S + (0.1 if seed & 1 else 0)) + 10
    assert_legal(grbl)
    grbl.close()


@pytest.mark.parametrize("kind", stalls.LATE)
@pytest.mark.parametrize("seed", stalls.seeds(6))
def test_lines_after_a_probe_use_what_was_found(seed: int, kind: str) -> None:
    """The work zero set at the contact is the contact, whatever was late: G92, G10 L20 and #5063 agree."""
    rng = random.Random(f"{seed} {kind}")
    grbl = recorded()
    surface = -rng.randrange(20, 1500)
    grbl.surface(surface)
    grbl.stall_often(rng, stalls.LATE[kind], 80)
    program = ["G38.2Z-30F600", "#1=#5063", "G0Z0", "G10L20P1Z[0-#1]", "G1Z0F1500", "M3S100", "G0Z2", "M5"]
    said = "".join(until_answered(grbl, line + "\n", look_s=LOOK_S) for line in program)
    assert said.count("ok\r\n") == len(program), said
    way = z_way(grbl)
    assert way[-1] == surface + 2 * SPM == grbl.position()[2]
    grbl.close()
