/* The Worker of index.js: a session at a time, calls in the order in which they came. A message is {id, name, rest}, its answer
 * {id, value} or {id, error}, with {id, stage, fraction} on the way. The first message brings the compiled module. */
import { CANCEL, Module, QuadwrightError, Session } from './core.js';
import { startThread } from '#platform';
import { listen, port } from '#port';

const PAUSE = 50; // ms between two words of progress

let compiled, cancel, memoryLimit, module, session, ready;

async function begin(message) {
  ({ compiled, cancel, memoryLimit } = message);
  cancel &&= new Int32Array(cancel);
  module = new Module(compiled);
  if (module.threaded) await Promise.all(Array.from({ length: message.threads - 1 }, addThread));
}

/* Settles once the thread is there, or cannot be had: then there is one less. */
function addThread() {
  return new Promise((done) => {
    const thread = startThread();
    ['message', 'error', 'exit'].forEach((name) => listen(thread, name, done));
    thread.postMessage({ compiled, thread: module.makeThread() });
  });
}

function open() {
  session?.close();
  session = new Session(module, memoryLimit);
  return session;
}

function hooksOf(id) {
  let last = 0;
  const progress = (stage, fraction) => {
    const now = performance.now();
    if (now - last >= PAUSE || fraction >= 1) port.postMessage({ id, stage, fraction }), (last = now);
    return cancel && Atomics.load(cancel, 0) ? CANCEL : undefined;
  };
  return { progress, log: (warning) => port.postMessage({ id, warning }) };
}

const calls = {
  takeFile: (id, bytes) => open().takeFile(bytes),
  takePoints: (id, ...rest) => open().takePoints(...rest),
  takeArrays: (id, ...rest) => open().takeArrays(...rest),
  mark: (id, names) => session.mark(names),
  steer: (id, steering) => session.steer(steering),
  run: (id, options) => session.run(options, hooksOf(id)),
  save: (id, ...rest) => session.save(...rest),
  measuredReport: (id, ...rest) => session.measuredReport(...rest),
  inputAttributes: () => session.attributes(1),
};

/* The buffers of all arrays in a value: they are moved, not copied. */
function buffersOf(value, found = []) {
  if (ArrayBuffer.isView(value)) found.push(value.buffer);
  else if (value && typeof value === 'object') Object.values(value).forEach((member) => buffersOf(member, found));
  return found;
}

listen(port, 'message', async ({ id, name, rest, begins }) => {
  if (begins) return void (ready = begin(begins));
  try {
    await ready;
    const value = calls[name](id, ...rest);
    port.postMessage({ id, value }, buffersOf(value));
  } catch (error) {
    const { message, status = 'CRASHED', exitCode = 21 } = error;
    const known = error instanceof QuadwrightError;
    port.postMessage({ id, error: { message: known ? message : `the Worker failed: ${message}`, status, exitCode } });
  }
});
