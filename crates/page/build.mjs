// Builds dist/index.html: one file with the engine, the program of the page and its styles, which works from a disk and from any host of
// static files.
import { build } from "esbuild";
import { execFileSync } from "node:child_process";
import { mkdirSync, readFileSync, writeFileSync } from "node:fs";
import { dirname, join } from "node:path";
import { fileURLToPath } from "node:url";

const here = dirname(fileURLToPath(import.meta.url));
const target = process.env.CARGO_TARGET_DIR ?? join(here, "target");
const profile = process.argv[2] ?? "release";
const file = join(target, "wasm32-unknown-unknown", profile, "page.wasm");
const wasm = readFileSync(file);

const bundle = async (entry) => {
  const built = await build({
    entryPoints: [join(here, "web", entry)],
    bundle: true,
    minify: true,
    format: "iife",
    target: "es2022",
    loader: { ".toml": "text" },
    write: false,
  });
  return built.outputFiles[0].text;
};

// A closing tag within a script would end it.
const inScript = (text) => text.replaceAll("</script", "<\\/script");
const engine = execFileSync("zstd", [...(profile === "release" ? ["--ultra", "-22"] : ["-3"]), "--quiet", "--stdout", file], { maxBuffer: wasm.length });
const parts = {
  style: readFileSync(join(here, "web/style.css"), "utf8"),
  engine: engine.toString("base64"),
  worker: inScript(await bundle("worker.js")),
  main: inScript(await bundle("main.js")),
};
let html = readFileSync(join(here, "web/index.html"), "utf8");
for (const [name, text] of Object.entries(parts)) {
  html = html.replace(`<!--${name}-->`, () => text);
}
mkdirSync(join(here, "dist"), { recursive: true });
writeFileSync(join(here, "dist/index.html"), html);
const size = (bytes) => `${(bytes / 1e6).toFixed(2)} MB`;
console.log(`dist/index.html: ${size(html.length)}; engine ${size(wasm.length)}, compressed ${size(engine.length)}`);
