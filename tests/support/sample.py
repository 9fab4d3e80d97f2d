"""Samples of the cases of each test, for CI: of a test with many parameters some, from all of them; and slices of what
that leaves out."""

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
    """Marks as deep what is beyond so many cases of a test that says so: @pytest.mark.alike(6); and in the ring core
    what is marked as slow.

    A plugin: its hook comes behind those of folders, which mark cases of their own, and of the rings, and before -m,
    which looks at the markers.
    """

    def pytest_collection_modifyitems(self, items: list[pytest.Item]) -> None:
        tests: dict[int, list[pytest.Item]] = defaultdict(list)
        for item in items:
            if all(map(item.get_closest_marker, ("slow", "core"))):
                item.add_marker(pytest.mark.deep)
            marked = item.get_closest_marker("alike")
            if marked and item.get_closest_marker("deep") is None:
                tests[marked.args[0]].append(item)
        for most, cases in tests.items():
            kept = sampled([item.nodeid for item in cases], most)
            for item in cases:
                if item.nodeid not in kept:
                    item.add_marker(pytest.mark.deep)


def part_of(text: str) -> tuple[int, int]:
    """Of K/N: part K of N. Raises ValueError."""
    part, count = map(int, text.split("/"))
    if not 0 <= part < count:
        raise ValueError(f"a part of {count} is 0 to {count - 1}, not {part}")
    return part, count


# Files whose tests do more, or are more, with WIFICNC_ON_CHIP=all.
MORE_ON_CHIP = ("test_pic32mz_power_cut_commands.py", "test_states_on_chip.py")


def is_left_out(item: pytest.Item) -> bool:
    """CI runs this case in a slice alone, or with less."""
    parameters = getattr(item, "callspec", None)
    on_chip = parameters is not None and "chip" in parameters.params.values()
    return on_chip or item.path.name in MORE_ON_CHIP or any(map(item.get_closest_marker, ("deep", "hypothesis")))


class Slice:
    """Leaves one part of what CI leaves out, by a checksum of the cases' names: deep ones, those in the virtual chip,
    and tests of hypothesis, which the command gives another seed. A plugin; its hook comes behind CasesOfCi's."""

    def __init__(self, part: int, count: int) -> None:
        self.part, self.count = part, count

    def is_in(self, name: str) -> bool:
        return zlib.crc32(name.encode()) % self.count == self.part

    @pytest.hookimpl(trylast=True)
    def pytest_collection_modifyitems(self, config: pytest.Config, items: list[pytest.Item]) -> None:
        kept = {item.nodeid for item in items if is_left_out(item) and self.is_in(item.nodeid)}
        config.hook.pytest_deselected(items=[item for item in items if item.nodeid not in kept])
        items[:] = [item for item in items if item.nodeid in kept]
