"""The firmware of a board with an ESP32, built by PlatformIO: what is missing, how it is called, what came out."""

from __future__ import annotations

import hashlib
import json
import os
import shutil
import socket
import subprocess
import sys
import threading
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Literal

from wificnc.board.model import Board
from wificnc.build.signing import SigningKey
from wificnc.errors import BuildError

REGISTRY = ("api.registry.platformio.org", 443)
REACH_SECONDS = 0.8  # an answer of the network, name look-up and all
PACKAGES = ("framework-espidf", "toolchain-xtensa-esp-elf", "tool-cmake", "tool-ninja", "tool-scons")
ARTEFACTS = ("firmware.bin", "firmware.elf", "bootloader.bin", "partitions.bin")
SIGNATURE = "firmware.sig"  # next to them: of firmware.bin
SAID_LINES = 24  # of the build's last words in an error

Kind = Literal["release", "debug"]
CONFIGURATION = Path("targets/esp32")  # sdkconfig.* lie there

STILL_WORKS = "without it: `wificnc build host` and all of `wificnc sim` and `wificnc serve`"


@dataclass(frozen=True)
class Plan:
    """What a build will do."""

    board: str
    argv: tuple[str, ...]
    environment: dict[str, str]  # next to the present one
    made: Path  # where PlatformIO leaves its files
    output: Path  # where ours go
    kind: Kind = "release"


@dataclass(frozen=True)
class Artefact:
    """A file of a build."""

    name: str
    size: int
    sha256: str


def plan_build(
    board: Board, root: Path, *, kind: Kind = "release", clean: bool = False, pio: Sequence[str] = ("pio",)
) -> Plan:
    """How PlatformIO is called: as anyone would. Each kind of build has its own environment in platformio.ini,
    and so its own configuration and objects. Nothing is run."""
    environment = board.id if kind == "release" else f"{board.id}-{kind}"
    argv = [*pio, "run", "-d", str(root), "-e", environment]
    return Plan(
        board=board.id,
        argv=tuple([*argv, "-t", "clean"] if clean else argv),
        environment={
            "WIFICNC_BOARD": board.id,
            "PLATFORMIO_SETTING_ENABLE_TELEMETRY": "no",
            # CMake looks for `wificnc` there
            "PATH": os.pathsep.join([str(Path(sys.executable).parent), os.environ.get("PATH", "")]),
        },
        made=root / ".pio" / "build" / environment,
        output=root / "build" / board.id,
        kind=kind,
    )


def find_platformio(environment: Mapping[str, str] = os.environ) -> tuple[str, ...]:
    """How PlatformIO is called here. Raises BuildError when it is not installed."""
    beside = Path(sys.executable).with_name("pio")
    found = str(beside) if beside.is_file() else shutil.which("pio", path=environment.get("PATH"))
    if found is None:
        raise BuildError(
            "PlatformIO is not installed; the ESP32 firmware is built with it", hint="pip install platformio"
        )
    return (found,)


def missing_packages(core_dir: Path) -> list[str]:
    """What PlatformIO would have to download: its platform and packages that are not in its folder."""
    missing = [] if (core_dir / "platforms" / "espressif32").is_dir() else ["espressif32"]
    return missing + [name for name in PACKAGES if not (core_dir / "packages" / name).is_dir()]


def core_directory(environment: Mapping[str, str] = os.environ) -> Path:
    """Where PlatformIO keeps its packages."""
    return Path(environment.get("PLATFORMIO_CORE_DIR") or Path.home() / ".platformio")


def registry_answers(address: tuple[str, int] = REGISTRY, seconds: float = REACH_SECONDS) -> bool:
    """Whether the registry can be reached, known within `seconds`: a look-up that hangs is left behind."""
    answered = threading.Event()

    def knock() -> None:
        try:
            socket.create_connection(address, timeout=seconds).close()
        except OSError:
            return
        answered.set()

    thread = threading.Thread(target=knock, daemon=True)
    thread.start()
    thread.join(seconds)
    return answered.is_set()


def require_packages(core_dir: Path, answers: Callable[[], bool] = registry_answers) -> None:
    """Raises BuildError when packages are missing and cannot be had. PlatformIO itself would wait for a minute."""
    missing = missing_packages(core_dir)
    if missing and not answers():
        raise BuildError(
            f"PlatformIO's packages are missing ({', '.join(missing)}), and its registry cannot be reached",
            hint=f"connect to the internet for the first build; {STILL_WORKS}",
        )


def run_build(plan: Plan) -> Iterator[str]:
    """Run PlatformIO; its lines as they come. Raises BuildError when it fails."""
    said: list[str] = []
    with subprocess.Popen(
        plan.argv,
        stdin=subprocess.DEVNULL,
        stdout=subprocess.PIPE,
        stderr=subprocess.STDOUT,
        text=True,
        encoding="utf-8",
        errors="replace",
        env={**os.environ, **plan.environment},
    ) as process:
        assert process.stdout is not None
        for line in process.stdout:
            said.append(line.rstrip())
            yield line.rstrip()
    if process.returncode != 0:
        raise BuildError("\n".join([f"PlatformIO could not build {plan.board}:", *said[-SAID_LINES:]]))


def collect(plan: Plan, facts: Mapping[str, str], key: SigningKey) -> list[Artefact]:
    """Copy what was made to build/BOARD, signed, with a build.json. Raises BuildError when a file is not there, or the
    firmware carries another key: what is signed with this one could not be updated by it."""
    plan.output.mkdir(parents=True, exist_ok=True)
    contents = {}
    for name in ARTEFACTS:
        made = plan.made / name
        if not made.is_file():
            raise BuildError(f"PlatformIO reported success for {plan.board}, but {made} is missing")
        contents[name] = made.read_bytes()
    if key.point not in contents["firmware.bin"]:
        raise BuildError(
            f"the firmware of {plan.board} was configured with another signing key than {key.name}",
            hint=f"wificnc build {plan.board} --clean",
        )
    (plan.output / SIGNATURE).unlink(missing_ok=True)
    signature = key.sign(contents["firmware.bin"])
    contents |= {SIGNATURE: signature} if signature is not None else {}
    artefacts = []
    for name, content in contents.items():
        (plan.output / name).write_bytes(content)
        artefacts.append(Artefact(name, len(content), hashlib.sha256(content).hexdigest()))
    record = {
        "board": plan.board,
        "kind": plan.kind,
        "signing_key": key.name,
        **facts,
        "artefacts": [asdict(artefact) for artefact in artefacts],
    }
    (plan.output / "build.json").write_text(json.dumps(record, indent=2) + "\n", encoding="utf-8")
    return artefacts


def configuration_lines(root: Path, chip: str, kind: Kind) -> list[str]:
    """What our sdkconfig files want of ESP-IDF: lines of an sdkconfig."""
    folder = root / CONFIGURATION
    files = [folder / name for name in ("sdkconfig.defaults", f"sdkconfig.defaults.{chip}", f"sdkconfig.{kind}")]
    return [
        line for path in files for line in path.read_text(encoding="utf-8").splitlines() if line.startswith("CONFIG_")
    ]


def configuration_without(root: Path, plan: Plan, chip: str) -> list[str]:
    """Lines of our sdkconfig files that the configuration of this build does not have: it is kept from the first build
    on, whatever becomes of the files it was made of. PlatformIO keeps one for each environment."""
    kept = root / f"sdkconfig.{plan.made.name}"
    if not kept.is_file():
        return []
    has = set(kept.read_text(encoding="utf-8").splitlines())
    platformio = (root / CONFIGURATION / "sdkconfig.platformio").read_text(encoding="utf-8").splitlines()
    replaced = {line.partition("=")[0] for line in platformio}
    wanted = [line for line in configuration_lines(root, chip, plan.kind) if line.partition("=")[0] not in replaced]
    return [line for line in wanted if not _has_line(has, line)]


def _has_line(has: set[str], line: str) -> bool:
    """Kconfig writes "# CONFIG_X is not set" for n, and nothing where what X depends on is off."""
    option, _, value = line.partition("=")
    return f"{option}=y" not in has if value == "n" else line in has


def git_revision(root: Path) -> str:
    """The commit of the sources, with + when they were changed since; unknown outside of git."""
    run = subprocess.run(
        ["git", "-C", str(root), "describe", "--always", "--dirty=+", "--abbrev=12", "--exclude=*"],
        capture_output=True,
        text=True,
        encoding="utf-8",
        errors="replace",
        check=False,
    )
    return run.stdout.strip() or "unknown"


def slot_bytes(partitions: str) -> int:
    """Size of the smallest application slot of a partitions.csv."""
    rows = [[cell.strip() for cell in line.split(",")] for line in partitions.splitlines() if not line.startswith("#")]
    return min(int(row[4], 0) for row in rows if len(row) > 4 and row[1] == "app")
