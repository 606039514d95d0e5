// Builds the page into the Python package. The same sources give the same bytes.
import { build } from "esbuild";
import { copyFile, readFile, writeFile } from "node:fs/promises";
import { gzipSync } from "node:zlib";

const out = new URL("../service/multiradar/api/page/", import.meta.url).pathname;

await build({
  entryPoints: { page: "src/main.ts" },
  outdir: out,
  bundle: true,
  minify: true,
  format: "esm",
  target: "es2022",
  legalComments: "none",
  logLevel: "warning",
  loader: { ".css": "css" },
});
await copyFile("src/index.html", `${out}index.html`);
await copyFile("node_modules/world-atlas/countries-50m.json", `${out}land.json`);

// Licences of what is bundled.
const bundled = ["ol", "rbush", "quickselect", "lit", "lit-html", "lit-element", "@lit/reactive-element",
  "topojson-client", "uplot", "world-atlas"];
const notices = [];
for (const name of bundled) {
  const folder = `node_modules/${name}/`;
  const { version, license } = JSON.parse(await readFile(`${folder}package.json`, "utf8"));
  let text = "";
  for (const file of ["LICENSE", "LICENSE.md", "LICENSE.txt"]) {
    text ||= await readFile(folder + file, "utf8").catch(() => "");
  }
  notices.push(`${name} ${version} (${license})\n\n${text.trim()}\n`);
}
await writeFile(`${out}NOTICES.txt`, notices.join(`\n${"-".repeat(78)}\n\n`));

let total = 0;
for (const file of ["index.html", "page.js", "page.css"]) {
  const content = await readFile(out + file);
  total += gzipSync(content, { level: 9 }).length;
  console.log(`${file}: ${content.length} octets, ${gzipSync(content, { level: 9 }).length} compressed`);
}
console.log(`without coast lines: ${total} octets compressed`);
