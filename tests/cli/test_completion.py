"""Tab completion as shells ask for it, and as docs/start/README.md says."""

from __future__ import annotations

import os
import re
import shutil
import subprocess
import sys
from pathlib import Path

import pytest
from patience import HANG_S
from wificnc.build.checkout import checkout_root

PAGE = checkout_root() / "docs/start/README.md"
SHELLS = ("bash", "zsh", "fish", "powershell")


def ask(instruction: str, words: str = "", index: str = "", folder: Path | None = None) -> str:
    environment = {**os.environ, "_WIFICNC_COMPLETE": instruction, "COMP_WORDS": words, "COMP_CWORD": index}
    argv = [sys.executable, "-m", "wificnc"]
    run = subprocess.run(argv, env=environment, capture_output=True, text=True, timeout=HANG_S, check=False)
    return run.stdout


@pytest.mark.parametrize("shell", SHELLS)
def test_the_page_names_what_each_shell_reads(shell: str) -> None:
    if shell != "bash" and not ask(f"{shell}_source"):
        pytest.skip("this click has no completion for that shell")
    assert f"{shell}_source" in PAGE.read_text(encoding="utf-8")
    assert "wificnc" in ask(f"{shell}_source")


@pytest.mark.parametrize("shell", ["bash", "zsh"])
@pytest.mark.parametrize(("words", "index", "found"), [
    ("wificnc bo", "1", {"boards"}),
    ("wificnc settings d", "2", {"diff"}),
    ("wificnc status --j", "2", {"--json"}),
    ("wificnc build esp32s3-zero --cc ", "4", {"gcc", "zig"}),
])  # fmt: skip
def test_completion(shell: str, words: str, index: str, found: set[str]) -> None:
    separator = r"," if shell == "bash" else r"\n"
    assert set(re.findall(rf"^plain{separator}(\S+)", ask(f"{shell}_complete", words, index), re.MULTILINE)) == found


def test_bash_completes_after_the_line_of_the_page(tmp_path: Path) -> None:
    bash = shutil.which("bash")
    if bash is None:
        pytest.skip("bash is not here")
    wificnc = tmp_path / "wificnc"
    wificnc.write_text(f'#!/bin/sh\nexec "{sys.executable}" -m wificnc "$@"\n')
    wificnc.chmod(0o755)
    line = re.search(r"`(eval [^`]*bash_source wificnc[^`]*)`", PAGE.read_text(encoding="utf-8"))
    assert line
    script = f'{line[1]}\nCOMP_WORDS=(wificnc mon)\nCOMP_CWORD=1\n_wificnc_completion wificnc\necho "${{COMPREPLY[@]}}"'
    environment = {**os.environ, "PATH": os.pathsep.join([str(tmp_path), os.environ["PATH"]])}
    argv = [bash, "--norc", "-c", script]
    run = subprocess.run(argv, env=environment, capture_output=True, text=True, timeout=HANG_S, check=False)
    assert run.stdout.split() == ["monitor"], run.stderr
