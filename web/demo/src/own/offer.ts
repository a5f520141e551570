import { showError, showNote } from "../toast.js";
import { readGlbHeader } from "./glb.js";
import { leaveFile } from "./handover.js";

/** Offers to give tissue to what was dropped as a motion, if it is an avatar itself. */
export async function offerAsAvatar(file: File): Promise<void> {
  if (!/\.(glb|vrm)$/i.test(file.name)) return;
  const header = await readGlbHeader(file);
  if (!header?.skins?.length) return;
  showNote(`${file.name} has a skin of its own`, "It can have tissue of its own, too.", {
    label: "Open it as an avatar",
    run: () => {
      leaveFile(file)
        .then(() => location.assign("./own.html#handed"))
        .catch((error) => showError("Drop it on the page for avatars", error));
    },
  });
}
