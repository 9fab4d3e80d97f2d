"""The pin-out of a board as a picture: laid out once, drawn as SVG (by hand) or PNG (by matplotlib, if it is there)."""

from __future__ import annotations

import io
from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Literal
from xml.sax.saxutils import escape

from wificnc.board.labels import label, remarks
from wificnc.board.model import Board, Role, Use
from wificnc.board.rules import spare_pins
from wificnc.errors import UserError
from wificnc.output import write_output

if TYPE_CHECKING:
    from matplotlib.artist import Artist

Anchor = Literal["start", "middle", "end"]
Side = Literal["left", "right"]
PLOT_ANCHORS: dict[Anchor, Literal["left", "center", "right"]] = {"start": "left", "middle": "center", "end": "right"}

ROLE_COLOURS = {
    Role.STEP: "#1f5fa8",
    Role.DIR: "#4b9cd3",
    Role.ENABLE: "#6a4fb3",
    Role.LIMIT: "#d9820a",
    Role.HOME: "#a8661f",
    Role.PROBE: "#2e8b57",
    Role.ESTOP: "#c62828",
    Role.SPINDLE: "#ad2f86",
    Role.COOLANT: "#0b8f99",
    Role.PUMP: "#7a5548",
    Role.SERVO: "#b0486b",
    Role.MISC: "#5c7c1d",
    Role.MISC_IN: "#8d7a16",
    Role.ENCODER: "#94523a",
    Role.LED: "#c2a000",
    Role.ETHERNET: "#37515f",
    Role.SERIAL: "#6d6d6d",
    Role.I2SO: "#2b4a3f",
    Role.SPINDLE_BUS: "#7d3f98",
    Role.PENDANT: "#8a5a1f",
    Role.DIAL: "#3f6d8c",
    Role.DRIVER_BUS: "#5f6b2f",
}
POWER_COLOURS = {"GND": "#222222", "3V3": "#8e1b1b", "5V": "#8e1b1b", "VIN": "#8e1b1b"}
PAPER, INK, FAINT, LINE = "#fbfbf8", "#22272b", "#70777d", "#b9bec2"
BOARD_FILL, BOARD_EDGE, SILK, GOLD = "#17493a", "#0e3026", "#e9f2ee", "#d8b24a"
SHIELD_FILL, SHIELD_EDGE = "#c9ced1", "#8f979c"

PITCH, RADIUS = 25.0, 7.0
PILL_WIDTH, PILL_HEIGHT = 148.0, 19.0
BODY_WIDTH_MIN, LEAD, MARGIN, TAG_WIDTH = 250.0, 22.0, 28.0, 190.0
GROUP_SIZE, GROUP_PAD, BOLD = 10.0, 14.0, 0.67  # of the names of groups; width of a bold character, in its size
SHIELD_TOP, ONBOARD_TOP, ONBOARD_PITCH, ONBOARD_WIDTH, GAP = 44.0, 184.0, 46.0, 92.0, 6.0
TITLE_HEIGHT, BODY_PAD, GROUP_GAP, LEGEND_PITCH = 84.0, 34.0, 34.0, 26.0
FONT, MONO = "DejaVu Sans, Verdana, Arial, sans-serif", "DejaVu Sans Mono, Menlo, Consolas, monospace"
UNITS_PER_INCH, POINTS_PER_UNIT, PNG_DPI, STROKE = 100.0, 0.72, 200, 0.8


@dataclass(frozen=True)
class Box:
    """A rectangle, with rounded corners where radius > 0."""

    x: float
    y: float
    width: float
    height: float
    fill: str
    edge: str
    radius: float = 0.0
    dashed: bool = False


@dataclass(frozen=True)
class Disc:
    x: float
    y: float
    radius: float
    fill: str
    edge: str


@dataclass(frozen=True)
class Line:
    x1: float
    y1: float
    x2: float
    y2: float
    colour: str


@dataclass(frozen=True)
class Text:
    """One line of text, centred vertically on y."""

    x: float
    y: float
    text: str
    size: float
    colour: str
    anchor: Anchor = "start"
    bold: bool = False
    mono: bool = False


Shape = Box | Disc | Line | Text


@dataclass(frozen=True)
class Picture:
    width: float
    height: float
    shapes: tuple[Shape, ...]


@dataclass(frozen=True)
class Row:
    """One pin of a side, or the name of a group of pins."""

    y: float
    name: str
    is_group: bool = False

    @property
    def inward(self) -> float:
        """How far the name of a group goes from the edge of the board."""
        return GROUP_PAD + len(self.name) * GROUP_SIZE * BOLD if self.is_group else 0.0


@dataclass(frozen=True)
class Body:
    """The board itself: its left edge and its width."""

    left: float
    width: float

    @property
    def middle(self) -> float:
        return self.left + self.width / 2

    def edge(self, side: Side) -> float:
        return self.left if side == "left" else self.left + self.width


def save_picture(option: str, board: Board, path: Path) -> None:
    """Write the pin-out as .svg or .png.

    Raises:
        UserError: another ending, PNG without matplotlib, or the file cannot be written; then none of it is there.
    """
    makers = {".svg": lambda picture: svg_text(picture).encode(), ".png": _png}
    if path.suffix.lower() not in makers:
        raise UserError(f"cannot draw {path.name}: a picture is .svg or .png")
    write_output(option, path, makers[path.suffix.lower()](draw(board)))


def draw(board: Board) -> Picture:
    """Lay the pin-out out."""
    sides: dict[Side, list[Row]] = {"left": _rows(board, "left"), "right": _rows(board, "right")}
    bottom = max(row.y for rows in sides.values() for row in rows) + BODY_PAD
    body = Body(MARGIN + TAG_WIDTH + PILL_WIDTH + LEAD, _body_width(board, sides))
    width = 2 * body.left + body.width
    legend = list(_legend(board, bottom + 44.0, width))
    height = max(shape.y for shape in legend if isinstance(shape, Text)) + 30.0
    shapes: list[Shape] = [Box(0, 0, width, height, PAPER, PAPER)]
    shapes += _title(board, width)
    shapes += _body(board, body, bottom)
    free = set(spare_pins(board, board.pins))
    for side, rows in sides.items():
        for row in rows:
            shapes += _group(row, side, body) if row.is_group else _pin(board, row, side, body, free)
    return Picture(width, height, (*shapes, *legend))


# ---- layout --------------------------------------------------------------------------------------------------------


def _rows(board: Board, side: Side) -> list[Row]:
    """The pins of a side from top to bottom, groups apart."""
    rows: list[Row] = []
    y = TITLE_HEIGHT + BODY_PAD
    for name, pins in _groups_of(board, side):
        if name:
            rows.append(Row(y, name, is_group=True))
            y += PITCH
        rows += [Row(y + PITCH * index, pin) for index, pin in enumerate(pins)]
        y += PITCH * (len(pins) - 1) + GROUP_GAP
    return rows


def _groups_of(board: Board, side: Side) -> list[tuple[str, list[str]]]:
    """Headers as they lie on the board; without any, the wired pins in the order of the package."""
    if board.header:
        return [(header.name, list(header.pins)) for header in board.header if header.side == side]
    chip = board.pins.pin
    pins = sorted({use.pin for use in board.uses()}, key=lambda pin: chip[pin].package_pin or chip[pin].number)
    half = (len(pins) + 1) // 2
    return [("", pins[:half] if side == "left" else pins[half:])]


def _title(board: Board, width: float) -> Iterator[Shape]:
    chip = f"{board.pins.name}, {board.pins.memory[board.memory.mode]}"
    rate_khz = board.timing.max_step_rate_hz / 1000
    facts = f"{chip}   ·   {len(board.axes)} axes {board.axes_text}   ·   {rate_khz:g} k steps/s"
    yield Text(width / 2, 34, board.name, 24, INK, "middle", bold=True)
    yield Text(width / 2, 62, facts, 13, FAINT, "middle")


def _body_width(board: Board, sides: dict[Side, list[Row]]) -> float:
    """Wide enough that the names of groups meet neither each other nor what is in the middle."""
    low = TITLE_HEIGHT + SHIELD_TOP
    high = TITLE_HEIGHT + ONBOARD_TOP + ONBOARD_PITCH * len(_soldered(board))
    widths = [BODY_WIDTH_MIN]
    for row in (*sides["left"], *sides["right"]):
        if low - PITCH / 2 < row.y < high and row.is_group:
            widths.append(2 * (row.inward + GAP) + ONBOARD_WIDTH)
    opposite = {row.y: row.inward for row in sides["right"] if row.is_group}
    widths += [row.inward + opposite[row.y] + GAP for row in sides["left"] if row.is_group and row.y in opposite]
    return max(widths)


def _body(board: Board, body: Body, bottom: float) -> Iterator[Shape]:
    top, middle = TITLE_HEIGHT, body.middle
    yield Box(body.left, top, body.width, bottom - top, BOARD_FILL, BOARD_EDGE, 14)
    if not board.header:
        yield Text(middle, bottom - 12, "wired pins only", 9.5, SILK, "middle")
        return
    yield Box(middle - 42, top + SHIELD_TOP, 84, 108, SHIELD_FILL, SHIELD_EDGE, 5)
    yield Text(middle, top + 92, board.pins.name, 12, INK, "middle", bold=True)
    yield Text(middle, top + 110, "seen from above", 8, FAINT, "middle")
    yield from _onboard(board, middle, top + ONBOARD_TOP)


def _soldered(board: Board) -> list[Use]:
    """What is soldered to a pin that no header carries."""
    carried = {pin for header in board.header for pin in header.pins}
    return [use for use in board.uses() if use.pin in board.onboard and use.pin not in carried]


def _onboard(board: Board, x: float, y: float) -> Iterator[Shape]:
    for index, use in enumerate(_soldered(board)):
        top = y + ONBOARD_PITCH * index
        yield Box(x - ONBOARD_WIDTH / 2, top - 13, ONBOARD_WIDTH, 38, ROLE_COLOURS[use.role], ROLE_COLOURS[use.role], 6)
        yield Text(x, top, label(use.signal), 10.5, "#ffffff", "middle", bold=True)
        yield Text(x, top + 14, use.pin, 9.5, "#ffffff", "middle", mono=True)


def _group(row: Row, side: Side, body: Body) -> Iterator[Shape]:
    x = body.edge(side) + (GROUP_PAD if side == "left" else -GROUP_PAD)
    yield Text(x, row.y, row.name, GROUP_SIZE, GOLD, "start" if side == "left" else "end", bold=True)


def _pin(board: Board, row: Row, side: Side, body: Body, free: set[str]) -> Iterator[Shape]:
    edge, outward = body.edge(side), -1 if side == "left" else 1
    inner: Anchor = "start" if side == "left" else "end"
    outer: Anchor = "end" if side == "left" else "start"
    yield Text(edge - 20 * outward, row.y, _silk_name(board, row.name), 11, SILK, inner, mono=True)
    yield Line(edge, row.y, edge + LEAD * outward, row.y, LINE)
    yield Disc(edge, row.y, RADIUS, GOLD, BOARD_EDGE)
    yield Disc(edge, row.y, 3, PAPER, BOARD_EDGE)
    start = edge + LEAD * outward
    pill_left = start if outward > 0 else start - PILL_WIDTH
    yield from _pill(board, row.name, pill_left, row.y, free)
    tag_x = start + (PILL_WIDTH + 8) * outward
    yield Text(tag_x, row.y, _tags(board, row.name, _pill_word(board, row.name, free)), 9.5, FAINT, outer)


def _silk_name(board: Board, name: str) -> str:
    package_pin = board.pins.pin[name].package_pin if name in board.pins.pin else None
    return f"{name} ({package_pin})" if not board.header and package_pin else name


def _pill(board: Board, name: str, x: float, y: float, free: set[str]) -> Iterator[Shape]:
    use = board.use_of(name)
    colour = ROLE_COLOURS[use.role] if use else POWER_COLOURS.get(name)
    middle, top = x + PILL_WIDTH / 2, y - PILL_HEIGHT / 2
    word = _pill_word(board, name, free)
    if colour:
        yield Box(x, top, PILL_WIDTH, PILL_HEIGHT, colour, colour, 6)
        yield Text(middle, y, word, 11, "#ffffff", "middle", bold=True)
    else:
        yield Box(x, top, PILL_WIDTH, PILL_HEIGHT, PAPER, LINE, 6, dashed=name not in free)
        yield Text(middle, y, word, 10.5, INK if name in free else FAINT, "middle")


def _pill_word(board: Board, name: str, free: set[str]) -> str:
    use = board.use_of(name)
    if use:
        return label(use.signal)
    return name if name in POWER_COLOURS else _unused_word(board, name, free)


def _unused_word(board: Board, name: str, free: set[str]) -> str:
    pin = board.pins.pin.get(name)
    if pin is None:
        return "reset"
    if pin.taken_in(board.memory.mode):
        return "flash, PSRAM"
    if name in free:
        return "free"
    return next(
        word
        for word in (pin.usb, pin.console, pin.debug and f"{pin.debug}, unused", pin.strap and "strapping", "unused")
        if word
    )


def _tags(board: Board, name: str, pill: str) -> str:
    """What else is worth knowing of the pin and does not stand in its pill."""
    pin = board.pins.pin.get(name)
    if pin is None:
        return ""
    use = board.use_of(name)
    words = _level_words(use) if use else []
    others = [word for word in remarks(pin) if word not in pill and not (use and word == pin.adc)]
    return " · ".join([*words, *others])


def _level_words(use: Use) -> list[str]:
    if use.role in (
        Role.ETHERNET,
        Role.SERIAL,
        Role.I2SO,
        Role.SPINDLE_BUS,
        Role.PENDANT,
        Role.DRIVER_BUS,
        Role.LED,
        Role.STEP,
        Role.DIR,
    ):
        return []
    if use.is_output:
        return [f"active {use.active}"]
    return [f"active {use.active}", f"pull-{use.pull}" if use.pull != "none" else "no pull inside"]


def _legend(board: Board, top: float, width: float) -> Iterator[Shape]:
    present = {use.role for use in board.uses()}
    entries = [(role.value, colour) for role, colour in ROLE_COLOURS.items() if role in present]
    columns = 7
    pitch = (width - 2 * MARGIN) / columns
    for index, (word, colour) in enumerate(entries):
        x = MARGIN + pitch * (index % columns)
        y = top + LEGEND_PITCH * (index // columns)
        yield Box(x, y - 7, 22, 14, colour, colour, 4)
        yield Text(x + 30, y, word, 12, INK)


# ---- drawing -------------------------------------------------------------------------------------------------------


def svg_text(picture: Picture) -> str:
    """The picture as SVG; same picture, same text."""
    size = f'width="{picture.width:g}" height="{picture.height:g}" viewBox="0 0 {picture.width:g} {picture.height:g}"'
    lines = [f'<svg xmlns="http://www.w3.org/2000/svg" {size} font-family="{FONT}">']
    lines += [_svg_shape(shape) for shape in picture.shapes if not isinstance(shape, Text) or shape.text]
    return "\n".join([*lines, "</svg>", ""])


def _svg_shape(shape: Shape) -> str:
    if isinstance(shape, Box):
        style = f'fill="{shape.fill}" stroke="{shape.edge}"' + (' stroke-dasharray="3 3"' if shape.dashed else "")
        at = f'x="{shape.x:g}" y="{shape.y:g}" width="{shape.width:g}" height="{shape.height:g}"'
        return f'<rect {at} rx="{shape.radius:g}" {style}/>'
    if isinstance(shape, Disc):
        at = f'cx="{shape.x:g}" cy="{shape.y:g}" r="{shape.radius:g}"'
        return f'<circle {at} fill="{shape.fill}" stroke="{shape.edge}"/>'
    if isinstance(shape, Line):
        return f'<path d="M{shape.x1:g} {shape.y1:g}L{shape.x2:g} {shape.y2:g}" stroke="{shape.colour}"/>'
    return _svg_line_of_text(shape)


def _svg_line_of_text(shape: Text) -> str:
    style = f'fill="{shape.colour}" text-anchor="{shape.anchor}" dominant-baseline="central"'
    style += ' font-weight="bold"' if shape.bold else ""
    style += f' font-family="{MONO}"' if shape.mono else ""
    return f'<text x="{shape.x:g}" y="{shape.y:g}" font-size="{shape.size:g}" {style}>{escape(shape.text)}</text>'


def _png(picture: Picture) -> bytes:
    try:
        from matplotlib.backends.backend_agg import FigureCanvasAgg
        from matplotlib.figure import Figure
    except ImportError as err:
        raise UserError("PNG needs matplotlib", "pip install matplotlib, or ask for an .svg") from err
    figure = Figure(figsize=(picture.width / UNITS_PER_INCH, picture.height / UNITS_PER_INCH))
    FigureCanvasAgg(figure)
    axes = figure.add_axes((0, 0, 1, 1), xlim=(0, picture.width), ylim=(picture.height, 0))
    axes.axis("off")
    for artist in _artists(picture.shapes):
        axes.add_artist(artist)
    out = io.BytesIO()
    figure.savefig(out, format="png", dpi=PNG_DPI, metadata={"Software": None})
    return out.getvalue()


def _artists(shapes: Iterable[Shape]) -> Iterator[Artist]:
    """The shapes in matplotlib's terms, each drawn over those before it."""
    for order, shape in enumerate(shapes):
        artist = _text_artist(shape) if isinstance(shape, Text) else _patch_artist(shape)
        artist.set_zorder(order)
        yield artist


def _patch_artist(shape: Box | Disc | Line) -> Artist:
    from matplotlib.lines import Line2D
    from matplotlib.patches import Circle, FancyBboxPatch

    if isinstance(shape, Line):
        return Line2D([shape.x1, shape.x2], [shape.y1, shape.y2], color=shape.colour, linewidth=STROKE)
    if isinstance(shape, Disc):
        return Circle((shape.x, shape.y), shape.radius, facecolor=shape.fill, edgecolor=shape.edge, linewidth=STROKE)
    corner = f"round,pad=0,rounding_size={shape.radius}" if shape.radius else "square,pad=0"
    patch = FancyBboxPatch((shape.x, shape.y), shape.width, shape.height, corner, linewidth=STROKE)
    patch.set(facecolor=shape.fill, edgecolor=shape.edge, linestyle=(0, (3, 3)) if shape.dashed else "solid")
    return patch


def _text_artist(shape: Text) -> Artist:
    from matplotlib.text import Text as PlotText

    text = PlotText(shape.x, shape.y, shape.text, color=shape.colour, fontsize=shape.size * POINTS_PER_UNIT)
    text.set_horizontalalignment(PLOT_ANCHORS[shape.anchor])
    text.set_verticalalignment("center_baseline")
    text.set_fontweight("bold" if shape.bold else "normal")
    text.set_fontfamily("monospace" if shape.mono else "sans-serif")
    return text
