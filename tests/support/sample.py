"""A sample of the cases of each test, for `make test`: of a test with many parameters a few, from all of them."""

from __future__ import annotations

import zlib
from collections import defaultdict
from collections.abc import Iterable


def sampled(names: Iterable[str], most: int) -> set[str]:
    """Of each test's cases at most so many: the first one, and others by a checksum of their name, so that a case
    that comes or goes changes no more than one.
    """
    cases: dict[str, list[str]] = defaultdict(list)
    for name in names:
        cases[name.partition("[")[0]].append(name)
    found = set()
    for first, *others in cases.values():
        others.sort(key=lambda name: zlib.crc32(name.encode()))
        found.update([first, *others[: most - 1]])
    return found
