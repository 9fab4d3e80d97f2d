"""Two lists of calls are the same ones."""

from __future__ import annotations

from collections.abc import Sequence

from canon import Call

FEED_PART = 2e-6  # of a feed, ours being a float
BINARY = 1e-7  # mm: what binary fractions add


def same(ours: Call, theirs: Call) -> bool:
    """As far as theirs was printed."""
    near = theirs.tolerance + BINARY
    if (ours.what, ours.turns) != (theirs.what, theirs.turns) or len(ours.target) != len(theirs.target):
        return False
    if abs(ours.feed - theirs.feed) > near + FEED_PART * theirs.feed or abs(ours.seconds - theirs.seconds) > near:
        return False
    if ours.what == "arc" and ours.plane != theirs.plane:
        return False
    return _near((*ours.target, *ours.center), (*theirs.target, *theirs.center), near)


def check_same(ours: Sequence[Call], theirs: Sequence[Call]) -> None:
    """Says which call differs first. LinuxCNC may say again where it is, which is no move."""
    at = 0
    before = Call("rapid", (0.0,) * 6)
    for call in theirs:
        if at < len(ours) and same(ours[at], call):
            at += 1
        elif not _says_again(before, call):
            raise AssertionError(f"call {at}:\nours   {ours[at] if at < len(ours) else None}\ntheirs {call}")
        before = call if call.target else before
    assert at == len(ours), f"{at} calls there, and here one more: {ours[at]}"


def _says_again(before: Call, call: Call) -> bool:
    return call.what in ("rapid", "feed") and _near(before.target, call.target, before.tolerance + call.tolerance)


def _near(a: Sequence[float], b: Sequence[float], near: float) -> bool:
    return all(abs(one - other) <= near for one, other in zip(a, b, strict=True))
