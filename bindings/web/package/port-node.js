/* Messages of a Worker in Node, at either end. */
import { parentPort } from 'node:worker_threads';

export const listen = (worker, name, use) => worker.on(name, use);
export const port = parentPort; // of worker.js
