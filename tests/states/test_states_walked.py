"""Every cell of the table of states in a real controller, every pair of inputs from every state, and random triples."""

from __future__ import annotations

import os
from itertools import product

import pytest
from generate.states_table import load_states
from hypothesis import given, settings
from hypothesis import strategies as st
from state_machine import SITUATIONS, Pair

TABLE = load_states()
INPUTS = sorted(entry.name for entry in TABLE.controllers)
SHARDS = 60  # of the pairs; one is deep, all with WIFICNC_STATES=all
SHARE = 3  # of the inputs, those of a situation of several
ALL = os.environ.get("WIFICNC_STATES") == "all"


def walk(situation: str, names: tuple[str, ...]) -> None:
    pair = Pair(TABLE)
    pair.reach(situation)
    for name in names:
        pair.step(name)
    pair.close()


def walk_cells(situation: str, names: list[str]) -> None:
    """A find names its cell, and the other cells are walked all the same."""
    finds = []
    for name in names:
        try:
            walk(situation, (name,))
        except AssertionError as find:
            finds.append(f"{name}: {find}")
    assert finds == []


def is_one_of_several(situation: str) -> bool:
    """Another way into the same state: "hold, M0" next to "hold, move"."""
    return "," in situation


def some_inputs(situation: str) -> list[str]:
    state, _, other = situation.partition(",")
    if not other:
        return INPUTS
    return INPUTS[[name for name in SITUATIONS if name.startswith(f"{state},")].index(situation) % SHARE :: SHARE]


@pytest.mark.parametrize("situation", SITUATIONS)
def test_every_cell(situation: str) -> None:
    """Of a state that has several situations, each cell in every third of them."""
    walk_cells(situation, some_inputs(situation))


def test_some_inputs_are_all_of_each_state() -> None:
    walked = {(situation.split(",")[0], name) for situation in SITUATIONS for name in some_inputs(situation)}
    assert walked == {(situation.split(",")[0], name) for situation in SITUATIONS for name in INPUTS}


@pytest.mark.deep
@pytest.mark.parametrize("situation", list(filter(is_one_of_several, SITUATIONS)))
def test_every_other_cell(situation: str) -> None:
    walk_cells(situation, [name for name in INPUTS if name not in some_inputs(situation)])


@pytest.mark.deep
@pytest.mark.parametrize("shard", range(SHARDS) if ALL else [0])
@pytest.mark.parametrize("situation", SITUATIONS)
def test_every_pair(situation: str, shard: int) -> None:
    """Each shard has every first and every second input of a state, in other combinations."""
    for number, (first, second) in enumerate(product(INPUTS, INPUTS)):
        if (number // len(INPUTS) + number) % SHARDS == shard:
            walk(situation, (first, second))


@pytest.mark.parametrize("onward", ["resume_byte", "start_button"])
@pytest.mark.parametrize("key", ["flood_byte", "mist_byte", "spindle_stop_byte"])
def test_what_the_operator_has_switched_stays_so(key: str, onward: str) -> None:
    """A job that waits after a host has moved gets its outputs back, but for those that were switched since."""
    walk("returned", (key, onward))
    walk("returned", (key, key, onward))


@settings(max_examples=2000 if ALL else 60)
@given(st.sampled_from(sorted(SITUATIONS)), st.lists(st.sampled_from(INPUTS), min_size=3, max_size=5))
def test_longer_ways(situation: str, names: list[str]) -> None:
    walk(situation, tuple(names))
