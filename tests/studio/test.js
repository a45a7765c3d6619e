// What the page makes of every example, as digests: the test holds them against what the command writes.

import { Compiler } from "./compiler.js";

const encode = (text) => new TextEncoder().encode(text);

async function digests(made) {
  const found = {};
  for (const [name, bytes] of Object.entries(made)) {
    const digest = new Uint8Array(await crypto.subtle.digest("SHA-256", bytes));
    found[name] = [...digest].map((byte) => byte.toString(16).padStart(2, "0")).join("");
  }
  return found;
}

async function all() {
  const compiler = new Compiler(() => {});
  const examples = await (await fetch("examples.json")).json();
  for (const path of new Set(examples.flatMap(({ files }) => files))) {
    await compiler.put(path, new Uint8Array(await (await fetch(`examples/${path}`)).arrayBuffer()));
  }
  const found = { policies: {} };
  for (const { contract, plant } of examples.filter((example) => example.contract)) {
    const code = await compiler.ask({ ask: "compile", contract, emit: ["c", "rust", "kit", "sfunction"], target: "host" });
    await compiler.put("check.toml", encode(`plant = "${plant}"\n${SCENARIO}`));
    const begun = performance.now();
    const loop = await compiler.ask({ ask: "simulate", contract, scenario: "check.toml" });
    const read = await compiler.ask({ ask: "read", contract });
    found.policies[contract] = {
      plant, faults: [code.faults, loop.faults, read.faults], inspect: read.inspect,
      code: await digests(code.made), loop: await digests(loop.made), ms: performance.now() - begun,
    };
  }
  const model = examples.find(({ train }) => train).plant;
  const diagnosis = await compiler.ask({ ask: "diagnose", model, train: ["diagnose/records/nothing-wrong.csv"] });
  found.diagnosis = { faults: diagnosis.faults, verdict: diagnosis.verdict, made: await digests(diagnosis.made) };
  const broken = new TextDecoder().decode(compiler.files.get("buck12/policy.toml")).replace("sample_period", "sample_perod");
  await compiler.put("buck12/policy.toml", encode(broken));
  found.faults = (await compiler.ask({ ask: "read", contract: "buck12/policy.toml" })).faults.map(({ text }) => text);
  return found;
}

const SCENARIO = "v_ref = 100.0\nload_steps = [[200, 500], [800, 200]]\ninstants = 3\nsampling_instants = 2\nlead = 60\nafter = 60\ntail = 20\nbaselines = [\"pid\"]\n";

all().then((found) => { window.found = JSON.stringify({ ...found, scenario: SCENARIO }); }, (error) => { window.found = JSON.stringify({ error: String(error.stack ?? error) }); });
