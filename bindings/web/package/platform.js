/* Browsers, and Workers in them. Bundlers see all files by `new URL`, as it is written here. */
const urls = [new URL('./quadwright.wasm', import.meta.url), new URL('./quadwright-threads.wasm', import.meta.url)];

/* Vite's dev server puts the scripts of a package together in node_modules/.vite/deps, and leaves its other files behind in node_modules/quadwright: where a
 * file of that name is there, or null. */
const behind = (name) => (/\/\.vite[^/]*\/deps[^/]*\//.test(import.meta.url) ? new URL(`../../quadwright/${name}`, import.meta.url) : null);

export async function compile(threaded) {
  const url = behind(threaded ? 'quadwright-threads.wasm' : 'quadwright.wasm') ?? urls[threaded ? 1 : 0], response = await fetch(url);
  if (!response.ok) throw new Error(`${url}: ${response.status} ${response.statusText}`);
  const type = response.headers.get('content-type') ?? '';
  if (type.startsWith('text/html')) throw new Error(`${url}: there is a page, and not the module: what bundles or serves it has to copy the file there (README, Bundlers)`);
  // Compiled as it comes, and kept by browsers that keep compiled code, where the host calls the file by its type.
  if (type === 'application/wasm') return WebAssembly.compileStreaming(response);
  return WebAssembly.compile(await response.arrayBuffer());
}

export function readLocal() {
  throw new TypeError('load: a path is for Node; here bytes or a Blob are needed: (await fetch(url)).blob()');
}

export const processors = () => navigator.hardwareConcurrency ?? 1;

export function startWorker() {
  const url = behind('worker.js');
  return url ? new Worker(url, { type: 'module' }) : new Worker(new URL('./worker.js', import.meta.url), { type: 'module' });
}

export function startThread() {
  const url = behind('thread.js');
  return url ? new Worker(url, { type: 'module' }) : new Worker(new URL('./thread.js', import.meta.url), { type: 'module' });
}
