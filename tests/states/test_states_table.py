"""The table of states has a cell for everything that exists: states of the core, bytes, `$` lines, inputs, events."""

from __future__ import annotations

import html
import re
from itertools import product
from pathlib import Path

import pytest
from generate.states import CODE, COLUMNS, OUTPUT, cells_html, document
from generate.states_table import BYTES, PATH, Table, load_states, parse_states
from generate.wire_table import WireTable, parse_wire
from state_machine import SITUATIONS
from wificnc.connection.wmc3.layout import Refusal
from wificnc.tables.nvs import load_nvs
from wificnc.tables.settings import load_settings

ROOT = Path(__file__).parents[2]
TABLE = load_states()
WIRE = parse_wire((ROOT / "protocol/wmc3.toml").read_text(encoding="utf-8"), load_settings(), load_nvs())
TEXT = PATH.read_text(encoding="utf-8")
NOTHING = ("", "unchanged", "unchanged", "unchanged")


def source(name: str) -> str:
    return (ROOT / "core" / name).read_text(encoding="utf-8")


def missing_states(table: Table, header: str) -> set[str]:
    """States of the core without a state of the table, and the other way round."""
    body = header.split("enum machine_state {")[1].split("}")[0]
    return (set(re.findall(r"\bMACHINE_[A-Z]+\b", body)) - {"MACHINE_STATE_COUNT"}) ^ {
        state.machine for state in table.state
    }


def missing_bytes(table: Table) -> set[int]:
    """Bytes that are in no input, or in two."""
    counts = dict.fromkeys(BYTES, 0)
    for entry in table.input:
        for byte in entry.all_bytes():
            counts[byte] = counts.get(byte, 0) + 1
    return {byte for byte, count in counts.items() if count != 1}


def missing_commands(table: Table, help_line: str) -> set[str]:
    """Words of the `$` help that no line of the table is an example of."""
    heads = {re.match(r"\$?[A-Z$#]*", (entry.line or ""))[0] for entry in table.input if entry.line is not None}
    heads |= {re.sub(r"\d.*", "", entry.line or "") + "x=val" for entry in table.input if entry.name == "set"}
    words = help_line.split("[HLP:")[1].split("]")[0].split()
    known = {"$Nx=line": "$N", "$J=line": "$J", "$RST=$": "$RST"}
    realtime = {"~", "!", "?", "ctrl-x"}
    return {word for word in words if word not in realtime and known.get(word, word) not in heads}


def test_every_state_of_the_core_has_one() -> None:
    assert missing_states(TABLE, source("machine/states.h")) == set()


def test_every_byte_is_of_one_input() -> None:
    assert missing_bytes(TABLE) == set()


def test_every_command_of_the_help_has_an_input() -> None:
    assert missing_commands(TABLE, source("machine/command.c")) == set()


def missing_packets(table: Table, wire: WireTable) -> set[str]:
    """Packets that a host may send and that are in no input, and such that do not exist. One stands for all that only
    ask."""
    sent = {packet.name for packet in wire.packet if packet.sender == "host" and not packet.only_asks}
    return (sent | {"ping"}) ^ {name for entry in table.packets for name in entry.packets}


def test_every_packet_of_a_host_has_an_input() -> None:
    assert missing_packets(TABLE, WIRE) == set()


def test_every_answer_to_a_packet_exists() -> None:
    names = {"done", "reply"} | {refusal.name.lower() for refusal in Refusal}
    for state, entry in product(TABLE.states, TABLE.packets):
        assert {rule.answer for rule in TABLE.variants(state, entry.name)} <= names, (state, entry.name)


def test_every_input_line_has_an_input() -> None:
    """struct hal_inputs: what a board may have wired."""
    body = source("hal/hal.h").split("struct hal_inputs {")[1].split("};")[0]
    fields = {name for names in re.findall(r"bool ([\w, ]+);", body) for name in names.split(", ")}
    pins = {entry.pin.split("-")[0] for entry in TABLE.input if entry.pin}
    assert fields and fields <= pins, fields - pins


def test_every_cell_is_decided() -> None:
    for state, entry in product(TABLE.states, TABLE.inputs):
        rule = TABLE.cell(state, entry)
        answered = TABLE.inputs[entry].line is not None or TABLE.inputs[entry].packets or TABLE.inputs[entry].server
        assert rule.answer or not answered, f"{entry} in {state} has no answer"


def test_no_rule_is_covered_by_others() -> None:
    """A rule that decides nothing says something that is not so."""
    deciding = {
        id(rule) for state, entry in product(TABLE.states, TABLE.inputs) for rule in TABLE.variants(state, entry)
    }
    idle = [rule for rule in TABLE.rule if id(rule) not in deciding]
    assert not idle, idle[0]


def test_every_difference_has_a_reason() -> None:
    assert [rule for rule in TABLE.rule if rule.source == "ours" and not rule.why] == []


def test_every_state_is_walked_from() -> None:
    assert {situation.split(",")[0] for situation in SITUATIONS} == set(TABLE.states)


def test_the_document_is_fresh_and_has_each_state() -> None:
    text = (ROOT / OUTPUT).read_text(encoding="utf-8")
    assert text == document(TABLE)
    assert re.findall(r"^\| (\w+) \| `", text, re.MULTILINE) == [state.name for state in TABLE.state]


def test_the_site_has_each_cell_that_does_something() -> None:
    """Each as many times as it has variants; inputs with the same rule share a row."""
    rows = re.findall(r"<tr><td>(.*)</td></tr>", cells_html(TABLE))
    found = {state: {row for row in rows if row.startswith(f"{state}</td>")} for state in TABLE.states}
    for state, name in product(TABLE.states, TABLE.inputs):
        rules = TABLE.variants(state, name)
        acts = any((rule.answer, rule.next, rule.motion, rule.outputs) != NOTHING for rule in rules)
        entry = TABLE.inputs[name]
        shown = CODE.sub(r"<code>\1</code>", html.escape(entry.help, quote=False))
        lines = "any line" if entry.line is not None else shown
        assert not acts or any(shown in row or lines in row for row in found[state]), (state, name)
    assert len([row for row in rows if row.startswith("tool</td>")]) == len(TABLE.tool)
    assert all(row.count("<td>") == len(COLUMNS) - 1 for row in rows)


# ---- the checks above find what is missing ----


def test_a_new_state_is_found() -> None:
    header = source("machine/states.h").replace("MACHINE_STATE_COUNT", "MACHINE_PARK,\n    MACHINE_STATE_COUNT", 1)
    assert missing_states(TABLE, header) == {"MACHINE_PARK"}


def test_a_byte_without_an_input_is_found() -> None:
    text = TEXT.replace('bytes = ["0xA1"]', 'bytes = ["0xA0"]')
    assert missing_bytes(parse_states(text)) == {0xA0, 0xA1}


def test_a_new_packet_is_found() -> None:
    text = TEXT.replace('packets = ["reset"]', 'packets = ["jog"]')
    assert missing_packets(parse_states(text), WIRE) == {"reset"}


def test_a_new_command_is_found() -> None:
    assert missing_commands(TABLE, "[HLP:$$ $Q $SLP]") == {"$Q"}


@pytest.mark.parametrize(
    ("wrong", "message"),
    [('state = "nowhere"', "unknown state nowhere"), ('state = "idle"\ninput = "kick"', "unknown input kick")],
)
def test_a_wrong_name_is_found(wrong: str, message: str) -> None:
    rule = f"{TEXT}\n[[rule]]\n{wrong}\n" + ("" if "input" in wrong else 'input = "*"\n') + 'source = "grbl"\n'
    with pytest.raises(ValueError, match=message):
        parse_states(rule).cell("idle", "move")
