"""Plain English: in what users read (messages of core, targets, command line and web page, README and docs), and by the
rules that name a phrase alone, in comments, docstrings, and messages of tests.

Each rule is a pattern that readers with English from data sheets stumble over, and what to write instead. The words
with one meaning in this project are in docs/glossary.md."""

from __future__ import annotations

import ast
import io
import re
import tokenize
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

from lint.problem import Problem, tracked_files


@dataclass(frozen=True)
class Rule:
    """A pattern, and a better form."""

    pattern: re.Pattern[str]
    better: str
    for_comments: bool


def _rule(pattern: str, better: str, *, for_comments: bool = True) -> Rule:
    return Rule(re.compile(pattern, re.IGNORECASE), better, for_comments)


RULES = (
    _rule(r"\bat once\b", "immediately, in one step, or at the same time"),
    _rule(r"\b(go|goes|going|went|gone) on\b", "continue, resume"),
    _rule(r"\banew\b", "again, or restart"),
    _rule(r"\b(is|are|was|were) (said|told)\b", "is reported, is printed, is shown"),
    _rule(r"\b(is|are|says|that is) none\b(?! of)", "is missing, is invalid, does not exist", for_comments=False),
    _rule(r"\b(?<!there )(is|are) no (?!longer\b|more\b|less\b)[a-z]", "is not a ..., is not ...", for_comments=False),
    _rule(r"\bstands\b(?! for\b)|\b(must|to|axes|motors|they|it|may) stand\b", "is, stops, is listed"),
    _rule(r"\bof (its|their|your|our|his) own(?= (to|in|and|for|at|by)\b|[^\w ]| $|$)", "dedicated, separate, its "
    "own ...", for_comments=False),
    _rule(r"\bbeside\b", "next to, in addition to, while ... is active"),
    _rule(r"\bwhoever\b|\bwho (asks|wants|publishes|commands)\b", "name the person or the program: you, the "
          "client", for_comments=False),
    _rule(r"^#+ (?-i:What|Who|Whoever|When something)\b", "a heading names a thing or a task", for_comments=False),
    _rule(r"\b(has|have) (it )?not (a|an|the|any|all)\b|\b(has|have) it not\b", "lacks, does not have, does not "
    "support"),
    _rule(r"\bmend(s|ed|ing)?\b", "fix, correct"),
    _rule(r"\bseldom\b", "rarely"),
    _rule(r"\bto be had\b", "is available"),
    _rule(r"\bas against\b", "compared with"),
    _rule(r"\bso long\b", "for this time, as long as"),
    _rule(r"\bhow (its|the|their) \w+ stands?\b", "the state of ..."),
    _rule(r"\b(nobody|everybody|somebody|anybody)\b", "no client, all clients, another client, any client"),
    _rule(r"\b(controller|board|device|firmware|program|command|machine|page|it) (says|tells|hears|knows|wants)\b",
          "reports, prints, receives, supports, requires", for_comments=False),
    _rule(r"\bgave motion back\b|\bgives? (it|motion) back\b", "release motion"),
    _rule(r"\btakes? over\b|\btaken over\b", "take control"),
    _rule(r"\bis sure\b|\bto its end\b|\bthe way back\b", "passed, until it ends, prepare resume", for_comments=False),
)  # fmt: skip

COMMENTED = ("core", "targets", "linuxcnc", "cli", "emulators", "tools", "web", "protocol", "boards", "tests")
RULES_AND_THEIR_TEST = (Path("tools/lint/english.py"), Path("tests/repo/test_english.py"))
CODE_SPAN = re.compile(r"`[^`]*`")
FENCE = re.compile(r"^\s*```")
C_STRING = re.compile(r'"((?:[^"\\\n]|\\.)*)"')
COMMENT = re.compile(r"/\*.*?\*/|//[^\n]*", re.DOTALL)
STRING_OR_COMMENT = re.compile(r'"(?:[^"\\\n]|\\.)*"|(?<![:\w])(?P<comment>/\*.*?\*/|//[^\n]*)', re.DOTALL)
NEXT_LINE = re.compile(r"\s*\n\s*(?:\*|//|#)?\s*")
HASH = re.compile(r"(?:^|\s)#\s.*")
TYPESCRIPT_COMMENT = re.compile(r"/\*.*?\*/|(?<![:\w])//[^\n]*", re.DOTALL)
ONE_WORD = re.compile(r'"\w*"|\b[A-Z_]+\b')
TWO_WORDS = re.compile(r"[A-Za-z]{2}[^A-Za-z]+[A-Za-z]")


def check_english(root: Path) -> list[Problem]:
    """Every rule over every text that users read."""
    problems: list[Problem] = []
    for path in tracked_files(root):
        if is_user_visible(path):
            problems += check_text(path, (root / path).read_text())
        if has_comments(path):
            problems += check_comments(path, (root / path).read_text())
    return sorted(set(problems))


def is_user_visible(path: Path) -> bool:
    """Whether users read text of this file. Tests, generators of code, and generated C do not count."""
    parts = path.parts
    if path.suffix == ".md":
        return parts[0] == "docs" or path.name == "README.md"
    if "test" in parts or path.stem.endswith("_gen"):
        return False
    if path.suffix in (".c", ".h"):
        return parts[0] in ("core", "targets", "linuxcnc")
    if path.suffix == ".py":
        return parts[0] == "cli" or parts[:2] == ("emulators", "wificnc_chips")
    return parts[:2] == ("web", "src") and path.suffix in (".ts", ".tsx")


def has_comments(path: Path) -> bool:
    """Whether comments of this file are checked: sources of all that is built, their tables, and tests."""
    if path.parts[0] not in COMMENTED:
        return False
    if path in RULES_AND_THEIR_TEST or path.parts[:2] == ("tools", "generate"):
        return False
    if path.parts[0] == "tests" and path.suffix == ".toml":  # broken board files and the like
        return False
    return path.suffix in (".c", ".h", ".S", ".py", ".ts", ".tsx", ".toml") and path.stem != "generated"


def check_comments(path: Path, text: str) -> list[Problem]:
    """The rules for comments over one file, and over messages of a test."""
    found = []
    messages = _test_messages(text) if "tests" in path.parts[:2] and path.suffix == ".py" else ()
    for line, comment in (*_comments(path.suffix, text), *messages):
        words = CODE_SPAN.sub("", NEXT_LINE.sub(" ", comment))
        for rule in RULES:
            if rule.for_comments and (match := rule.pattern.search(words)):
                found.append(Problem(path, line, f'"{match[0].strip()}": write {rule.better}'))
    return found


def _comments(suffix: str, text: str) -> Iterator[tuple[int, str]]:
    if suffix == ".py":
        yield from _python_comments(text)
    elif suffix == ".toml":
        for number, line in enumerate(text.splitlines(), 1):
            if match := HASH.search(line):
                yield number, match[0]
    else:
        for match in STRING_OR_COMMENT.finditer(text):
            if match["comment"]:
                yield text.count("\n", 0, match.start()) + 1, match["comment"]


def _python_comments(text: str) -> Iterator[tuple[int, str]]:
    for token in tokenize.generate_tokens(io.StringIO(text).readline):
        if token.type == tokenize.COMMENT:
            yield token.start[0], token.string
    for doc in _docstrings(ast.parse(text)):
        if isinstance(doc, ast.Constant) and isinstance(doc.value, str):
            yield doc.lineno, doc.value


def _test_messages(text: str) -> Iterator[tuple[int, str]]:
    """What a test prints when it fails or is skipped."""
    for node in ast.walk(ast.parse(text)):
        said: ast.expr | None = None
        if isinstance(node, ast.Assert):
            said = node.msg
        elif isinstance(node, ast.Call) and ast.unparse(node.func) in ("pytest.skip", "pytest.fail") and node.args:
            said = node.args[0]
        for part in ast.walk(said) if said is not None else ():
            if isinstance(part, ast.Constant) and isinstance(part.value, str):
                yield part.lineno, part.value


def check_text(path: Path, text: str) -> list[Problem]:
    """The rules over the messages or the prose of one file."""
    found = []
    for line, words in _texts(path.suffix, text):
        for rule in RULES:
            if match := rule.pattern.search(words):
                found.append(Problem(path, line, f'"{match[0].strip()}": write {rule.better}'))
    return found


def _texts(suffix: str, text: str) -> Iterator[tuple[int, str]]:
    if suffix == ".md":
        return _prose(text)
    if suffix == ".py":
        return _python_messages(text)
    if suffix in (".ts", ".tsx"):
        return enumerate(ONE_WORD.sub("", _without(TYPESCRIPT_COMMENT, text)).splitlines(), 1)
    return _c_messages(text)


def _prose(text: str) -> Iterator[tuple[int, str]]:
    """Lines outside of code blocks, without the code in them: messages are checked where they are made."""
    is_code = False
    for number, line in enumerate(text.splitlines(), 1):
        if FENCE.match(line):
            is_code = not is_code
        elif not is_code:
            yield number, CODE_SPAN.sub("", line)


def _c_messages(text: str) -> Iterator[tuple[int, str]]:
    for number, line in enumerate(_without(COMMENT, text).splitlines(), 1):
        for match in C_STRING.finditer(line):
            if TWO_WORDS.search(match[1]):
                yield number, match[1]


def _without(comment: re.Pattern[str], text: str) -> str:
    """The text with its comments gone and its lines where they were."""
    return comment.sub(lambda match: "\n" * match[0].count("\n"), text)


def _python_messages(text: str) -> Iterator[tuple[int, str]]:
    """Strings, f-strings without their values, and the docstrings of commands, which are their help."""
    tree = ast.parse(text)
    silent = {id(doc) for doc in _docstrings(tree)}
    for node in ast.walk(tree):
        if isinstance(node, ast.Constant) and isinstance(node.value, str) and id(node) not in silent:
            for offset, line in enumerate(node.value.split("\n")):
                yield node.lineno + offset, line


def _docstrings(tree: ast.AST) -> Iterator[ast.expr]:
    """Docstrings that no user reads: all but those of commands."""
    for node in ast.walk(tree):
        if isinstance(node, ast.Module | ast.ClassDef | ast.FunctionDef | ast.AsyncFunctionDef):
            first = node.body[0] if node.body else None
            if isinstance(first, ast.Expr) and not _is_command(node):
                yield first.value


def _is_command(node: ast.AST) -> bool:
    decorators = node.decorator_list if isinstance(node, ast.FunctionDef) else []
    return any(re.search(r"\b(command|group)\(", ast.unparse(decorator)) for decorator in decorators)
