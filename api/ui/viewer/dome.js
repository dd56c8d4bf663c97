// The sky from within: the panorama on a dome, two times cross-faded, the sun's disc on it, and where the view rests the
// server's own sharp picture of just this view.
import { GLSL } from "./light.js";
import { RAD, camera, dot } from "./angles.js";

export const SCREEN = `void main() { gl_Position = vec4(vec2(gl_VertexID == 1 ? 3. : -1., gl_VertexID == 2 ? 3. : -1.), 0., 1.); }`;
export const PANORAMA = `vec2 panorama(vec3 d) { return vec2(atan(d.x, d.y) / 6.2831853, .5 - asin(clamp(d.z, -1., 1.)) / 3.14159265); }`;

const FRAGMENT = `
uniform sampler2D first, second, sharp, other;
uniform vec2 size; uniform vec3 right, up, ahead, sun, disc;
uniform float slope, mixed, sharpness, wipe, gain, radius, paint, most;
out vec4 color;
${GLSL}${PANORAMA}
void main() {
  vec2 p = gl_FragCoord.xy / size, s = (2. * p - 1.) * vec2(size.x / size.y, 1.) * slope;
  vec3 d = normalize(ahead + s.x * right + s.y * up);
  vec2 at = panorama(d);
  vec3 c = mix(texture(first, at).rgb, texture(second, at).rgb, mixed);
  c = mix(c, texture(sharp, vec2(p.x, 1. - p.y)).rgb, sharpness);
  if (p.x > wipe) c = texture(other, at).rgb;
  float away = length(cross(d, sun)), pixel = 2. * slope / size.y;
  if (dot(d, sun) > 0. && d.z > -.02) c += disc * (1. - smoothstep(radius - .5 * pixel, radius + .5 * pixel, away));
  float l = dot(c, vec3(.2126, .7152, .0722));
  vec3 shown = paint > .5 ? ramp(l / most) : film(c * gain);
  if (abs(p.x - wipe) * size.x < 1.) shown = vec3(1.);
  color = vec4(shown + (fall(gl_FragCoord.xy) - .5) / 255., 1.);
}`;

export function dome({ gl, program }) {
  const use = program(SCREEN, FRAGMENT);
  return ({ a, b, mixed, sharp, sharpness, other, wipe, sun, gain, most, paint, yaw, pitch, fov, width, height }) => {
    gl.bindFramebuffer(gl.FRAMEBUFFER, null);
    gl.viewport(0, 0, width, height);
    gl.disable(gl.DEPTH_TEST);
    gl.disable(gl.BLEND);
    const { right, up, ahead } = camera(yaw, pitch);
    use({ first: a, second: b || a, sharp: sharp || null, other: other || null, size: [width, height], right, up, ahead, sun: sun.direction, disc: sun.disc, slope: Math.tan(fov * RAD / 2),
      mixed, sharpness: sharp ? sharpness : 0, wipe: other ? wipe : 2, gain, radius: Math.max(1e-6, sun.radius), paint: paint ? 1 : 0, most });
    gl.drawArrays(gl.TRIANGLES, 0, 3);
  };
}

// Where a direction is seen, from 0 to 1 to the right and down; null behind the viewer.
export function project(d, { yaw, pitch, fov }, aspect) {
  const { right, up, ahead } = camera(yaw, pitch);
  const far = dot(d, ahead);
  if (far < 0.02) return null;
  const slope = Math.tan(fov * RAD / 2) * far;
  return [0.5 + dot(d, right) / (2 * slope * aspect), 0.5 - dot(d, up) / (2 * slope)];
}

// The direction that is seen at a place of the picture.
export function directionAt(x, y, { yaw, pitch, fov }, aspect) {
  const { right, up, ahead } = camera(yaw, pitch);
  const slope = Math.tan(fov * RAD / 2);
  const d = ahead.map((each, i) => each + (2 * x - 1) * aspect * slope * right[i] + (1 - 2 * y) * slope * up[i]);
  const length = Math.hypot(...d);
  return d.map((each) => each / length);
}

export function radianceTowards(picture, d) {
  const u = (Math.atan2(d[0], d[1]) / (2 * Math.PI) + 1) % 1;
  const v = 0.5 - Math.asin(d[2]) / Math.PI;
  const at = 3 * (Math.min(picture.height - 1, Math.floor(v * picture.height)) * picture.width + Math.floor(u * picture.width) % picture.width);
  return [...picture.data.subarray(at, at + 3)];
}
