"""`--send`: the printed settings reach the controller."""

from __future__ import annotations

from core_bridge import FAST, Bridge

WAVES = ("--feed", "2400", "--waves", "8", "--distance", "7.75", "--first", "12", "--last", "4")


def test_the_settings_are_sent(tune):
    with Bridge(settings=FAST) as bridge:
        code, out, err = tune("measure", "--axis", "y", *WAVES, "--send", "--to", bridge.target)
        assert code == 0 and out.splitlines()[-1] == "$171=2 $181=41.30 $191=0.022"
        assert "shaper_hz.y ($181)" in err and "3 changed" in err
        for name, value in (
            ("shaper.y", "2"),
            ("shaper_hz.y", "41.30"),
            ("shaper_damping.y", "0.022"),
            ("shaper.x", "0"),
        ):
            assert tune.main("settings", "get", name, "--to", bridge.target)[1].strip() == value


def test_nothing_is_sent_without_being_asked(tune, monkeypatch):
    monkeypatch.setenv("WIFICNC_TO", "tcp://127.0.0.1:1")
    assert tune("measure", *WAVES)[0] == 0


def test_a_controller_that_is_not_there(tune):
    code, _, err = tune("measure", *WAVES, "--send", "--to", "tcp://127.0.0.1:1")
    assert code == 4 and "error:" in err
