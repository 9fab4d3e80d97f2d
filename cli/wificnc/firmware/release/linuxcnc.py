"""The LinuxCNC component as an archive, for a machine where nothing can be installed by pip."""

from __future__ import annotations

from pathlib import Path

from wificnc.linuxcnc.config import files as configuration
from wificnc.linuxcnc.source import FILE_NAME, PROGRAM, build_command, component_source
from wificnc.profile import find_machines, load_machine

ADDRESS = "192.168.4.1"  # a controller in its own network
COPIED = ("LICENSE", "docs/linuxcnc.md", "docs/protocol.md")

README = f"""\
# WiFiCNC for LinuxCNC {{version}}

`{FILE_NAME}` is the HAL component, in C. docs/linuxcnc.md has its pins and options.
`configs` has a configuration for each machine profile that comes with WiFiCNC.

1. sudo apt install linuxcnc-uspace-dev build-essential
2. sudo {" ".join(build_command("install", FILE_NAME))}
3. Put the folder of a machine into ~/linuxcnc/configs, and the controller's address into its .ini file.
4. linuxcnc ~/linuxcnc/configs/MACHINE/MACHINE.ini

The second step builds `{PROGRAM}` and puts it into /usr/bin, where the configurations find it.
The package of the command (docs/start/README.md) has `wificnc linuxcnc init`, too: it writes a configuration for your
own profile.
"""


def component_files(root: Path, version: str) -> dict[str, bytes]:
    """Path in the archive -> content. @param root  the repository. Raises BuildError."""
    texts = {"README.md": README.format(version=version), FILE_NAME: component_source(root)}
    for name, path in sorted(find_machines().items()):
        for file, text in configuration(name, ADDRESS, load_machine(path)).items():
            texts[f"configs/{name}/{file}"] = text
    files = {name: text.encode() for name, text in texts.items()}
    files |= {name: (root / name).read_bytes() for name in COPIED}
    return {f"wificnc-linuxcnc-{version}/{name}": data for name, data in files.items()}
