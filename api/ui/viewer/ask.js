// Everything that is asked of the server: problems become errors, raw floats become pictures that keep their timings.

const KEPT = 40; // pictures, the newest ones
const pictures = new Map();

export class Refused extends Error {
  constructor(problem) {
    super(problem.title || "error");
    this.problem = problem;
  }
}

export async function ask(url, options) {
  const reply = await fetch(url, options);
  if (reply.ok) return reply;
  let problem = { title: reply.statusText || "error", status: reply.status };
  try { problem = await reply.json(); } catch { /* the body was no document: the status has to do */ }
  throw new Refused(problem);
}

export const askJson = async (url, signal) => (await ask(url, { signal })).json();

export async function register(text, signal) {
  const reply = await ask("/v1/skies", { method: "POST", headers: { "content-type": "application/json" }, body: text, signal });
  return { ...(await reply.json()), isNew: reply.status === 201 };
}

// `server-timing: field;dur=2.1, total;dur=9` as [["field", 2.1], ["total", 9]]
const timings = (text) => [...(text || "").matchAll(/([\w-]+)(?:;desc=[^;,]*)?(?:;dur=([\d.]+))?/g)].map(([, name, ms]) => [name, Number(ms || 0)]);

// One texture as floats. The version in the address lets the browser keep it for ever.
export async function picture(sky, texture, query, signal) {
  const all = new URLSearchParams(query);
  all.set("v", sky.version);
  const url = `/v1/skies/${sky.id}/${texture}.f32?${all}`;
  const known = pictures.get(url);
  if (known) return known;
  const start = performance.now();
  const reply = await ask(url, { signal });
  const [height, width, channels] = reply.headers.get("x-skyloom-shape").split(",").map(Number);
  const made = {
    texture, query, width, height, channels, data: new Float32Array(await reply.arrayBuffer()),
    timings: timings(reply.headers.get("server-timing")), took: performance.now() - start,
    expected: Number(reply.headers.get("skyloom-expected-error")), met: reply.headers.get("skyloom-tolerance-met") !== "false",
  };
  pictures.set(url, made);
  if (pictures.size > KEPT) pictures.delete(pictures.keys().next().value);
  return made;
}
