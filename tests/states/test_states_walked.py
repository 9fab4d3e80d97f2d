"""Every cell of the table of states in a real controller, every pair of inputs from every state, and random triples."""

from __future__ import annotations

import os
from itertools import product

import pytest
from generate.states_table import load_states
from hypothesis import given, settings
from hypothesis import strategies as st
from slow import slow_but
from state_machine import SITUATIONS, Pair

TABLE = load_states()
INPUTS = sorted(TABLE.inputs)
SHARDS = 60  # of the pairs; one runs in `make test-deep`, all with WIFICNC_STATES=all
ALL = os.environ.get("WIFICNC_STATES") == "all"


def walk(situation: str, names: tuple[str, ...]) -> None:
    pair = Pair(TABLE)
    pair.reach(situation)
    for name in names:
        pair.step(name)
    pair.close()


@pytest.mark.parametrize("situation", slow_but(lambda name: "," not in name, SITUATIONS))
def test_every_cell(situation: str) -> None:
    """A find names its cell, and the other cells are walked all the same."""
    finds = []
    for name in INPUTS:
        try:
            walk(situation, (name,))
        except AssertionError as find:
            finds.append(f"{name}: {find}")
    assert finds == []


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
