"""Checklist 4.2: `ok`, errors, and the buffer. Each test quotes its line."""

from __future__ import annotations

import re

import pytest
from grbl_host import BANNER, LOCKED, RX_SIZE, Grbl


def test_ok_means_taken_by_the_planner(grbl: Grbl) -> None:
    """Each line gets exactly one `ok` or `error:N`. `ok` for a motion line = accepted (blocks while full)."""
    moves = grbl.plan_moves
    lines = moves + 21  # not in one line: collinear moves are merged, and take no room
    said = grbl.after(0.001, "G91G1F60X1\n" + "Y.1\nX.1\n" * (lines // 2))
    assert moves / 3 <= said.count("ok") <= moves  # a move takes room for three pieces of path at most
    assert said.count("ok") + grbl.send("").count("ok") == lines // 2 * 2 + 1
    assert grbl.position()[:2] == [round((1 + 0.1 * (lines // 2)) * 250), round(0.1 * (lines // 2) * 250)]


@pytest.mark.parametrize("line", ["G4P1", "M0", "G38.3Z-10F300"])
def test_dwell_and_pause_hold_their_answer(grbl: Grbl, line: str) -> None:
    """Dwell, M0 and probe hold their answer until done."""
    assert grbl.after(0.5, line + "\n") == ""
    assert grbl.send("~").split("\r\n")[-2] == "ok"


def test_a_dwell_lasts_exactly(grbl: Grbl) -> None:
    """Dwell holds its answer until done: G4 P1.5 takes 1.5 s, neither less nor more."""
    before = grbl.time()
    grbl.send("G4P1.5\n")
    assert grbl.time() - before == pytest.approx(1.5, abs=1e-4)


def test_receive_overflow_is_reported_and_every_line_answered(grbl: Grbl) -> None:
    """Never drop without saying so: lost lines are answered too, in their place (intended deviation)."""
    line, more = "G4P0\n", 30
    fit = RX_SIZE // len(line)
    lost = more - min(more, (grbl.receive_room - RX_SIZE) // len(line))  # a driver's buffer keeps some
    grbl.after(0, "G4P1\n")
    grbl.flood(line * (fit + more))
    said = grbl.send("")
    answers = [a for a in said.split("\r\n") if a == "ok" or a.startswith("error")]
    assert answers == ["ok"] * (1 + fit + more - lost) + ["error:11"] * lost
    assert said.count("[MSG:Receive buffer overflow]") == (1 if lost else 0)
    assert grbl.send("G0X1\n") == "ok\r\n" and grbl.position()[0] == 250


@pytest.mark.parametrize("end", ["\n", "\r", "\r\n"])
def test_after_an_overflow_whole_lines_come_again(grbl: Grbl, end: str) -> None:
    """Never drop without saying so: neither half a line nor the second half of a CR LF survives."""
    grbl.after(0, "G4P1\n")
    grbl.flood((" " * 30 + "G1X9" + end) * 40)
    said = grbl.send("")
    assert said.count("ok") + said.count("error:") == 41
    grbl.flood("G91" + end)
    assert grbl.send("") == "ok\r\n"
    assert grbl.position()[0] == 0


def test_an_overflow_between_cr_and_lf_makes_no_line(grbl: Grbl) -> None:
    """Each line gets exactly one answer, also when its CR found the last free byte and its LF none."""
    grbl.after(0, "G4P1\n")
    grbl.flood("G4P0\r\n" * (RX_SIZE // 6 - 1) + " " * (RX_SIZE % 6 + 6 - 3) + "G0\r" + "\n")
    said = grbl.send("")
    assert said.count("ok") == 1 + RX_SIZE // 6 and "error" not in said
    grbl.flood("G91\r\n")
    assert grbl.send("") == "ok\r\n"


def test_a_report_between_a_lost_cr_and_its_lf(grbl: Grbl) -> None:
    """Real-time bytes are no part of the stream, wherever they are."""
    grbl.flood("G4P0\n" * RX_SIZE + "G4P0\r")
    assert grbl.send("").count("\n") == RX_SIZE + 2
    grbl.flood("?")
    assert grbl.send("").startswith("<Idle")
    grbl.flood("\n")
    assert grbl.send("") == ""


@pytest.mark.parametrize("half", ["G4P", "G4P0\r"])
def test_a_reset_ends_an_overflow(grbl: Grbl, half: str) -> None:
    """What was being lost belongs to the time before the banner: the next line is a line."""
    grbl.flood("G4P0\n" * RX_SIZE + half)
    assert BANNER in grbl.send("\x18")
    grbl.flood("\n")
    assert grbl.send("") == "ok\r\n"


def test_reset_while_a_line_is_executing(grbl: Grbl) -> None:
    """A reset while a line is executing makes that line's `ok` appear **before** the banner."""
    grbl.after(0.2, "G4P1\n")
    assert grbl.send("\x18") == "ok\r\n" + BANNER
    grbl.after(0.3, "G1X-10F1000\n" + "Y-9\nX-9\nY-10\nX-10\n" * 90)
    said = grbl.send("\x18")
    assert said == "ALARM:3\r\nok\r\n" + BANNER + LOCKED


def test_a_reset_drops_all_that_came_before_its_banner(grbl: Grbl) -> None:
    """A reset drops what waits, and what comes in the quiet after its alarm: nothing behind the banner is for that."""
    grbl.after(0.3, "G1X-10F1000\n")
    assert grbl.after(0.2, "\x18$I\n") == "ALARM:3\r\n"
    assert grbl.after(0.1, "$X\n$I\nG0X") == ""
    assert grbl.send("") == BANNER + LOCKED
    assert grbl.send("$X\n") == "[MSG:Caution: Unlocked]\r\nok\r\n"


def put_in_state(grbl: Grbl, state: str) -> None:
    if state == "Alarm":
        grbl.send("$SLP\n")
    steps = {"Idle": "", "Alarm": "\x18", "Run": "G1X-20F300\n", "Jog": "$J=X-20F300\n", "Check": "$C\n"}
    grbl.after(0.6, steps[state])
    assert grbl.state() == state
    grbl.heard()


# command -> the states in which it is not error:8
REFUSALS = [
    ("$$", {"Idle", "Alarm", "Jog", "Check"}),
    ("$G", {"Idle", "Alarm", "Run", "Jog", "Check"}),
    ("$X", {"Idle", "Alarm", "Run", "Jog", "Check"}),
    ("$#", {"Idle", "Alarm"}),
    ("$I", {"Idle", "Alarm"}),
    ("$N", {"Idle", "Alarm"}),
    ("$10=1", {"Idle", "Alarm"}),
    ("$H", {"Idle", "Alarm"}),
    ("$SLP", {"Idle", "Alarm"}),
    ("$RST=#", {"Idle", "Alarm"}),
    ("$N0=", {"Idle"}),
    ("$J=X1F100", {"Idle", "Jog"}),
    ("$C", {"Idle", "Check"}),
]


@pytest.mark.parametrize("state", ["Idle", "Alarm", "Run", "Jog", "Check"])
@pytest.mark.parametrize(("command", "possible"), REFUSALS)
def test_dollar_refusals(grbl: Grbl, command: str, possible: set[str], state: str) -> None:
    """`$$` refused only in Cycle/Hold (error:8); `$G` `$X` always; `$# $H $SLP $I $RST $N $x=` Idle or Alarm, else
    error:8."""
    put_in_state(grbl, state)
    said = grbl.after(0.001, command + "\n")
    assert ("error:8" in said) == (state not in possible), said


def test_check_mode_off_resets(grbl: Grbl) -> None:
    """`$C` Idle (else 8), turning off resets."""
    grbl.fine("G91")
    assert grbl.send("$C\n") == "[MSG:Enabled]\r\nok\r\n"
    assert grbl.send("$C\n") == "[MSG:Disabled]\r\nok\r\n" + BANNER
    assert "G90" in grbl.send("$G\n")


@pytest.mark.parametrize(
    ("line", "answer"),
    [
        ("$999=1", "error:3"),
        ("$0=", "error:2"),
        ("$=", "error:2"),
        pytest.param("$0=2", "error:6", marks=pytest.mark.needs("no own pulse of 2 us")),
        ("$110=-1", "error:4"),
        ("$20=1", "error:10"),
        ("$100=1.5x", "error:3"),
        ("$256=1", "error:3"),
        ("$J", "error:3"),
        ("$J=", "error:22"),
        ("$J=X1", "error:22"),
        ("$J=X1F100M3", "error:16"),
        ("$J=G0X1F100", "error:16"),
        ("$J=X1F100S5", "error:16"),
        pytest.param("$J=A1F100", "error:20", marks=pytest.mark.needs("no axis A")),
        ("$J=F1000", "error:26"),
        ("$N1=G1X1", "error:22"),
        ("$N2=", "error:3"),
        ("$N2=G20", "error:3"),
        ("$Z", "error:2"),
        ("$G1", "error:3"),
        ("$C1", "error:3"),
        ("$#1", "error:3"),
        ("$RST", "error:3"),
        ("$RST=x", "error:3"),
        ("$H", "error:5"),
        ("$I1", "error:3"),
    ],
)
def test_errors_of_dollar_lines(grbl: Grbl, line: str, answer: str) -> None:
    """Settings: unknown `$999=1` error:3; `$=` empty value error:2; `$0=2` error:6; negative error:4; `$20=1` without
    $22 error:10; `$100=1.5x` error:3. `$J` gives error:3; `$J=`, `$J=X1` = error:22; `$J=...M3` = error:16; letter A =
    error:20; no axis word drives to machine zero: do not copy, answer error:26. (`$N2=` answers ok and writes outside):
    reply error:3. Unknown `$Z`: error:2. `$G1`, `$C1`, `$#1`, `$RST`, `$RST=x`: error:3."""
    assert grbl.send(line + "\n") == answer + "\r\n"
    assert grbl.position() == [0] * 6


def test_homing_off_switches_soft_limits_off(grbl: Grbl) -> None:
    """Turning $22 off also turns $20 off."""
    grbl.fine("$22=1", "$20=1", "$22=0")
    assert "$20=0\r\n" in grbl.send("$$\n")


def test_settings_print_formats(grbl: Grbl) -> None:
    """`$$` shows ints bare, floats 3 decimals, in **mm** always, whatever $13. They print as ints except $11 $12 $24
    $25
    $27 and $100+ (three decimals), $30 $31 as zero-decimal floats; $34 to $36 (as in grblHAL), $75, $93, $394 and $539
    one, $140+ (mA), $150+ (microsteps), $340, $341, $346, $374, $375, $395, $400, $460 to $467, $681, $744,
    $745 and $747 to $749 none. Ours: $57 to $59 three, $170+ are kinds, $180+
    Hz with two decimals, $220+ to $260+ and $746 none."""
    grbl.fine("$13=1", "$30=1000.4", "$110=5000.0004")
    rows = dict(line[1:].split("=") for line in grbl.send("$$\n").split("\r\n") if line.startswith("$"))
    for number, value in rows.items():
        decimals = {140: 0, 150: 0, 170: 0, 180: 2, 210: 0, 220: 0, 230: 0, 240: 0, 250: 0, 260: 0}.get(
            int(number) // 10 * 10, 3 if int(number) >= 100 else 0
        )
        if int(number) in (11, 12, 24, 25, 27, 40, 41, 57, 58, 59, 81, 82):
            decimals = 3
        elif int(number) in (206, 340, 341, 346, 374, 375, 395, 400, 681, *range(744, 750), *range(460, 468)):
            decimals = 0
        elif int(number) in (34, 35, 36, 75, 93, 394, 539):
            decimals = 1
        form = rf"\d+\.\d{{{decimals}}}" if decimals else r"\d+"
        assert re.fullmatch(form, value), (number, value)
    grbls = [
        *range(7),
        *range(10, 14),
        *range(20, 28),
        30,
        31,
        32,
        *(b + ax for b in (100, 110, 120, 130) for ax in range(3)),
    ]
    assert set(map(str, grbls)) <= set(rows) and [*map(int, rows)] == sorted(map(int, rows))
    assert (rows["11"], rows["30"], rows["110"]) == ("0.010", "1000", "5000.000")


def test_help(grbl: Grbl) -> None:
    """`$` help text in docs lacks `$SLP`: real Grbl's names it, and so does ours."""
    said = grbl.send("$\n")
    assert said.startswith("[HLP:$$ $# $G $I $N $x=val $Nx=line $J=line $SLP $C $X $H") and said.endswith("]\r\nok\r\n")


def test_startup_line_runs_before_it_is_stored(grbl: Grbl) -> None:
    """`$Nx=` executes its line first and stores only if that was ok (`$N1=G1X1` with no feed = error:22)."""
    assert grbl.send("$N1=G1X1\n") == "error:22\r\n"
    assert grbl.send("$N\n") == "$N0=\r\n$N1=\r\nok\r\n"
    assert grbl.send("$N1=G0X2\n") == "ok\r\n" and grbl.position()[0] == 500
    assert grbl.send("$N\n") == "$N0=\r\n$N1=G0X2\r\nok\r\n"
    assert grbl.send("$N1=\n$N\n") == "ok\r\n$N0=\r\n$N1=\r\nok\r\n"


def test_a_setting_does_not_round_the_position(grbl: Grbl) -> None:
    """Position is sacred: parts of a step survive a `$x=` between incremental moves; $100 keeps the steps."""
    grbl.fine("G91", *["G0X.0015", "$1=25"] * 8)
    assert grbl.position()[0] == 3
    grbl.fine("G90", "G0X1", "$100=125")
    assert grbl.position()[0] == 250 and "MPos:2.000," in grbl.status()
    grbl.fine("G0X0")
    assert grbl.position()[0] == 0


@pytest.mark.parametrize(("line", "answer"), [("$100", "$100=250.000\r\nok\r\n"), ("$22", "$22=0\r\nok\r\n")])
def test_a_setting_alone_is_a_question(grbl: Grbl, line: str, answer: str) -> None:
    """As in grblHAL; a number that no setting has is error:3."""
    assert grbl.send(line + "\n") == answer
    assert grbl.send("$9999\n") == "error:3\r\n"
