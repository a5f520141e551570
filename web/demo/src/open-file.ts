import { type Avatar, Motion } from "dynaskin";
import { byId } from "./dom.js";
import { jointNames } from "./joint-names.js";
import { checkKind } from "./motion-kind.js";
import type { MotionFile } from "./motions.js";
import { showFileProblem, showFileReport } from "./report.js";
import { dismissErrors, showError } from "./toast.js";

/** Largest file that is read into memory, in bytes. */
const MAX_FILE_BYTES = 64e6;

/** What a motion file is opened with. */
export interface FilePlayer {
  /** Goes where what is said of files can be seen. */
  leaveStory: () => void;
  /**
   * The avatar that the motion is for, of a core that reads files.
   *
   * @throws Error where there is none yet, or that core cannot be loaded
   */
  avatar: () => Promise<Avatar>;
  /** Plays the motion of a file instead of what plays; it throws where the avatar refuses a pose. */
  play: (motion: Motion, file: MotionFile) => void;
}

/** Plays a motion file; one that cannot be played is explained, and what played goes on. */
export async function openMotionFile(file: File, player: FilePlayer): Promise<void> {
  try {
    if (file.size > MAX_FILE_BYTES) {
      throw new Error(`It has ${(file.size / 1e6).toFixed(0)} MB; the page reads up to 64 MB.`);
    }
    const bytes = new Uint8Array(await file.arrayBuffer());
    checkKind(file.name, bytes);
    const motion = Motion.fromFile(bytes, await player.avatar());
    player.leaveStory();
    dismissErrors();
    player.play(motion, { name: file.name, bytes });
    showFileReport(file.name, motion);
    byId("file-report").scrollIntoView({ block: "nearest" });
  } catch (error) {
    player.leaveStory();
    showFileProblem(file.name, error, await jointNames(file));
    byId("file-report").scrollIntoView({ block: "nearest" });
    showError(`${file.name} cannot be played`, error);
  }
}
