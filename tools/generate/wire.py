"""What follows from protocol/wmc3.toml: the codecs in C and Python, LinuxCNC's words, docs/protocol.md."""

from __future__ import annotations

from pathlib import Path

from wificnc.tables.nvs import parse_nvs
from wificnc.tables.settings import parse_settings

from generate.examples import framed, parse_examples
from generate.nvs import SOURCE as NVS_SOURCE
from generate.settings import SOURCE as SETTINGS_SOURCE
from generate.settings import environment
from generate.wire_table import WireField, parse_wire

SOURCE = "protocol/wmc3.toml"
VECTORS = "protocol/vectors/packets.toml"

# generated file -> template
OUTPUTS = {
    "core/wire/wire_gen.h": "wire_gen.h.j2",
    "core/wire/wire_gen.c": "wire_gen.c.j2",
    "core/session/rules_gen.c": "wire_rules.c.j2",
    "core/session/requests_gen.h": "wire_requests.h.j2",
    "core/session/requests_gen.c": "wire_requests.c.j2",
    "core/session/keys_gen.c": "wire_keys.c.j2",
    "core/device/device_gen.h": "device_gen.h.j2",
    "linuxcnc/words_gen.h": "wire_words.h.j2",
    "cli/wificnc/connection/wmc3/layout.py": "wire_layout.py.j2",
    "cli/wificnc/connection/wmc3/keys.py": "wire_keys.py.j2",
    "cli/wificnc/connection/wmc3/remedies.py": "wire_remedies.py.j2",
    "docs/protocol.md": "protocol.md.j2",
}
C_TYPES = {"u8": "uint8_t", "u16": "uint16_t", "u32": "uint32_t", "i8": "int8_t", "i32": "int32_t", "char": "char"}


def c_declaration(field: WireField) -> str:
    """`uint32_t duration_us` or `char name[33]`: text has room for its NUL."""
    count = field.count + 1 if field.type == "char" else field.count
    return f"{C_TYPES[field.type]} {field.name}" + (f"[{count}]" if count > 1 else "")


def c_comment(field: WireField) -> str:
    """Unit and words, if there are any."""
    words = " ".join(part for part in (f"[{field.unit}]" if field.unit else "", field.help) if part)
    return f" /* {words} */" if words else ""


def python_type(field: WireField) -> str:
    """Annotation and default of a dataclass field."""
    if field.type == "char":
        return 'str = ""'
    if field.count == 1:
        return "int = 0"
    return f"bytes = bytes({field.count})" if field.type == "u8" else f"tuple[int, ...] = (0,) * {field.count}"


def camel(name: str) -> str:
    """`stream_ack` as `StreamAck`."""
    return "".join(part.capitalize() for part in name.split("_"))


def first_sentence(text: str) -> str:
    """For a docstring of one line."""
    return text.split(". ")[0].rstrip(".") + "."


def cell(text: str) -> str:
    """For a Markdown table."""
    return text.replace("|", "\\|")


def bit(name: str, prefix: str) -> str:
    """`machine` as `NEEDS_MACHINE`."""
    return prefix + name.upper()


def bare(text: str) -> str:
    """Without Markdown's marks for code."""
    return text.replace("`", "")


def render(source: str, settings_source: str, nvs_source: str, vectors: str) -> dict[str, str]:
    """All generated files from the texts of the tables: path in the repository -> text."""
    env = environment()
    filters = (c_declaration, c_comment, python_type, camel, first_sentence, cell, bare, bit, framed)
    env.filters.update({f.__name__: f for f in filters})
    settings, nvs = parse_settings(settings_source), parse_nvs(nvs_source)
    table = parse_wire(source, settings, nvs)
    values = {
        "stored": {row.wire: row for row in nvs.channel},
        "source": SOURCE,
        "table": table,
        "examples": parse_examples(vectors, table),
        "setting": {row.name: row for row in settings.setting},
        "refusals": next(enum for enum in table.enum if enum.name == "refusal").values,
    }
    return {path: env.get_template(template).render(values) for path, template in OUTPUTS.items()}


def texts(root: Path) -> dict[str, str]:
    """All of them: path in the repository -> text."""
    sources = (SOURCE, SETTINGS_SOURCE, NVS_SOURCE, VECTORS)
    return render(*((root / path).read_text(encoding="utf-8") for path in sources))
