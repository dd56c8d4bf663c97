// The ground from above: its irradiance, with the clouds over it at their true height, blended in linear light.
import { GLSL } from "./light.js";
import { RAD, camera, dot } from "./angles.js";
import { PANORAMA, SCREEN } from "./dome.js";

const GRID = 144; // squares a side of the mesh of one layer
const TILES = 2.5; // half the side of the ground that is drawn, in domains

const BACK = `
uniform sampler2D around; uniform vec2 size; uniform vec3 right, up, ahead; uniform float slope;
out vec4 color;
${PANORAMA}
void main() {
  vec2 s = (2. * gl_FragCoord.xy / size - 1.) * vec2(size.x / size.y, 1.) * slope;
  color = vec4(texture(around, panorama(normalize(ahead + s.x * right + s.y * up))).rgb, 1.);
}`;

const GROUND_VERTEX = `
uniform mat4 matrix; out vec2 place;
void main() {
  place = (vec2(gl_VertexID & 1, gl_VertexID >> 1) * 2. - 1.) * ${TILES.toFixed(1)};
  gl_Position = matrix * vec4(place, 0., 1.);
}`;
const GROUND = `
uniform sampler2D first, second; uniform vec2 shiftA, shiftB; uniform vec3 albedo; uniform float mixed, mode, most;
in vec2 place; out vec4 color;
${GLSL}
void main() {
  vec2 uv = vec2(place.x + .5, .5 - place.y);
  vec3 e = mix(texture(first, uv - shiftA).rgb, texture(second, uv - shiftB).rgb, mixed);
  float y = mode > 1.5 ? e.r : dot(e, vec3(.2126, .7152, .0722));
  vec3 c = mode < .5 ? e * albedo / 3.14159265 : ramp(y / most);
  vec2 edge = max(abs(fract(place + .5) - .5) - .498, 0.) / .002;
  float r = length(place);
  if (mode > .5 && r > .9) c *= .55;
  color = vec4(c, 1.) * (1. - smoothstep(1.5, 2.45, r));
}`;

const CLOUD_VERTEX = `
uniform mat4 matrix; uniform sampler2D thickA, thickB; uniform vec2 shiftA, shiftB; uniform float base, metre, mixed; out vec2 uv; out float r;
void main() {
  int square = gl_VertexID / 6, corner = gl_VertexID - 6 * square;
  vec2 at = vec2(square % ${GRID}, square / ${GRID}) + vec2(corner == 1 || corner == 3 || corner == 4, corner == 2 || corner == 4 || corner == 5);
  vec2 p = at / ${GRID}. - .5;
  uv = vec2(p.x + .5, .5 - p.y);
  vec2 place = p + vec2(gl_InstanceID % 3 - 1, gl_InstanceID / 3 - 1);
  r = length(place);
  float thick = mix(textureLod(thickA, uv - shiftA, 0.).r, textureLod(thickB, uv - shiftB, 0.).r, mixed);
  gl_Position = matrix * vec4(place, (base + thick) * metre, 1.);
}`;
const CLOUD = `
uniform sampler2D first, second; uniform vec2 shiftA, shiftB; uniform float mixed, faint;
in vec2 uv; in float r; out vec4 color;
void main() {
  vec4 c = mix(texture(first, uv - shiftA), texture(second, uv - shiftB), mixed);
  c = faint > .5 ? vec4(c.a * .22) : c;
  if (c.a < .004) discard;
  color = c * (1. - smoothstep(1.1, 1.6, r));
}`;

const SHOW = `
uniform sampler2D scene; uniform vec2 size; uniform float gain, plain, edge; out vec4 color;
${GLSL}
void main() {
  vec3 c = texture(scene, gl_FragCoord.xy / size).rgb;
  color = vec4((plain > .5 ? c : film(c * gain)) + (fall(gl_FragCoord.xy) - .5) / 255., 1.);
  if (abs(gl_FragCoord.x - edge) < 1.) color = vec4(1.);
}`;

// A matrix from metres of the domain (in units of its side) to the screen.
function look({ turn, tilt, away }, aspect) {
  const { right, up, ahead } = camera(turn, -tilt);
  const eye = ahead.map((each) => -each * away);
  const f = 1 / Math.tan(20 * RAD);
  const near = 0.02, far = 12;
  const rows = [[right, f / aspect], [up, f]].map(([axis, k]) => [...axis.map((each) => each * k), -dot(axis, eye) * k]);
  const depth = (far + near) / (far - near);
  const z = [...ahead.map((each) => each * depth), -dot(ahead, eye) * depth - (2 * far * near) / (far - near)];
  const w = [...ahead, -dot(ahead, eye)];
  return { matrix: new Float32Array([0, 1, 2, 3].flatMap((i) => [rows[0][i], rows[1][i], z[i], w[i]])), right, up, ahead, eye };
}

// Where a place of the picture lies on the ground, in domains east and north of the middle; null above the horizon.
export function groundAt(x, y, view, aspect) {
  const { right, up, ahead, eye } = look(view, aspect);
  const slope = Math.tan(20 * RAD);
  const d = ahead.map((each, i) => each + (2 * x - 1) * aspect * slope * right[i] + (1 - 2 * y) * slope * up[i]);
  return d[2] < -1e-3 ? [eye[0] - (d[0] * eye[2]) / d[2], eye[1] - (d[1] * eye[2]) / d[2]] : null;
}

export function ground({ gl, program }) {
  if (!gl.getExtension("EXT_color_buffer_float") && !gl.getExtension("EXT_color_buffer_half_float")) return null;
  const [back, floor, cloud, show] = [program(SCREEN, BACK), program(GROUND_VERTEX, GROUND), program(CLOUD_VERTEX, CLOUD), program(SCREEN, SHOW)];
  const target = gl.createFramebuffer();
  const depth = gl.createRenderbuffer();
  let light = null;
  let held = [0, 0];
  function resize(width, height) {
    if (held[0] === width && held[1] === height) return;
    held = [width, height];
    gl.deleteTexture(light);
    light = gl.createTexture();
    gl.bindTexture(gl.TEXTURE_2D, light);
    gl.texStorage2D(gl.TEXTURE_2D, 1, gl.RGBA16F, width, height);
    gl.texParameteri(gl.TEXTURE_2D, gl.TEXTURE_MIN_FILTER, gl.NEAREST);
    gl.texParameteri(gl.TEXTURE_2D, gl.TEXTURE_MAG_FILTER, gl.NEAREST);
    gl.bindRenderbuffer(gl.RENDERBUFFER, depth);
    gl.renderbufferStorage(gl.RENDERBUFFER, gl.DEPTH_COMPONENT24, width, height);
    gl.bindFramebuffer(gl.FRAMEBUFFER, target);
    gl.framebufferTexture2D(gl.FRAMEBUFFER, gl.COLOR_ATTACHMENT0, gl.TEXTURE_2D, light, 0);
    gl.framebufferRenderbuffer(gl.FRAMEBUFFER, gl.DEPTH_ATTACHMENT, gl.RENDERBUFFER, depth);
  }
  // With `from` it is drawn on the right of that part of the width alone, with a line there.
  return ({ a, b, mixed, from, gain, most, mode, clouds, albedo, view, width, height }) => {
    const { matrix, right, up, ahead } = look(view, width / height);
    const second = b || a;
    const [floorA, floorB] = mode === 2 ? [a.shadow, second.shadow] : [a.irradiance, second.irradiance];
    resize(width, height);
    gl.bindFramebuffer(gl.FRAMEBUFFER, target);
    gl.viewport(0, 0, width, height);
    gl.disable(gl.DEPTH_TEST);
    gl.disable(gl.BLEND);
    gl.clearColor(0.02, 0.03, 0.05, 1);
    gl.clear(gl.COLOR_BUFFER_BIT | gl.DEPTH_BUFFER_BIT);
    if (mode === 0) {
      back({ around: a.around, size: [width, height], right, up, ahead, slope: Math.tan(20 * RAD) });
      gl.drawArrays(gl.TRIANGLES, 0, 3);
    }
    gl.enable(gl.BLEND);
    gl.blendFunc(gl.ONE, gl.ONE_MINUS_SRC_ALPHA);
    // Clouds of both times are moved by the wind to where they are now, so that they fade without a ghost.
    const shifts = (wind) => ({ shiftA: wind.map((each, i) => (i ? -1 : 1) * each * a.since), shiftB: wind.map((each, i) => (i ? -1 : 1) * each * second.since) });
    floor({ matrix, first: floorA, second: floorB, ...shifts(a.layers[0]?.wind || [0, 0]), albedo, mixed, mode, most });
    gl.drawArrays(gl.TRIANGLE_STRIP, 0, 4);
    if (clouds) {
      gl.enable(gl.DEPTH_TEST);
      gl.depthFunc(gl.LEQUAL);
      a.layers.forEach((layer, i) => {
        const next = second.layers[i] || layer;
        cloud({ matrix, first: layer.cloud, second: next.cloud, thickA: layer.thickness, thickB: next.thickness, ...shifts(layer.wind), base: layer.base, metre: a.metre, mixed, faint: mode ? 1 : 0 });
        gl.drawArraysInstanced(gl.TRIANGLES, 0, 6 * GRID * GRID, 9);
      });
    }
    gl.bindFramebuffer(gl.FRAMEBUFFER, null);
    gl.disable(gl.DEPTH_TEST);
    gl.disable(gl.BLEND);
    const edge = from === undefined ? -9 : Math.round(from * width);
    if (from !== undefined) {
      gl.enable(gl.SCISSOR_TEST);
      gl.scissor(Math.max(0, edge - 1), 0, width, height);
    }
    show({ size: [width, height], gain, plain: mode ? 1 : 0, edge });
    gl.activeTexture(gl.TEXTURE0);
    gl.bindTexture(gl.TEXTURE_2D, light);
    gl.drawArrays(gl.TRIANGLES, 0, 3);
    gl.disable(gl.SCISSOR_TEST);
  };
}
