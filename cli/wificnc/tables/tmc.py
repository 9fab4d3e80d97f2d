"""protocol/tmc.toml as Python objects: the motor drivers with registers, and what current their resistors allow."""

from __future__ import annotations

import math
import sys
from functools import lru_cache

from pydantic import BaseModel, ConfigDict, Field

from wificnc.files.paths import ROOT

if sys.version_info >= (3, 11):
    import tomllib
else:
    import tomli as tomllib  # type: ignore[import-not-found, unused-ignore]

TMC_PATH = ROOT / "protocol" / "tmc.toml"


class _Strict(BaseModel):
    model_config = ConfigDict(extra="forbid", frozen=True, strict=True)


class TmcChip(_Strict):
    """A kind of driver."""

    kind: str = Field(pattern=r"^tmc\d+$")
    title: str
    sense_mohm: int = Field(ge=10, le=1000)
    sense_more_mohm: int = Field(ge=0, le=255)
    full_mv: int = Field(ge=1, le=65535)
    fine_mv: int = Field(ge=0, le=65535)
    source: str

    def current_max_ma(self, sense_mohm: int) -> int:
        """The most current that this sense resistor allows, mA rms, as $DRIVERS prints it: I = V / (R sqrt 2)."""
        return int(1000 * self.full_mv / ((sense_mohm + self.sense_more_mohm) * math.sqrt(2)))


class TmcTable(_Strict):
    chip: tuple[TmcChip, ...] = Field(min_length=1, strict=False)

    def number(self, kind: str) -> int:
        """enum tmc_kind of core/drivers/tmc_chips_gen.h. Raises ValueError when there is none of this kind."""
        return [row.kind for row in self.chip].index(kind) + 1

    def of(self, kind: str) -> TmcChip:
        """Raises ValueError when there is none of this kind."""
        return self.chip[self.number(kind) - 1]


def parse_tmcs(text: str) -> TmcTable:
    """The table from TOML text. Raises ValueError (TOML syntax, pydantic) when the table itself is wrong."""
    return TmcTable.model_validate(tomllib.loads(text))


@lru_cache(maxsize=1)
def load_tmcs() -> TmcTable:
    """The table of this WiFiCNC."""
    return parse_tmcs(TMC_PATH.read_text(encoding="utf-8"))
