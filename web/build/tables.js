/** Brings the page's tables (build/generated) up to date, by the generator in tools/: before Vite, Vitest and tsc. */
import { spawnSync } from "node:child_process";
import { existsSync } from "node:fs";
import { join } from "node:path";

const ROOT = join(import.meta.dirname, "../..");
const PYTHONS = [
  process.env.WIFICNC_PYTHON, // of tools/web/build.py
  join(ROOT, process.platform === "win32" ? ".venv/Scripts/python.exe" : ".venv/bin/python"),
  "python3",
  "python",
];

/** @param {string} python  @return {boolean} whether it can import what the generator needs */
function canGenerate(python) {
  return spawnSync(python, ["-c", "import wificnc.board.load"], { cwd: join(ROOT, "tools") }).status === 0;
}

const stamp = join(ROOT, "build/generated/.stamp");
const python = PYTHONS.find((path) => path && canGenerate(path));
if (python) {
  const { status } = spawnSync(python, ["-m", "generate.built"], { cwd: join(ROOT, "tools"), stdio: "inherit" });
  if (status !== 0) throw new Error("The page's tables cannot be generated. Correct the table that is named above.");
} else if (!existsSync(stamp)) {
  throw new Error("The page's tables are missing, and no Python here has wificnc. Run `python tools/dev.py setup` in the repository.");
}
