// Problems of the server's, shown at what they are about: a place in the scene's text, or a control.

// Offsets [from, to] of the value that a JSON pointer names in a text, or of the deepest part of it that there is.
export function placeOf(text, pointer) {
  const wanted = pointer.split("/").slice(1).map((part) => part.replaceAll("~1", "/").replaceAll("~0", "~"));
  let at = 0;
  let best = null;
  const blank = () => { while (/\s/.test(text[at] || "")) at++; };
  const string = () => { const from = at++; while (at < text.length && text[at] !== '"') at += text[at] === "\\" ? 2 : 1; at++; return JSON.parse(text.slice(from, at)); };
  const depthOf = (path) => (path.every((part, i) => part === wanted[i]) ? path.length : -1);
  function value(path, from) {
    blank();
    const start = from ?? at;
    if (text[at] === '"') string();
    else if (text[at] === "{" || text[at] === "[") {
      const isObject = text[at++] === "{";
      for (let i = 0; ; i++) {
        blank();
        if (at >= text.length || text[at] === "}" || text[at] === "]") { at++; break; }
        if (text[at] === ",") { at++; i--; continue; }
        const begin = at;
        let name = String(i);
        if (isObject) { name = string(); blank(); at++; }
        value([...path, name], begin);
      }
    } else while (at < text.length && !/[\s,\]}]/.test(text[at])) at++;
    const depth = depthOf(path);
    if (depth >= 0 && (!best || depth > best.depth)) best = { depth, from: start, to: at };
  }
  try { value([]); } catch { /* a text that is no JSON: what was found by then */ }
  return best && best.depth > 0 ? [best.from, best.to] : null;
}

// "… at line 3 column 12" of a text that cannot be read
export function placeOfLine(text, detail) {
  const found = /line (\d+) column (\d+)/.exec(detail || "");
  if (!found) return null;
  const before = text.split("\n").slice(0, Number(found[1]) - 1).reduce((sum, line) => sum + line.length + 1, 0);
  const at = Math.min(text.length, before + Number(found[2]));
  return [Math.max(0, at - 1), at];
}

const CONTROLS = { "/sun/zenith_deg": "zenith", "/sun/azimuth_deg": "azimuth", "/sun/latitude_deg": "lat", "/sun/longitude_deg": "lon", "/sun/utc": "date" };

// Fills `box` with a problem; a field's button leads to it by `go(pointer)`. `find` knows the controls of fields.
export function showProblem(box, problem, go, find) {
  for (const each of document.querySelectorAll("[aria-invalid]")) each.removeAttribute("aria-invalid");
  box.hidden = !problem;
  if (!problem) return void box.replaceChildren();
  const said = document.createElement("p");
  said.textContent = [problem.title, problem.detail].filter(Boolean).join(": ");
  const list = document.createElement("ul");
  for (const { pointer = "", parameter = "", detail } of problem.errors || []) {
    const name = pointer || parameter;
    const control = document.querySelector(`[data-key="${CONTROLS[name] || name.replace(/[^\w]/g, "")}"]`) || (pointer && find?.(pointer)) || null;
    control?.setAttribute("aria-invalid", "true");
    const item = document.createElement("li");
    const button = Object.assign(document.createElement("button"), { type: "button", textContent: name });
    button.addEventListener("click", () => go(name, control));
    item.append(button, ` ${detail}`);
    list.append(item);
  }
  box.replaceChildren(said, ...(list.children.length ? [list] : []));
}
