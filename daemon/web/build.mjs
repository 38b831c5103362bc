// Builds the page: node build.mjs OUT.cc. Bundles src/ with the packages of this directory, names each file by a hash of its
// content, compresses it, and writes all as C++. Prints the sizes loaded by a browser.

import { build } from "esbuild";
import { createHash } from "node:crypto";
import { readFileSync, writeFileSync } from "node:fs";
import { extname } from "node:path";
import { gzipSync } from "node:zlib";
import { catalogues } from "./catalogues.mjs";

const here = process.cwd();
const out = process.argv[2];
if (!out) {
  console.error("usage: node build.mjs OUT.cc");
  process.exit(2);
}

const TYPES = {
  ".html": "text/html; charset=utf-8",
  ".js": "text/javascript; charset=utf-8",
  ".css": "text/css; charset=utf-8",
  ".svg": "image/svg+xml",
  ".txt": "text/plain; charset=utf-8",
};

const digest = (bytes) => createHash("sha256").update(bytes).digest("hex").slice(0, 16);

const bundled = await build({
  entryPoints: ["src/main.tsx", "src/abort.ts", "src/fleet/fleet.tsx", "src/style.css"],
  absWorkingDir: here,
  bundle: true,
  splitting: true,
  format: "esm",
  target: ["es2021"],
  minify: true,
  legalComments: "none",
  preserveSymlinks: true,
  jsx: "automatic",
  jsxImportSource: "preact",
  outdir: "page",
  publicPath: "/page/",
  entryNames: "[name]-[hash]",
  chunkNames: "[name]-[hash]",
  assetNames: "[name]-[hash]",
  loader: { ".svg": "file" },
  plugins: [catalogues],
  write: false,
  metafile: true,
  logLevel: "warning",
});

const files = bundled.outputFiles.map((file) => ({
  path: "/page/" + file.path.slice(file.path.lastIndexOf("/") + 1),
  body: Buffer.from(file.contents),
}));
// The bundle contains third-party packages, whose licences have to be distributed with it.
const { dependencies } = JSON.parse(readFileSync("package.json", "utf8"));
const licences = Object.entries(dependencies)
  .map(([name, version]) => `${name} ${version}\n\n${readFileSync(`node_modules/${name}/LICENSE`, "utf8")}`)
  .join("\n\n");
files.push({ path: `/page/licences-${digest(licences).slice(0, 8)}.txt`, body: Buffer.from(licences) });
const icon = readFileSync("src/icon.svg");
files.push({ path: `/page/icon-${digest(icon).slice(0, 8)}.svg`, body: icon });

const named = (name) => {
  const [stem, ending] = name.split(".");
  const found = files.find(({ path }) => new RegExp(`^/page/${stem}-[^/]*\\.${ending}$`).test(path));
  if (!found) throw new Error(`no ${name} among ${files.map(({ path }) => path)}`);
  return found.path;
};
// "/": page of a cell; "/fleet": page of the plant, which its collector serves at its own "/".
const html = (name) => Buffer.from(readFileSync(`src/${name}.html`, "utf8").replace(/\{\{(.*?)\}\}/g, (_, file) => named(file)));
files.unshift({ path: "/", body: html("index") }, { path: "/fleet", body: html("fleet") });

const octal = (bytes) => {
  let text = "";
  for (const byte of bytes) text += "\\" + byte.toString(8).padStart(3, "0");
  return text.replace(/(.{2000})/g, '$1"\n    "');
};

let code = `// Made by daemon/web/build.mjs.
#include <array>

#include "daemon/web/assets.h"

namespace cellcal::daemon {

namespace {

using namespace std::string_view_literals;

`;
const rows = [];
let total = 0;
for (const [i, { path, body }] of files.entries()) {
  const small = gzipSync(body, { level: 9 });
  const type = TYPES[extname(path) || ".html"];
  total += small.length;
  console.log(`page: ${String(small.length).padStart(7)} bytes compressed  ${path}`);
  code += `constexpr std::string_view kBody${i} =\n    "${octal(small)}"sv;\n`;
  rows.push(`    Asset{"${path}", "${type}", "\\"${digest(body)}\\"", kBody${i}, true}`);
}
code += `
constexpr std::array kAssets{
${rows.join(",\n")}};

}  // namespace

std::span<const Asset> assets() { return kAssets; }

}  // namespace cellcal::daemon
`;
writeFileSync(out, code);
console.log(`page: ${String(total).padStart(7)} bytes compressed in all`);
