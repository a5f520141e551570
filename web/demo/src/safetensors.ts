// Reads safetensors files: eight bytes of length, a header in JSON, then the tensors' bytes.

/** The number types of the demo's clips. */
type DType = "F16" | "F32" | "F64" | "U32";

const BYTES: Record<DType, number> = { F16: 2, F32: 4, F64: 8, U32: 4 };
const LARGEST_HEADER_BYTES = 1e6;

interface Entry {
  dtype: DType;
  shape: number[];
  data_offsets: [number, number];
}

/** A safetensors file whose header was checked. */
export class SafeTensors {
  /** The file's own notes. */
  readonly metadata: Readonly<Record<string, string>>;
  readonly #entries: Record<string, Entry>;
  readonly #data: ArrayBuffer;

  /** Throws an `Error` that says what is wrong with a file that cannot be read. */
  constructor(file: ArrayBuffer) {
    const length = file.byteLength >= 8 ? Number(new DataView(file).getBigUint64(0, true)) : 0;
    if (length === 0 || length > Math.min(LARGEST_HEADER_BYTES, file.byteLength - 8)) {
      throw new Error("This is not a safetensors file: its header does not fit into it.");
    }
    const text = new TextDecoder().decode(new Uint8Array(file, 8, length));
    const { __metadata__: metadata = {}, ...entries } = JSON.parse(text);
    this.metadata = metadata;
    this.#entries = entries;
    this.#data = file.slice(8 + length);
  }

  /** The shape of a tensor. */
  shape(name: string): number[] {
    return this.#entry(name).shape;
  }

  /** A tensor of half precision as single precision, flattened. */
  halves(name: string): Float32Array {
    return Float32Array.from(new Uint16Array(this.#bytes(name, "F16")), fromHalf);
  }

  /** A tensor of single precision, flattened. */
  singles(name: string): Float32Array {
    return new Float32Array(this.#bytes(name, "F32"));
  }

  /** A tensor of double precision, flattened. */
  doubles(name: string): Float64Array {
    return new Float64Array(this.#bytes(name, "F64"));
  }

  /** A tensor of whole numbers, flattened. */
  integers(name: string): Uint32Array {
    return new Uint32Array(this.#bytes(name, "U32"));
  }

  #bytes(name: string, dtype: DType): ArrayBuffer {
    const entry = this.#entry(name);
    const [start, end] = entry.data_offsets;
    const bytes = entry.shape.reduce((product, size) => product * size, BYTES[dtype]);
    if (entry.dtype !== dtype || end - start !== bytes || end > this.#data.byteLength) {
      throw new Error(`The tensor ${name} is not ${bytes} bytes of ${dtype} within the file.`);
    }
    // A copy: tensors need not begin where a typed array may.
    return this.#data.slice(start, end);
  }

  #entry(name: string): Entry {
    const entry = this.#entries[name];
    if (!entry) throw new Error(`The file has no tensor ${name}.`);
    return entry;
  }
}

/** The number that 16 bits stand for (IEEE 754 binary16); Float16Array is too new to rely on. */
export function fromHalf(bits: number): number {
  const sign = bits & 0x8000 ? -1 : 1;
  const exponent = (bits >> 10) & 0x1f;
  const fraction = bits & 0x3ff;
  if (exponent === 0) return sign * fraction * 2 ** -24;
  if (exponent === 0x1f) return fraction ? Number.NaN : sign * Number.POSITIVE_INFINITY;
  return sign * (1 + fraction / 1024) * 2 ** (exponent - 15);
}
