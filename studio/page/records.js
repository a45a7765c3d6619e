// The diagnosis of records.

import { at, decode, faults, fileList, make } from "./dom.js";
import { report } from "./report.js";

export class Records {
  constructor(studio) {
    this.studio = studio;
    at("diagnose").addEventListener("click", () => this.diagnose());
    at("stop").addEventListener("click", () => studio.compiler.stop());
  }

  /// Other files.
  list() {
    const records = this.studio.of("record");
    const chosen = (id) => new Set([...document.querySelectorAll(`#${id} input:checked`)].map((input) => input.value));
    const [train, heldout] = [chosen("train"), chosen("heldout")];
    const first = train.size === 0;
    const box = (id, path, checked) => make("label", {}, make("input", { type: "checkbox", value: path, checked }), ` ${path}`);
    const fill = (id, legend, checked) => at(id).replaceChildren(make("legend", {}, legend),
      ...(records.length ? records.map((path, index) => box(id, path, checked(path, index))) : [make("span", { class: "dim" }, "no record yet: a CSV with time, duty, voltage, load")]));
    fill("train", "Records to explain", (path, index) => (first ? (this.studio.example?.train ?? [records[0]]).includes(path) : train.has(path)));
    fill("heldout", "Records that only judge", (path) => (first ? (this.studio.example?.heldout ?? []).includes(path) : heldout.has(path)));
    if (first) at("columns").value = this.studio.example?.map ?? "";
  }

  async diagnose() {
    const { studio } = this;
    const chosen = (id) => [...document.querySelectorAll(`#${id} input:checked`)].map((input) => input.value);
    const [train, heldout] = [chosen("train"), chosen("heldout")];
    if (!studio.plant || !train.length) {
      at("diagnosis").replaceChildren(make("p", { class: "dim" }, "It takes a plant.toml, chosen on the left, and a record."));
      return;
    }
    [at("diagnose").disabled, at("stop").hidden] = [true, false];
    at("diagnosis").replaceChildren();
    try {
      const answer = await studio.busy("diagnosing", { ask: "diagnose", model: studio.plant, train, heldout, map: at("columns").value });
      at("diagnosis").replaceChildren(...(answer.faults ? faults(answer.faults)
        : [make("pre", { tabindex: "0" }, answer.lines.join("\n")), ...fileList(answer.made), report(decode(answer.made["report.html"]))]));
    } catch (error) {
      studio.say(`diagnosis: ${error.message}`, error.message !== "stopped");
    } finally {
      [at("diagnose").disabled, at("stop").hidden] = [false, true];
    }
  }
}
