import { type Avatar, Motion } from "dynaskin";
import { byId } from "./dom.js";
import { jointNames } from "./joint-names.js";
import type { MotionFile } from "./motions.js";
import { showFileProblem, showFileReport } from "./report.js";

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

async function readFile(file: File): Promise<Uint8Array> {
  try {
    return new Uint8Array(await file.arrayBuffer());
  } catch {
    // Browsers hand folders over as files that cannot be read.
    throw new Error(
      "The browser cannot read it: it is a folder, or was moved or deleted meanwhile.",
    );
  }
}

/** Plays a motion file; one that cannot be played is explained, and what played goes on. */
export async function openMotionFile(file: File, player: FilePlayer): Promise<void> {
  try {
    if (file.size > MAX_FILE_BYTES) {
      throw new Error(`It has ${(file.size / 1e6).toFixed(0)} MB; the page reads up to 64 MB.`);
    }
    const bytes = await readFile(file);
    const motion = Motion.fromFile(bytes, await player.avatar());
    player.leaveStory();
    player.play(motion, { name: file.name, bytes });
    showFileReport(file.name, motion);
    byId("file-report").scrollIntoView({ block: "nearest" });
  } catch (error) {
    player.leaveStory();
    showFileProblem(`${file.name} cannot be played`, error, await jointNames(file).catch(() => []));
  }
}
