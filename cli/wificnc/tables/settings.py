"""protocol/settings.toml as Python objects: every setting with its number, unit, range and default."""

from __future__ import annotations

import re
import struct
import sys
from functools import lru_cache
from itertools import pairwise
from typing import Annotated, Any, Literal, get_args

from pydantic import BaseModel, ConfigDict, Field, model_validator

from wificnc.files.paths import ROOT

if sys.version_info >= (3, 11):
    import tomllib
else:
    import tomli as tomllib  # type: ignore[import-not-found, unused-ignore]

AXES = "XYZABC"  # core/base/axis.h

SETTINGS_PATH = ROOT / "protocol" / "settings.toml"

INTEGER_MAX = {"bool": 1, "u8": 0xFF, "u16": 0xFFFF}
NVS_KEY_MAX = 15  # characters, ESP-IDF's NVS_KEY_NAME_MAX_SIZE - 1


class _Strict(BaseModel):
    model_config = ConfigDict(extra="forbid", frozen=True, strict=True, allow_inf_nan=False)


# How a wire value follows from a setting's: core/session/config.c has the arithmetic.
Convert = Literal[
    "value",
    "magnitude",
    "mask_any",
    "mask_none",
    "mask_flip",
    "idle_ms",
    "steps",
    "steps_s",
    "steps_s2",
    "dir_setup",
    "quarter",
    "pwm_hz",
]


# What follows from a setting, in the order of the bits of enum setting_effect; protocol/settings.toml says what each
# one is.
Effect = Literal[
    "motion", "position", "program", "outputs", "signals", "motors", "switches", "homing", "reports", "host", "drivers"
]
EFFECTS: tuple[str, ...] = get_args(Effect)


class Wire(_Strict):
    """Where the binary protocol finds a setting (for axis X), and how it differs from `$N` there."""

    key: Annotated[int, Field(ge=1, le=0xFFFF)]
    type: Literal["u8", "u16", "u32", "i32", "float"]
    unit: str = ""  # "" = the setting's own
    convert: Annotated[Convert, Field(alias="as")] = "value"
    note: str = ""


class Choice(_Strict):
    """One value of a setting that chooses among kinds; the first one is 0. So far only kinematics has any."""

    name: Annotated[str, Field(pattern=r"^[a-z][a-z0-9_]*$")]
    words: str
    motors: Annotated[tuple[str, str], Field(strict=False)]  # what those of X and Y move
    curved: bool = False


class Setting(_Strict):
    """One row of the table. `number` and `name` stand for six settings when `per_axis` is set."""

    number: Annotated[int, Field(ge=0, le=999)]
    name: Annotated[str, Field(pattern=r"^[a-z][a-z0-9_]*$")]
    type: Literal["bool", "u8", "u16", "float"]
    unit: str
    default: bool | int | float
    min: int | float = 0
    max: int | float = 1
    decimals: Annotated[int, Field(ge=0, le=6)] = 0
    per_axis: bool = False
    below: Annotated[str, Field(pattern=r"^[A-Z_]+$")] = "BAD_NUMBER"
    reboot: bool = False
    help: Annotated[str, Field(min_length=1, max_length=95)]
    affects: Annotated[tuple[Effect, ...], Field(min_length=1, strict=False)]
    nvs: Annotated[str, Field(min_length=1)]
    wire: Wire | None = None
    choice: Annotated[tuple[Choice, ...], Field(strict=False)] = ()

    @model_validator(mode="before")
    @classmethod
    def _with_choices(cls, data: dict[str, Any]) -> dict[str, Any]:
        """Their number is the range, their words are part of the help."""
        choices = data.get("choice", ())
        if not choices or "max" in data:
            return data
        words = ", ".join(f"{value} {choice['words']}" for value, choice in enumerate(choices))
        return {**data, "max": len(choices) - 1, "help": f"{data['help']}: {words}."}

    @model_validator(mode="after")
    def _consistent(self) -> Setting:
        if not 0 <= self.min < self.max:
            raise ValueError("min must be 0 or more, and less than max")
        if not self.min <= self.default <= self.max:
            raise ValueError("the default is out of range")
        if isinstance(self.default, bool) != (self.type == "bool"):
            raise ValueError("only a bool has true or false as its default")
        if self.type == "float":
            self._check_float()
        elif self.max > INTEGER_MAX[self.type]:
            raise ValueError(f"max does not fit {self.type}")
        if len(self.nvs.format(axis="x")) > NVS_KEY_MAX:
            raise ValueError(f"the nvs key is longer than {NVS_KEY_MAX} characters")
        return self

    def _check_float(self) -> None:
        """The core compares with single-precision limits: max must not move when it is rounded."""
        if struct.unpack("<f", struct.pack("<f", self.max))[0] != self.max:
            raise ValueError("max is not a single-precision number")

    @property
    def c_name(self) -> str:
        """Of its number in C; of axis X's in a per-axis row."""
        return f"SETTING_{self.name.upper()}"

    @property
    def count(self) -> int:
        """Settings in this row."""
        return len(AXES) if self.per_axis else 1

    def text(self, value: bool | int | float) -> str:
        """A value as `$$` prints it."""
        return f"{value:.{self.decimals}f}" if self.type == "float" else str(int(value))


class SettingsTable(_Strict):
    """The whole table, in ascending order of numbers."""

    schema_: Annotated[Literal[1], Field(alias="schema")]
    setting: tuple[Setting, ...] = Field(strict=False)

    @model_validator(mode="after")
    def _ordered(self) -> SettingsTable:
        for low, high in pairwise(self.setting):
            if high.number < low.number + low.count:
                raise ValueError(f"${high.number} {high.name} must come after ${low.number} {low.name}")
        if len({row.name for row in self.setting}) < len(self.setting):
            raise ValueError("two settings have the same name")
        keys = [row.nvs.format(axis=axis) for row in self.setting for axis in ("xyzabc" if row.per_axis else "x")]
        if again := sorted({key for key in keys if keys.count(key) > 1}):
            raise ValueError(f"two settings have the same nvs key: {', '.join(again)}")
        return self

    def __getitem__(self, name: str) -> Setting:
        """The row of a name. Raises KeyError for a name that the table does not have."""
        for row in self.setting:
            if row.name == name:
                return row
        raise KeyError(name)


def parse_settings(text: str) -> SettingsTable:
    """The table from TOML text. Raises ValueError (TOML syntax, pydantic) when the table itself is wrong."""
    return SettingsTable.model_validate(tomllib.loads(text))


@lru_cache(maxsize=1)
def load_settings() -> SettingsTable:
    """The table of this WiFiCNC."""
    return parse_settings(SETTINGS_PATH.read_text(encoding="utf-8"))


def status_codes(header: str) -> dict[str, int]:
    """Grbl's answers as core/gcode/status.h has them: name -> number."""
    return {name: int(number) for number, name in re.findall(r"\bX\((\d+), ([A-Z_]+),", header)}
