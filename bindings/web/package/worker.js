/* The Worker of index.js: a session at a time, calls in the order in which they came. A message is {id, name, rest}, its answer
 * {id, value} or {id, error}, with {id, stage, fraction} on the way. The first message brings the compiled module. */
import { Module, QuadwrightError, Session } from './core.js';
import { listen, port } from '#port';

const PAUSE = 50; // ms between two words of progress

let compiled, cancel, memoryLimit, module, session;

function begin(message) {
  ({ compiled, cancel, memoryLimit } = message);
  cancel &&= new Int32Array(cancel);
  module = new Module(compiled);
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
    return Boolean(cancel && Atomics.load(cancel, 0));
  };
  return { progress, log: (warning) => port.postMessage({ id, warning }) };
}

const calls = {
  takeFile: (id, bytes) => open().takeFile(bytes),
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

listen(port, 'message', ({ id, name, rest, begins }) => {
  if (begins) return begin(begins);
  try {
    const value = calls[name](id, ...rest);
    port.postMessage({ id, value }, buffersOf(value));
  } catch (error) {
    const { message, status = 'CRASHED', exitCode = 21 } = error;
    const known = error instanceof QuadwrightError;
    port.postMessage({ id, error: { message: known ? message : `the Worker failed: ${message}`, status, exitCode } });
  }
});
