"""Figures drawn from data that the project holds: docs/charts/*.csv and the reference runs of tests/data."""

import csv
import math
import pathlib
import struct

from canvas import BLUE, GREEN, GREY, INK, PALE, PURPLE, RED, SUN, Axes, Canvas, power

ROOT = pathlib.Path(__file__).resolve().parents[2]


def rows(name):
    with open(ROOT / name, encoding="utf-8", newline="") as file:
        return list(csv.DictReader(file))


def phase():
    """Phase functions of an independent Mie program, and what their parts make."""
    c = Canvas(860, 404, "Phase function of cloud droplets of 7 micrometres")
    table = rows("tests/data/phase/phase_re07.csv")
    axes = Axes(c, (78, 28, 754, 300), (0, 180), (0.01, 1e4), y_log=True)
    a, top = axes.place(0, 1e4)
    b, _ = axes.place(5, 1e4)
    c.rect(a, top, b - a, 300, "#fdf3e7", "none")
    axes.draw(range(0, 181, 30), [0.01, 0.1, 1, 10, 100, 1e3, 1e4], "scattering angle, degrees", "P, 1 for even scattering", power)
    for column, colour in [("red_650", RED), ("green_550", GREEN), ("blue_450", BLUE)]:
        axes.curve([(float(r["theta_deg"]), float(r[column])) for r in table], colour, 1.5)
    c.lines(126, 64, ["forward peak: 45 % of the light", "of 550 nm is scattered by less", "than 5° (silver lining, aureole)"], 13.5)
    x, y = axes.place(142, 0.34)
    c.line(x, y - 62, x, y - 8, INK, 1.3, arrow=True)
    c.text(x, y - 70, "fogbow", 14, "middle")
    x, y = axes.place(178, 0.5)
    c.line(x - 10, y - 82, x, y - 10, INK, 1.3, arrow=True)
    c.text(x + 2, y - 90, "glory", 14, "end")
    c.text(560, 58, "650 nm", 14, colour=RED)
    c.text(630, 58, "550 nm", 14, colour=GREEN)
    c.text(700, 58, "450 nm", 14, colour=BLUE)
    c.source("Effective radius 7 µm, broadness 2; tests/data/phase/phase_re07.csv, an independent Mie program")
    return c


def peak():
    """The two ways to take the forward peak out: by angle (method analytic), by moments (delta-M)."""
    c = Canvas(860, 400, "The forward peak cut off by angle and by moments")
    table = [(float(r["theta_deg"]), float(r["green_550"])) for r in rows("tests/data/phase/phase_re07.csv")]
    axes = Axes(c, (78, 56, 316, 260), (0, 12), (0.1, 1e4), y_log=True)
    axes.draw(range(0, 13, 2), [0.1, 1, 10, 100, 1e3, 1e4], "scattering angle, degrees", "P at 550 nm", power)

    def window(angle):
        t = min(max((6.0 - angle) / 2.0, 0.0), 1.0)
        return t * t * (3.0 - 2.0 * t)

    near = [(a, p) for a, p in table if a <= 12.0]
    axes.curve(near, GREY, 1.4, "4 3")
    axes.curve([(a, p * window(a)) for a, p in near if window(a) > 0], SUN, 2.4)
    axes.curve([(a, p * (1.0 - window(a))) for a, p in near if window(a) < 1], BLUE, 2.4)
    c.text(236, 26, "method analytic: by angle, softly", 15, "middle", bold=True)
    c.text(150, 84, "peak: counted as unscattered", 13.5, colour=SUN)
    c.text(386, 190, "smooth medium: the rest", 13.5, "end", BLUE)

    moments = [float(r["chi_l"]) for r in rows("tests/data/slab/legendre_re07_G550.csv")]
    streams = 48
    f = 0.5 * (moments[streams] + moments[streams + 1])
    axes = Axes(c, (506, 56, 330, 260), (0, 96), (0, 1))
    axes.draw(range(0, 97, 16), [0, 0.25, 0.5, 0.75, 1], "degree l of the moment", "Legendre moment of P", lambda v: f"{v:g}")
    x0, y0 = axes.place(0, f)
    x1, _ = axes.place(96, f)
    c.line(x0, y0, x1, y0, SUN, 1.4, "5 4")
    axes.curve(list(enumerate(moments[:97])), GREY, 2.0, "4 3")
    axes.curve([(l, (moments[l] - f) / (1.0 - f)) for l in range(streams + 1)], BLUE, 2.4)
    x, bottom = axes.place(streams, 0)
    c.line(x, 56, x, bottom, PALE, 1.2)
    c.text(670, 26, "delta-M: by moments", 15, "middle", bold=True)
    c.text(826, y0 - 8, f"cut off: f = {f:.2f}", 13.5, "end", SUN)
    c.text(826, 114, "kept: (χ_l − f) / (1 − f)", 13.5, "end", BLUE)
    c.text(826, 84, "moments χ_l of P", 13.5, "end", GREY)
    c.source("Droplets of 7 µm: tests/data/phase/phase_re07.csv, tests/data/slab/legendre_re07_G550.csv")
    return c


def single(value):
    """Rounded to 32 bits."""
    return struct.unpack("<f", struct.pack("<f", value))[0]


def precision():
    """What single precision leaves of two differences near zero, and what the series of the shaders leave."""
    c = Canvas(860, 392, "Differences in single precision and the series that replace them")
    axes = Axes(c, (92, 40, 560, 280), (1e-7, 10), (1e-9, 10), x_log=True, y_log=True)
    axes.draw([10.0**k for k in range(-7, 2)], [10.0**k for k in range(-9, 2, 2)], "optical path x", "relative error", power, power)

    def direct1(x):
        return single(1.0 - single(math.exp(-x))), -math.expm1(-x)

    def direct2(x):
        product = single(single(1.0 + x) * single(math.exp(-x)))
        exact = sum((-x) ** k / (math.factorial(k) * (k + 2)) for k in range(30)) * x * x if x < 1 else 1 - (1 + x) * math.exp(-x)
        return single(1.0 - product), exact

    def horner(x, factors):
        value = single(factors[-1])
        for factor in reversed(factors[:-1]):
            value = single(single(factor) - single(x * value))
        return value

    # slab_phi1 and slab_phi2 of shaders/shared/slab.wgsl, times x.
    def series1(x):
        if x >= 0.3:
            return direct1(x)
        return single(x * horner(x, [1 / math.factorial(k) for k in range(1, 8)])), -math.expm1(-x)

    def series2(x):
        if x >= 0.3:
            return direct2(x)
        return single(x * single(x * horner(x, [0.5, 1 / 3, 0.125, 1 / 30, 1 / 144, 1 / 840]))), direct2(x)[1]

    for function, colour, dash in [(direct1, RED, "5 4"), (direct2, SUN, "5 4"), (series1, BLUE, None), (series2, GREEN, None)]:
        points = []
        for step in range(180):
            # The largest of the errors around each place: single ones jump.
            worst = 0.0
            for k in range(24):
                x = single(10.0 ** (-7 + 8 * (step + k / 24) / 180))
                found, exact = function(x)
                worst = max(worst, abs(found / exact - 1.0))
            points.append((10.0 ** (-7 + 8 * (step + 0.5) / 180), min(max(worst, 1e-9), 10.0)))
        axes.curve(points, colour, 2.0, dash)
    for y, words, colour in [
        (64, ["1 − (1 + x) e^{−x}", "as a difference"], SUN),
        (124, ["1 − e^{−x}", "as a difference"], RED),
        (212, ["1 − (1 + x) e^{−x}", "by series below 0.3"], GREEN),
        (272, ["1 − e^{−x}", "by series below 0.3"], BLUE),
    ]:
        c.lines(668, y, words, 14, "start", colour)
    c.source("Computed with rounding to 32 bits after every operation; drawn are the largest errors around each place")
    return c


def limits():
    """Measured errors of the stages, side by side."""
    c = Canvas(860, 572, "Measured errors, root mean square")
    slab = {r["method"]: r for r in rows("docs/charts/slab.csv") if r["medium"] == "all"}
    light = rows("docs/charts/light.csv")
    exchange = rows("docs/charts/exchange.csv")

    def of_light(field, where, method, sun):
        for r in light:
            if (r["field"], r["light"], r["method"], r["sun_zenith_deg"]) == (field, where, method, sun):
                return float(r["rms"]) / float(r["mean_exact"])
        raise KeyError((field, where, method, sun))

    def of_exchange(case, kernel):
        for r in exchange:
            if r["case"] == case and r["kernel"] == kernel and r["solver"] == "settled" and r["texels_per_height"] == "4":
                return 0.01 * float(r["rms_percent"])
        raise KeyError((case, kernel))

    worst = slab["tabulated fine"]
    bars = [
        ("slab: radiance of an even layer", None, None),
        ("tabulated, fine (default)", max(float(worst["reflected_rms"]), float(worst["transmitted_rms"])), GREEN),
        ("tabulated, within 10° of the sun", float(worst["near_sun_rms"]), GREEN),
        ("analytic, reflected", float(slab["analytic"]["reflected_rms"]), RED),
        ("analytic, transmitted", float(slab["analytic"]["transmitted_rms"]), RED),
        ("light at the base of uneven cloud, blended (default)", None, None),
        ("closed cover, sun at 0°", of_light("overcast", "base", "blended", "0"), BLUE),
        ("closed cover, 60°", of_light("overcast", "base", "blended", "60"), BLUE),
        ("closed cover, 80°", of_light("overcast", "base", "blended", "80"), BLUE),
        ("broken cover, 60°", of_light("broken", "base", "blended", "60"), BLUE),
        ("broken cover, 80°", of_light("broken", "base", "blended", "80"), BLUE),
        ("light on the ground 1000 m below, blended", None, None),
        ("closed cover, 60°", of_light("overcast", "ground", "blended", "60"), PURPLE),
        ("broken cover, 60°", of_light("broken", "ground", "blended", "60"), PURPLE),
        ("broken cover, 80°", of_light("broken", "ground", "blended", "80"), PURPLE),
        ("exchange over a snow coast, broken cover", None, None),
        ("exact kernel, 4 texels a height (default)", of_exchange("broken over a coast of snow (0.95)", "exact"), SUN),
    ]
    left, right, top, step = 330, 790, 44, 27
    axes = Axes(c, (left, top - 14, right - left, step * len(bars) + 8), (1e-3, 2.0), (0, 1), x_log=True)
    percent = {1e-3: "0.1 %", 1e-2: "1 %", 1e-1: "10 %", 1.0: "100 %"}
    axes.draw(list(percent), [], "rms error of an even layer's radiance, or of irradiance relative to its mean", "", x_format=percent.get)
    for i, (words, value, colour) in enumerate(bars):
        y = top + step * i
        if value is None:
            c.rect(left - 316, y - 11, right - left + 320, 21, "#f3f4f6", "none")
            c.text(24, y + 5, words, 14, bold=True)
            continue
        c.text(left - 12, y + 5, words, 13.5, "end")
        x = axes.place(value, 0)[0]
        c.rect(left, y - 7, x - left, 15, colour, "none")
        label = f"{100 * value:.2g} %"
        c.text(x + 6, y + 5, label, 13)
    c.source("From docs/charts/slab.csv, light.csv and exchange.csv")
    return c
