// All that needs three.js: a chunk of its own, which the page loads with the first avatar.
export { bindAvatar } from "dynaskin/three";
export { BoundAvatar } from "./bound-avatar.js";
export { rampCss } from "./coverage.js";
export { readAvatarFile } from "./read-file.js";
export { Studio } from "./studio.js";
