// The store that holds what the demo shows.
import { expect, test } from "@playwright/test";
import { Store } from "../../web/demo/src/store.js";

test("what follows from values that change together follows once, and before change returns", () => {
  const store = new Store({ heat: false, strength: 1, tissue: {} });
  const shown: string[] = [];
  const followed: number[] = [];
  store.show(() => shown.push(`${store.state.heat} ${store.state.strength}`));
  store.on(
    () => [store.state.heat, store.state.strength],
    () => followed.push(store.state.strength),
  );
  expect(shown).toEqual(["false 1"]);
  expect(followed).toEqual([]);
  store.change({ heat: true, strength: 2 });
  expect(shown).toEqual(["false 1", "true 2"]);
  expect(followed).toEqual([2]);
  const { revision } = store;
  store.change({ heat: true, strength: 2 });
  store.change({ tissue: { chest: 2 } });
  expect(shown.length).toBe(2);
  expect(followed.length).toBe(1);
  expect(store.revision).toBe(revision + 1);
});

test("a follower that changes something itself is followed after it, and what it reads binds nobody", () => {
  const store = new Store({ clip: null as string | null, layout: "one", plots: false });
  const order: string[] = [];
  store.on(
    () => [store.state.clip],
    () => {
      store.change({ layout: "side" });
      order.push(`clip ${store.state.clip}, plots ${store.state.plots}`);
    },
  );
  store.on(
    () => [store.state.layout],
    () => order.push(`layout ${store.state.layout}`),
  );
  store.change({ clip: "hop" });
  expect(order).toEqual(["clip hop, plots false", "layout side"]);
  store.change({ plots: true });
  expect(order.length).toBe(2);
  expect({ ...store.state }).toEqual({ clip: "hop", layout: "side", plots: true });
});
