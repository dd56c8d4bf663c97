// Speed against accuracy of the very view: it is rendered by one method after another at a moment of its own each, so that nothing is at hand,
// and each one's time stands against the error that the plan expects of it and against how far it is from the finest of them.
import { picture } from "./ask.js";
import { mainOf, methodsOf, queryOf } from "./load.js";
import { digits } from "./light.js";
import { difference, percent, tableOf } from "./panels.js";
import { isPhysical, layersOf } from "./scene.js";

const SIDE = 192;
// Seconds between two of them: what moves is about where it was. A page begins somewhere within four seconds, as the server keeps what others asked for.
const APART_S = 0.001;
let moments = Math.floor(4000 * Math.random());

const words = (query) => Object.entries(query).map(([name, value]) => `${name} ${value}`).join(", ") || "default";

function ways(scene, texture, state) {
  const layers = layersOf(scene);
  const all = [["A", methodsOf(state, false)], ...(state.compare ? [["B", methodsOf(state, true)]] : []), ["", {}]];
  const add = (name, values) => values.forEach((value) => all.push(["", { [name]: value }]));
  add("tolerance", ["1", "0.3", "0.1", "0.05", "0.005"]);
  if (layers.some(({ kind }) => kind !== "cumulus")) add("transport", ["columns", "tilted", "entry", "blended", "lattice"]);
  if (texture === "cloud" || texture === "sky") {
    if (layers.length) add("method", ["forward", "analytic"]);
    if (layers.some(({ kind }) => kind === "cumulus")) add("cumulus", ["shader3", "shader", "forward", "octaves"]);
  }
  if (texture !== "shadow" && isPhysical(scene)) add("air", ["single", "isotropic", "second-order"]);
  const seen = new Map();
  for (const [side, query] of all) {
    const known = seen.get(words(query));
    if (known) known.side ||= side; else seen.set(words(query), { side, query, name: words(query) });
  }
  return [...seen.values()];
}

// Calls `onPoint(points, of)` after each.
export async function measureView(sky, state, aspect, onPoint, signal) {
  const texture = mainOf(state);
  const points = [];
  const all = ways(sky.scene, texture, state);
  for (const way of all) {
    const query = { ...queryOf(texture, { ...state, tolerance: "", method: "", transport: "", cumulus: "", air: "" }, Math.min(SIDE, Number(state.size)), state.time + ++moments * APART_S), ...way.query };
    if (state.view === "dome") Object.assign(query, { projection: "camera", look: `${state.yaw.toFixed(2)},${state.pitch.toFixed(2)}`, fov: state.fov.toFixed(2), aspect: aspect.toFixed(3) });
    const made = await picture(sky, texture, query, signal);
    const ms = made.timings.filter(([name]) => name !== "total").reduce((sum, [, part]) => sum + part, 0);
    points.push({ ...way, ms, expected: made.expected, made });
    const finest = points.reduce((best, each) => (each.expected <= best.expected ? each : best));
    for (const each of points) each.found = each === finest ? null : difference(finest.made, each.made).rms;
    onPoint(points, all.length);
  }
  return points;
}

export function drawTradeoff(svg, table, points) {
  const draw = (name, values, text) => {
    const made = document.createElementNS(svg.namespaceURI, name);
    for (const [key, value] of Object.entries(values)) made.setAttribute(key, value);
    if (text !== undefined) made.textContent = text;
    return made;
  };
  const WIDE = 320, HIGH = 220, LEFT = 44, LOW = 34;
  const range = (values) => [Math.min(...values) / 1.4, Math.max(...values) * 1.6];
  const errors = points.flatMap(({ expected, found }) => [expected, found]).filter((each) => each > 0);
  const times = range(points.map(({ ms }) => Math.max(0.1, ms)));
  const sizes = range(errors.length ? errors : [0.01, 0.1]);
  const on = ([low, high], value) => Math.log(Math.min(high, Math.max(low, value)) / low) / Math.log(high / low);
  const x = (ms) => LEFT + on(times, ms) * (WIDE - LEFT - 8);
  const y = (error) => HIGH - LOW - on(sizes, error) * (HIGH - LOW - 10);
  svg.setAttribute("viewBox", `0 0 ${WIDE} ${HIGH}`);
  // 1, 2 and 5 of each power of ten.
  const round = ([low, high]) => {
    const found = [];
    for (let unit = 10 ** Math.floor(Math.log10(low)); unit <= high; unit *= 10) found.push(...[1, 2, 5].map((each) => each * unit).filter((each) => each >= low && each <= high));
    return found;
  };
  const parts = [];
  for (const at of round(times)) parts.push(draw("line", { x1: x(at), x2: x(at), y1: 10, y2: HIGH - LOW, class: "grid" }), draw("text", { x: x(at), y: HIGH - LOW + 13, "text-anchor": "middle" }, digits(at)));
  for (const at of round(sizes)) parts.push(draw("line", { x1: LEFT, x2: WIDE - 8, y1: y(at), y2: y(at), class: "grid" }), draw("text", { x: LEFT - 4, y: y(at) + 4, "text-anchor": "end" }, percent(at)));
  parts.push(draw("text", { x: (LEFT + WIDE) / 2, y: HIGH - 4, "text-anchor": "middle" }, "milliseconds of the server"));
  points.forEach(({ ms, expected, found, side }, i) => {
    const strong = side ? " own" : "";
    if (found > 0) parts.push(draw("circle", { cx: x(ms), cy: y(found), r: 4, class: `ring${strong}` }));
    parts.push(draw("circle", { cx: x(ms), cy: y(expected), r: 4, class: `dot${strong}` }), draw("text", { x: x(ms) + 6, y: y(expected) + (i % 2 ? 14 : -5), class: "name" }, side || String(i + 1)));
  });
  svg.replaceChildren(...parts);
  svg.setAttribute("aria-label", `Time against error of ${points.length} ways to render this view; the table below has the numbers`);
  tableOf(table, ["Mark", "Way", "Time", "Expected", "From the finest"], points.map(({ side, name, ms, expected, found }, i) => [side || String(i + 1), name, `${digits(ms)} ms`, percent(expected), found === null ? "finest" : percent(found)]));
}
