/* Static files for any host, at any path; and a service worker that knows all of them, so that the page works offline after the first visit. */
import { createHash } from 'node:crypto';
import { readdirSync, readFileSync } from 'node:fs';
import { fileURLToPath } from 'node:url';
import { defineConfig } from 'vite';

const here = (path) => fileURLToPath(new URL(path, import.meta.url));

const serviceWorker = () => ({
  name: 'service-worker',
  apply: 'build',
  generateBundle(options, bundle) {
    const samples = readdirSync(here('public/samples')).map((name) => `samples/${name}`);
    const hash = createHash('sha256');
    for (const name of samples) hash.update(readFileSync(here(`public/${name}`)));
    for (const [name, { source, code }] of Object.entries(bundle)) hash.update(name).update(source ?? code);
    const files = ['./', ...Object.keys(bundle).filter((name) => name !== 'index.html'), ...samples];
    const source = readFileSync(here('sw.js'), 'utf8')
      .replace("'VERSION'", () => JSON.stringify(hash.digest('hex').slice(0, 16)))
      .replace("['FILES']", () => JSON.stringify(files));
    this.emitFile({ type: 'asset', fileName: 'sw.js', source });
  },
});

/* The page asks at once for what it will need, and not when the code that needs it has come and begun: the picture's code, and of the two
 * modules the one that index.js will load. The script comes before the style sheet, for which scripts after it wait. */
const preloads = () => ({
  name: 'preloads',
  apply: 'build',
  transformIndexHtml: {
    order: 'post',
    handler(html, { bundle }) {
      const files = Object.values(bundle), dynamic = files.filter(({ isDynamicEntry }) => isDynamicEntry);
      const [one, several] = ['quadwright.wasm', 'quadwright-threads.wasm'].map((name) => `./${files.find(({ names }) => names?.includes(name)).fileName}`);
      const script = `document.head.append(Object.assign(document.createElement('link'), {
        rel: 'preload', as: 'fetch', crossOrigin: '', href: self.crossOriginIsolated && navigator.hardwareConcurrency > 1 ? '${several}' : '${one}',
      }));`;
      return [
        { tag: 'script', children: script, injectTo: 'head-prepend' },
        ...dynamic.map(({ fileName }) => ({ tag: 'link', attrs: { rel: 'modulepreload', crossorigin: true, href: `./${fileName}` }, injectTo: 'head' })),
      ];
    },
  },
});

export default defineConfig({
  root: here('.'),
  base: './',
  resolve: { alias: { 'quadwright/three': here('../package/three.js'), quadwright: here('../package/index.js') } },
  build: { outDir: here('../dist'), emptyOutDir: true, target: 'es2022', assetsInlineLimit: 0, chunkSizeWarningLimit: 1000, modulePreload: { polyfill: false } },
  plugins: [preloads(), serviceWorker()],
});
