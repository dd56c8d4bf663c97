// Flat maps on a plain canvas: no WebGL needed. Gaps between clouds show a dark checker, in light and dark pages alike.
import { RAMP, asRadiance, film, luminance } from "./light.js";
import { clamp } from "./angles.js";

const CHECKER = ["#1b2a45", "#24375a"];
const toned = new WeakMap();

// The picture as the screen shows it; kept until the exposure changes.
function tone(picture, { gain, paint, range }) {
  const how = `${gain} ${paint} ${range}`;
  const known = toned.get(picture);
  if (known?.how === how) return known.canvas;
  const { data, width, height, channels, texture } = picture;
  const canvas = known?.canvas || Object.assign(document.createElement("canvas"), { width, height });
  const image = new ImageData(width, height);
  const out = image.data;
  const isLight = asRadiance(texture) !== null;
  const factor = gain * (asRadiance(texture) ?? 0);
  for (let i = 0, from = 0, to = 0; i < width * height; i++, from += channels, to += 4) {
    const alpha = channels === 4 ? data[from + 3] : 1;
    out[to + 3] = 255 * clamp(alpha, 0, 1);
    if (texture !== "compass" && (paint || texture === "thickness")) {
      const value = channels < 3 ? data[from] : luminance(data[from], data[from + 1], data[from + 2]);
      const at = 3 * Math.round(255 * clamp((value - range[0]) / (range[1] - range[0]), 0, 1));
      out[to] = RAMP[at]; out[to + 1] = RAMP[at + 1]; out[to + 2] = RAMP[at + 2];
      if (texture === "thickness") out[to + 3] = value > 0 ? 255 : 0;
    } else if (isLight) {
      const k = alpha > 1e-4 ? factor / alpha : 0;
      for (let c = 0; c < 3; c++) out[to + c] = film(data[from + Math.min(c, channels - 1)] * k);
    } else {
      for (let c = 0; c < 3; c++) out[to + c] = 255 * Math.sqrt(clamp(data[from + Math.min(c, channels - 1)], 0, 1));
    }
  }
  canvas.getContext("2d").putImageData(image, 0, 0);
  toned.set(picture, { canvas, how });
  return canvas;
}

// How the map lies on the canvas: pixels of one map's width and height, and of its left upper corner.
export function layout(picture, { zoom, mapX, mapY }, width, height) {
  const shape = picture.width / picture.height;
  const side = Math.min(width / shape, height) * zoom;
  return { wide: side * shape, high: side, left: width / 2 - mapX * side * shape, top: height / 2 - mapY * side };
}

export function drawMap(canvas, { a, b, mixed, other, wipe, look, how, tiles, cross }) {
  const { width, height } = canvas;
  const pen = canvas.getContext("2d");
  const { wide, high, left, top } = layout(a, look, width, height);
  const cell = 14 * (window.devicePixelRatio || 1);
  pen.fillStyle = "#0d1420";
  pen.fillRect(0, 0, width, height);
  const isSky = a.width === 2 * a.height;
  const from = tiles ? Math.floor(-left / wide) : 0, to = tiles ? Math.ceil((width - left) / wide) - 1 : 0;
  const over = tiles && !isSky ? Math.floor(-top / high) : 0, under = tiles && !isSky ? Math.ceil((height - top) / high) - 1 : 0;
  pen.save();
  pen.beginPath();
  pen.rect(left + from * wide, top + over * high, (to - from + 1) * wide, (under - over + 1) * high);
  pen.clip();
  if (a.channels === 4 || a.texture === "thickness") {
    for (let y = 0; y < height; y += cell) for (let x = 0; x < width; x += cell) {
      pen.fillStyle = CHECKER[(x / cell + y / cell) & 1];
      pen.fillRect(x, y, cell, cell);
    }
  }
  pen.imageSmoothingEnabled = wide / a.width < 6;
  const lay = (picture) => {
    const image = tone(picture, how);
    for (let j = over; j <= under; j++) for (let i = from; i <= to; i++) pen.drawImage(image, left + i * wide, top + j * high, wide + 0.5, high + 0.5);
  };
  lay(a);
  if (b && b !== a && mixed > 0) {
    pen.globalAlpha = mixed;
    lay(b);
    pen.globalAlpha = 1;
  }
  if (other) {
    pen.beginPath();
    pen.rect(wipe * width, 0, width, height);
    pen.clip();
    pen.fillStyle = CHECKER[0];
    if (other.channels === 4) pen.fillRect(0, 0, width, height);
    lay(other);
  }
  pen.restore();
  pen.strokeStyle = "#fff8";
  if (tiles) pen.strokeRect(left, top, wide, high);
  if (other) { pen.fillStyle = "#fff"; pen.fillRect(wipe * width - 1, 0, 2, height); }
  if (cross) {
    const [x, y] = [left + cross[0] * wide, top + cross[1] * high];
    for (const [colour, line] of [["#000", 4], ["#fff", 2]]) {
      pen.strokeStyle = colour; pen.lineWidth = line;
      pen.beginPath();
      pen.moveTo(x - 14, y); pen.lineTo(x + 14, y); pen.moveTo(x, y - 14); pen.lineTo(x, y + 14);
      pen.stroke();
    }
    pen.lineWidth = 1;
  }
}

export function valueAt(picture, u, v) {
  const wrap = (x) => ((x % 1) + 1) % 1;
  const at = picture.channels * (Math.floor(wrap(v) * picture.height) * picture.width + Math.floor(wrap(u) * picture.width));
  return [...picture.data.subarray(at, at + picture.channels)];
}
