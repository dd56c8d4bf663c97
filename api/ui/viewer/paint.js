// What is on the screen: the view's pictures, the legend, the sun's handle, the points of the compass, what is under the pointer.
import { state } from "./state.js";
import { asRadiance, digits, evOf, gainOf, lookAt, luminance, rangeOf, unitOf } from "./light.js";
import { azimuthOf, clamp, direction, elevationOf } from "./angles.js";
import { directionAt, dome, project, radianceTowards } from "./dome.js";
import { ground, groundAt } from "./ground.js";
import { context } from "./gl.js";
import { drawMap, layout, valueAt } from "./maps.js";
import { drawHistogram, drawLegend } from "./panels.js";
import { albedoOf, isPhysical } from "./scene.js";

const $ = (id) => document.getElementById(id);
const still = matchMedia("(prefers-reduced-motion: reduce)");
const gpu = context($("solid"));
const drawDome = gpu && dome(gpu);
const drawGround = gpu && ground(gpu);
const seen = new WeakMap();

export const hasDome = Boolean(drawDome);
export const hasGround = Boolean(drawGround);
const shown = { a: null, b: null, mixed: 0, sharp: null, sharpAt: "", since: 0, other: null, sky: null };
let adapted = null; // the mean light that the eye has got used to
let cross = [0.5, 0.5];
let pointed = null;
let asked = false;

const statistics = (picture) => { if (!seen.has(picture)) seen.set(picture, lookAt(picture)); return seen.get(picture); };
const sharpKey = () => [state.yaw, state.pitch, state.fov, $("solid").width, $("solid").height, shown.a?.main.query.tolerance].join();
export const canvasNow = () => $(state.view === "maps" ? "flat" : "solid");

export function show(values) {
  if (values.a && values.a !== shown.a) { shown.sharp = null; shown.other = values.other ?? null; }
  Object.assign(shown, values);
  if (values.sharp) { shown.sharpAt = sharpKey(); shown.since = performance.now(); }
  repaint();
}
export const frameNow = () => shown.a;
// Until the pictures of another view have come, those of the one before stay.
const isOfView = () => shown.a && shown.sky && (state.view !== "ground" || shown.a.layers);

export function repaint() {
  if (asked) return;
  asked = true;
  requestAnimationFrame(() => { asked = false; paint(); });
}

function fit(canvas) {
  const scale = Math.min(2, window.devicePixelRatio || 1);
  const [width, height] = [Math.max(1, Math.round(canvas.clientWidth * scale)), Math.max(1, Math.round(canvas.clientHeight * scale))];
  if (canvas.width !== width || canvas.height !== height) Object.assign(canvas, { width, height });
  return [width, height];
}

// The exposure of the present picture: of an adapting eye by its mean light, in kcd/m2 of a white surface.
function exposure() {
  const { main } = shown.a;
  const k = asRadiance(main.texture) ?? 1;
  let mean = statistics(main).mean * k;
  if (state.view === "ground") mean *= Math.max(0.08, luminance(...albedoOf(shown.sky.scene))) * 2;
  // In a running picture the eye follows slowly.
  adapted = adapted && shown.b ? adapted ** 0.97 * mean ** 0.03 : mean;
  return gainOf(state, adapted);
}

function paint() {
  if (!isOfView()) return;
  const { a, b, other } = shown;
  const mixed = still.matches ? Math.round(shown.mixed) : shown.mixed;
  const gain = exposure();
  const { texture } = a.main;
  const range = rangeOf(texture, statistics(a.main));
  const isPainted = state.view === "ground" ? state.ground !== "light" : texture === "thickness" || (state.paint && texture !== "compass");
  const canvas = canvasNow();
  const [width, height] = fit(canvas);
  const compared = state.compare && other;
  if (state.view === "dome" && drawDome) {
    const isSharp = shown.sharp && shown.sharpAt === sharpKey() && !b && !compared;
    const sharpness = isSharp ? (still.matches ? 1 : clamp((performance.now() - shown.since) / 300, 0, 1)) : 0;
    drawDome({ a: a.main, b: b?.main, mixed, sharp: shown.sharp, sharpness, other: compared ? other.main : null, wipe: state.wipe, sun: a.sun, gain, most: range[1], paint: isPainted, width, height, ...pick("yaw", "pitch", "fov") });
    if (isSharp && sharpness < 1) repaint();
  } else if (state.view === "ground" && drawGround) {
    const now = b ? a.time + mixed * (b.time - a.time) : a.time;
    a.since = now - a.time;
    if (b) b.since = now - b.time;
    const how = { gain, most: range[1], mode: { light: 0, irradiance: 1, shadow: 2 }[state.ground], clouds: state.clouds, albedo: albedoOf(shown.sky.scene), view: pick("turn", "tilt", "away"), width, height };
    drawGround({ a, b, mixed, ...how });
    if (compared && other.layers) {
      other.since = now - other.time;
      drawGround({ a: other, b: null, mixed: 0, from: state.wipe, ...how });
    }
  } else if (state.view === "maps") {
    const at = document.activeElement === canvas && canvas.matches(":focus-visible") ? cross : null;
    drawMap(canvas, { a: a.main, b: b?.main, mixed, other: compared ? other.main : null, wipe: state.wipe, look: pick("zoom", "mapX", "mapY"), how: { gain, paint: isPainted, range }, tiles: state.tiles, cross: at });
  }
  const unit = unitOf(texture, isPhysical(shown.sky.scene));
  $("legend").hidden = !isPainted;
  if (isPainted) drawLegend($("ramp"), $("ticks"), range, unit);
  overlays(width / height);
  probe();
  if (!b || Math.random() < 0.1) measures(gain, unit);
}

const pick = (...keys) => Object.fromEntries(keys.map((key) => [key, state[key]]));

function measures(gain, unit) {
  const { main } = shown.a;
  const k = asRadiance(main.texture);
  const numbers = statistics(main);
  drawHistogram($("histogram"), numbers, gain * (k ?? 1), unit, k !== null);
  $("exposure-now").textContent = `${main.texture}: half below ${digits(numbers.middle)}, most ${digits(numbers.most)} ${unit}` + (k === null ? "" : `. Shown as a camera at EV ${evOf(gain).toFixed(1)} would.`);
}

function overlays(aspect) {
  const isDome = state.view === "dome" && hasDome;
  const handle = $("sun-handle");
  const at = isDome && shown.a.sun ? project(shown.a.sun.direction, state, aspect) : null;
  const isSeen = at && at[0] > -0.02 && at[0] < 1.02 && at[1] > -0.02 && at[1] < 1.02;
  handle.hidden = !isDome;
  // Out of sight it stays at the edge, so that keys reach it and eyes find it.
  const behind = isDome && !isSeen && shown.a.sun ? clamp(0.5 + (((azimuthOf(shown.a.sun.direction) - state.yaw + 540) % 360) - 180) / 100, 0.03, 0.97) : 0.5;
  if (isDome) {
    handle.style.left = `${100 * (isSeen ? clamp(at[0], 0.02, 0.98) : behind)}%`;
    handle.style.top = `${100 * (isSeen ? clamp(at[1], 0.03, 0.97) : clamp(0.5 - (elevationOf(shown.a.sun.direction) - state.pitch) / state.fov, 0.05, 0.95))}%`;
  }
  const names = isDome ? ["N", "NE", "E", "SE", "S", "SW", "W", "NW"] : [];
  const marks = names.map((name, i) => [name, project(direction(45 * i, 1), state, aspect)]).filter(([, place]) => place && place[0] > 0.01 && place[0] < 0.99 && place[1] > 0.02 && place[1] < 0.98);
  $("cardinals").replaceChildren(...marks.map(([name, place]) => {
    const mark = Object.assign(document.createElement("span"), { textContent: name });
    mark.style.left = `${100 * place[0]}%`;
    mark.style.top = `${100 * place[1]}%`;
    return mark;
  }));
}

const values = (picture, numbers) => {
  const unit = unitOf(picture.texture, isPhysical(shown.sky.scene));
  if (numbers.length === 1) return `${digits(numbers[0])} ${unit}`;
  const [r, g, b, alpha] = numbers;
  return `${digits(luminance(r, g, b))} ${unit} (R ${digits(r)}, G ${digits(g)}, B ${digits(b)})${alpha === undefined ? "" : `, alpha ${digits(alpha)}`}`;
};

const metres = (x, names) => `${Math.abs(x) >= 1000 ? `${(Math.abs(x) / 1000).toFixed(2)} km` : `${Math.abs(Math.round(x))} m`} ${x >= 0 ? names[0] : names[1]}`;

// What is under the pointer, or without one in the middle (on a map: under the cross).
export function point(x, y) { pointed = x === null ? null : [x, y]; probe(); }
export function moveCross(dx, dy) {
  const { main } = shown.a;
  cross = [cross[0] + dx / Math.min(main.width, 64), cross[1] + dy / Math.min(main.height, 64)];
  pointed = null;
  repaint();
}

function probe() {
  if (!isOfView()) return;
  const [x, y] = pointed || [0.5, 0.5];
  const { main } = shown.a;
  const canvas = canvasNow();
  const aspect = canvas.clientWidth / canvas.clientHeight;
  const extent = shown.sky.scene.domain.extent_m;
  let text = "";
  const onGround = (u, v, picture, east, north) => `${metres(east * extent, ["east", "west"])}, ${metres(north * extent, ["north", "south"])}: ${values(picture, valueAt(picture, u, v))}`;
  if (state.view === "dome") {
    const d = directionAt(x, y, state, aspect);
    text = `azimuth ${azimuthOf(d).toFixed(1)}°, elevation ${elevationOf(d).toFixed(1)}°: ${values(main, radianceTowards(main, d))}`;
  } else if (state.view === "ground") {
    const at = groundAt(x, y, state, aspect);
    text = at ? `ground (seen towards ${Math.round(state.turn)}°), ${onGround(at[0] + 0.5, 0.5 - at[1], shown.a.irradiance, at[0], at[1])}, shadow ${digits(valueAt(shown.a.shadow, at[0] + 0.5, 0.5 - at[1])[0])}` : "above the horizon";
  } else {
    const { wide, high, left, top } = layout(main, state, canvas.width, canvas.height);
    const [u, v] = pointed ? [(x * canvas.width - left) / wide, (y * canvas.height - top) / high] : cross;
    if (!state.tiles && (u < 0 || u >= 1 || v < 0 || v >= 1)) text = "beside the map";
    else if (main.width === 2 * main.height) {
      const numbers = valueAt(main, u, clamp(v, 0, 0.9999));
      text = `azimuth ${(((u % 1) + 1) % 1 * 360).toFixed(1)}°, elevation ${(90 - 180 * clamp(v, 0, 1)).toFixed(1)}°: ${values(main, numbers)}`;
    } else text = onGround(u, v, main, u - 0.5, 0.5 - v);
  }
  const where = pointed ? "Pointer" : state.view === "maps" ? "Cross" : "Middle";
  $("probe").textContent = `${where}: ${text}`;
}

export const mapSide = () => {
  const canvas = $("flat");
  if (!shown.a) return [1, 1];
  const { wide, high } = layout(shown.a.main, state, canvas.width, canvas.height);
  return [wide / canvas.height, high / canvas.height];
};
