"""A function or table that a header offers has a user: another file of core, targets or linuxcnc.

What else may be in a header: what Python or the page calls in the library (headers of targets/pc and targets/sim);
what only tests call, if the comment of the header or of the function begins with [tests]; and the codec of WMC3, which
is whole in both directions.
"""

from __future__ import annotations

import re
from collections.abc import Iterator
from functools import cache
from pathlib import Path

from lint.problem import Problem, tracked_files

COMMENT = re.compile(r"/\*.*?\*/|//[^\n]*", re.DOTALL)
STRING = re.compile(r'"(?:[^"\\\n]|\\.)*"')
WORD = re.compile(r"\w+")
FUNCTION = re.compile(
    r"^(?!static|typedef|return|#|extern|else)[A-Za-z_][\w \t*]*?[\s*](?P<name>\w+)\([^;{}]*\)[^;{}]*;", re.MULTILINE
)
TABLE = re.compile(r"^extern [\w \t*]*?(?P<name>\w+)(?:\[[^;]*\])?(?:,[^;]*)?;", re.MULTILINE)

CODE = (".c", ".h", ".S", ".ld", ".lf", ".def")
ROOMS = ("core", "targets", "linuxcnc")
LIBRARY = ("targets/pc/", "targets/sim/")
CALLERS_OF_LIBRARY = ("cli/", "web/wasm/")
SIGNATURES = Path("core/hal/contract.c")
CODEC = Path("core/wire/wire_gen.h")
FOR_TESTS = "[tests]"


def check_callers(root: Path) -> list[Problem]:
    """Every name that a header declares and no one else uses."""
    texts = {path: (root / path).read_text() for path in tracked_files(root) if _is_code(path)}
    words = {path: set(WORD.findall(blanked(text))) for path, text in texts.items()}
    outside = _words_outside(root)
    problems = []
    for header in sorted(path for path in texts if path.suffix == ".h" and path != CODEC):
        for name, line, note in declared(texts[header]):
            if is_used(name, header, texts, words):
                continue
            if header.as_posix().startswith(LIBRARY) and name in outside:
                continue
            if FOR_TESTS not in note:
                message = f"{name} has no user outside of its file: make it static, or delete it"
                problems.append(Problem(header, line, message))
    return problems


def declared(text: str) -> Iterator[tuple[str, int, str]]:
    """Names in a header, their lines, and what is noted about them: the header's comment and their own."""
    text_only = blanked(text)
    head = COMMENT.search(text)
    comments = [(match.end(), match[0]) for match in COMMENT.finditer(text)]
    for pattern in (FUNCTION, TABLE):
        for match in pattern.finditer(text_only):
            at = match.start()
            own = [comment for end, comment in comments if end <= at and not text[end:at].strip()]
            yield match["name"], text_only.count("\n", 0, at) + 1, (head[0] if head else "") + "".join(own)


def is_used(name: str, header: Path, texts: dict[Path, str], words: dict[Path, set[str]]) -> bool:
    """In a file that neither defines nor declares it, or in an inline function of its header."""
    if len(re.findall(rf"\b{name}\b", blanked(texts[header]))) > 1:
        return True
    definition = re.compile(rf"^[A-Za-z_][^;{{}}=]*\b{name}(?:\([^;{{}}]*\)\s*\{{|(?:\[[^\]]*\])* =)", re.MULTILINE)
    return any(
        name in found and path not in (header, SIGNATURES) and not definition.search(blanked(texts[path]))
        for path, found in words.items()
    )


def _is_code(path: Path) -> bool:
    return path.suffix in CODE and path.parts[0] in ROOMS and "test" not in path.parts


def _words_outside(root: Path) -> set[str]:
    paths = [path for path in tracked_files(root) if path.as_posix().startswith(CALLERS_OF_LIBRARY)]
    return {word for path in paths if path.suffix in (".py", ".c") for word in WORD.findall((root / path).read_text())}


@cache
def blanked(text: str) -> str:
    """Without comments and strings, all else where it was."""
    blank = re.compile(f"{COMMENT.pattern}|{STRING.pattern}", re.DOTALL)
    return blank.sub(lambda match: re.sub(r"[^\n]", " ", match[0]), text)
