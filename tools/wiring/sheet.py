"""What the wiring pictures are made of: boxes with terminals, and wires between them, drawn by schemdraw."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import pairwise
from typing import NamedTuple

import schemdraw
import schemdraw.elements as elm

INK, SUPPLY, SIGNAL, DANGER = "#1f2933", "#b91c1c", "#1d4ed8", "#c2410c"
PITCH = 0.7  # between terminals

Point = tuple[float, float]


class Box(NamedTuple):
    """A device, and where its terminals are."""

    at: dict[str, Point]

    def __getitem__(self, name: str) -> Point:
        return self.at[name]


class Sheet:
    """One picture. Units are those of schemdraw; y goes up."""

    def __init__(self) -> None:
        schemdraw.use("svg")
        schemdraw.svgconfig.text = "text"
        self.drawing = schemdraw.Drawing(show=False)
        self.drawing.config(unit=1.6, fontsize=11, lw=1.4, color=INK, bgcolor="white", margin=0.3, font="sans-serif")

    def add(self, element: elm.Element) -> elm.Element:
        return self.drawing.add(element)

    def box(self, corner: Point, size: Point, title: str, left: Sequence[str] = (), right: Sequence[str] = (),
            top: Sequence[str] = (), bottom: Sequence[str] = ()) -> Box:  # fmt: skip
        """A rectangle from its lower left corner, with terminals from top to bottom and from left to right; an empty
        name leaves a place free. A title between its terminals, or under the upper edge where there are some."""
        (x, y), (width, height) = corner, size
        self.block(corner, size, "#f4f6f9")
        places: dict[str, Point] = {}
        for names, edge, loc, dx in ((left, x, "right", 0.15), (right, x + width, "left", -0.15)):
            first = y + height / 2 + PITCH * (len(names) - 1) / 2
            for row, name in enumerate(names):
                places[name] = (edge, first - PITCH * row)
                self.text((edge + dx, first - PITCH * row), name, align=loc)
        for names, edge, dy in ((top, y + height, -0.22), (bottom, y, 0.22)):
            for column, name in enumerate(names):
                at = (x + width * (column + 1) / (len(names) + 1), edge)
                places[name] = at
                self.text((at[0], edge + dy), name)
        self.text((x + width / 2, y + height + 0.28 if top or left or right else y + height / 2), title, bold=True)
        return Box(places)

    def block(self, corner: Point, size: Point, fill: str) -> None:
        """A rectangle without terminals, from its lower left corner."""
        self.add(elm.Rect(corner1=(0, 0), corner2=size).at(corner).theta(0).fill(fill))

    def dot(self, *places: Point) -> None:
        """Wires are joined here."""
        for at in places:
            self.add(elm.Dot(radius=0.07).at(at))

    def text(self, at: Point, words: str, *, align: str = "center", bold: bool = False, colour: str = INK,
             size: float = 10) -> None:  # fmt: skip
        """@param align  the side of the point on which the words are: left, right, center"""
        halign = {"center": "center", "left": "right", "right": "left"}[align]
        label = elm.Label().at((at[0], at[1] - 0.14)).theta(0).color(colour)  # the middle of small letters
        self.add(label.label(words, fontsize=size + (1 if bold else 0), halign=halign, valign="center", ofst=0))

    def wire(self, *points: Point, colour: str = INK, dashed: bool = False, ends: str = "") -> None:
        """Through these points. @param ends  a dot at the "first", the "last" or "both" """
        for begin, end in pairwise(points):
            line = elm.Line().at(begin).to(end).color(colour)
            self.add(line.linestyle("--") if dashed else line)
        if ends in ("first", "both"):
            self.add(elm.Dot(radius=0.07).at(points[0]).color(colour))
        if ends in ("last", "both"):
            self.add(elm.Dot(radius=0.07).at(points[-1]).color(colour))

    def part(self, element: elm.Element, begin: Point, end: Point, words: str = "", loc: str = "top") -> elm.Element:
        """A part with two ends."""
        drawn = element.at(begin).to(end)
        return self.add(drawn.label(words, loc=loc, fontsize=10) if words else drawn)

    def svg(self) -> str:
        return self.drawing.get_imagedata("svg").decode("utf-8")
