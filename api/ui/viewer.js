// The page: controls into a scene and queries, what comes back onto the screen. The latest setting wins; while a control moves,
// small pictures come, and the full one when it rests.
import { Refused, ask, askJson, register } from "./viewer/ask.js";
import { defaults, onChange, readAddress, set, state } from "./viewer/state.js";
import { isPhysical, original, sceneNow, setPresets, sunOf } from "./viewer/scene.js";
import { load, loadOther, loadSharp, mainOf, methodsOf, queryOf } from "./viewer/load.js";
import { canvasNow, frameNow, hasDome, hasGround, mapSide, moveCross, point, repaint, show } from "./viewer/paint.js";
import { commands, setTextures, showCompared, showFiles, showPlan, stagesOf } from "./viewer/panels.js";
import { hands, nearer, resetView, sunHand } from "./viewer/hands.js";
import { placeOf, placeOfLine, showProblem } from "./viewer/wrong.js";
import { fieldOf, sceneForm } from "./viewer/form.js";
import { drawTradeoff, measureView } from "./viewer/tradeoff.js";
import { player } from "./viewer/play.js";
import { watch } from "./viewer/alive.js";

const $ = (id) => document.getElementById(id);
const DRAFT = 96;
const REST_MS = 350;
// What changes only how the same pictures are shown.
const QUIET = new Set(["expose", "ev", "stops", "paint", "wipe", "yaw", "pitch", "fov", "turn", "tilt", "away", "zoom", "mapX", "mapY", "tiles", "clouds", "speed", "axes"]);
const CAMERA = new Set(["yaw", "pitch", "fov"]);

let sky = null; // { id, version, scene, text, isNew, isShown }
let running = new AbortController();
let sharpening = new AbortController();
let drafting = false;
let again = false;
let timers = { rest: 0, sharp: 0 };
let wasAlive = true;

const say = (text) => { $("state").textContent = text; };

function failed(error, box = $("problem")) {
  say("");
  const problem = error instanceof Refused ? error.problem : { title: "The server does not answer", detail: String(error.message || error) };
  showProblem(box, problem, goTo, (pointer) => fieldOf($("form"), pointer));
}

// Leads to what a problem is about: a control, or the place in the scene's text.
function goTo(name, control) {
  for (let part = control?.closest("details") || $("part-scene"); part; part = part.parentElement?.closest("details")) part.open = true;
  if (control) return control.focus();
  const text = $("scene");
  const [from, to] = placeOf(text.value, name) || [0, 0];
  text.focus();
  text.setSelectionRange(from, to);
  text.scrollTop = Math.max(0, (text.value.slice(0, from).split("\n").length - 4) * 18);
}

async function registered(signal) {
  const scene = sceneNow();
  const text = JSON.stringify(scene);
  if (sky?.text === text) return sky;
  const left = sky;
  const answer = await register(text, signal);
  // A sky that this page made and left before it was seen in full: nobody else can know it.
  if (left && left.isNew && !left.isShown && left.id !== answer.id) fetch(`/v1/skies/${left.id}`, { method: "DELETE" }).catch(() => {});
  sky = { ...answer, text, sent: scene, isShown: false };
  return sky;
}

// Small pictures while something moves: one request at a time, then the latest setting.
async function draft() {
  if (drafting) { again = true; return; }
  drafting = true;
  running.abort();
  running = new AbortController();
  const { signal } = running;
  try {
    const now = await registered(signal);
    const frame = await load(now, state, Math.min(DRAFT, Number(state.size)), state.time, signal);
    if (!signal.aborted) { show({ sky: now, a: frame, b: null, mixed: 0 }); showProblem($("problem"), null); showSun(frame.sun); }
  } catch (error) {
    if (!signal.aborted) failed(error);
  } finally {
    drafting = false;
    if (again) { again = false; draft(); }
  }
}

async function watchTables(id, signal) {
  const wait = (ms) => new Promise((done) => setTimeout(done, ms));
  await wait(800);
  while (!signal.aborted) {
    const { tables } = await askJson(`/v1/skies/${id}`, signal);
    if (tables.state === "ready") return;
    say(tables.state === "waiting" ? `Waiting in line for the optics of this droplet mix, place ${tables.place}` : `Computing the optics of this droplet mix, once: ${Math.round(100 * tables.progress)} %`);
    await wait(500);
  }
}

async function update() {
  again = false;
  running.abort();
  sharpening.abort();
  running = new AbortController();
  const { signal } = running;
  const start = performance.now();
  say("Rendering …");
  const done = new AbortController();
  try {
    const now = await registered(signal);
    watchTables(now.id, AbortSignal.any([signal, done.signal])).catch(() => {});
    const size = Number(state.size);
    const shown = frameNow();
    if (size > 128 && (!shown || shown.main.texture !== mainOf(state) || !shown.irradiance === (state.view === "ground"))) {
      const small = await load(now, state, DRAFT, state.time, signal);
      if (signal.aborted) return;
      show({ sky: now, a: small, b: null, mixed: 0 });
      showSun(small.sun);
    }
    const frame = await load(now, state, size, state.time, signal);
    const other = state.compare ? await loadOther(now, state, size, state.time, signal) : null;
    if (signal.aborted) return;
    now.isShown = true;
    show({ sky: now, a: frame, b: null, mixed: 0, other });
    showProblem($("problem"), null);
    showSun(frame.sun);
    const { main } = frame;
    say(`${main.texture} ${main.width} × ${main.height} in ${Math.round(performance.now() - start)} ms; the server: ${stagesOf(main) || "from memory"}` + (main.met ? "" : `; error expected ${Math.round(100 * main.expected)} %`));
    showRest(now);
    sharpen();
    await showPlans(now, frame.main, other?.main, signal);
  } catch (error) {
    if (!signal.aborted) failed(error);
  } finally {
    done.abort();
  }
}

// The server's own picture of the view, once it rests.
function sharpen() {
  clearTimeout(timers.sharp);
  sharpening.abort();
  if (state.view !== "dome" || !hasDome || play.playing || state.compare || Number(state.size) < 256) return;
  timers.sharp = setTimeout(async () => {
    sharpening = new AbortController();
    const { signal } = sharpening;
    const { width, height } = $("solid");
    const tall = Math.min(1080, height);
    try {
      const made = await loadSharp(sky, state, state.time, (width / height) * tall, tall, signal);
      if (!signal.aborted) show({ sharp: made });
    } catch (error) {
      if (!signal.aborted && error instanceof Refused) failed(error);
    }
  }, 500);
}

async function showPlans(now, main, other, signal) {
  const texture = mainOf(state);
  if (texture === "compass") return;
  const planOf = (b) => askJson(`/v1/skies/${now.id}/plan?${new URLSearchParams({ texture, ...queryOf(texture, state, state.size, state.time, b) })}`, signal);
  const plan = await planOf(false);
  showPlan($("plan"), plan);
  if (other) showCompared($("compared"), main, other, plan, await planOf(true));
  else $("compared").replaceChildren();
}

function showRest(now) {
  const query = (texture) => ({ ...queryOf(texture, { ...state, component: texture === "irradiance" ? state.component : "total" }, $("file-size").value, state.time),
    ...((texture === "sky" || texture === "compass") && state.axes !== "enu" ? { axes: state.axes } : {}) });
  showFiles($("files"), now, Number($("file-size").value), query);
  $("curl").textContent = commands(now, now.sent, query);
  if (document.activeElement !== $("scene")) $("scene").value = JSON.stringify(now.sent, null, 2);
  showForm(now.sent);
}

const clock = (utc) => (utc ? utc.slice(11, 16) : null);

function showSun(sun) {
  const [r, g, b] = sun.irradiance.horizontal;
  const klx = 0.2126 * r + 0.7152 * g + 0.0722 * b;
  $("sun-now").textContent = `${(90 - (sun.apparent_zenith_deg ?? sun.zenith_deg)).toFixed(1)}° above the horizon, azimuth ${sun.azimuth_deg.toFixed(1)}°; ${klx.toPrecision(3)}${sky && isPhysical(sky.sent) ? " klx" : ""} from the sun on a level plane at ${sun.irradiance.at}`;
  $("clock").textContent = timeText(sun.utc);
  const start = Date.parse(`${state.date}T${state.start}:00Z`);
  $("day").replaceChildren(...Object.entries(sun.day || {}).filter(([, at]) => typeof at === "string").map(([name, at]) => {
    const button = Object.assign(document.createElement("button"), { type: "button", textContent: `${name} ${clock(at)}` });
    button.addEventListener("click", () => set({ time: (((Date.parse(at) - start) / 1000) % 86400 + 86400) % 86400 }));
    return button;
  }));
}

function timeText(utc) {
  const time = Math.round(state.time);
  const since = [Math.floor(time / 3600), Math.floor(time / 60) % 60, time % 60].map((each) => String(each).padStart(2, "0")).join(":");
  return state.by === "place" && utc ? `${new Date(Date.parse(`${state.date}T${state.start}:00Z`) + 1000 * state.time).toISOString().slice(0, 16).replace("T", " ")} UTC` : since;
}

const play = player({
  fetchFrame: async (time, signal) => load(await registered(signal), state, Math.min(256, Number(state.size)), time, signal),
  onFrames: (a, b, mixed) => { show({ a, b, mixed, sky }); showSun(mixed < 0.5 ? a.sun : b.sun); },
  onEnd: (error) => { playButton(); failed(error); },
});

function playButton() { $("play").textContent = play.playing ? "Pause" : "Play"; }

function togglePlay() {
  if (play.playing) {
    play.stop();
    schedule(false);
  } else {
    running.abort();
    sharpening.abort();
    play.start(null);
    say("Playing; time waits where the server is late");
  }
  playButton();
}

function schedule(isMoving) {
  clearTimeout(timers.rest);
  if (isMoving) draft();
  timers.rest = setTimeout(update, isMoving ? REST_MS : 60);
}

// Controls show the state; `data-key` names what of it.
function showControls() {
  for (const control of document.querySelectorAll("[data-key]")) {
    const value = state[control.dataset.key];
    if (control.type === "checkbox") control.checked = value;
    else if (control.type === "radio") control.checked = control.value === value;
    else if (document.activeElement !== control || control.type === "range") control.value = value;
  }
  for (const out of document.querySelectorAll("[data-of]")) out.textContent = { ev: state.ev, stops: `${state.stops > 0 ? "+" : ""}${state.stops}` }[out.dataset.of] ?? `${state[out.dataset.of]}°`;
  for (const attribute of ["by", "expose"]) for (const part of document.querySelectorAll(`[data-${attribute}]`)) part.hidden = part.dataset[attribute] !== state[attribute];
  for (const part of document.querySelectorAll("[data-for]")) part.hidden = part.dataset.for !== state.view || (part.dataset.texture ?? state.texture) !== state.texture;
  $("preset").value = state.scene ? "" : state.preset;
  $("time").max = state.by === "place" ? 86400 : 7200;
  $("time").value = state.time;
  const isMap = state.view === "maps";
  $("flat").hidden = !isMap;
  $("solid").hidden = isMap;
  for (const id of ["wipe", "side-a", "side-b"]) $(id).hidden = !state.compare;
  canvasNow().setAttribute("aria-label", { dome: "The sky. Arrow keys turn, plus and minus change the field of view", ground: "The ground under the clouds. Arrow keys turn, plus and minus come nearer and farther", maps: `Map of ${state.texture}. Arrow keys move it, Shift and arrows the cross` }[state.view]);
}

function readControl({ target }) {
  const { key } = target.dataset;
  if (!key) return;
  if (target.type === "radio" && !target.checked) return;
  let value = target.type === "checkbox" ? target.checked : target.value;
  if (["range", "number"].includes(target.type) || key === "speed") value = Number(value);
  if (target.type === "number" && (target.value === "" || !target.checkValidity())) return void target.setAttribute("aria-invalid", "true");
  if (["date", "time"].includes(target.type) && !value) return;
  target.removeAttribute("aria-invalid");
  set({ [key]: value });
}

// From the text, or from a field of the form, which leaves the time as it is.
async function useScene(isField) {
  const text = $("scene").value;
  const box = $("scene-wrong");
  try {
    const answer = await register(text);
    showProblem(box, null);
    set({ scene: JSON.stringify(JSON.parse(text)), preset: "", ...sunOf(answer.scene), ...(isField ? {} : { time: 0 }) });
  } catch (error) {
    failed(error, box);
    if (isField) return;
    const place = error instanceof Refused && (placeOf(text, error.problem.errors?.[0]?.pointer || "") || placeOfLine(text, error.problem.detail));
    $("scene").setAttribute("aria-invalid", "true");
    if (place) { $("scene").focus(); $("scene").setSelectionRange(...place); $("scene").scrollTop = Math.max(0, (text.slice(0, place[0]).split("\n").length - 4) * 18); }
  }
}

let showForm = () => {};
let editing = 0;
function fieldChanged(scene) {
  $("scene").value = JSON.stringify(scene, null, 2);
  clearTimeout(editing);
  editing = setTimeout(() => useScene(true), 300);
}

let measuring = null;
async function measure() {
  if (measuring) return measuring.abort();
  measuring = new AbortController();
  const { signal } = measuring;
  $("measure").textContent = "Stop";
  try {
    const now = await registered(signal);
    const { width, height } = canvasNow();
    await measureView(now, state, width / height, (points, all) => {
      for (const id of ["tradeoff", "ways-box"]) $(id).removeAttribute("hidden");
      drawTradeoff($("tradeoff"), $("ways"), points);
      $("measured").textContent = `${points.length} of ${all}. Full: the error that the plan expects; rings: how far from the finest of these this view is, rms. Each at a moment of its own, from nothing.`;
    }, signal);
  } catch (error) {
    if (!signal.aborted) failed(error);
  }
  measuring = null;
  $("measure").textContent = "Measure this view by every method";
}

function choose(name) {
  set({ preset: name, scene: "" });
  set({ ...sunOf(original()), time: original().sun?.utc ? 6 * 3600 : 0 });
}

function fillMethods() {
  const lists = { tolerance: ["", "0.005", "0.02", "0.05", "0.1", "0.3", "1"], method: ["", "forward", "analytic", "tabulated"], transport: ["", "columns", "tilted", "entry", "blended", "lattice"],
    cumulus: ["", "lattice", "octaves", "forward", "shader", "shader3"], air: ["", "single", "isotropic", "second-order"] };
  for (const [name, values] of Object.entries(lists)) for (const b of ["", "B"]) {
    const label = document.createElement("label");
    const select = document.createElement("select");
    select.dataset.key = name + b;
    for (const value of values) select.append(new Option(value || ({ tolerance: "0.02", air: "moments" }[name] ?? "by tolerance"), value));
    label.append(`${b || "A"}: ${name}`, select);
    $("methods").append(label);
  }
}

function listen() {
  for (const part of [$("panel"), document.querySelector(".show"), $("views")]) part.addEventListener("input", readControl);
  $("panel").addEventListener("submit", (event) => event.preventDefault());
  $("preset").addEventListener("change", () => choose($("preset").value));
  $("play").addEventListener("click", togglePlay);
  $("nearer").addEventListener("click", () => nearer(1.25));
  $("farther").addEventListener("click", () => nearer(0.8));
  $("reset").addEventListener("click", resetView);
  $("measure").addEventListener("click", measure);
  $("use").addEventListener("click", () => useScene(false));
  $("undo").addEventListener("click", () => { showProblem($("scene-wrong"), null); $("scene").value = JSON.stringify(sceneNow(), null, 2); showForm(sceneNow()); });
  $("scene").addEventListener("keydown", (event) => { if (event.key === "Enter" && (event.ctrlKey || event.metaKey)) useScene(false); });
  $("file-size").addEventListener("change", () => sky && showRest(sky));
  $("copy").addEventListener("click", async () => {
    await navigator.clipboard.writeText($("curl").textContent);
    $("copy").textContent = "Copied";
    setTimeout(() => { $("copy").textContent = "Copy"; }, 1200);
  });
  for (const id of ["solid", "flat"]) {
    hands($(id), { mapSide, onPoint: point, onCross: moveCross, onPlay: togglePlay });
    for (const event of ["focus", "blur"]) $(id).addEventListener(event, repaint);
  }
  sunHand($("sun-handle"), $("stage"), () => {});
  new ResizeObserver(() => { repaint(); sharpen(); }).observe($("stage"));
  $("solid").addEventListener("webglcontextlost", () => location.reload());
  onChange((changed) => {
    showControls();
    repaint();
    if (changed.some((key) => key === "axes") && sky) showRest(sky);
    if (changed.some((key) => CAMERA.has(key))) sharpen();
    const asks = changed.filter((key) => !QUIET.has(key) && !(play.playing && key === "time"));
    if (!asks.length) return;
    if (play.playing) { play.stop(); play.start(null); return; }
    schedule(asks.every((key) => ["zenith", "azimuth", "time"].includes(key)));
  });
}

function tell(gone) {
  $("dead").hidden = !gone;
  if (gone) $("dead").textContent = `The server has not answered since ${gone.toLocaleTimeString()}. What you see is what it last sent; this page asks again every second.`;
  if (!gone && !wasAlive) update();
  wasAlive = !gone;
}

async function start() {
  fillMethods();
  const found = readAddress();
  if (!hasDome) {
    $("plain").hidden = false;
    $("plain").textContent = "This browser has no WebGL2: the sky and the ground in three dimensions are not shown. All textures are there as maps; the sky too.";
    for (const input of document.querySelectorAll("#views input:not([value=maps])")) input.disabled = true;
    found.view = "maps";
    found.texture ||= "sky";
  } else if (!hasGround) {
    document.querySelector("#views input[value=ground]").disabled = true;
    if (found.view === "ground") found.view = "dome";
  }
  try {
    const [presets, limits, schema] = await Promise.all([askJson("/v1/presets"), askJson("/v1/limits"), askJson("/v1/schema/scene.json")]);
    showForm = sceneForm($("form"), schema, fieldChanged);
    setTextures(limits.textures);
    setPresets(presets);
    for (const { name, title } of presets) $("preset").append(new Option(title, name));
    const edited = Object.assign(new Option("edited", ""), { disabled: true });
    $("preset").append(edited);
    const first = presets.find(({ name }) => name === "fair-weather") || presets[0];
    Object.assign(state, { preset: found.preset || first.name });
    if (found.scene) try { JSON.parse(found.scene); state.scene = found.scene; } catch { delete found.scene; }
    Object.assign(state, sunOf(state.scene ? JSON.parse(state.scene) : original()), found);
    if (!state.by) state.by = "direction";
    // The first look goes to the sun's side of the sky, the sun beside the middle.
    if (found.yaw === undefined && state.by === "direction") state.yaw = (state.azimuth + 332) % 360;
    listen();
    showControls();
    $("scene").value = JSON.stringify(sceneNow(), null, 2);
    watch(tell);
    askJson("/health/ready").then(({ adapter }) => { $("device").textContent = `on ${adapter.name}`; }, () => { $("device").textContent = "not ready to render"; });
    update();
  } catch (error) {
    failed(error);
    watch(tell);
  }
}

start();
