// Panels over a shared time axis, with a cursor that tells every value. Drawn to the width that there is, so that its text is of one
// size on every screen.

import { digits, make, svg } from "./dom.js";

const EDGE = { left: 52, right: 10, top: 22, bottom: 6, axis: 34 };

/// Round ticks between two values, about `count` of them.
function ticks(low, high, count) {
  const rough = (high - low) / count;
  const power = 10 ** Math.floor(Math.log10(rough));
  const step = [1, 2, 5, 10].map((factor) => factor * power).find((size) => size >= rough) ?? 10 * power;
  const all = [];
  for (let at = Math.ceil(low / step) * step; at <= high + 1e-9 * step; at += step) all.push(Math.abs(at) < 1e-9 * step ? 0 : at);
  return all;
}

function range(panel) {
  let [low, high] = panel.zone ? [...panel.zone] : [Infinity, -Infinity];
  for (const { y } of panel.curves) {
    for (const value of y) {
      if (value < low) low = value;
      if (value > high) high = value;
    }
  }
  for (const { y } of panel.lines ?? []) [low, high] = [Math.min(low, y), Math.max(high, y)];
  if (!(low < high)) [low, high] = [low - 1, low + 1];
  const room = 0.05 * (high - low);
  return [low - room, high + room];
}

function panelSvg(panel, x, top, width, height, xTicks, root) {
  const [low, high] = range(panel);
  const inner = { left: EDGE.left, right: width - EDGE.right, top: top + EDGE.top, bottom: top + height - EDGE.bottom };
  const y = (value) => inner.bottom - ((value - low) / (high - low)) * (inner.bottom - inner.top);
  root.append(svg("text", { class: "title", x: 0, y: top + 13 }, panel.title));
  if (panel.zone) {
    const [from, to] = panel.zone;
    root.append(svg("rect", { class: "zone", x: inner.left, y: y(to), width: inner.right - inner.left, height: y(from) - y(to) }));
  }
  for (const value of ticks(low, high, Math.max(3, height / 40))) {
    root.append(svg("path", { class: "grid", d: `M${inner.left},${y(value)}H${inner.right}` }));
    root.append(svg("text", { x: inner.left - 6, y: y(value) + 4, "text-anchor": "end" }, digits(value)));
  }
  for (const value of xTicks) root.append(svg("path", { class: "grid", d: `M${x(value)},${inner.top}V${inner.bottom}` }));
  for (const line of panel.lines ?? []) {
    root.append(svg("path", { class: "limit", d: `M${inner.left},${y(line.y)}H${inner.right}` }));
  }
  // the first on top of the others
  for (const curve of [...panel.curves].reverse()) {
    const points = curve.x.map((time, index) => {
      const place = `${x(time).toFixed(1)},${y(curve.y[index]).toFixed(1)}`;
      if (index === 0) return `M${place}`;
      return panel.steps ? `H${x(time).toFixed(1)}V${y(curve.y[index]).toFixed(1)}` : `L${place}`;
    });
    root.append(svg("path", { class: `curve ${curve.class}`, d: points.join("") }));
  }
  root.append(svg("rect", { class: "frame", x: inner.left, y: inner.top, width: inner.right - inner.left, height: inner.bottom - inner.top }));
}

/// Replaces what is in `host`. `panels`: { title, curves: [{ name, class, x, y }], zone, lines, steps }; all curves share their times.
export function draw(host, panels, window, unit, heights) {
  const width = Math.max(280, host.clientWidth);
  const total = heights.reduce((sum, height) => sum + height, 0) + EDGE.axis;
  const root = svg("svg", { viewBox: `0 0 ${width} ${total}`, role: "img", "aria-label": panels.map((panel) => panel.title).join(", ") });
  const [from, to] = window;
  const x = (value) => EDGE.left + ((value - from) / (to - from)) * (width - EDGE.left - EDGE.right);
  const xTicks = ticks(from, to, Math.max(3, width / 110));
  let top = 0;
  panels.forEach((panel, index) => {
    panelSvg(panel, x, top, width, heights[index], xTicks, root);
    top += heights[index];
  });
  for (const value of xTicks) root.append(svg("text", { x: x(value), y: top + 10, "text-anchor": "middle" }, digits(value)));
  root.append(svg("text", { x: (EDGE.left + width - EDGE.right) / 2, y: top + 27, "text-anchor": "middle" }, unit));
  const cursor = svg("path", { class: "cursor" });
  root.append(cursor);
  const said = make("p", { class: "dim" }, "Point at the curves for values.");
  const times = panels[0].curves[0]?.x ?? [];
  const show = (event) => {
    const box = root.getBoundingClientRect();
    const time = from + (((event.clientX - box.left) / box.width) * width - EDGE.left) / (width - EDGE.left - EDGE.right) * (to - from);
    if (!times.length || time < from || time > to) return;
    let nearest = 0;
    times.forEach((value, index) => { if (Math.abs(value - time) < Math.abs(times[nearest] - time)) nearest = index; });
    cursor.setAttribute("d", `M${x(times[nearest])},${EDGE.top}V${top - EDGE.bottom}`);
    const values = panels[0].curves.map((curve, index) =>
      `${curve.name}: ${panels.map((panel) => digits(panel.curves[index].y[nearest])).join(", ")}`);
    said.textContent = `${digits(times[nearest])} ${unit.match(/\((.*)\)/)?.[1] ?? ""}: ${values.join("; ")}`;
  };
  root.addEventListener("pointermove", show);
  root.addEventListener("pointerdown", show);
  const legend = make("div", { class: "legend" }, ...panels[0].curves.map((curve) => make("span", { class: curve.class }, curve.name)));
  host.replaceChildren(make("div", { class: "chart" }, legend, root, said));
}
