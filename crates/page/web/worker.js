// The engine in a thread of its own. A request is { id, call, request }; the answers are { id, rows } while rows are computed, and
// { id, answer } at the end.
let module;
let engine;
let current;
let fault;

const text = (address, length) => new TextDecoder().decode(new Uint8Array(engine.memory.buffer, address, length));

const imports = {
  env: {
    now: () => performance.now(),
    rows: (address, count) => {
      const rows = new Float64Array(engine.memory.buffer, address, count).slice();
      postMessage({ id: current, rows }, [rows.buffer]);
    },
    fault: (address, length) => {
      fault = text(address, length);
    },
  },
};

const open = () => {
  engine = new WebAssembly.Instance(module, imports).exports;
  engine.start();
};

const call = (name, request) => {
  const bytes = new TextEncoder().encode(JSON.stringify(request));
  const address = engine.allocate(bytes.length);
  new Uint8Array(engine.memory.buffer, address, bytes.length).set(bytes);
  const answer = BigInt.asUintN(64, engine[name](address, bytes.length));
  const [at, length] = [Number(answer >> 32n), Number(answer & 0xffffffffn)];
  const json = text(at, length);
  engine.release(at, length);
  return JSON.parse(json);
};

onmessage = ({ data }) => {
  if (data.module) {
    module = data.module;
    open();
    return;
  }
  current = data.id;
  fault = undefined;
  try {
    const began = performance.now();
    const answer = call(data.call, data.request);
    postMessage({ id: data.id, answer, milliseconds: performance.now() - began });
  } catch (error) {
    // After a fault the memory of the engine is in no known state.
    postMessage({ id: data.id, answer: { fault: fault ?? String(error) } });
    open();
  }
};
