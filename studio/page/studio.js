// The page: files on one side, views of them on the other.

import { Compiler } from "./compiler.js";
import { at, choose, decode, download, encode, faults, fileList, latest, make, size } from "./dom.js";
import { Loop } from "./loop.js";
import { DecisionMap } from "./map.js";
import { Records } from "./records.js";
import { whole } from "./simulate.js";

const VIEWS = ["contract", "code", "map", "loop", "records"];
/// What a view will ask that is fetched apart.
const LATER = { code: "compile", records: "diagnose" };

/// What a file is for, by its name and content.
function kind(path, content) {
  if (/\.(csv|txt|tsv|mat|mf4)$/i.test(path)) return "record";
  if (/\.(zip|onnx|pt|pth|safetensors|npz|npy)$/i.test(path)) return "model";
  if (!/\.toml$/i.test(path)) return "other";
  const text = decode(content);
  if (/^\s*(\[converter\]|converter\s*[.=])/m.test(text)) return "plant";
  if (/^\s*(\[network\]|network\s*[.=]|\[+signal\]+|signal\s*=)/m.test(text)) return "contract";
  if (/^\s*(load_steps|current_steps|resistance_steps|baselines|plant|limit)\s*=/m.test(text)) return "scenario";
  return "other";
}

class Studio {
  constructor() {
    this.compiler = new Compiler((what) => this.say(`${this.doing ?? "working"}: ${what}`));
    this.kinds = new Map();
    this.read = latest(() => this.show());
    this.loop = new Loop(this);
    this.map = new DecisionMap(this);
    this.records = new Records(this);
    this.view = VIEWS.includes(location.hash.slice(1)) ? location.hash.slice(1) : "contract";
  }

  get contract() { return at("contract").value; }
  get format() { return at("format").value || null; }
  /** Of a contract with several outputs the one that drives the plant. */
  get output() { return at("of-output").hidden ? null : at("output").value; }
  get plant() { return at("plant").value; }

  /// Paths of a kind.
  of(wanted) {
    return [...this.kinds].filter(([, one]) => one === wanted).map(([path]) => path).sort();
  }

  say(text, wrong = false) {
    at("status").textContent = text;
    at("status").classList.toggle("wrong", wrong);
  }

  /// An answer that takes long.
  async busy(doing, request) {
    this.doing = doing;
    const begun = performance.now();
    this.say(`${doing} …`);
    const answer = await this.compiler.ask(request);
    this.say(answer.faults ? `${doing}: not done` : `${doing}: done in ${((performance.now() - begun) / 1000).toFixed(1)} s`, Boolean(answer.faults));
    return answer;
  }

  async start() {
    this.choices = await this.compiler.ask({ ask: "choices" });
    choose(at("format"), [["", "as the contract says"], ...this.choices.formats.map((name) => [name, name])]);
    choose(at("target"), this.choices.targets.map((name) => [name, name]), "host");
    at("outputs").append(...this.choices.outputs.map(([name, meaning]) =>
      make("label", {}, make("input", { type: "checkbox", value: name, checked: ["c", "rust"].includes(name) }), ` ${name}: ${meaning}`)));
    this.examples = await (await fetch("examples.json")).json();
    at("examples").append(...this.examples.map(({ name }, index) => make("option", { value: index }, name)));
    this.say("Ready. Choose files, or an example.");
    this.listen();
    this.select(this.view);
  }

  listen() {
    at("choose").addEventListener("change", (event) => this.take([...event.target.files].map((file) => [file.name, file])));
    at("examples").addEventListener("change", (event) => this.pick(this.examples[event.target.value]));
    at("clear").addEventListener("click", () => this.clear().then(() => this.changed()));
    at("contract").addEventListener("change", () => this.other());
    at("plant").addEventListener("change", () => this.other());
    at("format").addEventListener("change", () => { this.loop.answer = null; this.read(); });
    at("output").addEventListener("change", () => { this.loop.answer = null; this.read(); });
    at("edit").addEventListener("input", () => this.edited());
    at("save").addEventListener("click", () => download(this.contract, this.compiler.files.get(this.contract)));
    at("compile").addEventListener("click", () => this.compile());
    for (const name of VIEWS) {
      at(`tab-${name}`).addEventListener("click", () => this.select(name));
      at(`tab-${name}`).addEventListener("keydown", (event) => this.arrow(name, event.key));
    }
    const drop = document.documentElement;
    drop.addEventListener("dragover", (event) => { event.preventDefault(); at("drop").classList.add("over"); });
    drop.addEventListener("dragleave", () => at("drop").classList.remove("over"));
    drop.addEventListener("drop", (event) => { event.preventDefault(); at("drop").classList.remove("over"); this.dropped(event.dataTransfer); });
  }

  arrow(name, key) {
    const place = VIEWS.indexOf(name), last = VIEWS.length - 1;
    const to = { ArrowRight: place === last ? 0 : place + 1, ArrowLeft: place === 0 ? last : place - 1, Home: 0, End: last }[key];
    if (to === undefined) return;
    const next = VIEWS[to];
    this.select(next);
    at(`tab-${next}`).focus();
  }

  select(view) {
    this.view = view;
    history.replaceState(null, "", `#${view}`);
    for (const name of VIEWS) {
      at(`tab-${name}`).setAttribute("aria-selected", String(name === view));
      at(`tab-${name}`).tabIndex = name === view ? 0 : -1;
      at(`panel-${name}`).hidden = name !== view;
    }
    if (LATER[view]) this.compiler.prepare(LATER[view]);
    this.refresh();
  }

  /// What the view in front shows.
  refresh() {
    if (this.view === "map") this.map.draw();
    if (this.view === "loop") this.loop.draw().then(() => this.policy && this.plant && whole(this, this.loop));
    if (this.view === "records") this.records.list();
  }

  /// Files out of folders as well.
  async dropped(transfer) {
    const found = [];
    const walk = async (entry, path) => {
      if (entry.isFile) return found.push([path + entry.name, await new Promise((done, failed) => entry.file(done, failed))]);
      const reader = entry.createReader();
      for (let batch; (batch = await new Promise((done, failed) => reader.readEntries(done, failed))).length;) {
        for (const inner of batch) await walk(inner, `${path}${entry.name}/`);
      }
    };
    // all at once: the list is empty after the first pause; what is no entry of a file system may still be a file
    const items = [...transfer.items].map((item) => [item.webkitGetAsEntry?.(), item.kind === "file" ? item.getAsFile() : null]);
    for (const [entry, file] of items) {
      if (entry) await walk(entry, "");
      else if (file) found.push([file.name, file]);
    }
    this.take(found);
  }

  async take(list) {
    const models = [];
    for (const [path, file] of list) {
      const content = new Uint8Array(await file.arrayBuffer());
      this.put(path, content);
      if (this.kinds.get(path) === "model") models.push(path);
    }
    this.example = null;
    // weights beside a contract are the contract's; a trainer's file alone asks for a contract
    if (models.length && !this.of("contract").length) await this.newContract(models[0]);
    this.changed();
  }

  put(path, content) {
    this.kinds.set(path, kind(path, content));
    return this.compiler.put(path, content);
  }

  async newContract(path) {
    const contract = path.replace(/[^/]*$/, "policy.toml");
    const answer = await this.busy(`policyc new ${path}`, { ask: "new", file: path, contract });
    if (answer.faults) return this.refused(answer.faults);
    for (const [name, content] of Object.entries(answer.made)) this.put(name, content);
    this.said = answer.said;
  }

  async clear() {
    for (const path of [...this.compiler.files.keys()]) await this.compiler.forget(path);
    this.kinds.clear();
    this.said = null;
  }

  async pick(example) {
    if (!example) return;
    this.say(`fetching ${example.name} …`);
    await this.clear();
    const all = await Promise.all(example.files.map(async (path) => {
      const response = await fetch(`examples/${path}`);
      if (!response.ok) throw new Error(`examples/${path}: ${response.status}`);
      return [path, new Uint8Array(await response.arrayBuffer())];
    }));
    for (const [path, content] of all) this.put(path, content);
    this.example = example;
    document.querySelectorAll("#train input, #heldout input").forEach((input) => { input.checked = false; });
    this.say(example.what);
    this.changed();
    if (example.view) this.select(example.view);
  }

  /// Files came or went.
  changed() {
    const paths = [...this.kinds.keys()].sort();
    at("clear").hidden = !paths.length;
    at("files").replaceChildren(...(paths.length ? paths.map((path) => make("li", {}, make("span", {}, `${path} `, make("span", { class: "dim" }, size(this.compiler.files.get(path).length))),
      make("button", { type: "button", "aria-label": `remove ${path}`, onclick: () => { this.compiler.forget(path); this.kinds.delete(path); this.changed(); } }, "✕"))) : [make("li", { class: "dim" }, "none yet")]));
    const none = ["", "none"];
    const list = (wanted) => (this.of(wanted).length ? this.of(wanted).map((path) => [path, path]) : [none]);
    choose(at("contract"), list("contract"), this.example?.contract);
    choose(at("plant"), list("plant"), this.example?.plant);
    this.other();
  }

  /// Another contract or plant.
  other() {
    if (!this.example) this.say("");
    this.loop.reset();
    this.map.reset();
    at("compiled").replaceChildren();
    at("made").replaceChildren();
    const content = this.compiler.files.get(this.contract);
    at("edit-box").hidden = !content;
    at("edit").value = content ? decode(content) : "";
    this.read();
  }

  edited() {
    this.put(this.contract, encode(at("edit").value));
    clearTimeout(this.pause);
    this.pause = setTimeout(this.read, 250);
  }

  refused(list) {
    this.policy = null;
    const count = `${list.length === 1 ? "a fault" : "faults"}: nothing can be made of it`;
    at("verdict").className = "verdict fail";
    at("verdict").textContent = `${this.contract || "The file"} has ${count}.`;
    at("faults").replaceChildren(...faults(list));
    at("inspect").textContent = "–";
  }

  /// Puts the cursor of the editor where a fault is.
  places(answer) {
    const own = answer.places.filter(([file]) => file === this.contract);
    const go = ([, line, column]) => {
      const edit = at("edit");
      const start = edit.value.split("\n").slice(0, line - 1).reduce((sum, text) => sum + text.length + 1, 0) + column - 1;
      edit.focus();
      edit.setSelectionRange(start, start + 1);
      edit.scrollTop = Math.max(0, (line - 6) * 1.45 * 13);
    };
    return make("div", { class: "out" }, ...own.slice(0, 12).map((place) => make("button", { type: "button", onclick: () => go(place) }, `to line ${place[1]}`)));
  }

  async show() {
    if (!this.contract) {
      this.policy = null;
      at("verdict").className = "verdict note";
      at("verdict").textContent = "No contract yet.";
      at("faults").replaceChildren();
      at("inspect").textContent = "–";
      return this.refresh();
    }
    const answer = await this.compiler.ask({ ask: "read", contract: this.contract, format: this.format });
    if (answer.faults) {
      this.refused(answer.faults);
      at("faults").append(this.places(answer));
      return this.refresh();
    }
    this.policy = answer;
    at("of-output").hidden = !answer.outputs.length;
    choose(at("output"), answer.outputs.map((name) => [name, name]));
    at("verdict").className = `verdict ${answer.different ? "fail" : "pass"}`;
    at("verdict").textContent = answer.different ?? `${answer.name} is sound: ${answer.features} features, ${answer.outputs.length ? `${answer.outputs.length} outputs` : answer.actions ? `${answer.actions} actions` : "one commanded number"}, ${answer.format}.`;
    at("faults").replaceChildren(...(this.said ?? []).map((said) => make("p", { class: "dim" }, said)));
    at("inspect").textContent = answer.inspect;
    this.refresh();
  }

  async compile() {
    const emit = [...document.querySelectorAll("#outputs input:checked")].map((input) => input.value);
    const answer = await this.busy("compiling", { ask: "compile", contract: this.contract, format: this.format, emit, target: at("target").value });
    if (answer.faults) {
      at("compiled").replaceChildren(...faults(answer.faults));
      return at("made").replaceChildren();
    }
    at("compiled").replaceChildren(make("p", {}, answer.sizes), ...answer.notes.map((note) => make("p", { class: "dim" }, `note: ${note}`)));
    at("made").replaceChildren(...fileList(answer.made));
  }
}

const studio = new Studio();
studio.start().catch((error) => studio.say(`The compiler could not be started: ${error.message}`, true));
