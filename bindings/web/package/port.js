/* Messages of a Worker in a browser, at either end. */
export const listen = (worker, name, use) => worker.addEventListener(name, name === 'message' ? (event) => use(event.data) : use);
export const port = globalThis; // of worker.js
