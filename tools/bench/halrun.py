"""LinuxCNC's programs as they must be run: by an ordinary user, and alone with themselves."""

from __future__ import annotations

import os

NOBODY = "65534"


def isolated(*argv: str) -> list[str]:
    """The command for that. As root it runs as the user `nobody`, with shared memory and processes for HAL alone: no
    other LinuxCNC of this computer is met; others run as they are."""
    if os.geteuid() != 0:
        return list(argv)
    user = ("--reuid", NOBODY, "--regid", NOBODY, "--clear-groups")
    return ["unshare", "--ipc", "--pid", "--fork", "--kill-child", "--mount-proc", "setpriv", *user, *argv]
