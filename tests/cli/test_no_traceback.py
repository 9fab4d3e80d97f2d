"""Whatever a file holds and wherever the output goes, a command says what is wrong: a traceback is a fault of ours."""

from __future__ import annotations

import os
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path

import pytest
from patience import HANG_S

Cli = Callable[..., tuple[int, str, str]]

DIGITS = "9" * 5000  # more than Python converts
NOWHERE = "tcp://127.0.0.1:1"
# Commands with a file of each kind; {0} is the file, {job} a good one.
TOML = {
    "boards check": ("boards", "check", "{0}"),
    "boards show": ("boards", "show", "{0}"),
    "dev pins": ("dev", "pins", "{0}", "-o", "-"),
    "build": ("build", "{0}"),
    "sim --machine": ("sim", "{job}", "--machine", "{0}"),
    "sim --board": ("sim", "{job}", "--board", "{0}"),
    "check --machine": ("check", "{job}", "--machine", "{0}"),
    "settings import": ("settings", "import", "{0}", "-y", "--to", NOWHERE),
    "settings diff": ("settings", "diff", "baseline", "{0}"),
    "nvs build": ("nvs", "build", "{0}", "-o", "-"),
    "serve --machine": ("serve", "--tcp", "127.0.0.1:0", "--machine", "{0}"),
    "linuxcnc init": ("linuxcnc", "init", "{0}", "--to", "192.0.2.1", "--out", "made"),
}
YAML = {"boards import": ("boards", "import", "{0}", "-o", "made.toml", "--machine", "made-machine.toml")}
JSON = {"flash --from": ("flash", "esp32s3-zero", "--dry-run", "--from", "{0}")}
OTHERS = {
    "nvs read": ("nvs", "read", "{0}"),
    "nvs diff": ("nvs", "diff", "{0}", "{0}"),
    "tune log": ("tune", "log", "{0}"),
    "sim": ("sim", "{0}"),
    "settings import": TOML["settings import"],
}
BAD_TOML = {
    "digits": f"schema = {DIGITS}\n",
    "digits with underscores": f"schema = 1\nname = -{'9_' * 5000}9\n",
    "digits of a setting": f"schema = 1\n[settings]\nidle_delay_ms = {DIGITS}\n",
    "a number that no float holds": f"schema = 1\n[axis.x]\nmax_rate_mm_min = {'9' * 400}\n",
    "infinite": "schema = 1\n[settings]\nidle_delay_ms = inf\n[axis.x]\nmax_rate_mm_min = nan\n",
    "deep": f"a = {'[' * 20000}",
    "bytes": "\0" * 1000,
    "digits of $": f"$110={DIGITS}\n$22={DIGITS}\n",
    "empty": "",
    "comments": "# schema = 1\n",
}
BAD_YAML = {
    "digits": f"name: x\naxes:\n  x:\n    steps_per_mm: {DIGITS}\n    max_rate_mm_per_min: 1e999\n",
    "digits of a pin": f"axes:\n  x:\n    motor0:\n      stepstick:\n        step_pin: gpio.{DIGITS}\n",
    "deep": f"axes: {'{a: ' * 5000}",
}
BAD_JSON = {
    "digits": f'{{"board": {DIGITS}}}',
    "deep": "[" * 200_000,
    "another shape": '{"board": 1, "artefacts": {"a": [[]]}}',
    "bytes": "\0",
}


def run(cli: Cli, words: tuple[str, ...], file: Path, folder: Path) -> tuple[int, str]:
    job = folder / "job.nc"
    job.write_text("G91G1X1F600\n")
    code, out, err = cli(*(word.format(file, job=job) for word in words))
    assert "Traceback" not in err
    return code, out + err


# Arguments with a number in place of {0}.
NUMBERS = {
    "nvs build --set": ("nvs", "build", "baseline", "-o", "-", "--set", "p_sx={0}"),
    "nvs build --set of a mask": ("nvs", "build", "baseline", "-o", "-", "--set", "io_dir={0}"),
    "sim --set": ("sim", "{job}", "--set", "$110={0}"),
    "sim --set of a number": ("sim", "{job}", "--set", "${0}=1"),
    "sim --at": ("sim", "{job}", "--at", "{0}s hold"),
    "check --work-zero": ("check", "{job}", "--work-zero", "X{0}"),
    "check --max-lines": ("check", "{job}", "--max-lines", "{0}"),
    "settings set": ("settings", "set", "$110={0}", "--to", NOWHERE),
    "serve --tcp": ("serve", "--tcp", "127.0.0.1:{0}"),
    "serve --pendant": ("serve", "--tcp", "off", "--pendant", "tcp:{0}"),
    "serve --control": ("serve", "--tcp", "off", "--control", "{0}"),
    "serve --speed": ("serve", "--tcp", "off", "--speed", "{0}"),
    "status --to": ("status", "--to", "127.0.0.1:{0}"),
    "status --to of a serial port": ("status", "--to", "/dev/ttyNONE?baud={0}"),
    "jog": ("jog", "X{0}", "--to", NOWHERE),
    "wmc3 --to": ("wmc3", "info", "127.0.0.1:{0}"),
}


@pytest.fixture(autouse=True)
def _elsewhere(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)


@pytest.mark.parametrize("command", TOML)
@pytest.mark.parametrize("kind", BAD_TOML)
def test_a_bad_toml_file(cli: Cli, tmp_path: Path, command: str, kind: str) -> None:
    (tmp_path / "bad.toml").write_text(BAD_TOML[kind])
    code, err = run(cli, TOML[command], tmp_path / "bad.toml", tmp_path)
    assert code in (2, 3)
    if kind == "digits":
        assert "bad.toml:1: has a number of more than 4,300 digits" in err


def test_the_line_of_a_number_with_too_many_digits(cli: Cli, tmp_path: Path) -> None:
    (tmp_path / "bad.toml").write_text(BAD_TOML["digits of a setting"])
    assert "bad.toml:3: " in run(cli, TOML["settings diff"], tmp_path / "bad.toml", tmp_path)[1]


@pytest.mark.parametrize("kind", BAD_YAML)
def test_a_bad_yaml_file(cli: Cli, tmp_path: Path, kind: str) -> None:
    (tmp_path / "bad.yaml").write_text(BAD_YAML[kind])
    code, _ = run(cli, YAML["boards import"], tmp_path / "bad.yaml", tmp_path)
    assert code in (2, 3)


@pytest.mark.parametrize("kind", BAD_JSON)
def test_a_bad_json_file(cli: Cli, tmp_path: Path, kind: str) -> None:
    (tmp_path / "build.json").write_text(BAD_JSON[kind])
    code, err = run(cli, JSON["flash --from"], tmp_path, tmp_path)
    assert code == 6 and "build.json is damaged" in err


@pytest.mark.parametrize("command", NUMBERS)
def test_an_argument_of_more_digits_than_python_converts(cli: Cli, tmp_path: Path, command: str) -> None:
    assert run(cli, NUMBERS[command], Path(DIGITS), tmp_path)[0] in (2, 4)


@pytest.mark.skipif(not Path("/dev/zero").exists(), reason="no /dev/zero")
@pytest.mark.parametrize("command", ["settings import", "nvs read", "boards check"])
def test_a_file_without_an_end(cli: Cli, tmp_path: Path, command: str) -> None:
    code, err = run(cli, {**TOML, **OTHERS}[command], Path("/dev/zero"), tmp_path)
    assert code in (2, 3) and "is larger than" in err


@pytest.mark.parametrize("command", OTHERS)
@pytest.mark.parametrize("content", [b"", bytes(range(256)) * 40, b"3," + DIGITS.encode(), b"\xff\xfe" * 500])
def test_a_bad_file_of_another_kind(cli: Cli, tmp_path: Path, command: str, content: bytes) -> None:
    (tmp_path / "bad").write_bytes(content)
    assert run(cli, OTHERS[command], tmp_path / "bad", tmp_path)[0] in (1, 2, 6)


@pytest.mark.skipif(sys.platform in ("win32", "darwin"), reason="its names of files are Unicode")
@pytest.mark.parametrize(
    "words",
    [("sim",), ("sim", "--json", "-"), ("check", "--machine", "baseline"), ("boards", "check"), ("nvs", "read")],
)
@pytest.mark.parametrize("exists", [True, False])
def test_a_name_that_is_not_utf8(tmp_path: Path, words: tuple[str, ...], exists: bool) -> None:
    file = os.fsencode(tmp_path) + b"/a\xff.nc"
    if exists:
        Path(os.fsdecode(file)).write_text("G91G1X1F600\n")
    environment = {**os.environ, "PYTHONIOENCODING": "utf-8:strict"}
    command = [sys.executable, "-m", "wificnc", *words, file]
    done = subprocess.run(command, capture_output=True, env=environment, timeout=HANG_S, check=False)
    assert done.returncode in (0, 1, 2, 3, 6) and b"Traceback" not in done.stderr


# ---- where the output goes ----

SAYS = {
    "table": ("boards", "list"),
    "json": ("boards", "list", "--json"),
    "help": ("--help",),
    "bytes": ("dev", "pins", "host", "-o", "-"),
    "version": ("--version",),
}


@pytest.mark.skipif(not Path("/dev/full").exists(), reason="no /dev/full")
@pytest.mark.parametrize("what", SAYS)
def test_a_full_disk(what: str) -> None:
    with open("/dev/full", "wb") as full:
        command = [sys.executable, "-m", "wificnc", *SAYS[what]]
        done = subprocess.run(command, stdout=full, stderr=subprocess.PIPE, text=True, timeout=HANG_S, check=False)
    assert (done.returncode, done.stderr.strip()) == (2, "error: cannot write the output: No space left on device")


@pytest.mark.skipif(not Path("/dev/full").exists(), reason="no /dev/full")
def test_a_full_disk_of_messages_keeps_the_exit_code() -> None:
    with open("/dev/full", "wb") as full:
        command = [sys.executable, "-m", "wificnc", "boards", "show", "no-such-board"]
        done = subprocess.run(command, stdout=full, stderr=full, timeout=HANG_S, check=False)
    assert done.returncode == 3


def test_a_reader_that_has_gone_is_no_error() -> None:
    read, write = os.pipe()
    os.close(read)
    command = [sys.executable, "-m", "wificnc", "boards", "list", "--json"]
    done = subprocess.run(command, stdout=write, stderr=subprocess.PIPE, text=True, timeout=HANG_S, check=False)
    os.close(write)
    assert done.stderr == "" and done.returncode in (0, 1)


@pytest.mark.parametrize(
    ("typed", "meant"),
    [("simm", "sim"), ("sends", "send"), ("board", "boards"), ("Serve", "serve"), ("setings", "settings")],
)
def test_a_misspelt_command_has_a_suggestion(cli: Cli, typed: str, meant: str) -> None:
    code, _, err = cli(typed)
    assert code == 2 and f"No such command '{typed}'. Did you mean '{meant}'?" in " ".join(err.split())


@pytest.mark.parametrize("typed", ["xyzzy", "signing-ke", "--simm"])
def test_no_suggestion_where_nothing_is_near(cli: Cli, typed: str) -> None:
    code, _, err = cli(typed)
    assert code == 2 and "Did you mean 'signing" not in err and "Traceback" not in err
