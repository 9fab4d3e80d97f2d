"""Pass 1, the shape of a file: pydantic finds every fault, and this module says it in the file's own words."""

from __future__ import annotations

import difflib
import types
import typing
from collections.abc import Iterable, Sequence
from typing import Annotated, Any, TypeVar, Union

from pydantic import BaseModel, ValidationError
from pydantic_core import ErrorDetails

from wificnc.files.problem import FileProblems, Finding, KeyPath, Problem, key_text
from wificnc.files.tomlfile import TomlFile

_SCALARS = (str, int, float, bool)
_IN_TOML = {  # pydantic's words are Python's; by its kinds of errors
    "dict_type": "must be a table",
    "tuple_type": "must be a list in brackets",
    "list_type": "must be a list in brackets",
    "string_type": "must be text in quotes",
    "int_type": "must be a whole number",
    "int_parsing": "must be a whole number",
    "int_from_float": "must be a whole number",
    "bool_type": "must be true or false",
    "bool_parsing": "must be true or false",
}

ModelT = TypeVar("ModelT", bound=BaseModel)


def validate(model: type[ModelT], source: TomlFile) -> ModelT:
    """Build the model from the file.

    Raises:
        FileProblems: the file lacks the model's shape; every fault with its line.
    """
    try:
        return model.model_validate(source.data)
    except ValidationError as err:
        raise FileProblems(locate(_findings(model, err.errors()), source)) from err


def locate(findings: Iterable[Finding], source: TomlFile) -> list[Problem]:
    """Give every finding its file and line, in the order of the file."""
    problems = [
        Problem(source.path, source.line(found.path), found.rule, key_text(found.path), found.reason, found.hint)
        for found in findings
    ]
    return by_line(problems)


def by_line(problems: Iterable[Problem]) -> list[Problem]:
    return sorted(problems, key=lambda problem: problem.line)


def closest(word: str, known: Iterable[str]) -> str | None:
    """The known word this one was probably meant to be."""
    matches = difflib.get_close_matches(word, list(known), n=1, cutoff=0.6)
    return matches[0] if matches else None


def _findings(model: type[BaseModel], errors: Sequence[ErrorDetails]) -> list[Finding]:
    unknown = [error["loc"] for error in errors if error["type"] == "extra_forbidden"]
    missing = {error["loc"] for error in errors if error["type"] == "missing"}
    found = [_unknown_key(model, loc, missing) for loc in unknown]
    found += [_missing_key(loc) for loc in sorted(missing, key=str)]
    others = [error for error in errors if error["type"] not in ("extra_forbidden", "missing")]
    return found + [_bad_value(model, error) for error in others]


def _unknown_key(model: type[BaseModel], loc: KeyPath, missing: set[KeyPath]) -> Finding:
    """A misspelt key also leaves its right spelling missing: say it once."""
    known = _keys_at(model, loc[:-1])
    meant = closest(str(loc[-1]), known)
    if meant is None:
        return Finding("unknown-key", loc, "unknown key", f"known here: {', '.join(known)}")
    missing.discard((*loc[:-1], meant))
    return Finding("unknown-key", loc, "unknown key", f"did you mean {meant}?")


def _missing_key(loc: KeyPath) -> Finding:
    return Finding("missing-key", loc, "is required and missing")


def _bad_value(model: type[BaseModel], error: ErrorDetails) -> Finding:
    reason = error["msg"].replace("Input should be", "must be").removeprefix("Value error, ")
    if error["type"] == "model_type":
        reason = f"must be {_written_as(model, error['loc'])}"
    reason = _IN_TOML.get(error["type"], reason)
    given = error["input"]
    shown = repr(given).lower() if isinstance(given, bool) else repr(given)
    return Finding("bad-value", error["loc"], f"{reason}, not {shown}" if isinstance(given, _SCALARS) else reason)


def _written_as(model: type[BaseModel], loc: KeyPath) -> str:
    """What belongs at this place of a file, as its model says it."""
    here: Any = model
    for part in loc:
        here = step_type(here, part)
    return str(getattr(here, "written_as", "a table"))


def _keys_at(model: type[BaseModel], loc: KeyPath) -> list[str]:
    """The keys the model knows at this place."""
    here: Any = model
    for part in loc:
        here = step_type(here, part)
    if isinstance(here, type) and issubclass(here, BaseModel):
        return [field.alias or name for name, field in here.model_fields.items()]
    return []


def step_type(annotation: Any, part: str | int) -> Any:
    """The type of one key or element inside a type."""
    if isinstance(annotation, type) and issubclass(annotation, BaseModel):
        names = {field.alias or name: field.annotation for name, field in annotation.model_fields.items()}
        return bare_type(names.get(str(part)))
    arguments = typing.get_args(annotation)
    return bare_type(arguments[-1 if isinstance(part, str) else 0]) if arguments else None


def bare_type(annotation: Any) -> Any:
    """Without Annotated[...] and `| None`."""
    while typing.get_origin(annotation) is Annotated:
        annotation = typing.get_args(annotation)[0]
    if typing.get_origin(annotation) in (Union, types.UnionType):
        return bare_type(next(part for part in typing.get_args(annotation) if part is not type(None)))
    return annotation
