"""A small SVG canvas: shapes, arrows, text with sub- and superscripts, and axes for plots. Coordinates are pixels, y down."""

import math
import re
from xml.sax.saxutils import escape

INK = "#1b1f24"
GREY = "#6b7280"
PALE = "#d1d5db"
CLOUD = "#e3e8ef"
CLOUD_EDGE = "#94a3b8"
GROUND = "#d9c3a5"
SUN = "#c2620a"
BLUE = "#1d5fbf"
RED = "#b3261e"
GREEN = "#1a7f37"
PURPLE = "#7c3aed"

SCRIPT = re.compile(r"([_^])(\{[^}]*\}|.)")


def spans(words, size):
    """Text with `_x` or `_{xy}` set lower and smaller and `^x` or `^{xy}` higher: works in every viewer of SVG."""
    parts, at, off = [], 0, 0.0

    def put(text, shift, scale):
        nonlocal off
        if text:
            move = shift - off
            style = f' font-size="{scale * size:.1f}"' if scale != 1.0 else ""
            dy = f' dy="{move:.1f}"' if abs(move) > 0.01 else ""
            parts.append(f"<tspan{dy}{style}>{escape(text)}</tspan>" if dy or style else escape(text))
            off = shift

    for match in SCRIPT.finditer(words):
        put(words[at : match.start()], 0.0, 1.0)
        put(match[2].strip("{}"), (0.28 if match[1] == "_" else -0.38) * size, 0.74)
        at = match.end()
    put(words[at:], 0.0, 1.0)
    return "".join(parts)


class Canvas:
    """A drawing of a fixed size on a white ground, so that it can be read on light and on dark pages."""

    def __init__(self, width, height, title):
        self.width, self.height = width, height
        self.items = [
            f'<svg xmlns="http://www.w3.org/2000/svg" width="{width}" height="{height}" viewBox="0 0 {width} {height}" '
            f'font-family="Helvetica, Arial, \'DejaVu Sans\', sans-serif" xml:space="preserve" role="img">',
            f"<title>{escape(title)}</title>",
            f'<rect width="{width}" height="{height}" fill="white"/>',
        ]

    def add(self, item):
        self.items.append(item)

    def save(self, path):
        with open(path, "w", encoding="utf-8") as file:
            file.write("\n".join(self.items + ["</svg>", ""]))

    def line(self, x1, y1, x2, y2, colour=INK, width=1.5, dash=None, arrow=False, both=False):
        style = f' stroke-dasharray="{dash}"' if dash else ""
        if arrow or both:
            length = math.hypot(x2 - x1, y2 - y1) or 1.0
            along = ((x2 - x1) / length, (y2 - y1) / length)
            head = 4.0 + 2.2 * width
            # The line ends inside the head, so that it does not blunt the tip.
            end = (x2 - 0.7 * head * along[0], y2 - 0.7 * head * along[1])
            start = (x1 + 0.7 * head * along[0], y1 + 0.7 * head * along[1]) if both else (x1, y1)
            self.head(x2, y2, along, head, colour)
            if both:
                self.head(x1, y1, (-along[0], -along[1]), head, colour)
            (x1, y1), (x2, y2) = start, end
        self.add(
            f'<line x1="{x1:.1f}" y1="{y1:.1f}" x2="{x2:.1f}" y2="{y2:.1f}" stroke="{colour}" stroke-width="{width}"{style}/>'
        )

    def head(self, x, y, along, length, colour):
        back = (x - length * along[0], y - length * along[1])
        side = (-0.42 * length * along[1], 0.42 * length * along[0])
        points = [(x, y), (back[0] + side[0], back[1] + side[1]), (back[0] - side[0], back[1] - side[1])]
        self.polygon(points, colour, "none")

    def polygon(self, points, fill, stroke=INK, width=1.2, opacity=1.0):
        text = " ".join(f"{x:.1f},{y:.1f}" for x, y in points)
        self.add(
            f'<polygon points="{text}" fill="{fill}" stroke="{stroke}" stroke-width="{width}" fill-opacity="{opacity}"/>'
        )

    def polyline(self, points, colour=INK, width=1.8, dash=None):
        text = " ".join(f"{x:.1f},{y:.1f}" for x, y in points)
        style = f' stroke-dasharray="{dash}"' if dash else ""
        self.add(
            f'<polyline points="{text}" fill="none" stroke="{colour}" stroke-width="{width}" stroke-linejoin="round"{style}/>'
        )

    def rect(self, x, y, width, height, fill="none", stroke=INK, line=1.2, round_by=0):
        self.add(
            f'<rect x="{x:.1f}" y="{y:.1f}" width="{width:.1f}" height="{height:.1f}" rx="{round_by}" fill="{fill}" '
            f'stroke="{stroke}" stroke-width="{line}"/>'
        )

    def circle(self, x, y, radius, fill="none", stroke=INK, line=1.2):
        self.add(
            f'<circle cx="{x:.1f}" cy="{y:.1f}" r="{radius:.1f}" fill="{fill}" stroke="{stroke}" stroke-width="{line}"/>'
        )

    def arc(self, x, y, radius, start_deg, end_deg, colour=INK, width=1.2):
        """Part of a circle; angles counted from the right, upwards."""
        turn = [math.radians(start_deg + (end_deg - start_deg) * i / 24) for i in range(25)]
        self.polyline([(x + radius * math.cos(a), y - radius * math.sin(a)) for a in turn], colour, width)

    def text(self, x, y, words, size=14, anchor="start", colour=INK, bold=False, turn=0):
        weight = ' font-weight="bold"' if bold else ""
        rotate = f' transform="rotate({turn} {x:.1f} {y:.1f})"' if turn else ""
        self.add(
            f'<text x="{x:.1f}" y="{y:.1f}" font-size="{size}" text-anchor="{anchor}" fill="{colour}"{weight}{rotate}>'
            f"{spans(words, size)}</text>"
        )

    def source(self, words):
        """Where the numbers come from, at the foot; taken as it is."""
        at = f'x="{self.width / 2:.1f}" y="{self.height - 10}" font-size="12.5" text-anchor="middle" fill="{GREY}"'
        self.add(f"<text {at}>{escape(words)}</text>")

    def lines(self, x, y, rows, size=14, anchor="start", colour=INK, step=1.35):
        for i, words in enumerate(rows):
            self.text(x, y + i * step * size, words, size, anchor, colour)

    def box(self, x, y, width, height, rows, fill="white", stroke=GREY, size=14, bold_first=True):
        """A box with centred rows of text."""
        self.rect(x, y, width, height, fill, stroke, 1.3, 5)
        top = y + 0.5 * height - 0.5 * (len(rows) - 1) * 1.35 * size + 0.35 * size
        for i, words in enumerate(rows):
            self.text(x + 0.5 * width, top + i * 1.35 * size, words, size, "middle", INK, bold_first and i == 0)

    def sun(self, x, y, radius=11):
        self.circle(x, y, radius, "#fbbf24", SUN, 1.5)
        for i in range(8):
            a = math.pi * i / 4
            inner, outer = radius + 3, radius + 8
            self.line(x + inner * math.cos(a), y + inner * math.sin(a), x + outer * math.cos(a), y + outer * math.sin(a), SUN, 1.8)

    def eye(self, x, y):
        self.add(
            f'<path d="M{x - 13} {y} Q{x} {y - 13} {x + 13} {y} Q{x} {y + 13} {x - 13} {y} Z" fill="white" stroke="{INK}" '
            f'stroke-width="1.5"/>'
        )
        self.circle(x, y, 4.2, INK, "none")


class Axes:
    """A plot: a rectangle of the canvas with two axes, linear or logarithmic (`log=True`)."""

    def __init__(self, canvas, frame, x_range, y_range, x_log=False, y_log=False):
        self.canvas, self.frame = canvas, frame
        self.ranges, self.logs = (x_range, y_range), (x_log, y_log)

    def place(self, x, y):
        left, top, width, height = self.frame
        parts = []
        for value, (low, high), log in zip((x, y), self.ranges, self.logs):
            if log:
                parts.append(math.log(max(value, 1e-300) / low) / math.log(high / low))
            else:
                parts.append((value - low) / (high - low))
        return left + parts[0] * width, top + (1.0 - parts[1]) * height

    def draw(self, x_ticks, y_ticks, x_label, y_label, y_format=str, x_format=str):
        left, top, width, height = self.frame
        for value in x_ticks:
            x, _ = self.place(value, self.ranges[1][0])
            self.canvas.line(x, top, x, top + height, PALE, 0.8)
            self.canvas.text(x, top + height + 17, x_format(value), 13, "middle")
        for value in y_ticks:
            _, y = self.place(self.ranges[0][0], value)
            self.canvas.line(left, y, left + width, y, PALE, 0.8)
            self.canvas.text(left - 7, y + 4.5, y_format(value), 13, "end")
        self.canvas.rect(left, top, width, height, "none", GREY)
        self.canvas.text(left + 0.5 * width, top + height + 37, x_label, 14, "middle")
        if y_label:
            self.canvas.text(left - 52, top + 0.5 * height, y_label, 14, "middle", turn=-90)

    def curve(self, points, colour, width=2.0, dash=None):
        """A line through points; what lies below the plot is left out."""
        low = self.ranges[1][0]
        self.canvas.polyline([self.place(x, y) for x, y in points if y >= low], colour, width, dash)


def power(value):
    """A power of ten as a label."""
    exponent = round(math.log10(value))
    return {0: "1", 1: "10", 2: "100"}.get(exponent, "10^{" + str(exponent).replace("-", "\u2212") + "}")


class Random:
    """The same numbers on every machine."""

    def __init__(self, seed):
        self.state = seed

    def next(self):
        self.state = (self.state * 6364136223846793005 + 1442695040888963407) % 2**64
        return (self.state >> 11) / 2**53
