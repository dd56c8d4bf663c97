// Light to screen: how bright a picture is shown, the tone curve, false colour. What the shaders do is here a second time for
// flat maps, which need no WebGL.

export const luminance = (r, g, b) => 0.2126 * r + 0.7152 * g + 0.0722 * b;

// Stops of the histogram below and above 1 kcd/m2.
const LOW = -16, HIGH = 12, STEPS = 112;

// Mean of the logarithm, range and histogram of a picture's light; of a panorama the upper half, weighted by solid angle.
export function lookAt(picture) {
  const { data, width, height, channels, texture } = picture;
  const isSky = texture === "sky" && width === 2 * height;
  const rows = isSky ? height / 2 : height;
  const step = Math.max(1, Math.floor((width * rows) / 60000));
  const bins = new Float64Array(STEPS);
  const seen = [];
  let sum = 0, weights = 0;
  for (let i = 0; i < width * rows; i += step) {
    const at = i * channels;
    const value = channels < 3 ? data[at] : luminance(data[at], data[at + 1], data[at + 2]);
    if (!(value > 0)) continue;
    const weight = isSky ? Math.cos((0.5 - (Math.floor(i / width) + 0.5) / height) * Math.PI) : 1;
    const stops = Math.log2(value);
    sum += weight * stops;
    weights += weight;
    seen.push(value);
    bins[Math.min(STEPS - 1, Math.max(0, Math.floor(((stops - LOW) / (HIGH - LOW)) * STEPS)))] += weight;
  }
  seen.sort((a, b) => a - b);
  const part = (p) => seen[Math.min(seen.length - 1, Math.floor(p * seen.length))] || 0;
  return { mean: weights ? 2 ** (sum / weights) : 0, low: part(0.005), middle: part(0.5), high: part(0.995), most: part(1), bins, LOW, HIGH };
}

// The eye adapts, but not wholly: noon looks brighter than dusk. Key of Krawczyk et al. (2005) by the mean luminance in cd/m2.
const key = (mean) => 1.03 - 2 / (2 + Math.log10(1000 * mean + 1));

// The factor from kcd/m2 to the screen's linear light before the tone curve.
export function gainOf({ expose, ev, stops }, mean) {
  const gain = expose === "fixed" ? 1000 / (1.2 * 2 ** ev) : 0.36 * key(mean) / Math.max(mean, 1e-9);
  return gain * 2 ** stops;
}
export const evOf = (gain) => Math.log2(1000 / (1.2 * gain));

// What one unit of a texture is in radiance of a white surface; null: it is no light.
export const asRadiance = (texture) => ({ cloud: 1, sky: 1, irradiance: 1 / Math.PI }[texture] ?? null);
export const unitOf = (texture, isPhysical) => {
  const light = isPhysical ? { cloud: "kcd/m²", sky: "kcd/m²", irradiance: "klx" } : { cloud: "units of light/sr", sky: "units of light/sr", irradiance: "units of light" };
  return light[texture] ?? { shadow: "of the beam", thickness: "m" }[texture] ?? "";
};

// Filmic: a fit by Narkowicz (2015), with what is far brighter than white losing its colour as on film.
export const GLSL = `
vec3 film(vec3 c) {
  float l = dot(c, vec3(.2126, .7152, .0722));
  c = mix(c, vec3(l), smoothstep(1., 12., l) * .6);
  c = clamp(c * (2.51 * c + .03) / (c * (2.43 * c + .59) + .14), 0., 1.);
  return mix(12.92 * c, 1.055 * pow(c, vec3(1. / 2.4)) - .055, step(.0031308, c));
}
vec3 ramp(float t) {
  t = clamp(t, 0., 1.);
  vec3 c0 = vec3(.2777, .0054, .3341), c1 = vec3(.1051, 1.4046, 1.3846), c2 = vec3(-.3309, .2148, .0951),
    c3 = vec3(-4.6342, -5.7991, -19.3324), c4 = vec3(6.2283, 14.1799, 56.6906), c5 = vec3(4.7764, -13.7451, -65.3530), c6 = vec3(-5.4355, 4.6459, 26.3124);
  return clamp(c0 + t * (c1 + t * (c2 + t * (c3 + t * (c4 + t * (c5 + t * c6))))), 0., 1.);
}
float fall(vec2 p) { return fract(52.9829189 * fract(dot(p, vec2(.06711056, .00583715)))); }
`;

const CURVE = new Uint8ClampedArray(4096); // linear light from 0 to 16, by its fourth root: fine in the dark
for (let i = 0; i < 4096; i++) {
  const x = 16 * (i / 4095) ** 4;
  const c = Math.min(1, (x * (2.51 * x + 0.03)) / (x * (2.43 * x + 0.59) + 0.14));
  CURVE[i] = Math.round(255 * (c <= 0.0031308 ? 12.92 * c : 1.055 * c ** (1 / 2.4) - 0.055));
}
export const film = (x) => CURVE[Math.min(4095, Math.floor(4095 * Math.sqrt(Math.sqrt(Math.max(0, x) / 16))))];

// Viridis, as a polynomial (Zucker), like the shader's.
const VIRIDIS = [[0.2777, 0.0054, 0.3341], [0.1051, 1.4046, 1.3846], [-0.3309, 0.2148, 0.0951], [-4.6342, -5.7991, -19.3324], [6.2283, 14.1799, 56.6906], [4.7764, -13.7451, -65.353], [-5.4355, 4.6459, 26.3124]];
export const RAMP = new Uint8ClampedArray(256 * 3);
for (let i = 0; i < 256; i++) for (let c = 0; c < 3; c++) RAMP[3 * i + c] = 255 * VIRIDIS.reduceRight((sum, k) => sum * (i / 255) + k[c], 0);

// The range that false colour spans, on round numbers.
export function rangeOf(texture, seen) {
  if (texture === "shadow") return [0, 1];
  const round = (x) => { const unit = 10 ** Math.floor(Math.log10(x || 1)); return [1, 1.5, 2, 3, 4, 5, 6, 8, 10].map((k) => k * unit).find((k) => k >= x * 0.999); };
  return [0, round(seen.high || 1)];
}

export const digits = (x) => (x === 0 ? "0" : Math.abs(x) >= 1000 ? Math.round(x).toLocaleString("en") : Math.abs(x) >= 0.001 ? Number(x.toPrecision(3)).toString() : x.toExponential(1));
