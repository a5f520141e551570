// Paths and links that a Markdown page names, and whether they lead anywhere.
import { existsSync, readdirSync, readFileSync, statSync } from "node:fs";
import { dirname, join, relative, resolve } from "node:path";

/** Pages whose paths and links are to hold, with folders of such pages. */
const PAGES = [
  ...["README.md", "ARCHITECTURE.md", "CONTRIBUTING.md", "CHANGELOG.md", "docs"],
  ...["web/sdk/README.md", "models/female/MODEL_CARD.md", "models/male/MODEL_CARD.md"],
];

/** What a build or npm makes: right to name, and not there in a fresh clone. */
const GENERATED =
  /^(artifacts|node_modules|target|web\/(demo|examples|sdk)\/dist|web\/sdk\/src\/wasm)(\/|$)/;

/**
 * Whether there is a path below `folder`; `*`, and a word in capitals as in `models/BODY/traits.json`,
 * stand for any name.
 */
function exists(folder, [name, ...rest]) {
  if (name === undefined) return true;
  const pattern = name.replaceAll(/\b[A-Z]{2,}\b(?!\.md)/g, "*");
  if (!pattern.includes("*"))
    return existsSync(join(folder, name)) && exists(join(folder, name), rest);
  if (!statSync(folder).isDirectory()) return false;
  const wanted = new RegExp(`^${pattern.replaceAll(".", "\\.").replaceAll("*", ".*")}$`);
  return readdirSync(folder).some(
    (entry) => wanted.test(entry) && exists(join(folder, entry), rest),
  );
}

/** @returns {string[]} all pages below `root` */
export function pagesOf(root) {
  return PAGES.map((page) => join(root, page)).flatMap((path) =>
    statSync(path).isDirectory()
      ? readdirSync(path, { recursive: true })
          .filter((name) => name.endsWith(".md"))
          .map((name) => join(path, name))
      : [path],
  );
}

/**
 * The links and paths of a page that lead nowhere, as sentences with file and line.
 *
 * @param {string} root the repository
 * @param {string} page a file below it
 * @returns {Promise<string[]>}
 */
export async function brokenIn(root, page) {
  const folders = new Set(readdirSync(root).filter((name) => !name.startsWith(".")));
  const text = readFileSync(page, "utf8");
  const problems = [];
  for (const node of await nodesOf(text)) {
    const at = `${relative(root, page)}:${node.position.start.line}`;
    if (node.url !== undefined) {
      const problem = await brokenLink(page, node.url);
      if (problem) problems.push(`${at}: ${node.url} ${problem}.`);
    } else if (node.type === "inlineCode") {
      const path = node.value.replace(/\/$/, "");
      const isPath = /^[\w.*-]+(\/[\w.*-]+)+$/.test(path) && folders.has(path.split("/")[0]);
      if (!isPath || GENERATED.test(path) || exists(root, path.split("/"))) continue;
      problems.push(`${at}: \`${node.value}\` is no file or folder of the repository.`);
    }
  }
  return problems;
}

/** All nodes of a page's syntax tree; what stands in blocks of code is none. */
async function nodesOf(text) {
  const { fromMarkdown } = await import("mdast-util-from-markdown");
  const nodes = [];
  const visit = (node) => {
    nodes.push(node);
    for (const child of node.children ?? []) visit(child);
  };
  visit(fromMarkdown(text));
  return nodes;
}

/** Why a link leads nowhere; null where it leads somewhere, or out of the repository. */
async function brokenLink(page, url) {
  if (/^[a-z]+:/.test(url)) return null;
  const [path, anchor] = decodeURIComponent(url).split("#");
  const target = path === "" ? page : resolve(dirname(page), path);
  if (!existsSync(target)) return "is not there";
  if (anchor === undefined || !target.endsWith(".md")) return null;
  return (await headingsOf(target)).includes(anchor) ? null : "has no such heading";
}

/** The anchors of a page's headings, as GitHub makes them. */
async function headingsOf(page) {
  const { default: Slugger } = await import("github-slugger");
  const slugger = new Slugger();
  const textOf = (node) => node.value ?? (node.children ?? []).map(textOf).join("");
  const nodes = await nodesOf(readFileSync(page, "utf8"));
  return nodes
    .filter(({ type }) => type === "heading")
    .map((heading) => slugger.slug(textOf(heading)));
}
