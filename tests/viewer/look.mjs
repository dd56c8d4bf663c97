// The viewer in headless Chromium: on a desktop, a tablet and a telephone, by keyboard alone, and what axe finds. Optional; nothing else needs it.
//   npm install --no-save playwright-core axe-core && node tests/viewer/look.mjs http://127.0.0.1:8080 [/usr/bin/chromium] [FOLDER for pictures]
// With UI=api/ui the page's files come from there and not from the server, so that nothing need be built. It fails if anything is wrong, or if the page
// says a word on the console or asks another server for anything.
import { readFile } from "node:fs/promises";
import { createRequire } from "node:module";
import { chromium } from "playwright-core";

const [server = "http://127.0.0.1:8080", executablePath = "/usr/bin/chromium", folder] = process.argv.slice(2);
const axe = await readFile(createRequire(import.meta.url).resolve("axe-core/axe.min.js"), "utf8");
const args = ["--no-sandbox", "--use-gl=angle", "--use-angle=swiftshader", "--enable-unsafe-swiftshader", "--ignore-gpu-blocklist"];
const browser = await chromium.launch({ executablePath, args });
let passed = 0, failed = 0;
const check = (is, what) => { is ? passed++ : (failed++, console.error(`WRONG ${what}`)); };

const COARSE = { isMobile: true, hasTouch: true };
const SCREENS = [
  ["desktop", { viewport: { width: 1440, height: 900 } }],
  ["tablet", { viewport: { width: 820, height: 1180 }, ...COARSE }],
  ["telephone", { viewport: { width: 390, height: 844 }, ...COARSE, colorScheme: "dark" }],
];

async function open(options, state, isQuiet = true) {
  // axe is put into the page, which the page's own policy forbids.
  const context = await browser.newContext({ ...options, bypassCSP: true });
  const page = await context.newPage();
  if (isQuiet) page.on("console", (message) => { if (!/GPU stall|GL Driver/.test(message.text())) check(false, `console: ${message.text()} ${message.location().url}`); });
  page.on("pageerror", (error) => check(false, error.stack));
  page.on("request", (request) => { if (!request.url().startsWith(server) && !/^(data|blob):/.test(request.url())) check(false, `asks ${request.url()}`); });
  if (process.env.UI) await page.route(/\/(viewer[^?]*\.(js|css))?$/, async (route) => {
    const { pathname } = new URL(route.request().url());
    const name = pathname === "/" ? "/index.html" : pathname;
    const kind = { html: "text/html", js: "text/javascript", css: "text/css" }[name.split(".").at(-1)];
    await route.fulfill({ body: await readFile(process.env.UI + name), contentType: `${kind}; charset=utf-8` });
  });
  await page.goto(`${server}/#${new URLSearchParams(state)}`);
  await shown(page);
  return page;
}
const shown = (page) => page.waitForFunction(() => / in \d+ ms/.test(document.getElementById("state").textContent), null, { timeout: 180_000 });
const stateOf = (page) => page.evaluate(() => Object.fromEntries(new URLSearchParams(location.hash.slice(1))));
async function audit(page, where) {
  await page.evaluate(axe);
  const found = await page.evaluate(() => window.axe.run(document, { resultTypes: ["violations"] }));
  for (const each of found.violations) console.log(`  axe, ${where}: ${each.impact} ${each.id}: ${each.nodes.map(({ target }) => target).join(" ")}`);
  check(found.violations.every(({ impact }) => !["serious", "critical"].includes(impact)), `axe, ${where}`);
}
const unfold = (page) => page.evaluate(() => { for (const each of document.querySelectorAll(".panel > details")) each.open = true; });

for (const [name, options] of SCREENS) {
  const page = await open(options, { preset: "broken", size: 128 });
  check(await page.evaluate(() => document.documentElement.scrollWidth <= innerWidth), `${name}: wider than the screen`);
  await unfold(page);
  // Nothing lies over a control: at its right end it is itself that is met.
  const covered = await page.evaluate(async () => {
    const wrong = [];
    for (const each of document.querySelectorAll("input, select, button, textarea, summary")) {
      if (!each.checkVisibility() || each.closest(".views") || each.closest(".stage")) continue;
      each.scrollIntoView({ block: "center" });
      const box = each.getBoundingClientRect();
      const met = document.elementFromPoint(box.right - 4, (box.top + box.bottom) / 2);
      if (met !== each && !each.contains(met)) wrong.push(`${each.id || each.dataset.key || each.textContent}: ${met?.id || met?.tagName}`);
    }
    return wrong;
  });
  check(covered.length === 0, `${name}: lies over a control: ${covered.join(", ")}`);
  const least = await page.evaluate(() => Math.min(...[...document.querySelectorAll("input[type=range]")].filter((each) => each.checkVisibility()).map((each) => each.getBoundingClientRect().height)));
  check(least >= (options.hasTouch ? 44 : 24), `${name}: sliders of ${least} px`);
  for (const view of ["dome", "ground", "maps"]) {
    await page.locator(`[data-key=view][value=${view}]`).first().check({ force: true });
    await shown(page);
    await page.waitForTimeout(1500);
    await audit(page, `${name}, ${view}`);
    if (folder) { await page.evaluate(() => scrollTo(0, 0)); await page.screenshot({ path: `${folder}/${name}-${view}.png` }); }
  }
  await page.context().close();
}

// --- By keyboard alone. ---
{
  const page = await open(SCREENS[0][1], { preset: "broken", size: 128 });
  const focused = () => page.evaluate(() => document.activeElement?.id || document.activeElement?.dataset?.key || document.activeElement?.textContent);
  const tabTo = async (wanted) => { for (let i = 0; i < 400; i++) { await page.keyboard.press("Tab"); if (await focused() === wanted) return true; } return false; };
  check(await tabTo("solid"), "no way by Tab to the picture");
  await page.keyboard.press("ArrowLeft");
  await page.keyboard.press("+");
  await page.waitForTimeout(600);
  const turned = await stateOf(page);
  check(turned.yaw !== undefined && turned.fov !== undefined, `arrows turn, plus comes nearer: ${JSON.stringify(turned)}`);
  check(await tabTo("sun-handle"), "no way by Tab to the sun");
  await page.keyboard.press("ArrowUp");
  await page.waitForTimeout(600);
  const moved = await stateOf(page);
  check(moved.zenith !== turned.zenith, `the sun moves by keys: ${moved.zenith}`);
  check(await tabTo("zenith"), "no way by Tab to the zenith");
  await page.keyboard.press("End");
  await page.waitForTimeout(600);
  check((await stateOf(page)).zenith === "110", "the slider goes to its end");
  await page.keyboard.press("Home");
  // Until the picture rests: its files are listed anew then.
  await page.waitForTimeout(1000);
  await shown(page);
  await page.waitForTimeout(1500);
  // Every part opens by Enter, and what it holds is reached by Tab: the curl line too.
  for (let i = 0; i < 20; i++) {
    const closed = page.locator(".panel > details:not([open]) > summary").first();
    if (!await closed.count()) break;
    await closed.focus();
    await page.keyboard.press("Enter");
  }
  check(await page.locator(".panel > details:not([open])").count() === 0, "parts that keys do not open");
  check(await tabTo("curl"), "no way by Tab to the curl line");
  const reached = new Set(), all = await page.evaluate(() => [...document.querySelectorAll("a[href], button, input, select, textarea, summary, [tabindex='0']")]
    .filter((each) => each.checkVisibility() && each.type !== "radio").map((each, i) => { each.dataset.reach = i; return i; }).length);
  for (let i = 0; i < 2 * all; i++) { await page.keyboard.press("Tab"); reached.add(await page.evaluate(() => document.activeElement?.dataset?.reach)); }
  reached.delete(undefined);
  check(reached.size >= all, `${reached.size} of ${all} controls are reached by Tab`);
  await tabTo("solid");
  await page.keyboard.press(" ");
  await page.waitForTimeout(12_000);
  // The address follows when it rests.
  const played = Number(await page.inputValue("#time"));
  check(played > 60, `a minute a second: ${played} s in 12 s`);
  await page.keyboard.press(" ");
  await page.context().close();
}

// --- Light: high and low suns, as the eye adapts. ---
const brightness = async (zenith) => {
  const page = await open(SCREENS[0][1], { preset: "fair-weather", size: 128, zenith, azimuth: 180, yaw: 0, pitch: 30 });
  await page.waitForTimeout(500);
  await page.evaluate(() => { document.body.style.visibility = "hidden"; document.getElementById("solid").style.visibility = "visible"; });
  const png = await page.locator("#solid").screenshot();
  const mean = await page.evaluate(async (text) => {
    const bitmap = await createImageBitmap(new Blob([Uint8Array.from(atob(text), (letter) => letter.charCodeAt(0))], { type: "image/png" }));
    const pen = Object.assign(document.createElement("canvas"), { width: 32, height: 20 }).getContext("2d");
    pen.drawImage(bitmap, 0, 0, 32, 20);
    const { data } = pen.getImageData(0, 0, 32, 20);
    return data.reduce((sum, value, i) => sum + (i % 4 === 3 ? 0 : value), 0) / (32 * 20 * 3);
  }, png.toString("base64"));
  await page.context().close();
  return mean;
};
const [noon, dusk] = [await brightness(20), await brightness(95)];
console.log(`mean of the picture, 0 to 255: sun at 20 degrees ${noon.toFixed(0)}, at 95 ${dusk.toFixed(0)}`);
check(noon > 1.25 * dusk, "noon looks no brighter than dusk");

// --- Two skies side by side, and the speed and accuracy of the view. ---
{
  const page = await open(SCREENS[0][1], { preset: "broken", size: 128, compare: true, transport: "columns", transportB: "lattice", zenith: 62 });
  await page.waitForFunction(() => document.querySelector("#compared tr"), null, { timeout: 60_000 });
  await unfold(page);
  const told = await page.textContent("#compared");
  check(/lattice/.test(told) && /columns/.test(told) && /in the mean/.test(told) && /Error expected/.test(told) && / ms|from memory/.test(told), `the table of two skies: ${told}`);
  check(await page.isVisible("#wipe"), "no edge between two skies");
  await page.click("#measure");
  await page.waitForFunction(() => document.getElementById("measure").textContent.startsWith("Measure") && document.querySelectorAll("#ways tr").length > 8, null, { timeout: 240_000 });
  const dots = await page.locator("#tradeoff .dot").count(), rings = await page.locator("#tradeoff .ring").count(), rows = await page.locator("#ways tr").count();
  console.log(await page.evaluate(() => [...document.querySelectorAll("#ways tr")].map((row) => [...row.children].map((cell) => cell.textContent).join(" | ")).join("\n")));
  check(dots === rows - 1 && rings >= dots / 2, `${dots} dots and ${rings} rings of ${rows - 1} ways`);
  await audit(page, "comparison");
  if (folder) { await page.locator("#part-compare").scrollIntoViewIfNeeded(); await page.screenshot({ path: `${folder}/compare.png` }); }
  await page.context().close();
}

// --- The scene's form, by the schema: a wrong value is told at its field, a right one is rendered. ---
{
  const page = await open(SCREENS[0][1], { preset: "broken", size: 128 }, false);
  await page.evaluate(() => { document.getElementById("part-scene").open = true; });
  const open_ = (pointer) => page.evaluate((pointer) => { const found = document.querySelector(`details[data-pointer="${pointer}"]`); found.open = true; found.dispatchEvent(new Event("toggle")); }, pointer);
  await open_("/layers/0");
  const field = page.locator('input[data-pointer="/layers/0/base_m"]');
  await field.fill("99999");
  await field.press("Tab");
  await page.waitForFunction(() => !document.getElementById("scene-wrong").hidden, null, { timeout: 10_000 });
  check(await field.getAttribute("aria-invalid") === "true", "the wrong field is not marked");
  check(/base_m/.test(await page.textContent("#scene-wrong")), `the error names the field: ${await page.textContent("#scene-wrong")}`);
  await page.click("#scene-wrong button");
  check(await page.evaluate(() => document.activeElement.dataset.pointer) === "/layers/0/base_m", "the error leads to its field");
  if (folder) { await page.locator("#part-scene").scrollIntoViewIfNeeded(); await page.screenshot({ path: `${folder}/form.png` }); }
  await field.fill("1500");
  await field.press("Tab");
  await page.waitForFunction(() => document.getElementById("scene-wrong").hidden, null, { timeout: 10_000 });
  await page.waitForTimeout(1500);
  await shown(page);
  check(JSON.parse(await page.inputValue("#scene")).layers[0].base_m === 1500, "the text has what the field has");
  check((await stateOf(page)).scene !== undefined, "the address has the scene");
  // Another kind of a part.
  const kinds = page.locator('select[aria-label="Kind of atmosphere"]');
  await open_("/atmosphere");
  check(await kinds.locator("option").count() >= 3, "kinds of air");
  await kinds.selectOption({ label: "by name" });
  await page.waitForTimeout(2500);
  check(typeof JSON.parse(await page.inputValue("#scene")).atmosphere === "string", "air by name");
  await page.context().close();
}

// --- A server that dies is told within three seconds, and when it is back. ---
{
  const page = await open(SCREENS[0][1], { preset: "broken", size: 128 }, false);
  await page.route("**/health/live", (route) => route.abort());
  const start = Date.now();
  await page.waitForSelector("#dead:not([hidden])", { timeout: 10_000 });
  console.log(`told after ${Date.now() - start} ms`);
  check(Date.now() - start <= 3000, "a dead server is told late");
  await page.unroute("**/health/live");
  await page.waitForSelector("#dead", { state: "hidden", timeout: 10_000 });
  await page.context().close();
}

// --- The charts. ---
if (!process.env.UI) {
  const context = await browser.newContext({ viewport: { width: 1440, height: 900 }, bypassCSP: true });
  const page = await context.newPage();
  page.on("console", (message) => check(false, `charts: ${message.text()}`));
  await page.goto(`${server}/charts`);
  const broken = await page.evaluate(async () => {
    const all = [...document.images];
    for (const each of all) { each.loading = "eager"; await each.decode().catch(() => {}); }
    return [all.length, all.filter((each) => !each.naturalWidth).map((each) => each.src)];
  });
  check(broken[0] >= 16 && broken[1].length === 0, `charts: ${broken}`);
  await audit(page, "charts");
  await context.close();
}

await browser.close();
console.log(`${passed} passed, ${failed} failed`);
process.exit(failed ? 1 : 0);
