/* Any triangle surface in, a clean all-quad mesh out: the library in a Worker of its own, or on the calling thread.
 *
 *     import { init, remesh } from 'quadwright';
 *     await init();
 *     const { positions, quads, report, attributes } = await remesh(vertices, triangles, { faces: 5000 });
 *
 * index.d.ts, which is made of the library's tables, says what there is. */
import { CANCEL, Module, QuadwrightError, Session } from './core.js';
import { compile, processors, readLocal, startWorker } from '#platform';
import { listen } from '#port';

export { CANCEL, QuadwrightError };

const MOST_THREADS = 8; // more take next to nothing off
const canShare = () => typeof SharedArrayBuffer === 'function' && (globalThis.crossOriginIsolated ?? true);

let compiling = null, here = null, threads = 1;

/* Threads need memory that Workers share. Where that cannot be had, as the address space is short, one does. */
async function compileFor(count) {
  if (count > 1)
    try {
      const compiled = await compile(true);
      here = new Module(compiled);
      threads = count;
      return compiled;
    } catch {
      here = null;
    }
  threads = 1;
  return compile(false);
}

/* wasm: the compiled module, or its bytes, where the package cannot find them by itself. threads: of each Worker; 0, the default: one for each
 * processor on pages that are cross-origin isolated, else 1; more are an own module, with the same results. Gives the tables of the library. */
export async function init({ wasm = null, threads: wanted = 0 } = {}) {
  if (wasm || wanted) compiling = here = null;
  const count = Math.min(wanted || (globalThis.crossOriginIsolated ? processors() : 1), MOST_THREADS, canShare() ? MOST_THREADS : 1);
  if (wasm) threads = count;
  compiling ??= Promise.resolve(wasm instanceof WebAssembly.Module ? wasm : wasm ? WebAssembly.compile(wasm) : compileFor(count));
  const compiled = await compiling.catch((error) => {
    compiling = null; // another try may do better
    throw error;
  });
  here ??= new Module(compiled);
  return here.tables;
}

function ready() {
  if (!here) throw new QuadwrightError('init() has to be awaited first', 'NOT_READY', 19);
  return here;
}

/* The tables: version, options, fields of reports, statuses. After init. */
export const tables = () => ready().tables;

/* ---- in a Worker */

/* Functions go through no message: it is said which option is one, before the Worker is asked. */
function checkCloneable(options) {
  const wrong = Object.keys(options).find((name) => typeof options[name] === 'function');
  if (wrong) throw new QuadwrightError(`${wrong}: there is no hook of that name; hooks are progress and log, and signal`, 'ARGUMENT', 2);
}

/* Remesher.remesh takes hooks by themselves, and other calls would leave them out silently. */
function requireNone(rest) {
  if (rest.length > 0) throw new QuadwrightError('there is no fourth argument: signal, progress and log are among the options', 'ARGUMENT', 2);
}

/* A surface that is remeshed more than once: what two runs have in common is made once, and the results are those of fresh runs. */
export class Remesher {
  #worker = null;
  #cancel = null; // Int32Array on shared memory, where there is such: cancels a run without loss of the Worker
  #waiting = new Map(); // id -> {resolve, reject, progress, log}
  #next = 0;
  #surface = null; // the call that makes it again in another Worker; null: there is none, or its arrays were moved
  #held = false; // whether the Worker has a surface
  #steering = null; // what steer was given for the surface
  #queue = Promise.resolve();
  #memoryLimit;

  /* memoryLimit: bytes, or a text such as "2G"; 0: none but that of the address space, 4 GiB. */
  constructor({ memoryLimit = 0 } = {}) {
    ready();
    this.#memoryLimit = memoryLimit;
  }

  async #start() {
    const worker = startWorker();
    this.#worker = worker;
    const shared = canShare() ? new SharedArrayBuffer(4) : null;
    this.#cancel = shared && new Int32Array(shared);
    listen(worker, 'message', (message) => this.#hear(message));
    const fall = (event) => this.#fall(worker, new QuadwrightError(`the Worker crashed: ${event?.message ?? 'it ended'}`, 'CRASHED', 21));
    ['error', 'messageerror', 'exit'].forEach((name) => listen(worker, name, fall));
    worker.postMessage({ begins: { compiled: await compiling, cancel: shared, memoryLimit: this.#memoryLimit, threads } });
  }

  #hear({ id, value, error, stage, fraction, warning }) {
    const call = this.#waiting.get(id);
    if (!call) return;
    if (stage !== undefined) return this.#tell(call, call.progress, stage, fraction);
    if (warning !== undefined) return this.#tell(call, call.log, warning);
    this.#waiting.delete(id);
    if (this.#waiting.size === 0) this.#worker?.unref?.();
    if (call.thrown) return call.reject(call.thrown.error);
    if (!error) return call.resolve(value);
    const failure = new QuadwrightError(error.message, error.status, error.exitCode);
    if (error.status === 'CRASHED') this.#fall(this.#worker, failure);
    call.reject(failure);
  }

  /* Calls a hook of the caller's. What it throws, or its promise is rejected with, ends the run and becomes the run's own error; CANCEL,
   * returned or promised, cancels the run. */
  #tell(call, hook, ...told) {
    const fail = (error) => {
      if (call.thrown || ![...this.#waiting.values()].includes(call)) return;
      call.thrown = { error };
      if (this.#cancel) Atomics.store(this.#cancel, 0, 1);
      else this.#fall(this.#worker, error);
    };
    const judge = (answer) => answer === CANCEL && fail(new QuadwrightError('cancelled by the caller', 'CANCELLED', 18));
    try {
      const answer = hook?.(...told);
      if (answer?.then) answer.then(judge, fail);
      else judge(answer);
    } catch (error) {
      fail(error);
    }
  }

  /* The Worker is lost; the next call starts another. */
  #fall(worker, error) {
    if (worker !== this.#worker) return;
    this.#worker = null;
    this.#held = false;
    worker.terminate();
    const calls = [...this.#waiting.values()];
    this.#waiting.clear();
    calls.forEach((call) => call.reject(error));
  }

  #send(name, rest, { transfer = [], progress, log } = {}) {
    return new Promise((resolve, reject) => {
      const id = this.#next++;
      this.#waiting.set(id, { resolve, reject, progress, log });
      this.#worker.ref?.();
      this.#worker.postMessage({ id, name, rest }, transfer);
    });
  }

  async #callNow(name, rest, { signal, ...hooks }, makesSurface) {
    signal?.throwIfAborted();
    if (!this.#worker) await this.#start();
    if (!makesSurface && !this.#held) {
      if (!this.#surface) throw new QuadwrightError('there is no surface (any more): call load or set first', 'NOT_READY', 19);
      await this.#send(...this.#surface);
      this.#held = true;
      if (this.#steering) await this.#send('steer', [this.#steering]);
    }
    const worker = this.#worker;
    if (this.#cancel) Atomics.store(this.#cancel, 0, 0);
    const abort = () => {
      if (this.#cancel && name === 'run') Atomics.store(this.#cancel, 0, 1);
      else this.#fall(worker, signal.reason);
    };
    signal?.addEventListener('abort', abort, { once: true });
    if (makesSurface) (this.#surface = this.#steering = null), (this.#held = false);
    try {
      const value = await this.#send(name, rest, hooks);
      if (makesSurface) this.#held = true;
      return value;
    } catch (error) {
      throw signal?.aborted ? signal.reason : error;
    } finally {
      signal?.removeEventListener('abort', abort);
    }
  }

  /* One call at a time, in their order. */
  #call(name, rest, hooks = {}, makesSurface = false) {
    const answer = this.#queue.then(() => this.#callNow(name, rest, hooks, makesSurface));
    this.#queue = answer.catch(() => {});
    return answer;
  }

  /* A file of OBJ, PLY, OFF, STL, GLB or glTF, or of points: bytes (ArrayBuffer or Uint8Array), a Blob, or in Node its path. Gives the surface as arrays. */
  async load(file, { signal, log } = {}) {
    if (typeof file === 'string' || file instanceof URL) file = await readLocal(file);
    const bytes = file instanceof Uint8Array ? file : new Uint8Array(file instanceof ArrayBuffer ? file : await file.arrayBuffer());
    const surface = await this.#call('takeFile', [bytes], { signal, log }, true);
    this.#surface = ['takeFile', [bytes]];
    return surface;
  }

  /* A surface from arrays. They are copied, unless `transfer` is true: then they are moved, and lost to the caller. */
  async set(positions, indices, { faceSize, faceSizes, markedEdges, attributes, transfer = false, signal } = {}) {
    const rest = [positions, indices, { faceSize, faceSizes, markedEdges, attributes }];
    const moved = transfer ? [...new Set([positions, indices].filter(ArrayBuffer.isView).map((array) => array.buffer))] : [];
    await this.#call('takeArrays', rest, { signal, transfer: moved }, true);
    this.#surface = transfer ? null : ['takeArrays', rest];
  }

  /* Points without faces, three numbers a point, and attributes of theirs: a surface with the option wrap. */
  async setPoints(positions, { attributes, signal } = {}) {
    const rest = [positions, { attributes }];
    await this.#call('takePoints', rest, { signal }, true);
    this.#surface = ['takePoints', rest];
  }

  /* Hooks lie among the options, as in remesh, or in an object of their own. */
  async remesh(options = {}, hooks = {}) {
    const { signal, progress, log, ...library } = { ...options, ...hooks };
    checkCloneable(library);
    return this.#call('run', [library], { signal, progress, log });
  }

  /* Steers the runs on this surface: density (a number for each vertex: edges are as many times smaller), guides (polylines on the surface:
   * [{points, kind: 'loop' | 'direction', closed}]), region (1 for each face that is to be remeshed; the others stay). What is missing is taken
   * away. A guide off the surface is refused by the run. */
  async steer(steering = {}, { signal } = {}) {
    await this.#call('steer', [steering], { signal });
    this.#steering = steering;
  }

  /* Marks the borders of these attributes ("uv,material"), which options.keep_marks makes edges of the result. */
  mark(names) {
    return this.#call('mark', [names]);
  }

  /* The last result as the bytes of a file, the same as the command line tool's. format: "obj", "ply", "off", "stl", "glb" or "gltf". */
  save(format, { bare = false } = {}) {
    return this.#call('save', [format, { bare }]);
  }

  /* The last result measured against the surface: what the command line tool writes with --json. */
  async measure({ input = null, output = null, signal } = {}) {
    return JSON.parse(await this.#call('measuredReport', [input, output], { signal }));
  }

  close() {
    this.#surface = null;
    if (this.#worker) this.#fall(this.#worker, new QuadwrightError('the Remesher was closed', 'CANCELLED', 18));
  }
}

/* Remeshes in a Worker that ends with the call. options: those of the library, and faceSize, faceSizes, markedEdges, attributes, transfer,
 * density, guides, region, signal, progress, log, memoryLimit. */
export async function remesh(positions, indices, options = {}, ...rest) {
  requireNone(rest);
  const { faceSize, faceSizes, markedEdges, attributes, transfer, signal, progress, log, memoryLimit, density, guides, region, ...library } = options;
  await init();
  const remesher = new Remesher({ memoryLimit });
  try {
    await remesher.set(positions, indices, { faceSize, faceSizes, markedEdges, attributes, transfer, signal });
    if (density || guides || region) await remesher.steer({ density, guides, region }, { signal });
    return await remesher.remesh(library, { signal, progress, log });
  } finally {
    remesher.close();
  }
}

/* Quads with texture coordinates of their own, and maps on them of what the surface looks like. */
export const asset = (positions, indices, options = {}, ...rest) => remesh(positions, indices, { bake: 'input', ...options }, ...rest);

/* The same on the calling thread, as in a Worker of one's own: progress returns CANCEL to cancel. */
export function remeshSync(positions, indices, options = {}, ...rest) {
  requireNone(rest);
  const { faceSize, faceSizes, markedEdges, attributes, progress, log, memoryLimit, density, guides, region, ...library } = options;
  const session = new Session(ready(), memoryLimit);
  let crashed = false;
  try {
    session.takeArrays(positions, indices, { faceSize, faceSizes, markedEdges, attributes });
    if (density || guides || region) session.steer({ density, guides, region });
    return session.run(library, { progress, log });
  } catch (error) {
    crashed = error.status === 'CRASHED';
    if (crashed) here = null; // the instance is lost: init makes another
    throw error;
  } finally {
    if (!crashed) session.close();
  }
}

/* A torus with waves, of 2,000 triangles: enough of a surface for every stage to have work. */
function wavyTorus() {
  const across = 50, along = 20, positions = [], indices = [], at = (i, j) => (i % across) * along + (j % along), turn = 2 * Math.PI;
  for (let i = 0; i < across; i++)
    for (let j = 0; j < along; j++) {
      const a = (turn * i) / across, b = (turn * j) / along, r = 3 + Math.cos(b) * (1 + 0.2 * Math.sin(5 * a));
      positions.push(r * Math.cos(a), r * Math.sin(a), Math.sin(b));
      indices.push(at(i, j), at(i + 1, j), at(i + 1, j + 1), at(i, j), at(i + 1, j + 1), at(i, j + 1));
    }
  return [positions, indices];
}

/* Engines begin with quickly compiled code, and make better code of what runs: a first run takes about twice as long as later ones. This runs a
 * small surface in a Worker of its own, for programs that have an idle half second before theirs. */
export async function warmUp() {
  for (const faces of [300, 500]) await remesh(...wavyTorus(), { faces });
}
