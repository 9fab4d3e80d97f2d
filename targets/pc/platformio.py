"""`pio run -e native`: leaves out the sources of the other kind of system, and adds what Windows links with.

platforms.py of the wificnc package says the same of our own build. Here it may not be installed.
"""

import sys

Import("env")  # noqa: F821  what SCons gives its scripts

windows = sys.platform == "win32"
env.Append(SRC_FILTER=["-<../../pc/*_posix.c>" if windows else "-<../../pc/*_windows.c>"])  # noqa: F821
if windows:
    env.Append(LIBS=["ws2_32", "winmm", "bcrypt", "shell32"])  # noqa: F821
