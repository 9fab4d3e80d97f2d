"""A pin of a board file, and how it is used."""

from __future__ import annotations

from typing import Annotated, Any, ClassVar

from pydantic import Field, model_validator

from wificnc.board.chip import Level, Pull, Strict
from wificnc.files.values import Text

Reason = Annotated[Text, Field(min_length=10)]


class Wire(Strict):
    """A pin and how it is used. In the file also just its name: step = "GPIO1"."""

    written_as: ClassVar[str] = 'a pin in quotes, like "GPIO4", or a table like { pin = "GPIO4" }'

    pin: str = Field(description="the pin as the chip's table names it")
    allow: dict[str, Reason] = Field(
        default={}, description="rules this use may break, each with the reason why it is safe"
    )

    @model_validator(mode="before")
    @classmethod
    def _from_name(cls, value: Any) -> Any:
        return {"pin": value} if isinstance(value, str) else value


class OutputWire(Wire):
    """A pin the board drives."""

    active: Level = Field(default="high", description="the level that switches the thing on")


class InputWire(Wire):
    """A pin the board reads."""

    active: Level = Field(default="low", description="the level that means triggered")
    pull: Pull = Field(default="up", description="the chip's own pull resistor")
