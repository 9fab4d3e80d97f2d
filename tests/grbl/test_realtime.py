"""Checklist 4.5: real-time bytes. Each test quotes its line."""

from __future__ import annotations

import re

import pytest
from grbl_host import BANNER, LOCKED, Grbl


@pytest.mark.parametrize("byte", ["\x86", "\x9f", "\xff", "\x98", "\xa2"])
def test_unknown_bytes_vanish(grbl: Grbl, byte: str) -> None:
    r"""Any byte >= 0x80 is removed from the stream: known ones act, unknown ones vanish (`G0\x86X0` = ok)."""
    assert grbl.send(f"G0{byte}X1\n") == "ok\r\n" and grbl.position()[0] == 250


@pytest.mark.parametrize("byte", ["?", "!", "~", "\x84", "\x85", "\x91", "\x96", "\xa0"])
def test_known_bytes_act_in_the_middle_of_a_line(grbl: Grbl, byte: str) -> None:
    """Any byte >= 0x80 is removed from the stream: known ones act."""
    said = grbl.send(f"G0{byte}X1\n") + grbl.send("~")
    assert said.endswith("ok\r\n") and "error" not in said and grbl.position()[0] == 250


def test_hold_in_jog_is_cancel(grbl: Grbl) -> None:
    """`!` in Jog = cancel; in Alarm and Check ignored."""
    grbl.after(0.3, "$J=G91X-50F1000\n")
    assert grbl.send("!") == "" and grbl.state() == "Idle"
    assert -50 * 250 < grbl.position()[0] < 0
    grbl.send("$C\n")
    grbl.send("!")
    assert grbl.state() == "Check"
    grbl.send("\x18")
    grbl.send("$SLP\n")
    grbl.send("\x18")
    grbl.send("!")
    assert grbl.state() == "Alarm"


def test_a_status_says_what_came_with_it_has_done(grbl: Grbl) -> None:
    """However many requests one packet brings, the report shows the machine behind all of them."""
    assert grbl.send("!?").startswith("<Hold:0|")
    assert grbl.send("~?").startswith("<Idle|")
    assert "|Ov:110,50,90" in grbl.send("\x91\x96\x9b?")


def test_hold_in_idle_keeps_the_queue_waiting(grbl: Grbl) -> None:
    """Idle + `!` = Hold:0 and the queue waits until `~`."""
    grbl.send("!")
    assert grbl.state() == "Hold:0"
    assert grbl.after(1, "$J=X1F100\nG0X1\n") == "" and grbl.position()[0] == 0
    assert grbl.send("~") == "ok\r\nerror:9\r\n" and grbl.position()[0] == 250


def test_hold_says_when_it_stands(grbl: Grbl) -> None:
    """States and sub-states: Hold:1 slows down, Hold:0 is at rest."""
    grbl.after(0.3, "G1X-30F3000\n")
    grbl.after(0.005, "!")
    assert grbl.state() == "Hold:1"
    grbl.after(1)
    assert grbl.state() == "Hold:0"
    held = grbl.position()
    grbl.after(5)
    assert grbl.position() == held
    grbl.send("~")
    assert grbl.position()[0] == -30 * 250


def test_hold_stops_a_dwell(grbl: Grbl) -> None:
    """Feed hold acts in a dwell too: its time advances after `~`."""
    grbl.after(0.5, "G4P1\n")
    assert grbl.after(3, "!") == "" and grbl.state() == "Hold:0"
    assert grbl.after(0.4, "~") == ""
    assert grbl.after(0.2) == "ok\r\n"


def test_door_byte_in_a_pause(grbl: Grbl) -> None:
    """0x84 in Hold:0 (after M0) becomes Door:0 and prints `[MSG:Check Door]` even with the door pin closed; one `~`
    then clears both and the M0 line's `ok` comes."""
    grbl.send("M0\n")
    assert grbl.send("\x84") == "[MSG:Check Door]\r\n" and grbl.state() == "Door:0"
    assert grbl.send("~") == "ok\r\n" and grbl.state() == "Idle"


def test_door_byte_in_alarm(grbl: Grbl) -> None:
    """0x84 in Hold:0 becomes Door:0. In Alarm it does nothing."""
    grbl.send("$SLP\n")
    grbl.send("\x18")
    assert grbl.send("\x84") == "" and grbl.state() == "Alarm"


def test_jog_cancel(grbl: Grbl) -> None:
    """0x85 acts only in Jog: decelerates and flushes; state returns to Idle, no message."""
    grbl.after(0.3, "G1X-20F1000\n")
    grbl.send("\x85")
    assert grbl.position()[0] == -20 * 250
    grbl.after(0.3, "$J=X0F1000\n")
    assert grbl.state() == "Jog"
    assert grbl.send("\x85") == "" and grbl.state() == "Idle"
    assert -20 * 250 < grbl.position()[0] < 0 and grbl.position() == grbl.stands()


@pytest.mark.parametrize("cancel", ["\x85", "!"])
def test_queued_jogs_are_flushed(grbl: Grbl, cancel: str) -> None:
    """Known race: a jog line already in RX runs after the cancel - fix by flushing *queued* `$J=` lines."""
    jog = "$J=G91X-.1F1000\n"
    said = grbl.after(0.1, jog * 64)
    said += grbl.after(0, jog * 60)
    said += grbl.send(cancel)
    assert said == "ok\r\n" * 124  # every line is answered
    assert grbl.state() == "Idle" and -3 * 250 < grbl.position()[0] < 0
    assert grbl.send("$J=X0F1000\n") == "ok\r\n" and grbl.position()[0] == 0  # a jog after it runs


def test_a_jog_that_overtakes_its_cancel(grbl: Grbl) -> None:
    """Known race: the jog and its cancel come in one packet, before the jog was read."""
    assert grbl.send("$J=G91X-50F1000\n\x85") == "ok\r\n"
    assert grbl.position()[0] == 0 and grbl.state() == "Idle"


@pytest.mark.parametrize("head", ["$", "$J", "$J=", "$J=G91X-50F10"])
def test_half_a_jog_when_its_cancel_comes(grbl: Grbl, head: str) -> None:
    """Its begin was read before the cancel: it must not run behind it. What begins behind the cancel runs."""
    jog = "$J=G91X-50F1000\n"
    grbl.send(head)
    grbl.send("\x85")
    assert grbl.send(jog.removeprefix(head)) == "ok\r\n"
    assert grbl.position()[0] == 0 and grbl.state() == "Idle"
    assert grbl.send(jog) == "ok\r\n" and grbl.position()[0] == -50 * 250


def overrides(grbl: Grbl) -> str:
    return re.search(r"Ov:([\d,]+)", "".join(grbl.status() for _ in range(12)))[1]


@pytest.mark.parametrize(
    ("data", "shown"),
    [
        ("\x91", "110,100,100"),
        ("\x91\x91\x93", "121,100,100"),
        ("\x92\x94", "89,100,100"),
        ("\x91" * 20, "200,100,100"),
        ("\x92" * 20, "10,100,100"),
        ("\x91\x91\x90", "100,100,100"),
        ("\x96", "100,50,100"),
        ("\x97", "100,25,100"),
        ("\x97\x95", "100,100,100"),
        ("\x97\x98", "100,25,100"),
        ("\x9a\x9a\x9c", "100,100,121"),
        ("\x9b\x9d", "100,100,89"),
        ("\x9b" * 20, "100,100,10"),
        ("\x9a\x99", "100,100,100"),
    ],
)
def test_override_bytes(grbl: Grbl, data: str, shown: str) -> None:
    """Feed +10 `0x91`, -10 `0x92`, +1 `0x93`, -1 `0x94`, 100 `0x90`; 10..200. Rapid 100/50/25 `0x95/96/97`, `0x98`
    nothing. Spindle `0x99`-`0x9D`."""
    grbl.send(data)
    assert overrides(grbl) == shown


@pytest.mark.parametrize("end", ["\x18", "M2\n", "M30\n"])
def test_overrides_last_until_reset_or_program_end(grbl: Grbl, end: str) -> None:
    """All kept until reset or M2/M30."""
    grbl.send("\x91\x97\x9b")
    grbl.fine("G0X1")
    assert overrides(grbl) == "110,25,90"
    grbl.send(end)
    assert overrides(grbl) == "100,100,100"


def test_feed_override_changes_the_time_of_a_move(grbl: Grbl) -> None:
    """Feed overrides act on motion: half the feed is twice the time; a jog has none."""
    times = []
    for data in ("G1X-10F300\n", "\x92" * 5 + "G1X0\n", "$J=X-10F300\n"):
        before = grbl.time()
        grbl.send(data)
        times.append(grbl.time() - before)
    assert times[1] == pytest.approx(2 * times[0], rel=0.02) and times[2] == pytest.approx(times[0], rel=0.02)


@pytest.mark.parametrize(("byte", "share"), [("\x96", 0.5), ("\x97", 0.25), ("\x95", 1.0)])
def test_rapid_override_changes_the_time_of_a_rapid(grbl: Grbl, byte: str, share: float) -> None:
    """Rapid 100/50/25 `0x95/96/97`: G0 runs at that part of its top speed, G1 as before."""
    top = 5000 / 60
    grbl.put(byte)
    for line, speed in (("G0X-200\n", top * share), ("G1X0F3000\n", 50)):
        before = grbl.time()
        grbl.send(line)
        assert grbl.time() - before == pytest.approx(200 / speed + speed / 500, rel=0.02), line


def test_spindle_override_and_stop(grbl: Grbl) -> None:
    """Spindle `0x99`-`0x9D`, `0x9E` stop only in Hold."""
    grbl.fine("M3S500")
    grbl.send("\x9e\x9a")
    assert grbl.outputs().spindle_rpm == pytest.approx(550, abs=grbl.rpm_step) and "FS:0,550" in grbl.status()
    grbl.send("!")
    grbl.send("\x9e")
    assert grbl.outputs().spindle_direction == 0 and "FS:0,0" in grbl.status()
    assert grbl.send("~") == "[MSG:Restoring spindle]\r\n"
    assert grbl.outputs().spindle_direction == 1 and grbl.outputs().spindle_rpm == pytest.approx(550, abs=grbl.rpm_step)


def test_spindle_range_and_pwm(grbl: Grbl) -> None:
    """$30 and $31 bound the speed; the PWM value is linear between them."""
    grbl.fine("$30=1000", "$31=200", "M3S2000")
    assert (grbl.outputs().spindle_rpm, grbl.outputs().spindle_duty) == (1000, 65535)
    grbl.fine("S50")
    assert (grbl.outputs().spindle_rpm, grbl.outputs().spindle_duty) == (200, 1)
    grbl.fine("S600")
    assert grbl.outputs().spindle_duty == 32768
    grbl.fine("S0")
    assert (grbl.outputs().spindle_direction, grbl.outputs().spindle_rpm, grbl.outputs().spindle_duty) == (1, 0, 0)


@pytest.mark.needs("coolant_mist")
def test_coolant_bytes(grbl: Grbl) -> None:
    """`0xA0` flood, `0xA1` mist: they toggle, also in a hold, and `$G` shows it."""
    grbl.send("\xa0")
    assert grbl.outputs().coolant == 2 and " M8 " in grbl.send("$G\n")
    grbl.send("!\xa1")
    assert grbl.outputs().coolant == 3
    grbl.send("\xa0\xa1")
    grbl.send("~")
    assert grbl.outputs().coolant == 0 and " M9 " in grbl.send("$G\n")


def test_m0(grbl: Grbl) -> None:
    """`M0` = Hold:0; its ok comes on `~`."""
    assert grbl.after(1, "M0\nG0X1\n") == "" and grbl.state() == "Hold:0"
    assert grbl.send("~") == "ok\r\nok\r\n" and grbl.position()[0] == 250


def test_sleep(grbl: Grbl) -> None:
    """`$SLP`: `ok` first, then `[MSG:Sleeping]`; state Sleep; everything but reset ignored; reset gives Alarm."""
    grbl.fine("M3S100")
    assert grbl.send("$SLP\n") == "ok\r\n[MSG:Sleeping]\r\n"
    assert grbl.state() == "Sleep" and grbl.outputs().spindle_direction == 0
    assert grbl.send("G0X1\n$X\n~!\x84\x91") == "" and grbl.state() == "Sleep"
    assert grbl.send("\x18") == BANNER + LOCKED and grbl.state() == "Alarm"


def test_check_mode(grbl: Grbl) -> None:
    """`$C`: `[MSG:Enabled]`+ok; G-code runs through the parser only (MPos stays put but modal state updates); off =
    `[MSG:Disabled]`, ok, banner."""
    assert grbl.send("$C\n") == "[MSG:Enabled]\r\nok\r\n" and grbl.state() == "Check"
    before = grbl.time()
    assert grbl.send("G91G1X-5F100\nM3S500\nG4P100\nM0\nG2X1Y1I1\nG38.2Z-1\n") == "ok\r\n" * 6
    assert grbl.time() - before < 0.1 and grbl.position()[0] == 0 and grbl.outputs().spindle_direction == 0
    assert "G91" in grbl.send("$G\n") and grbl.send("G0X1X1\n") == "error:25\r\n"
    assert grbl.send("$C\n") == "[MSG:Disabled]\r\nok\r\n" + BANNER
    assert grbl.send("G0X-1\n") == "ok\r\n" and grbl.position()[0] == -250


@pytest.mark.parametrize(
    ("what", "kept"), [("$", {"$N0=G20", "[G54:1.000"}), ("#", {"$N0=G20", "$1=7\r"}), ("*", set())]
)
def test_restore(grbl: Grbl, what: str, kept: set[str]) -> None:
    r"""`$RST=$|#|*`: `[MSG:Restoring defaults]`, ok, then a reset banner."""
    grbl.fine("$1=7", "G10L2P1X1", "$N0=G20", "$I=ME", "G21")
    said = grbl.send(f"$RST={what}\n")
    assert said.startswith("[MSG:Restoring defaults]\r\nok\r\n" + BANNER)
    now = grbl.send("$$\n$#\n$N\n$I\n")
    for text in ("$N0=G20", "$1=7\r", "[G54:1.000"):
        assert (text in now) == (text in kept), text
    assert (":ME]" in now) == (what != "*")
