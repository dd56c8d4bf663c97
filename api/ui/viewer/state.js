// What the page shows, as one flat object. What differs from the defaults stands in the address bar.

const DEFAULTS = {
  preset: "", scene: "", by: "", zenith: 50, azimuth: 180, lat: 48.1, lon: 11.6, date: "2026-06-21", start: "04:00",
  time: 0, speed: 1, view: "dome", eye: "2", ground: "light", clouds: true, texture: "cloud", side: "below", component: "total", tiles: false, size: "512",
  expose: "auto", ev: 14, stops: 0, paint: false, compare: false, wipe: 0.5, axes: "enu",
  tolerance: "", method: "", transport: "", cumulus: "", air: "", toleranceB: "0.3", methodB: "", transportB: "", cumulusB: "", airB: "",
  yaw: 180, pitch: 22, fov: 75, turn: 20, tilt: 30, away: 1.1, zoom: 1, mapX: 0.5, mapY: 0.5,
};

export const state = { ...DEFAULTS };
const listeners = [];
let writing = 0;

export const onChange = (call) => listeners.push(call);

// `quiet` changes need no new picture of the server's.
export function set(values) {
  const changed = Object.keys(values).filter((key) => state[key] !== values[key]);
  if (!changed.length) return;
  Object.assign(state, values);
  for (const call of listeners) call(changed);
  clearTimeout(writing);
  writing = setTimeout(write, 300);
}

export const defaults = (...keys) => Object.fromEntries(keys.map((key) => [key, DEFAULTS[key]]));

function write() {
  const query = new URLSearchParams();
  for (const [key, value] of Object.entries(state)) if (value !== DEFAULTS[key]) query.set(key, typeof value === "number" ? Number(value.toFixed(4)) : value);
  history.replaceState(null, "", `#${query}`);
}

// Values of a wrong type or an unknown name are passed over: an address may have been cut or typed.
export function readAddress() {
  const found = {};
  for (const [key, text] of new URLSearchParams(location.hash.slice(1))) {
    const kind = typeof DEFAULTS[key];
    const value = kind === "number" ? Number(text) : kind === "boolean" ? text === "true" : text;
    if (kind !== "undefined" && !Number.isNaN(value)) found[key] = value;
  }
  return found;
}
