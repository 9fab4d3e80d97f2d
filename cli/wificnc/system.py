"""What kind of computer this is, and the command that installs a tool on it."""

from __future__ import annotations

import os
import re
import shutil
import sys
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Literal

Manager = Literal["apt", "dnf", "pacman", "zypper", "brew", "winget"]
Tool = Literal["python", "cc", "mips", "node"]

OS_RELEASE = Path("/etc/os-release")

_COMMANDS: dict[Manager, str] = {
    "apt": "sudo apt-get install {}",
    "dnf": "sudo dnf install {}",
    "pacman": "sudo pacman -S {}",
    "zypper": "sudo zypper install {}",
    "brew": "brew install {}",
    "winget": "winget install --exact --id {}",
}
# ID and ID_LIKE of os-release
_MANAGERS: dict[str, Manager] = {
    "debian": "apt", "ubuntu": "apt", "raspbian": "apt", "fedora": "dnf", "rhel": "dnf", "centos": "dnf",
    "arch": "pacman", "suse": "zypper", "opensuse": "zypper",
}  # fmt: skip
_PACKAGES: dict[Tool, dict[Manager, str]] = {
    "python": {"apt": "python3 python3-venv", "dnf": "python3", "pacman": "python", "zypper": "python3",
               "brew": "python", "winget": "Python.Python.3.13"},
    "cc": {"apt": "gcc libc6-dev", "dnf": "gcc", "pacman": "gcc", "zypper": "gcc"},
    "mips": {"apt": "gcc-mipsel-linux-gnu"},
    "node": {"apt": "nodejs npm", "dnf": "nodejs", "pacman": "nodejs npm", "zypper": "nodejs", "brew": "node",
             "winget": "OpenJS.NodeJS.LTS"},
}  # fmt: skip


@dataclass(frozen=True)
class System:
    """A computer; without arguments this one."""

    platform: str = sys.platform
    os_release: Mapping[str, str] = field(default_factory=lambda: read_os_release())
    executable: str = sys.executable
    which: Callable[[str], str | None] = shutil.which

    @property
    def manager(self) -> Manager | None:
        """The program that installs packages; None on a Linux that we do not know."""
        if self.platform == "win32":
            return "winget"
        if self.platform == "darwin":
            return "brew"
        names = [self.os_release.get("ID", ""), *self.os_release.get("ID_LIKE", "").split()]
        return next((_MANAGERS[name.partition("-")[0]] for name in names if name.partition("-")[0] in _MANAGERS), None)

    def install(self, tool: Tool) -> str | None:
        """The command; None when the system's packages do not have it."""
        manager = self.manager
        package = _PACKAGES[tool].get(manager) if manager else None
        return _COMMANDS[manager].format(package) if manager and package else None

    def pip(self, package: str) -> str:
        """The command that installs a Python package next to this program."""
        call = f'& "{self.executable}"' if self.platform == "win32" else _quoted(self.executable)
        return f"{call} -m pip install {package}"

    def join_serial_group(self) -> str:
        """Linux: the command that gives this user the serial ports."""
        group = "uucp" if self.manager == "pacman" else "dialout"
        tool = "usermod -aG {} $USER" if self.which("usermod") else "adduser $USER {}"
        return f"sudo {tool.format(group)}"


def read_os_release(path: Path = OS_RELEASE) -> dict[str, str]:
    """KEY=value of /etc/os-release; {} where it is not there."""
    try:
        text = path.read_text(encoding="utf-8", errors="replace")
    except OSError:
        return {}
    return {key: value.strip("\"'") for key, value in re.findall(r"^(\w+)=(.*)$", text, re.MULTILINE)}


def _quoted(path: str) -> str:
    return f"'{path}'" if re.search(r"[^\w@%+=:,./-]", path) else os.fspath(path)
