import { letDialogsClose } from "../close-dialogs.js";
import { byId } from "../dom.js";
import { acceptFiles } from "../drop.js";
import { showError } from "../toast.js";
import { fetchExample } from "./examples.js";
import { takeFile } from "./handover.js";
import { OwnPage } from "./page.js";

letDialogsClose();
const page = new OwnPage();
window.dynaskinOwn = page;
acceptFiles((file) => void page.open(file));

async function openExample(name: "runner" | "lifter"): Promise<void> {
  try {
    const { file, sex } = await fetchExample(name);
    await page.open(file, sex);
  } catch (error) {
    showError("The example could not be loaded", error, () => void openExample(name));
  }
}

for (const name of ["runner", "lifter"] as const) {
  byId(`own-${name}`).addEventListener("click", () => void openExample(name));
}

// Left by the demo's first page.
if (location.hash === "#handed") {
  history.replaceState(null, "", location.pathname + location.search);
  takeFile()
    .then((file) => file && page.open(file))
    .catch((error) => showError("The file was not passed on; drop it here", error));
}
