// Small things that every view needs.

export const at = (id) => document.getElementById(id);

/// An element with attributes (`on...`: listeners) and children.
export function make(name, attributes = {}, ...children) {
  const element = document.createElement(name);
  for (const [key, value] of Object.entries(attributes)) {
    if (key.startsWith("on")) element.addEventListener(key.slice(2), value);
    else if (typeof value === "boolean") element.toggleAttribute(key, value);
    else element.setAttribute(key, value);
  }
  element.append(...children);
  return element;
}

export function svg(name, attributes = {}, ...children) {
  const element = document.createElementNS("http://www.w3.org/2000/svg", name);
  for (const [key, value] of Object.entries(attributes)) element.setAttribute(key, value);
  element.append(...children);
  return element;
}

/// Fills a `<select>`, keeping what was chosen if it is still there.
export function choose(select, options, fallback) {
  const before = select.value;
  select.replaceChildren(...options.map(([value, label]) => make("option", { value }, label)));
  const values = options.map(([value]) => value);
  select.value = values.includes(before) && before !== "" ? before : fallback ?? values[0] ?? "";
}

export const decode = (bytes) => new TextDecoder().decode(bytes);
export const encode = (text) => new TextEncoder().encode(text);

export function download(name, content) {
  const url = URL.createObjectURL(new Blob([content], { type: "application/octet-stream" }));
  const link = make("a", { href: url, download: name.split("/").pop() });
  link.click();
  setTimeout(() => URL.revokeObjectURL(url), 1000);
}

/// Four digits, as a person reads them.
export function digits(x, count = 4) {
  if (!Number.isFinite(x)) return "–";
  const size = Math.abs(x);
  if (size !== 0 && (size < 1e-3 || size >= 1e6)) return x.toExponential(count - 2).replace(/\.?0+e/, "e");
  return String(Number(x.toPrecision(count)));
}

/// A list of texts of faults.
export function faults(list) {
  return list.map(({ text }) => make("pre", { tabindex: "0" }, text));
}

export function size(bytes) {
  return bytes < 10000 ? `${bytes} bytes` : `${(bytes / 1000).toFixed(0)} kB`;
}

/// Files to download, each with a button and a look inside.
export function fileList(made) {
  return Object.entries(made).map(([name, bytes]) => {
    const isText = !bytes.includes(0);
    const get = make("button", { type: "button", onclick: () => download(name, bytes) }, `Download ${name}`);
    const line = make("div", { class: "out" }, get, make("span", { class: "dim" }, size(bytes.length)));
    if (!isText) return line;
    const shown = make("pre", { tabindex: "0" });
    const details = make("details", {}, make("summary", {}, `Look at ${name}`), shown);
    details.addEventListener("toggle", () => { if (details.open) shown.textContent = decode(bytes); });
    return make("div", {}, line, details);
  });
}

/// Calls the newest only: `work` is not begun again before it has ended.
export function latest(work) {
  let running = false;
  let wanted = false;
  return async function again() {
    wanted = true;
    if (running) return;
    running = true;
    try {
      while (wanted) {
        wanted = false;
        await work();
      }
    } finally {
      running = false;
    }
  };
}
