import { App } from "./app.js";
import { byId } from "./dom.js";
import { acceptFiles } from "./drop.js";
import { installHook } from "./hook.js";
import { announceDownloads } from "./loader.js";
import { LoadingBar } from "./loading.js";
import { readSettings } from "./settings.js";
import { showError } from "./toast.js";
import { View } from "./view.js";

async function start(): Promise<void> {
  const settings = readSettings(location.search);
  const loading = new LoadingBar();
  announceDownloads(settings, loading);
  const view = await View.create(
    settings.backend,
    settings.resolution === "adaptive",
    (loaded, total) => loading.report("renderer", loaded, total),
  );
  const app = new App(settings, view, loading);
  acceptFiles((file) => void app.openFile(file));
  installHook(app, view);
  await app.openModel();
}

start().catch((error) => {
  byId("loading").classList.add("done");
  showError("The page could not start", error, () => location.reload());
});
