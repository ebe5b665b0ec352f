/* How long the module takes beside the native program on one thread: 80,000 triangles to 5,000 quads, in Node and in headless Chromium.
 * usage: node speed.js [TRIANGLES] [QUADS], after `make web` and `make`. Writes a row of a table for each. */
import { readFileSync } from 'node:fs';
import { join } from 'node:path';
import { folder, native, openBrowser, read, shape, web } from './tools.js';
import { serve } from './serve.js';

const ROUNDS = 3;
const [triangles = 80000, quads = 5000] = process.argv.slice(2).map(Number);
const path = shape('dancer', triangles), options = { faces: quads, outward: false };
const best = (list) => Math.min(...list);

function nativeSeconds() {
  native(path, '-o', 'native.obj', '--faces', `${quads}`, '--no-outward', '--json', 'native.json');
  return JSON.parse(read('native.json')).report.seconds;
}

async function nodeSeconds() {
  const { init, Remesher } = await import('../package/index.js');
  await init();
  const remesher = new Remesher();
  await remesher.load(readFileSync(path));
  const { report } = await remesher.remesh(options);
  const bytes = await remesher.save('obj');
  if (!Buffer.from(bytes).equals(read('native.obj'))) throw new Error('the bytes differ from the native ones');
  remesher.close();
  return report.seconds;
}

/* Of the page itself: the seconds that its report tells of a run from the first stage on. */
async function pageSeconds() {
  const server = await serve(join(web, 'dist')), browser = await openBrowser();
  const page = await browser.newPage();
  page.setDefaultTimeout(600000);
  const done = () => page.waitForFunction(() => document.getElementById('progress').hidden && document.documentElement.dataset.ready && document.documentElement.dataset.busy === '0' && document.querySelector('#report table'));
  await page.goto(server.url);
  await done();
  await page.setInputFiles('#file', path);
  await page.waitForFunction((name) => document.getElementById('command').textContent.includes(name), path.split('/').at(-1));
  await page.fill('#count-number', `${quads}`);
  await page.locator('#count-number').blur();
  await page.waitForFunction((count) => document.getElementById('command').textContent.includes(`--faces ${count}`), quads);
  await done();
  await page.evaluate(() => { // another option of cleaning, so that nothing is left of the runs before
    const input = document.getElementById('option-outward');
    input.checked = false;
    input.dispatchEvent(new Event('change', { bubbles: true }));
  });
  await page.waitForFunction(() => document.getElementById('command').textContent.includes('--no-outward'));
  await done();
  const [file] = await Promise.all([page.waitForEvent('download'), page.click('#save-json')]);
  const to = join(folder, 'page.json');
  await file.saveAs(to);
  await browser.close();
  await server.close();
  return JSON.parse(readFileSync(to)).report?.seconds ?? JSON.parse(readFileSync(to)).seconds;
}

const times = { native: [], node: [], chromium: [] };
for (let i = 0; i < ROUNDS; i++) {
  times.native.push(nativeSeconds());
  times.node.push(await nodeSeconds());
  times.chromium.push(await pageSeconds());
}
const least = best(times.native);
console.log(`${triangles} triangles asked of the shape, ${quads} quads, one thread, best of ${ROUNDS}`);
for (const [name, list] of Object.entries(times)) console.log(`| ${name} | ${best(list).toFixed(2)} s | ${(best(list) / least).toFixed(2)} |`);
