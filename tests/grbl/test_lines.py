"""Checklist 4.1: boot, banner, lines. Each test quotes its line."""

from __future__ import annotations

from pathlib import Path

import pytest
from grbl_host import BANNER, LOCKED, Grbl


def test_banner_on_power_up_and_after_every_soft_reset(grbl: Grbl) -> None:
    r"""Banner is `\r\nGrbl 1.1h ['$' for help]\r\n` on power-up and after **every** soft reset."""
    fresh = Grbl()
    assert fresh.send("") == BANNER
    fresh.close()
    for _ in range(3):
        assert grbl.send("\x18") == BANNER


def test_check_limits_after_the_banner(grbl: Grbl) -> None:
    """After the banner: `[MSG:Check Limits]` if a limit is active and hard limits on."""
    grbl.input("limit-y", True)
    assert grbl.send("\x18") == BANNER
    grbl.fine("$21=1")
    assert grbl.send("\x18") == BANNER + "[MSG:Check Limits]\r\n" + LOCKED


def test_unlock_message_and_no_startup_lines_in_alarm_or_sleep(grbl: Grbl) -> None:
    """`[MSG:'$H'|'$X' to unlock]` when in Alarm or Sleep (startup lines then do **not** run)."""
    grbl.fine("$N0=G20")
    grbl.send("$SLP\n")
    assert grbl.send("\x18") == BANNER + LOCKED
    assert "G21" in grbl.send("$G\n")
    assert grbl.send("\x18") == BANNER + LOCKED


def test_startup_lines_run_and_print(grbl: Grbl) -> None:
    """Each `$N` line runs and prints `>LINE:ok` (no space; verified `>G20:ok`)."""
    grbl.fine("$N0=g20", "$N1=G 91 (relative)")
    assert grbl.send("\x18") == BANNER + ">G20:ok\r\n>G91:ok\r\n"
    assert "G20 G91" in grbl.send("$G\n")


def test_a_startup_line_that_fails_says_so(grbl: Grbl) -> None:
    """Each `$N` line runs and prints its answer; one that was fine when stored can fail later."""
    grbl.fine("F100", "$N0=G1")
    assert grbl.send("\x18") == BANNER + ">G1:error:22\r\n"


def test_power_up_with_homing_is_alarm(tmp_path: Path) -> None:
    """Power-up with $22=1 = Alarm; **soft** reset from Idle keeps Idle."""
    store = tmp_path / "settings"
    first = Grbl(store=store)
    first.send("$22=1\n")
    assert first.send("\x18") == BANNER and first.state() == "Idle"
    first.close()
    second = Grbl(store=store)
    assert second.send("") == BANNER + LOCKED and second.state() == "Alarm"
    second.close()


def test_damaged_settings_are_reported_before_the_banner(tmp_path: Path) -> None:
    """7 settings read failed, defaults used: settings checksum failure prints `error:7` and a full `$$` dump *before*
    the banner."""
    store = tmp_path / "settings"
    first = Grbl(store=store)
    first.send("$110=1234\n$N0=G20\n")
    first.close()
    image = bytearray(store.read_bytes())
    image[20] ^= 1
    store.write_bytes(image)
    second = Grbl(store=store)
    said = second.send("")
    assert said.startswith("error:7\r\n$0=1\r\n") and "$110=1234.000\r\n" in said
    damaged = "[MSG:Stored data is damaged: settings $1. Check $$ $# $N, then $ACK]\r\n"
    assert "$132=200.000\r\n" in said and said.endswith("\r\n" + BANNER + damaged)
    assert second.send("$N\n").startswith("$N0=G20\r\n")
    second.close()


@pytest.mark.parametrize(
    ("text", "lines"), [("\n", 1), ("\r", 1), ("\r\n", 1), ("G0\r\n", 1), ("\r\n\r\n", 2), ("\n\n", 2)]
)
def test_ends_of_lines(grbl: Grbl, text: str, lines: int) -> None:
    r"""`\n` **and** `\r` each end a line. An empty line answers `ok`. Recommendation: accept CRLF as one."""
    assert grbl.send(text) == "ok\r\n" * lines


def test_what_is_stripped(grbl: Grbl) -> None:
    """Stripped while storing: characters <= space, `/`, everything in `( )`, everything after `;`; letters upper-
    cased."""
    assert grbl.send("/ g \t9 1 (x;y) ; G0 X5\n") == "ok\r\n"
    assert "G91" in grbl.send("$ g\n") and grbl.position()[0] == 0


def test_the_stored_length(grbl: Grbl) -> None:
    """257 stored characters give error:11 (Grbl: 80); 100 spaces or a 110-character comment are fine."""
    assert grbl.send("G0X" + "0" * 253 + "\n") == "ok\r\n"
    assert grbl.send("G0X" + "0" * 254 + "\n") == "error:11\r\n"
    assert grbl.send("$$" + "X" * 300 + "\n") == "error:11\r\n"
    assert grbl.send(" " * 100 + "G0\n(" + "c" * 110 + ")G0\n") == "ok\r\n" * 2


@pytest.mark.parametrize(
    ("line", "answer"),
    [
        ("%G0", "error:1"),
        ("X+1", "ok"),
        ("X--1", "error:2"),
        ("X1.2.3", "error:1"),
        ("X1e2", "error:20"),
        ("N10000001", "error:27"),
        ("N-1", "error:4"),
        ("N5", "ok"),
        ("G0X1*32", "error:1"),
        ("[1]", "error:1"),
    ],
)
def test_characters_and_numbers(grbl: Grbl, line: str, answer: str) -> None:
    """`%`: error:1 (alone: see test_marks_of_a_program). Number grammar. `N`: > 10,000,000 error:27, negative error:4;
    alone is ok. `*` `#` `[` error:1."""
    assert grbl.send(line + "\n") == answer + "\r\n"


@pytest.mark.parametrize("line", ["%", " % ", "N1%", "O1000", "o0001 (BRACKET)", "N10 O7", ":1000", "O123456789012"])
def test_marks_of_a_program(grbl: Grbl, line: str) -> None:
    """`%`, `O1000`, `:1000` alone in a line: ok, nothing happens: some senders pass on what CAM programs write."""
    grbl.fine("G0X1")
    assert grbl.send(line + "\n") == "ok\r\n"
    assert grbl.send("$G\n").startswith("[GC:G0 ")
    assert grbl.send(line + "\nG0X2\n") == "ok\r\n" * 2


@pytest.mark.parametrize(
    ("line", "answer"),
    [("O100 sub", 120), ("o100 call", 120), ("O100 G0 X1", 120), ("O", 120), ("O1.5", 120), ("o<name>", 120),
     (":", 1), (":12X1", 1), ("%%", 1), ("G0O100", 20), ("$J=O100", 22)],
)  # fmt: skip
def test_no_marks_of_a_program(grbl: Grbl, line: str, answer: int) -> None:
    """Only a lone number is the program's: an O word that jumps, or words after the number, are never dropped."""
    assert grbl.send(line + "\n") == f"error:{answer}\r\n"


def test_digits_of_a_number(grbl: Grbl) -> None:
    """Only 8 digits kept, says Grbl; here the 9th and those behind it count too."""
    grbl.send("$100=10000\n")  # its top speed is clamped and that is reported
    grbl.fine("G0X12.34567891")
    assert grbl.position()[0] == 123457
    grbl.fine("G0X0", "G91", *["G0X.0000500000001"] * 2)
    assert grbl.position()[0] == 1


def test_order_of_checks(grbl: Grbl) -> None:
    """Check order for a line: overflow (11) > empty (ok) > `$` > Alarm/Jog lock (error:9) > G-code."""
    grbl.send("$SLP\n")
    grbl.send("\x18")
    assert grbl.state() == "Alarm"
    assert grbl.send("G0" + "X" * 300 + "\n") == "error:11\r\n"
    assert grbl.send("\n") == "ok\r\n"
    assert grbl.send("$Z\n") == "error:2\r\n"
    assert grbl.send("nonsense\n") == "error:9\r\n"
    grbl.send("$X\n")
    assert grbl.send("nonsense\n") != "error:9\r\n"


def test_jog_lock(grbl: Grbl) -> None:
    """Check order for a line: ... Alarm/Jog lock (error:9) > G-code: a jog is not disturbed by a program."""
    assert grbl.after(0.2, "$J=X-30F1000\n") == "ok\r\n"
    assert grbl.after(0.01, "G0X5\nnonsense\n") == "error:9\r\n" * 2
    grbl.send("")
    assert grbl.position()[0] == -30 * 250


def test_the_answers_do_not_depend_on_how_the_bytes_come() -> None:
    """Whole lines and single bytes take different ways through the controller."""
    text = (
        "G1 X1 F600\r\nX2 Y1\r(c)X3\n\n\r\n x4;c\nX5 5\nX6X6\nG20 X.25\rY 1\nG55\nG0 X1e2\n$G\nN7 G90 G21 X"
        + "0" * 90
        + "\nX9\n"
    )
    results = []
    for size in (1, 2, 3, 7, len(text)):
        grbl = Grbl()
        grbl.send("")
        said = ""
        for at in range(0, len(text), size):
            said += grbl.send(text[at : at + size])
        results.append((said, grbl.position()))
        grbl.close()
    assert results.count(results[0]) == len(results)


def test_a_startup_line_is_checked_as_any_other_line(grbl: Grbl) -> None:
    """What the machine refuses in a program it neither executes nor stores as a startup line."""
    grbl.send("$83=1\n$80=2\n$81=100\n$82=100\n")
    for line in ("M64 P0", "G0 X500 Y500"):
        refused = grbl.send(f"{line}\n")
        assert refused.startswith("error:")
        assert grbl.send(f"$N0={line}\n") == refused
        assert "$N0=\r\n" in grbl.send("$N\n")
    assert "<Idle" in grbl.send("?")
