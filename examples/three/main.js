// three.js has x east, y up, z south (`axes=three`), here in kilometres. Light stays in kcd/m2 and klx until the last pass.
import * as THREE from "three";
import { OrbitControls } from "three/addons/controls/OrbitControls.js";
import { EXRLoader } from "three/addons/loaders/EXRLoader.js";
import { EffectComposer } from "three/addons/postprocessing/EffectComposer.js";
import { RenderPass } from "three/addons/postprocessing/RenderPass.js";
import { OutputPass } from "three/addons/postprocessing/OutputPass.js";

const asked = new URLSearchParams(location.search);
const PRESET = asked.get("preset") || "fair-weather";
const SKY = asked.get("sky"); // the id of a sky that is registered already, instead of a preset
const SIZE = 512;
const EVERY_S = 5;
const EYE_M = 7000; // where the panorama is seen from
const told = document.getElementById("told");
const json = async (url, options) => {
  const reply = await fetch(url, options);
  const answer = await reply.json();
  if (!reply.ok) throw new Error(`${answer.title}: ${answer.detail}`);
  return answer;
};
const exr = new EXRLoader(); // half floats, linear
const load = async (url) => {
  const texture = await exr.loadAsync(url);
  texture.wrapS = texture.wrapT = THREE.RepeatWrapping; // the domain is periodic
  texture.minFilter = texture.magFilter = THREE.LinearFilter;
  return texture;
};

async function registered() {
  if (SKY) return json(`/v1/skies/${encodeURIComponent(SKY)}`);
  const preset = (await json("/v1/presets")).find(({ name }) => name === PRESET);
  if (!preset) throw new Error(`no preset is named ${PRESET}`);
  return json("/v1/skies", { method: "POST", headers: { "content-type": "application/json" }, body: JSON.stringify(preset.scene) });
}

async function start() {
  const sky = await registered();
  const { links, scene: normal } = sky;
  const km = normal.domain.extent_m / 1000;
  const baseKm = Math.min(...normal.layers.map((layer) => layer.base_m ?? 1000)) / 1000;
  const [sun, ambient, panorama] = await Promise.all([
    json(links.sun), json(links.ambient), exr.loadAsync(`${links.sky}&size=${SIZE}&axes=three&eye=0,0,${EYE_M}`)]);

  const renderer = new THREE.WebGLRenderer({ antialias: true });
  renderer.toneMapping = THREE.ACESFilmicToneMapping;
  renderer.toneMappingExposure = 0.09; // of light in kcd/m2, by day
  document.body.append(renderer.domElement);
  const camera = new THREE.PerspectiveCamera(50, 1, 0.05, 500);
  camera.position.set(0.35 * km, EYE_M / 1000, 0.55 * km);
  const controls = new OrbitControls(camera, renderer.domElement);
  controls.maxPolarAngle = 1.5;
  const scene = new THREE.Scene();
  panorama.mapping = THREE.EquirectangularReflectionMapping;
  scene.background = panorama;

  const shared = { irradiance: { value: null }, shadow: { value: null }, cloud: { value: null }, km: { value: km } };
  const albedo = new THREE.Vector3(...(Array.isArray(normal.ground.albedo) ? normal.ground.albedo : [0.2, 0.2, 0.2]));
  // North, -z, is the upper edge of a map, where the loader has v = 1.
  const PLACE = "vec2 onMap(vec3 p) { return vec2(p.x, -p.z) / km + .5; }";
  const VERTEX = "out vec3 world, facing; void main() { vec4 p = modelMatrix * vec4(position, 1.); world = p.xyz; facing = normalize(mat3(modelMatrix) * normal); gl_Position = projectionMatrix * viewMatrix * p; }";
  const material = (fragmentShader, more = {}) => new THREE.ShaderMaterial({ glslVersion: THREE.GLSL3, vertexShader: VERTEX, fragmentShader, uniforms: { ...shared, ...more.uniforms }, ...more.state });
  const level = (height, what) => {
    const plane = new THREE.Mesh(new THREE.PlaneGeometry(3 * km, 3 * km).rotateX(-Math.PI / 2), what);
    plane.position.y = height;
    scene.add(plane);
    return plane;
  };
  const FADE = "float near = 1. - smoothstep(.9, 1.5, length(world.xz) / km);";

  level(0, material(`
    in vec3 world; out vec4 color; uniform sampler2D irradiance; uniform vec3 albedo; uniform float km; ${PLACE}
    void main() { ${FADE} color = vec4(texture(irradiance, onMap(world)).rgb * albedo / 3.14159265, 1.) * near; }`,
  { uniforms: { albedo: { value: albedo } }, state: { transparent: true, blending: THREE.CustomBlending, blendSrc: THREE.OneFactor, blendDst: THREE.OneMinusSrcAlphaFactor } }));

  // Things on the ground: the sun through the shadow map, the sky by nine spherical harmonics.
  const direction = new THREE.Vector3(sun.direction[0], sun.direction[2], -sun.direction[1]);
  const thing = material(`
    in vec3 world, facing; out vec4 color; uniform sampler2D shadow; uniform float km; uniform vec3 sun, toSun, sh[9]; ${PLACE}
    void main() {
      vec3 n = normalize(facing); float x = n.x, y = -n.z, z = n.y; // east, north, up
      vec3 sky = .282095 * sh[0] + .488603 * (y * sh[1] + z * sh[2] + x * sh[3])
        + 1.092548 * (x * y * sh[4] + y * z * sh[5] + x * z * sh[7]) + .315392 * (3. * z * z - 1.) * sh[6] + .546274 * (x * x - y * y) * sh[8];
      vec3 e = max(sky, 0.) + sun * max(dot(n, toSun), 0.) * texture(shadow, onMap(world)).r;
      color = vec4(e * .5 / 3.14159265, 1.);
    }`, { uniforms: { sun: { value: new THREE.Vector3(...sun.irradiance.facing_the_sun) }, toSun: { value: direction }, sh: { value: ambient.irradiance.map((rgb) => new THREE.Vector3(...rgb)) } } });
  for (let i = -4; i <= 4; i++) for (let j = -4; j <= 4; j++) {
    const column = new THREE.Mesh(new THREE.CylinderGeometry(0.06, 0.06, 0.4, 24), thing);
    column.position.set((i * km) / 10, 0.2, (j * km) / 10);
    scene.add(column);
  }

  // Premultiplied light of the clouds: One, OneMinusSrcAlpha, in the composer's half-float target.
  const clouds = level(baseKm, material(`
    in vec3 world; out vec4 color; uniform sampler2D cloud; uniform float km; ${PLACE}
    void main() { ${FADE} color = texture(cloud, onMap(world)) * near; }`,
  { state: { transparent: true, depthWrite: false, side: THREE.DoubleSide, blending: THREE.CustomBlending, blendEquation: THREE.AddEquation, blendSrc: THREE.OneFactor, blendDst: THREE.OneMinusSrcAlphaFactor } }));
  clouds.renderOrder = 1;

  const composer = new EffectComposer(renderer);
  composer.addPass(new RenderPass(scene, camera));
  composer.addPass(new OutputPass());
  const fit = () => {
    renderer.setSize(innerWidth, innerHeight);
    composer.setSize(innerWidth, innerHeight);
    camera.aspect = innerWidth / innerHeight;
    camera.updateProjectionMatrix();
  };
  addEventListener("resize", fit);
  fit();
  renderer.setAnimationLoop(() => { controls.update(); composer.render(); });

  let busy = false;
  const names = ["cloud", "irradiance", "shadow"];
  const frames = new EventSource(`${links.frames}?every=${EVERY_S}&size=${SIZE}&view=above&textures=${names.map((name) => `${name}.exr`)}`);
  frames.addEventListener("frame", async ({ data }) => {
    if (busy) return; // what comes while the one before is loaded is left out
    busy = true;
    try {
      const { at, textures } = JSON.parse(data);
      const made = await Promise.all(names.map((name) => load(textures[`${name}.exr`])));
      names.forEach((name, i) => {
        shared[name].value?.dispose();
        shared[name].value = made[i];
      });
      told.textContent = `${SKY ?? PRESET}, clouds of ${new Date(at).toLocaleTimeString()}, every ${EVERY_S} s; drag to turn`;
    } catch (error) {
      told.textContent = String(error);
    } finally {
      busy = false;
    }
  });
  frames.addEventListener("error", () => { told.textContent = "The server does not answer; asking again …"; });
}

start().catch((error) => { told.textContent = String(error.message || error); });
