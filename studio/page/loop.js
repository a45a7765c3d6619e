// The closed loop: sliders, and what they do.

import { draw } from "./chart.js";
import { at, digits, faults, latest, make } from "./dom.js";

/// Numbers of a plant that have a slider, as a person calls them.
const KNOBS = [
  ["converter.v_in", "source voltage"],
  ["converter.inductance", "inductance"],
  ["converter.capacitance", "output capacitance"],
  ["inductor.dcr", "winding resistance"],
  ["capacitor.esr", "ESR of the capacitor"],
  ["switch.r_ds_on", "on-resistance"],
  ["switch.v_f", "diode's forward voltage"],
  ["pwm.duty_delay", "delay of the duty"],
];
const BESIDE = ["pid", "cascade", "feed-forward", "deadbeat"];
const CLASSES = { policy: "s0", pid: "s1", cascade: "s2", "feed-forward": "s3", deadbeat: "s4" };

export class Loop {
  constructor(studio) {
    this.studio = studio;
    this.draw = latest(() => this.show());
    this.set = new Map();
    this.load = null;
    this.shown = 0;
    new ResizeObserver(() => this.paint()).observe(at("loop"));
  }

  /// Another policy or plant.
  reset() {
    this.set.clear();
    this.load = null;
    this.answer = null;
    this.scale = null;
    at("knobs").replaceChildren();
    at("steps").replaceChildren();
    at("loop").replaceChildren();
    at("whole").replaceChildren();
  }

  request() {
    const { contract, format, output, plant } = this.studio;
    const load = this.load ?? { unit: "W", steps: this.studio.steps ?? [[200, 500], [200, 800], [200, 1000], [500, 200], [800, 200], [1000, 200]], beside: ["pid"], after: 150 };
    this.load = load;
    return { ask: "loop", contract, format, output, plant, set: [...this.set], v_ref: this.studio.vRef ?? null, unit: load.unit, steps: load.steps, beside: load.beside, limit: true, after: load.after };
  }

  async show() {
    const { studio } = this;
    if (!studio.policy || !studio.plant) {
      at("loop").replaceChildren(make("p", { class: "dim" }, "It takes a contract without faults and a plant.toml: choose both on the left, or an example."));
      return;
    }
    const begun = performance.now();
    const answer = await studio.compiler.ask(this.request());
    this.took = performance.now() - begun;
    this.answer = answer;
    if (answer.faults) {
      at("loop").replaceChildren(...faults(answer.faults));
      if (!at("knobs").children.length) return;
    } else if (!at("knobs").children.length) this.knobs();
    this.paint();
  }

  knobs() {
    const { parameters } = this.studio.choices;
    const now = new Map(this.answer.plant);
    const knobs = KNOBS.map(([key, name]) => {
      const known = parameters.find((parameter) => parameter.key === key);
      const value = now.get(key);
      const whole = key === "pwm.duty_delay";
      const high = whole ? 3 : value > 0 ? 3 * value : known.typical[1];
      const low = whole ? 0 : key.startsWith("converter.") ? value / 3 : 0;
      return this.slider(name, known.unit === "1" ? "" : known.unit, Math.max(low, known.allowed[0]), Math.min(high, known.allowed[1]), value, whole ? 1 : "any", (chosen) => {
        this.set.set(key, chosen);
        this.draw();
      });
    });
    const [from, to] = this.load.steps[this.shown] ?? this.load.steps[0];
    const most = 2 * Math.max(...this.load.steps.flat());
    const load = (name, index, value) => this.slider(name, this.load.unit, 0, most, value, "any", (chosen) => {
      this.load.steps[this.shown][index] = Number(chosen.toPrecision(3));
      this.draw();
    });
    const beside = BESIDE.map((name) => make("label", {}, make("input", {
      type: "checkbox", checked: this.load.beside.includes(name), onchange: (event) => {
        this.load.beside = BESIDE.filter((other) => (other === name ? event.target.checked : this.load.beside.includes(other)));
        this.draw();
      },
    }), ` ${name}`));
    at("knobs").replaceChildren(
      load("load before", 0, from), load("load after", 1, to),
      make("fieldset", {}, make("legend", {}, "Beside the policy"), ...beside),
      make("h2", {}, "Plant"), ...knobs,
      make("button", { type: "button", onclick: () => { this.reset(); this.draw(); } }, "As in the file"));
  }

  slider(name, unit, low, high, value, step, moved) {
    const shown = make("span", { class: "value" }, `${digits(value)} ${unit}`);
    const input = make("input", { type: "range", min: low, max: high, step, value, "aria-label": name });
    input.addEventListener("input", () => {
      const chosen = Number(Number(input.value).toPrecision(4));
      shown.textContent = `${digits(chosen)} ${unit}`;
      moved(chosen);
    });
    return make("label", {}, name, shown, input);
  }

  paint() {
    const { answer } = this;
    if (!answer || answer.faults || !answer.steps?.length) return;
    const step = answer.steps[Math.min(this.shown, answer.steps.length - 1)];
    at("steps").replaceChildren(...answer.steps.map(({ from, to }, index) => make("button", {
      type: "button", "aria-pressed": String(index === this.shown), onclick: () => {
        this.shown = index;
        at("knobs").replaceChildren();
        this.knobs();
        this.paint();
      },
    }, `${digits(from)} → ${digits(to)} ${this.load.unit}`)));
    const longest = Math.max(...step.curves.map(({ metrics }) => metrics.settling), 0);
    const end = step.curves[0].time.at(-1);
    const period = this.studio.policy.sample_period;
    const until = Math.min(end, Math.max(1.5 * longest, 40 * period));
    const panels = [["output voltage (V)", "v_out"], ["inductor current (A)", "i_l"], ["duty", "duty"]].map(([title, key]) => ({
      title,
      steps: key === "duty",
      curves: step.curves.map((curve) => {
        const inside = curve.time.map((time, index) => [1e3 * time, curve[key][index]]).filter(([time]) => time <= 1e3 * until && time >= -1e4 * period);
        return { name: curve.name, class: CLASSES[curve.name] ?? "s5", x: inside.map(([time]) => time), y: inside.map(([, value]) => value) };
      }),
    }));
    panels[0].zone = [answer.v_ref - step.band, answer.v_ref + step.band];
    if (step.limit) panels[0].lines = [{ y: answer.v_ref + (this.draws(step.to) >= this.draws(step.from) ? -1 : 1) * step.limit[0] }];
    draw(at("loop"), panels, [-1e4 * period, 1e3 * until], "time from the load step (ms)", [240, 150, 120]);
    const row = (name, deviation, settling, mean) => make("tr", {}, make("td", {}, name), ...[deviation, 1e3 * settling, mean].map((value) => make("td", { class: "n" }, value === null ? "" : digits(value, 3))));
    const table = make("table", {}, make("thead", {}, make("tr", {}, ...["", "deviation, V", "settling, ms", "mean error at rest, V"].map((title, index) => make("th", index ? { class: "n" } : {}, title)))),
      make("tbody", {}, ...step.curves.map(({ name, metrics }) => row(name, metrics.deviation, metrics.settling, metrics.tail_mean)),
        ...(step.limit ? [row("limit (dashed)", step.limit[0], step.limit[1], null)] : [])));
    at("loop").append(make("div", { class: "table" }, table), ...answer.notes.map((note) => make("p", { class: "dim" }, `note: ${note}`)),
      make("p", { class: "dim" }, `${answer.steps.length} load steps at one sampling instant each, simulated in ${this.took.toFixed(0)} ms. policyc simulate tries many instants.`));
  }

  /// What a load draws, for its order alone.
  draws(value) {
    return this.load.unit === "ohm" ? -value : value;
  }
}
