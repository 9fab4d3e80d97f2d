"""Values of files that their types alone would let through: empty texts and lists, the same thing twice, true for 1."""

from __future__ import annotations

from collections.abc import Callable, Hashable, Sequence
from typing import Annotated, Any, TypeVar

from pydantic import AfterValidator, BeforeValidator

ItemsT = TypeVar("ItemsT", bound=Sequence[Any])


def _one_line(text: str) -> str:
    if not text.strip():
        raise ValueError("must not be empty")
    if text != text.strip():
        raise ValueError("must not begin or end with a blank")
    if not text.isprintable():
        raise ValueError("must be one line of printable characters")
    return text


def _whole(value: Any) -> Any:
    if isinstance(value, bool | float):  # Python takes true and 1.0 for 1
        raise ValueError("must be a whole number")
    return value


def _not_empty(items: ItemsT) -> ItemsT:
    if not items:
        raise ValueError("is an empty list: give it a value, or leave the key out")
    return items


Text = Annotated[str, AfterValidator(_one_line)]  # for people, or a name
WholeChoice = BeforeValidator(_whole)  # next to Literal[1, 2]
not_empty = AfterValidator(_not_empty)


def distinct(name: Callable[[Any], Hashable] = lambda item: item) -> AfterValidator:
    """A list that has something, and nothing twice. @param name  what of an item must be its own"""

    def check(items: ItemsT) -> ItemsT:
        names = [name(item) for item in _not_empty(items)]
        if twice := [each for each in names if names.count(each) > 1]:
            raise ValueError(f"has {' '.join(map(str, twice[0])) if isinstance(twice[0], tuple) else twice[0]} twice")
        return items

    return AfterValidator(check)
