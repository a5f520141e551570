// How values stand in the page's address.
import type { RegionName } from "dynaskin";

/** Reads a value from a link and writes it there. */
export interface Codec<Value, All> {
  /** What makes no sense becomes the usual value; `all` has what is read before. */
  read(query: URLSearchParams, all: Readonly<All>): Value;
  /** Writes nothing for the usual value. */
  write(query: URLSearchParams, value: Value, all: Readonly<All>): void;
}

/** Lowest, usual and highest value. */
type Range = readonly [number, number, number];

/** One of some words. */
export function word<Word extends string, All>(
  name: string,
  usual: NoInfer<Word>,
  words: (all: Readonly<All>) => readonly Word[],
): Codec<Word, All> {
  return {
    read: (query, all) => words(all).find((value) => value === query.get(name)) ?? usual,
    write: (query, value) => {
      if (value !== usual) query.set(name, value);
    },
  };
}

/** One of some words, or none. */
export function wordOrNull<Word extends string, All>(
  name: string,
  words: (all: Readonly<All>) => readonly Word[],
): Codec<Word | null, All> {
  return {
    read: (query, all) => words(all).find((value) => value === query.get(name)) ?? null,
    write: (query, value) => {
      if (value !== null) query.set(name, value);
    },
  };
}

/** Whether a flag of a link is on. */
export function isOn(query: URLSearchParams, name: string, otherwise: boolean): boolean {
  return query.has(name) ? ["", "1", "on", "true"].includes(query.get(name) ?? "") : otherwise;
}

/** Yes or no; `otherwise` is what a link without it means. */
export function flag<All>(
  name: string,
  usual: boolean,
  otherwise: () => boolean = () => usual,
): Codec<boolean, All> {
  return {
    read: (query) => isOn(query, name, otherwise()),
    write: (query, on) => {
      if (on !== usual) query.set(name, on ? "1" : "0");
    },
  };
}

function numberOf(query: URLSearchParams, name: string): number | null {
  const value = Number.parseFloat(query.get(name) ?? "");
  return Number.isFinite(value) ? value : null;
}

/** A link's number, in its range; null where there is none. */
export function numberIn(
  query: URLSearchParams,
  name: string,
  range: Range | undefined,
): number | null {
  const value = numberOf(query, name);
  return value === null || !range ? null : Math.max(range[0], Math.min(range[2], value));
}

/** A number; written to so many digits after the point. */
export function number<All>(
  name: string,
  usual: number,
  range: Range,
  digits?: number,
): Codec<number, All> {
  return {
    read: (query) => numberIn(query, name, range) ?? usual,
    write: (query, value) => {
      const written = digits === undefined ? value : +value.toFixed(digits);
      if (written !== usual) query.set(name, `${written}`);
    },
  };
}

/** A number in a range, where there is one, or none. */
export function numberOrNull<All>(
  name: string,
  range: (all: Readonly<All>) => Range | undefined,
): Codec<number | null, All> {
  return {
    read: (query, all) => numberIn(query, name, range(all)),
    write: (query, value) => {
      if (value !== null) query.set(name, `${value}`);
    },
  };
}

/** The nearest of some numbers. */
export function nearest<All>(
  name: string,
  usual: number,
  values: readonly number[],
): Codec<number, All> {
  return {
    read: (query) => {
      const wanted = numberOf(query, name) ?? usual;
      return values.reduce((best, value) =>
        Math.abs(value - wanted) < Math.abs(best - wanted) ? value : best,
      );
    },
    write: (query, value) => {
      if (value !== usual) query.set(name, `${value}`);
    },
  };
}

const parts = (query: URLSearchParams, name: string) => (query.get(name) ?? "").split(",");
const rounded = (values: readonly number[]) => values.map((value) => +value.toFixed(2)).join(",");

/** Numbers from `-limit` to `limit`, which are usually 0. */
export function numbers<All>(
  name: string,
  usual: readonly number[],
  limit: number,
): Codec<readonly number[], All> {
  return {
    read: (query) => {
      const values = parts(query, name).map(Number.parseFloat);
      return usual.map((zero, idx) => {
        const value = values[idx] ?? Number.NaN;
        return Number.isFinite(value) ? Math.max(-limit, Math.min(limit, value)) : zero;
      });
    },
    write: (query, values) => {
      if (values.some((value) => value !== 0)) query.set(name, rounded(values));
    },
  };
}

/** The four numbers of a camera, or none. */
export function place<All>(name: string): Codec<readonly number[] | null, All> {
  return {
    read: (query) => {
      const values = parts(query, name).map(Number.parseFloat);
      return values.length === 4 && values.every(Number.isFinite) ? values : null;
    },
    write: (query, values) => {
      if (values) query.set(name, rounded(values));
    },
  };
}

type Factors<Property extends string> = Readonly<
  Record<Property, Readonly<Partial<Record<RegionName, number>>>>
>;

/** Factors of regions, as `gains=chest:0.5,belly:2`. */
export function tissue<Property extends string, All>(
  ranges: Readonly<Record<Property, Range>>,
  regions: readonly RegionName[],
): Codec<Factors<Property>, All> {
  const properties = Object.keys(ranges) as Property[];
  const nameOf = (property: Property) => (property === "gain" ? "gains" : property);
  const readOne = (query: URLSearchParams, property: Property) => {
    const [low, , high] = ranges[property];
    const pairs = parts(query, nameOf(property)).flatMap((part) => {
      const [name, value] = part.split(":");
      const region = regions.find((known) => known === name);
      const factor = Number.parseFloat(value ?? "");
      if (!region || !Number.isFinite(factor)) return [];
      return [[region, Math.max(low, Math.min(high, factor))] as const];
    });
    return Object.fromEntries(pairs);
  };
  return {
    read: (query) =>
      Object.fromEntries(
        properties.map((property) => [property, readOne(query, property)]),
      ) as Factors<Property>,
    write: (query, factors) => {
      for (const property of properties) {
        const changed = Object.entries<number>(factors[property] as Record<string, number>)
          .filter(([, factor]) => factor !== 1)
          .map(([region, factor]) => `${region}:${+factor.toFixed(2)}`);
        if (changed.length > 0) query.set(nameOf(property), changed.join(","));
      }
    },
  };
}
