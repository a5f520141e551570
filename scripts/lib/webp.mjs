// Animated WebP of still ones: the container alone, as Google's "WebP Container Specification" has it.

/** Bytes of a frame's header in an `ANMF` chunk. */
const FRAME_HEADER_BYTES = 16;
const ANIMATION_FLAG = 0x02;

/**
 * Puts pictures of one size in a row that is repeated for ever.
 *
 * @param {Buffer[]} stills lossy WebP files, as browsers write them
 * @param {{ width: number, height: number, frameMs: number }} how pixels, and for how long each is shown
 * @returns {Buffer}
 */
export function animatedWebp(stills, { width, height, frameMs }) {
  const size = [uint24(width - 1), uint24(height - 1)];
  const extended = chunk("VP8X", Buffer.concat([Buffer.of(ANIMATION_FLAG, 0, 0, 0), ...size]));
  // White behind, and 0 rounds: for ever.
  const animation = chunk("ANIM", Buffer.of(255, 255, 255, 255, 0, 0));
  const frames = stills.map((still) => {
    const header = Buffer.concat([uint24(0), uint24(0), ...size, uint24(frameMs), Buffer.of(0)]);
    if (header.length !== FRAME_HEADER_BYTES) throw new Error("A frame's header has 16 bytes.");
    return chunk("ANMF", Buffer.concat([header, pictureOf(still)]));
  });
  return chunk("RIFF", Buffer.concat([Buffer.from("WEBP"), extended, animation, ...frames]));
}

/** The chunk of a still WebP that holds the picture. */
function pictureOf(still) {
  if (still.toString("latin1", 0, 4) !== "RIFF" || still.toString("latin1", 8, 12) !== "WEBP") {
    throw new Error("This is no WebP file.");
  }
  for (let at = 12; at + 8 <= still.length; ) {
    const end = at + 8 + still.readUInt32LE(at + 4);
    if (still.toString("latin1", at, at + 4) === "VP8 ") {
      return chunk("VP8 ", still.subarray(at + 8, end));
    }
    at = end + (end % 2);
  }
  throw new Error("This WebP file is not lossy.");
}

/** A chunk with its name and length; odd ones are filled up. */
function chunk(name, content) {
  const head = Buffer.alloc(8);
  head.write(name, "latin1");
  head.writeUInt32LE(content.length, 4);
  return Buffer.concat([head, content, Buffer.alloc(content.length % 2)]);
}

function uint24(value) {
  return Buffer.of(value & 255, (value >> 8) & 255, value >> 16);
}
