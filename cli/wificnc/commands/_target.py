"""What every command that talks to a controller has in common."""

from __future__ import annotations

import json
from collections.abc import Callable
from typing import Any, TypeVar

import rich_click as click

FunctionT = TypeVar("FunctionT", bound=Callable[..., Any])

target_option = click.option(
    "--to",
    "target",
    envvar="WIFICNC_TO",
    show_envvar=True,
    required=True,
    metavar="TARGET",
    help="The controller: tcp://HOST[:2323] or serial:///dev/ttyUSB0[?baud=115200].",
)
json_option = click.option("--json", "as_json", is_flag=True, help="One JSON document on stdout.")


def position_json(position: tuple[float, ...]) -> dict[str, float]:
    """{"X": 1.0, …}"""
    return dict(zip("XYZABC", position, strict=False))


def compact(value: Any) -> str:
    return json.dumps(value, ensure_ascii=False)
