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
    """The panorama's file, that of the light on the ground with the clouds' shadows in it, and what is told of them, in one reply."""
    textures = [f"sky.exr?axes=blender&size={size}&depth=32", "irradiance.exr?depth=32"]
    document = {"scene": scene, "time": time, "textures": textures}
    request = urllib.request.Request(
        f"{server}/v1/render", json.dumps(document).encode(), {"Content-Type": "application/json"}
    )
    with urllib.request.urlopen(request) as reply:
        archive = zipfile.ZipFile(io.BytesIO(reply.read()))
    folder = tempfile.mkdtemp(prefix="skyloom-")
    paths = [archive.extract(name, folder) for name in ("sky.exr", "irradiance.exr")]
    return *paths, json.loads(archive.read("index.json"))["sun"]


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


def ground(path, extent_m, albedo=(0.2, 0.2, 0.2), tiles=9):
    """The ground around the middle, lit as the server says: irradiance x albedo / pi is its radiance. Sun and sky are in that light, and the shadows of the
    clouds; the lamp is for what stands on it. The map's upper edge is the north, +y, and it repeats."""
    image = bpy.data.images.load(path)
    image.colorspace_settings.name = "Non-Color"
    side = extent_m * tiles / 2
    plane = bpy.data.meshes.new("skyloom ground")
    plane.from_pydata([(-side, -side, 0), (side, -side, 0), (side, side, 0), (-side, side, 0)], [], [(0, 1, 2, 3)])
    material = bpy.data.materials.new("skyloom ground")
    material.use_nodes = True
    nodes, links = material.node_tree.nodes, material.node_tree.links
    nodes.clear()
    place, scale = nodes.new("ShaderNodeTexCoord"), nodes.new("ShaderNodeMapping")
    scale.inputs["Scale"].default_value = (1 / extent_m, 1 / extent_m, 1)
    scale.inputs["Location"].default_value = (0.5, 0.5, 0)
    picture, light = nodes.new("ShaderNodeTexImage"), nodes.new("ShaderNodeEmission")
    picture.image, picture.extension = image, "REPEAT"
    reflect = nodes.new("ShaderNodeVectorMath")
    reflect.operation = "MULTIPLY"
    reflect.inputs[1].default_value = [part / math.pi for part in albedo]
    out = nodes.new("ShaderNodeOutputMaterial")
    links.new(place.outputs["Object"], scale.inputs["Vector"])
    links.new(scale.outputs["Vector"], picture.inputs["Vector"])
    links.new(picture.outputs["Color"], reflect.inputs[0])
    links.new(reflect.outputs["Vector"], light.inputs["Color"])
    links.new(light.outputs["Emission"], out.inputs["Surface"])
    plane.materials.append(material)
    return bpy.data.objects.new("skyloom ground", plane)


def box(side_m=2.0, at=(0.0, 8.0)):
    """Something to stand in the light: a white box."""
    made = bpy.data.meshes.new("box")
    low, high = -side_m / 2, side_m / 2
    corners = [(x, y, z) for z in (0, side_m) for y in (low, high) for x in (low, high)]
    made.from_pydata(corners, [], [(0, 2, 3, 1), (4, 5, 7, 6), (0, 1, 5, 4), (1, 3, 7, 5), (3, 2, 6, 7), (2, 0, 4, 6)])
    made = bpy.data.objects.new("box", made)
    made.location = (*at, 0.0)
    return made


def camera(azimuth_deg, elevation_deg, fov_deg=60.0):
    """Looks as the camera of skyloom does: degrees clockwise from north, +y, and above the horizon."""
    seen = bpy.data.cameras.new("camera")
    seen.sensor_fit, seen.angle = "VERTICAL", math.radians(fov_deg)
    made = bpy.data.objects.new("camera", seen)
    made.location = (0.0, 0.0, 2.0)
    made.rotation_euler = (math.radians(90.0 + elevation_deg), 0.0, math.radians(-azimuth_deg))
    return made


def stage(scene_json, server=SERVER, look=(0.0, 15.0), size=1024):
    """A scene of Blender with the sky around it, its sun, the ground in its light, and a camera; the box is for the eye."""
    path, light, told = fetch(server, scene_json, size=size)
    scene = bpy.data.scenes.new("skyloom")
    scene.world = world(path)
    scene.camera = camera(*look)
    extent_m = scene_json.get("domain", {}).get("extent_m", 20_000)
    for each in (sun(told), scene.camera, ground(light, extent_m)):
        scene.collection.objects.link(each)
    return scene


def main(scene_file, out="sky.png", server=SERVER, look="0,15"):
    azimuth, elevation = [float(part) for part in look.split(",")]
    with open(scene_file, encoding="utf-8") as file:
        scene = stage(json.load(file), server, (azimuth, elevation))
    ahead = math.radians(azimuth)
    scene.collection.objects.link(box(at=(10 * math.sin(ahead), 10 * math.cos(ahead))))
    scene.render.engine, scene.cycles.device, scene.cycles.samples = "CYCLES", "CPU", 32
    scene.render.resolution_x = scene.render.resolution_y = 256
    scene.view_settings.view_transform, scene.view_settings.exposure = "AgX", EXPOSURE_STOPS
    if out.endswith(".exr"):
        scene.render.image_settings.file_format, scene.render.image_settings.color_depth = "OPEN_EXR", "32"
    scene.render.filepath = os.path.abspath(out)
    bpy.ops.render.render(write_still=True, scene=scene.name)


if __name__ == "__main__":
    main(*sys.argv[sys.argv.index("--") + 1 if "--" in sys.argv else 1 :])
