/** After a build: a .gz next to each text file, and the sizes. A page above its budget fails the build. */
import { readdirSync, readFileSync, statSync, writeFileSync } from "node:fs";
import { join, relative } from "node:path";
import { gzipAsync } from "@gfx/zopfli";
import type { Plugin } from "vite";

/** Everything but WebAssembly, gzip, bytes: 37 KB of each language, half of the rest for the installer. */
const BUDGET = 460 * 1024;
const TEXT = /\.(html|js|css|svg|wasm|webmanifest)$/;

function files(folder: string): string[] {
  return readdirSync(folder, { withFileTypes: true }).flatMap((entry) => {
    const path = join(folder, entry.name);
    return entry.isDirectory() ? files(path) : [path];
  });
}

export function sizes(): Plugin {
  let folder = "dist";
  return {
    name: "wificnc-sizes",
    apply: "build",
    configResolved(config) {
      folder = config.build.outDir;
    },
    async closeBundle() {
      let page = 0;
      let wasm = 0;
      for (const path of files(folder).filter((name) => TEXT.test(name)).sort()) {
        const packed = await gzipAsync(readFileSync(path), { numiterations: 5 }); // 5 % smaller than zlib's best
        writeFileSync(`${path}.gz`, packed);
        if (path.endsWith(".wasm")) wasm += packed.length;
        else page += packed.length;
        console.log(`${relative(folder, path).padEnd(52)} ${kb(statSync(path).size)} ${kb(packed.length)} gzip`);
      }
      console.log(`page ${kb(page)} gzip of ${kb(BUDGET)}; WebAssembly ${kb(wasm)} gzip`);
      if (page > BUDGET) throw new Error(`the page has ${page} bytes gzip, its budget is ${BUDGET}`);
    },
  };
}

function kb(bytes: number): string {
  return `${(bytes / 1024).toFixed(1).padStart(7)} KB`;
}
