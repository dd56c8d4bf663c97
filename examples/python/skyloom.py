#!/usr/bin/env python3
"""A client of skyloom: skyloom.py SCENE.json [TEXTURE] [NAME=VALUE ...], at the server of $SKYLOOM or http://127.0.0.1:8080.

>>> sky = Sky(json.load(open("config/scenes/broken.json")))
>>> sky.texture("irradiance", time=600, size=256, component="direct").sel(y=0, method="nearest")
"""
import json, os, sys, urllib.error, urllib.parse, urllib.request
from dataclasses import dataclass

import numpy as np

try:
    import xarray
except ImportError:
    xarray = None

CHANNELS = {1: ["Y"], 3: ["R", "G", "B"], 4: ["R", "G", "B", "A"]}


class Refused(Exception):
    """What the server refused, with each wrong field and what is allowed there."""


@dataclass
class Texture:
    """An array with axes and units, where xarray is not installed: the same names as those of its DataArray."""
    values: np.ndarray
    dims: tuple
    coords: dict
    attrs: dict
    name: str


class Sky:
    def __init__(self, scene, server=None):
        self.server = server or os.environ.get("SKYLOOM", "http://127.0.0.1:8080")
        answer = json.load(self._ask("/v1/skies", json.dumps(scene).encode()))
        self.id, self.scene, self.notes, self.version = answer["id"], answer["scene"], answer["notes"], answer["version"]

    def sun(self, time=0):
        return self._json("sun.json", time=time)

    def ambient(self, **query):
        return self._json("ambient.json", **query)

    def plan(self, texture, **query):
        return self._json("plan", texture=texture, **query)

    def texture(self, name, **query):
        """A texture in 32-bit floats; `query` as in docs/http.md. Maps have axes y, x in metres north and east of the middle; an
        equirectangular sky elevation and azimuth in degrees; other projections row and column."""
        reply = self._ask(self._path(f"{name}.f32", query))
        shape = [int(side) for side in reply.headers["X-Skyloom-Shape"].split(",")]
        values = np.frombuffer(reply.read(), "<f4").reshape(shape)
        dims, coords = self._axes(name, query, *shape[:2])
        attrs = {"units": self._unit(name, query), "time_s": float(query.get("time", 0)), "sky": self.id, "version": self.version,
                 "expected_error": float(reply.headers.get("Skyloom-Expected-Error", "nan")),
                 "tolerance_met": reply.headers.get("Skyloom-Tolerance-Met") != "false"}
        coords["channel"] = CHANNELS[shape[2]]
        make = xarray.DataArray if xarray else Texture
        return make(values, dims=(*dims, "channel"), coords=coords, attrs=attrs, name=name)

    def _axes(self, name, query, height, width):
        rows, columns = (np.arange(height) + 0.5) / height, (np.arange(width) + 0.5) / width
        if name not in ("sky", "compass"):
            extent = self.scene["domain"]["extent_m"]
            return ("y", "x"), {"y": (0.5 - rows) * extent, "x": (columns - 0.5) * extent}
        if query.get("projection", "equirect") == "equirect" and query.get("axes", "enu") == "enu":
            return ("elevation", "azimuth"), {"elevation": 90 - 180 * rows, "azimuth": 360 * columns}
        return ("row", "column"), {"row": np.arange(height), "column": np.arange(width)}

    def _unit(self, name, query):
        if "wavelength" in query and query["wavelength"] != "rgb":
            return "1/sr" if name == "sky" else "1"
        is_physical = not isinstance(self.scene["atmosphere"].get("sun"), list)
        unit = {"sky": "kcd/m2", "cloud": "kcd/m2", "irradiance": "klx"}.get(name)
        if unit:
            scale = "" if float(query.get("scale", 1)) == 1 else f" x {query['scale']}"
            return (unit if is_physical else "of the scene's own light") + scale
        return {"thickness": "m"}.get(name, "1")

    def _path(self, what, query):
        query = {key: str(value).lower() if isinstance(value, bool) else value for key, value in query.items()}
        return f"/v1/skies/{self.id}/{what}?{urllib.parse.urlencode(query)}"

    def _json(self, what, **query):
        return json.load(self._ask(self._path(what, query)))

    def _ask(self, path, body=None):
        request = urllib.request.Request(self.server + path, body, {"Content-Type": "application/json"} if body else {})
        try:
            return urllib.request.urlopen(request)
        except urllib.error.HTTPError as error:
            problem = json.load(error)
            wrong = [f"\n  {each.get('pointer') or each.get('parameter')}: {each['detail']}" for each in problem.get("errors", [])]
            raise Refused(f"{problem['title']}: {problem.get('detail', '')}{''.join(wrong)}") from None


def main():
    if len(sys.argv) < 2:
        sys.exit(__doc__)
    try:
        sky = Sky(json.load(open(sys.argv[1])))
        for note in sky.notes:
            print("note:", note["pointer"], note["detail"])
        name = sys.argv[2] if len(sys.argv) > 2 else "irradiance"
        texture = sky.texture(name, **dict(argument.split("=", 1) for argument in sys.argv[3:]))
    except (Refused, urllib.error.URLError, OSError, ValueError) as error:
        sys.exit(f"{error}")
    values = np.asarray(texture.values)
    print(f"{name} {values.shape}, {texture.attrs['units']}, expected error {texture.attrs['expected_error']:.2g}")
    for channel, label in enumerate(texture.coords["channel"]):
        plane = values[..., channel]
        print(f"  {str(np.asarray(label))}: least {plane.min():.4g}, mean {plane.mean():.4g}, most {plane.max():.4g}")
    np.save(f"{name}.npy", values)
    print(f"written: {name}.npy")


if __name__ == "__main__":
    main()
