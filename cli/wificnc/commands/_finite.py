"""Numbers as options have them: Python reads `nan` and `inf`, too, and `nan` passes every limit."""

from __future__ import annotations

import math
from typing import Any

import rich_click as click
from click.types import FloatParamType


class _Finite(FloatParamType):
    def convert(self, value: Any, param: click.Parameter | None, ctx: click.Context | None) -> Any:
        number = super().convert(value, param, ctx)
        return number if math.isfinite(number) else self.fail(f"{value!r} is not a finite number.", param, ctx)


class FiniteRange(_Finite, click.FloatRange):
    """A number within limits."""


class _FiniteFloat(_Finite):
    """Any number."""


FINITE = _FiniteFloat()
