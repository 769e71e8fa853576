// One HTML file with the script and the style in it, and a policy that lets nothing else in. build.mjs OUTPUT
import { createHash } from "node:crypto";
import { mkdirSync, readFileSync, renameSync, writeFileSync } from "node:fs";
import { dirname } from "node:path";
import { build } from "esbuild";

const output = process.argv[2] ?? "index.html";
const bundle = await build({
    entryPoints: ["src/main.ts"], bundle: true, write: false, minify: true, format: "iife", target: "es2022",
    legalComments: "none", charset: "ascii",
});
const script = bundle.outputFiles[0].text.replaceAll("</script", "<\\/script");
const style = readFileSync("src/style.css", "utf8");
const hash = (text) => `'sha256-${createHash("sha256").update(text).digest("base64")}'`;
const policy = [
    "default-src 'none'", `script-src ${hash(script)}`, `style-src ${hash(style)} 'unsafe-hashes'`, "img-src data: blob:",
    "connect-src 'self' ws:", "base-uri 'none'", "form-action 'none'",
].join("; ");
const fill = { "%POLICY%": policy, "%STYLE%": style, "%SCRIPT%": script };
const page = readFileSync("src/index.html", "utf8").replace(/%(POLICY|STYLE|SCRIPT)%/g, (name) => fill[name]);
mkdirSync(dirname(output), { recursive: true });
writeFileSync(output + ".part", page);
renameSync(output + ".part", output);
console.log(`${output}: ${(page.length / 1024).toFixed(0)} KiB`);
