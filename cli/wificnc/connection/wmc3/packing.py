"""Payloads as bytes and back."""

from __future__ import annotations

import re
import struct
from dataclasses import fields
from functools import cache
from typing import Any, ClassVar, TypeVar

LayoutT = TypeVar("LayoutT", bound="Layout")


@cache
def _parts(layout: str) -> tuple[tuple[str, int], ...]:
    """Code and count of each field; reserved bytes are none."""
    found = re.findall(r"(\d*)([A-Za-z])", layout)
    return tuple((code, int(count or 1)) for count, code in found if code != "x")


class Layout:
    """A payload. Subclasses are dataclasses whose fields stand in the order of FORMAT."""

    TYPE: ClassVar[int] = 0
    FORMAT: ClassVar[str] = "<"

    @classmethod
    def size(cls) -> int:
        """Bytes."""
        return struct.calcsize(cls.FORMAT)

    def pack(self) -> bytes:
        """Raises struct.error when a number does not fit its field."""
        values: list[Any] = []
        for field, (code, count) in zip(fields(self), _parts(self.FORMAT), strict=True):  # type: ignore[arg-type]
            value = getattr(self, field.name)
            if code == "s":
                values.append(value.encode()[:count])
            elif count > 1:
                if len(value) != count:
                    raise struct.error(f"{field.name} has {len(value)} values instead of {count}")
                values.extend(value)
            else:
                values.append(value)
        return struct.pack(self.FORMAT, *values)

    @classmethod
    def unpack(cls: type[LayoutT], payload: bytes) -> LayoutT:
        """From the begin of a payload; more bytes may follow. Raises struct.error when it is too short."""
        values = list(struct.unpack_from(cls.FORMAT, payload))
        arguments: list[Any] = []
        for code, count in _parts(cls.FORMAT):
            if code == "s":
                arguments.append(values.pop(0).split(b"\0")[0].decode(errors="replace"))
            elif count > 1:
                several = [values.pop(0) for _ in range(count)]
                arguments.append(bytes(several) if code == "B" else tuple(several))
            else:
                arguments.append(values.pop(0))
        return cls(*arguments)
