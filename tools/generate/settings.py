"""What follows from protocol/settings.toml: its C table, the ESP32's keys, docs/settings.md.

Same table, same bytes: no time, no host, no path in the output.
"""

from __future__ import annotations

from pathlib import Path

import jinja2
from wificnc.tables.settings import AXES, EFFECTS, Setting, parse_settings, status_codes

SOURCE = "protocol/settings.toml"
STATUS_HEADER = "core/gcode/status.h"

# generated file -> template
OUTPUTS = {
    "core/settings/settings_gen.h": "settings_gen.h.j2",
    "core/settings/settings_table.c": "settings_table.c.j2",
    "docs/settings.md": "settings.md.j2",
    "targets/esp32/store/nvs_keys.c": "nvs_keys.c.j2",
}
NVS_TYPES = {"bool": "U8", "u8": "U8", "u16": "U16", "float": "FLOAT"}
C_TYPES = {"bool": "bool", "u8": "uint8_t", "u16": "uint16_t", "float": "float"}


def c_number(value: float) -> str:
    """A limit or default of the descriptor table: `3` or `0.002F`."""
    return str(int(value)) if value == int(value) else f"{value!r}F"


def plain(value: float) -> str:
    """A number for people: no trailing zeros, no exponent."""
    return f"{value:.6f}".rstrip("0").rstrip(".")


def numbers(row: Setting) -> str:
    """`$0`, or `$100..$105` for a per-axis row."""
    return f"${row.number}" + (f"..${row.number + row.count - 1}" if row.per_axis else "")


def span(row: Setting) -> str:
    """`3..255`; nothing for on/off."""
    return "" if row.type == "bool" else f"{plain(row.min)}..{plain(row.max)}"


def effects(row: Setting) -> str:
    """`0x003`: bits of enum setting_effect."""
    return f"0x{sum(1 << EFFECTS.index(name) for name in row.affects):03X}"


def wire_keys(row: Setting) -> str:
    """`0x0100`, or `0x0001..0x0006` for a per-axis row."""
    first = row.wire.key if row.wire else 0
    return f"0x{first:04X}" + (f"..0x{first + row.count - 1:04X}" if row.per_axis else "")


def environment() -> jinja2.Environment:
    """Templates with our filters; a name that a template misspells is an error."""
    env = jinja2.Environment(
        loader=jinja2.FileSystemLoader(Path(__file__).with_name("templates")),
        undefined=jinja2.StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
        keep_trailing_newline=True,
        autoescape=False,  # C and Markdown
    )
    env.filters.update({f.__name__: f for f in (c_number, plain, numbers, span, effects, wire_keys)})
    return env


def render(source: str, status_header: str) -> dict[str, str]:
    """All generated files from the texts of SOURCE and STATUS_HEADER: path in the repository -> text.

    Raises ValueError when a row names an answer that Grbl does not have.
    """
    status = status_codes(status_header)
    rows = parse_settings(source).setting
    for row in rows:
        if row.below not in status:
            raise ValueError(f"${row.number} {row.name}: {STATUS_HEADER} has no {row.below}")
    types = {"c_type": C_TYPES, "nvs_type": NVS_TYPES}
    values = {"source": SOURCE, "rows": rows, "status": status, "axes": AXES.lower(), "effects": EFFECTS, **types}
    env = environment()
    return {path: env.get_template(template).render(values) for path, template in OUTPUTS.items()}


def texts(root: Path) -> dict[str, str]:
    """All of them: path in the repository -> text."""
    return render(*((root / path).read_text(encoding="utf-8") for path in (SOURCE, STATUS_HEADER)))
