// What a view needs of the server at one time: its pictures, and where the sun is.
import { askJson, picture } from "./ask.js";
import { albedoOf, layersOf, windOf } from "./scene.js";
import { RAD } from "./angles.js";

export const methodsOf = (state, b) => Object.fromEntries(["tolerance", "method", "transport", "cumulus", "air"]
  .map((name) => [name, state[b ? `${name}B` : name]]).filter(([, value]) => value !== ""));

export function queryOf(texture, state, size, time, b) {
  const query = { size, ...methodsOf(state, b) };
  if (time > 0) query.time = Number(time.toFixed(3));
  if (texture === "cloud" && state.side === "above") query.view = "above";
  if (texture === "irradiance" && state.component !== "total") query.component = state.component;
  if (texture === "sky" && state.eye !== "2") query.eye = `0,0,${state.eye}`;
  return query;
}

// The texture that stands for a view: of its plan, histogram and comparison.
export const mainOf = (state) => ({ dome: "sky", ground: state.ground === "shadow" ? "shadow" : "irradiance", maps: state.texture }[state.view]);

async function sunOf(sky, state, time, signal) {
  const sun = await askJson(`/v1/skies/${sky.id}/sun.json?time=${Number(time.toFixed(3))}`, signal);
  const apparent = (90 - (sun.apparent_zenith_deg ?? sun.zenith_deg)) * RAD;
  const { azimuth_deg } = sun;
  return { ...sun, radius: (sun.angular_diameter_deg * RAD) / 2, disc: [0, 0, 0],
    direction: [Math.cos(apparent) * Math.sin(azimuth_deg * RAD), Math.cos(apparent) * Math.cos(azimuth_deg * RAD), Math.sin(apparent)] };
}

// Radiance of the disc as it is seen from the middle of the ground: the beam that arrives there over its solid angle.
async function discOf(sky, state, sun, time, signal) {
  if (sun.zenith_deg > 90 || sun.radius < 1e-4) return [0, 0, 0];
  let beam = sun.irradiance.facing_the_sun;
  if (Number(state.eye) < 1000) {
    const direct = await picture(sky, "irradiance", { ...queryOf("", state, 1, time), component: "direct", peak: false }, signal);
    beam = [...direct.data].map((each) => each / Math.max(0.02, Math.cos(sun.zenith_deg * RAD)));
  }
  return beam.map((each) => Math.min(60000, each / (Math.PI * sun.radius ** 2)));
}

async function groundOf(sky, state, size, time, signal, b) {
  const { scene } = sky;
  const extent = scene.domain.extent_m;
  const ask = (texture, more = {}) => picture(sky, texture, { size, ...methodsOf(state, b), ...(time > 0 ? { time: Number(time.toFixed(3)) } : {}), ...more }, signal);
  const layers = Promise.all(layersOf(scene).map(async (layer, i) => {
    const [cloud, thickness] = await Promise.all([ask("cloud", { view: "above", layer: i }), ask("thickness", { layer: i })]);
    let most = 0;
    for (const each of thickness.data) most = Math.max(most, each);
    const base = layer.base_m ?? (layer.top_m !== undefined ? layer.top_m - most : 1000);
    return { cloud, thickness, base, wind: windOf(layer).map((each) => each / extent) };
  }));
  const [irradiance, shadow, around, made] = await Promise.all([ask("irradiance"), ask("shadow"), ask("sky", { size: Math.min(256, size), eye: "0,0,9000" }), layers]);
  return { irradiance, shadow, around, layers: made, metre: 1 / extent, albedo: albedoOf(scene), main: state.ground === "shadow" ? shadow : irradiance };
}

// One time of one view. `main` is the picture that is probed and measured.
export async function load(sky, state, size, time, signal) {
  const texture = mainOf(state);
  const withDisc = async () => {
    const sun = await sunOf(sky, state, time, signal);
    return state.view === "dome" ? { ...sun, disc: await discOf(sky, state, sun, time, signal) } : sun;
  };
  const pictures = async () => (state.view === "ground" ? groundOf(sky, state, size, time, signal)
    : { main: await picture(sky, texture, queryOf(texture, state, size, time), signal) });
  const [sun, made] = await Promise.all([withDisc(), pictures()]);
  return { time, size, sun, ...made };
}

// The same by the other methods.
export const loadOther = async (sky, state, size, time, signal) => ({ time, ...(state.view === "ground" ? await groundOf(sky, state, size, time, signal, true)
  : { main: await picture(sky, mainOf(state), queryOf(mainOf(state), state, size, time, true), signal) }) });

// The server's own picture of just what the dome shows, at the screen's resolution.
export async function loadSharp(sky, state, time, width, height, signal) {
  const query = { ...queryOf("sky", state, height, time), projection: "camera", look: `${state.yaw.toFixed(2)},${state.pitch.toFixed(2)}`, fov: state.fov.toFixed(2), aspect: (width / height).toFixed(5) };
  const made = await picture(sky, "sky", query, signal);
  made.clamp = true;
  return made;
}
