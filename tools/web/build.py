"""Build the page: `python -m web.build`, which is `make web`. npm's packages, the core as WebAssembly, Vite."""

from __future__ import annotations

import os
import re
import shutil
import subprocess
import sys
from pathlib import Path

from generate.built import bring_up_to_date
from wificnc import ui
from wificnc.build.lock import build_lock
from wificnc.errors import BuildError, UserError

from web.wasm import build_wasm

ROOT = Path(__file__).resolve().parents[2]
NODE_OLDEST = (20, 19)  # web/package.json, engines
SAID_LINES = 30  # of a tool's own words in an error


def build_page(root: Path = ROOT) -> tuple[Path, str]:
    """Bring web/dist up to date. @return it, and Vite's report of sizes. Raises BuildError."""
    require_tools()
    with build_lock(root / "build" / "web"):
        bring_up_to_date(root)
        install_packages(root)
        build_wasm(root)
        report = run_npm(root, "run", "--silent", "build")
    return root / "web" / "dist", report


def require_tools() -> None:
    """Raises BuildError when the page cannot be built on this computer."""
    if why := missing_tools():
        raise BuildError(why, hint="Debian, Ubuntu: apt-get install nodejs npm; or nodejs.org")


def missing_tools() -> str:
    """Why the page cannot be built on this computer; "" when it can."""
    node = shutil.which("node")
    if node is None or shutil.which("npm") is None:
        return "Node.js or npm is not installed"
    said = subprocess.run(
        [node, "--version"], capture_output=True, text=True, encoding="utf-8", errors="replace"
    ).stdout
    version = tuple(int(part) for part in re.findall(r"\d+", said)[:2])
    if version < NODE_OLDEST:
        return f"Node.js {said.strip()} is too old: {'.'.join(map(str, NODE_OLDEST))} or newer is needed"
    return ""


def install_packages(root: Path) -> None:
    """What web/package-lock.json says, unless it is there. Raises BuildError."""
    lock = root / "web" / "package-lock.json"
    stamp = root / "web" / "node_modules" / ".package-lock.json"
    if not stamp.exists() or stamp.stat().st_mtime_ns < lock.stat().st_mtime_ns:
        run_npm(root, "ci", "--no-audit", "--no-fund")
        stamp.touch()


def run_npm(root: Path, *arguments: str, **environment: str) -> str:
    """@param environment  variables on top of ours. @return what it said. Raises BuildError."""
    npm = shutil.which("npm")
    assert npm is not None
    variables = {**os.environ, "WIFICNC_PYTHON": sys.executable, **environment}
    run = subprocess.run(
        [npm, *arguments],
        cwd=root / "web",
        capture_output=True,
        text=True,
        encoding="utf-8",
        errors="replace",
        env=variables,
    )
    if run.returncode != 0:
        said = "\n".join((run.stdout + run.stderr).strip().splitlines()[-SAID_LINES:])
        raise BuildError(f"npm {' '.join(arguments)} failed:\n{said}")
    return run.stdout


def main() -> int:
    try:
        folder, report = build_page()
    except UserError as error:
        ui.error(error)
        return error.exit_code
    print(report)
    print(f"The page is {folder}; wificnc serve --http 127.0.0.1:8080 serves it")
    return 0


if __name__ == "__main__":
    sys.exit(main())
