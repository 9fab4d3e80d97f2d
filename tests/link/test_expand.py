"""Programs with O words on their way to a controller: what is known while they are expanded, and what is refused."""

from __future__ import annotations

import ctypes
import json
from pathlib import Path

import pytest
from click.testing import CliRunner
from core_bridge import Bridge
from wificnc.app import root
from wificnc.build.host import ensure_host_library
from wificnc.commands.send import job_program
from wificnc.errors import JobError
from wificnc.job.expand import LINES_MAX, Start, expand, load_expand, needs_expansion
from wificnc.job.program import LONGEST_CODE, ready
from wificnc.simulator.job import JobRequest, SimResult, Timing, run_job
from wificnc.simulator.library import load_library

EXAMPLE = Path(__file__).resolve().parents[2] / "examples" / "bolt_circle.ngc"
LOOP = "G90 G21 F600\no1 repeat [2]\n#1=[#1+1]\nG0 X#1\no1 endrepeat\nG0 X0\nM2\n"


@pytest.fixture(scope="module")
def library() -> ctypes.CDLL:
    return load_expand(ensure_host_library())


def lines(library: ctypes.CDLL, text: str, start: Start = Start.ANYWHERE, lines_max: int = LINES_MAX) -> list[str]:
    return expand(library, "job.nc", text.encode(), start, lines_max).text.decode().split()


def refusal(library: ctypes.CDLL, text: str, start: Start = Start.ANYWHERE, lines_max: int = LINES_MAX) -> str:
    with pytest.raises(JobError) as caught:
        lines(library, text, start, lines_max)
    return caught.value.message


# -- the lines


def test_lines_and_where_they_came_from(library: ctypes.CDLL) -> None:
    expanded = expand(library, "job.nc", LOOP.encode(), Start.ANYWHERE)
    assert expanded.text == b"G90G21F600\nG0X1\nG0X2\nG0X0\nM2\n"
    assert expanded.numbers == (1, 4, 4, 6, 7)


def test_the_end_of_the_program_ends_it(library: ctypes.CDLL) -> None:
    assert lines(library, "G0X1\nM30\nG0X2\no1 if [1/0]\no1 endif") == ["G0X1", "M30"]


def test_values_have_six_decimals_or_fewer_where_the_line_is_full(library: ctypes.CDLL) -> None:
    assert lines(library, "X[1/3] Y[-2/3] Z0.123456789") == ["X0.333333Y-0.666667Z0.123456789"]
    full = "".join(f"{letter}[-100000/3]" for letter in "XYZABC")
    (line,) = lines(library, full + "K[1/3]")
    assert line == full.replace("[-100000/3]", "-33333.3333") + "K0.3333" and len(line) == LONGEST_CODE
    assert lines(library, full + "K[10/3]I[1]") == [full.replace("[-100000/3]", "-33333.3333") + "K3.3333I1"]
    assert "error:11 " in refusal(library, "X[1/3]" * 40)  # 280 characters with four decimals


def test_what_is_no_g_code_goes_through(library: ctypes.CDLL) -> None:
    """The controller refuses it with its own words."""
    assert lines(library, "$H\nG999\nX1 Y\n$J=G91X1F100") == ["$H", "G999", "X1Y", "$J=G91X1F100"]


def test_an_endless_loop(library: ctypes.CDLL) -> None:
    said = refusal(library, "G0X1\no1 while [1]\n#1=[#1+1]\no1 endwhile", lines_max=1000)
    assert said.startswith("job.nc:2: error:127 ")
    assert "error:127" in refusal(library, "o1 do\nG0X1\no1 while [1]")


@pytest.mark.parametrize(
    ("text", "needed"),
    [
        ("G0X1", False), ("#1=2\nX[#1]", False), ("(o1 sub)\nG0X1", False), ("; o1 if [1]", False),
        ("O1234\nG0X1", False),
        ("o1 sub\no1 endsub", True), ("N5 o1 call", True), ("G0X1\n  o<a> IF [1]", True), ("o1 call (last line)", True),
    ],
)  # fmt: skip
def test_which_files_need_it(library: ctypes.CDLL, text: str, needed: bool) -> None:
    assert needs_expansion(library, text.encode()) is needed


# -- what is known of the machine


@pytest.mark.parametrize(
    ("text", "read"),
    [
        ("G21", "#<_metric>"), ("G20", "#<_imperial>"), ("G90", "#<_absolute>"), ("G91", "#<_incremental>"),
        ("G18", "#<_plane>"), ("G55", "#5220"), ("G55", "#<_coord_system>"), ("G94", "#<_units_per_minute>"),
        ("G90.1", "#<_ijk_absolute_mode>"), ("G0", "#<_motion_mode>"), ("M3", "#<_spindle_on>"), ("M9", "#<_flood>"),
        ("G99", "#<_retract_r_plane>"), ("S100", "#<_rpm>"), ("G94 F100", "#<_feed>"), ("T3", "#<_selected_tool>"),
        ("T3 M6", "#5400"), ("T3 M6", "#<_current_tool>"),
        ("G90 G0 X1", "#5420"), ("G90 G0 X1", "#<_x>"), ("G90 G0 C7", "#<_c>"), ("G90 G0 X1\nG91 X2", "#<_x>"),
        ("G90 G54 G0 X1", "#<_x>"), ("G21 G90 G0 X1", "#<_x>"), ("G90 G0 X1\nG21\nX2", "#<_x>"),
        ("G90 G0 X0 Y0\nG2 X2 I1 F100", "#<_x>"), ("G90 G0 X1\nG4 P0", "#<_x>"),
    ],
)  # fmt: skip
def test_what_a_program_has_set_it_may_read(library: ctypes.CDLL, text: str, read: str) -> None:
    assert lines(library, f"{text}\n#1={read}")
    assert refusal(library, f"#1={read}").startswith("job.nc:1: error:129 ")


@pytest.mark.parametrize(
    ("text", "read"),
    [
        ("G90 G0 X1", "#5221"), ("G90 G0 X1", "#5161"), ("G90 G0 X1", "#5211"), ("G90 G0 X1", "#5210"),
        ("G90 G0 X1", "#5021"), ("G90 G0 X1", "#<_abs_x>"), ("G90 G0 X1", "#<_y>"), ("G0 X1", "#<_x>"),
        ("G91 G0 X1", "#<_x>"), ("G90 G0 X1\nG55", "#<_x>"), ("G90 G0 X1\nG92 X0", "#<_x>"),
        ("G90 G0 X1\nG10 L2 P1 X0", "#<_x>"), ("G90 G0 X1\nG53 G0 X1", "#<_x>"), ("G90 G0 X1\nG28", "#<_x>"),
        ("G90 G0 Z1\nG43.1 Z1", "#<_z>"), ("G90 G0 X1\nG21", "#<_x>"), ("G90 G38.2 X1 F10", "#<_x>"),
        ("G90 G38.2 X1 F10", "#5061"), ("G90 G38.3 X1 F10", "#5070"), ("G90 G0 Z5\nG81 X1 Z-1 R1 F10", "#<_z>"),
        ("F100", "#<_feed>"), ("M70\nG20\nM72", "#<_metric>"), ("G94 F100\nG20", "#<_feed>"), ("M8", "#<_mist>"),
        ("M6", "#5400"), ("M66P0", "#5399"),
        ("T3 M6", "#5403"), ("G43", "#<_tool_offset>"), ("M48", "#<_feed_hold>"),
    ],
)  # fmt: skip
def test_what_only_the_machine_knows(library: ctypes.CDLL, text: str, read: str) -> None:
    assert "error:129 " in refusal(library, f"{text}\n#1={read}")
    assert "error:129 " in refusal(library, f"{text}\no1 if [{read} GT 100000]\no1 endif")


def test_at_zero_all_is_known_but_a_probe(library: ctypes.CDLL) -> None:
    text = "#1=[#<_x>+#5221+#5061*0]\n"
    assert "error:129 " in refusal(library, text, Start.AT_ZERO)
    assert lines(library, "G10L2P1X5\nG0X[#<_x>+#5221+#<_abs_x>]", Start.AT_ZERO) == ["G10L2P1X5", "G0X0"]
    assert lines(library, "M70\nG20\nM72\nG0X#<_metric>", Start.AT_ZERO)[-1] == "G0X1"
    assert "error:129 " in refusal(library, "G38.2X5F10\nG92X0\n#1=#5211", Start.AT_ZERO)
    assert lines(library, "G38.2X5F10\nG0X2\nY#<_x>", Start.AT_ZERO)[-1] == "Y2"


def test_exists_asks_nothing_of_the_machine(library: ctypes.CDLL) -> None:
    assert lines(library, "X[EXISTS[#<_x>]] Y[EXISTS[#<no>]]") == ["X1Y0"]


@pytest.mark.parametrize("line", ["$H", "$J=G91X1F100", "G2 X9 I1 F100", "G1 X3", "X"])
def test_a_line_that_cannot_be_followed_makes_all_unknown(library: ctypes.CDLL, line: str) -> None:
    """The arc may be one on the machine, and the feed may be set."""
    assert "error:129 " in refusal(library, f"G90 G0 X1 Y1\n{line}\n#1=#<_x>")


# -- the commands


def run(*arguments: str) -> tuple[int, str, str]:
    result = CliRunner().invoke(root, list(arguments))
    if isinstance(result.exception, JobError):
        raise result.exception
    return result.exit_code, result.stdout, result.stderr


def test_expand_writes_what_send_takes(tmp_path: Path) -> None:
    out = tmp_path / "plain.nc"
    assert run("expand", str(EXAMPLE), "-o", str(out))[0] == 0
    assert run("expand", str(EXAMPLE), "-o", "-")[1].encode() == out.read_bytes()
    assert run("expand", str(out), "-o", "-")[1].encode() == out.read_bytes(), "plain lines stay"


def test_expand_numbers_lines_by_the_file(tmp_path: Path) -> None:
    job = tmp_path / "job.nc"
    job.write_text(LOOP + "")
    assert run("expand", str(job), "-o", "-", "--number")[1].split() == [
        "N1G90G21F600",
        "N4G0X1",
        "N4G0X2",
        "N6G0X0",
        "N7M2",
    ]


def test_a_failed_expansion_writes_nothing(tmp_path: Path) -> None:
    job, out = tmp_path / "job.nc", tmp_path / "out.nc"
    job.write_text("G0X1\no1 if [1/0]\no1 endif\n")
    with pytest.raises(JobError, match=r"job\.nc:2: error:102"):
        run("expand", str(job), "-o", str(out))
    assert not out.exists()


def test_send_expands(bridge: Bridge, monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    monkeypatch.setenv("WIFICNC_TO", bridge.target)
    job = tmp_path / "job.nc"
    job.write_text(LOOP.replace("G0 X0", "G0 Y#1"))
    code, stdout, _ = run("send", str(job), "--json")
    document = json.loads(stdout)
    assert (code, document["end"], document["lines_answered"]) == (0, "finished", 5)
    assert document["machine_position"] == {"X": 2.0, "Y": 2.0, "Z": 0.0}


def test_send_names_the_line_of_the_file(bridge: Bridge, monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    monkeypatch.setenv("WIFICNC_TO", bridge.target)
    job = tmp_path / "job.nc"
    job.write_text("G21 G90\n\no1 repeat [2]\nG1 X[1+1]\no1 endrepeat\n")
    code, stdout, stderr = run("send", str(job), "--json")
    assert json.loads(stdout)["errors"][0] == {"line": 4, "code": 22, "text": "G1X2"}
    assert code != 0 and "wificnc expand" in stderr and "--from-line" not in stderr


@pytest.mark.parametrize("text", [LOOP, "#1=5\nG0X#1\nG0X2\n", "G0X[1+1]\nG0X2\nX3\n"])
def test_a_program_that_computes_is_not_resumed(text: str, tmp_path: Path) -> None:
    job = tmp_path / "job.nc"
    job.write_text(text)
    with pytest.raises(JobError, match="cannot be resumed"):
        run("send", str(job), "--from-line", "3", "--to", "tcp://127.0.0.1:1")


# -- the simulator


def simulated(text: str, **more: object) -> SimResult:
    request = JobRequest("job.nc", text.encode(), Timing(20_000_000, 1000, 500, 200_000, 3), **more)
    return run_job(load_library(ensure_host_library()), request)


def test_sim_runs_what_expand_writes(library: ctypes.CDLL) -> None:
    text = EXAMPLE.read_text()
    program = simulated(text)
    plain = simulated(expand(library, "x", text.encode(), Start.AT_ZERO).text.decode())
    assert program.errors == () and program.step_events == plain.step_events > 0
    assert program.final_position_steps == plain.final_position_steps
    assert program.lines == text.count("\n")


def test_sim_says_which_line_of_the_file_is_wrong() -> None:
    (error,) = simulated("G21\n\no1 repeat [3]\nG1 X1\no1 endrepeat\n").errors
    assert (error.line, error.code, error.text) == (4, 22, "G1 X1")
    (error,) = simulated("G0 X1\no1 if [1/0]\no1 endif\n").errors
    assert (error.line, error.code) == (2, 102)


def test_sim_bounds_endless_loops() -> None:
    result = simulated("G0 X1\no1 while [1]\n#1=[#1+1]\no1 endwhile\n", lines_max=100)
    assert [(error.line, error.code) for error in result.errors] == [(2, 127)]
    assert result.step_events == 0
    kept = simulated("G0 X1\no1 while [1]\n#1=[#1+1]\no1 endwhile\n", lines_max=100, keep_going=True)
    assert kept.step_events > 0 and len(kept.errors) == 1


# -- comments that the controller keeps or shows

TOOLS = """o100 repeat [2]
#1 = [#1 + 1]
G10 L1 P[#1] Z[5 * #1] (flat 6 mm) ; mine
T#1 M6 (Fräser!)
G1 X#1 F100 (cut)
o100 endrepeat
"""


def test_texts_of_tools_and_of_tool_changes_stay(library: ctypes.CDLL, tmp_path: Path) -> None:
    """As in a file without O words: in what is sent, and in what `wificnc expand` writes."""
    sent = [line.wire.decode().strip() for line in ready(job_program("tools.nc", TOOLS.encode(), LINES_MAX).lines)]
    expected = ["G10L1P1Z5(flat 6 mm)", "T1M6(Fraser)", "G1X1F100", "G10L1P2Z10(flat 6 mm)", "T2M6(Fraser)", "G1X2F100"]
    assert sent == [f"N{number}{line}" for number, line in zip((3, 4, 5) * 2, expected, strict=True)]
    job = tmp_path / "tools.nc"
    job.write_text(TOOLS, encoding="utf-8")
    for options, written in (([], expected), (["--number"], sent)):
        done = CliRunner().invoke(root, ["expand", str(job), "-o", "-", *options])
        assert done.exit_code == 0 and done.stdout.split("\n")[:-1] == written


def test_a_text_of_a_tool_that_cannot_be_sent_is_refused(library: ctypes.CDLL) -> None:
    with pytest.raises(JobError, match=r"tools\.nc:2: a tool's text has letters"):
        job_program("tools.nc", b"o1 repeat [1]\nG10 L1 P[1] Z1 (6 mm!)\no1 endrepeat\n", LINES_MAX)
