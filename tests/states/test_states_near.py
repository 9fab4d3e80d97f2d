"""Two inputs within 5 ms: two switches or buttons, or one of them and a real-time byte, in every situation.

The second one comes before the first has settled, so the controller may see it as if it had come first. What must not
be: anything that neither order leads to, a stop that is lost next to a resume, a reset or a report, or a find of the
monitor.
"""

from __future__ import annotations

import copy
import os
from collections.abc import Iterator

import pytest
from generate.states_table import Input, load_states
from grbl_host import Grbl
from slow import deep_but
from state_machine import PULSE_S, SITUATIONS, Pair, answers
from state_model import Model

TABLE = load_states()
PINS = [entry.name for entry in TABLE.input if entry.pin]
BYTES = [entry.name for entry in TABLE.input if entry.bytes]
PAIRS = [
    *((a, b) for a in PINS for b in PINS if TABLE.inputs[a].pin != TABLE.inputs[b].pin),
    *((a, b) for a in PINS for b in BYTES),
    *((b, a) for a in PINS for b in BYTES),
]
GAPS_S = (0.0, 0.001, 0.0049)
RESUMES = {"resume_byte", "start_button"}
HOLDS = {"hold_byte", "hold_button"}
STOPS = HOLDS | {"cancel_byte", "door_byte", "door_opens"}
HOLDS_AGAIN = STOPS | {"park_byte", "spindle_stop_byte"}
SHARDS = 180  # of the pairs; one runs in CI, three in the night, all with WIFICNC_STATES=all
ALL = os.environ.get("WIFICNC_STATES") == "all"


def act(grbl: Grbl, entry: Input, on: bool) -> None:
    """A byte and a switch that stays come once, a button is pressed and let go."""
    if entry.bytes and on:
        grbl.put(chr(next(entry.all_bytes())))
    elif entry.level is not None and on:
        grbl.input(entry.pin, entry.level)
    elif entry.pin and entry.level is None:
        grbl.input(entry.pin, on)


def together(pair: Pair, first: str, second: str, gap_s: float) -> str:
    """Returns what was answered."""
    grbl, one, two = pair.grbl, TABLE.inputs[first], TABLE.inputs[second]
    said = ""
    for entry, on, wait_s in ((one, True, gap_s), (two, True, PULSE_S), (one, False, gap_s), (two, False, 0)):
        act(grbl, entry, on)
        said += grbl.after(wait_s)
    return said + grbl.after(pair.settled_s)


def restores(start: Model, name: str) -> bool:
    """A resume that brings spindle and coolant back before anything moves."""
    return name in RESUMES and start.rule(name).outputs == "restored"


def takes_back(start: Model, hold: str, resume: str, gap_s: float) -> bool:
    """In the same moment the stop counts and the resume does not. Until the tools are back the machine is held as
    before: a stop then stops them again, 0xA3 parks, 0x9E stops the spindle, and another resume is needed
    (docs/states.md, door_closed)."""
    if hold in STOPS and resume in RESUMES and gap_s == 0:
        return True
    return hold in HOLDS_AGAIN and restores(start, resume)


def orders(start: Model, first: str, second: str, gap_s: float) -> Iterator[tuple[str, ...]]:
    """What it may look like, as it came first. A hold is never lost next to a resume; two holds may be one."""
    yield first, second
    if not (first in RESUMES and second in HOLDS):
        yield second, first
    if {first, second} <= HOLDS:
        yield (first,)
    for resume, hold in ((first, second), (second, first)):
        if takes_back(start, hold, resume, gap_s):
            yield (hold,)


def expected(start: Model, names: tuple[str, ...]) -> tuple[Model, list[str]]:
    model, answered = copy.deepcopy(start), []
    for name in names:
        answered += model.apply(name).answers
    return model, answered


def check(situation: str, first: str, second: str, gap_s: float) -> None:
    pair = Pair(TABLE)
    pair.reach(situation)
    start, finds = pair.model, []
    said = together(pair, first, second, gap_s)
    for names in orders(start, first, second, gap_s):
        pair.model, answered = expected(start, names)
        where = f"{situation}: {first}, {gap_s * 1000:g} ms, {second}, as {' > '.join(names)}: said {said!r}"
        try:
            assert answers(said) == answered, f"{where}, not {answered}"
            pair.compare(where)
        except AssertionError as find:
            finds.append(str(find))
            continue
        pair.close()
        return
    raise AssertionError("\n".join(finds))


@pytest.mark.alike(16)
@pytest.mark.slow
@pytest.mark.parametrize("shard", deep_but((0).__eq__, range(SHARDS if ALL else 3)))
@pytest.mark.parametrize("situation", SITUATIONS)
def test_two_inputs_within_5_ms(situation: str, shard: int) -> None:
    for number, (first, second) in enumerate(PAIRS):
        for turn, gap_s in enumerate(GAPS_S):
            if (number * len(GAPS_S) + turn + list(SITUATIONS).index(situation)) % SHARDS == shard:
                check(situation, first, second, gap_s)


@pytest.mark.alike(12)
@pytest.mark.parametrize("gap_s", GAPS_S)
@pytest.mark.parametrize("hold", sorted(HOLDS))
@pytest.mark.parametrize("resume", sorted(RESUMES))
@pytest.mark.parametrize("situation", ["hold, move", "lost, move", "door_closed, move", "host_hold", "returned"])
def test_a_hold_after_a_resume_holds(situation: str, resume: str, hold: str, gap_s: float) -> None:
    """Also while spindle and coolant are restored. Two buttons in the same moment: it holds."""
    pair = Pair(TABLE)
    pair.reach(situation)
    report = pair.shown()
    together(pair, resume, hold, gap_s)
    assert pair.shown() in ("Hold:0", report)
    at = pair.grbl.stands()
    pair.grbl.after(10)
    assert pair.grbl.stands() == at
    pair.close()


def test_resume_and_hold_in_one_look_of_the_controller() -> None:
    """In a stalled task both wait for the same look: the newer one decides."""
    stops = ("!", "\x85", "\x84", "\x18")
    both = [(f"~{stop}", False) for stop in stops] + [(f"{stop}~", stop in "!\x85") for stop in stops]
    for bytes_, moves in (*both, ("~!~", True), ("!~!", False), ("\x85~\x85", False), ("~\xa3", False)):
        pair = Pair(TABLE)
        pair.reach("hold, move")
        pair.grbl.put(bytes_)
        pair.grbl.after(1)
        at = pair.grbl.stands()
        pair.grbl.after(1)
        assert (pair.grbl.stands() != at) == moves, bytes_
        pair.close()


@pytest.mark.alike(8)
@pytest.mark.parametrize("stop", sorted(STOPS - {"door_opens"}))
@pytest.mark.parametrize("situation", ["lost, move", "door_closed, move"])
def test_a_stop_while_the_tools_come_back_holds(situation: str, stop: str) -> None:
    """The spindle runs up for 4 s: what a resume has begun is taken back, and the next one leads on."""
    pair = Pair(TABLE)
    pair.reach(situation)
    at, entry = pair.grbl.stands(), TABLE.inputs[stop]
    pair.grbl.after(1, "~")
    act(pair.grbl, entry, True)
    pair.grbl.after(PULSE_S)
    act(pair.grbl, entry, False)
    pair.grbl.after(20)
    assert pair.grbl.stands() == at and pair.shown() in ("Hold:0", "Door:0")
    assert pair.outputs() == (False, 0)
    pair.grbl.after(10, "~")
    assert pair.grbl.stands() != at and pair.outputs() == (True, 2)
    pair.close()
