"""The LinuxCNC component as an archive, for a machine where nothing can be installed by pip."""

from __future__ import annotations

import ast
from pathlib import Path

from wificnc.linuxcnc.config import files as configuration
from wificnc.machine import find_machines, load_machine

ENTRY = "wificnc.linuxcnc.__main__"
PROGRAM = "wificnc-hal"
ADDRESS = "192.168.4.1"  # a controller in its own network

LAUNCHER = f"""\
#!/usr/bin/env python3
import sys
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parent / "python"))
from {ENTRY.removesuffix(".__main__")}.component import main

sys.exit(main())
"""

README = f"""\
# WiFiCNC for LinuxCNC {{version}}

`{PROGRAM}` is the HAL component; it needs Python 3.10 and nothing else. docs/linuxcnc.md has its pins and options.
`configs` has a configuration for each machine profile that comes with WiFiCNC:

1. Put this folder where it can stay, and the folder of a machine into ~/linuxcnc/configs.
2. In its .hal file, say where {PROGRAM} is, and the controller's address.
3. linuxcnc ~/linuxcnc/configs/MACHINE/MACHINE.ini

With `pip install wificnc` there is also `wificnc linuxcnc init`, which writes the same for a profile of your own.
"""


def component_files(package: Path, root: Path, version: str) -> dict[str, bytes]:
    """Path in the archive -> content. @param package  cli/wificnc. @param root  the repository"""
    texts = {"README.md": README.format(version=version), PROGRAM: LAUNCHER}
    for name, path in sorted(find_machines().items()):
        for file, text in configuration(name, ADDRESS, load_machine(path)).items():
            texts[f"configs/{name}/{file}"] = text.replace(f"python3 -m {ENTRY.removesuffix('.__main__')}", PROGRAM)
    files = {name: text.encode() for name, text in texts.items()}
    files |= {f"python/{path.relative_to(package.parent).as_posix()}": path.read_bytes() for path in modules(package)}
    files |= {name: (root / name).read_bytes() for name in ("LICENSE", "docs/linuxcnc.md", "docs/protocol.md")}
    return {f"wificnc-linuxcnc-{version}/{name}": data for name, data in files.items()}


def modules(package: Path) -> list[Path]:
    """The component's module and every one of ours that it imports, however far away."""
    found: set[Path] = set()
    waiting = [ENTRY]
    while waiting:
        name = waiting.pop()
        path = _file(package, name)
        if path is not None and path not in found:
            found.add(path)
            waiting += [*_imports(path), name.rpartition(".")[0]]
    return sorted(found)


def _imports(path: Path) -> list[str]:
    """Names that may be modules of ours."""
    names: list[str] = []
    for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
        if isinstance(node, ast.ImportFrom) and node.module:
            names += [node.module, *(f"{node.module}.{alias.name}" for alias in node.names)]
        elif isinstance(node, ast.Import):
            names += [alias.name for alias in node.names]
    return [name for name in names if name.split(".")[0] == "wificnc"]


def _file(package: Path, module: str) -> Path | None:
    """The file of a module of ours; None: it is a name in one."""
    if not module:
        return None
    path = package.parent.joinpath(*module.split("."))
    candidates = (path / "__init__.py", path.with_suffix(".py"))
    return next((candidate for candidate in candidates if candidate.is_file()), None)
