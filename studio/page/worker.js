// The compiler in its own thread. Messages: { id, put | forget | ask }; answers: { id, answer, made } or { id, error };
// { progress } while a long answer is made.

let wasm;

const page = {
  progress: (at, length) => postMessage({ progress: text(bytes(at, length)) }),
};

const ready = fetch("studio.wasm")
  .then((response) => {
    if (!response.ok) throw new Error(`studio.wasm: ${response.status}`);
    return response.arrayBuffer();
  })
  .then((code) => WebAssembly.instantiate(code, { page }))
  .then(({ instance }) => { wasm = instance.exports; });

// a view is gone when the memory grows: made anew each time
const bytes = (at, length) => new Uint8Array(wasm.memory.buffer, at, length).slice();
const text = (content) => new TextDecoder().decode(content);

function write(...parts) {
  const lists = parts.map((part) => (typeof part === "string" ? new TextEncoder().encode(part) : part));
  const at = wasm.room(lists.reduce((sum, list) => sum + list.length, 0));
  const room = new Uint8Array(wasm.memory.buffer, at);
  let end = 0;
  for (const list of lists) {
    room.set(list, end);
    end += list.length;
  }
  return lists[0].length;
}

function work(message) {
  if (message.put !== undefined) return wasm.put(write(message.put, message.content)), {};
  if (message.forget !== undefined) return wasm.forget(write(message.forget)), {};
  const length = wasm.ask(write(JSON.stringify(message.ask)));
  const answer = JSON.parse(text(bytes(wasm.answer(), length)));
  const made = {};
  // now: the next request makes others
  for (const { name } of answer.files ?? []) {
    const taken = wasm.take(write(name));
    made[name] = bytes(wasm.answer(), taken);
  }
  return { answer, made };
}

onmessage = async ({ data }) => {
  try {
    await ready;
    postMessage({ id: data.id, ...work(data) });
  } catch (error) {
    postMessage({ id: data.id, error: String(error) });
  }
};
