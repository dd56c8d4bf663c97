"""A sky of skyloom as the world of a Blender scene, with its sun as a lamp.

In Blender's text editor, or with Blender as a Python module:  python3 sky.py SCENE.json [OUT.png] [SERVER] [AZIMUTH,ELEVATION]
"""

import io
import json
import math
import os
import sys
import tempfile
import urllib.request
import zipfile

import bpy
from mathutils import Vector

SERVER = "http://127.0.0.1:8080"
# Light comes in kcd/m2 and klx: a sunlit cloud is about 20. The view's exposure brings that to the screen.
EXPOSURE_STOPS = -4.5


def fetch(server, scene, time=0.0, size=1024):
    """The panorama's file and the sun, in one reply."""
    document = {"scene": scene, "time": time, "textures": [f"sky.exr?axes=blender&size={size}&depth=32"]}
    request = urllib.request.Request(
        f"{server}/v1/render", json.dumps(document).encode(), {"Content-Type": "application/json"}
    )
    with urllib.request.urlopen(request) as reply:
        archive = zipfile.ZipFile(io.BytesIO(reply.read()))
    folder = tempfile.mkdtemp(prefix="skyloom-")
    return archive.extract("sky.exr", folder), json.loads(archive.read("index.json"))["sun"]


def world(path):
    """The panorama around everything: its middle lies in the east, +x, as `axes=blender` has it."""
    image = bpy.data.images.load(path)
    image.colorspace_settings.name = "Linear Rec.709"
    made = bpy.data.worlds.new("skyloom")
    made.use_nodes = True
    nodes, links = made.node_tree.nodes, made.node_tree.links
    picture = nodes.new("ShaderNodeTexEnvironment")
    picture.image, picture.projection = image, "EQUIRECTANGULAR"
    background = nodes["Background"]
    background.inputs["Strength"].default_value = 1.0
    links.new(picture.outputs["Color"], background.inputs["Color"])
    return made


def sun(told):
    """The sun's beam on a plane that faces it, which is what a lamp's strength means; the panorama has no disc."""
    lamp = bpy.data.lights.new("skyloom sun", "SUN")
    beam = told["irradiance"]["facing_the_sun"]
    most = max(beam) or 1.0
    lamp.energy, lamp.color = max(beam), [part / most for part in beam]
    lamp.angle = math.radians(told["angular_diameter_deg"])
    made = bpy.data.objects.new("skyloom sun", lamp)
    # A lamp shines along its own -z.
    made.rotation_mode = "QUATERNION"
    made.rotation_quaternion = Vector(told["direction"]).to_track_quat("Z", "Y")
    return made


def camera(azimuth_deg, elevation_deg, fov_deg=60.0):
    """Looks as the camera of skyloom does: degrees clockwise from north, +y, and above the horizon."""
    seen = bpy.data.cameras.new("camera")
    seen.sensor_fit, seen.angle = "VERTICAL", math.radians(fov_deg)
    made = bpy.data.objects.new("camera", seen)
    made.location = (0.0, 0.0, 2.0)
    made.rotation_euler = (math.radians(90.0 + elevation_deg), 0.0, math.radians(-azimuth_deg))
    return made


def main(scene_file, out="sky.png", server=SERVER, look="0,15"):
    with open(scene_file, encoding="utf-8") as file:
        path, told = fetch(server, json.load(file))
    scene = bpy.data.scenes.new("skyloom")
    scene.world = world(path)
    scene.collection.objects.link(sun(told))
    scene.camera = camera(*[float(part) for part in look.split(",")])
    scene.collection.objects.link(scene.camera)
    plane = bpy.data.meshes.new("ground")
    plane.from_pydata([(-1e3, -1e3, 0), (1e3, -1e3, 0), (1e3, 1e3, 0), (-1e3, 1e3, 0)], [], [(0, 1, 2, 3)])
    scene.collection.objects.link(bpy.data.objects.new("ground", plane))
    scene.render.engine, scene.cycles.device, scene.cycles.samples = "CYCLES", "CPU", 32
    scene.render.resolution_x = scene.render.resolution_y = 256
    scene.view_settings.view_transform, scene.view_settings.exposure = "AgX", EXPOSURE_STOPS
    if out.endswith(".exr"):
        scene.render.image_settings.file_format, scene.render.image_settings.color_depth = "OPEN_EXR", "32"
    scene.render.filepath = os.path.abspath(out)
    bpy.ops.render.render(write_still=True, scene=scene.name)


if __name__ == "__main__":
    main(*sys.argv[sys.argv.index("--") + 1 if "--" in sys.argv else 1 :])
