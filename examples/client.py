#!/usr/bin/env python3
"""A client in ten lines: registers a scene and saves its cloud. examples/client.py config/scenes/broken.json [http://127.0.0.1:8080]"""
import json, sys, urllib.request

server = sys.argv[2] if len(sys.argv) > 2 else "http://127.0.0.1:8080"
scene = open(sys.argv[1], "rb").read()
post = urllib.request.Request(server + "/v1/skies", scene, {"Content-Type": "application/json"})
sky = json.load(urllib.request.urlopen(post))
for note in sky["notes"]:
    print("note:", note["pointer"], note["detail"])
with urllib.request.urlopen(server + sky["links"]["cloud"]) as reply, open("cloud.exr", "wb") as file:
    file.write(reply.read())
    print("cloud.exr, expected error", reply.headers["Skyloom-Expected-Error"])
