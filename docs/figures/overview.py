"""What is computed at which rate, and where it is kept."""

from canvas import BLUE, GREEN, GREY, INK, PALE, PURPLE, SUN, Canvas

ROWS = [
    (
        "droplet mix",
        "new sizes or phase function",
        ["optics (Mie theory)", "flux tables, radiance tables"],
        ["memory, and a folder on disk", "file per mix, with a checksum"],
        SUN,
    ),
    (
        "sun",
        "new height of the sun",
        ["slice of the radiance tables", "(analytic: closure of the orders)"],
        ["on the device: the 8 that were", "used last"],
        PURPLE,
    ),
    (
        "moment",
        "new scene or time",
        ["thickness of each layer, sunlight,", "exchange with the ground, beam"],
        ["on the device: 8 fields, 8 lights,", "4 beams, sources of 4 moving fields"],
        GREEN,
    ),
    (
        "request",
        "new texture, view, size, format",
        ["one pass over the texels,", "encoded as a file"],
        ["reply cache of the server; strong", "ETag, immutable for every cache"],
        BLUE,
    ),
]


def lifetimes():
    c = Canvas(860, 404, "Four lifetimes, four caches")
    for x, words in [(95, "changes with"), (378, "what is computed"), (716, "where it is kept")]:
        c.text(x, 26, words, 14, "middle", GREY)
    for i, (name, when, what, where, colour) in enumerate(ROWS):
        y = 42 + 90 * i
        c.rect(16, y, 828, 72, "#fafafa", PALE, 1.0, 6)
        c.rect(16, y, 7, 72, colour, "none")
        c.text(36, y + 31, name, 16, bold=True)
        c.text(36, y + 53, when, 12.5, colour=GREY)
        c.box(262, y + 9, 232, 54, what, "white", colour, 13, bold_first=False)
        c.line(498, y + 36, 572, y + 36, INK, 1.4, arrow=True)
        c.text(535, y + 28, "kept", 12.5, "middle", GREY)
        c.box(578, y + 9, 252, 54, where, "white", GREY, 13, bold_first=False)
    for i in range(len(ROWS) - 1):
        y = 42 + 90 * i
        c.line(378, y + 64, 378, y + 98, INK, 1.4, arrow=True)
    return c
