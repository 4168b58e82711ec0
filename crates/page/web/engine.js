// The engine, as functions that return promises.
import { decompress } from "fzstd";

const bytesOf = (id) => Uint8Array.from(atob(document.getElementById(id).textContent.trim()), (c) => c.charCodeAt(0));

export class Engine {
  #module;
  #worker;
  #url;
  #open = new Map();
  #next = 0;

  static async load() {
    const engine = new Engine();
    engine.#module = await WebAssembly.compile(decompress(bytesOf("engine")));
    const source = new Blob([document.getElementById("worker").textContent], { type: "text/javascript" });
    engine.#url = URL.createObjectURL(source);
    engine.#start();
    return engine;
  }

  #start() {
    this.#worker = new Worker(this.#url);
    this.#worker.onmessage = ({ data }) => {
      const open = this.#open.get(data.id);
      if (!open) return;
      if (data.rows) {
        open.parts.push(data.rows);
        open.onRows?.(data.rows);
        return;
      }
      this.#open.delete(data.id);
      open.resolve({ ...data.answer, numbers: joined(open.parts), milliseconds: data.milliseconds });
    };
    this.#worker.postMessage({ module: this.#module });
  }

  /// Calls a function of the engine; the answer has all rows in `numbers`.
  call(name, request, onRows) {
    const id = this.#next++;
    return new Promise((resolve) => {
      this.#open.set(id, { resolve, onRows, parts: [] });
      this.#worker.postMessage({ id, call: name, request });
    });
  }

  /// Ends all that is computed. What was computed of it is in the answers, which have `stopped`.
  stop() {
    this.#worker.terminate();
    for (const { resolve, parts } of this.#open.values()) resolve({ stopped: true, numbers: joined(parts) });
    this.#open.clear();
    this.#start();
  }
}

const joined = (parts) => {
  const all = new Float64Array(parts.reduce((sum, part) => sum + part.length, 0));
  let at = 0;
  for (const part of parts) {
    all.set(part, at);
    at += part.length;
  }
  return all;
};
