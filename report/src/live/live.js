// Makes the charts of a page answer: values under the pointer in all panels, zoom, series that come and go.
// Without it the pictures stand as they are; in print they always do.
(() => {
  "use strict";
  const FONT = "system-ui, sans-serif";
  const ink = name => getComputedStyle(document.documentElement).getPropertyValue(name).trim();
  const make = (name, parent, text = "", properties = {}) => {
    const element = Object.assign(document.createElement(name), properties);
    if (text) element.textContent = text;
    parent.append(element);
    return element;
  };

  // 16 bits a value, low byte first, even steps from one end to the other; all bits set: no value
  const decode = ({ codes, from, to }) => {
    const bytes = atob(codes);
    return Array.from({ length: bytes.length >> 1 }, (_, n) => {
      const code = bytes.charCodeAt(2 * n) | bytes.charCodeAt(2 * n + 1) << 8;
      return code === 65535 ? null : from + code / 65534 * (to - from);
    });
  };

  // what rounds to 0 has no sign
  const text = (value, digits) => value.toFixed(digits).replace(/^-(?=[0.]*[1-9])/, "−").replace(/^-/, "");

  // digits that a ten-thousandth of the span needs
  const writer = span => {
    const digits = Math.min(9, Math.max(0, 4 - Math.ceil(Math.log10(span || 1))));
    return value => value === null || value === undefined ? "–" : text(value, digits);
  };

  // labels of an axis, with as many digits as their distance needs
  const labels = (ticks, step) => {
    let digits = 0;
    // a step of 0.025 has three
    while (digits < 9 && Math.abs(step * 10 ** digits - Math.round(step * 10 ** digits)) > 1e-6 * step * 10 ** digits) digits++;
    return ticks.map(value => value === null ? "" : text(value, digits));
  };

  // px between ticks of a horizontal axis: a label of 12 px, whose decimals are those of a tenth of what is shown, and a gap
  const roomFor = (plot, axis, low, high) => {
    const decimals = Math.max(0, Math.ceil(1 - Math.log10(high - low || 1)));
    const longest = Math.max(low.toFixed(Math.min(decimals, 9)).length, high.toFixed(Math.min(decimals, 9)).length);
    // two more: steps of 2.5 have a digit more, and a sign
    return Math.max(50, 7 * (longest + 2) + 16);
  };

  // lowest and highest value within a stretch of x; nothing where there is none
  const extent = (x, columns, from, to) => {
    let low = Infinity, high = -Infinity;
    for (const values of columns) {
      values.forEach((value, n) => {
        if (value === null || x[n] < from || x[n] > to) return;
        low = Math.min(low, value);
        high = Math.max(high, value);
      });
    }
    return low <= high ? [low, high] : null;
  };

  // the value that a series shows at x: of a step the last before, otherwise the nearest
  const valueAt = (kind, x, y, at) => {
    let low = 0, high = x.length;
    while (low < high) {
      const middle = (low + high) >> 1;
      if (x[middle] <= at) low = middle + 1; else high = middle;
    }
    if (low === 0) return kind === "step" ? null : y[0];
    if (kind === "step" || low === x.length) return y[low - 1];
    return at - x[low - 1] <= x[low] - at ? y[low - 1] : y[low];
  };

  // lines and stripes across a panel, with their labels
  const drawMarks = (plot, marks) => {
    const { ctx, bbox } = plot, ratio = devicePixelRatio;
    ctx.save();
    ctx.beginPath();
    ctx.rect(bbox.left, bbox.top, bbox.width, bbox.height);
    ctx.clip();
    ctx.font = `${11 * ratio}px ${FONT}`;
    // beside the line, else on its other side, else further along, as the still picture has them
    const taken = [];
    const room = (label, places) => {
      const width = ctx.measureText(label).width + 12 * ratio, high = 13 * ratio;
      const isFree = ([x, y]) => taken.every(other => Math.abs(other.y - y) >= high || x <= other.x - other.width || other.x <= x - width);
      const [x, y] = places.find(isFree) ?? [places[0][0] - taken.reduce((sum, other) => sum + other.width, 0), places[0][1]];
      taken.push({ x, y, width });
      return [x, y];
    };
    for (const { on_x: isX, from, to, label } of marks) {
      const [a, b] = [from, to].map(value => plot.valToPos(value, isX ? "x" : "y", true)).sort((a, b) => a - b);
      ctx.strokeStyle = ctx.fillStyle = ink("--dim");
      if (from === to) {
        ctx.setLineDash([4 * ratio, 3 * ratio]);
        ctx.beginPath();
        ctx.moveTo(isX ? a : bbox.left, isX ? bbox.top : a);
        ctx.lineTo(isX ? a : bbox.left + bbox.width, isX ? bbox.top + bbox.height : a);
        ctx.stroke();
        ctx.setLineDash([]);
      } else {
        ctx.globalAlpha = .16;
        if (isX) ctx.fillRect(a, bbox.top, b - a, bbox.height); else ctx.fillRect(bbox.left, a, bbox.width, b - a);
        ctx.globalAlpha = 1;
      }
      ctx.textAlign = isX ? "left" : "right";
      if (isX) ctx.fillText(label, a + 5 * ratio, bbox.top + 13 * ratio);
      else {
        const end = bbox.left + bbox.width - 6 * ratio;
        const beside = (from === to ? [-4, 13] : [13, 26]).map(by => [end, a + by * ratio]);
        ctx.fillText(label, ...room(label, beside));
      }
    }
    ctx.restore();
  };

  // what uPlot draws of a series; a band is two of them with a surface between
  const layers = panel => {
    const tables = [], series = [{}], bands = [];
    for (const { name, colour, kind, dashed, x, y, top } of panel.series) {
      const line = { label: name, stroke: colour, width: kind === "band" ? 0 : 1.6, points: { show: false }, dash: dashed ? [6, 4] : undefined };
      if (kind === "step") line.paths = uPlot.paths.stepped({ align: 1 });
      if (kind === "points") Object.assign(line, { paths: () => null, points: { show: true, size: 7, fill: colour, stroke: colour } });
      if (kind === "band") bands.push({ series: [series.length + 1, series.length], fill: colour + "38" });
      for (const values of kind === "band" ? [y, top] : [y]) {
        series.push({ ...line });
        tables.push([x, values]);
      }
    }
    return { series, bands, table: uPlot.join(tables) };
  };

  class Live {
    constructor(figure, number) {
      const data = JSON.parse(figure.querySelector("script").textContent);
      const xs = data.xs.map(decode);
      const series = one => ({ ...one, x: xs[one.x], y: decode(one.y), top: one.top && decode(one.top) });
      this.alt = figure.querySelector("svg").getAttribute("aria-label");
      this.x = data.x;
      this.panels = data.panels.map(panel => ({ ...panel, show: writer(panel.high - panel.low), series: panel.series.map(series) }));
      this.key = `chart${number}`;
      this.hidden = new Set();
      this.plots = [];
      this.rows = [];
      this.isMoving = false;
      this.side = Math.max(...this.panels.map(panel => this.widest(panel)));
      this.box = make("div", figure, "", { className: "live" });
      figure.prepend(this.box);
      make("p", this.box, data.title, { className: "title" });
      this.addTools();
      this.addReadout(number);
      this.panels.forEach((panel, index) => this.addPlot(panel, index));
      make("p", this.box, data.x.label, { className: "axis along" });
      this.zoom(this.x.low, this.x.high);
      this.read(null);
      figure.classList.add("answers");
      new ResizeObserver(() => this.fit()).observe(this.box);
      matchMedia("(prefers-color-scheme: dark)").addEventListener("change", () => this.plots.forEach(plot => plot.redraw()));
    }

    // room for the numbers of a vertical axis, with the digit more that a stretch needs
    widest({ low, high }) {
      const longest = Math.max(...labels([low, high], 10 ** Math.floor(Math.log10((high - low) / 50 || 1))).map(text => text.length));
      return Math.max(40, 14 + 7 * longest);
    }

    width() {
      return Math.max(240, this.box.clientWidth - 20);
    }

    fit() {
      for (const plot of this.plots) if (plot.width !== this.width()) plot.setSize({ width: this.width(), height: plot.height });
    }

    ends() {
      const { min, max } = this.plots[0].scales.x;
      return [min, max];
    }

    isWhole() {
      const [min, max] = this.plots.length ? this.ends() : [null, null];
      return min === null || min === undefined || min <= this.x.low && max >= this.x.high;
    }

    // all panels show the same stretch
    zoom(min, max) {
      if (!(max - min >= (this.x.high - this.x.low) / 2000)) return;
      this.isMoving = true;
      const ends = { min: Math.max(min, this.x.low), max: Math.min(max, this.x.high) };
      for (const plot of this.plots) plot.setScale("x", ends);
      this.isMoving = false;
      this.stretch = ends;
      if (this.isAtRest) this.read(null);
    }

    addTools() {
      const tools = make("div", this.box, "", { className: "tools" });
      const scaled = factor => () => {
        const [min, max] = this.ends(), middle = (min + max) / 2, half = (max - min) / 2 * factor;
        this.zoom(middle - half, middle + half);
      };
      const whole = () => this.zoom(this.x.low, this.x.high);
      for (const [text, label, onclick] of [["+", "zoom in", scaled(.5)], ["−", "zoom out", scaled(2)], ["whole", "show the whole", whole]]) {
        make("button", tools, text, { type: "button", title: label, onclick }).setAttribute("aria-label", label);
      }
    }

    // the legend, with the values under the pointer
    addReadout(number) {
      const region = make("div", this.box, "", { className: "readout", tabIndex: 0 });
      region.setAttribute("role", "region");
      region.setAttribute("aria-label", `values under the pointer, chart ${number + 1}`);
      const table = make("table", region);
      const head = make("tr", make("thead", table));
      this.along = make("th", head, this.x.label, { scope: "col" });
      for (const panel of this.panels) make("th", head, panel.label, { scope: "col", className: "n" });
      const body = make("tbody", table);
      const all = this.panels.flatMap(panel => panel.series);
      for (const name of new Set(all.map(series => series.name).filter(name => name))) {
        const row = make("tr", body);
        const button = make("button", make("th", row, "", { scope: "row" }), "", { type: "button", title: "show or hide" });
        button.setAttribute("aria-pressed", "true");
        const { colour, dashed } = all.find(series => series.name === name);
        make("i", button).style.background = dashed ? `repeating-linear-gradient(90deg, ${colour} 0 5px, #0000 5px 9px)` : colour;
        button.append(name);
        button.onclick = () => button.setAttribute("aria-pressed", String(this.toggle(name)));
        this.rows.push({ name, cells: this.panels.map(panel => {
          const cell = make("td", row, "", { className: "n" });
          cell.dataset.of = panel.label;
          return cell;
        }) });
      }
    }

    // whether it is shown from now on
    toggle(name) {
      const isShown = this.hidden.delete(name);
      if (!isShown) this.hidden.add(name);
      for (const plot of this.plots) plot.series.forEach((series, index) => { if (index && series.label === name) plot.setSeries(index, { show: isShown }); });
      return isShown;
    }

    // the values at x, or those that the stretch reaches where nobody points
    read(at) {
      this.isAtRest = at === null;
      const along = writer(this.x.high - this.x.low);
      this.along.textContent = this.isAtRest ? "lowest … highest" : `${this.x.label} ${along(at)}`;
      const { min, max } = this.stretch ?? { min: this.x.low, max: this.x.high };
      for (const { name, cells } of this.rows) {
        this.panels.forEach((panel, index) => {
          const series = panel.series.find(series => series.name === name);
          if (!series) return;
          const columns = series.top ? [series.y, series.top] : [series.y];
          const values = this.hidden.has(name) ? [null]
            : this.isAtRest ? extent(series.x, columns, min, max) ?? [null]
            : columns.map(values => valueAt(series.kind, series.x, values, at));
          cells[index].textContent = [...new Set(values.map(panel.show))].join(" … ");
        });
      }
    }

    addPlot(panel, index) {
      const isLast = index === this.panels.length - 1;
      make("p", this.box, panel.label, { className: "axis" });
      const place = make("div", this.box, "", { className: "plot" });
      place.setAttribute("role", "img");
      place.setAttribute("aria-label", this.alt);
      const { series, bands, table } = layers(panel);
      const line = { stroke: () => ink("--line"), width: 1 };
      const axis = { stroke: () => ink("--dim"), font: `12px ${FONT}`, grid: line, ticks: { ...line, size: 4 } };
      // a stretch is shown as high as its own values go, unless the chart says how high
      const height = (_, low, high) => {
        if (this.isWhole() || low === null || panel.fixed) return [panel.low, panel.high];
        const free = (high - low || Math.abs(high) || 1) * .06;
        return [low - free, high + free];
      };
      this.plots.push(new uPlot({
        width: this.width(),
        height: (innerWidth < 600 ? .75 : 1) * panel.height + (isLast ? 30 : 8),
        padding: [6, 8, 0, 0],
        legend: { show: false },
        cursor: { sync: { key: this.key, setSeries: false }, drag: { x: true, y: false, dist: 4 }, points: { size: 6 } },
        scales: { x: { time: false, range: (_, low, high) => [low ?? this.x.low, high ?? this.x.high] }, y: { range: height } },
        axes: [{ ...axis, size: isLast ? 30 : 6, space: roomFor, values: (_, ticks, __, ___, step) => isLast ? labels(ticks, step) : ticks.map(() => "") },
          { ...axis, size: this.side, values: (_, ticks, __, ___, step) => labels(ticks, step) }],
        series,
        bands,
        hooks: {
          draw: [plot => drawMarks(plot, panel.marks)],
          setCursor: [plot => { if (plot.cursor.left >= 0) this.read(plot.posToVal(plot.cursor.left, "x")); }],
          setScale: [(plot, scale) => { if (scale === "x" && !this.isMoving && this.plots.length === this.panels.length) this.zoom(plot.scales.x.min, plot.scales.x.max); }],
          ready: [plot => this.addFingers(plot)],
        },
      }, table, place));
      place.addEventListener("dblclick", () => this.zoom(this.x.low, this.x.high));
      place.addEventListener("mouseleave", () => this.read(null));
    }

    // one finger reads, two zoom; up and down stay the page's
    addFingers(plot) {
      const down = new Map();
      let held = null;
      const left = at => at - plot.over.getBoundingClientRect().left;
      const onTouch = (name, act) => plot.over.addEventListener(name, event => { if (event.pointerType !== "mouse") act(event); });
      const both = () => [...down.values()].map(left);
      onTouch("pointerdown", event => {
        down.set(event.pointerId, event.clientX);
        held = down.size === 2 ? both().map(at => plot.posToVal(at, "x")) : null;
      });
      onTouch("pointermove", event => {
        if (down.has(event.pointerId)) down.set(event.pointerId, event.clientX);
        if (held) {
          const [p, q] = both().map(at => at / plot.over.clientWidth);
          const span = (held[1] - held[0]) / (q - p);
          if (span > 0) this.zoom(held[0] - p * span, held[0] + (1 - p) * span);
        } else {
          plot.setCursor({ left: left(event.clientX), top: plot.over.clientHeight / 2 });
          this.read(plot.posToVal(left(event.clientX), "x"));
        }
      });
      for (const end of ["pointerup", "pointercancel", "pointerleave"]) {
        onTouch(end, event => { down.delete(event.pointerId); held = null; });
      }
    }
  }

  document.querySelectorAll("figure.data").forEach((figure, number) => {
    try {
      new Live(figure, number);
    } catch (reason) {
      // the picture stays
      figure.querySelector(".live")?.remove();
      figure.classList.remove("answers");
      console.error(reason);
    }
  });
})();
