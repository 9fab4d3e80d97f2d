import { defineConfig } from "vitest/config";
import "./build/tables.js"; // first: all of the page reads them
import { catalogues } from "./build/catalogue.ts";
import { offline } from "./build/offline.ts";
import { sizes } from "./build/sizes.ts";

// Paths are relative: the page works from any folder of any web host, and from the controller.
export default defineConfig({
  base: "./",
  build: {
    target: "es2022",
    assetsInlineLimit: 0,
    modulePreload: { polyfill: false },
    reportCompressedSize: false,
    rolldownOptions: {
      input: ["index.html", "setup.html"],
      // In one file: each more costs a request and its head.
      output: { advancedChunks: { groups: [{ name: "libraries", test: /node_modules\/(preact|@preact)\// }] } },
    },
    manifest: "files.json", // which file loads which, for firmware that carries the page
  },
  worker: { format: "es" },
  plugins: [catalogues(), offline(), sizes()],
  server: { fs: { allow: [".."] } },
  test: { include: ["test/**/*.test.ts"], testTimeout: 300_000 }, // only a hang takes this long, at any load
});
