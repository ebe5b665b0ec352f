/* Node 18 and later. */
import { readFile } from 'node:fs/promises';
import { cpus } from 'node:os';
import { Worker } from 'node:worker_threads';

export const compile = async (threaded) =>
  WebAssembly.compile(await readFile(new URL(threaded ? './quadwright-threads.wasm' : './quadwright.wasm', import.meta.url)));

function start(url) {
  const worker = new Worker(url, { execArgv: [] }); // some switches of the process, as --input-type, are none for files
  worker.unref(); // a worker that has nothing to do keeps no process alive; index.js holds it while it has
  return worker;
}

export const readLocal = (path) => readFile(path);
export const processors = () => cpus().length;
export const startWorker = () => start(new URL('./worker.js', import.meta.url));
export const startThread = () => start(new URL('./thread.js', import.meta.url));
