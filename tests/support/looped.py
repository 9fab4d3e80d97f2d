"""Many values in one case, where each takes no time: pytest takes a millisecond for a case."""

from __future__ import annotations

import functools
import inspect
from collections.abc import Callable, Iterable
from typing import Any


def looped(
    name: str, values: Iterable[Any], label: Callable[[Any], str], **fresh: Callable[[Any], Any]
) -> Callable[[Callable[..., None]], Callable[..., None]]:
    """The test is run for each value as its argument `name`; all values that fail are named.

    @param fresh  argument of the test = what makes another one for each value; its own argument is a fixture's name
    """
    every = list(values)
    makers = {argument: (make, next(iter(inspect.signature(make).parameters))) for argument, make in fresh.items()}

    def decorate(test: Callable[..., None]) -> Callable[..., None]:
        @functools.wraps(test)
        def loop(**fixtures: Any) -> None:
            wrong = []
            for value in every:
                made = {argument: make(fixtures[fixture]) for argument, (make, fixture) in makers.items()}
                others = {known: fixtures[known] for known in wanted if known in fixtures}
                try:
                    test(**{name: value}, **others, **made)
                except AssertionError as err:
                    wrong.append(f"{label(value)}: {err}")
            assert not wrong, f"{len(wrong)} of {len(every)}\n" + "\n".join(wrong[:20])

        wanted = [known for known in inspect.signature(test).parameters if known != name and known not in makers]
        asked = dict.fromkeys([*wanted, *(fixture for _, fixture in makers.values())])
        kind = inspect.Parameter.KEYWORD_ONLY
        loop.__signature__ = inspect.Signature([inspect.Parameter(each, kind) for each in asked])
        return loop

    return decorate
