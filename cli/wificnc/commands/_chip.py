"""`--on-chip [IMAGE]` of the commands that run a board's real image, and whether the virtual chips are installed.

They are another package, wificnc-chips (emulators/), which is imported only when a command needs it.
"""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import TypeVar

import rich_click as click

from wificnc import __version__
from wificnc.errors import UserError
from wificnc.files import paths

INSTALL = "pip install 'wificnc[chips]'"
INSTALL_IN_CHECKOUT = "pip install -e emulators"

F = TypeVar("F", bound=Callable[..., object])


def on_chip_option(what: str) -> Callable[[F], F]:
    """None: not on a chip; "": the image that was built. docs/espsim.md."""
    return click.option(
        "--on-chip",
        is_flag=False,
        flag_value="",
        default=None,
        metavar="[IMAGE]",
        help=f"{what} IMAGE: a folder of `wificnc build`, a merged image or an application; without: what was built.",
    )


def chip_image(value: str) -> Path | None:
    """Raises nothing: what is not there is refused by who reads it."""
    return Path(value) if value else None


def require_chips(what: str) -> None:
    """Raises UserError unless the virtual chips are installed, of this version. @param what  needs them"""
    install = INSTALL_IN_CHECKOUT if paths.IS_CHECKOUT else INSTALL
    try:
        import wificnc_chips
    except ModuleNotFoundError as err:
        if err.name != "wificnc_chips":
            raise
        raise UserError(f"{what} needs the virtual chips: {install}") from err
    if wificnc_chips.__version__ != __version__:
        found = f"the virtual chips are of version {wificnc_chips.__version__}, and wificnc is {__version__}"
        raise UserError(found, hint=f"{install} --upgrade")
