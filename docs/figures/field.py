"""Figures of thickness fields: how one is made, and how it moves."""

import math

from canvas import BLUE, CLOUD, CLOUD_EDGE, GREEN, GREY, INK, PALE, PURPLE, RED, Axes, Canvas, Random


def noise(seed, count):
    """A periodic Gaussian-like curve of octaves whose amplitudes fall by 2^(-1/3), brought to deviation 1."""
    random = Random(seed)
    waves = []
    for octave in range(7):
        for _ in range(3):
            cycles = round((1.0 + random.next()) * 2**octave)
            waves.append((cycles, 2 * math.pi * random.next(), 2.0 ** (-octave / 3)))
    values = [sum(a * math.cos(2 * math.pi * k * i / count + p) for k, p, a in waves) for i in range(count)]
    mean = sum(values) / count
    deviation = math.sqrt(sum((v - mean) ** 2 for v in values) / count)
    return [(v - mean) / deviation for v in values]


def synthesis():
    """From a Gaussian field to thickness, with the renderer's formulas."""
    c = Canvas(860, 470, "From a Gaussian field to cloud thickness")
    count, spread = 560, 0.9
    g = noise(5, count)
    water = [math.exp(spread * v) for v in g]
    # Half of the domain is cloud; the mean of the cloudy part is 300 m, found by halving as the renderer does.
    threshold = sorted(water)[count // 2]
    mean_m, clip_m = 300.0, 750.0

    def thickness(w, scale):
        free = scale * math.sqrt(max(w - threshold, 0.0))
        return free / (1.0 + (free / clip_m) ** 4) ** 0.25

    low, high = 1.0, 1e5
    for _ in range(60):
        scale = math.sqrt(low * high)
        cloudy = [thickness(w, scale) for w in water if w > threshold]
        low, high = (scale, high) if sum(cloudy) / len(cloudy) < mean_m else (low, scale)
    heights = [thickness(w, low) for w in water]
    rows = [
        (g, [-3, 3], [-2, 0, 2], "Gaussian field", ["octaves of noise with a −5/3", "spectrum, and cells; mean 0,", "deviation 1"], BLUE),
        (water, [0, 6], [0, 2, 4, 6], "water path", ["lognormal, e^{s g}; cloud is what", "exceeds the threshold that gives", "the coverage asked for"], PURPLE),
        (heights, [0, 800], [0, 250, 500, 750], "thickness, m", ["its root, as in an adiabatic", "cloud, scaled to the mean asked", "for, clipped softly at 2.5 means"], GREEN),
    ]
    for i, (values, span, ticks, label, words, colour) in enumerate(rows):
        axes = Axes(c, (84, 20 + 150 * i, 506, 112), (0, count), span)
        axes.draw([], ticks, "", label, y_format=lambda v: str(v).replace("-", "−"))
        points = [(k, min(v, span[1])) for k, v in enumerate(values)]
        if i == 2:
            outline = [axes.place(0, 0)] + [axes.place(*p) for p in points] + [axes.place(count, 0)]
            c.polygon(outline, CLOUD, CLOUD_EDGE)
        else:
            axes.curve(points, colour, 1.7)
        if i == 1:
            y = axes.place(0, threshold)[1]
            c.line(84, y, 590, y, RED, 1.4, "5 4")
            c.text(598, y + 5, "threshold", 13, colour=RED)
        c.lines(616, 52 + 150 * i - (12 if i == 1 else 0), words, 13)
        if i < 2:
            c.line(337, 136 + 150 * i, 337, 164 + 150 * i, INK, 1.6, arrow=True)
    c.text(337, 460, "place, over one periodic domain", 14, "middle")
    return c


class Eddies:
    """A few waves that blow along their crests: no divergence."""

    def __init__(self, seed):
        random = Random(seed)
        self.waves = []
        for k in range(10):
            direction = math.pi * (k + random.next()) / 10
            number = 1.0 + 2.0 * random.next()
            cycles = (round(number * math.cos(direction)), round(number * math.sin(direction)))
            if cycles != (0, 0):
                self.waves.append((cycles, 2 * math.pi * random.next()))

    def velocity(self, x, y):
        u = v = 0.0
        for (kx, ky), phase in self.waves:
            wave = math.sin(2 * math.pi * (kx * x + ky * y) + phase) / math.hypot(kx, ky)
            u += ky * wave
            v -= kx * wave
        return u, v

    def carried(self, x, y, way, steps=24):
        for _ in range(steps):
            u, v = self.velocity(x, y)
            um, vm = self.velocity(x + 0.5 * way / steps * u, y + 0.5 * way / steps * v)
            x, y = x + way / steps * um, y + way / steps * vm
        return x, y


def motion():
    """Two layers of displacement, and their weights over time."""
    c = Canvas(860, 352, "A field displaced by eddies: two layers of displacement and their weights")
    eddies = Eddies(3)
    cells = 8
    for left, way, title, words in [
        (24, 0.0, "layer at birth: D = 0", "weight 0"),
        (206, 0.011, "layer in mid-life", "weight 1"),
        (388, 0.022, "layer at its end", "weight 0"),
    ]:
        top, side = 62, 150
        c.rect(left, top, side, side, "#f8fafc", PALE)
        for i in range(cells + 1):
            for flip in (False, True):
                line = []
                for k in range(49):
                    a, b = k / 48, i / cells
                    x, y = (b, a) if flip else (a, b)
                    x, y = eddies.carried(x, y, way)
                    line.append((left + side * x, top + side * y))
                c.polyline(line, BLUE if not flip else PURPLE, 1.1)
        c.text(left + side / 2, 30, title, 13.5, "middle", bold=True)
        c.text(left + side / 2, top + side + 32, words, 13, "middle", GREY)
    c.lines(
        24,
        268,
        ["Noise is read at x − D: the field is bent, not smeared. Before the mapping folds,", "a layer fades out, and starts again from D = 0 while the other carries the field."],
        13,
    )
    axes = Axes(c, (636, 50, 204, 160), (0, 2), (0, 1.15))
    axes.draw([0, 0.5, 1, 1.5, 2], [0, 0.5, 1], "time, lives of a layer", "weight", y_format=lambda v: f"{v:g}", x_format=lambda v: f"{v:g}")
    first, second = [], []
    for i in range(201):
        t = i / 100
        w = 1.0 - abs(2.0 * (t % 1.0) - 1.0)
        first.append((t, w))
        second.append((t, 1.0 - w))
    axes.curve(first, BLUE, 2.2)
    axes.curve(second, RED, 2.2, "7 4")
    c.text(738, 30, "the two sum to 1", 13.5, "middle", bold=True)
    c.lines(600, 282, ["A life is 64 steps: any time is replayed", "from the last birth in at most 63."], 13)
    c.lines(
        24,
        318,
        ["Two displaced copies differ, so that their blend lacks variance: each octave is divided by √(a² + b² + 2abρ),", "ρ being the correlation of the two at that octave's wavelength."],
        13,
    )
    return c
