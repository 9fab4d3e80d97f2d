"""The command line: the root group, the lazily loaded commands, and the one error boundary."""

from __future__ import annotations

import importlib
import os
import sys
from typing import Any

import rich_click as click

from wificnc import __version__, ui
from wificnc.errors import Exit, UserError

# name -> (module under wificnc.commands, short help); a module is imported only when its command runs or shows help.
COMMANDS: dict[str, tuple[str, str]] = {
    "boards": ("boards", "List, show and check boards."),
    "pins": ("pins", "Generate pin_config.h of a board."),
    "page": ("page", "Generate page_files.h, with which a firmware carries the page."),
    "build": ("build", "Build the firmware of a board, or the host controller."),
    "flash": ("flash", "Write the firmware to a board, by USB or over the network."),
    "nvs": ("nvs", "Make, write, read and compare what an ESP32 has stored."),
    "wifi": ("wifi", "Let a board join a WiFi network."),
    "discover": ("discover", "Find controllers in this network."),
    "doctor": ("doctor", "Say what is missing here, and how to get it."),
    "sim": ("sim", "Run a G-code job through the real core in virtual time."),
    "check": ("check", "Check a G-code job before it runs, on the machine's own planner."),
    "expand": ("expand", "Write the plain lines that a program with O words executes."),
    "serve": ("serve", "Be a controller in real time, for any Grbl sender."),
    "send": ("send", "Stream a G-code job to a controller."),
    "status": ("status", "Show where a machine stands and what it does."),
    "jog": ("jog", "Move a machine by hand."),
    "home": ("home", "Find the machine's zero."),
    "probe": ("probe", "Move until the probe touches."),
    "unlock": ("unlock", "Leave an alarm."),
    "settings": ("settings", "Read, change, keep and compare settings."),
    "monitor": ("monitor", "Talk to a controller by hand."),
    "wmc3": ("wmc3", "Be a host of the binary protocol."),
    "release": ("release", "Make what people download, from what has been built."),
    "linuxcnc": ("linuxcnc", "Configure LinuxCNC for a controller."),
}


class LazyGroup(click.RichGroup):
    """A group that imports a command's module when it is needed, so that `--help` stays quick."""

    def list_commands(self, ctx: click.Context) -> list[str]:
        return list(COMMANDS)

    def get_command(self, ctx: click.Context, cmd_name: str) -> click.Command | None:
        if cmd_name not in COMMANDS:
            return None
        module = importlib.import_module(f"wificnc.commands.{COMMANDS[cmd_name][0]}")
        command: click.Command = module.command
        command.name = cmd_name
        command.short_help = COMMANDS[cmd_name][1]
        return command


@click.group(cls=LazyGroup, context_settings={"help_option_names": ["-h", "--help"], "max_content_width": 100})
@click.version_option(__version__, prog_name="wificnc")
def root() -> None:
    """WiFiCNC turns a US$5 board into a CNC motion controller."""


def main(argv: list[str] | None = None) -> Any:
    """Console entry. A UserError prints its message and hint and ends with its exit code; so does a file that cannot be
    read or written. Any other error is a bug, and shows where."""
    ui.use_plain_characters()
    try:
        return root.main(args=argv, prog_name="wificnc", standalone_mode=True)
    except UserError as err:
        ui.error(err)
        sys.exit(err.exit_code)
    except BrokenPipeError:
        sys.exit(Exit.OK)
    except OSError as err:
        if err.filename is None:
            raise
        ui.error(UserError(f"{os.fsdecode(err.filename)}: {err.strerror}"))
        sys.exit(Exit.USAGE)
