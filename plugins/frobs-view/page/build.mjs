/**
 * Builds the files that every exported page contains.
 *
 * Usage: node build.mjs FOLDER PACKAGES, where PACKAGES is the folder of Python's packages: mujoco and onnxruntime there
 * have the texts of licenses that their packages for JavaScript lack.
 */

import { copyFileSync, existsSync, mkdirSync, readFileSync, readdirSync, writeFileSync } from "node:fs";
import { dirname, join } from "node:path";
import { fileURLToPath } from "node:url";
import { gzipSync } from "node:zlib";
import { build } from "esbuild";

const here = dirname(fileURLToPath(import.meta.url));
const [folder, packages] = process.argv.slice(2);
const modules = join(here, "node_modules");
mkdirSync(folder, { recursive: true });

const { metafile } = await build({
  entryPoints: [join(here, "src", "app.js")],
  outfile: join(folder, "app.js"),
  bundle: true,
  minify: true,
  format: "iife",
  target: "es2022",
  legalComments: "none",
  external: ["module", "fs", "worker_threads", "path", "url", "crypto", "node:*"],
  define: { "import.meta.url": "document.baseURI" },
  logLevel: "warning",
  metafile: true,
});
for (const name of ["index.html", "style.css"]) copyFileSync(join(here, "src", name), join(folder, name));
compress(join(modules, "@mujoco", "mujoco", "mujoco.wasm"), "mujoco.wasm.gz");
compress(join(modules, "onnxruntime-web", "dist", "ort-wasm-simd-threaded.wasm"), "onnxruntime.wasm.gz");
writeFileSync(join(folder, "THIRD_PARTY_LICENSES"), licenses());

function compress(source, name) {
  writeFileSync(join(folder, name), gzipSync(stripped(readFileSync(source)), { level: 9 }));
}

/** Return a WebAssembly module without its custom sections, which hold names and debug information. */
function stripped(bytes) {
  const kept = [bytes.subarray(0, 8)];
  for (let at = 8; at < bytes.length; ) {
    const start = at;
    let size = 0;
    let shift = 0;
    do size += (bytes[++at] & 127) * 2 ** shift;
    while ((shift += 7) && bytes[at] & 128);
    at += 1 + size;
    if (bytes[start] !== 0) kept.push(bytes.subarray(start, at));
  }
  return Buffer.concat(kept);
}

/** Return the licenses of everything that is in the built files. */
function licenses() {
  const used = Object.keys(metafile.inputs).map((path) => path.match(/node_modules\/((?:@[^/]+\/)?[^/]+)/)?.[1]);
  const parts = [readFileSync(join(here, "licenses.txt"), "utf8")];
  for (const name of [...new Set(used)].filter(Boolean).sort()) {
    const { version, license } = JSON.parse(readFileSync(join(modules, name, "package.json"), "utf8"));
    const text = join(modules, name, "LICENSE");
    parts.push(`${name} ${version}, ${license}\n\n${existsSync(text) ? readFileSync(text, "utf8") : "See below."}`);
  }
  const info = readdirSync(packages).find((name) => /^mujoco-.*\.dist-info$/.test(name));
  const texts = [
    ["MuJoCo", join(info, "licenses", "LICENSE")],
    ["Libraries in MuJoCo", join(info, "licenses", "LICENSES_THIRD_PARTY.md")],
    ["onnxruntime", join("onnxruntime", "LICENSE")],
    ["Libraries in onnxruntime", join("onnxruntime", "ThirdPartyNotices.txt")],
  ];
  for (const [title, path] of texts) parts.push(`${title}\n\n${readFileSync(join(packages, path), "utf8")}`);
  return parts.map((part) => part.trim()).join(`\n\n${"=".repeat(80)}\n\n`) + "\n";
}
