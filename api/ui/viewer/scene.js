// The scene that is sent: the preset or the edited one, with the sun of the controls.
import { state } from "./state.js";

let presets = [];

export const setPresets = (all) => { presets = all; };
const preset = () => presets.find((each) => each.name === state.preset) || presets[0];
export const original = () => structuredClone(preset().scene);
const base = () => (state.scene ? JSON.parse(state.scene) : original());

export function sceneNow() {
  const scene = base();
  const { angular_diameter_deg, altitude_m } = scene.sun || {};
  scene.sun = state.by === "place"
    ? { latitude_deg: state.lat, longitude_deg: state.lon, utc: `${state.date}T${state.start}:00Z` }
    : { zenith_deg: state.zenith, azimuth_deg: state.azimuth };
  if (angular_diameter_deg !== undefined) scene.sun.angular_diameter_deg = angular_diameter_deg;
  if (altitude_m !== undefined && state.by === "place") scene.sun.altitude_m = altitude_m;
  return scene;
}

// The sun's controls as a scene has them.
export function sunOf(scene) {
  const sun = scene.sun || {};
  if (sun.latitude_deg !== undefined && sun.utc) {
    const utc = new Date(sun.utc).toISOString();
    return { by: "place", lat: sun.latitude_deg, lon: sun.longitude_deg, date: utc.slice(0, 10), start: utc.slice(11, 16) };
  }
  return { by: "direction", zenith: sun.zenith_deg ?? 50, azimuth: (((sun.azimuth_deg ?? 180) % 360) + 360) % 360 };
}

export const isPhysical = (scene) => !Array.isArray(scene.atmosphere?.sun);
export const layersOf = (scene) => scene.layers || [];
export const albedoOf = (scene) => { const a = scene.ground?.albedo; return Array.isArray(a) ? a : typeof a === "number" ? [a, a, a] : [0.2, 0.2, 0.2]; };

// Metres a second towards east and north of the lowest layer's clouds.
export function windOf(layer) {
  const { speed_m_s = 0, from_deg = 270 } = layer?.wind || {};
  const angle = (from_deg * Math.PI) / 180;
  return [-speed_m_s * Math.sin(angle), -speed_m_s * Math.cos(angle)];
}
