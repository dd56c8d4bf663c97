// Time that runs: two pictures at a time, faded from one to the next, the third on its way. The pace of pictures follows what
// the server can do; where it is late, time waits.
import { set, state } from "./state.js";

export function player({ fetchFrame, onFrames, onEnd }) {
  let running = null;
  let frames = [];
  let wanted = null;
  let period = 1.5; // seconds on the clock between two pictures
  let before = 0;

  async function want(time) {
    if (wanted !== null || !running) return;
    wanted = time;
    const { signal } = running;
    const start = performance.now();
    try {
      const frame = await fetchFrame(time, signal);
      if (signal.aborted) return;
      frames.push(frame);
      const took = (performance.now() - start) / 1000;
      period = Math.min(8, Math.max(0.7, 0.6 * period + 0.4 * 1.3 * took));
    } catch (error) {
      if (!signal.aborted) { stop(); onEnd(error); }
    } finally {
      wanted = null;
    }
  }

  function tick(now) {
    if (!running) return;
    const passed = Math.min(0.25, (now - before) / 1000);
    before = now;
    const [a, b, c] = frames;
    const step = state.speed * 60 * period;
    if (!c) want((frames.at(-1)?.time ?? state.time - step) + step);
    if (a && b) {
      const time = Math.min(b.time, state.time + passed * state.speed * 60);
      if (time >= b.time && c) frames.shift();
      set({ time });
      const [from, to] = frames;
      onFrames(from, to, Math.min(1, Math.max(0, (time - from.time) / (to.time - from.time))));
    }
    requestAnimationFrame(tick);
  }

  function start(frame) {
    running = new AbortController();
    frames = frame ? [frame] : [];
    wanted = null;
    before = performance.now();
    requestAnimationFrame(tick);
  }
  function stop() {
    running?.abort();
    running = null;
  }
  return { start, stop, get playing() { return running !== null; } };
}
