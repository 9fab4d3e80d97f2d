/** After a build: sw.js, the service worker that keeps the page of an https address for use without a network. */
import { createHash } from "node:crypto";
import { readdirSync, readFileSync, statSync, writeFileSync } from "node:fs";
import { join, relative, sep } from "node:path";
import type { Plugin } from "vite";

/** Not of the page itself: what is packed, what only firmware reads, and this worker. */
const LEFT_OUT = /\.gz$|^files\.json$|^sw\.js$/;

function names(folder: string): string[] {
  const found = readdirSync(folder, { recursive: true, encoding: "utf8" }).filter((name) => statSync(join(folder, name)).isFile());
  return found.map((name) => relative(folder, join(folder, name)).split(sep).join("/")).filter((name) => !LEFT_OUT.test(name)).sort();
}

/** The same files have the same version, wherever they were built. */
function version(folder: string, files: string[]): string {
  const hash = createHash("sha256");
  for (const name of files) hash.update(`${name}\0`).update(readFileSync(join(folder, name)));
  return hash.digest("hex").slice(0, 16);
}

export function offline(): Plugin {
  let folder = "dist";
  return {
    name: "wificnc-offline",
    apply: "build",
    configResolved(config) {
      folder = config.build.outDir;
    },
    writeBundle() {
      const files = names(folder);
      const worker = readFileSync(new URL("./worker.js", import.meta.url), "utf8");
      const filled = worker.replace('"VERSION"', JSON.stringify(version(folder, files))).replace('["FILES"]', JSON.stringify(files));
      writeFileSync(join(folder, "sw.js"), filled);
    },
  };
}
