// esbuild plugin: the module "catalogues" is every JSON file of src/words by its language, without the sentences that
// programs alone say.

import { readFileSync, readdirSync } from "node:fs";

const FOLDER = "src/words";

export const catalogues = {
  name: "catalogues",
  setup(build) {
    build.onResolve({ filter: /^catalogues$/ }, () => ({ path: "catalogues", namespace: "catalogues" }));
    build.onLoad({ filter: /.*/, namespace: "catalogues" }, () => {
      const files = readdirSync(FOLDER).filter((name) => name.endsWith(".json"));
      const own = (file) => Object.fromEntries(Object.entries(JSON.parse(readFileSync(`${FOLDER}/${file}`, "utf8")))
        .filter(([key]) => !key.startsWith("say.")));
      return { contents: JSON.stringify(Object.fromEntries(files.map((file) => [file.slice(0, -".json".length), own(file)]))), loader: "json" };
    });
  },
};
