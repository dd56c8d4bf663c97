"""Figures of one slab: its geometry, adding-doubling, orders of scattering, what method tabulated adds up."""

import math

from canvas import BLUE, CLOUD, CLOUD_EDGE, GREEN, GREY, INK, PALE, PURPLE, SUN, Canvas


def slab(c, x, y, width, height):
    c.rect(x, y, width, height, CLOUD, CLOUD_EDGE)


def geometry():
    """Angles, optical depth and the two faces of a homogeneous slab."""
    c = Canvas(860, 384, "Angles and depths of a homogeneous slab")
    top, base, left, right = 150, 270, 30, 572
    slab(c, left, top, right - left, base - top)
    # The sun's ray, its normal, and the part that goes straight on.
    hit = (235, top)
    sun = 38.0
    dx, dy = math.sin(math.radians(sun)), math.cos(math.radians(sun))
    c.sun(hit[0] - 150 * dx, hit[1] - 150 * dy + 4)
    c.line(hit[0] - 128 * dx, hit[1] - 128 * dy, hit[0], hit[1], SUN, 2.4, arrow=True)
    depth = base - top
    out = (hit[0] + depth * math.tan(math.radians(sun)), base)
    c.line(*hit, *out, SUN, 1.8, "6 4")
    c.line(*out, out[0] + 55 * dx, out[1] + 55 * dy, SUN, 1.8, "6 4", arrow=True)
    c.line(hit[0], 32, hit[0], top, GREY, 1.0, "3 3")
    c.arc(*hit, 62, 90, 90 + sun, SUN)
    c.text(hit[0] - 33, top - 68, "θ_l", 15, "middle", SUN)
    c.text(hit[0] + 58, top + 46, "sun's path τ / μ_l", 14, "start", SUN)
    c.text(out[0] + 44, base + 36, "direct beam, e^{−τ/μ}", 14, "start", SUN)
    # Views from both sides.
    seen = 52.0
    vx, vy = math.sin(math.radians(seen)), math.cos(math.radians(seen))
    up = (425, top)
    c.line(*up, up[0] + 128 * vx, up[1] - 128 * vy, BLUE, 2.2, arrow=True)
    c.eye(up[0] + 146 * vx, up[1] - 146 * vy)
    c.line(up[0], 45, up[0], top, GREY, 1.0, "3 3")
    c.arc(*up, 52, 90 - seen, 90, BLUE)
    c.text(up[0] + 27, top - 58, "θ_v", 15, "middle", BLUE)
    down = (140, base)
    c.line(*down, down[0] - 62 * vx, down[1] + 62 * vy + 20, BLUE, 2.2, arrow=True)
    c.eye(down[0] - 80 * vx, down[1] + 82 * vy + 22)
    c.text(down[0] - 36, base + 100, "view from below", 14, "start", BLUE)
    c.text(up[0] + 40, 36, "view from above", 14, "end", BLUE)
    c.text(left + 10, top + 20, "top face", 13, colour=GREY)
    c.text(left + 10, base - 9, "base face", 13, colour=GREY)
    # Depth.
    c.line(right - 26, top + 2, right - 26, base - 2, INK, 1.5, both=True)
    c.text(right - 36, (top + base) / 2 + 5, "optical depth τ", 14, "end")
    c.lines(
        600,
        62,
        [
            "μ_l = cos θ_l: the sun",
            "μ_v = cos θ_v: the view",
            "path = τ / μ: optical depth",
            "along a slanted ray",
            "",
            "plane albedo R(τ, μ_l):",
            "part of a beam that leaves",
            "through the top",
            "",
            "transmittance T(τ, μ_l):",
            "part that leaves through the base,",
            "scattered or not",
            "",
            "spherical albedo: R for light",
            "that is the same from everywhere",
        ],
        13.5,
    )
    return c


def doubling():
    """Two equal slabs on top of each other from one."""
    c = Canvas(860, 344, "Adding-doubling: two equal slabs on top of each other")
    c.text(130, 28, "one slab: R and T known", 15, "middle", bold=True)
    slab(c, 40, 120, 180, 44)
    c.line(84, 56, 110, 118, SUN, 2.2, arrow=True)
    c.line(118, 118, 146, 56, BLUE, 2.2, arrow=True)
    c.text(160, 76, "R", 16, "start", BLUE)
    c.line(116, 166, 142, 228, GREEN, 2.2, arrow=True)
    c.text(154, 208, "T", 16, "start", GREEN)
    c.text(130, 250, "optical depth τ", 14, "middle")
    c.line(246, 142, 292, 142, INK, 2.0, arrow=True)

    c.text(470, 28, "two of them: sum the bounces between them", 15, "middle", bold=True)
    slab(c, 316, 88, 308, 44)
    slab(c, 316, 188, 308, 44)
    c.line(338, 40, 358, 86, SUN, 2.2, arrow=True)
    c.line(364, 86, 382, 40, BLUE, 2.2, arrow=True)
    c.text(394, 60, "R", 15, "start", BLUE)
    x = 364.0
    for i, weight in enumerate([2.4, 1.9, 1.5, 1.2]):
        c.line(x, 134, x + 26, 186, GREEN, weight, arrow=True)
        c.line(x + 28, 234, x + 44, 276, GREEN, weight, arrow=True)
        c.line(x + 30, 186, x + 56, 134, BLUE, weight, arrow=True)
        c.line(x + 58, 86, x + 74, 44 + 5 * i, BLUE, weight, arrow=True)
        x += 60
    c.text(602, 165, "…", 18)
    c.text(470, 304, "up:  R + T (R + R³ + R⁵ + …) T", 14, "middle")
    c.text(470, 326, "down:  T (1 + R² + R⁴ + …) T", 14, "middle")

    c.text(746, 28, "and again", 15, "middle", bold=True)
    bottom = 268
    for i in range(6):
        height = 4.5 * 2**i
        x = 660 + 31 * i
        c.rect(x, bottom - height, 24, height, CLOUD, CLOUD_EDGE)
    c.text(672, 288, "τ", 13, "middle")
    for i in range(1, 6):
        c.text(672 + 31 * i, 288, f"{2**i}τ", 13, "middle")
    c.lines(660, 66, ["41 doublings lead from", "τ = 2^{−24} to 2^{17}"], 14)
    return c


def orders():
    """What is counted as scattered once, twice and more often, and what each is computed by."""
    c = Canvas(860, 430, "Orders of scattering in a slab, with the forward peak counted as not scattered")
    top, base = 128, 268
    slab(c, 30, top, 800, base - top)
    names = ["order 0", "order 1", "order 2", "orders 3 and up"]
    for i, name in enumerate(names):
        c.text(125 + 205 * i, 26, name, 15, "middle", bold=True)
        if i:
            c.line(22 + 205 * i, 40, 22 + 205 * i, 330, PALE, 1.0, "4 4")
    dx, dy = math.sin(math.radians(30)), math.cos(math.radians(30))

    def arrive(x, depth):
        """The sun's ray down to a depth below the top; where it ends."""
        along = (depth + 72) / dy
        end = (x + along * dx, top + depth)
        c.line(x, top - 72, *end, SUN, 2.2)
        c.circle(*end, 4, SUN, "none")
        return end

    # 0: small deflections only.
    x, y = 58.0, float(top - 72)
    angle = 30.0
    for step, turn in [(110, 4), (52, -5), (56, 3), (80, 0)]:
        a = math.radians(angle)
        nx, ny = x + step * math.sin(a), y + step * math.cos(a)
        c.line(x, y, nx, ny, SUN, 2.2, arrow=turn == 0)
        if turn:
            c.circle(nx, ny, 4, SUN, "none")
        x, y, angle = nx, ny, angle + turn
    c.line(58, top - 72, 58 + 292 * dx, top - 72 + 292 * dy, GREY, 1.0, "3 3")
    c.lines(36, 352, ["met the forward peak alone:", "stays within some degrees", "of the beam, makes the", "aureole around the sun"], 13)

    # 1: one turn, to either side.
    end = arrive(268, 52)
    c.line(*end, end[0] + 32, top - 66, BLUE, 2.0, arrow=True)
    c.line(*end, end[0] - 42, base + 52, GREEN, 2.0, arrow=True)
    c.lines(240, 352, ["exact in closed form:", "bow, glory and silver lining", "are the phase function's", "own shape"], 13)

    # 2.
    end = arrive(448, 36)
    second = (end[0] + 56, end[1] + 42)
    c.line(*end, *second, PURPLE, 2.0)
    c.circle(*second, 4, PURPLE, "none")
    c.line(*second, second[0] + 30, top - 66, BLUE, 2.0, arrow=True)
    c.line(*second, second[0] - 10, base + 52, GREEN, 2.0, arrow=True)
    c.lines(444, 352, ["approximate closed form with", "P ∗ P, the phase function", "convolved with itself"], 13)

    # Many.
    end = arrive(660, 30)
    way = [(22, 34), (-30, 22), (20, 26), (38, -34), (-12, -38), (36, 16), (-8, 46)]
    x, y = end
    for sx, sy in way:
        c.line(x, y, x + sx, y + sy, PURPLE, 1.6)
        x, y = x + sx, y + sy
        c.circle(x, y, 3, PURPLE, "none")
    for turn in (-60, -25, 10, 45):
        a = math.radians(turn)
        c.line(x, base + 4, x + 50 * math.sin(a), base + 4 + 50 * math.cos(a), GREEN, 1.6, arrow=True)
    c.lines(648, 352, ["the rest of the exact flux,", "given off evenly by method", "analytic, tabulated exactly", "by method tabulated"], 13)
    return c


def tabulated():
    """The three terms of method tabulated and where each comes from."""
    c = Canvas(860, 372, "The three terms of method tabulated")
    c.text(430, 28, "radiance seen in a texel of depth τ, under the sun μ_l, in the direction μ_v, φ", 15, "middle", bold=True)
    c.box(20, 50, 240, 76, ["single scattering", "closed form, whole phase function,", "at the delta-M scaled depth"], "#fdf3e7", SUN, 13)
    c.text(281, 96, "+", 24, "middle")
    c.box(302, 50, 258, 76, ["multiple scattering", "smooth in every variable:", "table of the exact solution"], "#eaf1fb", BLUE, 13)
    c.text(581, 96, "+", 24, "middle")
    c.box(602, 50, 238, 76, ["near the sun", "small-angle sum over all orders,", "less what the others have there"], "#f3ecfd", PURPLE, 13)
    c.line(140, 128, 140, 172, SUN, 1.8, arrow=True)
    c.lines(36, 196, ["arithmetic in the shader:", "e^{−x} of the two paths times P(Θ)"], 13)
    c.line(721, 128, 721, 172, PURPLE, 1.8, arrow=True)
    c.lines(610, 196, ["a two-dimensional texture:", "scattering angle by optical path"], 13)
    # From four dimensions to one fetch.
    c.line(430, 128, 430, 160, BLUE, 1.8, arrow=True)
    c.lines(430, 182, ["depth × sun × view × azimuth,", "48 azimuth modes by adding-doubling"], 13, "middle")
    for i in range(5):
        c.rect(330 + 13 * i, 222 + 6 * i, 60, 60, "#eaf1fb", BLUE, 1.1)
    c.rect(330 + 13 * 2, 222 + 6 * 2, 60, 60, "#bcd4f6", BLUE, 1.6)
    c.text(374, 326, "one table per sun node", 13, "middle")
    c.line(452, 262, 500, 262, BLUE, 1.8, arrow=True)
    c.text(476, 250, "cut at", 12.5, "middle")
    c.text(476, 282, "the sun", 12.5, "middle")
    x, y, s, d = 520, 236, 58, 22
    c.polygon([(x, y), (x + d, y - d), (x + d + s, y - d), (x + s, y)], "#d8e6fa", BLUE)
    c.polygon([(x + s, y), (x + s + d, y - d), (x + s + d, y + s - d), (x + s, y + s)], "#c6daf7", BLUE)
    c.rect(x, y, s, s, "#eaf1fb", BLUE)
    c.text(x + 40, 326, "3-D texture", 13, "middle")
    c.line(614, 262, 652, 262, BLUE, 1.8, arrow=True)
    c.lines(660, 252, ["one fetch for three colours", "in each texel"], 13)
    c.text(430, 360, "Divided by the growth of order 2 and the decay of diffusion, the table needs few nodes; its root is stored.", 13, "middle", GREY)
    return c
