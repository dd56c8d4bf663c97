// Checks this example in headless Chromium, with a skyloom server that runs: a cube map with mip levels is read by three.js' own loader, looks
// and adds up as the server's other textures say, and a cloud in the shape of a letter lies right on the page, its shadow too.
//   npm install --no-save three@0.187 playwright-core && node check.mjs http://127.0.0.1:8080 [/usr/bin/chromium]
// It fails if a figure is out of its bounds, or if the page says anything on the console.
import { spawn } from "node:child_process";
import { crc32, deflateSync } from "node:zlib";
import { chromium } from "playwright-core";

const [server = "http://127.0.0.1:8080", executablePath = "/usr/bin/chromium"] = process.argv.slice(2);
const wrong = [];
const shows = (what, value, isRight) => {
  console.log(`${isRight ? "ok   " : "WRONG"} ${what}: ${value}`);
  if (!isRight) wrong.push(what);
};
const register = async (scene) => {
  const reply = await fetch(`${server}/v1/skies`, { method: "POST", headers: { "content-type": "application/json" }, body: JSON.stringify(scene) });
  if (!reply.ok) throw new Error(await reply.text());
  return (await reply.json()).id;
};

// A clear sky with a low sun, which no two directions have alike.
const clear = await register({
  sun: { zenith_deg: 70, azimuth_deg: 225 }, atmosphere: { aerosol: { optical_depth: 0.1 } }, ground: { albedo: [0.2, 0.2, 0.2] }, layers: [],
});

// The letter F, north up, of 64 x 64 texels of 100 m; the sun in the south-west at 45 degrees.
const SIDE = 64, TEXEL_M = 100, BASE_M = 1000;
const isInk = (x, y) => {
  const across = x - 25, down = y - 22;
  const within = (wide, from, to) => across >= 0 && across < wide && down >= from && down < to;
  return within(3, 0, 20) || within(13, 0, 3) || within(9, 8, 11);
};
const chunk = (kind, data) => {
  const body = Buffer.concat([Buffer.from(kind), data]);
  const around = Buffer.alloc(8);
  around.writeUInt32BE(data.length, 0);
  around.writeUInt32BE(crc32(body), 4);
  return Buffer.concat([around.subarray(0, 4), body, around.subarray(4)]);
};
const header = Buffer.from([0, 0, 0, SIDE, 0, 0, 0, SIDE, 8, 0, 0, 0, 0]);
const rows = Buffer.from(Array.from({ length: SIDE * (SIDE + 1) }, (_, i) => (isInk((i % (SIDE + 1)) - 1, Math.floor(i / (SIDE + 1))) ? 255 : 0)));
const png = Buffer.concat([Buffer.from("\x89PNG\r\n\x1a\n", "latin1"), chunk("IHDR", header), chunk("IDAT", deflateSync(rows)), chunk("IEND", Buffer.alloc(0))]);

const pageServer = spawn("python3", ["serve.py", server, "8098"], { cwd: new URL(".", import.meta.url).pathname, stdio: ["ignore", "pipe", "inherit"] });
process.on("exit", () => pageServer.kill());
const address = await new Promise((resolve, reject) => {
  let told = "";
  pageServer.stdout.on("data", (data) => { told += data; const found = /http\S+/.exec(told); if (found) resolve(found[0]); });
  pageServer.on("exit", (code) => reject(new Error(`serve.py ended with ${code}`)));
});
const args = ["--no-sandbox", "--use-gl=angle", "--use-angle=swiftshader", "--enable-unsafe-swiftshader", "--ignore-gpu-blocklist"];
const browser = await chromium.launch({ executablePath, args });

async function open(where) {
  const page = await browser.newPage({ viewport: { width: 800, height: 800 } });
  page.on("console", (message) => { if (!/GPU stall|GL Driver/.test(message.text())) wrong.push(`${where}: ${message.text()}`); });
  page.on("pageerror", (error) => wrong.push(`${where}: ${error.stack}`));
  await page.goto(`${address}${where}`);
  await page.waitForFunction(() => /clouds of|failed|rror/.test(document.getElementById("told").textContent), null, { timeout: 120_000 });
  return page;
}

// --- The cube map: what three.js shows of it, and its light on a level ground. ---
const page = await open(`?sky=${clear}`);
const cube = await page.evaluate(async (id) => {
  const THREE = await import("three");
  const { KTX2Loader } = await import("three/addons/loaders/KTX2Loader.js");
  const { cubeOf } = await import("./cube.js");
  const renderer = new THREE.WebGLRenderer();
  const loader = new KTX2Loader().detectSupport(renderer);
  const floats = async (query) => new Float32Array(await (await fetch(`/v1/skies/${id}/${query}`)).arrayBuffer());
  const seen = [], light = {};
  const ground = await floats("irradiance.f32?component=diffuse&peak=false&size=1");
  const shapes = [];
  for (const coding of ["depth=16", "coding=rgb9e5"]) {
    const map = cubeOf(await loader.loadAsync(`/v1/skies/${id}/sky.ktx2?projection=cube&size=128&mips=true&axes=three&${coding}`));
    shapes.push([map.image.length, 1 + map.mipmaps.length]);
    const scene = new THREE.Scene();
    scene.background = map;
    const target = new THREE.WebGLRenderTarget(16, 16, { type: THREE.FloatType, minFilter: THREE.NearestFilter, magFilter: THREE.NearestFilter });
    const texels = (render) => {
      renderer.setRenderTarget(target);
      render();
      const values = new Float32Array(16 * 16 * 4);
      renderer.readRenderTargetPixels(target, 0, 0, 16, 16, values);
      return values;
    };
    for (const [azimuth, elevation] of [[0, 10], [90, 10], [225, 35], [225, 12], [310, 60], [45, -20]]) {
      const camera = new THREE.PerspectiveCamera(20, 1, 0.1, 10);
      const [a, e] = [azimuth, elevation].map((angle) => (angle * Math.PI) / 180);
      camera.lookAt(Math.sin(a) * Math.cos(e), Math.sin(e), -Math.cos(a) * Math.cos(e));
      const drawn = texels(() => renderer.render(scene, camera));
      const server = await floats(`sky.f32?projection=camera&look=${azimuth},${elevation}&fov=20&size=16`);
      let square = 0, all = 0;
      for (let y = 0; y < 16; y++) for (let x = 0; x < 16; x++) for (let c = 0; c < 3; c++) {
        const [a, b] = [drawn[4 * (16 * (15 - y) + x) + c], server[3 * (16 * y + x) + c]];
        square += (a - b) ** 2;
        all += b ** 2;
      }
      seen.push([`${coding}, azimuth ${azimuth}, elevation ${elevation}`, Math.sqrt(square / all)]);
    }
    // Cosine times radiance over the upper half, every level's own texels: three.js looks cube maps up at (-x, y, z).
    for (const level of [0, 1, 2]) {
      const quad = new THREE.Mesh(new THREE.PlaneGeometry(2, 2), new THREE.ShaderMaterial({
        glslVersion: THREE.GLSL3, depthTest: false, uniforms: { map: { value: map } }, vertexShader: "void main() { gl_Position = vec4(position.xy, 0., 1.); }",
        fragmentShader: `out vec4 sum; uniform samplerCube map; void main() {
          sum = vec4(0.);
          for (int i = 0; i < 64; i++) for (int j = 0; j < 128; j++) {
            float cosine2 = (float(i) + .5) / 64., around = (float(j) + .5) / 128. * 6.2831853;
            float across = sqrt(1. - cosine2);
            sum += textureLod(map, vec3(-across * cos(around), sqrt(cosine2), across * sin(around)), ${level}.) * 3.14159265 / (64. * 128.);
          } }` }));
      quad.frustumCulled = false;
      const only = new THREE.Scene();
      only.add(quad);
      const sum = texels(() => renderer.render(only, new THREE.Camera()));
      light[`${coding}, level ${level}`] = [0, 1, 2].map((c) => sum[c] / ground[c]);
    }
  }
  return { seen, light, shapes };
}, clear);
shows("cube maps of six faces and eight levels", JSON.stringify(cube.shapes), cube.shapes.every(([faces, levels]) => faces === 6 && levels === 8));
// A cube of 128 texels has .7 degrees a texel, between which the loader's filter is linear.
for (const [what, error] of cube.seen) shows(`three.js against the server's camera, ${what}`, `${(100 * error).toFixed(2)} % rms`, error < 0.02);
for (const [what, ratios] of Object.entries(cube.light)) {
  shows(`light of the cube map on the ground, in parts of irradiance, ${what}`, ratios.map((ratio) => ratio.toFixed(4)).join(" "), ratios.every((ratio) => Math.abs(ratio - 1) < 0.02));
}
await page.close();

// --- The letter, from straight above: brighter than the ground; its shadow darker, to the north-east. ---
const image = await (await fetch(`${server}/v1/images`, { method: "POST", headers: { "content-type": "image/png" }, body: png })).json();
const letter = await register({
  domain: { extent_m: TEXEL_M * SIDE, resolution: SIDE }, sun: { zenith_deg: 45, azimuth_deg: 225 },
  atmosphere: { sun: [100, 100, 100], sky: [3, 4, 6] }, ground: { albedo: [0.06, 0.06, 0.06] },
  layers: [{ base_m: BASE_M, thickness: { kind: "image", image: image.sha256, scale_m: 100 }, droplets: { henyey_greenstein: 0.85, extinction_per_m: 0.03 } }],
});
const above = await open(`?sky=${letter}`);
// By its own mouse control: a quarter of the way round in height, and so far to the side that north is on top.
const drag = async (right, down) => {
  await above.mouse.move(400, 300);
  await above.mouse.down();
  await above.mouse.move(400 + right / 2, 300 + down / 2);
  await above.mouse.move(400 + right, 300 + down);
  await above.mouse.up();
  await above.waitForTimeout(1500);
};
await drag((Math.atan2(0.35, 0.55) / (2 * Math.PI)) * 800, 0);
await drag(0, 300);
await above.waitForTimeout(8000); // the next frame of the clouds
const shot = await above.screenshot(process.env.PICTURE ? { path: process.env.PICTURE } : {});
const brightness = await above.evaluate(async (data) => {
  const bitmap = await createImageBitmap(await (await fetch(`data:image/png;base64,${data}`)).blob());
  const canvas = new OffscreenCanvas(bitmap.width, bitmap.height).getContext("2d");
  canvas.drawImage(bitmap, 0, 0);
  const { data: rgba } = canvas.getImageData(0, 0, bitmap.width, bitmap.height);
  return Array.from({ length: rgba.length / 4 }, (_, i) => rgba[4 * i] + rgba[4 * i + 1] + rgba[4 * i + 2]);
}, shot.toString("base64"));
// The camera stands above the middle, as far from it as where the page puts it.
const km = (TEXEL_M * SIDE) / 1000, far = Math.hypot(0.35 * km, 7, 0.55 * km);
const at = (eastKm, northKm, heightKm) => {
  const half = Math.tan((25 * Math.PI) / 180) * (far - heightKm);
  const [x, y] = [400 * (1 + eastKm / half), 400 * (1 - northKm / half)].map(Math.floor);
  return x >= 0 && y >= 0 && x < 800 && y < 800 ? brightness[800 * y + x] : null;
};
const means = (heightKm, moveKm, way) => {
  const sums = [[0, 0], [0, 0]];
  for (let y = 12; y < 52; y++) for (let x = 12; x < 52; x++) {
    const [u, v] = way & 4 ? [y, x] : [x, y];
    const ink = isInk(way & 1 ? SIDE - 1 - u : u, way & 2 ? SIDE - 1 - v : v);
    const value = at(((x + 0.5) / SIDE - 0.5) * km + moveKm, (0.5 - (y + 0.5) / SIDE) * km + moveKm, heightKm);
    if (value !== null) {
      sums[Number(ink)][0] += value;
      sums[Number(ink)][1] += 1;
    }
  }
  return sums.map(([sum, count]) => sum / count);
};
const contrast = (heightKm, moveKm) => Array.from({ length: 8 }, (_, way) => { const [paper, ink] = means(heightKm, moveKm, way); return ink - paper; });
const cloud = contrast(BASE_M / 1000, 0), shadow = contrast(0, 0.74);
shows("cloud, brighter than around it, of the eight ways in which a letter can lie", cloud.map((value) => value.toFixed(0)).join(" "), cloud.every((value, way) => way === 0 || value < 0.7 * cloud[0]) && cloud[0] > 30);
shows("shadow 740 m to the north and east, darker", shadow.map((value) => value.toFixed(0)).join(" "), shadow.every((value, way) => way === 0 || value > 0.7 * shadow[0]) && shadow[0] < -30);

await browser.close();
for (const each of wrong) console.error(each);
process.exit(wrong.length ? 1 : 0);
