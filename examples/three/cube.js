// A cube map of what three.js' KTX2Loader makes of an uncompressed one: a flat texture (r187) whose every level holds six faces one after the other.
import * as THREE from "three";

export function cubeOf(flat) {
  const [first, ...smaller] = flat.mipmaps.map(({ data, width, height }) => Array.from({ length: 6 }, (_, face) => {
    const texels = data.subarray((face * data.length) / 6, ((face + 1) * data.length) / 6);
    return new THREE.DataTexture(texels, width, height, flat.format, flat.type);
  }));
  const cube = new THREE.CubeTexture(first, THREE.CubeReflectionMapping);
  cube.mipmaps = smaller.map((image) => ({ image }));
  cube.format = flat.format;
  cube.type = flat.type;
  cube.colorSpace = flat.colorSpace;
  cube.magFilter = THREE.LinearFilter;
  cube.minFilter = smaller.length ? THREE.LinearMipmapLinearFilter : THREE.LinearFilter;
  cube.generateMipmaps = false;
  cube.needsUpdate = true;
  return cube;
}
