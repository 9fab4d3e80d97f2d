"""`wificnc boards` and `wificnc dev pins`, the pictures, and the generated files."""

from __future__ import annotations

import json
import xml.etree.ElementTree as ET
from itertools import combinations
from pathlib import Path

import pytest
from click.testing import CliRunner, Result
from generate.board_docs import board_page
from generate.board_schema import board_schema_text
from wificnc import ui
from wificnc.app import main, root
from wificnc.board import paths
from wificnc.board.header import pin_header_text
from wificnc.board.labels import label
from wificnc.board.load import find_boards, load_board
from wificnc.board.model import BoardFile, Role
from wificnc.board.picture import ROLE_COLOURS, Text, draw, svg_text

IDS = [path.stem for path in find_boards()]
INVALID = Path(__file__).parent / "invalid"
SVG = "{http://www.w3.org/2000/svg}"


def run(*args: str) -> Result:
    return CliRunner().invoke(root, list(args))


def test_list() -> None:
    result = run("boards", "list")
    assert result.exit_code == 0
    assert all(board_id in result.stdout for board_id in IDS)


@pytest.mark.parametrize("width", [80, 200])
def test_list_fits_the_terminal(monkeypatch: pytest.MonkeyPatch, width: int) -> None:
    """In a narrow one what a board is for has lines of its own, and no column of a few letters."""
    monkeypatch.setattr(ui.data, "width", width)
    lines = run("boards", "list").stdout.splitlines()
    assert max(map(len, lines)) <= width
    boards = {line.split()[0]: line for line in lines if not line.startswith(" ")}
    assert boards.keys() == {"board", *IDS} and "250 k" in boards["esp32-wroom32"]
    assert ("Six axes" in boards["esp32-wroom32"]) == (width == 200)
    words = [word for line in lines for word in line.split()]
    assert len(lines) <= 3 * len(boards) and words.count("resistors") == 1, "nothing is cut off"


def test_a_second_motor_is_shown() -> None:
    """In the list, in the details, and for programs."""
    assert "XYZ+Y2" in run("boards", "list").stdout
    shown = run("boards", "show", "pic32mz-gantry").stdout
    assert "axes XYZ+Y2, up to" in shown and "Y2 direction" in shown
    details = json.loads(run("boards", "show", "pic32mz-gantry", "--json").stdout)
    assert (details["axes"], details["second_motors"]) == (["X", "Y", "Z"], ["Y2"])


def test_a_gantry_with_one_switch_is_said_to_be_one(tmp_path: Path) -> None:
    text = load_board("host-gantry").path.read_text(encoding="utf-8")
    one = tmp_path / "one.toml"
    one.write_text(text.replace('limit_min = "P22"\nlimit_max = "P30"\n', ""), encoding="utf-8")
    assert run("boards", "check", str(one)).exit_code == 0
    shown = " ".join(run("boards", "show", str(one)).stdout.split())
    assert "Y has two motors and one switch" in shown and "difference of $27 and $201 only" in shown
    assert json.loads(run("boards", "show", str(one), "--json").stdout)["one_switch"] == ["Y"]
    assert "one switch" not in run("boards", "show", "host-gantry").stdout


def test_drivers_that_can_be_second_motors_are_shown() -> None:
    shown = " ".join(run("boards", "show", "mks-tinybee").stdout.split())
    assert "by $210 ..: Y (with its limit), Z (with its limit), A (with its limit), B (no limit: " in shown
    assert "by $210 ..: Z (with its limit)" in " ".join(run("boards", "show", "mks-tinybee-gantry").stdout.split())


def test_list_json() -> None:
    listed = json.loads(run("boards", "list", "--json").stdout)
    zero = next(board for board in listed if board["id"] == "esp32s3-zero")
    assert zero["axes"] == ["X", "Y", "Z"]
    assert zero["timing"]["step_pulse_ns"] == 1800
    assert zero["memory"] == {"mode": "quad", "flash_mb": [4], "psram_mb": [2]}


def test_show_tells_pins_risks_and_deviations() -> None:
    result = run("boards", "show", "esp32-wroom32")
    assert result.exit_code == 0
    assert "X step" in result.stdout and "GPIO25" in result.stdout
    assert "GPIO12 B step, strapping: " in result.stdout
    assert "output.spindle_enable: published GPIO5, here GPIO17: " in result.stdout


def test_show_lists_what_the_board_lacks() -> None:
    """With the answer that a program gets; the site has a table of all boards."""
    shown = run("boards", "show", "esp32-wroom32").stdout
    assert "RC servo ($85): error:135" in shown and "mist coolant (M7, 0xA1): a message once in a program" in shown
    lacking = {row["what"] for row in json.loads(run("boards", "show", "esp32s3-zero", "--json").stdout)["lacks"]}
    assert {"mist coolant", "RC servo"} <= lacking
    assert not lacking & {"laser", "flood coolant", "spindle speed", "spindle encoder", "digital outputs"}
    assert json.loads(run("boards", "show", "host", "--json").stdout)["lacks"] == []


def test_show_json_of_a_file() -> None:
    shown = json.loads(run("boards", "show", str(paths.BOARDS / "pic32mz2048efh100.toml"), "--json").stdout)
    pins = {pin["signal"]: pin for pin in shown["pins"]}
    assert pins["limit_x_max"] == {
        "signal": "limit_x_max",
        "pin": "RA7",
        "number": 7,
        "direction": "in",
        "active": "high",
        "pull": "down",
        "allow": {},
    }


def test_check_all_boards() -> None:
    result = run("boards", "check")
    assert (result.exit_code, result.stdout) == (0, f"{len(IDS)} boards without a problem\n")


def test_check_fails_with_exit_code_3_and_a_summary() -> None:
    result = run("boards", "check", "host", str(INVALID / "strapping.toml"), str(INVALID / "taken.toml"))
    assert result.exit_code == 3
    assert "strapping.toml:26: input.estop: GPIO0 must read high" in result.stdout
    assert result.stdout.endswith("2 problems in 2 of 3 boards\n")


def test_check_json() -> None:
    result = run("boards", "check", "--json", str(INVALID / "used-twice.toml"))
    assert result.exit_code == 3
    (problem,) = json.loads(result.stdout)
    assert (problem["rule"], problem["line"], problem["key"]) == ("used-twice", 26, "input.probe")
    assert problem["file"].endswith("used-twice.toml")


def test_unknown_board_ends_with_exit_code_3_and_a_hint(capsys: pytest.CaptureFixture[str]) -> None:
    with pytest.raises(SystemExit) as caught:
        main(["boards", "show", "hosst"])
    assert caught.value.code == 3
    assert "did you mean host?" in capsys.readouterr().err


def test_pins_to_stdout_and_to_a_file(tmp_path: Path) -> None:
    expected = pin_header_text(load_board("esp32s3-zero"))
    assert run("dev", "pins", "esp32s3-zero").stdout == expected
    target = tmp_path / "pin_config.h"
    assert "wrote" in run("dev", "pins", "esp32s3-zero", "-o", str(target)).stderr
    assert target.read_text(encoding="utf-8") == expected
    assert "unchanged" in run("dev", "pins", "esp32s3-zero", "-o", str(target)).stderr


def test_pins_of_a_broken_board_writes_nothing(tmp_path: Path) -> None:
    target = tmp_path / "pin_config.h"
    with pytest.raises(SystemExit) as caught:
        main(["dev", "pins", str(INVALID / "strapping.toml"), "-o", str(target)])
    assert caught.value.code == 3
    assert not target.exists()


@pytest.mark.parametrize("board_id", IDS)
def test_picture_shows_every_signal_beside_its_pin(board_id: str) -> None:
    board = load_board(board_id)
    picture = ET.fromstring(svg_text(draw(board)))
    words = [text.text or "" for text in picture.iter(f"{SVG}text")]
    for use in board.uses():
        assert label(use.signal) in words
        assert any(word.split(" (")[0] == use.pin for word in words)
    for role in {use.role for use in board.uses()}:
        assert role.value in words


def test_texts_of_a_picture_stay_inside_it() -> None:
    for board_id in IDS:
        picture = draw(load_board(board_id))
        for shape in picture.shapes:
            x, y = (shape.x1, shape.y1) if hasattr(shape, "x1") else (shape.x, shape.y)
            assert 0 <= x <= picture.width and 0 <= y <= picture.height


def test_every_role_has_its_own_colour() -> None:
    assert set(ROLE_COLOURS) == set(Role)
    assert len(set(ROLE_COLOURS.values())) == len(Role)


def covered(text: Text) -> tuple[float, float, float, float]:
    """Left, right, top and bottom, by the widths of DejaVu Sans."""
    width = len(text.text) * text.size * (0.67 if text.bold else 0.6)
    left = text.x - {"start": 0.0, "middle": width / 2, "end": width}[text.anchor]
    return left, left + width, text.y - text.size / 2, text.y + text.size / 2


@pytest.mark.parametrize("board_id", IDS)
def test_texts_of_a_picture_do_not_cover_each_other(board_id: str) -> None:
    texts = [shape for shape in draw(load_board(board_id)).shapes if isinstance(shape, Text) and shape.text]
    for one, other in combinations(texts, 2):
        a, b = covered(one), covered(other)
        apart = a[1] <= b[0] or b[1] <= a[0] or a[3] <= b[2] or b[3] <= a[2]
        assert apart, (one.text, other.text)


@pytest.mark.parametrize(("name", "magic"), [("out.svg", b"<svg "), ("out.png", b"\x89PNG\r\n")])
def test_show_writes_a_picture(name: str, magic: bytes, tmp_path: Path) -> None:
    target = tmp_path / name
    assert run("boards", "show", "esp32s3-zero", "--picture", str(target)).exit_code == 0
    assert target.read_bytes().startswith(magic)


def test_picture_of_another_kind_is_refused(tmp_path: Path) -> None:
    with pytest.raises(SystemExit) as caught:
        main(["boards", "show", "host", "--picture", str(tmp_path / "out.pdf")])
    assert caught.value.code == 2


def test_docs_tell_every_deviation_and_every_risk() -> None:
    for path in find_boards():
        board = load_board(path)
        text = board_page(board)
        assert all(item.why in text for item in board.deviation)
        assert all(reason in text for use in board.uses() for reason in use.wire.allow.values())


def test_schema_knows_every_key_and_takes_a_bare_pin() -> None:
    schema = json.loads(board_schema_text())
    assert set(schema["properties"]) == {field.alias or name for name, field in BoardFile.model_fields.items()}
    assert schema["additionalProperties"] is False
    kinds = [kind["type"] for kind in schema["$defs"]["OutputWire"]["anyOf"]]
    assert kinds == ["string", "object"]
