import type { Bundle } from "dynaskin";
import { type Training, trainingOf } from "./about.js";
import { type ActorKind, actorLabel } from "./actors.js";
import { byId, create } from "./dom.js";
import { heldOut } from "./measured.js";
import type { Settings } from "./settings.js";
import type { Shown, State } from "./state.js";

/** Settings, and the file that plays instead of their motion. */
type Played = Readonly<Settings & Pick<State, "file">>;

/** Where the difference is to be looked for, by what moves. */
function whereOf({ motion, clip, file }: Played): string {
  if (file !== null)
    return "Watch chest, belly, buttocks and thighs as the body turns back or stops.";
  if (clip !== null) return "Watch chest, belly, buttocks and thighs as the feet land.";
  const where: Partial<Record<Settings["motion"], string>> = {
    "by-hand": "Watch chest and belly as you let go.",
    twist: "Watch belly and chest when the turn reverses.",
    "shake-hips": "Watch buttocks, belly and thighs when the hips reverse.",
    walk: "Watch thighs and buttocks with each step.",
    "run-in-place": "Watch chest, thighs and calves with each step.",
  };
  return where[motion] ?? "Watch chest, belly, buttocks and thighs as the feet land.";
}

/**
 * Says what differs between the actors on the screen, and what the networks of dynaskin (null while they
 * are being loaded) learned from and how well; until the visitor has closed it, or numbers take its place.
 */
export function describeDifference(
  settings: Played,
  shown: readonly Shown[],
  bundle: Bundle | null,
): void {
  const { layout, caption } = settings;
  const hasOther = settings.plots || settings.hud;
  byId("caption").hidden = !caption || shown.length === 0 || hasOther;
  byId("caption").classList.toggle("row", layout === "side" && shown.length > 1);
  const kinds = shown.map(({ kind }) => kind);
  const { title, text, where = "", hold } = differenceOf(settings, kinds);
  byId("caption-what").replaceChildren(
    create("strong", { textContent: title }),
    ` ${text} `,
    create("span", { className: "where", textContent: where }),
    create("span", { className: "hold" }, [" ", ...hold]),
  );
  byId("caption-learned").textContent = bundle ? learned(bundle) : "Its networks are being loaded.";
}

/** What the caption says before it comes to what was learned. */
interface Difference {
  title: string;
  text: string;
  /** Where to look; a phone has no room for it. */
  where?: string;
  /** What to hold; keys in an element of their own, because a phone has none. */
  hold: (string | Node)[];
}

const keys = (names: string) => create("span", { className: "keys", textContent: ` (${names})` });

function differenceOf(settings: Played, kinds: readonly ActorKind[]): Difference {
  const { layout } = settings;
  const where = whereOf(settings);
  const [first = "", second = ""] = kinds;
  if (kinds.length === 1) {
    const hold =
      first === "linear" ? [] : ["Hold its name", keys("A"), " to see it without its tissue."];
    return { title: `${actorLabel(first)}.`, text: "One body alone.", hold };
  }
  const hold =
    layout === "wipe"
      ? ["Drag the divider, or hold a name", keys("A, B"), "."]
      : ["Hold a name", keys("A, B"), " to compare."];
  if (kinds.length === 2 && first === "linear" && second === "dynaskin") {
    const text =
      "On the left it only follows the bones; on the right dynaskin lets the soft tissue lag, swing and settle.";
    return { title: "One motion, two skins.", text, where, hold };
  }
  const count = ["two", "three", "four"][kinds.length - 2] ?? "some";
  return { title: "One motion,", text: `${count} ways to move the skin.`, where, hold };
}

function learned(bundle: Bundle): string {
  const { frames }: Training = trainingOf(bundle);
  const unseen = heldOut(bundle);
  const from =
    `dynaskin learned from ${frames?.toLocaleString("en") ?? "many"} frames of simulated tissue, not from ` +
    "recordings of people.";
  if (!unseen) return from;
  const { errorMm, staticMm } = unseen;
  return (
    `${from} On motions it never saw it is ${errorMm.toFixed(1)} mm off in the soft regions, plain ` +
    `skinning ${staticMm.toFixed(1)} mm.`
  );
}
