/* Keeps the page's files, all of one version, and gives them without asking the network. vite.config.js puts in which they are. */
const VERSION = 'VERSION', FILES = ['FILES'];

self.addEventListener('install', (event) => {
  const fill = async () => (await caches.open(VERSION)).addAll(FILES.map((file) => new Request(file, { cache: 'reload' })));
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
