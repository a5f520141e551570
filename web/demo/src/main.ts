import { App } from "./app.js";
import { BakedLoop } from "./baked/loop.js";
import { byId } from "./dom.js";
import { acceptFiles } from "./drop.js";
import { installHook } from "./hook.js";
import { announceDownloads } from "./loader.js";
import { LoadingBar } from "./loading.js";
import { offerAsAvatar } from "./own/offer.js";
import { readSettings } from "./settings.js";
import { createStore, type PageStore } from "./state.js";
import { showError } from "./toast.js";
import { View } from "./view.js";

async function start(store: PageStore, baked: BakedLoop): Promise<void> {
  const { backend, resolution } = store.state;
  const loading = new LoadingBar();
  announceDownloads(store.state, loading);
  const view = await View.create(backend, resolution === "adaptive", (loaded, total) =>
    loading.report("renderer", loaded, total),
  );
  const app = new App(store, view, loading, baked);
  acceptFiles((file) => {
    void app.openFile(file);
    void offerAsAvatar(file);
  });
  installHook(app, view);
  await app.openModel();
  // What could not be loaded has been explained: nothing plays as if it were there.
  if (!store.state.isComplete) baked.end();
}

const store = createStore(readSettings(location.search));
const baked = new BakedLoop(store);
start(store, baked).catch((error) => {
  baked.end();
  byId("loading").classList.add("done");
  showError("The page could not start", error, () => location.reload());
});
