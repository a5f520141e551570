import type { Avatar } from "dynaskin";

/** What the tests of these pages hold on to. An application needs none of it. */
export interface ExampleHook {
  avatar: Avatar;
  /**
   * Stops the clock and plays the motion from its start in steps of a sixtieth; the next frame shows
   * the end.
   */
  showMoment(seconds: number): void;
  /** Stops and frees everything, as an application does that closes its view. */
  dispose?(): void;
}

declare global {
  interface Window {
    dynaskinExample?: ExampleHook;
  }
}
