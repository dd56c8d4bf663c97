// Draws docs/pictures/viewer-*.jpg: the viewer of a running server, in headless Chromium. Optional; nothing else needs it.
//   npm install --no-save playwright-core && node docs/pictures/viewer.mjs http://127.0.0.1:8080 [/usr/bin/chromium]
// It fails if the page says anything on the console, or is wider than the screen.
import { chromium } from "playwright-core";

const [server = "http://127.0.0.1:8080", executablePath = "/usr/bin/chromium"] = process.argv.slice(2);
const here = new URL(".", import.meta.url).pathname;
const PICTURES = [
  ["viewer-sky", { width: 1440, height: 900 }, "preset=fair-weather&zenith=62&azimuth=225&yaw=205&pitch=20", {}],
  ["viewer-ground", { width: 820, height: 1180 }, "preset=fair-weather&view=ground&zenith=62&azimuth=120&turn=30&tilt=32&size=256", { isMobile: true, hasTouch: true }],
  ["viewer-map", { width: 390, height: 844 }, "preset=broken&view=maps&texture=irradiance&paint=true&size=256", { isMobile: true, hasTouch: true, colorScheme: "dark" }],
];

const args = ["--no-sandbox", "--use-gl=angle", "--use-angle=swiftshader", "--enable-unsafe-swiftshader", "--ignore-gpu-blocklist"];
const browser = await chromium.launch({ executablePath, args });
const wrong = [];
for (const [name, viewport, state, options] of PICTURES) {
  const context = await browser.newContext({ viewport, ...options });
  const page = await context.newPage();
  page.on("console", (message) => { if (!/GPU stall|GL Driver/.test(message.text())) wrong.push(`${name}: ${message.text()}`); });
  page.on("pageerror", (error) => wrong.push(`${name}: ${error.stack}`));
  await page.goto(`${server}/#${state}`);
  await page.waitForFunction(() => / in \d+ ms/.test(document.getElementById("state").textContent), null, { timeout: 120_000 });
  await page.waitForTimeout(8000); // the sharp picture of the view
  if (await page.evaluate(() => document.documentElement.scrollWidth > innerWidth)) wrong.push(`${name}: wider than the screen`);
  await page.screenshot({ path: `${here}${name}.jpg`, quality: 84 });
  await context.close();
}
await browser.close();
for (const each of wrong) console.error(each);
process.exit(wrong.length ? 1 : 0);
