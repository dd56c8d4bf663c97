"use strict";
// The latest setting wins: a new one aborts the requests of the one before, and nothing is sent while a slider moves fast.

const TEXTURES = ["sky", "cloud", "shadow", "irradiance", "compass"];
const PANORAMAS = ["sky", "compass"];
const PAUSE_MS = 180;
const EVERY_S = 2; // between the frames of a playing sky
const $ = (id) => document.getElementById(id);
const wait = (ms) => new Promise((done) => setTimeout(done, ms));

let presets = [];
let running = new AbortController();
let timer = 0;
let playing = false;
let passing = null; // a sky this page registered and left before its pictures were shown: nobody else can know it

class Refused extends Error {
  constructor(problem) {
    super(problem.title || "error");
    this.problem = problem;
  }
}

async function ask(url, options) {
  const reply = await fetch(url, options);
  if (reply.ok) return reply;
  let problem = { title: reply.statusText || "error", status: reply.status };
  try { problem = await reply.json(); } catch { /* the body was no document: the status has to do */ }
  throw new Refused(problem);
}

function settings() {
  const preset = presets.find((each) => each.name === $("preset").value);
  const scene = structuredClone(preset.scene);
  // A sun given by place and date is replaced by the sliders' direction; the size of its disc stays.
  const { angular_diameter_deg } = scene.sun || {};
  scene.sun = { zenith_deg: Number($("zenith").value), azimuth_deg: Number($("azimuth").value) };
  if (angular_diameter_deg !== undefined) scene.sun.angular_diameter_deg = angular_diameter_deg;
  const view = document.querySelector("input[name=view]:checked").value;
  return { scene, time: Number($("time").value), size: Number($("size").value), view, axes: $("axes").value };
}

function queryOf(name, { time, size, view, axes }) {
  const query = new URLSearchParams({ size });
  if (time > 0) query.set("time", time);
  if (name === "cloud" && view !== "below") query.set("view", view);
  if (PANORAMAS.includes(name) && axes !== "enu") query.set("axes", axes);
  return query.toString();
}

function showValues() {
  $("zenith-value").value = `${$("zenith").value}°`;
  $("azimuth-value").value = `${$("azimuth").value}°`;
  showTime(Number($("time").value));
}

function showTime(time) {
  $("time-value").value = `${Math.floor(time / 60)} min ${String(Math.floor(time % 60)).padStart(2, "0")} s`;
}

function showCurl(id, now) {
  const origin = location.origin;
  const scene = JSON.stringify(now.scene).replaceAll("'", "'\\''");
  const lines = [`curl --json '${scene}' ${origin}/v1/skies`];
  for (const name of TEXTURES) lines.push(`curl -o ${name}.png '${origin}/v1/skies/${id}/${name}.png?${queryOf(name, now)}'`);
  $("curl").textContent = lines.join("\n");
}

function showProblem(problem) {
  $("problem").hidden = !problem;
  $("problem").textContent = problem ? JSON.stringify(problem, null, 2) : "";
}

// Tables of a new droplet mix take a while: tell how far they are until the pictures come.
async function watchTables(id, signal) {
  await wait(700);
  while (!signal.aborted) {
    const { tables } = await (await ask(`/v1/skies/${id}`, { signal })).json();
    if (tables.state === "ready") return;
    $("state").textContent = `Computing the optics of this droplet mix, once: ${Math.round(100 * tables.progress)} %`;
    await wait(500);
  }
}

async function picture(name, address, signal) {
  const figure = $(name);
  figure.classList.add("waiting");
  const reply = await ask(address, { signal });
  const image = figure.querySelector("img");
  const url = URL.createObjectURL(await reply.blob());
  if (signal.aborted) return URL.revokeObjectURL(url);
  const before = image.src;
  image.src = url;
  await image.decode();
  image.hidden = false;
  if (before) URL.revokeObjectURL(before);
  figure.querySelector("a").href = address.replace(".png?", ".exr?");
  figure.querySelector("i").textContent = (reply.headers.get("server-timing") || "").replaceAll(";dur=", " ").replace(";desc=", " ");
  figure.classList.remove("waiting");
}

// Follows the server's clock from the slider's time on, until the signal ends it. A frame that comes while the one before
// is still being drawn is left out.
function play(id, now, clock, signal) {
  const query = new URLSearchParams({ every: EVERY_S, size: now.size, view: now.view, axes: now.axes, start: (clock - now.time).toFixed(3) });
  query.set("textures", TEXTURES.map((name) => `${name}.png`).join());
  const source = new EventSource(`/v1/skies/${id}/frames?${query}`);
  signal.addEventListener("abort", () => source.close());
  let drawing = false;
  source.addEventListener("frame", async ({ data }) => {
    if (drawing || signal.aborted) return;
    drawing = true;
    try {
      const { time, at, textures } = JSON.parse(data);
      await Promise.all(TEXTURES.map((name) => picture(name, textures[`${name}.png`], signal)));
      if (signal.aborted) return;
      passing = null;
      $("time").value = time;
      showTime(time);
      showCurl(id, { ...now, time });
      showProblem(null);
      $("state").textContent = `Playing: the sky of ${new Date(at).toLocaleTimeString()}, every ${EVERY_S} s`;
    } catch (error) {
      if (!signal.aborted) failed(error);
    } finally {
      drawing = false;
    }
  });
  // The browser connects again by itself after a break; it gives up where the server refuses, without telling why.
  source.addEventListener("error", () => {
    if (source.readyState !== EventSource.CLOSED || signal.aborted) return;
    setPlaying(false);
    failed(new Refused({ title: "The stream of frames ended", detail: "It was refused; too many may be open." }));
  });
}

function setPlaying(on) {
  playing = on;
  $("play").textContent = on ? "Pause" : "Play";
}

function failed(error) {
  $("state").textContent = "This did not work:";
  showProblem(error instanceof Refused ? error.problem : { title: "The server does not answer", detail: String(error) });
}

async function update() {
  running.abort();
  running = new AbortController();
  const { signal } = running;
  const start = performance.now();
  const now = settings();
  $("state").textContent = "Rendering …";
  try {
    const options = { method: "POST", headers: { "content-type": "application/json" }, body: JSON.stringify(now.scene), signal };
    const reply = await ask("/v1/skies", options);
    const { id, version } = await reply.json();
    if (passing && passing !== id) fetch(`/v1/skies/${passing}`, { method: "DELETE" }).catch(() => {});
    passing = reply.status === 201 || passing === id ? id : null;
    if (playing) {
      // The server's clock, as the browser's may be wrong.
      const clock = Date.parse(reply.headers.get("date")) / 1000;
      play(id, now, clock, signal);
      return;
    }
    const done = new AbortController();
    watchTables(id, AbortSignal.any([signal, done.signal])).catch(() => {});
    try {
      // With the version a browser may keep a picture for ever; the curl lines go without, for the picture of the day.
      const address = (name) => `/v1/skies/${id}/${name}.png?${queryOf(name, now)}&v=${encodeURIComponent(version)}`;
      await Promise.all(TEXTURES.map((name) => picture(name, address(name), signal)));
    } finally {
      done.abort();
    }
    if (signal.aborted) return;
    passing = null;
    showCurl(id, now);
    showProblem(null);
    $("state").textContent = `Five textures, ${now.size} high, in ${Math.round(performance.now() - start)} ms`;
  } catch (error) {
    if (signal.aborted) return;
    setPlaying(false);
    failed(error);
  }
}

function changed() {
  showValues();
  clearTimeout(timer);
  timer = setTimeout(update, PAUSE_MS);
}

function choose() {
  const { scene } = presets.find((each) => each.name === $("preset").value);
  if (scene.sun && scene.sun.zenith_deg !== undefined) {
    $("zenith").value = scene.sun.zenith_deg;
    $("azimuth").value = scene.sun.azimuth_deg || 0;
  }
  changed();
}

async function start() {
  $("controls").addEventListener("submit", (event) => event.preventDefault());
  $("controls").addEventListener("input", (event) => (event.target === $("preset") ? choose() : changed()));
  $("play").addEventListener("click", () => {
    setPlaying(!playing);
    changed();
  });
  $("copy").addEventListener("click", async () => {
    await navigator.clipboard.writeText($("curl").textContent);
    $("copy").textContent = "Copied";
    setTimeout(() => { $("copy").textContent = "Copy"; }, 1200);
  });
  try {
    presets = await (await ask("/v1/presets")).json();
    for (const { name, title } of presets) $("preset").append(new Option(title, name));
    choose();
    const { adapter } = await (await ask("/health/ready")).json();
    $("device").textContent = `on ${adapter.name}`;
  } catch (error) {
    const { problem } = error;
    $("device").textContent = problem && presets.length ? "not ready to render" : "";
    showProblem(problem || { title: "The server does not answer", detail: String(error) });
  }
}

start();
