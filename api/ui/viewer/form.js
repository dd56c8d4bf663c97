// The scene as a form, made from the server's own JSON Schema: a field each, with its range, default and meaning. What is edited is the scene's
// JSON; whatever has no field of its own kind (colours, lists of numbers) is a field of JSON.

const join = (pointer, name) => `${pointer}/${String(name).replaceAll("~", "~0").replaceAll("/", "~1")}`;
const partsOf = (pointer) => pointer.split("/").slice(1).map((part) => part.replaceAll("~1", "/").replaceAll("~0", "~"));
const make = (name, values, ...children) => { const made = Object.assign(document.createElement(name), values); made.append(...children); return made; };

export function sceneForm(box, schema, onEdit) {
  let scene = {};

  const resolve = (node) => (node.$ref ? resolve(node.$ref.split("/").slice(1).reduce((at, part) => at[part], schema)) : node);
  // What a value may be: a list of plain kinds. Alternatives that only say which fields belong together are no kinds.
  function kindsOf(node) {
    const here = resolve(node);
    const others = (here.anyOf || here.oneOf || []).map(resolve).filter((each) => each.properties || each.type || each.enum || each.const !== undefined || each.anyOf);
    return here.properties || !others.length ? [here] : others.flatMap(kindsOf);
  }
  const constOf = (node) => { const { const: one } = resolve(node); return one; };

  function fits(kind, value) {
    if (kind.const !== undefined) return value === kind.const ? 1 : -1;
    if (kind.enum) return kind.enum.includes(value) ? 1 : -1;
    if (kind.properties) {
      if (value === undefined) return 0;
      if (value === null || typeof value !== "object" || Array.isArray(value)) return -1;
      const names = Object.keys(value);
      if ((kind.required || []).some((name) => !(name in value))) return -1;
      let sum = 0;
      for (const name of names) {
        if (!(name in kind.properties)) return -1;
        const fixed = constOf(kind.properties[name]);
        if (fixed !== undefined && fixed !== value[name]) return -1;
        sum += 1;
      }
      return sum + 1;
    }
    if (kind.type === "array") return Array.isArray(value) ? 1 : -1;
    if (kind.type === "integer") return typeof value === "number" ? 1 : -1;
    return typeof value === kind.type ? 1 : -1;
  }

  function nameOf(kind) {
    if (kind.enum) return "by name";
    if (kind.type === "array") return kind.prefixItems ? `${kind.prefixItems.length} numbers` : "a list";
    if (!kind.properties) return kind.type || "JSON";
    const fixed = Object.values(kind.properties).map(constOf).filter((each) => each !== undefined);
    const needed = (kind.required || []).filter((name) => constOf(kind.properties[name]) === undefined);
    return [...fixed, ...(needed.length ? needed : fixed.length ? [] : Object.keys(kind.properties).slice(0, 2))].join(", ");
  }

  // The least that is of a kind: what it cannot be without.
  function emptyOf(kind) {
    if (kind.const !== undefined) return kind.const;
    if (kind.enum) return kind.enum[0];
    if (kind.default !== undefined) return kind.default;
    if (kind.properties) {
      const names = new Set([...(kind.required || []), ...Object.keys(kind.properties).filter((name) => constOf(kind.properties[name]) !== undefined)]);
      return Object.fromEntries([...names].map((name) => [name, emptyOf(kindsOf(kind.properties[name])[0])]));
    }
    if (kind.type === "array") return (kind.prefixItems || []).map((each) => emptyOf(kindsOf(each)[0]));
    if (kind.type === "boolean") return false;
    if (kind.type === "string") return "";
    return kind.minimum ?? kind.exclusiveMinimum ?? 0;
  }

  const at = (pointer) => partsOf(pointer).reduce((value, part) => value?.[part], scene);
  function put(pointer, value) {
    const parts = partsOf(pointer);
    const last = parts.pop();
    let here = scene;
    for (const part of parts) here = here[part] ??= {};
    if (value !== undefined) here[last] = value;
    else if (Array.isArray(here)) here.splice(Number(last), 1);
    else delete here[last];
    onEdit(structuredClone(scene));
  }

  function input(pointer, kind, value) {
    if (kind.enum || kind.type === "boolean") {
      const words = kind.enum || [true, false];
      const select = make("select", {});
      const usual = kind.default === undefined ? "as it is without" : `default: ${kind.default}`;
      select.append(new Option(usual, ""), ...words.map((word) => new Option(String(word), JSON.stringify(word))));
      select.value = value === undefined ? "" : JSON.stringify(value);
      select.addEventListener("change", () => put(pointer, select.value === "" ? undefined : JSON.parse(select.value)));
      return select;
    }
    const isNumber = kind.type === "number" || kind.type === "integer";
    const isText = kind.type === "string";
    const field = make("input", { type: isNumber ? "number" : "text", spellcheck: false, autocomplete: "off" });
    if (isNumber) Object.assign(field, { step: kind.type === "integer" ? "1" : "any", min: kind.minimum ?? "", max: kind.maximum ?? "" });
    if (kind.default !== undefined) field.placeholder = isText ? kind.default : JSON.stringify(kind.default);
    field.value = value === undefined ? "" : isText ? value : JSON.stringify(value);
    field.addEventListener("change", () => {
      let given;
      try { given = field.value.trim() === "" ? undefined : isText ? field.value : JSON.parse(field.value); } catch { given = null; }
      // The server tells of a number that is too large better than a browser; of what is none it cannot.
      const isWrong = given === null || field.validity.badInput;
      field.toggleAttribute("aria-invalid", isWrong);
      if (isWrong) field.setAttribute("aria-invalid", "true");
      else put(pointer, given);
    });
    return field;
  }

  // A row or a part of the form for what stands at a pointer.
  function part(pointer, name, node) {
    const value = at(pointer);
    const kinds = kindsOf(node);
    const scores = kinds.map((each) => fits(each, value));
    const chosen = scores.indexOf(Math.max(...scores));
    const kind = kinds[chosen];
    const about = resolve(node).description || kind.description;
    if (kinds.length === 1 && kind.const !== undefined) return null;
    if (kinds.length === 1 && kind.type === "array" && kind.items && kindsOf(kind.items).some((each) => each.properties)) return list(pointer, name, kind.items);
    const isPart = kinds.some((each) => each.properties);
    if (!isPart) {
      // A colour is one number or three.
      const plain = kinds.length === 1 ? kind : { ...(kinds.every((each) => each.type === "string") ? kind : {}), description: about, default: resolve(node).default };
      const field = input(pointer, plain, value);
      field.dataset.pointer = pointer;
      return make("label", {}, make("span", { textContent: name }), field, ...(about ? [make("small", { textContent: about })] : []));
    }
    const details = make("details", { open: value !== undefined && partsOf(pointer).length < 2 }, make("summary", { textContent: name }));
    details.dataset.pointer = pointer;
    const fill = () => {
      if (details.dataset.isFull || !details.open) return;
      details.dataset.isFull = "yes";
      details.append(inside(pointer, kinds, chosen, about));
    };
    details.addEventListener("toggle", fill);
    fill();
    return details;
  }

  function inside(pointer, kinds, chosen, about) {
    const body = make("div", { className: "fields" });
    if (about) body.append(make("p", { className: "note", textContent: about }));
    if (kinds.length > 1) {
      const select = make("select", {}, ...kinds.map((kind, i) => new Option(nameOf(kind), i)));
      select.value = chosen;
      select.setAttribute("aria-label", `Kind of ${pointer.slice(1)}`);
      select.addEventListener("change", () => {
        const before = at(pointer);
        const next = kinds[Number(select.value)];
        const made = emptyOf(next);
        // What both have stays.
        if (next.properties && before && typeof before === "object") for (const [name, value] of Object.entries(before)) if (next.properties[name] && constOf(next.properties[name]) === undefined) made[name] = value;
        put(pointer, made);
        body.replaceWith(inside(pointer, kinds, Number(select.value), about));
      });
      body.append(select);
    }
    const kind = kinds[chosen];
    if (kind.properties) for (const [name, node] of Object.entries(kind.properties)) { const made = part(join(pointer, name), name, node); if (made) body.append(made); }
    else { const field = input(pointer, kind, at(pointer)); field.dataset.pointer = pointer; field.setAttribute("aria-label", pointer.slice(1)); body.append(field); }
    return body;
  }

  function list(pointer, name, items) {
    const box = make("div", { className: "fields" });
    const show = () => {
      const all = at(pointer) || [];
      box.replaceChildren(...all.flatMap((_, i) => {
        const row = part(join(pointer, i), `${name} ${i + 1} of ${all.length}`, items);
        const drop = make("button", { type: "button", textContent: `Remove ${name} ${i + 1}` });
        drop.addEventListener("click", () => { put(join(pointer, i), undefined); show(); });
        return [row, drop];
      }));
      const more = make("button", { type: "button", textContent: `Add to ${name}` });
      more.addEventListener("click", () => {
        const before = at(pointer) || [];
        // A copy of the last one is a sounder start than an empty one.
        put(pointer, [...before, before.length ? structuredClone(before.at(-1)) : emptyOf(kindsOf(items)[0])]);
        show();
      });
      box.append(more);
    };
    show();
    return box;
  }

  return (next) => {
    if (JSON.stringify(next) === JSON.stringify(scene) || box.contains(document.activeElement)) return;
    const open = new Set([...box.querySelectorAll("details[open]")].map((each) => each.dataset.pointer));
    scene = structuredClone(next);
    const rows = Object.entries(schema.properties).map(([name, node]) => part(join("", name), name, node)).filter(Boolean);
    box.replaceChildren(...rows);
    for (const pointer of [...open].sort()) {
      const found = box.querySelector(`details[data-pointer="${CSS.escape(pointer)}"]`);
      if (found) { found.open = true; found.dispatchEvent(new Event("toggle")); }
    }
  };
}

// The control of a field, or of the nearest part around it that has one; parts that are closed are opened on the way.
export function fieldOf(box, pointer) {
  const parts = partsOf(pointer);
  let found = null;
  for (let n = 1; n <= parts.length; n++) {
    const here = box.querySelector(`[data-pointer="${CSS.escape(parts.slice(0, n).reduce(join, ""))}"]`);
    if (!here) continue;
    found = here;
    if (here.tagName === "DETAILS" && n < parts.length) { here.open = true; here.dispatchEvent(new Event("toggle")); }
  }
  return found?.tagName === "DETAILS" ? found.querySelector("summary") : found;
}
