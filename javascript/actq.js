// Heads of actq in JavaScript: images run with the bits of a microcontroller. README.md and actq.d.ts document it.

const TEXTS = { error: 0, name: 1, ports: 2 };
const NUMBERS = { observationLength: 0, actionLength: 1, rateHz: 2, scratchBytes: 3, crc32: 4, stateBytes: 5 };

/** Compiles the module from its gzip file, or from its content: some servers make a browser unpack it. */
export async function compile(gzip) {
  const [first] = new Uint8Array(gzip.buffer ?? gzip, gzip.byteOffset ?? 0, 1);
  if (first !== 0x1f) return WebAssembly.compile(gzip);
  const stream = new Blob([gzip]).stream().pipeThrough(new DecompressionStream("gzip"));
  return WebAssembly.compile(await new Response(stream).arrayBuffer());
}

let compiled;

/** Lets the next caller try again. */
function again(error) {
  compiled = undefined;
  throw error;
}

/** Compiles the file beside this one, once. */
async function own() {
  const url = new URL("./actq.wasm.gz", import.meta.url);
  if (url.protocol !== "file:") {
    const response = await fetch(url);
    if (!response.ok) throw new Error(`${url}: ${response.status} ${response.statusText}`);
    return compile(await response.arrayBuffer());
  }
  const { readFile } = await import("node:fs/promises");
  return compile(await readFile(url));
}

/** An image that runs, with its state. */
export class Head {
  #exports;
  #observation;
  #action;

  constructor(exports) {
    this.#exports = exports;
    for (const [name, which] of Object.entries(NUMBERS)) this[name] = exports.number(which);
    this.name = this.#text(TEXTS.name);
    const ports = this.#text(TEXTS.ports).split("\n").filter(Boolean).map(port);
    this.inputs = ports.filter(({ kind }) => kind === "input");
    this.targets = ports.filter(({ kind }) => kind !== "input");
    this.#observation = exports.observation();
    this.#action = exports.action();
    Object.freeze(this);
  }

  /** Opens an image of these bytes, a Uint8Array or an ArrayBuffer. `module` is a compiled module; by default, it is the file beside this one. */
  static async open(content, module) {
    const isView = ArrayBuffer.isView(content);
    if (!isView && !(content instanceof ArrayBuffer)) throw new TypeError(`the image is of type ${typeof content}; pass a Uint8Array or an ArrayBuffer`);
    const bytes = isView ? new Uint8Array(content.buffer, content.byteOffset, content.byteLength) : new Uint8Array(content);
    const { exports } = await WebAssembly.instantiate(module ?? (await (compiled ??= own().catch(again))), {});
    const address = exports.allocate(bytes.length);
    new Uint8Array(exports.memory.buffer, address, bytes.length).set(bytes);
    check(exports, exports.open(bytes.length));
    return new Head(exports);
  }

  /** Computes with these weights in f32 from now on, in place of the image's own. */
  useWeights(weights) {
    const address = this.#exports.allocate(4 * weights.length);
    new Float32Array(this.#exports.memory.buffer, address, weights.length).set(weights);
    check(this.#exports, this.#exports.weights());
  }

  /** Returns the action for an observation. */
  step(observation) {
    if (observation.length !== this.observationLength) {
      throw new RangeError(`the observation has ${observation.length} values; the image needs ${this.observationLength}`);
    }
    const { memory, step } = this.#exports;
    new Float32Array(memory.buffer, this.#observation, this.observationLength).set(observation);
    check(this.#exports, step());
    return new Float32Array(memory.buffer, this.#action, this.actionLength).slice();
  }

  /** Clears the recurrent state, histories, chunks and the last action. */
  reset() {
    check(this.#exports, this.#exports.reset());
  }

  /** Sets the seed of a flow or diffusion policy's noise, and resets. */
  seed(seed) {
    check(this.#exports, this.#exports.seed(seed >>> 0));
  }

  /** Returns the state between two steps. */
  save() {
    const { memory, allocate, save } = this.#exports;
    const address = allocate(this.stateBytes);
    check(this.#exports, save());
    return new Uint8Array(memory.buffer, address, this.stateBytes).slice();
  }

  /** Continues from a state that a head of the same image saved. */
  restore(state) {
    const { memory, allocate, restore } = this.#exports;
    const address = allocate(state.length);
    new Uint8Array(memory.buffer, address, state.length).set(state);
    check(this.#exports, restore());
  }

  #text(which) {
    return text(this.#exports, which);
  }
}

function port(line) {
  const [kind, length, low, high, name, ...names] = line.split("\t");
  const number = (value) => (value.endsWith("inf") ? Number(value.replace("inf", "Infinity")) : Number(value));
  return { kind: kind.toLowerCase(), name, names, length: Number(length), range: [number(low), number(high)] };
}

function text(exports, which) {
  const length = exports.text(which);
  return new TextDecoder().decode(new Uint8Array(exports.memory.buffer, exports.text_address(), length));
}

function check(exports, status) {
  if (status !== 0) throw new Error(text(exports, TEXTS.error));
}
