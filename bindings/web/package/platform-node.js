/* Node 18 and later. */
import { readFile } from 'node:fs/promises';
import { Worker } from 'node:worker_threads';

export const compile = async () => WebAssembly.compile(await readFile(new URL('./quadwright.wasm', import.meta.url)));

export function startWorker() {
  const worker = new Worker(new URL('./worker.js', import.meta.url));
  worker.unref(); // a worker that has nothing to do keeps no process alive; index.js holds it while it has
  return worker;
}
