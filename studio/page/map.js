// The decision map: duty over two signals.

import { at, digits, faults, latest, make } from "./dom.js";

/// Cells along an axis.
const CELLS = 96;
/// From low to high; told apart with any colour vision, and in grey (viridis).
const RAMP = [[68, 1, 84], [59, 82, 139], [33, 145, 140], [94, 201, 98], [253, 231, 37]];

function colour(share) {
  const place = Math.min(Math.max(share, 0), 1) * (RAMP.length - 1);
  const index = Math.min(Math.floor(place), RAMP.length - 2);
  return RAMP[index].map((low, channel) => Math.round(low + (place - index) * (RAMP[index + 1][channel] - low)));
}

function paint(canvas, columns, rows, share) {
  [canvas.width, canvas.height] = [columns, rows];
  const context = canvas.getContext("2d");
  const image = context.createImageData(columns, rows);
  for (let row = 0; row < rows; row += 1) {
    for (let column = 0; column < columns; column += 1) {
      // the lowest y at the bottom
      image.data.set([...colour(share(column, rows - 1 - row)), 255], 4 * (row * columns + column));
    }
  }
  context.putImageData(image, 0, 0);
}

export class DecisionMap {
  constructor(studio) {
    this.studio = studio;
    this.draw = latest(() => this.show());
    this.of = null;
  }

  reset() {
    this.of = null;
    at("axes").replaceChildren();
    at("map").replaceChildren();
  }

  /// Where a signal is looked at first: near the voltage that is held, or all of its range.
  range({ name, range }) {
    const held = this.studio.policy.v_ref;
    if (name === "v_out" && held) return [0.95 * held, 1.05 * held];
    // a plausible range reaches far beyond what a converter carries
    return [Math.max(range.low, 0), Math.max(range.low, 0) + (range.high - Math.max(range.low, 0)) / 4];
  }

  middle(signal) {
    const [low, high] = this.range(signal);
    return (low + high) / 2;
  }

  form() {
    const { signals } = this.studio.policy;
    const number = (label, value) => {
      const input = make("input", { type: "number", step: "any", value: Number(value.toPrecision(4)), onchange: this.draw });
      return [make("label", {}, label, input), input];
    };
    const axis = (title, index) => {
      const select = make("select", { "aria-label": title, onchange: () => { this.fill(fields); this.draw(); } }, ...signals.map(({ name, unit }) => make("option", { value: name }, `${name} (${unit})`)));
      select.value = signals[Math.min(index, signals.length - 1)].name;
      const [lowLabel, low] = number("from", 0);
      const [highLabel, high] = number("to", 1);
      const fields = { select, low, high };
      this.fill(fields);
      return { row: make("div", { class: "row" }, make("label", {}, title, select), lowLabel, highLabel), fields };
    };
    const [x, y] = [axis("to the right", 0), axis("upwards", 1)];
    this.x = x.fields;
    this.y = y.fields;
    this.rest = signals.map((signal) => [signal.name, ...number(`${signal.name} otherwise (${signal.unit})`, this.middle(signal))]);
    at("axes").replaceChildren(x.row, y.row, make("div", { class: "row" }, ...this.rest.map(([, label]) => label)));
  }

  fill({ select, low, high }) {
    const signal = this.studio.policy.signals.find(({ name }) => name === select.value);
    [low.value, high.value] = this.range(signal).map((value) => Number(value.toPrecision(4)));
  }

  async show() {
    const { studio } = this;
    if (!studio.policy || studio.policy.signals.length < 2) {
      at("map").replaceChildren(make("p", { class: "dim" }, "It takes a contract without faults that measures two signals."));
      return;
    }
    if (this.of !== studio.policy) {
      this.of = studio.policy;
      this.form();
    }
    const axis = ({ select, low, high }) => ({ signal: select.value, low: Number(low.value), high: Number(high.value), cells: CELLS });
    const [x, y] = [axis(this.x), axis(this.y)];
    for (const [name, label] of this.rest) label.hidden = [x.signal, y.signal].includes(name);
    const others = this.rest.map(([name, , input]) => [name, Number(input.value)]);
    const answer = await studio.compiler.ask({ ask: "map", contract: studio.contract, format: studio.format, output: studio.output, x, y, at: others });
    if (answer.faults) return at("map").replaceChildren(...faults(answer.faults));
    this.paint(answer, x, y);
  }

  paint({ duties, actions }, x, y) {
    const [low, high] = [Math.min(...duties), Math.max(...duties)];
    const share = (duty) => (high > low ? (duty - low) / (high - low) : 0.5);
    const canvas = make("canvas", { role: "img", "aria-label": `duty over ${x.signal} and ${y.signal}` });
    paint(canvas, x.cells, y.cells, (column, row) => share(duties[row * x.cells + column]));
    const said = make("p", { class: "dim" }, "Point at the map for values.");
    canvas.addEventListener("pointermove", (event) => {
      const box = canvas.getBoundingClientRect();
      const column = Math.min(x.cells - 1, Math.max(0, Math.floor(((event.clientX - box.left) / box.width) * x.cells)));
      const row = y.cells - 1 - Math.min(y.cells - 1, Math.max(0, Math.floor(((event.clientY - box.top) / box.height) * y.cells)));
      const centre = (axis, cell) => axis.low + ((axis.high - axis.low) * (cell + 0.5)) / axis.cells;
      const index = row * x.cells + column;
      const action = actions.length ? `, action ${actions[index]}` : "";
      said.textContent = `${x.signal} ${digits(centre(x, column))}, ${y.signal} ${digits(centre(y, row))}: duty ${digits(duties[index])}${action}`;
    });
    const scale = make("canvas");
    paint(scale, 64, 1, (column) => column / 63);
    const count = new Set(actions).size;
    const chosen = count ? ` ${count === 1 ? "One action is" : `${count} actions are`} chosen here.` : "";
    at("map").replaceChildren(
      make("div", { class: "scale" }, make("span", {}, `duty ${digits(low)}`), scale, make("span", {}, digits(high))),
      make("div", { class: "plot" },
        make("div", { class: "ends up" }, make("span", {}, digits(y.low)), make("span", {}, y.signal), make("span", {}, digits(y.high))), canvas,
        make("span"), make("div", { class: "ends" }, make("span", {}, digits(x.low)), make("span", {}, x.signal), make("span", {}, digits(x.high)))),
      said, make("p", { class: "dim" }, `${x.cells} × ${y.cells} measurements.${chosen}`));
  }
}
