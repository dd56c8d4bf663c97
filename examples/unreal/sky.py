"""A sky of skyloom as the sky light of an Unreal level, and its sun as the directional light.

In the editor, with the plugin "Python Editor Script Plugin":  py "sky.py" "C:/scenes/day.json"
"""

import json
import os
import sys
import tempfile
import urllib.request
import zipfile

import unreal

SERVER = "http://127.0.0.1:8080"
FOLDER = "/Game/Skyloom"


def fetch(scene, time=0.0, size=1024):
    """The panorama's file in cd/m2, and the sun."""
    document = {"scene": scene, "time": time, "textures": [f"sky.hdr?axes=unreal&size={size}&scale=1000"]}
    request = urllib.request.Request(
        f"{SERVER}/v1/render", json.dumps(document).encode(), {"Content-Type": "application/json"}
    )
    path = os.path.join(tempfile.mkdtemp(prefix="skyloom-"), "sky.zip")
    with urllib.request.urlopen(request) as reply, open(path, "wb") as file:
        file.write(reply.read())
    with zipfile.ZipFile(path) as archive:
        return archive.extract("sky.hdr", os.path.dirname(path)), json.loads(archive.read("index.json"))["sun"]


def cube(path):
    """A long-lat .hdr becomes a cube on import, which an .exr does not."""
    task = unreal.AssetImportTask()
    task.filename, task.destination_path, task.destination_name = path, FOLDER, "Sky"
    task.automated, task.replace_existing, task.save = True, True, True
    unreal.AssetToolsHelpers.get_asset_tools().import_asset_tasks([task])
    return unreal.load_asset(f"{FOLDER}/Sky")


def main(scene_file):
    with open(scene_file, encoding="utf-8") as file:
        path, told = fetch(json.load(file))
    actors = unreal.get_editor_subsystem(unreal.EditorActorSubsystem)
    sky = actors.spawn_actor_from_class(unreal.SkyLight, unreal.Vector(0, 0, 0)).light_component
    sky.set_mobility(unreal.ComponentMobility.MOVABLE)
    sky.set_editor_property("source_type", unreal.SkyLightSourceType.SLS_SPECIFIED_CUBEMAP)
    sky.set_editor_property("cubemap", cube(path))
    sky.set_editor_property("intensity", 1.0)
    # Light from below the horizon is in the panorama.
    sky.set_editor_property("lower_hemisphere_is_black", False)

    east, north, up = told["direction"]
    # x east, y south, z up; a light shines along its x.
    away = unreal.Vector(-east, north, -up)
    rotation = unreal.MathLibrary.make_rot_from_x(away)
    light = actors.spawn_actor_from_class(unreal.DirectionalLight, unreal.Vector(0, 0, 0), rotation).light_component
    light.set_mobility(unreal.ComponentMobility.MOVABLE)
    beam = told["irradiance"]["facing_the_sun"]
    most = max(beam) or 1.0
    # Lux; the colour is linear.
    light.set_intensity(1000.0 * most if up > 0.0 else 0.0)
    light.set_light_color(unreal.LinearColor(*[part / most for part in beam]), False)
    light.set_editor_property("light_source_angle", told["angular_diameter_deg"])


if __name__ == "__main__":
    main(sys.argv[1])
