"""A file with faults in its shape, made whole by stand-ins: rules can look at the rest of it in the same run."""

from __future__ import annotations

import copy
import typing
from typing import Any, TypeVar

from annotated_types import Ge
from pydantic import BaseModel, ValidationError
from pydantic.fields import FieldInfo

from wificnc.files.problem import KeyPath
from wificnc.files.shape import bare_type, step_type

_ROUNDS_MAX = 20  # each goes one table deeper
STAND_IN = "?"

ModelT = TypeVar("ModelT", bound=BaseModel)


def repaired(model: type[ModelT], data: dict[str, Any]) -> tuple[ModelT | None, list[KeyPath]]:
    """@return  the model, None where no stand-in helps; and the places that have one or were left out"""
    data, places = copy.deepcopy(data), list[KeyPath]()
    for _ in range(_ROUNDS_MAX):
        try:
            return model.model_validate(data), places
        except ValidationError as err:
            for error in err.errors():
                places.append(error["loc"])
                _repair(model, data, error["loc"])
    return None, places


def concerns(path: KeyPath, places: list[KeyPath]) -> bool:
    """What is at this path, or around or below it, has a fault of its own."""
    return any(place[: len(path)] == path or path[: len(place)] == place for place in places)


def _repair(model: type[BaseModel], data: Any, loc: KeyPath) -> None:
    """A stand-in for what is required; else it is left out."""
    table: Any = data
    here: Any = model
    for part in loc[:-1]:
        if isinstance(table, dict) and part not in table:
            return  # left out meanwhile
        table, here = table[part], step_type(here, part)
    last = loc[-1]
    if isinstance(table, list):
        table[int(last)] = _stand_in(step_type(here, last), None)
        return
    if not isinstance(table, dict):
        return
    field = _field(here, str(last))
    if field is None or not field.is_required():
        table.pop(last, None)
    else:
        table[last] = _stand_in(bare_type(field.annotation), field)


def _field(model: Any, name: str) -> FieldInfo | None:
    if not (isinstance(model, type) and issubclass(model, BaseModel)):
        return None
    fields = model.model_fields
    return next((field for key, field in fields.items() if (field.alias or key) == name), None)


def _stand_in(kind: Any, field: FieldInfo | None) -> Any:
    if typing.get_origin(kind) is typing.Literal:
        return typing.get_args(kind)[0]
    if isinstance(kind, type) and issubclass(kind, BaseModel):
        return {"pin": STAND_IN} if "pin" in kind.model_fields else {}
    if kind is int:
        return next((bound.ge for bound in (field.metadata if field else ()) if isinstance(bound, Ge)), 0)
    if kind is str:
        return STAND_IN
    return [STAND_IN]
