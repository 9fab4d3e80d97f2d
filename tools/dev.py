"""What a developer does, on every system: python tools/dev.py demo | test | lint | setup, and test-all | test-slice |
test-deep.

Sets up .venv first: a Python environment with WiFiCNC and its tools, and a C compiler from PyPI where there is none.
A second run skips that. `make` calls it. Needs Python 3.10 or newer, and nothing else.
"""

from __future__ import annotations

import argparse
import importlib.util
import os
import shutil
import subprocess
import sys
from pathlib import Path

ROOT = Path(__file__).resolve().parents[1]
PACKAGES = ("pyproject.toml", "emulators/pyproject.toml")  # of the command, and of the virtual chips
TESTS = ("tests", "emulators/tests")
OLDEST_PYTHON = (3, 10)
COMPILERS = ("cc", "gcc", "clang")
RUN_EXTRAS, DEV_EXTRAS = "plot", "plot,esp,dev"
RUN_STAMP, DEV_STAMP = ".ready", ".ready-dev"
RINGS = ("core", "chips", "realtime")  # tests/support/rings.py says which test is in which
SLICES = 40  # of what CI leaves out: the workflow of each change does one of them
COMMANDS = {
    "demo": "run a real job through the real core and draw it",
    "test": "the ring core: nearly all tests, in virtual time; --ring for another; more words go to pytest, and tests "
    "that they name are of any ring",
    "test-all": "the three rings, as CI runs them; more words go to pytest",
    "test-slice": f"one of {SLICES} parts of what test-all leaves out: that of the commit, or --part N",
    "test-deep": "what test-all leaves out; more words go to pytest",
    "lint": "formats, types, static analysis, house rules: all, or those named",
    "setup": "only set up .venv, and write what git does not keep; --dev: with the tools",
}


def main(words: list[str]) -> int:
    """Exit code of what was run."""
    parser = argparse.ArgumentParser(prog="tools/dev.py", description="What a developer does, on every system.")
    parser.add_argument("--venv", default=".venv", help="folder of the environment (%(default)s)")
    commands = parser.add_subparsers(dest="command", required=True)
    tests = [name for name in COMMANDS if name.startswith("test")]
    for name, text in COMMANDS.items():
        made = commands.add_parser(name, help=text, add_help=name not in tests, allow_abbrev=False)
        if name == "test":
            made.add_argument("--ring", choices=RINGS)
        if name == "test-slice":
            made.add_argument("--part", type=int, metavar="N", choices=range(SLICES))
    asked, rest = parser.parse_known_args(words)
    if asked.command == "setup" and rest not in ([], ["--dev"]):
        parser.error(f"setup takes --dev or nothing, not {' '.join(rest)}")
    venv = ROOT / asked.venv
    python = python_of(venv)
    set_up(venv, dev=asked.command in (*tests, "lint") or "--dev" in rest)
    if asked.command == "demo":
        return run([python, "-m", "wificnc", "demo", *rest])
    if code := run([python, "-m", "generate.built"], ROOT / "tools"):
        return code
    if asked.command == "setup":
        return 0
    if asked.command == "lint":
        return run([python, "-m", "lint", *rest], ROOT / "tools")
    return test(python, asked, rest)


def test(python: Path, asked: argparse.Namespace, rest: list[str]) -> int:
    """Run what was asked for, on all processors."""
    if code := run([python, "-m", "wificnc", "build", "host"]):
        return code
    if not rest:
        compile_tests(python)
    words: list[str | Path] = [
        python,
        "-m",
        "pytest",
        "-n",
        "auto",
        "--no-loadscope-reorder",
        *chosen(asked, rest),
        *rest,
    ]
    return run(words, also={"WIFICNC_ON_CHIP": "all"} if asked.command == "test-slice" else {})


def chosen(asked: argparse.Namespace, rest: list[str]) -> list[str]:
    """pytest's options for a command. Tests that are named run with all their cases."""
    named = any((ROOT / word.partition("::")[0]).exists() for word in rest)
    sample = [] if named else ["--cases-of-ci"]
    if asked.command == "test-deep":
        return ["-m", "deep", *sample]
    if asked.command == "test-slice":
        part = slice_of_commit() if asked.part is None else asked.part
        print(
            f"Part {part} of {SLICES} of what test-all leaves out: python tools/dev.py test-slice --part {part}",
            flush=True,
        )
        seeded = ("--hypothesis-profile=seeded", f"--hypothesis-seed={part}")
        return [f"--slice={part}/{SLICES}", *seeded, *sample]
    ring = (asked.ring or ("" if named else "core")) if asked.command == "test" else ""
    return ["-m", f"{ring} and not deep" if ring else "not deep", *sample]


def slice_of_commit() -> int:
    """By the commit's hash; 0 outside a repository."""
    words = ["git", "rev-parse", "HEAD"]
    said = subprocess.run(words, cwd=ROOT, capture_output=True, text=True, check=False).stdout.strip()
    return int(said or "0", 16) % SLICES


def run(command: list[str | Path], folder: Path = ROOT, also: dict[str, str] | None = None) -> int:
    """In the folder, with text in UTF-8 whatever the system's code page is. @param also  more environment"""
    environ = {**environment(), **(also or {})}
    return subprocess.run([*map(str, command)], cwd=folder, env=environ, check=False).returncode


def environment() -> dict[str, str]:
    """Ours, with text in UTF-8; and what Python has compiled is kept, or each worker and command compiles it again."""
    kept = {name: value for name, value in os.environ.items() if name != "PYTHONDONTWRITEBYTECODE"}
    return {**kept, "PYTHONUTF8": "1"}


def compile_tests(python: Path) -> None:
    """Before a first run, each file once, on all processors: pytest compiles tests for a minute, and each of its
    workers would, at the same time."""
    files = sorted(path for folder in TESTS for path in ROOT.glob(f"{folder}/*/test_*.py"))
    if next(ROOT.glob("tests/*/__pycache__/test_*-pytest-*.pyc"), None):
        return
    count = os.cpu_count() or 1
    collect = [str(python), "-m", "pytest", "--collect-only", "-qq"]
    parts = [[str(path.relative_to(ROOT)) for path in files[n::count]] for n in range(min(count, len(files)))]
    null = subprocess.DEVNULL  # the run itself reports what does not compile
    for each in [subprocess.Popen([*collect, *part], cwd=ROOT, env=environment(), stdout=null) for part in parts]:
        each.wait()


def python_of(venv: Path) -> Path:
    return venv / "Scripts" / "python.exe" if os.name == "nt" else venv / "bin" / "python"


def set_up(venv: Path, *, dev: bool) -> None:
    """The environment, unless it is as new as each pyproject.toml. That with the tools has all of the other one."""
    stamps = [venv / RUN_STAMP, venv / DEV_STAMP] if dev else [venv / RUN_STAMP]
    if all(is_newer(stamps[-1], ROOT / package) for package in PACKAGES):
        return
    create(venv)
    print(f"Installing WiFiCNC{' and its tools' * dev} into {os.path.relpath(venv, ROOT)} ...", flush=True)
    install(venv, DEV_EXTRAS if dev else RUN_EXTRAS)
    if not os.environ.get("CC") and not any(map(shutil.which, COMPILERS)):
        print("There is no C compiler here: installing zig from PyPI, which has one ...", flush=True)
        install(venv, "toolchain")
    for stamp in stamps:
        stamp.touch()


def is_newer(stamp: Path, source: Path) -> bool:
    return stamp.exists() and stamp.stat().st_mtime >= source.stat().st_mtime


def create(venv: Path) -> None:
    if python_of(venv).exists():
        return
    if sys.version_info < OLDEST_PYTHON:
        sys.exit(f"WiFiCNC needs Python 3.10 or newer; this is {sys.version.split()[0]}. Run it with a newer one.")
    if importlib.util.find_spec("ensurepip") is None or importlib.util.find_spec("venv") is None:
        sys.exit("Python cannot make an environment here. Debian, Ubuntu: apt-get install python3-venv")
    if code := run([sys.executable, "-m", "venv", venv]):
        sys.exit(code)


def install(venv: Path, extras: str) -> None:
    words = ("install", "--quiet", "--disable-pip-version-check", "--no-compile")  # few of these modules are ever used
    pip: list[str | Path] = [python_of(venv), "-m", "pip", *words]
    run([*pip, "--upgrade", "pip"])  # Python's own takes twice the time to choose; where there is no newer one it does
    if code := run([*pip, "-e", f".[{extras}]", "-e", "./emulators"]):
        sys.exit(code)


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
