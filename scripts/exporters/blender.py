"""Makes motion files with Blender's exporters, for scripts/exporters.mjs.

    python blender.py PLAN.json

The plan is a list of variants, each with the keys of USUAL that differ, `out`, `source` (a BVH in
centimetres, +Y up) and `fps`. A line `VARIANT<tab>ok` or `VARIANT<tab>failed<tab>WHY` for each follows.
"""

import json
import sys
from pathlib import Path

import bpy

SECONDS = 4.0
FIRST_FRAME = 1
M_PER_CM = 0.01

USUAL = {
    # Size of the armature's object; the bones shrink as it grows.
    "object_scale": 1.0,
    # Blender's +Z up, or the source's axes unchanged.
    "keep_axes": False,
    # The object carries the turn to +Z up, as after an import of FBX files.
    "object_turns": False,
    "has_skin": True,
    # Where the scene stands while it is exported, as a part of the motion.
    "current": 0.0,
    "pose_position": "POSE",
    "rotate_mode": "NATIVE",
    "options": {},
}

# The add-on's names of bones, by the joints of the source.
HUMAN_BONES = {
    "pelvis": "hips",
    "spine1": "spine",
    "spine2": "chest",
    "spine3": "upper_chest",
    "neck": "neck",
    "head": "head",
} | {
    f"{side}_{joint}": f"{side}_{bone}"
    for side in ("left", "right")
    for joint, bone in {
        "hip": "upper_leg",
        "knee": "lower_leg",
        "ankle": "foot",
        "foot": "toes",
        "collar": "shoulder",
        "shoulder": "upper_arm",
        "elbow": "lower_arm",
        "wrist": "hand",
    }.items()
}


def import_motion(variant: dict) -> bpy.types.Object:
    bpy.ops.wm.read_factory_settings(use_empty=True)
    if Path(variant["out"]).suffix.startswith(".vrm"):
        bpy.ops.preferences.addon_enable(module="io_scene_vrm")
    scene = bpy.context.scene
    scene.render.fps = variant["fps"]
    scene.render.fps_base = 1.0
    keep = variant["keep_axes"] or variant["object_turns"]
    axes = {"axis_forward": "Y", "axis_up": "Z"} if keep else {}
    bpy.ops.import_anim.bvh(
        filepath=variant["source"],
        global_scale=M_PER_CM / variant["object_scale"],
        frame_start=FIRST_FRAME,
        use_fps_scale=True,
        rotate_mode=variant["rotate_mode"],
        **axes,
    )
    scene.frame_start = FIRST_FRAME
    scene.frame_end = FIRST_FRAME + round(SECONDS * variant["fps"])
    armature = bpy.context.object
    armature.scale = [variant["object_scale"]] * 3
    if variant["object_turns"]:
        armature.rotation_euler = (1.5707963267948966, 0.0, 0.0)
    return armature


def add_skin(armature: bpy.types.Object) -> bpy.types.Object:
    """A small triangle at each bone, held by it alone."""
    size = 0.02 / armature.scale[0]
    bones = list(armature.data.bones)
    corners = [
        bone.head_local + offset
        for bone in bones
        for offset in map(type(bones[0].head_local), [(0, 0, 0), (size, 0, 0), (0, size, 0)])
    ]
    faces = [(3 * bone, 3 * bone + 1, 3 * bone + 2) for bone in range(len(bones))]
    mesh = bpy.data.meshes.new("Skin")
    mesh.from_pydata(corners, [], faces)
    skin = bpy.data.objects.new("Skin", mesh)
    bpy.context.scene.collection.objects.link(skin)
    for place, bone in enumerate(bones):
        skin.vertex_groups.new(name=bone.name).add(list(faces[place]), 1.0, "REPLACE")
    skin.parent = armature
    skin.modifiers.new("Armature", "ARMATURE").object = armature
    return skin


def name_human_bones(armature: bpy.types.Object) -> None:
    extension = armature.data.vrm_addon_extension
    extension.spec_version = "1.0"
    human = extension.vrm1.humanoid.human_bones
    for bone, role in HUMAN_BONES.items():
        getattr(human, role).node.bone_name = bone
    meta = extension.vrm1.meta
    meta.vrm_name = "known"
    meta.authors.add().value = "dynaskin"


def export(variant: dict, armature: bpy.types.Object) -> None:
    out = variant["out"]
    scene = bpy.context.scene
    kind = Path(out).suffix
    if kind == ".bvh":
        result = bpy.ops.export_anim.bvh(
            filepath=out,
            frame_start=scene.frame_start,
            frame_end=scene.frame_end,
            **variant["options"],
        )
    elif kind == ".glb":
        result = bpy.ops.export_scene.gltf(
            filepath=out, export_format="GLB", **variant["options"]
        )
    elif kind == ".vrma":
        name_human_bones(armature)
        result = bpy.ops.export_scene.vrma(
            filepath=out, armature_object_name=armature.name, **variant["options"]
        )
    elif kind == ".vrm":
        name_human_bones(armature)
        result = bpy.ops.export_scene.vrm(
            filepath=out,
            armature_object_name=armature.name,
            use_addon_preferences=False,
            # Without the first one the second one counts for nothing.
            enable_advanced_preferences=True,
            export_gltf_animations=True,
            ignore_warning=True,
            **variant["options"],
        )
    else:
        raise ValueError(f"no exporter for {kind}")
    if "FINISHED" not in result:
        raise RuntimeError(f"the exporter returned {result}")


def make(variant: dict) -> None:
    armature = import_motion(variant)
    if variant["has_skin"]:
        add_skin(armature)
    bpy.ops.object.select_all(action="DESELECT")
    armature.select_set(True)
    bpy.context.view_layer.objects.active = armature
    armature.data.pose_position = variant["pose_position"]
    scene = bpy.context.scene
    length = scene.frame_end - scene.frame_start
    scene.frame_set(scene.frame_start + round(variant["current"] * length))
    export(variant, armature)


def main() -> None:
    plan = json.loads(Path(sys.argv[1]).read_text())
    for variant in plan:
        try:
            make(USUAL | variant)
            print(f"VARIANT\t{variant['out']}\tok", flush=True)
        except Exception as error:
            why = " ".join(str(error).split())
            print(f"VARIANT\t{variant['out']}\tfailed\t{why}", flush=True)


main()
