"""Samples of the cases of each test, for `make test` and CI: of a test with many parameters some, from all of them."""

from __future__ import annotations

import zlib
from collections import defaultdict
from collections.abc import Iterable

import pytest


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


class CasesOfCi:
    """Marks as deep what is beyond so many cases of a test that says so: @pytest.mark.alike(6).

    A plugin: its hook comes behind those of folders, which mark cases of their own, and before -m, which looks at the
    markers.
    """

    def pytest_collection_modifyitems(self, items: list[pytest.Item]) -> None:
        tests: dict[int, list[pytest.Item]] = defaultdict(list)
        for item in items:
            marked = item.get_closest_marker("alike")
            if marked and item.get_closest_marker("deep") is None:
                tests[marked.args[0]].append(item)
        for most, cases in tests.items():
            kept = sampled([item.nodeid for item in cases], most)
            for item in cases:
                if item.nodeid not in kept:
                    item.add_marker(pytest.mark.deep)
