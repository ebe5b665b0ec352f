/* Browsers, and Workers in them. Bundlers see both files by `new URL`. */
const urls = [new URL('./quadwright.wasm', import.meta.url), new URL('./quadwright-threads.wasm', import.meta.url)];

export async function compile(threaded) {
  const url = urls[threaded ? 1 : 0], response = await fetch(url);
  if (!response.ok) throw new Error(`${url}: ${response.status} ${response.statusText}`);
  // Compiled as it comes, and kept by browsers that keep compiled code, where the host calls the file by its type.
  if (response.headers.get('content-type') === 'application/wasm') return WebAssembly.compileStreaming(response);
  return WebAssembly.compile(await response.arrayBuffer());
}

export const processors = () => navigator.hardwareConcurrency ?? 1;
export const startWorker = () => new Worker(new URL('./worker.js', import.meta.url), { type: 'module' });
export const startThread = () => new Worker(new URL('./thread.js', import.meta.url), { type: 'module' });
