// Bundles the tests in this folder and runs them with node's test runner.

import { build } from "esbuild";
import { spawnSync } from "node:child_process";
import { readdirSync, rmSync } from "node:fs";
import { catalogues } from "../catalogues.mjs";

const tests = readdirSync("tests").filter((file) => file.endsWith(".test.ts"));
rmSync("unit", { recursive: true, force: true });
await build({
  entryPoints: tests.map((file) => `tests/${file}`),
  bundle: true,
  platform: "node",
  format: "esm",
  target: ["node18"],
  preserveSymlinks: true,
  jsx: "automatic",
  jsxImportSource: "preact",
  outdir: "unit",
  outExtension: { ".js": ".mjs" },
  plugins: [catalogues],
  logLevel: "warning",
});
const files = tests.map((file) => `unit/${file.replace(/\.ts$/, ".mjs")}`);
const ran = spawnSync(process.execPath, ["--test", ...files], { stdio: "inherit" });
process.exit(ran.status ?? 1);
