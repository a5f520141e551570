import { useFrame, useLoader } from "@react-three/fiber";
import { type Avatar, load, type Model, Motion, type ProceduralName } from "dynaskin";
import { DynaSkin } from "dynaskin/three";
import { use, useEffect, useMemo, useRef } from "react";
import type { SkinnedMesh } from "three";
import { GLTFLoader } from "three/addons/loaders/GLTFLoader.js";
import { clone } from "three/addons/utils/SkeletonUtils.js";
import { showNote } from "../src/shared/note.js";
import "../src/shared/hook.js";

const SHAPE = [0, 1.5, 0, 0, 0, 0, 0, 0, 0, 0];

/** Models that are loaded or on their way: one per folder, however many bodies show it. */
const models = new Map<string, Promise<Model>>();

function loadOnce(folder: string): Promise<Model> {
  const loading = models.get(folder) ?? load({ model: folder });
  models.set(folder, loading);
  return loading;
}

/** What moves while the component is mounted. */
interface Moving {
  avatar: Avatar;
  skin: DynaSkin;
  motion: Motion;
  timeSeconds: number;
  playing: boolean;
}

function animate(moving: Moving, deltaSeconds: number): void {
  const { motion, skin } = moving;
  moving.timeSeconds = (moving.timeSeconds + deltaSeconds) % motion.durationSeconds;
  skin.writePose(motion.poseAt(moving.timeSeconds));
  skin.update(deltaSeconds);
}

/** A body whose soft tissue follows one of dynaskin's own motions. */
export function SoftBody(props: { model: string; motion: ProceduralName }) {
  const model = use(loadOnce(props.model));
  const gltf = useLoader(GLTFLoader, `${props.model}body.glb`);
  // The loader's scene is shared between components; bones are not.
  const scene = useMemo(() => clone(gltf.scene), [gltf]);
  const moving = useRef<Moving | null>(null);

  useEffect(() => {
    const mesh = scene.getObjectByProperty("isSkinnedMesh", true) as SkinnedMesh;
    mesh.castShadow = true;
    const avatar = model.createAvatar({ shape: SHAPE });
    const skin = new DynaSkin(avatar, mesh);
    const motion = Motion.procedural(props.motion, avatar);
    const now: Moving = { avatar, skin, motion, timeSeconds: 0, playing: true };
    moving.current = now;
    showNote("React, react-three-fiber", avatar);
    window.dynaskinExample = {
      avatar,
      showMoment(seconds) {
        now.playing = false;
        now.timeSeconds = 0;
        avatar.reset();
        for (let tick = 0; tick < seconds * 60; tick += 1) animate(now, 1 / 60);
      },
    };
    return () => {
      moving.current = null;
      skin.dispose();
      avatar.dispose();
      motion.dispose();
    };
  }, [scene, model, props.motion]);

  useFrame((_state, deltaSeconds) => {
    if (moving.current?.playing) animate(moving.current, deltaSeconds);
  });
  return <primitive object={scene} />;
}
