#!/usr/bin/env bash
# Blender's glTF exporter with "Remove Armature Object" leaves the root's animation in the armature's space.
#
# Version: bpy 5.0.1 from PyPI (its exporter is io_scene_gltf2 5.0.21), Python 3.11.
# Expected: with export_armature_object_remove the transform of the armature's object goes over to the
#   root bone, in its node and in its animation: a bone that is keyed where it rests stays there.
# What happens: the node has the transform, the animation's translation does not. An armature scaled by
#   0.01 rests at 1 m and plays at 100 m; one turned by 90 degrees about x rests at (0, 0, 1) and plays at
#   (0, 1, 0). VRM Add-on for Blender 4.10.2 exports VRM 1.0 with animations this way, with the same result.
# Output seen:
#   kept, scale 1, turn 0: rests at (0.00, 1.00, 0.00), plays at (0.00, 1.00, 0.00)
#   removed, scale 1, turn 0: rests at (0.00, 1.00, 0.00), plays at (0.00, 1.00, 0.00)
#   kept, scale 0.01, turn 0: rests at (0.00, 100.00, 0.00), plays at (0.00, 100.00, 0.00)
#   removed, scale 0.01, turn 0: rests at (0.00, 1.00, 0.00), plays at (0.00, 100.00, 0.00)
#   kept, scale 1, turn 90: rests at (0.00, 1.00, 0.00), plays at (0.00, 1.00, 0.00)
#   removed, scale 1, turn 90: rests at (0.00, 0.00, 1.00), plays at (0.00, 1.00, 0.00)
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

PATH = sys.argv[1]


def places(scale, turn_degrees, is_removed):
    """Where the root bone rests and where its first key has it, in its parent's space."""
    bpy.ops.wm.read_factory_settings(use_empty=True)
    armature = bpy.data.armatures.new("armature")
    person = bpy.data.objects.new("person", armature)
    bpy.context.scene.collection.objects.link(person)
    bpy.context.view_layer.objects.active = person
    bpy.ops.object.mode_set(mode="EDIT")
    bone = armature.edit_bones.new("root")
    bone.head, bone.tail = (0, 0, 1 / scale), (0, 0, 2 / scale)
    bpy.ops.object.mode_set(mode="OBJECT")
    person.scale = [scale] * 3
    person.rotation_euler = (math.radians(turn_degrees), 0, 0)
    for frame in (1, 11):
        person.pose.bones["root"].keyframe_insert("location", frame=frame)
    bpy.ops.export_scene.gltf(
        filepath=PATH,
        export_format="GLB",
        export_armature_object_remove=is_removed,
        export_optimize_animation_size=False,
    )
    data = open(PATH, "rb").read()
    length = struct.unpack("<I", data[12:16])[0]
    file, binary = json.loads(data[20 : 20 + length]), data[28 + length :]
    names = [node["name"] for node in file["nodes"]]
    rest = file["nodes"][names.index("root")]["translation"]
    animation = file["animations"][0]
    for channel in animation["channels"]:
        target = channel["target"]
        if names[target["node"]] == "root" and target["path"] == "translation":
            accessor = file["accessors"][animation["samplers"][channel["sampler"]]["output"]]
            view = file["bufferViews"][accessor["bufferView"]]
            start = view.get("byteOffset", 0) + accessor.get("byteOffset", 0)
            return rest, struct.unpack_from("<3f", binary, start)
    raise SystemExit("no translation was exported")


def text(place):
    return "(" + ", ".join(f"{abs(value) if abs(value) < 5e-3 else value:.2f}" for value in place) + ")"


is_as_seen = True
for scale, turn_degrees in ((1, 0), (0.01, 0), (1, 90)):
    for is_removed in (False, True):
        rest, first = places(scale, turn_degrees, is_removed)
        word = "removed" if is_removed else "kept"
        print(
            f"RESULT {word}, scale {scale}, turn {turn_degrees}: "
            f"rests at {text(rest)}, plays at {text(first)}"
        )
        is_right = not is_removed or (scale, turn_degrees) == (1, 0)
        is_as_seen &= (math.dist(rest, first) < 1e-3) == is_right
sys.stdout.flush()
sys.exit(0 if is_as_seen else 1)
PYTHON
"$folder/venv/bin/python" "$folder/export.py" "$folder/out.glb" | sed -n 's/^RESULT //p'
