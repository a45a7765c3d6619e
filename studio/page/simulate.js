// All instants of the load steps, as `policyc simulate` tries them.

import { at, decode, encode, faults, fileList, make } from "./dom.js";
import { report } from "./report.js";

const OWN = "studio-scenario.toml";

/// The scenario that the sliders stand for.
function text({ load, set }, { plant, vRef }) {
  const key = { W: "load_steps", A: "current_steps", ohm: "resistance_steps" }[load.unit];
  const lines = [
    "# From policyc studio.",
    `plant = ${JSON.stringify(plant)}`,
    ...(vRef ? [`v_ref = ${vRef}`] : []),
    `${key} = ${JSON.stringify(load.steps)}   # ${load.unit}`,
    `baselines = ${JSON.stringify(load.beside)}`,
  ];
  if (set.size) lines.push("", "[set]", ...[...set].map(([name, value]) => `"${name}" = ${value}`));
  return `${lines.join("\n")}\n`;
}

/// The part of the view below the sliders.
export function whole(studio, loop) {
  const own = "these load steps and sliders";
  const select = make("select", { "aria-label": "scenario" }, make("option", { value: OWN }, own),
    ...studio.of("scenario").map((path) => make("option", { value: path }, path)));
  const out = make("div", { "aria-live": "polite" });
  const button = make("button", { type: "button" }, "Simulate at every instant");
  button.addEventListener("click", async () => {
    const scenario = select.value;
    button.disabled = true;
    try {
      if (scenario === OWN) await studio.compiler.put(OWN, encode(text(loop, studio)));
      const answer = await studio.busy("simulating", { ask: "simulate", contract: studio.contract, format: studio.format, output: studio.output, scenario });
      if (scenario === OWN && answer.made) answer.made[OWN] = studio.compiler.files.get(OWN);
      out.replaceChildren(...(answer.faults ? faults(answer.faults)
        : [make("pre", { tabindex: "0" }, answer.summary), ...fileList(answer.made), report(decode(answer.made["report.html"]))]));
    } finally {
      button.disabled = false;
    }
  });
  at("whole").replaceChildren(make("h2", {}, "As policyc simulate"), make("div", { class: "out" }, select, button), out);
}
