"""Checks this example with Blender as a Python module, with a skyloom server that runs:  python3 check.py [SERVER]

A cloud in the shape of a letter lies right in the sky over the camera, and its shadow, with the sun in the south-west, to the north-east on the ground;
a white floor under world and lamp has the light that the texture `irradiance` says. It fails if a figure is out of its bounds."""

import array
import json
import os
import struct
import sys
import tempfile
import urllib.request
import zlib

import bpy
import numpy

sys.path.insert(0, os.path.dirname(os.path.abspath(__file__)))
import sky

SERVER = sys.argv[1] if len(sys.argv) > 1 else sky.SERVER
SIDE, TEXEL_M, BASE_M = 64, 100.0, 1000.0
wrong = []


def shows(what, value, is_right):
    print(f"{'ok   ' if is_right else 'WRONG'} {what}: {value}", flush=True)
    if not is_right:
        wrong.append(what)


def ask(path, body=None, media_type="application/json"):
    request = urllib.request.Request(SERVER + path, body, {"Content-Type": media_type} if body else {})
    with urllib.request.urlopen(request) as reply:
        return reply.read()


def render(scene, size, samples):
    """Linear light of a picture, rows from the top."""
    scene.render.engine, scene.cycles.device, scene.cycles.samples = "CYCLES", "CPU", samples
    scene.render.resolution_x = scene.render.resolution_y = size
    scene.render.image_settings.file_format, scene.render.image_settings.color_depth = "OPEN_EXR", "32"
    scene.render.filepath = os.path.join(tempfile.mkdtemp(), "picture.exr")
    bpy.ops.render.render(write_still=True, scene=scene.name)
    image = bpy.data.images.load(scene.render.filepath)
    values = array.array("f", [0.0]) * (size * size * 4)
    image.pixels.foreach_get(values)
    return numpy.array(values).reshape(size, size, 4)[::-1, :, :3]


# The letter F, north up, of 64 x 64 texels of 100 m; the sun in the south-west at 45 degrees.
down, across = numpy.mgrid[0:SIDE, 0:SIDE] - numpy.array([22, 25]).reshape(2, 1, 1)


def within(wide, first, last):
    return (across >= 0) & (across < wide) & (down >= first) & (down < last)


ink = within(3, 0, 20) | within(13, 0, 3) | within(9, 8, 11)
rows = b"".join(b"\0" + bytes(row.astype(numpy.uint8) * 255) for row in ink)


def chunk(kind, data):
    return struct.pack(">I", len(data)) + kind + data + struct.pack(">I", zlib.crc32(kind + data))


png = b"\x89PNG\r\n\x1a\n" + chunk(b"IHDR", struct.pack(">IIBBBBB", SIDE, SIDE, 8, 0, 0, 0, 0)) + chunk(b"IDAT", zlib.compress(rows)) + chunk(b"IEND", b"")
stored = json.loads(ask("/v1/images", png, "image/png"))["sha256"]
letter = {
    "domain": {"extent_m": TEXEL_M * SIDE, "resolution": SIDE}, "sun": {"zenith_deg": 45, "azimuth_deg": 225},
    "atmosphere": {"sun": [100, 100, 100], "sky": [3, 4, 6]}, "ground": {"albedo": [0.2, 0.2, 0.2]},
    "layers": [{"base_m": BASE_M, "thickness": {"kind": "image", "image": stored, "scale_m": 100},
                "droplets": {"henyey_greenstein": 0.85, "extinction_per_m": 0.03}}],
}


def ways(picture, right=0.0, up=0.0):
    """How much brighter the ink is than the paper, in the eight ways in which a letter can lie, moved by so many texels."""
    found = []
    for way in range(8):
        lies = ink.T if way & 4 else ink
        lies = lies[:, ::-1] if way & 1 else lies
        lies = lies[::-1] if way & 2 else lies
        moved = numpy.roll(numpy.roll(lies, round(right), 1), -round(up), 0)
        near = slice(12, 52)
        found.append(float(picture[near, near][moved[near, near]].mean()) - float(picture[near, near][~moved[near, near]].mean()))
    return found


# From straight above, north on top: the domain fills the picture.
stage = sky.stage(letter, SERVER, size=512)
stage.camera.data.type, stage.camera.data.ortho_scale = "ORTHO", TEXEL_M * SIDE
stage.camera.location, stage.camera.rotation_euler = (0, 0, 500), (0, 0, 0)
stage.camera.data.clip_end = 1e5
light = render(stage, SIDE, 4).mean(2)
shadow = ways(light, 7.4, 7.4)
shows("shadow 740 m to the north and east, darker, of the eight ways in which a letter can lie", " ".join(f"{each:.2f}" for each in shadow),
      shadow[0] < -0.5 and all(each > 0.7 * shadow[0] for each in shadow[1:]))

# The sky over the camera, with no light but the cloud's: who looks up, having looked north, has the east on the right and the south on top.
dark = {**letter, "atmosphere": {"sun": [100, 100, 100], "sky": [0, 0, 0]}, "ground": {"albedo": [0, 0, 0]}}
stage = sky.stage(dark, SERVER, look=(0.0, 90.0), size=512)
stage.camera.data.angle = 2 * numpy.arctan(TEXEL_M * SIDE / 2 / BASE_M)
cloud = ways(render(stage, SIDE, 4).mean(2)[::-1] > 2)
shows("cloud in the sky, the part of the ink that is lit less that of the paper, of the eight ways", " ".join(f"{each:.2f}" for each in cloud),
      cloud[0] > 0.5 and all(each < 0.8 * cloud[0] for each in cloud[1:]))

# A white floor under the world and the lamp, where no cloud is: its light is that of `irradiance`.
clear = {"sun": {"zenith_deg": 50, "azimuth_deg": 225}, "atmosphere": {"aerosol": {"optical_depth": 0.1}}, "ground": {"albedo": [0.2, 0.2, 0.2]}, "layers": []}
stage = sky.stage(clear, SERVER, size=512)
floor = bpy.data.meshes.new("floor")
floor.from_pydata([(-50, -50, 1), (50, -50, 1), (50, 50, 1), (-50, 50, 1)], [], [(0, 1, 2, 3)])
white = bpy.data.materials.new("white")
white.use_nodes = True
white.node_tree.nodes.clear()
diffuse, out = white.node_tree.nodes.new("ShaderNodeBsdfDiffuse"), white.node_tree.nodes.new("ShaderNodeOutputMaterial")
diffuse.inputs["Color"].default_value = (1, 1, 1, 1)
white.node_tree.links.new(diffuse.outputs[0], out.inputs["Surface"])
floor.materials.append(white)
stage.collection.objects.link(bpy.data.objects.new("floor", floor))
stage.camera.data.type, stage.camera.data.ortho_scale = "ORTHO", 20
stage.camera.location, stage.camera.rotation_euler = (0, 0, 500), (0, 0, 0)
found = numpy.pi * render(stage, 16, 512).mean((0, 1))
identity = json.loads(ask("/v1/skies", json.dumps(clear).encode()))["id"]
wanted = numpy.frombuffer(ask(f"/v1/skies/{identity}/irradiance.f32?size=1"), "<f4")
parts = found / wanted
shows("a white floor's light, in parts of irradiance", " ".join(f"{part:.3f}" for part in parts), bool((abs(parts - 1) < 0.02).all()))
sys.exit(1 if wrong else 0)
