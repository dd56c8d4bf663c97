#!/usr/bin/env python3
"""A day of light at a point beside the clear sky of pvlib, minute by minute from one request: day.py [SCENE.json] [day.png] [SECONDS from one to the next], at the server of $SKYLOOM
or http://127.0.0.1:8080. Needs pvlib and matplotlib. The scene's sun has a place and a time (config/scenes/day.json)."""
import csv, io, json, os, sys, time
from pathlib import Path

import matplotlib
matplotlib.use("Agg")
import matplotlib.pyplot as plt
import numpy as np
import pandas as pd
import pvlib

from skyloom import Sky

# Luminous efficacy of daylight, lm/W: what a lux is in W/m2, to some 5 % (Perez et al. 1990; Littlefair 1985).
LUMENS_PER_WATT = {"global": 110.0, "beam": 98.0, "diffuse": 125.0}


def series(sky, hours=24, every=60):
    """The series of the middle of the scene, as the server streams it: comments, a header, a row a time."""
    start = time.monotonic()
    text = sky._ask(sky._path("point.csv", {"at": "0,0", "from": 0, "to": hours * 3600, "every": every})).read().decode()
    rows = list(csv.DictReader(line for line in io.StringIO(text) if not line.startswith("#")))
    frame = pd.DataFrame(rows)
    frame.index = pd.to_datetime(frame.pop("utc"))
    return frame.apply(pd.to_numeric, errors="coerce"), time.monotonic() - start


def luminance(frame, name):
    return sum(weight * frame[f"{name}_{channel}"] for channel, weight in zip("rgb", (0.2126, 0.7152, 0.0722)))


def main():
    here = Path(__file__).parent
    scene = json.loads(Path(sys.argv[1] if len(sys.argv) > 1 else here / "../../config/scenes/day.json").read_text())
    out = sys.argv[2] if len(sys.argv) > 2 else "day.png"
    sky = Sky(scene)
    day, seconds = series(sky, every=int(sys.argv[3]) if len(sys.argv) > 3 else 60)
    sun = scene["sun"]
    place = pvlib.location.Location(sun["latitude_deg"], sun["longitude_deg"], "UTC", sun.get("altitude_m", 0))
    clear = place.get_clearsky(day.index, model="ineichen")
    theirs = place.get_solarposition(day.index)
    up = theirs["elevation"] > 0
    zenith_apart = np.abs(day["zenith_deg"] - theirs["zenith"])[up].max()
    print(f"{len(day)} times in {seconds:.1f} s; the sun is {zenith_apart:.4f} degrees from pvlib's at most")
    figure, (upper, lower) = plt.subplots(2, 1, sharex=True, figsize=(9, 6))
    for name, column, colour in (("global", "global", "tab:blue"), ("diffuse", "diffuse", "tab:green"), ("beam", "beam_normal", "tab:orange")):
        upper.plot(day.index, luminance(day, column), color=colour, label=f"skyloom, {name}")
    for name, column, colour in (("global", "ghi", "tab:blue"), ("diffuse", "dhi", "tab:green"), ("beam", "dni", "tab:orange")):
        upper.plot(clear.index, clear[column] * LUMENS_PER_WATT[name] / 1000, color=colour, linestyle=":", label=f"pvlib, clear, {name}")
    upper.set_ylabel("klx")
    upper.legend(ncols=2, fontsize="small")
    index = luminance(day, "global") / (clear["ghi"] * LUMENS_PER_WATT["global"] / 1000).where(clear["ghi"] > 20)
    lower.plot(day.index, index)
    lower.set_ylabel("global / clear global")
    lower.set_xlabel("UTC")
    figure.tight_layout()
    figure.savefig(out, dpi=110)
    print(f"written: {out}")
    if zenith_apart > 0.01:
        sys.exit("the sun is not where pvlib has it")


if __name__ == "__main__":
    main()
