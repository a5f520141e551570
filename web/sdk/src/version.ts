/** Version of this package; the WebAssembly core it starts must be of the same. */
export const VERSION = "0.1.0";
