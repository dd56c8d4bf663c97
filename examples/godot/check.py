"""Runs the project of Godot 3 (Debian's `godot3-runner`, under Xvfb where there is no screen), with a skyloom server that runs:  python3 check.py [SERVER]

A cloud in the shape of a letter lies right in the sky overhead, and its shadow, with the sun in the south-west, to the north-east on the ground. Needs numpy
and Pillow. It fails if a figure is out of its bounds."""

import io
import json
import os
import shutil
import subprocess
import sys
import tempfile
import urllib.request

import numpy
from PIL import Image

SERVER = sys.argv[1] if len(sys.argv) > 1 else "http://127.0.0.1:8080"
HERE = os.path.dirname(os.path.abspath(__file__))
SIDE, TEXEL_M, BASE_M = 64, 100.0, 1000.0
wrong = []


def shows(what, value, is_right):
    print(f"{'ok   ' if is_right else 'WRONG'} {what}: {value}", flush=True)
    if not is_right:
        wrong.append(what)


def godot(scene, *arguments):
    """Light of the picture, 0 to 1, rows from the top, a texel for a texel of the letter."""
    folder = tempfile.mkdtemp()
    file, picture = os.path.join(folder, "scene.json"), os.path.join(folder, "picture.png")
    with open(file, "w", encoding="utf-8") as out:
        json.dump(scene, out)
    screen = [] if os.environ.get("DISPLAY") else ["xvfb-run", "-a", "-s", "-screen 0 640x640x24"]
    command = [*screen, "godot3-runner", "--path", os.path.join(HERE, "godot3"), "--video-driver", "GLES3", f"--scene={file}", f"--server={SERVER}",
               f"--picture={picture}", *arguments]
    told = subprocess.run(command, capture_output=True, text=True, timeout=180)
    if not os.path.exists(picture):
        sys.exit(told.stdout + told.stderr)
    image = Image.open(picture).convert("RGB").resize((SIDE, SIDE), Image.Resampling.BOX)
    shutil.rmtree(folder)
    return numpy.asarray(image).mean(2) / 255


down, across = numpy.mgrid[0:SIDE, 0:SIDE] - numpy.array([22, 25]).reshape(2, 1, 1)


def within(wide, first, last):
    return (across >= 0) & (across < wide) & (down >= first) & (down < last)


ink = within(3, 0, 20) | within(13, 0, 3) | within(9, 8, 11)


def ways(picture, right=0, up=0):
    """How much brighter the ink is than the paper, in the eight ways in which a letter can lie, moved by so many texels."""
    found = []
    for way in range(8):
        lies = ink.T if way & 4 else ink
        lies = lies[:, ::-1] if way & 1 else lies
        lies = lies[::-1] if way & 2 else lies
        moved = numpy.roll(numpy.roll(lies, right, 1), -up, 0)
        near = slice(12, 52)
        found.append(float(picture[near, near][moved[near, near]].mean() - picture[near, near][~moved[near, near]].mean()))
    return found


image = io.BytesIO()
Image.fromarray(ink.astype(numpy.uint8) * 255).save(image, "png")
request = urllib.request.Request(f"{SERVER}/v1/images", image.getvalue(), {"Content-Type": "image/png"})
stored = json.load(urllib.request.urlopen(request))["sha256"]
letter = {
    "domain": {"extent_m": TEXEL_M * SIDE, "resolution": SIDE}, "sun": {"zenith_deg": 45, "azimuth_deg": 225},
    "atmosphere": {"sun": [100, 100, 100], "sky": [3, 4, 6]}, "ground": {"albedo": [0.2, 0.2, 0.2]},
    "layers": [{"base_m": BASE_M, "thickness": {"kind": "image", "image": stored, "scale_m": 100},
                "droplets": {"henyey_greenstein": 0.85, "extinction_per_m": 0.03}}],
}

shadow = ways(godot(letter, "--from-above"), 7, 7)
shows("shadow 700 m to the north and east, darker, of the eight ways in which a letter can lie", " ".join(f"{each:.2f}" for each in shadow),
      shadow[0] < -0.05 and all(each > 0.7 * shadow[0] for each in shadow[1:]))

# Overhead, with no light but the cloud's: who looks up, having looked north, has the east on the right and the south on top. 60 degrees show 1155 m.
dark = {**letter, "atmosphere": {"sun": [100, 100, 100], "sky": [0, 0, 0]}, "ground": {"albedo": [0, 0, 0]}}
seen = godot(dark, "--look=0,90")[::-1] > 0.1
place = ((numpy.arange(SIDE) + 0.5) / SIDE - 0.5) * 2 * BASE_M * numpy.tan(numpy.radians(30)) / TEXEL_M + SIDE / 2
lying = []
for way in range(8):
    lies = ink.T if way & 4 else ink
    lies = lies[:, ::-1] if way & 1 else lies
    lies = lies[::-1] if way & 2 else lies
    wanted = lies[numpy.ix_(place.astype(int), place.astype(int))]
    lying.append(float((wanted == seen).mean()))
shows("letter overhead, the part of the picture that is as it would be in each of the eight ways", " ".join(f"{each:.2f}" for each in lying),
      lying[0] > 0.9 and all(each < lying[0] - 0.04 for each in lying[1:]))
sys.exit(1 if wrong else 0)
