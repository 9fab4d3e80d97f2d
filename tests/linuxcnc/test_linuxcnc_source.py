"""The component as one C file, and `wificnc linuxcnc component`, which writes and installs it."""

from __future__ import annotations

import os
import re
import shlex
import subprocess
from pathlib import Path

import pytest
from click.testing import CliRunner
from wificnc.app import root
from wificnc.build.checkout import checkout_root
from wificnc.build.compiler import locate_compiler
from wificnc.errors import BuildError, UserError
from wificnc.linuxcnc import halcompile
from wificnc.linuxcnc.source import FILE_NAME, PROGRAM, component_source

# A component that says "2 one two 7": a header for two, one more of it, a table used twice, a room of the core with its
# own header, and one that no one needs.
SMALL = {
    "LICENSE": "MIT License\n\nCopyright (c) somebody\n",
    "linuxcnc/words.def": "WORD(one)\nWORD(two)\n",
    "linuxcnc/say.h": '/* SPDX-License-Identifier: MIT\n * Says it. */\n#include "sum.h"\nvoid say(struct sum sum);\n',
    "linuxcnc/sum.h": '#include "wire/number.h"\nstruct sum { int seven; };\n',
    "linuxcnc/say.c": """/* SPDX-License-Identifier: MIT */
#include "say.h"
#include "sum.h"

#include <stdio.h>
#define WORD(name) WORD_##name,
enum word {
#include "words.def"
    WORDS
};
#undef WORD
#define WORD(name) " " #name
void say(struct sum sum) {
    printf("%d%s %d", WORDS,
#include "words.def"
           , sum.seven);
}
""",
    "linuxcnc/main.c": '#include "say.h"\nint main(void) {\n    say((struct sum){ number() });\n    return 0;\n}\n',
    "core/wire/number.h": "#ifndef NUMBER\n#define NUMBER\nint number(void);\n#endif\n",
    "core/wire/number.c": '#include "wire/number.h"\n#include <stdlib.h>\nint number(void) { return 7; }\n',
    # what <string.h> has only with this macro, before the first header of the system
    "linuxcnc/pure.c": "#define _GNU_SOURCE\n#include <string.h>\nconst void *pure(void);\n"
    'const void *pure(void) { return memmem("7", 1, "7", 1); }\n',
    "core/wire/other.c": "#error nobody needs it\n",
}
# As halcompile is called and what it does: a program of the file's name in a folder next to its own.
HALCOMPILE = """#!/bin/sh
printf '%s\\n' "$*" > {said}
for file; do :; done
name=${{file##*/}}
while [ "$((n += 1))" -le 3 ] && IFS= read -r line; do
    printf '%s\\n' "$line"
done < "$file" > {folder}/bin/"${{name%.c}}"
"""


def plant(folder: Path, files: dict[str, str] = SMALL) -> Path:
    for name, text in files.items():
        (folder / name).parent.mkdir(parents=True, exist_ok=True)
        (folder / name).write_text(text)
    return folder


def invoke(*arguments: object) -> str:
    result = CliRunner().invoke(root, ["linuxcnc", "component", *map(str, arguments)])
    if result.exception and not isinstance(result.exception, SystemExit):
        raise result.exception
    return result.output


# ---- one file ----


def test_one_file_is_the_same_program(tmp_path: Path) -> None:
    text = component_source(plant(tmp_path / "tree"))
    (tmp_path / "one.c").write_text(text)
    flags = ["-std=c11", "-Wall", "-Wextra", "-Werror", "-o", str(tmp_path / "one")]
    subprocess.run([*locate_compiler(), *flags, str(tmp_path / "one.c")], check=True)
    assert subprocess.run([tmp_path / "one"], capture_output=True, check=True).stdout == b"2 one two 7"
    assert text.count("struct sum {") == text.count("int number(void);") == 1, "headers once, without guards, too"
    assert text.count("SPDX-License-Identifier") == text.count("MIT License") == text.count("Copyright") == 1
    assert "/* ---- linuxcnc/say.h ---- */\n/* Says it. */\n" in text
    assert '#include "' not in text and "#include <stdio.h>" in text
    assert str(tmp_path) not in text


def test_where_a_part_comes_from_is_said_again_behind_an_include(tmp_path: Path) -> None:
    text = component_source(plant(tmp_path))
    before = text[: text.index("enum word {")]
    assert re.findall(r"---- (\S+) ----", before)[-1] == "linuxcnc/say.c"


def test_an_include_of_nothing_says_where_it_is(tmp_path: Path) -> None:
    plant(tmp_path, SMALL | {"linuxcnc/sum.h": '#include "gone.h"\n'})
    with pytest.raises(BuildError, match=r'linuxcnc/sum\.h includes "gone\.h"'):
        component_source(tmp_path)


def test_a_tree_without_the_component_is_refused(tmp_path: Path) -> None:
    with pytest.raises(BuildError, match="C files are missing in"):
        component_source(plant(tmp_path, {name: SMALL[name] for name in ("LICENSE", "core/wire/number.c")}))


def test_all_of_the_component_is_in_it_once(tmp_path: Path) -> None:
    tree = checkout_root()
    text = component_source(tree)
    assert text == component_source(tree)
    for path in sorted((tree / "linuxcnc").glob("*.[ch]")):
        code = [line for line in path.read_text().splitlines() if re.match(r"(?!#|/| |\w+\()\S.*[({]$", line)]
        for line in code:
            assert line in text.splitlines(), f"{path.name}: {line}"
    assert not re.search(r"^#include \"", text, re.MULTILINE)
    assert len(set(guards := re.findall(r"^#ifndef (WIFICNC_\w+_H)$", text, re.MULTILINE))) == len(guards) > 5


def test_halcompile_builds_it_without_a_warning(hal_program: Path) -> None:
    assert os.access(hal_program, os.X_OK) and hal_program.name == PROGRAM


# ---- the command ----


def test_the_file_is_written_where_it_is_wanted(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    said = invoke()
    assert f"sudo halcompile --install --userspace --extra-link-args=-lm {FILE_NAME}" in said
    text = Path(FILE_NAME).read_text()
    assert text == component_source(checkout_root())
    (tmp_path / "folder").mkdir()
    assert str(tmp_path / "folder" / FILE_NAME) in invoke("--out", tmp_path / "folder")
    Path(FILE_NAME).write_text("\n".join(text.splitlines()[:2]))  # of another version
    invoke("--out", FILE_NAME)
    assert Path(FILE_NAME).read_text() == text


def test_a_file_of_somebody_else_stays(tmp_path: Path) -> None:
    file = tmp_path / "mine.c"
    file.write_text("int mine;\n")
    with pytest.raises(UserError, match=r"mine\.c exists"):
        invoke("--out", file)
    assert file.read_text() == "int mine;\n"
    with pytest.raises(UserError, match="cannot write"):
        invoke("--out", tmp_path / "nowhere" / "hal.c")


@pytest.fixture
def linuxcnc(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A folder with bin/halcompile, which the PATH begins with."""
    for name in ("bin", "tmp"):
        (tmp_path / name).mkdir()
    compiler = tmp_path / "bin" / "halcompile"
    said = shlex.quote(str(tmp_path / "said"))
    compiler.write_text(HALCOMPILE.format(said=said, folder=shlex.quote(str(tmp_path))))
    compiler.chmod(0o755)
    monkeypatch.setenv("PATH", f"{tmp_path / 'bin'}{os.pathsep}{os.environ['PATH']}")
    monkeypatch.setenv("TMPDIR", str(tmp_path / "tmp"))
    monkeypatch.setattr("tempfile.tempdir", None)
    monkeypatch.delenv("USER_MODULE_DIR", raising=False)
    return tmp_path


def test_it_is_installed_by_halcompile(linuxcnc: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(linuxcnc)
    assert invoke("--install").split() == [str(linuxcnc / "bin" / PROGRAM)]
    words = (linuxcnc / "said").read_text().split()
    assert words[:3] == ["--install", "--userspace", "--extra-link-args=-lm"] and Path(words[3]).name == FILE_NAME
    assert (linuxcnc / "bin" / PROGRAM).read_text() in component_source(checkout_root())
    assert not Path(FILE_NAME).exists() and not list((linuxcnc / "tmp").iterdir()), "nothing else is left"


def test_sudo_only_when_it_is_wanted(linuxcnc: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    access = os.access
    monkeypatch.setattr(halcompile.os, "access", lambda path, mode: mode != os.W_OK and access(path, mode))
    with pytest.raises(BuildError, match=f"only root may write to {re.escape(str(linuxcnc / 'bin'))}") as refused:
        invoke("--install")
    assert (
        refused.value.hint
        and f"sudo halcompile --install --userspace --extra-link-args=-lm {FILE_NAME}" in refused.value.hint
    )
    assert not (linuxcnc / "said").exists()
    monkeypatch.undo()
    sudo = linuxcnc / "bin" / "sudo"
    sudo.write_text(f'#!/bin/sh\nprintf "%s\\n" "$@" > {shlex.quote(str(linuxcnc))}/by_sudo\n')
    sudo.chmod(0o755)
    monkeypatch.setenv("PATH", f"{linuxcnc / 'bin'}{os.pathsep}{os.environ['PATH']}")
    invoke("--install", "--sudo")
    words = (linuxcnc / "by_sudo").read_text().split("\n")
    assert words[:3] == [str(linuxcnc / "bin" / "halcompile"), "--install", "--userspace"]
    with pytest.raises(UserError, match="--sudo needs --install"):
        invoke("--sudo")


def test_what_the_compiler_says_is_shown(linuxcnc: Path) -> None:
    said = "wificnc-hal.c:12:1: error: something"
    (linuxcnc / "bin" / "halcompile").write_text(f"#!/bin/sh\necho '{said}' >&2\nexit 2\n")
    with pytest.raises(BuildError, match=re.escape(said)):
        invoke("--install")


def test_without_halcompile_it_says_where_that_comes_from(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("PATH", str(tmp_path))
    with pytest.raises(BuildError, match="halcompile is not installed") as missing:
        invoke("--install")
    assert missing.value.hint and "apt install linuxcnc-uspace-dev" in missing.value.hint
