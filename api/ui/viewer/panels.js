// What stands beside the picture: histogram, legend, plan, comparison, files, commands. Each is drawn from what it is handed.
import { RAMP, digits } from "./light.js";

const cell = (name, text, small) => {
  const made = document.createElement(name);
  made.append(text);
  if (small) made.append(Object.assign(document.createElement("small"), { textContent: small }));
  return made;
};
const rowOf = (...cells) => { const row = document.createElement("tr"); row.append(...cells); return row; };
const headOf = (...names) => rowOf(...names.map((name) => Object.assign(cell("th", name), { scope: "col" })));

export function drawLegend(ramp, ticks, [low, high], unit) {
  const pen = ramp.getContext("2d");
  const image = new ImageData(256, 1);
  for (let i = 0; i < 256; i++) image.data.set([RAMP[3 * i], RAMP[3 * i + 1], RAMP[3 * i + 2], 255], 4 * i);
  pen.putImageData(image, 0, 0);
  ticks.replaceChildren(...[0, 0.25, 0.5, 0.75, 1].map((part) => Object.assign(document.createElement("span"), { textContent: digits(low + part * (high - low)) + (part === 1 ? ` ${unit}` : "") })));
}

// Light by stops; the line is what the screen shows as middle grey, the shade what it shows as white.
export function drawHistogram(canvas, seen, gain, unit, isLight) {
  const { width, height } = canvas;
  const pen = canvas.getContext("2d");
  const style = getComputedStyle(canvas);
  const colour = (name) => style.getPropertyValue(name);
  pen.clearRect(0, 0, width, height);
  const most = Math.max(...seen.bins, 1e-9);
  const used = [...seen.bins.keys()].filter((i) => seen.bins[i] > 0);
  if (!used.length) return void canvas.setAttribute("aria-label", "Histogram: all is black");
  const first = Math.max(0, used[0] - 4), last = Math.min(seen.bins.length - 1, used.at(-1) + 4);
  const perStop = seen.bins.length / (seen.HIGH - seen.LOW);
  const place = (value) => ((Math.log2(value) - seen.LOW) * perStop - first) / (last + 1 - first) * width;
  const floor = height - 16;
  if (isLight) {
    pen.fillStyle = colour("--line");
    const white = place(1 / gain);
    pen.fillRect(white, 0, width - white, floor);
  }
  pen.fillStyle = colour("--strong");
  const wide = width / (last + 1 - first);
  for (let i = first; i <= last; i++) pen.fillRect((i - first) * wide, floor - (seen.bins[i] / most) * floor, Math.max(1, wide - 0.5), (seen.bins[i] / most) * floor);
  pen.fillStyle = colour("--soft");
  pen.font = "11px system-ui";
  const decade = Math.max(1, Math.round((last - first) / perStop / 3.32 / 4));
  for (let e = -5; e <= 5; e += decade) {
    const x = place(10 ** e);
    if (x > 4 && x < width - 30) { pen.fillRect(x, floor, 1, 4); pen.fillText(digits(10 ** e), x + 3, height - 3); }
  }
  canvas.setAttribute("aria-label", `Histogram of luminance: half of the picture below ${digits(seen.middle)}, one in 200 above ${digits(seen.high)} ${unit}`);
}

export const tableOf = (table, names, rows) => table.replaceChildren(headOf(...names), ...rows.map((cells) => rowOf(...cells.map((each) => cell("td", each)))));

export const percent = (x) => (Number.isFinite(x) ? `${Number((100 * x).toPrecision(2))} %` : "–");

export function showPlan(table, plan) {
  table.replaceChildren(headOf(`Stage of ${plan.texture}`, "Choice", "Error"),
    ...plan.stages.map(({ stage, choice, reason, error }) => rowOf(cell("td", stage), cell("td", choice, reason), cell("td", percent(error)))),
    rowOf(cell("th", "all"), cell("td", plan.meets_tolerance ? `within the tolerance of ${plan.tolerance}` : `the best there is; the tolerance of ${plan.tolerance} is not met`), cell("td", percent(plan.expected_error))));
}

const costOf = ({ timings }) => {
  const stages = timings.filter(([name, ms]) => name !== "total" && ms > 0);
  return stages.length ? `${Math.round(stages.reduce((sum, [, ms]) => sum + ms, 0))} ms` : "from memory";
};
export const stagesOf = ({ timings }) => timings.filter(([, ms]) => ms >= 0.5).map(([name, ms]) => `${name} ${Math.round(ms)}`).join(" · ");

// How far B is from A: root mean square, relative to that of A, and in the mean, relative to the mean of A.
export function difference(a, b) {
  let square = 0, squares = 0, sum = 0, sums = 0;
  const weigh = a.texture === "sky" && a.width === 2 * a.height ? (i) => Math.cos((0.5 - (Math.floor(i / (3 * a.width)) + 0.5) / a.height) * Math.PI) : () => 1;
  for (let i = 0; i < a.data.length; i++) {
    const weight = weigh(i);
    const apart = a.data[i] - b.data[i];
    square += weight * apart ** 2;
    squares += weight * a.data[i] ** 2;
    sum += weight * Math.abs(apart);
    sums += weight * Math.abs(a.data[i]);
  }
  return { rms: Math.sqrt(square / squares), mean: sum / sums };
}

export function showCompared(table, a, b, planA, planB) {
  const choice = (plan, stage) => plan.stages.find((each) => each.stage === stage);
  const stages = [...new Set([...planA.stages, ...planB.stages].map(({ stage }) => stage))]
    .filter((stage) => choice(planA, stage)?.choice !== choice(planB, stage)?.choice);
  const { rms, mean } = difference(a, b);
  table.replaceChildren(headOf("Compared", "A", "B"),
    rowOf(cell("th", "Time of the server", "Server-Timing, without waiting"), cell("td", costOf(a), stagesOf(a)), cell("td", costOf(b), stagesOf(b))),
    rowOf(cell("th", "Error expected"), cell("td", percent(planA.expected_error)), cell("td", percent(planB.expected_error))),
    rowOf(cell("th", "B against A", "of this picture"), cell("td", "–"), cell("td", `${percent(mean)} in the mean`, `rms ${percent(rms)}; the brightest texels count most`)),
    ...stages.map((stage) => rowOf(cell("th", stage), ...[planA, planB].map((plan) => { const at = choice(plan, stage); return cell("td", at ? at.choice : "–", at ? percent(at.error) : ""); }))));
}

// What the server makes, and in which formats.
let textures = [];
export const setTextures = (all) => { textures = all; };
const bytes = (n) => (n > 1e6 ? `${(n / 1e6).toFixed(1)} MB` : `${Math.round(n / 1e3)} kB`);

export function showFiles(table, sky, size, queryOf) {
  const rows = textures.map(({ name: texture, channels, meaning, formats }) => {
    const wide = texture === "sky" || texture === "compass" ? 2 * size : size;
    const links = document.createElement("td");
    for (const format of formats) {
      const link = document.createElement("a");
      link.href = `/v1/skies/${sky.id}/${texture}.${format}?${new URLSearchParams(queryOf(texture))}`;
      link.download = `${texture}.${format}`;
      link.textContent = format;
      link.setAttribute("aria-label", `${texture} as ${format}`);
      links.append(link, " ");
    }
    return rowOf(cell("td", texture, meaning), cell("td", `${wide} × ${size}`, `floats ${bytes(wide * size * channels.length * 4)}`), links);
  });
  table.replaceChildren(headOf("Texture", "Texels", "Formats"), ...rows);
}

export function commands(sky, scene, queryOf) {
  const text = JSON.stringify(scene).replaceAll("'", "'\\''");
  const line = (texture, format) => `curl -o ${texture}.${format} '${location.origin}/v1/skies/${sky.id}/${texture}.${format}?${new URLSearchParams(queryOf(texture))}'`;
  return [`curl --json '${text}' ${location.origin}/v1/skies`, ...textures.map(({ name }) => line(name, "png")), line("cloud", "exr")].join("\n");
}
