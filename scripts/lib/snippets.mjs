// Code that stands in the Markdown pages, as files that can be type-checked and run.
import { readFileSync } from "node:fs";

/**
 * A piece of code of a page.
 *
 * @typedef {object} Snippet
 * @property {number} line of the page, of its first line
 * @property {"ts" | "tsx" | "js" | "html"} language
 * @property {string} code as readers see it
 * @property {string} before what readers do not see and the code needs, as TypeScript
 */

/**
 * The pieces of a page in TypeScript, also with JSX, JavaScript and HTML. What one needs beside itself stands in a comment before it:
 *
 *     <!-- snippet
 *     import { load } from "dynaskin";
 *     declare const mesh: SkinnedMesh;
 *     -->
 *
 * `after above` as the first line stands for the code of the piece before it, with what that needed.
 *
 * @param {string} page path of a Markdown file
 * @returns {Promise<Snippet[]>}
 */
export async function snippetsOf(page) {
  const { fromMarkdown } = await import("mdast-util-from-markdown");
  const found = [];
  const visit = (node) => {
    for (const [idx, child] of (node.children ?? []).entries()) {
      if (child.type === "code" && ["ts", "tsx", "js", "html"].includes(child.lang)) {
        const { line } = child.position.start;
        const before = contextOf(node.children[idx - 1], found.at(-1));
        found.push({ line, language: child.lang, code: `${child.value}\n`, before });
      } else visit(child);
    }
  };
  visit(fromMarkdown(readFileSync(page, "utf8")));
  return found;
}

function contextOf(node, above) {
  if (node?.type !== "html") return "";
  const [, text] = /^<!-- snippet\n(.*?)-->$/s.exec(node.value) ?? [];
  if (text === undefined) return "";
  if (!text.startsWith("after above\n")) return text;
  return `${above?.before ?? ""}${above?.code ?? ""}${text.slice("after above\n".length)}`;
}

/**
 * The JavaScript module of a page of HTML.
 *
 * @param {string} html
 * @returns {string} empty where there is none
 */
export function moduleIn(html) {
  const [, script = ""] = /<script type="module">\n(.*?)<\/script>/s.exec(html) ?? [];
  return script;
}
