/* A static server on the loopback, as hosts of static files are: gzip where the browser takes it, no special headers, unless `isolated`: then
 * those with which pages get memory that Workers share.
 * usage: node serve.js FOLDER [PORT] */
import { createServer } from 'node:http';
import { readFileSync, statSync } from 'node:fs';
import { extname, join, normalize } from 'node:path';
import { gzipSync } from 'node:zlib';

const TYPES = { '.html': 'text/html', '.js': 'text/javascript', '.css': 'text/css', '.wasm': 'application/wasm', '.obj': 'text/plain', '.json': 'application/json' };

const ISOLATING = { 'cross-origin-opener-policy': 'same-origin', 'cross-origin-embedder-policy': 'require-corp' };

/* Gives {url, sent, close}: sent maps each path that was asked for to its compressed size. */
export async function serve(folder, port = 0, { isolated = false } = {}) {
  const packed = new Map(), sent = new Map();
  const server = createServer((request, response) => {
    let path = normalize(decodeURIComponent(new URL(request.url, 'http://localhost').pathname));
    if (path.endsWith('/')) path += 'index.html';
    try {
      const file = join(folder, path);
      if (!statSync(file).isFile()) throw new Error('no file');
      if (!packed.has(file)) packed.set(file, gzipSync(readFileSync(file), { level: 9 }));
      sent.set(path, packed.get(file).length);
      response.writeHead(200, { 'content-type': TYPES[extname(file)] ?? 'application/octet-stream', 'content-encoding': 'gzip', 'cache-control': 'no-cache', ...(isolated && ISOLATING) });
      response.end(packed.get(file));
    } catch {
      response.writeHead(404).end();
    }
  });
  await new Promise((resolve) => server.listen(port, '127.0.0.1', resolve));
  const close = () => new Promise((resolve) => (server.closeAllConnections?.(), server.close(resolve)));
  return { url: `http://127.0.0.1:${server.address().port}/`, sent, close };
}

if (process.argv[1]?.endsWith('serve.js')) console.log((await serve(process.argv[2], Number(process.argv[3] ?? 8000))).url);
