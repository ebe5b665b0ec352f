/* Keeps the page's files, all of one version, and gives them without asking the network. vite.config.js puts in which they are. Of the two
 * modules, with and without threads, a page loads but one. */
const VERSION = 'VERSION', FILES = ['FILES'];
const isWanted = (file) => !file.endsWith('.wasm') || /quadwright-threads/.test(file) === Boolean(self.crossOriginIsolated);

self.addEventListener('install', (event) => {
  const fill = async () => (await caches.open(VERSION)).addAll(FILES.filter(isWanted).map((file) => new Request(file, { cache: 'reload' })));
  event.waitUntil(fill().then(() => self.skipWaiting()));
});

self.addEventListener('activate', (event) => {
  const drop = async () => Promise.all((await caches.keys()).filter((name) => name !== VERSION).map((name) => caches.delete(name)));
  event.waitUntil(drop().then(() => self.clients.claim()));
});

self.addEventListener('fetch', (event) => {
  if (event.request.method !== 'GET' || new URL(event.request.url).origin !== location.origin) return;
  const answer = async () => (await (await caches.open(VERSION)).match(event.request, { ignoreSearch: true })) ?? fetch(event.request);
  event.respondWith(answer());
});
