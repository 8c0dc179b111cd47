// The report and the gallery in a real browser: Debian's Chromium, driven by Playwright. `cargo xtask wasm --check` makes the
// pages, whose folder ACTQ_PAGES names.
import assert from "node:assert/strict";
import { access } from "node:fs/promises";
import { after, before, test } from "node:test";
import { pathToFileURL } from "node:url";

const folder = process.env.ACTQ_PAGES;
const executablePath = process.env.ACTQ_CHROMIUM ?? "/usr/bin/chromium";
const missing = async () => {
  if (!folder) return "ACTQ_PAGES names no folder of pages";
  try {
    await access(executablePath);
    await import("playwright-core");
    return false;
  } catch (error) {
    return `no browser: ${error.message}`;
  }
};
const skip = await missing();
let browser;

before(async () => {
  if (skip) return;
  const { chromium } = await import("playwright-core");
  const args = ["--no-sandbox", "--disable-gpu", "--disable-quic", "--no-first-run", "--disable-background-networking", "--disable-component-update", "--disable-sync"];
  browser = await chromium.launch({ executablePath, args });
});
after(() => browser?.close());

/** Opens a page; the list gets all errors and requests to a network. */
async function open(name, { width = 1400, colorScheme = "light" } = {}) {
  const context = await browser.newContext({ viewport: { width, height: 900 }, colorScheme, hasTouch: width < 500 });
  const page = await context.newPage();
  const problems = [];
  page.on("console", (message) => message.type() === "error" && problems.push(message.text()));
  page.on("pageerror", (error) => problems.push(error.message));
  page.on("dialog", (dialog) => (problems.push(dialog.message()), dialog.dismiss()));
  page.on("request", (request) => /^(file|data|blob):/.test(request.url()) || problems.push(request.url()));
  await page.goto(pathToFileURL(`${folder}/${name}`).href);
  await page.waitForFunction(() => document.documentElement.dataset.ready === "true", undefined, { timeout: 30000 });
  return { page, problems };
}

test("a report has its sections, the bits of the host, and no error", { skip }, async () => {
  const { page, problems } = await open("report.html");
  for (const id of ["network", "errors", "live", "flash", "contract", "provenance"]) assert.ok(await page.locator(`#${id}`).isVisible(), id);
  assert.equal(await page.getAttribute("#bits", "data-equal"), "true", await page.textContent("#bits"));
  assert.ok(Number(await page.getAttribute("#speed", "data-milliseconds")) < 1000, await page.textContent("#speed"));
  const figures = await page.locator("#top dd").allTextContents();
  assert.ok(figures.length >= 5 && figures.every((text) => text.length > 0 && !/NaN|undefined|null/.test(text)), figures.join());
  assert.doesNotMatch(await page.innerText("main"), /NaN|undefined|\[object/);
  assert.deepEqual(problems, []);
});

test("the diagram of a bundle leads from its raw inputs to its targets", { skip }, async () => {
  const { page, problems } = await open("bundle.html");
  const facts = JSON.parse(await page.textContent("#data")).facts;
  const texts = await page.locator("#around svg text").allTextContents();
  for (const { name } of facts.ports) assert.ok(texts.some((text) => text.startsWith(name)), `${name} is not in ${texts}`);
  assert.ok(texts.some((text) => text.startsWith("network")), texts.join());
  // Every box but an input is the end of a line.
  const [boxes, lines] = [await page.locator("#around svg rect").count(), await page.locator("#around svg path").count()];
  assert.ok(boxes > facts.ports.length && lines >= boxes - facts.ports.length, `${boxes} boxes, ${lines} lines`);
  assert.equal(await page.getAttribute("#bits", "data-equal"), "true", await page.textContent("#bits"));
  assert.doesNotMatch(await page.innerText("main"), /NaN|undefined|\[object/);
  assert.deepEqual(problems, []);
});

test("a slider moves the actions of both policies", { skip }, async () => {
  const { page, problems } = await open("report.html");
  const actions = () => page.locator("#live td.n").allTextContents();
  const before = await actions();
  await page.locator("#s0").focus();
  for (let i = 0; i < 40; i++) await page.keyboard.press("ArrowRight");
  const moved = await actions();
  assert.notDeepEqual(moved, before);
  await page.locator("#errors tr.pick").first().press("Enter");
  assert.notDeepEqual(await actions(), moved);
  assert.deepEqual(problems, []);
});

test("names with markup stay text", { skip }, async () => {
  const { page, problems } = await open("markup.html");
  assert.match(await page.innerText("h1"), /<\/script><img/);
  assert.equal(await page.locator("img").count(), 0);
  assert.deepEqual(problems, []);
});

for (const width of [1400, 390]) {
  for (const colorScheme of ["light", "dark"]) {
    test(`pages fit ${width} pixels, ${colorScheme}`, { skip }, async () => {
      for (const name of ["report.html", "bundle.html", "index.html"]) {
        const { page, problems } = await open(name, { width, colorScheme });
        const [wide, smallest] = await page.evaluate(() => [
          document.documentElement.scrollWidth - document.documentElement.clientWidth,
          Math.min(...[...document.querySelectorAll("main *")].filter((e) => e.textContent && e.getClientRects().length).map((e) => {
            const svg = e.closest("svg");
            return parseFloat(getComputedStyle(e).fontSize) * (svg ? svg.clientWidth / svg.viewBox.baseVal.width : 1);
          })),
        ]);
        assert.ok(wide <= 0, `${name} is ${wide} pixels too wide`);
        assert.ok(smallest >= 12, `${name} has text of ${smallest} pixels`);
        if (process.env.ACTQ_PICTURES) await page.screenshot({ path: `${process.env.ACTQ_PICTURES}/${name}-${width}-${colorScheme}.png`, fullPage: true });
        assert.deepEqual(problems, []);
      }
    });
  }
}

test("the balancer survives a push at 2 bits", { skip }, async () => {
  const { page, problems } = await open("index.html");
  assert.equal(await page.locator("#levels button[aria-pressed=true]").textContent(), "2 bits");
  await page.waitForTimeout(1000);
  const errors = [];
  await page.click("#right");
  for (let i = 0; i < 10; i++) {
    await page.waitForTimeout(200);
    errors.push(Number(await page.getAttribute("html", "data-error")));
  }
  // A fall would end the episode.
  assert.equal(await page.getAttribute("html", "data-episodes"), "0");
  assert.ok(Math.max(...errors) > 0.05, `nothing moved: ${errors}`);
  assert.deepEqual(problems, []);
});
