"""Figures of light in uneven cloud: rays, tracing, transports, exchange."""

import math

from canvas import BLUE, CLOUD, CLOUD_EDGE, GREEN, GREY, GROUND, INK, PALE, PURPLE, RED, SUN, Canvas


def hill(x, bumps):
    return max(0.0, sum(h * math.exp(-(((x - m) / w) ** 2)) for m, w, h in bumps) - 6.0)


def cloud(c, left, right, base, bumps, fill=CLOUD):
    """A cloud with a flat base and tops of Gaussian bumps; gives its height at a place."""
    points = [(left, base)]
    points += [(left + i, base - hill(left + i, bumps)) for i in range(int(right - left) + 1)]
    points.append((right, base))
    c.polygon(points, fill, CLOUD_EDGE)
    return lambda x: hill(x, bumps) if left <= x <= right else 0.0


def inside(height, base, start, slope, reach, step=1.0):
    """Stretches of a ray (slope dx per dy upwards) inside a cloud, as pairs of points."""
    runs, run = [], None
    for i in range(int(reach / step)):
        y = base - i * step
        x = start + slope * i * step
        now = (base - y) < height(x)
        if now and run is None:
            run = (x, y)
        if not now and run is not None:
            runs.append((run, (x, y)))
            run = None
    if run is not None:
        runs.append((run, (start + slope * reach, base - reach)))
    return runs


def view_ray():
    """How a view ray through uneven cloud becomes a slab."""
    c = Canvas(860, 378, "A view ray through uneven cloud and the slab that stands for it")
    base = 268
    height = cloud(c, 30, 560, base, [(120, 60, 80), (255, 55, 150), (420, 70, 118), (520, 40, 40)])
    for i in range(12):
        x = 42 + 46 * i
        c.line(x, 84, x, base, PALE, 0.9, "3 4")
        c.circle(x, base - height(x), 3, "white", GREY)
    slope = 1.25
    start = 128.0
    ground = (start - slope * 80, base + 80.0)
    c.eye(ground[0] - 8, ground[1] + 6)
    c.line(ground[0], ground[1], start + slope * 186, base - 186, BLUE, 1.5, "6 4")
    for (x1, y1), (x2, y2) in inside(height, base, start, slope, 186):
        c.line(x1, y1, x2, y2, BLUE, 5.0)
    c.line(16, base, 574, base, GREY, 1.0)
    c.text(566, base + 18, "plane of the base", 13, "end", GREY)
    c.circle(start, base, 4.5, INK, "none")
    c.text(start + 12, base + 18, "texel", 13)
    c.text(40, 30, "length of cloud along the ray: sum of the thick pieces", 14, colour=BLUE)
    c.text(40, 52, "cut at the lines through texel centres: between them the map is a parabola", 13, colour=GREY)
    c.text(40, 70, "along the ray, whose roots are exact", 13, colour=GREY)
    c.line(start, base, start, base + 52, GREY, 1.0, "3 3")
    c.arc(start, base, 34, 270 - 51.3, 270, BLUE)
    c.text(start - 20, base + 52, "θ_v", 14, "middle", BLUE)
    c.line(584, 190, 622, 190, INK, 2.0, arrow=True)
    # The slab.
    top = 140
    c.rect(640, top, 200, 100, CLOUD, CLOUD_EDGE)
    c.text(740, 60, "the slab of this texel", 15, "middle", bold=True)
    c.text(740, 84, "τ = path · μ_v", 15, "middle")
    c.line(668, 240, 793, top, BLUE, 5.0)
    c.line(630, 270.4, 668, 240, BLUE, 1.5, "6 4")
    c.line(793, top, 820, top - 21.6, BLUE, 1.5, "6 4")
    c.text(700, 182, "path", 14, "end", BLUE)
    c.line(828, top + 2, 828, 238, INK, 1.3, both=True)
    c.text(818, 198, "τ", 16, "end")
    c.lines(640, 282, ["as deep as the ray says,", "the same everywhere sideways:", "sides and neighbours enter as a", "factor (section 5)"], 13)
    c.lines(
        230,
        320,
        ["Blocks of 8 × 8 texels know their least and greatest", "thickness: where a ray is below the one or above the", "other, the map is not looked at."],
        13,
    )
    return c


def null_collision():
    """Woodcock tracking: flights at the greatest extinction, collisions that do nothing outside the cloud."""
    c = Canvas(860, 330, "Null-collision tracking through uneven cloud")
    base, top = 236, 92
    c.rect(30, top, 800, base - top, "#f6f8fb", CLOUD_EDGE, 1.2)
    bumps = [(150, 70, 100), (330, 80, 148), (560, 95, 110), (740, 60, 70)]
    height = cloud(c, 30, 830, base, bumps)
    c.text(826, top - 12, "majorant: the greatest extinction, everywhere from the base to the highest top", 13, "end", GREY)
    way = [(112, 40), (205, 128), (258, 178), (302, 152), (384, 196), (470, 170), (548, 188), (600, 222)]
    for i, (a, b) in enumerate(zip(way, way[1:])):
        c.line(*a, *b, SUN if i == 0 else BLUE, 2.0)
    last = (642, 286)
    c.line(*way[-1], *last, BLUE, 2.0, arrow=True)
    c.sun(92, 26, 9)
    for i, (x, y) in enumerate(way[1:]):
        real = base - y < height(x)
        if real:
            c.circle(x, y, 5.5, RED, "none")
        else:
            c.circle(x, y, 5.5, "white", GREY, 2.0)
    c.line(0, 290, 860, 290, "#8b6b43", 2.0)
    c.rect(0, 290, 860, 40, GROUND, "none")
    c.text(655, 282, "counted on the ground", 13, colour=BLUE)
    c.circle(40, 311, 5.5, RED, "none")
    c.text(54, 316, "real collision: scattered by the phase function, or absorbed", 13)
    c.circle(470, 311, 5.5, "white", GREY, 2.0)
    c.text(484, 316, "null collision: outside cloud, flies on as before", 13)
    return c


def panel(c, left, title, rows):
    c.text(left + 96, 26, title, 16, "middle", bold=True)
    c.lines(left + 96, 292, rows, 12.5, "middle")


def transport():
    """The four transports of sunlight through uneven cloud."""
    c = Canvas(860, 392, "Four ways to carry sunlight through uneven cloud")
    base = 218
    slope = -0.75
    for i in range(4):
        left = 18 + 212 * i
        bumps = [(left + 50, 27, 92), (left + 132, 36, 132)]
        height = cloud(c, left, left + 192, base, bumps)
        c.line(left, base, left + 192, base, GREY, 1.0)
        spot = left + 96.0
        column = height(spot)
        norm = math.hypot(slope, 1.0)
        if i == 0:
            # As if the column went on to all sides.
            top = base - column
            c.polyline([(left, top), (left + 192, top)], BLUE, 1.3, "5 4")
            c.line(spot + slope * 118, base - 118, spot + slope * column, top, SUN, 2.0, arrow=True)
            c.line(spot + slope * column, top, spot, base, SUN, 1.2, "4 3")
            c.line(spot, top, spot, base, BLUE, 5.0)
        if i in (1, 3):
            for (x1, y1), (x2, y2) in inside(height, base, spot, slope, 150):
                c.line(x1, y1, x2, y2, BLUE, 5.0)
            c.line(spot + slope * 176, base - 176, spot + slope * 118, base - 118, SUN, 2.0, arrow=True)
            c.line(spot + slope * 118, base - 118, spot, base, SUN, 1.2, "4 3")
        if i in (2, 3):
            # Faces of the top that look at the sun get more, those behind others less.
            for k in range(0, 193, 4):
                x = left + k
                h, ahead = height(x), height(x + 1)
                if h < 4:
                    continue
                facing = 1.0 - (ahead - height(x - 1)) / 2 * (-slope) * -1.0
                shade = any(height(x + slope * s) > h + s for s in range(4, 120, 4))
                strength = 0.0 if shade else max(0.0, facing)
                if strength > 0.15:
                    c.circle(x, base - h, 1.0 + 1.6 * min(strength, 2.2), SUN, "none")
            if i == 2:
                for x in (left + 30, left + 108):
                    c.line(x - 46 * 0.75, base - height(x) - 50, x - 3, base - height(x) - 5, SUN, 2.0, arrow=True)
                c.line(spot, base - column, spot, base, BLUE, 5.0)
                c.line(spot - 34, base - column - 16, spot + 34, base - column - 16, PURPLE, 1.6, both=True)
        c.circle(spot, base, 4.5, INK, "none")
        if i in (0, 1, 2, 3):
            c.line(spot, base + 6, spot, base + 34, GREEN, 2.0, arrow=True)
    panel(c, 18, "columns", ["slab of the column's own", "depth; no neighbour matters", "= independent column", "approximation (ICA)"])
    panel(c, 230, "tilted", ["slab as deep as the slanted", "ray to the sun", "= tilted independent columns", "(tilted ICA)"])
    panel(c, 442, "entry", ["the column's slab, lit by what", "enters its top: slope and shade,", "blurred by 0.7 transport", "mean free paths"])
    panel(c, 654, "blended", ["half tilted, half entry:", "each is wrong where", "the other is right", "(default)"])
    c.text(430, 382, "blue: depth that is looked up in the flux table; orange dots: sunlight that enters the top", 12.5, "middle", GREY)
    return c


def exchange():
    """Light between ground and cloud base, and between layers."""
    c = Canvas(860, 392, "Exchange of light between ground and cloud, and between layers")
    c.text(262, 26, "between cloud base and ground", 15, "middle", bold=True)
    base, ground = 112, 318
    c.rect(24, 60, 476, base - 60, CLOUD, CLOUD_EDGE)
    c.rect(24, ground, 238, 30, "#eef2f6", GREY, 1.0)
    c.rect(262, ground, 238, 30, "#7aa6c9", GREY, 1.0)
    c.text(143, ground + 20, "snow", 13, "middle")
    c.text(381, ground + 20, "water", 13, "middle")
    c.text(38, 90, "sends back the part R of what comes up", 13)
    c.line(462, 66, 462, base + 34, SUN, 2.2, arrow=True)
    c.text(452, base + 26, "d_0", 15, "end", SUN)
    way = [(250, base), (178, ground), (120, base), (70, ground), (40, base + 60)]
    for i, (a, b) in enumerate(zip(way, way[1:])):
        c.line(*a, *b, BLUE if i % 2 == 0 else GREEN, 2.6 - 0.5 * i, arrow=True)
    x0 = 318.0
    weight = [(x0 + 3 * k, 44.0 / (1 + (k / 17.0) ** 2) ** 2) for k in range(-50, 51)]
    c.polygon([(x, ground - 2 - w) for x, w in weight] + [(weight[-1][0], ground - 2), (weight[0][0], ground - 2)], "#fdf3e7", SUN)
    c.circle(x0, base, 4.5, INK, "none")
    for k in (-42, -16, 16, 42):
        c.line(x0, base, x0 + 1.6 * k, ground - 6, GREY, 1.0, "3 3")
    c.line(484, base + 3, 484, ground - 3, INK, 1.3, both=True)
    c.text(474, 222, "h", 15, "end")
    c.text(x0 + 66, 264, "h² / π(r² + h²)²", 13.5, "start", SUN)
    c.text(24, 370, "E = b + K d     u = K (a E)     d = d_0 + R u", 15)
    c.line(524, 20, 524, 372, PALE, 1.0)

    c.text(690, 26, "layers become one cloud", 15, "middle", bold=True)
    for i, (y, h) in enumerate([(58, 26), (128, 40), (212, 30)]):
        c.rect(552, y, 170, h, CLOUD, CLOUD_EDGE)
        c.text(562, y + h / 2 + 5, f"R_{3 - i}, T_{3 - i}", 14)
    for y1, y2 in [(86, 126), (170, 210)]:
        for k in range(3):
            c.line(640 + 20 * k, y1, 650 + 20 * k, y2, GREEN, 1.8 - 0.4 * k, arrow=True)
            c.line(652 + 20 * k, y2, 660 + 20 * k, y1, BLUE, 1.6 - 0.4 * k, arrow=True)
    c.line(744, 62, 744, 240, INK, 1.8, arrow=True)
    c.lines(756, 116, ["added", "from the", "top down,", "each in its", "own column"], 13)
    c.line(637, 250, 637, 280, INK, 1.8, arrow=True)
    c.rect(552, 286, 170, 34, CLOUD, CLOUD_EDGE)
    c.text(637, 308, "R, d_0 of the stack", 14, "middle")
    c.lines(552, 344, ["at the height where light from", "the ground first meets cloud"], 13)
    return c
