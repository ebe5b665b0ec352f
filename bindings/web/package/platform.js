/* Browsers, and Workers in them. Bundlers see both files by `new URL`. */
export async function compile() {
  const url = new URL('./quadwright.wasm', import.meta.url);
  const response = await fetch(url);
  if (!response.ok) throw new Error(`${url}: ${response.status} ${response.statusText}`);
  return WebAssembly.compile(await response.arrayBuffer());
}

export const startWorker = () => new Worker(new URL('./worker.js', import.meta.url), { type: 'module' });
