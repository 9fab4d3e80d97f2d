"""The comparison with LinuxCNC finds what differs; it needs no LinuxCNC."""

from __future__ import annotations

from dataclasses import replace

import pytest
from canon import Call
from compare import check_same

HERE = (1.0, 2.0, 0.0, 0.0, 0.0, 0.0)
CALLS = [
    Call("rapid", HERE),
    Call("feed", (5.0, *HERE[1:]), feed=100.0),
    Call("arc", HERE, feed=100.0, center=(3.0, 2.0), turns=1),
    Call("dwell", seconds=0.5),
]


def test_the_same_calls_are_the_same() -> None:
    check_same(CALLS, CALLS)


@pytest.mark.parametrize(
    ("at", "change"),
    [
        (0, {"what": "feed"}),
        (1, {"target": (5.01, *HERE[1:])}),
        (1, {"feed": 101.0}),
        (2, {"center": (3.0, 2.01)}),
        (2, {"turns": -1}),
        (2, {"plane": (2, 0, 1)}),
        (3, {"seconds": 0.6}),
    ],
)
def test_a_call_that_differs_is_found(at: int, change: dict[str, object]) -> None:
    theirs = [*CALLS[:at], replace(CALLS[at], **change), *CALLS[at + 1 :]]  # type: ignore[arg-type]
    with pytest.raises(AssertionError, match=f"call {at}:"):
        check_same(CALLS, theirs)


def test_a_call_that_only_one_makes_is_found() -> None:
    with pytest.raises(AssertionError, match="one more"):
        check_same([*CALLS, Call("rapid", HERE)], CALLS)
    with pytest.raises(AssertionError, match="call 3:"):
        check_same(CALLS[:-1], CALLS)
