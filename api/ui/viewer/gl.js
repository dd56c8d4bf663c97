// The little of WebGL2 that the views need: programs by name of uniform, pictures as half-float textures.

export function context(canvas) {
  const gl = canvas.getContext("webgl2", { antialias: true, alpha: false, powerPreference: "high-performance" });
  if (!gl) return null;
  const textures = new WeakMap();
  const kept = []; // the newest last; what is older than this many is given up
  const program = (vertex, fragment) => {
    const made = gl.createProgram();
    for (const [kind, source] of [[gl.VERTEX_SHADER, vertex], [gl.FRAGMENT_SHADER, fragment]]) {
      const shader = gl.createShader(kind);
      gl.shaderSource(shader, `#version 300 es\nprecision highp float;\nprecision highp sampler2D;\n${source}`);
      gl.compileShader(shader);
      gl.attachShader(made, shader);
      if (!gl.getShaderParameter(shader, gl.COMPILE_STATUS) && !gl.isContextLost()) throw new Error(gl.getShaderInfoLog(shader));
    }
    gl.linkProgram(made);
    const places = new Map();
    const place = (name) => { if (!places.has(name)) places.set(name, gl.getUniformLocation(made, name)); return places.get(name); };
    // Numbers, vectors and pictures by the name of the uniform.
    return (values) => {
      gl.useProgram(made);
      let unit = 0;
      for (const [name, value] of Object.entries(values)) {
        if (typeof value === "number") gl.uniform1f(place(name), value);
        else if (value?.length === 16) gl.uniformMatrix4fv(place(name), false, value);
        else if (value?.length) gl[`uniform${value.length}fv`](place(name), value);
        else {
          gl.activeTexture(gl.TEXTURE0 + unit);
          gl.bindTexture(gl.TEXTURE_2D, texture(value));
          gl.uniform1i(place(name), unit++);
        }
      }
    };
  };
  const empty = { width: 1, height: 1, channels: 3, data: new Float32Array(3), texture: "thickness" };
  function texture(picture) {
    const asked = picture || empty;
    let made = textures.get(asked);
    if (made) return made;
    made = gl.createTexture();
    gl.bindTexture(gl.TEXTURE_2D, made);
    const [inside, outside] = [[], [gl.R16F, gl.RED], [], [gl.RGB16F, gl.RGB], [gl.RGBA16F, gl.RGBA]][asked.channels];
    gl.pixelStorei(gl.UNPACK_ALIGNMENT, 1);
    gl.texImage2D(gl.TEXTURE_2D, 0, inside, asked.width, asked.height, 0, outside, gl.FLOAT, asked.data);
    const isFlat = asked.width !== 2 * asked.height;
    for (const [what, how] of [[gl.TEXTURE_MIN_FILTER, gl.LINEAR], [gl.TEXTURE_MAG_FILTER, gl.LINEAR], [gl.TEXTURE_WRAP_S, asked.clamp ? gl.CLAMP_TO_EDGE : gl.REPEAT],
      [gl.TEXTURE_WRAP_T, isFlat && !asked.clamp ? gl.REPEAT : gl.CLAMP_TO_EDGE]]) gl.texParameteri(gl.TEXTURE_2D, what, how);
    textures.set(asked, made);
    kept.push(asked);
    if (kept.length > 48) {
      const old = kept.shift();
      gl.deleteTexture(textures.get(old));
      textures.delete(old);
    }
    return made;
  }
  return { gl, program };
}
