/* The pictures of the page in bindings/web/docs: wide and narrow, light and dark, and what it can do.
 * usage: node pictures.js, after `make web` */
import { mkdirSync } from 'node:fs';
import { join } from 'node:path';
import { openBrowser, web } from './tools.js';
import { serve } from './serve.js';

const WIDE = { width: 1400, height: 900 }, NARROW = { width: 390, height: 844 };
const folder = join(web, 'docs');

const server = await serve(join(web, 'dist')), browser = await openBrowser();

async function visit(hash, options) {
  const context = await browser.newContext({ viewport: WIDE, ...options }), page = await context.newPage();
  page.setDefaultTimeout(120000);
  await page.goto(`${server.url}#${hash}`);
  await settled(page);
  return page;
}

const settled = (page) => page.waitForFunction(() => document.getElementById('progress').hidden && document.documentElement.dataset.ready && document.documentElement.dataset.busy === '0' && document.querySelector('#report table'));

async function shoot(page, name, full = false) {
  await page.waitForTimeout(300); // the last frame of the picture
  await page.screenshot({ path: join(folder, `${name}.png`), fullPage: full });
  await page.context().close();
  console.log(name);
}

async function drag(page, points) {
  const box = await page.locator('#canvas').boundingBox(), at = ([x, y]) => [box.x + x * box.width, box.y + y * box.height];
  await page.mouse.move(...at(points[0]));
  await page.mouse.down();
  for (const point of points.slice(1)) await page.mouse.move(...at(point), { steps: 6 });
  await page.mouse.up();
}

async function set(page, values) {
  await page.evaluate((given) => {
    for (const [id, value] of Object.entries(given)) {
      const input = document.getElementById(id);
      if (input.type === 'checkbox') input.checked = value;
      else input.value = value;
      for (const type of ['input', 'change']) input.dispatchEvent(new Event(type, { bubbles: true }));
    }
  }, values);
  await settled(page);
}

mkdirSync(folder, { recursive: true });

await shoot(await visit('sample=dancer&faces=1500', { colorScheme: 'light' }), 'wide-light');

{ // compared side by side with the paper's flow, with a strip under the pointer
  const page = await visit('sample=bracket&faces=900', { colorScheme: 'dark' });
  await page.selectOption('#layout', 'beside');
  await page.selectOption('#against', 'paper');
  await page.waitForFunction(() => document.querySelectorAll('#report > .table-scroll thead th').length === 3);
  await settled(page);
  const box = await page.locator('#canvas').boundingBox();
  await page.mouse.move(box.x + box.width * 0.75, box.y + box.height * 0.48);
  await shoot(page, 'wide-dark');
}
{
  const page = await visit('sample=sheet&faces=900', { colorScheme: 'light' });
  await page.check('input[name=tool][value=paint]');
  await set(page, { brush: 12, value: 1.5 });
  await drag(page, [[0.16, 0.45], [0.22, 0.5], [0.3, 0.52]]);
  await page.waitForTimeout(100);
  await settled(page);
  await page.locator('#steer').scrollIntoViewIfNeeded();
  await shoot(page, 'paint');
}
{
  const page = await visit('sample=hand&faces=1500', { colorScheme: 'dark' });
  await page.check('input[name=tool][value=guide]');
  await drag(page, [[0.2, 0.68], [0.22, 0.67], [0.245, 0.68]]);
  await page.waitForTimeout(100);
  await settled(page);
  await page.locator('#steer').scrollIntoViewIfNeeded();
  await shoot(page, 'guide');
}
{
  const page = await visit('sample=bracket&faces=900&symmetry=any', { colorScheme: 'light' });
  await page.selectOption('#layout', 'result');
  await set(page, { base: true });
  await page.locator('#report').scrollIntoViewIfNeeded();
  await shoot(page, 'symmetry-report');
}
await shoot(await visit('sample=knot&faces=800', { colorScheme: 'light', viewport: NARROW, hasTouch: true, isMobile: true }), 'narrow-light', true);
{
  const page = await visit('sample=hand&faces=1500', { colorScheme: 'dark', viewport: NARROW, hasTouch: true, isMobile: true });
  await page.selectOption('#layout', 'result');
  await settled(page);
  await shoot(page, 'narrow-dark');
}

await browser.close();
await server.close();
