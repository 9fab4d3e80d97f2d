"""Where a program ends in its file, and what is not run: protocol/vectors/program_end.json, in the core's simulator and
in what `wificnc send` sends. web/test/program.test.ts has the same cases."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import pytest
from sim_native import job_lines, program_end
from wificnc.build.host import ensure_host_library
from wificnc.job.expand import Start, expand, load_expand
from wificnc.job.program import code_of, read_program

VECTORS = Path(__file__).resolve().parents[2] / "protocol" / "vectors" / "program_end.json"
CASES = json.loads(VECTORS.read_text(encoding="utf-8"))["cases"]
by_case = pytest.mark.parametrize("case", CASES, ids=[case["name"] for case in CASES])
FIGURES = ("line", "unrun", "first", "second")


def text_of(case: dict[str, Any], end: str = "\n") -> bytes:
    return end.join(case["lines"]).encode()


def figures(ending: object) -> dict[str, int]:
    return {name: getattr(ending, name) for name in FIGURES}


@by_case
@pytest.mark.parametrize("end", ["\n", "\r\n", "\r"])
def test_the_simulator(library, case, end):
    text = text_of(case, end)
    _, numbers, *_ = job_lines(library, text)
    coded = [number for number in numbers if code_of(case["lines"][number - 1].encode())]
    marks = [number for number in coded if number not in case["run"]]
    assert [number for number in coded if number in case["run"]] == case["run"]
    assert all(code_of(case["lines"][number - 1].encode())[:1] in (b"O", b"N") for number in marks)
    assert figures(program_end(library, text)) == {name: case[name] for name in FIGURES}


@by_case
def test_the_sender(case):
    program = read_program("job.nc", text_of(case))
    assert [line.number for line in program.lines] == case["run"]
    assert figures(program.ending) == {name: case[name] for name in FIGURES}
    assert bool(program.ending.words) == bool(case["unrun"])


@pytest.mark.parametrize(
    ("lines", "run", "found"),
    [
        # M2 in a branch ends the program where it is executed, and nothing can be said of the rest
        (["#1=1", "o1 if [#1 GT 0]", "G0X1", "M2", "o1 endif", "G0X2"], [3, 4], (0, 0, 0, 0)),
        (["#1=0", "o1 if [#1 GT 0]", "M2", "o1 endif", "G0X2", "M2", "G0X3"], [5, 6], (6, 1, 7, 0)),
        # subroutines may follow the end; they are no part of the way
        (["o<t> call", "M2", "o<t> sub", "G0X1", "o<t> endsub"], [4, 2], (0, 0, 0, 0)),
        (["o<t> call", "M2", "o<t> sub", "G0X1", "o<t> endsub", "G0X9"], [4, 2], (2, 1, 6, 0)),
        # nothing after the closing % belongs to the program
        (["%", "o1 repeat [2]", "G0X1", "o1 endrepeat", "%", "G0X9"], [3, 3], (5, 1, 6, 0)),
        (["%", "o1 repeat [2]", "G0X1", "o1 endrepeat", "M30", "%", "O2", "G0X9"], [3, 3, 5], (5, 1, 8, 7)),
    ],
)
def test_programs_with_o_words(lines, run, found):
    library = load_expand(ensure_host_library())
    done = expand(library, "job.ngc", "\n".join(lines).encode(), Start.AT_ZERO)
    assert [number for number in done.numbers if "#" not in lines[number - 1]] == run
    ending = done.ending
    assert (ending.line if ending.unrun else 0, ending.unrun, ending.first, ending.second) == found


def test_a_subroutine_after_the_closing_percent_does_not_exist():
    library = load_expand(ensure_host_library())
    text = b"%\no<t> call\n%\no<t> sub\nG0X1\no<t> endsub\n"
    with pytest.raises(Exception, match="error:123"):
        expand(library, "job.ngc", text, Start.AT_ZERO)
