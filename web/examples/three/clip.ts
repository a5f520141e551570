import { type Avatar, JOINT_NAMES, Motion } from "dynaskin";
import type { DynaSkin } from "dynaskin/three";
import { AnimationClip, QuaternionKeyframeTrack, VectorKeyframeTrack } from "three";

const FRAMES_PER_SECOND = 60;

/** One of dynaskin's own motions as a three.js clip: a clip from a file would do as well. */
export function jumpingJacks(avatar: Avatar, skin: DynaSkin): AnimationClip {
  const motion = Motion.procedural("jumping-jacks", avatar);
  const bones = JOINT_NAMES.map((name) => skin.mesh.skeleton.getBoneByName(name));
  const times: number[] = [];
  const pelvis: number[] = [];
  const turns: number[][] = JOINT_NAMES.map(() => []);
  const nFrames = Math.floor(motion.durationSeconds * FRAMES_PER_SECOND);
  for (let frame = 0; frame < nFrames; frame += 1) {
    times.push(frame / FRAMES_PER_SECOND);
    skin.writePose(motion.poseAt(frame / FRAMES_PER_SECOND));
    pelvis.push(...(bones[0]?.position.toArray() ?? []));
    for (const [joint, bone] of bones.entries()) {
      turns[joint]?.push(...(bone?.quaternion.toArray() ?? []));
    }
  }
  const tracks = JOINT_NAMES.map(
    (name, joint) => new QuaternionKeyframeTrack(`${name}.quaternion`, times, turns[joint] ?? []),
  );
  return new AnimationClip(motion.name, -1, [
    new VectorKeyframeTrack("pelvis.position", times, pelvis),
    ...tracks,
  ]);
}
