"""An option that has an effect only with another one, or against another one, is refused and never ignored."""

from __future__ import annotations

from pathlib import Path

import pytest
from click.testing import CliRunner
from wificnc.app import root
from wificnc.errors import UserError

NO_PORT = ("--to", "tcp://127.0.0.1:1")
ESP, PIC = ("flash", "esp32-wroom32", "--from", "."), ("flash", "pic32mz2048efh100", "--from", ".")
OTA = (*ESP, "--ota", "127.0.0.1:1")
ALONE = [
    (("nvs", "build", "shapeoko3", "-o", "out", "--wifi-password", "12345678"), "--wifi-password", "--ssid"),
    (("nvs", "read", "job.nc", "--port", "COM3"), "--port", "FILE"),
    (("nvs", "read", "job.nc", "-o", "-", "--show-secrets"), "--show-secrets", "table"),
    (("nvs", "read", "job.nc", "-o", "-", "--json"), "--json", "stdout"),
    (("send", "job.nc", *NO_PORT, "--safe-z", "5"), "--safe-z", "--from-line"),
    (("send", "job.nc", *NO_PORT, "--start-id", "A1"), "--start-id", "--from-line"),
    (("send", "job.nc", *NO_PORT, "--spindle-wait", "4"), "--spindle-wait", "--from-line"),
    (("send", "job.nc", *NO_PORT, "--plunge-feed", "5"), "--plunge-feed", "--from-line"),
    (("send", "job.nc", *NO_PORT, "--yes"), "--yes", "--from-line"),
    (("sim", "job.nc", "--laser-w", "5"), "--laser-w", "picture"),
    (("settings", "export", "out", *NO_PORT, "--json"), "--json", "FILE"),
    (("settings", "diff", "shapeoko3", "mpcnc", *NO_PORT), "--to", "controller"),
    ((*ESP, "--other-board"), "--other-board", "--ota"),
    ((*ESP, "--key", "x" * 12), "--key", "--ota"),
    ((*ESP, "--tool", "uhb"), "--tool", "PIC32MZ"),
    ((*OTA, "--erase"), "--erase", "--ota"),
    ((*OTA, "--port", "COM3"), "--port", "--ota"),
    ((*OTA, "--baud", "115200"), "--baud", "--ota"),
    ((*OTA, "--no-verify"), "--verify", "--ota"),
    ((*OTA, "--wait", "1"), "--wait", "--ota"),
    ((*PIC, "--baud", "115200"), "--baud", "PIC32MZ"),
    ((*PIC, "--wait", "1"), "--wait", "PIC32MZ"),
    ((*PIC, "--no-verify"), "--verify", "PIC32MZ"),
    ((*PIC, "--key", "x" * 12), "--key", "PIC32MZ"),
    ((*PIC, "--ota", "127.0.0.1:1"), "--ota", "PIC32MZ"),
]


@pytest.mark.parametrize(("arguments", "option", "other"), ALONE)
def test_it_is_refused(
    arguments: tuple[str, ...], option: str, other: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    Path("job.nc").write_text("G0X1\n")
    error = CliRunner().invoke(root, list(arguments)).exception
    assert isinstance(error, UserError), error
    assert option in error.message and other in error.message
    assert not Path("out").exists()


def test_a_variable_of_the_environment_is_no_option(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("WIFICNC_KEY", "x" * 12)
    monkeypatch.setenv("WIFICNC_TO", "tcp://127.0.0.1:1")
    assert CliRunner().invoke(root, ["settings", "diff", "shapeoko3", "mpcnc"]).exit_code == 1
    error = CliRunner().invoke(root, [*ESP[:3], str(tmp_path)]).exception
    assert "WIFICNC_KEY" not in str(error) and "--key" not in str(error)
