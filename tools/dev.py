"""What a developer does, on every system: python tools/dev.py demo | test | test-all | test-deep | lint | setup.

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
OLDEST_PYTHON = (3, 10)
COMPILERS = ("cc", "gcc", "clang")
RUN_EXTRAS, DEV_EXTRAS = "plot", "plot,esp,dev"
RUN_STAMP, DEV_STAMP = ".ready", ".ready-dev"
# Which cases of a test; those of one that is asked for by its name run all.
SAMPLES = {"test": "--cases=3", "test-all": "--cases-of-ci", "test-deep": "--cases-of-ci"}
CHOSEN = {"test": "not slow and not deep", "test-all": "not deep", "test-deep": "deep"}
COMMANDS = {
    "demo": "run a real job through the real core and draw it",
    "test": "the quick tests, of each a few cases; more words go to pytest, and all cases run",
    "test-all": "the slow tests, too, as CI runs them; more words go to pytest, and all cases run",
    "test-deep": "what test-all leaves out, as it runs each night; more words go to pytest",
    "lint": "formats, types, static analysis, house rules: all, or those named",
    "setup": "only set up .venv; --dev: with the tools",
}


def main(words: list[str]) -> int:
    """Exit code of what was run."""
    parser = argparse.ArgumentParser(prog="tools/dev.py", description="What a developer does, on every system.")
    parser.add_argument("--venv", default=".venv", help="folder of the environment (%(default)s)")
    commands = parser.add_subparsers(dest="command", required=True)
    for name, text in COMMANDS.items():
        commands.add_parser(name, help=text, add_help=name not in CHOSEN)
    asked, rest = parser.parse_known_args(words)
    if asked.command == "setup" and rest not in ([], ["--dev"]):
        parser.error(f"setup takes --dev or nothing, not {' '.join(rest)}")
    venv = ROOT / asked.venv
    python = python_of(venv)
    set_up(venv, dev=asked.command in (*CHOSEN, "lint") or "--dev" in rest)
    if asked.command == "setup":
        return 0
    if asked.command == "lint":
        return run([python, "-m", "lint", *rest], ROOT / "tools")
    if asked.command == "demo":
        return run([python, "-m", "wificnc", "demo", *rest])
    if code := run([python, "-m", "wificnc", "build", "host"]):
        return code
    chosen = ["-m", CHOSEN[asked.command]]
    if not rest:
        compile_tests(python)
        chosen.append(SAMPLES[asked.command])
    return run([python, "-m", "pytest", "-n", "auto", "--no-loadscope-reorder", *chosen, *rest])


def run(command: list[str | Path], folder: Path = ROOT) -> int:
    """In the folder, with text in UTF-8 whatever the system's code page is."""
    return subprocess.run([*map(str, command)], cwd=folder, env=environment(), check=False).returncode


def environment() -> dict[str, str]:
    return {**os.environ, "PYTHONUTF8": "1"}


def compile_tests(python: Path) -> None:
    """Before a first run, each file once, on all processors: pytest compiles tests for a minute, and each of its
    workers would, at the same time."""
    files = sorted(ROOT.glob("tests/*/test_*.py"))
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
    """The environment, unless it is as new as pyproject.toml. That with the tools has all of the other one."""
    stamps = [venv / RUN_STAMP, venv / DEV_STAMP] if dev else [venv / RUN_STAMP]
    if is_newer(stamps[-1], ROOT / "pyproject.toml"):
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
    if code := run([*pip, "-e", f".[{extras}]"]):
        sys.exit(code)


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
