"""What PlatformIO's registry would bring for `native`, made from what is here: SCons of PyPI and a builder of ours.

PlatformIO takes a package for installed when its folder has a package.json and a .piopm.
"""

from __future__ import annotations

import importlib.util
import json
import shutil
from pathlib import Path

SCONS_VERSION = "4.41101.0"  # how PlatformIO writes SCons 4.11.1
NATIVE_VERSION = "1.2.1"

BUILDER = """\
from SCons.Script import AlwaysBuild, Default, DefaultEnvironment

env = DefaultEnvironment()
flags = {name: env.get(name, []) for name in ("CFLAGS", "CXXFLAGS", "LINKFLAGS")}
for tool in ("gcc", "g++", "gnulink"):
    env.Tool(tool)
env.Replace(**flags)
program = env.BuildProgram()
AlwaysBuild(env.Alias("exec", program, env.VerboseAction(str(program[0]), "Executing")))
Default([program])
"""


def make_standins(core_dir: Path) -> None:
    """Fill a PLATFORMIO_CORE_DIR. Raises ImportError when SCons is not installed."""
    scons = core_dir / "packages" / "tool-scons"
    found = importlib.util.find_spec("SCons")
    if found is None or found.origin is None:
        raise ImportError("SCons is not installed (pip install scons==4.11.1)")
    shutil.copytree(Path(found.origin).parent, scons / "SCons", ignore=shutil.ignore_patterns("__pycache__"))
    (scons / "scons.py").write_text("from SCons.Script.Main import main\n\nmain()\n")
    _install(scons, "package.json", "tool", "tool-scons", SCONS_VERSION)
    native = core_dir / "platforms" / "native"
    (native / "builder").mkdir(parents=True)
    (native / "builder" / "main.py").write_text(BUILDER)
    _install(native, "platform.json", "platform", "native", NATIVE_VERSION)


def _install(folder: Path, manifest: str, kind: str, name: str, version: str) -> None:
    about = {
        "name": name,
        "version": version,
        "engines": {"platformio": "^6"},
        "title": name,
        "description": "stand-in",
    }
    spec = {"owner": "platformio", "id": None, "name": name, "requirements": None, "uri": None}
    (folder / manifest).write_text(json.dumps(about))
    (folder / ".piopm").write_text(json.dumps({"type": kind, "name": name, "version": version, "spec": spec}))
    (folder / ".piokeep").touch()
