// The compiler in its own thread. Messages: { id, put | forget | ask | fetch }; answers: { id, answer, made } or { id, error };
// { progress } while a long answer is made.
//
// It comes as modules. studio.wasm shows a contract and its closed loop; the others are fetched when they are wanted, and each
// holds the files of the session for itself.

/// The requests that are not of studio.wasm.
const MODULES = { compile: "code.wasm", diagnose: "records.wasm", simulate: "simulate.wasm" };

const files = new Map();
const modules = new Map();

const text = (content) => new TextDecoder().decode(content);

class Module {
  async start(name) {
    const response = await fetch(name);
    if (!response.ok) throw new Error(`${name}: ${response.status}`);
    const page = { progress: (at, length) => postMessage({ progress: text(this.bytes(at, length)) }) };
    const { instance } = await WebAssembly.instantiate(await response.arrayBuffer(), { page });
    this.wasm = instance.exports;
    // without a pause after: a file that comes now finds the module below
    for (const [path, content] of files) this.put(path, content);
    return this;
  }

  // a view is gone when the memory grows: made anew each time
  bytes(at, length) {
    return new Uint8Array(this.wasm.memory.buffer, at, length).slice();
  }

  write(...parts) {
    const lists = parts.map((part) => (typeof part === "string" ? new TextEncoder().encode(part) : part));
    const at = this.wasm.room(lists.reduce((sum, list) => sum + list.length, 0));
    const room = new Uint8Array(this.wasm.memory.buffer, at);
    let end = 0;
    for (const list of lists) {
      room.set(list, end);
      end += list.length;
    }
    return lists[0].length;
  }

  put(path, content) {
    this.wasm?.put(this.write(path, content));
  }

  forget(path) {
    this.wasm?.forget(this.write(path));
  }

  ask(request) {
    const length = this.wasm.ask(this.write(JSON.stringify(request)));
    const answer = JSON.parse(text(this.bytes(this.wasm.answer(), length)));
    const made = {};
    // now: the next request makes others
    for (const { name } of answer.files ?? []) {
      const taken = this.wasm.take(this.write(name));
      made[name] = this.bytes(this.wasm.answer(), taken);
    }
    return { answer, made };
  }
}

/// The module that answers a request, fetched once.
function moduleOf(request) {
  const name = MODULES[request] ?? "studio.wasm";
  if (!modules.has(name)) {
    const module = new Module();
    const ready = module.start(name);
    modules.set(name, { module, ready });
    // one that did not come is asked for again
    ready.catch(() => modules.delete(name));
  }
  return modules.get(name).ready;
}

async function work({ put, content, forget, fetch: wanted, ask }) {
  if (put !== undefined) {
    files.set(put, content);
    for (const { module } of modules.values()) module.put(put, content);
  } else if (forget !== undefined) {
    files.delete(forget);
    for (const { module } of modules.values()) module.forget(forget);
  } else if (wanted !== undefined) {
    // nobody waits for it yet: who asks hears why it did not come
    moduleOf(wanted).catch(() => {});
  } else {
    return (await moduleOf(ask.ask)).ask(ask);
  }
  return {};
}

moduleOf("read").catch(() => {});

// in turn: what is asked sees the files as they were then
let last = Promise.resolve();
onmessage = ({ data }) => {
  last = last.then(async () => {
    try {
      postMessage({ id: data.id, ...(await work(data)) });
    } catch (error) {
      postMessage({ id: data.id, error: String(error) });
    }
  });
};
