// What scripts/exporters.mjs makes: each variant is a file of one exporter.
//
// `exporter` is a key of EXPORTERS, `name` what the table says, `source` and `control` motions of
// SOURCES: what the exporter is given, and what its file is compared with. `named` has the caller say
// which joint is which. The rest goes to blender.py, three.mjs or gltfpack.
// `misses` says why a file is not within the limit, or is refused: known, and checked to be so still.

export const VERSIONS = {
  bpy: "5.0.1",
  vrm: "4.10.2",
  numpy: "1.26.4",
  three: "0.187.0",
  gltfpack: "1.3.0",
};

/** Rates in keys a second and zero poses. */
export const SOURCES = {
  "t-24": [24, "t-pose"],
  "t-30": [30, "t-pose"],
  "t-60": [60, "t-pose"],
  "t-120": [120, "t-pose"],
  "a-120": [120, "a-pose"],
};

export const EXPORTERS = {
  bvh: { title: `Blender ${VERSIONS.bpy}, BVH`, by: "blender", suffix: ".bvh" },
  glb: { title: `Blender ${VERSIONS.bpy}, glTF`, by: "blender", suffix: ".glb" },
  vrma: { title: `VRM add-on ${VERSIONS.vrm}, VRMA`, by: "blender", suffix: ".vrma" },
  vrm: { title: `VRM add-on ${VERSIONS.vrm}, VRM 1.0`, by: "blender", suffix: ".vrm" },
  three: { title: `three ${VERSIONS.three}, GLTFExporter`, by: "three", suffix: ".glb" },
  gltfpack: { title: `gltfpack ${VERSIONS.gltfpack}`, by: "gltfpack", suffix: ".glb" },
};

const RATES = [24, 30, 60, 120];
const NO_MOTION =
  "the exporter writes the pose that is shown, which is the rest pose in all frames";
const LYING = "the add-on's T-pose is one for people that stand along +Z";
const REMOVED =
  "the animation of the root stays in the space of the armature that is not exported (findings/blender-gltf-remove-armature.sh)";
const T_POSE = "the add-on's T-pose straightens the legs and rolls the feet with them";
const EULER =
  "the exporter takes Euler angles of every order for XYZ (findings/blender-gltf-euler-order.sh)";
const FLAT = "refused: without a tree names alone do not say which joint is which";
const LINEAR =
  "gltfpack leads straight lines from key to key, and its own keys fall between those of 60 fps";
const COMPRESSED = "refused: compressed animations are not read";
const MID = { current: 0.4 };

/** For every exporter of Blender: rates, axes, sizes, and how the scene stands. */
const blender = (exporter, misses = {}) =>
  [
    ...RATES.map((fps) => ({ name: `${fps} fps`, fps })),
    { name: "+Y up in Blender", keep_axes: true },
    { name: "armature turned by 90°", object_turns: true },
    { name: "armature scaled by 0.01", object_scale: 0.01 },
    { name: "armature scaled by 100", object_scale: 100 },
    { name: "saved in mid-motion", ...MID },
    { name: "saved while shown in its rest position", ...MID, pose_position: "REST" },
    { name: "rotations as quaternions", rotate_mode: "QUATERNION" },
    { name: "drawn in an A-pose", source: "a-120" },
  ].map((variant) => ({ exporter, misses: misses[variant.name], ...variant }));

const glb = (name, more, options = {}) => ({ exporter: "glb", name, options, ...more });
const packed = (name, flags, more = {}) => ({
  exporter: "gltfpack",
  name,
  flags,
  of: "glb: 60 fps",
  ...more,
});
const three = (name, more) => ({ exporter: "three", name, ...more });

export const VARIANTS = [
  ...blender("bvh", { "saved while shown in its rest position": NO_MOTION }),
  {
    exporter: "bvh",
    name: "scale 100, root translation only",
    options: { global_scale: 100, root_transform_only: true },
  },
  ...blender("glb", { "saved while shown in its rest position": NO_MOTION }),
  glb("+Z up", {}, { export_yup: false }),
  glb("+Z up, saved in mid-motion", MID, { export_yup: false }),
  glb("nodes at the current frame, in mid-motion", MID, { export_rest_position_armature: false }),
  glb("current frame as object transforms", MID, { export_current_frame: true }),
  glb("every second frame of 60 fps", {}, { export_frame_step: 2 }),
  glb("without sampling", { misses: EULER }, { export_force_sampling: false }),
  glb(
    "without sampling, rotations as quaternions",
    { rotate_mode: "QUATERNION" },
    { export_force_sampling: false },
  ),
  glb(
    "without sampling, rotations as XYZ",
    { rotate_mode: "XYZ" },
    { export_force_sampling: false },
  ),
  glb("bones flat", { misses: FLAT }, { export_hierarchy_flatten_bones: true }),
  glb(
    "bones flat, joints named by the caller",
    { named: true },
    { export_hierarchy_flatten_bones: true },
  ),
  glb("without the armature's object", {}, { export_armature_object_remove: true }),
  glb(
    "without the armature's object, scaled by 0.01",
    { object_scale: 0.01, misses: REMOVED },
    { export_armature_object_remove: true },
  ),
  glb("armature without a mesh", { has_skin: false }),
  glb("armature without a mesh, in mid-motion", { has_skin: false, ...MID }),
  glb(
    "armature without a mesh, nodes at the current frame, in mid-motion",
    { has_skin: false, ...MID },
    { export_rest_position_armature: false },
  ),
  ...blender("vrma", {
    "+Y up in Blender": LYING,
    "drawn in an A-pose": T_POSE,
  }),
  ...blender("vrm", {
    "+Y up in Blender": LYING,
    "armature turned by 90°": REMOVED,
    "armature scaled by 0.01": REMOVED,
    "armature scaled by 100": REMOVED,
    "drawn in an A-pose": T_POSE,
  }),
  packed("`-kn`", ["-kn"]),
  packed("`-kn -af 60`", ["-kn", "-af", "60"]),
  packed("`-kn -af 24`", ["-kn", "-af", "24"], { misses: LINEAR }),
  packed("`-kn -af 24`, of 120 fps", ["-kn", "-af", "24"], { of: "glb: 120 fps" }),
  packed("`-kn -af 0`", ["-kn", "-af", "0"]),
  packed("`-kn -noq`", ["-kn", "-noq"]),
  packed("`-kn -ac -ar 16`", ["-kn", "-ac", "-ar", "16"]),
  packed("`-kn`, armature scaled by 0.01", ["-kn"], { of: "glb: armature scaled by 0.01" }),
  packed("`-kn`, saved in mid-motion", ["-kn"], { of: "glb: saved in mid-motion" }),
  packed("`-kn`, of three's file", ["-kn"], { of: "three: 60 fps" }),
  packed("`-kn -c`", ["-kn", "-c"], { misses: COMPRESSED }),
  packed("without `-kn`", []),
  ...RATES.map((fps) => three(`${fps} fps`, { source: `t-${fps}` })),
  three("armature scaled by 0.01", { scale: 0.01 }),
  three("armature scaled by 100", { scale: 100 }),
  three("saved in mid-motion", MID),
  three("drawn in an A-pose", { source: "a-120" }),
].map((variant) => ({
  source: variant.exporter === "three" ? "t-60" : "t-120",
  control: variant.source === "a-120" ? "a-120" : "t-120",
  fps: 60,
  ...variant,
}));
