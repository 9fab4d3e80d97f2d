"""The command line: the root group, the lazily loaded commands, and the one error boundary."""

from __future__ import annotations

import errno
import importlib
import os
import sys
import traceback
from contextlib import suppress
from difflib import get_close_matches
from typing import Any, NoReturn

import rich_click as click

from wificnc import __version__, ui
from wificnc.errors import Exit, UserError

# group of the help -> name -> (module under wificnc.commands, short help); a module is imported only when its command
# runs or shows help.
GROUPS: dict[str, dict[str, tuple[str, str]]] = {
    "Machine": {
        "discover": ("discover", "Find controllers on the network."),
        "login": ("login", "Let this computer's programs command a controller in the network."),
        "status": ("status", "Show position and state, and why the machine is locked or held."),
        "home": ("home", "Run the homing cycle."),
        "unlock": ("unlock", "End an alarm without homing."),
        "jog": ("jog", "Jog the machine."),
        "probe": ("probe", "Move until the probe touches."),
        "settings": ("settings", "Read, change, export, import and compare settings."),
        "drivers": ("drivers", "Show the motor drivers with registers, and change their settings."),
        "tune": ("tune", "Choose an input shaper against the vibration of the frame."),
        "monitor": ("monitor", "Open a terminal to a controller."),
        "serve": ("serve", "Run a simulated controller in real time, for any Grbl sender."),
    },
    "Job": {
        "demo": ("demo", "Run a job that comes with WiFiCNC, and draw it."),
        "check": ("check", "Check a G-code job before it runs, on the machine's own planner."),
        "sim": ("sim", "Run a G-code job through the real core in virtual time."),
        "send": ("send", "Stream a G-code job to a controller."),
        "expand": ("expand", "Expand a program with O words to plain G-code lines."),
    },
    "Board": {
        "boards": ("boards", "List, show and check boards."),
        "flash": ("flash", "Write the firmware to a board, by USB or over the network."),
        "wifi": ("wifi", "Connect a board to a WiFi network."),
        "nvs": ("nvs", "Make, write, read and compare the storage of an ESP32."),
    },
    "Firmware": {
        "build": ("build", "Build the firmware of a board, or the simulator."),
        "release": ("release", "Make a release from what has been built."),
        "dev": ("dev", "What the builds call: headers made from a board, the page and a key."),
        "doctor": ("doctor", "Check this computer's tools and ports, and how to install what is missing."),
    },
    "Protocol": {
        "wmc3": ("wmc3", "Control a device by the binary protocol (WMC3)."),
        "linuxcnc": ("linuxcnc", "Configure LinuxCNC for a controller."),
    },
}
# Of what is written: the disk, or the user's part of it, is full or fails.
NO_ROOM = (errno.ENOSPC, errno.EDQUOT, errno.EFBIG, errno.EIO, errno.EROFS)
COMMANDS = {name: command for group in GROUPS.values() for name, command in group.items()}


Resolved = tuple[str | None, click.Command | None, list[str]]


class LazyGroup(click.RichGroup):
    """A group that imports a command's module when it is needed, so that `--help` stays quick."""

    def list_commands(self, ctx: click.Context) -> list[str]:
        return list(COMMANDS)

    def resolve_command(self, ctx: click.Context, args: list[str]) -> Resolved:
        """With the name that may be meant."""
        close = get_close_matches(args[0].lower(), COMMANDS, n=1)
        if args[0] not in COMMANDS and close and not args[0].startswith("-"):
            ctx.fail(f"No such command {args[0]!r}. Did you mean {close[0]!r}?")
        return super().resolve_command(ctx, args)

    def get_command(self, ctx: click.Context, cmd_name: str) -> click.Command | None:
        if cmd_name not in COMMANDS:
            return None
        module = importlib.import_module(f"wificnc.commands.{COMMANDS[cmd_name][0]}")
        command: click.Command = module.command
        importlib.import_module("wificnc.commands._output").keep_inputs(command)
        command.name = cmd_name
        command.short_help = COMMANDS[cmd_name][1]
        return command


@click.group(cls=LazyGroup, context_settings={"help_option_names": ["-h", "--help"], "max_content_width": 100})
@click.version_option(__version__, prog_name="wificnc")
@click.rich_config(
    help_config={
        "command_groups": {"wificnc": [{"name": name, "commands": list(shown)} for name, shown in GROUPS.items()]}
    }
)
def root() -> None:
    """WiFiCNC turns a US$5 board into a CNC motion controller."""


def main(argv: list[str] | None = None) -> Any:
    """Console entry. A UserError prints its message and hint and ends with its exit code; so does a file that cannot be
    read or written, and a full disk. Any other error is a bug, and shows where."""
    ui.use_plain_characters()
    try:
        try:
            return root.main(args=argv, prog_name="wificnc", standalone_mode=True)
        finally:
            ui.flush()
    except UserError as err:
        _end(err)
    except BrokenPipeError:
        ui.drop_output()
        sys.exit(Exit.OK)
    except Exception as err:
        if isinstance(err, OSError) and (why := _why_no_file(err)):
            _end(UserError(why))
        with suppress(OSError):
            traceback.print_exc()
        _end(UserError("internal error of wificnc", hint="please report it with the text above"), Exit.BUG)


def _why_no_file(err: OSError) -> str:
    """ "": it is about no file or disk."""
    if err.filename is not None:
        return f"{os.fsdecode(err.filename)}: {err.strerror}"
    return f"cannot write the output: {err.strerror}" if err.errno in NO_ROOM else ""


def _end(err: UserError, code: Exit | None = None) -> NoReturn:
    """Also where neither stdout nor stderr can be written."""
    with suppress(OSError):
        ui.error(err)
    ui.drop_output()
    sys.exit(err.exit_code if code is None else code)
