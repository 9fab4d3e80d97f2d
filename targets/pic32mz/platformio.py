"""`pio run -e pic32mz2048efh100`: the build that `wificnc build` makes, for PlatformIO has no platform for this chip.

SCons runs this before anything of its own, and there is nothing left for it to do.
"""

import importlib.util
import subprocess
import sys

Import("env")  # noqa: F821  what SCons gives its scripts

if importlib.util.find_spec("wificnc") is None:
    sys.stderr.write("This environment needs the wificnc package in PlatformIO's Python: pip install -e .\n")
    env.Exit(1)  # noqa: F821
command = [sys.executable, "-m", "wificnc", "build", env["PIOENV"]]  # noqa: F821
if env.GetOption("clean"):  # noqa: F821
    command.append("--clean")
env.Exit(subprocess.call(command, cwd=env["PROJECT_DIR"]))  # noqa: F821
