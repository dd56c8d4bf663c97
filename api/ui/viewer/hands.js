// Mouse, touch and keys on the pictures.
import { defaults, set, state } from "./state.js";
import { azimuthOf, clamp, dot, elevationOf, sunAt, turnOf } from "./angles.js";
import { directionAt } from "./dome.js";

const VIEWS = { dome: ["yaw", "pitch", "fov"], ground: ["turn", "tilt", "away"], maps: ["zoom", "mapX", "mapY"] };

export const resetView = () => set(defaults(...VIEWS[state.view]));

export function nearer(factor) {
  if (state.view === "dome") set({ fov: clamp(state.fov / factor, 8, 120) });
  else if (state.view === "ground") set({ away: clamp(state.away / factor, 0.25, 4) });
  else set({ zoom: clamp(state.zoom * factor, 0.2, 64) });
}

// By so many parts of the picture's height.
function move(dx, dy, aspect, mapSide) {
  if (state.view === "dome") {
    const slant = Math.max(0.25, Math.cos((state.pitch * Math.PI) / 180));
    set({ yaw: turnOf(state.yaw - (dx * state.fov) / slant), pitch: clamp(state.pitch + dy * state.fov, -89, 89) });
  } else if (state.view === "ground") set({ turn: turnOf(state.turn + dx * 120), tilt: clamp(state.tilt + dy * 80, 8, 89.9) });
  else {
    const [wide, high] = mapSide();
    set({ mapX: state.mapX - dx / wide, mapY: clamp(state.mapY - dy / high, -40, 40) });
  }
}

export function hands(canvas, { mapSide, onPoint, onCross, onPlay }) {
  const fingers = new Map();
  const aspect = () => canvas.clientWidth / canvas.clientHeight;
  canvas.addEventListener("pointerdown", (event) => {
    canvas.setPointerCapture(event.pointerId);
    fingers.set(event.pointerId, [event.clientX, event.clientY]);
  });
  canvas.addEventListener("pointermove", (event) => {
    const box = canvas.getBoundingClientRect();
    const before = fingers.get(event.pointerId);
    if (!before) return onPoint((event.clientX - box.left) / box.width, (event.clientY - box.top) / box.height);
    const others = [...fingers].filter(([id]) => id !== event.pointerId).map(([, at]) => at);
    const now = [event.clientX, event.clientY];
    if (others.length) {
      const apart = (at) => Math.hypot(at[0] - others[0][0], at[1] - others[0][1]);
      nearer(clamp(apart(now) / Math.max(1, apart(before)), 0.5, 2));
    }
    const part = 1 / (others.length + 1);
    move(((now[0] - before[0]) / box.height) * part, ((now[1] - before[1]) / box.height) * part, aspect(), mapSide);
    fingers.set(event.pointerId, now);
  });
  for (const end of ["pointerup", "pointercancel"]) canvas.addEventListener(end, (event) => fingers.delete(event.pointerId));
  canvas.addEventListener("pointerleave", () => onPoint(null));
  canvas.addEventListener("wheel", (event) => {
    event.preventDefault();
    nearer(Math.exp(-event.deltaY * 0.0012));
  }, { passive: false });
  const ARROWS = { ArrowLeft: [1, 0], ArrowRight: [-1, 0], ArrowUp: [0, 1], ArrowDown: [0, -1] };
  canvas.addEventListener("keydown", (event) => {
    const arrow = ARROWS[event.key];
    if (event.ctrlKey || event.metaKey || event.altKey) return;
    if (arrow && event.shiftKey && state.view === "maps") onCross(-arrow[0], -arrow[1]);
    else if (arrow) move(arrow[0] * 0.06, arrow[1] * 0.06, aspect(), mapSide);
    else if (event.key === "+" || event.key === "=") nearer(1.2);
    else if (event.key === "-") nearer(1 / 1.2);
    else if (event.key === "0") resetView();
    else if (event.key === " ") onPlay();
    else return;
    event.preventDefault();
  });
}

// A sun over a place keeps to its day: it goes to the time at which it is nearest to where it was drawn.
function sunTo(d) {
  if (state.by !== "place") return set({ zenith: clamp(Math.round(2 * (90 - elevationOf(d))) / 2, 0, 110), azimuth: Math.round(azimuthOf(d)) % 360 });
  const start = Date.parse(`${state.date}T${state.start}:00Z`);
  let best = -2, time = 0;
  for (let at = 0; at <= 86400; at += 60) {
    const near = dot(d, sunAt(start + at * 1000, state.lat, state.lon));
    if (near > best) [best, time] = [near, at];
  }
  set({ time });
}

export function sunHand(button, stage, sunNow) {
  let held = false;
  button.addEventListener("pointerdown", (event) => { button.setPointerCapture(event.pointerId); held = true; });
  button.addEventListener("pointermove", (event) => {
    if (!held) return;
    const box = stage.getBoundingClientRect();
    sunTo(directionAt((event.clientX - box.left) / box.width, (event.clientY - box.top) / box.height, state, box.width / box.height));
  });
  for (const end of ["pointerup", "pointercancel"]) button.addEventListener(end, () => { held = false; });
  button.addEventListener("keydown", (event) => {
    const [turn, rise] = { ArrowLeft: [-1, 0], ArrowRight: [1, 0], ArrowUp: [0, 1], ArrowDown: [0, -1] }[event.key] || [];
    if (turn === undefined) return;
    event.preventDefault();
    if (state.by === "place") return set({ time: clamp(state.time + 300 * (turn || rise), 0, 86400) });
    const { zenith, azimuth } = state;
    set({ zenith: clamp(zenith - rise, 0, 110), azimuth: turnOf(azimuth + 2 * turn) });
    sunNow();
  });
}
