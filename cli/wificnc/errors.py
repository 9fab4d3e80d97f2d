"""Errors that the user can fix, each with its exit code. Anything else that escapes is a bug."""

from __future__ import annotations

from enum import IntEnum


class Exit(IntEnum):
    """Process exit codes; the only place where they are written."""

    OK = 0
    JOB = 1
    USAGE = 2
    BOARD = 3
    DEVICE = 4
    BUILD = 5
    FLASH = 6
    PROTOCOL = 7
    BUG = 70


# For the table in docs/errors.md.
EXIT_WORDS: dict[Exit, str] = {
    Exit.OK: "done, and nothing is wrong",
    Exit.JOB: "refused by the controller (an error, an alarm, a state in which it takes no commands, another client "
    "in control, an access key), or the job is wrong or was stopped; a comparison has found a difference, a search "
    "nothing",
    Exit.USAGE: "the command line, a file that it names, or a machine profile",
    Exit.BOARD: "a board file",
    Exit.DEVICE: "the link: the controller cannot be reached, does not answer, was reset or went away; "
    "a port or a device is missing",
    Exit.BUILD: "a compiler or a source is missing, a build or a release failed",
    Exit.FLASH: "a chip cannot be written or read",
    Exit.PROTOCOL: "the other end answers, but not as a controller does, or its answers match no line",
    Exit.BUG: "an error in this program, with a traceback: please report it",
}


class UserError(Exception):
    """What is wrong, and how to fix it."""

    exit_code: Exit = Exit.USAGE

    def __init__(self, message: str, hint: str | None = None) -> None:
        super().__init__(message)
        self.message = message
        self.hint = hint


class BoardError(UserError):
    """A board file is missing or breaks a rule."""

    exit_code = Exit.BOARD


class MachineError(UserError):
    """A machine profile is missing or breaks a rule."""

    exit_code = Exit.USAGE


class ServeError(UserError):
    """The controller cannot be served: a port, a link, a setting."""

    exit_code = Exit.DEVICE


class BuildError(UserError):
    """A compiler is missing or a build failed."""

    exit_code = Exit.BUILD


class ReleaseError(UserError):
    """A release cannot be made: something is missing, damaged, or does not belong together."""

    exit_code = Exit.BUILD


class FlashError(UserError):
    """A chip cannot be written or read, or what should be written does not fit."""

    exit_code = Exit.FLASH


class JobError(UserError):
    """A G-code job cannot be read or holds an error."""

    exit_code = Exit.JOB


class LinkError(UserError):
    """A controller cannot be reached, is busy, or went away."""

    exit_code = Exit.DEVICE


class ProtocolError(UserError):
    """Something answers, but not as a controller does."""

    exit_code = Exit.PROTOCOL


class RefusedError(UserError):
    """The controller understood, and said no."""

    exit_code = Exit.JOB
