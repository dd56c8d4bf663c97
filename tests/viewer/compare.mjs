// Two methods beside each other on the ground of the viewer, in headless Chromium. Optional; nothing else needs it.
//   npm install --no-save playwright-core && node tests/viewer/compare.mjs http://127.0.0.1:8080 [/usr/bin/chromium] [PICTURE.png]
// The slider at an end shows either whole; in the middle the left of the picture is that of one and the right that of the other. A table tells both.
import { chromium } from "playwright-core";

const [server = "http://127.0.0.1:8080", executablePath = "/usr/bin/chromium", picture] = process.argv.slice(2);
const args = ["--no-sandbox", "--use-gl=angle", "--use-angle=swiftshader", "--enable-unsafe-swiftshader", "--ignore-gpu-blocklist"];
const browser = await chromium.launch({ executablePath, args });
const page = await browser.newPage({ viewport: { width: 1280, height: 800 } });
let failed = 0, passed = 0;
const check = (is, what) => { is ? passed++ : (failed++, console.error(what)); };
page.on("console", (message) => { if (!/GPU stall|GL Driver/.test(message.text())) check(false, message.text()); });
page.on("pageerror", (error) => check(false, error.stack));
page.on("requestfailed", (request) => { if (!/ABORTED/.test(request.failure().errorText)) check(false, request.url()); });

const state = { preset: "broken", view: "ground", ground: "irradiance", clouds: false, size: 128, zenith: 62, tolerance: 0.01, transport: "columns", transportB: "lattice" };
async function at(wipe, compare = true) {
  await page.goto("about:blank");
  await page.goto(`${server}/#${new URLSearchParams({ ...state, compare, wipe })}`);
  await page.waitForFunction((compare) => / in \d+ ms/.test(document.getElementById("state").textContent) && (!compare || document.querySelector("#compared tr")), compare, { timeout: 180_000 });
  await page.waitForTimeout(1000);
  // What lies over the picture is not of it.
  const show = (how) => page.evaluate((how) => { document.body.style.visibility = how; document.getElementById("solid").style.visibility = "visible"; }, how);
  await show("hidden");
  const png = await page.locator("#solid").screenshot();
  await show("visible");
  // Colours of a grid of places of the picture.
  return page.evaluate(async (text) => {
    const bitmap = await createImageBitmap(new Blob([Uint8Array.from(atob(text), (letter) => letter.charCodeAt(0))], { type: "image/png" }));
    const pen = Object.assign(document.createElement("canvas"), { width: 64, height: 40 }).getContext("2d");
    pen.drawImage(bitmap, 0, 0, 64, 40);
    return [...pen.getImageData(0, 0, 64, 40).data];
  }, png.toString("base64"));
}
// Mean difference of two pictures between two columns of the grid, in 255th parts.
function apart(a, b, from, to) {
  let sum = 0;
  for (let y = 0; y < 40; y++) for (let x = from; x < to; x++) for (let c = 0; c < 3; c++) sum += Math.abs(a[4 * (64 * y + x) + c] - b[4 * (64 * y + x) + c]);
  return sum / (120 * (to - from));
}

const alone = await at(0.5, false);
check(await page.isHidden("#wipe"), "an edge to move where nothing is compared");
const whole = await at(1);
const none = await at(0);
const half = await at(0.5);
check(await page.isVisible("#wipe") && await page.isVisible("#side-a") && await page.isVisible("#side-b"), "no edge to move");
if (picture) await page.screenshot({ path: picture });
const numbers = { same: apart(alone, whole, 0, 62), methods: apart(whole, none, 0, 62), left: apart(half, whole, 0, 30), right: apart(half, none, 34, 64), wrong: apart(half, whole, 34, 62) };
console.log(numbers);
// Dither is a step up or down.
check(numbers.same < 1, "with the edge at the right end it is A");
check(numbers.methods > 2, "A and B look alike");
check(numbers.left < 1 && numbers.right < 1, "a side shows the other's picture");
check(numbers.wrong > 2, "the right shows A");
const told = await page.textContent("#compared");
check(/lattice/.test(told) && /in the mean/.test(told), `the table: ${told}`);
// From view to view, and at play, with two methods all the while.
for (const view of ["dome", "maps", "ground"]) {
  await page.locator(`[data-key=view][value=${view}]`).first().check({ force: true });
  await page.waitForTimeout(3000);
}
await page.click("#play");
await page.waitForTimeout(5000);
await browser.close();
console.log(`${passed} passed, ${failed} failed`);
process.exit(failed ? 1 : 0);
