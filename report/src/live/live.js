// Makes the charts of a page answer: values under the pointer in all panels, zoom, series that come and go.
// Without it the pictures stand as they are; in print they always do.
(() => {
  "use strict";
  const ink = name => getComputedStyle(document.documentElement).getPropertyValue(name).trim();
  const make = (name, parent, text, properties = {}) => {
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

  // digits that a ten-thousandth of the span needs
  const writer = span => {
    const digits = Math.min(9, Math.max(0, 4 - Math.ceil(Math.log10(span || 1))));
    return value => value === null || value === undefined ? "–" : value.toFixed(digits).replace("-", "−");
  };

  // the value that a series shows at x: of a step the last before, otherwise the nearest
  const valueAt = ({ kind, x, y }, at) => {
    let low = 0, high = x.length;
    while (low < high) {
      const middle = (low + high) >> 1;
      if (x[middle] <= at) low = middle + 1; else high = middle;
    }
    if (low === 0) return kind === "step" ? null : y[0];
    if (kind === "step" || low === x.length) return y[low - 1];
    return at - x[low - 1] <= x[low] - at ? y[low - 1] : y[low];
  };

  const alive = (figure, number) => {
    const data = JSON.parse(figure.querySelector("script").textContent);
    const xs = data.xs.map(decode);
    const key = "chart" + number;
    const hidden = new Set();
    const box = make("div", figure, "", { className: "live" });
    figure.prepend(box);
    make("p", box, data.title, { className: "title" });
    const tools = make("div", box, "", { className: "tools" });
    const showX = writer(data.x.high - data.x.low);
    const plots = [];
    const rows = [];
    let moving = false;

    const panels = data.panels.map(panel => ({
      ...panel,
      show: writer(panel.high - panel.low),
      series: panel.series.map(series => ({ ...series, x: xs[series.x], y: decode(series.y), top: series.top && decode(series.top) })),
    }));

    const zoom = (min, max) => {
      const span = (data.x.high - data.x.low) / 2000;
      if (!(max - min >= span)) return;
      moving = true;
      for (const plot of plots) plot.setScale("x", { min: Math.max(min, data.x.low), max: Math.min(max, data.x.high) });
      moving = false;
    };
    const ends = () => [plots[0].scales.x.min, plots[0].scales.x.max];
    const isWhole = () => {
      const [min, max] = ends();
      return min <= data.x.low && max >= data.x.high;
    };
    const scaled = factor => () => {
      const [min, max] = ends(), middle = (min + max) / 2, half = (max - min) / 2 * factor;
      zoom(middle - half, middle + half);
    };
    for (const [text, label, act] of [["+", "zoom in", scaled(.5)], ["−", "zoom out", scaled(2)], ["whole", "show the whole", () => zoom(data.x.low, data.x.high)]]) {
      make("button", tools, text, { type: "button", title: label, onclick: act }).setAttribute("aria-label", label);
    }

    const read = at => {
      along.textContent = at === null ? data.x.label : `${data.x.label} ${showX(at)}`;
      for (const { name, cells } of rows) {
        panels.forEach((panel, index) => {
          const series = panel.series.find(series => series.name === name);
          if (!series) return;
          const value = at === null || hidden.has(name) ? null : valueAt(series, at);
          const top = series.top && value !== null ? `…${panel.show(valueAt({ ...series, y: series.top }, at))}` : "";
          cells[index].textContent = at === null ? "" : panel.show(value) + top;
        });
      }
    };

    const readout = make("table", make("div", box, "", { className: "readout", tabIndex: 0 }), "");
    readout.parentElement.setAttribute("role", "region");
    readout.parentElement.setAttribute("aria-label", `values under the pointer, chart ${number + 1}`);
    const head = make("tr", make("thead", readout), "");
    const along = make("th", head, data.x.label, { scope: "col" });
    for (const panel of panels) make("th", head, panel.label, { scope: "col", className: "n" });
    const body = make("tbody", readout);
    const names = [...new Set(panels.flatMap(panel => panel.series.map(series => series.name)))].filter(name => name);
    for (const name of names) {
      const row = make("tr", body);
      const button = make("button", make("th", row, "", { scope: "row" }), "", { type: "button", title: "show or hide" });
      button.setAttribute("aria-pressed", "true");
      const one = panels.flatMap(panel => panel.series).find(series => series.name === name);
      make("i", button).style.background = one.colour;
      button.append(name);
      button.onclick = () => {
        const isHidden = !hidden.delete(name) && Boolean(hidden.add(name));
        button.setAttribute("aria-pressed", String(!isHidden));
        for (const plot of plots) plot.series.forEach((series, index) => { if (index && series.label === name) plot.setSeries(index, { show: !isHidden }); });
      };
      rows.push({ name, cells: panels.map(() => make("td", row, "", { className: "n" })) });
    }

    const marks = panel => plot => {
      const { ctx, bbox } = plot, ratio = devicePixelRatio;
      ctx.save();
      ctx.beginPath();
      ctx.rect(bbox.left, bbox.top, bbox.width, bbox.height);
      ctx.clip();
      ctx.font = `${11 * ratio}px system-ui, sans-serif`;
      for (const mark of panel.marks) {
        const place = value => plot.valToPos(value, mark.on_x ? "x" : "y", true);
        const a = place(mark.from), b = place(mark.to);
        ctx.strokeStyle = ctx.fillStyle = ink("--dim");
        if (mark.from === mark.to) {
          ctx.setLineDash([4 * ratio, 3 * ratio]);
          ctx.beginPath();
          if (mark.on_x) { ctx.moveTo(a, bbox.top); ctx.lineTo(a, bbox.top + bbox.height); }
          else { ctx.moveTo(bbox.left, a); ctx.lineTo(bbox.left + bbox.width, a); }
          ctx.stroke();
          ctx.setLineDash([]);
        } else {
          ctx.globalAlpha = .16;
          if (mark.on_x) ctx.fillRect(Math.min(a, b), bbox.top, Math.abs(a - b), bbox.height);
          else ctx.fillRect(bbox.left, Math.min(a, b), bbox.width, Math.abs(a - b));
          ctx.globalAlpha = 1;
        }
        ctx.textAlign = mark.on_x ? "left" : "right";
        if (mark.on_x) ctx.fillText(mark.label, Math.min(a, b) + 5 * ratio, bbox.top + 13 * ratio);
        else ctx.fillText(mark.label, bbox.left + bbox.width - 6 * ratio, Math.min(a, b) + (mark.from === mark.to ? -4 : 13) * ratio);
      }
      ctx.restore();
    };

    // one finger reads, two zoom; up and down stay the page's
    const fingers = plot => {
      const down = new Map();
      let held = null;
      const x = event => plot.posToVal(event.clientX - plot.over.getBoundingClientRect().left, "x");
      plot.over.addEventListener("pointerdown", event => {
        if (event.pointerType === "mouse") return;
        down.set(event.pointerId, event.clientX);
        held = down.size === 2 ? [...down.values()].map(at => plot.posToVal(at - plot.over.getBoundingClientRect().left, "x")) : null;
      });
      plot.over.addEventListener("pointermove", event => {
        if (event.pointerType === "mouse") return;
        if (down.has(event.pointerId)) down.set(event.pointerId, event.clientX);
        const rect = plot.over.getBoundingClientRect();
        if (held) {
          const [p, q] = [...down.values()].map(at => (at - rect.left) / rect.width);
          const span = (held[1] - held[0]) / (q - p);
          if (span > 0) zoom(held[0] - p * span, held[0] + (1 - p) * span);
        } else {
          plot.setCursor({ left: event.clientX - rect.left, top: event.clientY - rect.top });
          read(x(event));
        }
      });
      for (const end of ["pointerup", "pointercancel", "pointerleave"]) {
        plot.over.addEventListener(end, event => { down.delete(event.pointerId); held = null; });
      }
    };

    const width = () => Math.max(240, box.clientWidth);
    panels.forEach((panel, index) => {
      const isLast = index === panels.length - 1;
      make("p", box, panel.label, { className: "axis" });
      const tables = [], series = [{}], bands = [];
      for (const one of panel.series) {
        const common = { label: one.name, stroke: one.colour, width: 1.6, points: { show: false }, dash: one.dashed ? [6, 4] : undefined, show: true, spanGaps: false };
        if (one.kind === "step") common.paths = uPlot.paths.stepped({ align: 1 });
        if (one.kind === "points") Object.assign(common, { paths: () => null, points: { show: true, size: 7, fill: one.colour, stroke: one.colour } });
        if (one.kind === "band") {
          Object.assign(common, { width: 0 });
          bands.push({ series: [series.length + 1, series.length], fill: one.colour + "38" });
          series.push(common);
          tables.push([one.x, one.y]);
          series.push({ ...common });
          tables.push([one.x, one.top]);
        } else {
          series.push(common);
          tables.push([one.x, one.y]);
        }
      }
      const place = make("div", box, "", { className: "plot" });
      const axis = { stroke: () => ink("--dim"), font: "12px system-ui, sans-serif", grid: { stroke: () => ink("--line"), width: 1 }, ticks: { stroke: () => ink("--line"), width: 1, size: 4 } };
      const plot = new uPlot({
        width: width(),
        height: (innerWidth < 600 ? .75 : 1) * panel.height + (isLast ? 30 : 8),
        legend: { show: false },
        padding: [6, 8, 0, 0],
        cursor: { sync: { key, setSeries: false }, drag: { x: true, y: false, dist: 4 }, points: { size: 6 }, focus: { prox: -1 } },
        scales: {
          x: { time: false, range: (plot, low, high) => [low ?? data.x.low, high ?? data.x.high] },
          y: { range: (plot, low, high) => {
            if (!plots.length || !plots[0].scales.x || isWhole() || low === null || panel.fixed) return [panel.low, panel.high];
            const free = (high - low || Math.abs(high) || 1) * .06;
            return [low - free, high + free];
          } },
        },
        axes: [
          { ...axis, size: isLast ? 30 : 6, values: isLast ? undefined : (_, ticks) => ticks.map(() => "") },
          { ...axis, size: 58 },
        ],
        series,
        bands,
        hooks: {
          draw: [marks(panel)],
          setCursor: [plot => { if (plot.cursor.left >= 0) read(plot.posToVal(plot.cursor.left, "x")); }],
          setScale: [(plot, scale) => { if (scale === "x" && !moving && plots.length === panels.length) zoom(plot.scales.x.min, plot.scales.x.max); }],
          ready: [fingers],
        },
      }, uPlot.join(tables), place);
      place.addEventListener("dblclick", () => zoom(data.x.low, data.x.high));
      place.addEventListener("mouseleave", () => read(null));
      plots.push(plot);
    });
    zoom(data.x.low, data.x.high);

    read(null);
    figure.classList.add("answers");
    new ResizeObserver(() => {
      for (const plot of plots) if (plot.width !== width()) plot.setSize({ width: width(), height: plot.height });
    }).observe(box);
    matchMedia("(prefers-color-scheme: dark)").addEventListener("change", () => { for (const plot of plots) plot.redraw(); });
  };

  document.querySelectorAll("figure.data").forEach((figure, number) => {
    try { alive(figure, number); } catch (reason) { figure.querySelector(".live")?.remove(); figure.classList.remove("answers"); console.error(reason); }
  });
})();
