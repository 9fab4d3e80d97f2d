/** `npm run untranslated`: what each language of the page lacks and shows in English, by the file it belongs to. */
import { runnerImport } from "vite";

const { module: wanted } = await runnerImport("/build/wanted.ts", { configFile: false, logLevel: "error" });
const { module: languages } = await runnerImport("/src/languages.ts", { configFile: false, logLevel: "error" });
let count = 0;
for (const language of Object.keys(languages.LANGUAGES).filter((name) => name !== "en"))
  for (const [file, texts] of Object.entries(wanted.wanted())) {
    const missing = wanted.untranslated(file, texts, language);
    count += missing.length;
    if (missing.length > 0) console.log(`web/words/${file}.${language}.json:\n${missing.map((text) => ` ${JSON.stringify(text)}: "",`).join("\n")}`);
  }
console.log(count === 0 ? "Everything is translated." : `${count} texts are shown in English.`);
