/** Whether the controls are a sheet at the bottom; the same condition as in layout.css. */
export const narrowScreen = matchMedia(
  "(max-width: 620px), (max-width: 760px) and (min-height: 561px), (max-width: 900px) and (orientation: portrait)",
);

/** Whether the controls beside the picture are narrower, as on a phone held across; as in base.css. */
export const shortScreen = matchMedia("(max-height: 560px)");

/** Whether a whole body with a name over its head has no room between the title and the playback bar. */
export const lowScreen = matchMedia("(max-height: 799px)");
