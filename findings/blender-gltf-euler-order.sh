#!/usr/bin/env bash
# Blender's glTF exporter without sampling takes Euler angles of every order for XYZ.
#
# Version: bpy 5.0.1 from PyPI (its exporter is io_scene_gltf2 5.0.21), Python 3.11.
# Expected: a bone whose rotation mode is ZYX is exported as Blender shows it, with "Sampling
#   Animations" (export_force_sampling) and without: the same quaternions.
# What happens: without sampling, the keys' Euler angles are turned into quaternions in the order XYZ,
#   whatever the bone's rotation mode says. XYZ and QUATERNION are right, ZYX is 20 degrees off here,
#   without a warning. Blender's BVH importer makes bones of the order that the file's channels have, so
#   that captures that are imported and exported again are wrong.
# Output seen:
#   QUATERNION: 0.00 degrees between sampled and not sampled
#   XYZ: 0.00 degrees between sampled and not sampled
#   ZYX: 20.91 degrees between sampled and not sampled
#
# Installs pinned packages in a temporary folder (about 1 GB, removed at the end); needs python3.11.
# Fails where any of this is otherwise.
set -euo pipefail
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
python3.11 -m venv "$folder/venv"
"$folder/venv/bin/pip" install --quiet bpy==5.0.1 numpy==1.26.4
cat > "$folder/export.py" <<'PYTHON'
import json
import math
import struct
import sys

import bpy
from mathutils import Euler, Quaternion

PATH = sys.argv[1]


def rotation(mode, is_sampled):
    bpy.ops.wm.read_factory_settings(use_empty=True)
    armature = bpy.data.armatures.new("armature")
    person = bpy.data.objects.new("person", armature)
    bpy.context.scene.collection.objects.link(person)
    bpy.context.view_layer.objects.active = person
    bpy.ops.object.mode_set(mode="EDIT")
    bone = armature.edit_bones.new("bone")
    bone.head, bone.tail = (0, 0, 0), (0, 0, 1)
    bpy.ops.object.mode_set(mode="OBJECT")
    bone = person.pose.bones["bone"]
    bone.rotation_mode = mode
    turn = Euler((0.3, 0.5, 0.7), "XYZ").to_quaternion()
    for frame in (1, 2):
        if mode == "QUATERNION":
            bone.rotation_quaternion = turn
            bone.keyframe_insert("rotation_quaternion", frame=frame)
        else:
            bone.rotation_euler = turn.to_euler(mode)
            bone.keyframe_insert("rotation_euler", frame=frame)
    strip = person.animation_data.action.layers[0].strips[0]
    for curve in strip.channelbags[0].fcurves:
        for key in curve.keyframe_points:
            key.interpolation = "LINEAR"
    bpy.ops.export_scene.gltf(
        filepath=PATH, export_format="GLB", export_force_sampling=is_sampled
    )
    data = open(PATH, "rb").read()
    length = struct.unpack("<I", data[12:16])[0]
    file, binary = json.loads(data[20 : 20 + length]), data[28 + length :]
    animation = file["animations"][0]
    for channel in animation["channels"]:
        if channel["target"]["path"] == "rotation":
            accessor = file["accessors"][animation["samplers"][channel["sampler"]]["output"]]
            view = file["bufferViews"][accessor["bufferView"]]
            start = view.get("byteOffset", 0) + accessor.get("byteOffset", 0)
            x, y, z, w = struct.unpack_from("<4f", binary, start)
            return Quaternion((w, x, y, z))
    raise SystemExit("no rotation was exported")


is_as_seen = True
for mode, is_right in (("QUATERNION", True), ("XYZ", True), ("ZYX", False)):
    sampled, keys = rotation(mode, True), rotation(mode, False)
    degrees = math.degrees(2 * math.acos(min(1, abs(sampled.dot(keys)))))
    print(f"RESULT {mode}: {degrees:.2f} degrees between sampled and not sampled")
    is_as_seen &= (degrees < 0.1) == is_right
sys.stdout.flush()
sys.exit(0 if is_as_seen else 1)
PYTHON
"$folder/venv/bin/python" "$folder/export.py" "$folder/out.glb" | sed -n 's/^RESULT //p'
