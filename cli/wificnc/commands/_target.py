"""What every command that talks to a controller has in common."""

from __future__ import annotations

import functools
from collections.abc import Callable
from typing import Any, TypeVar

import rich_click as click

from wificnc.connection.access import KEY_VARIABLE
from wificnc.connection.client import Target
from wificnc.connection.port import BOARD_PORT, SERVE_PORT

FunctionT = TypeVar("FunctionT", bound=Callable[..., Any])

_to = click.option(
    "--to",
    "target",
    envvar="WIFICNC_TO",
    show_envvar=True,
    required=True,
    metavar="TARGET",
    help=f"The controller: [:KEY@]HOST[:PORT], or a serial port: /dev/ttyUSB0[?baud=115200], COM3. Without PORT: "
    f"{BOARD_PORT}, on this computer {SERVE_PORT}. tcp:// and serial:// may precede them.  "
    f"Without KEY: {KEY_VARIABLE} of the environment, which other users of this computer cannot read.",
)
_take = click.option("--take", is_flag=True, help="Take control from the client that is in control now.")


def target_option(function: FunctionT) -> FunctionT:
    """--to, for commands that look and listen: target is a str."""
    return _to(function)


def controller_option(function: Callable[..., None]) -> Callable[..., None]:
    """--to and --take, for commands that command: target is a Target."""

    @_to
    @_take
    @functools.wraps(function)
    def with_target(*arguments: Any, target: str, take: bool, **options: Any) -> None:
        function(*arguments, target=Target(target, take), **options)

    return with_target


json_option = click.option("--json", "as_json", is_flag=True, help="One JSON document on stdout.")


def position_json(position: tuple[float, ...]) -> dict[str, float]:
    """{"X": 1.0, …}"""
    return dict(zip("XYZABC", position, strict=False))
