// The worker as promises. Files are kept here as well: a worker that was stopped begins again with them.

export class Compiler {
  constructor(tell) {
    this.files = new Map();
    this.tell = tell;
    this.begin();
  }

  begin() {
    this.waiting = new Map();
    this.last = 0;
    this.worker = new Worker("worker.js");
    this.worker.onmessage = ({ data }) => {
      if (data.progress !== undefined) return this.tell(data.progress);
      const { resolve, reject } = this.waiting.get(data.id);
      this.waiting.delete(data.id);
      data.error === undefined ? resolve(data) : reject(new Error(data.error));
    };
    this.worker.onerror = (event) => this.fail(event.message || "the worker could not be started");
  }

  fail(why) {
    for (const { reject } of this.waiting.values()) reject(new Error(why));
    this.waiting.clear();
  }

  send(message) {
    this.last += 1;
    const id = this.last;
    this.worker.postMessage({ id, ...message });
    return new Promise((resolve, reject) => this.waiting.set(id, { resolve, reject }));
  }

  put(path, content) {
    this.files.set(path, content);
    return this.send({ put: path, content });
  }

  forget(path) {
    this.files.delete(path);
    return this.send({ forget: path });
  }

  /// The answer, with the files that it lists as `made`: name to bytes.
  async ask(request) {
    const { answer, made } = await this.send({ ask: request });
    return { ...answer, made };
  }

  /// Fetches what will answer a request, while nobody waits for it yet.
  prepare(request) {
    this.send({ fetch: request }).catch(() => {});
  }

  /// Ends whatever is being done.
  stop() {
    this.worker.terminate();
    this.fail("stopped");
    this.begin();
    for (const [path, content] of this.files) this.send({ put: path, content });
  }
}
