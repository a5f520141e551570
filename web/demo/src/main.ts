import { App } from "./app.js";
import { byId } from "./dom.js";
import { acceptFiles } from "./drop.js";
import { installHook } from "./hook.js";
import { announceDownloads } from "./loader.js";
import { LoadingBar } from "./loading.js";
import { offerAsAvatar } from "./own/offer.js";
import { readSettings } from "./settings.js";
import { createStore } from "./state.js";
import { showError } from "./toast.js";
import { View } from "./view.js";

async function start(): Promise<void> {
  const store = createStore(readSettings(location.search));
  const { backend, resolution } = store.state;
  const loading = new LoadingBar();
  announceDownloads(store.state, loading);
  const view = await View.create(backend, resolution === "adaptive", (loaded, total) =>
    loading.report("renderer", loaded, total),
  );
  const app = new App(store, view, loading);
  acceptFiles((file) => {
    void app.openFile(file);
    void offerAsAvatar(file);
  });
  installHook(app, view);
  await app.openModel();
}

start().catch((error) => {
  byId("loading").classList.add("done");
  showError("The page could not start", error, () => location.reload());
});
