// check.mjs MODULES SCREENSHOTS PAGE...: opens pages in a browser at 1366 px, on a phone, and in print. Each must be clean for axe
// (accessibility), load without errors and without network, and not scroll sideways. Prints sizes and load times; writes screenshots.
// A page is a file, or the address of a running specimen, which is looked at when its curve has appeared.
import { createRequire } from "node:module";
import { mkdirSync, readFileSync, statSync } from "node:fs";
import { basename, resolve } from "node:path";
import { pathToFileURL } from "node:url";

const [modules, screenshots, ...pages] = process.argv.slice(2);
const require = createRequire(pathToFileURL(resolve(modules) + "/"));
const puppeteer = require("puppeteer-core");
const axe = readFileSync(require.resolve("axe-core/axe.min.js"), "utf8");
mkdirSync(screenshots, { recursive: true });

const views = [
  { name: "1366", width: 1366, height: 768 },
  { name: "phone", width: 390, height: 844, isMobile: true, hasTouch: true, deviceScaleFactor: 2 },
  { name: "print", width: 794, height: 1123, print: true },
];
const browser = await puppeteer.launch({
  executablePath: process.env.CHROMIUM ?? "/usr/bin/chromium",
  args: ["--no-sandbox", "--disable-gpu", "--disable-dev-shm-usage"],
});
let failed = false;
const fail = text => { failed = true; console.error(text); };
for (const path of pages) {
  const isLive = path.startsWith("http:");
  const size = isLive ? (await (await fetch(path)).arrayBuffer()).byteLength : statSync(path).size;
  const name = isLive ? "watch" : basename(path, ".html");
  for (const view of views) {
    const page = await browser.newPage();
    await page.setViewport(view);
    if (view.print) await page.emulateMediaType("print");
    const where = `${name}, ${view.name}`;
    page.on("pageerror", error => fail(`${where}: ${error.message}`));
    page.on("console", message => { if (message.type() === "error") fail(`${where}: ${message.text()}`); });
    page.on("request", request => { if (/^https?:/.test(request.url()) && !(isLive && request.url().startsWith(path))) fail(`${where}: asks the network for ${request.url()}`); });
    await page.goto(isLive ? path : pathToFileURL(resolve(path)).href, { waitUntil: "load" });
    const loaded = await page.evaluate(() => performance.getEntriesByType("navigation")[0].loadEventEnd);
    if (isLive) await page.waitForFunction(() => /step/.test(document.getElementById("status").textContent), { timeout: 30000 });
    await page.evaluate(axe);
    const { violations } = await page.evaluate(async () => await axe.run(document, { resultTypes: ["violations"] }));
    for (const { id, impact, help, nodes } of violations) {
      fail(`${where}: ${impact} ${id}: ${help}\n` + nodes.slice(0, 3).map(node => "    " + node.html.slice(0, 160)).join("\n"));
    }
    // Not innerWidth: on a phone it grows with the page.
    const over = (await page.evaluate(() => document.documentElement.scrollWidth)) - view.width;
    if (over > 1 && !view.print) fail(`${where}: the page is ${over} px too wide`);
    // A page of more than a second is slow on this machine and worse on others; measured 0.1 to 0.3 s.
    if (loaded > 1000) fail(`${where}: loads in ${Math.round(loaded)} ms; at most 1000`);
    await page.screenshot({ path: `${screenshots}/${name}-${view.name}.png`, fullPage: true });
    console.log(`${where}: ${Math.round(size / 1000)} kB, ${Math.round(loaded)} ms, ${violations.length} violations`);
    await page.close();
  }
}
await browser.close();
process.exit(failed ? 1 : 0);
