/**
 * dynaskin: soft tissue for web avatars. A skeleton's motion goes in, per-vertex offsets of the
 * skin come out.
 *
 * Units are metres, seconds and radians; +Y is up, the rest pose faces +Z. Importing this module
 * uses no browser API, so it may be imported on a server.
 *
 * @module
 */
export {
  Avatar,
  type SettledBecause,
  type SkinnedSurface,
  type StepTimings,
} from "./avatar.js";
export {
  type Bundle,
  type BundleFile,
  type Learned,
  type LoweredFiles,
  REGION_NAMES,
  type RegionName,
  type Trait,
} from "./bundle.js";
export type { ControlChanges, ControlPreset, Controls, RegionControls } from "./controls.js";
export { Crowd, type CrowdReport, type LevelOfDetail } from "./crowd.js";
export type { Decoding } from "./decoding.js";
export type { Detail } from "./detail.js";
export { DynaSkinError, type DynaSkinErrorCode } from "./error.js";
export type { Figure, Shape } from "./figure.js";
export {
  type LoadBodyOptions,
  type LoadOptions,
  load,
  loadBody,
  type ModelFiles,
} from "./load.js";
export { type AvatarOptions, Body, Model } from "./model.js";
export {
  type AnimationInfo,
  type BvhOptions,
  type JointReport,
  type MappedJoint,
  Motion,
  type MotionFileOptions,
  type MotionOptions,
  PROCEDURAL_MOTIONS,
  type ProceduralName,
} from "./motion.js";
export {
  JOINT_NAMES,
  type JointName,
  POSE_LENGTH,
  type Pose,
  restPose,
  SHAPE_LENGTH,
} from "./pose.js";
export type { PoseSource, SourceReport } from "./pose-source.js";
export { GRIPS, type Grip, Puppet } from "./puppet.js";
export type { Skinning } from "./skinning.js";
export type { FileSource, Progress } from "./source.js";
export { VERSION } from "./version.js";
export type { WasmSource } from "./wasm/instantiate.js";
