// Child processes and the lines that tell a reader what is going on.
import { spawn } from "node:child_process";
import { accessSync, constants } from "node:fs";
import { delimiter, join } from "node:path";
import { ROOT } from "./paths.mjs";

const COLOUR = process.stdout.isTTY && !process.env.NO_COLOR;
const paint = (code, text) => (COLOUR ? `\u001b[${code}m${text}\u001b[0m` : text);
export const bold = (text) => paint(1, text);
export const dim = (text) => paint(2, text);
export const red = (text) => paint(31, text);
export const green = (text) => paint(32, text);

export const say = (text = "") => console.log(text);

/** A command that ended badly; `output` is what it printed, when that was captured. */
export class CommandFailed extends Error {
  constructor(command, status, output = "") {
    super(`${command} ended with ${status}`);
    this.name = "CommandFailed";
    this.output = output;
  }
}

/**
 * Runs a program and resolves with its standard output.
 *
 * @param {string} program
 * @param {string[]} args
 * @param {{ cwd?: string, env?: Record<string, string>, quiet?: boolean,
 *   onLine?: (line: string) => void, onErrorLine?: (line: string) => void,
 *   allowFailure?: boolean }} [options]
 *   `quiet` keeps the output from the terminal (it is shown after a failure); `onLine` sees every
 *   line of standard output, `onErrorLine` every line of standard error.
 * @returns {Promise<{ status: number, output: string }>}
 */
export function run(program, args, options = {}) {
  const { cwd = ROOT, env, quiet = false, onLine, onErrorLine, allowFailure = false } = options;
  return new Promise((done, fail) => {
    const child = spawn(program, args, {
      cwd,
      env: { ...process.env, ...env },
      stdio: ["ignore", "pipe", "pipe"],
    });
    let output = "";
    let errors = "";
    const lines = splitter(onLine);
    const errorLines = splitter(onErrorLine);
    child.stdout.on("data", (chunk) => {
      output += chunk;
      if (!quiet) process.stdout.write(chunk);
      lines.read(chunk);
    });
    child.stderr.on("data", (chunk) => {
      errors += chunk;
      if (!quiet) process.stderr.write(chunk);
      errorLines.read(chunk);
    });
    child.on("error", (error) =>
      error.code === "ENOENT"
        ? fail(new Error(`${program} is not installed, or not on the PATH.`))
        : fail(error),
    );
    child.on("close", (code, signal) => {
      lines.end();
      errorLines.end();
      const status = code ?? signal;
      if (status === 0 || allowFailure) return done({ status, output });
      if (quiet) process.stderr.write(output + errors);
      fail(new CommandFailed([program, ...args].join(" "), status, output + errors));
    });
  });
}

/** Cuts what comes in pieces into lines, and gives each to `onLine`, where there is one. */
function splitter(onLine = () => {}) {
  let partial = "";
  return {
    read(chunk) {
      const lines = (partial + chunk).split("\n");
      partial = lines.pop();
      for (const line of lines) onLine(line);
    },
    end() {
      if (partial) onLine(partial);
    },
  };
}

/** The full path of a program on the PATH, or null. */
export function which(program) {
  for (const folder of (process.env.PATH || "").split(delimiter)) {
    const path = join(folder, program);
    try {
      accessSync(path, constants.X_OK);
      return path;
    } catch {
      // Not in this folder; try the next.
    }
  }
  return null;
}

/** `12.3 s`, or `3 min 20 s` from two minutes up. */
export function duration(milliseconds) {
  const seconds = milliseconds / 1000;
  if (seconds < 120) return `${seconds.toFixed(1)} s`;
  return `${Math.floor(seconds / 60)} min ${Math.round(seconds % 60)} s`;
}

/** Runs `work` under a headline and prints how long it took. Errors pass through. */
export async function step(title, work) {
  say(`\n${bold(`▸ ${title}`)}`);
  const start = performance.now();
  try {
    const result = await work();
    say(dim(`  ${title}: ${duration(performance.now() - start)}`));
    return result;
  } catch (error) {
    say(red(`  ${title}: failed after ${duration(performance.now() - start)}`));
    throw error;
  }
}

/** Ends the process with a sentence instead of a stack trace. */
export function main(work) {
  work().catch((error) => {
    process.stderr.write(`\n${red("Failed:")} ${error.message}\n`);
    if (!(error instanceof CommandFailed) && process.env.DYNASKIN_DEBUG) console.error(error);
    process.exitCode = 1;
  });
}
