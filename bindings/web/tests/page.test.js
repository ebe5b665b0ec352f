/* The page as a visitor has it: built, served as static files, in headless Chromium. Results are compared with the native program, which is
 * run with the very command line that the page shows. */
import assert from 'node:assert/strict';
import { copyFileSync, readFileSync, readdirSync, writeFileSync } from 'node:fs';
import { basename, join } from 'node:path';
import { after, before, test } from 'node:test';
import { folder, measure, native, openBrowser, paint, parseObj, read, ringsAround, shape, web } from './tools.js';
import { serve } from './serve.js';

const COMPRESSED_LIMIT = 1180000; // bytes, of all files of a page: with one of the two modules
const PATIENCE = 600000; // ms: ends hangs only, as the machine may be busy

let server, browser, context, page, faults;

before(async () => {
  server = await serve(join(web, 'dist'));
  browser = await openBrowser();
});
after(async () => {
  await browser?.close();
  await server?.close();
});

async function visit(url = server.url, options = {}) {
  await context?.close();
  context = await browser.newContext({ viewport: { width: 1400, height: 900 }, acceptDownloads: true, ...options });
  page = await context.newPage();
  page.setDefaultTimeout(PATIENCE);
  faults = [];
  page.on('pageerror', (error) => faults.push(error.message));
  page.on('console', (message) => message.type() === 'error' && faults.push(message.text()));
  await page.goto(url);
}

/* The quads that the settings ask for are there, or a failure is said. */
const settled = () => page.waitForFunction(() => document.getElementById('progress').hidden && document.documentElement.dataset.ready && document.documentElement.dataset.busy === '0'
  && (document.querySelector('#report table') || !document.getElementById('error').hidden));

const textOf = (id) => page.textContent(`#${id}`);
const errorOf = async () => ((await page.isHidden('#error')) ? null : textOf('error'));

async function download(button) {
  const [file] = await Promise.all([page.waitForEvent('download'), page.click(`#${button}`)]);
  const path = join(folder, `page-${file.suggestedFilename()}`);
  await file.saveAs(path);
  return readFileSync(path);
}

/* Runs the page's command line natively on the file of that name in the folder: the bytes of its result. */
async function nativeResult(ending = 'obj') {
  const [program, input, , , ...switches] = (await textOf('command')).trim().split(' ');
  assert.equal(program, 'quadwright');
  native(input, '-o', `native.${ending}`, ...switches);
  return read(`native.${ending}`);
}

const settings = (values) => page.evaluate((given) => {
  for (const [id, value] of Object.entries(given)) {
    const input = document.getElementById(id);
    if (input.type === 'checkbox') input.checked = value;
    else input.value = value;
    input.dispatchEvent(new Event('input', { bubbles: true }));
    input.dispatchEvent(new Event('change', { bubbles: true }));
  }
}, values);

async function drop(path, name = basename(path)) {
  const bytes = readFileSync(path).toString('base64');
  await page.evaluate(async ([encoded, fileName]) => {
    const blob = await (await fetch(`data:application/octet-stream;base64,${encoded}`)).blob(), data = new DataTransfer();
    data.items.add(new File([blob], fileName));
    for (const type of ['dragover', 'drop']) document.body.dispatchEvent(new DragEvent(type, { dataTransfer: data, bubbles: true, cancelable: true }));
  }, [bytes, name]);
}

const sampleFile = (name) => copyFileSync(join(web, `dist/samples/${name}.obj`), join(folder, `${name}.obj`));

test('the first visit makes quads of a sample, byte for byte the native ones', async () => {
  await visit();
  await settled();
  assert.equal(await errorOf(), null);
  sampleFile('bracket');
  assert.ok((await download('save-obj')).equals(await nativeResult('obj')));
  assert.ok((await download('save-ply')).equals(await nativeResult('ply')));
  const figures = measure('native.obj');
  assert.match(await textOf('status'), new RegExp(`^${figures.quads ?? figures.topology.quads} quads`));
  assert.equal([...server.sent.keys()].filter((path) => path.endsWith('.wasm')).length, 1);
  assert.deepEqual(faults, []);
});

test('a page that is cross-origin isolated has several threads, the same bytes, and works offline', async () => {
  const isolated = await serve(join(web, 'dist'), 0, { isolated: true });
  try {
    await visit(isolated.url);
    assert.equal(await page.evaluate(() => crossOriginIsolated), true);
    await settled();
    assert.equal(await errorOf(), null);
    sampleFile('bracket');
    assert.ok((await download('save-obj')).equals(await nativeResult('obj')));
    const cores = await page.evaluate(() => navigator.hardwareConcurrency);
    assert.equal(page.workers().filter((worker) => /thread-/.test(worker.url())).length, Math.min(cores, 8) - 1);
    await page.evaluate(() => navigator.serviceWorker.ready);
    const modules = [...isolated.sent.keys()].filter((path) => path.endsWith('.wasm'));
    assert.ok(modules.length === 1 && /threads/.test(modules[0]), String(modules));
    await context.setOffline(true);
    await isolated.close();
    await page.reload();
    await settled();
    assert.equal(await errorOf(), null);
    assert.ok((await download('save-obj')).equals(await nativeResult('obj')));
    assert.deepEqual(faults, []);
  } finally {
    await isolated.close().catch(() => {});
  }
});

test('a preset sets its options, none takes them back, and a file keeps its name', async () => {
  await visit(`${server.url}#sample=sheet&faces=300`);
  await settled();
  await page.selectOption('#preset', 'cad');
  await settled();
  for (const words of ['--sharp-angle 30', '--adaptive 0', '--loops 1', '--evenness 0.25']) assert.ok((await textOf('command')).includes(words), words);
  assert.match(await textOf('preset-help'), /\w/);
  await page.selectOption('#preset', '');
  await settled();
  assert.ok(!(await textOf('command')).includes('--loops'));
  sampleFile('sheet');
  await drop(join(folder, 'sheet.obj'), "Anna's Blüte 2.obj");
  await settled();
  assert.ok((await textOf('command')).startsWith("quadwright 'Anna'\\''s Blüte 2.obj' -o 'Anna'\\''s Blüte 2-quads.obj'"));
  assert.equal(await errorOf(), null);
  assert.deepEqual(faults, []);
});

test('every sample can be picked', async () => {
  await visit();
  const names = await page.$$eval('#sample option', (all) => all.map((one) => one.value).filter(Boolean));
  assert.equal(names.length, 6);
  assert.deepEqual([...names].sort(), readdirSync(join(web, 'dist/samples')).map((name) => name.replace('.obj', '')).sort());
  for (const name of names) {
    await settled();
    await page.selectOption('#sample', name);
    await page.waitForFunction((wanted) => document.getElementById('command').textContent.startsWith(`quadwright ${wanted}.obj`), name);
    await settled();
    assert.equal(await errorOf(), null, name);
    assert.match(await textOf('status'), /^\d+ quads/);
  }
});

test('a file is opened by drop and by the picker, in each format', async () => {
  await visit();
  await settled();
  const path = shape('knot', 1500);
  for (const ending of ['ply', 'off']) native(path, '-o', `triangles.${ending}`, '--faces', '200');
  await drop(path, 'dropped.obj');
  await page.waitForFunction(() => document.getElementById('command').textContent.includes('dropped.obj'));
  await settled();
  copyFileSync(path, join(folder, 'dropped.obj'));
  assert.ok((await download('save-obj')).equals(await nativeResult('obj')));
  for (const name of ['triangles.ply', 'triangles.off']) {
    await page.setInputFiles('#file', join(folder, name));
    await page.waitForFunction((wanted) => document.getElementById('command').textContent.includes(wanted), name);
    await settled();
    assert.equal(await errorOf(), null, name);
    assert.ok((await download('save-obj')).equals(await nativeResult('obj')), name);
  }
});

test('a file of points is wrapped, and what is opened after it is not', async () => {
  await visit(`${server.url}#sample=knot&faces=300`);
  await settled();
  const count = 2000, lines = Array.from({ length: count }, (_, i) => {
    const z = 1 - (2 * i + 1) / count, r = Math.sqrt(1 - z * z), a = i * 2.399963229728653;
    return [r * Math.cos(a), r * Math.sin(a), z].join(' ');
  });
  writeFileSync(join(folder, 'ball.xyz'), lines.join('\n'));
  await page.setInputFiles('#file', join(folder, 'ball.xyz'));
  await page.waitForFunction(() => document.getElementById('command').textContent.includes('ball.xyz'));
  await settled();
  assert.equal(await errorOf(), null);
  assert.match(await textOf('command'), / --wrap/);
  assert.ok((await download('save-obj')).equals(await nativeResult('obj')));
  await page.click('#reset');
  await settled();
  assert.equal(await errorOf(), null);
  await page.selectOption('#sample', 'sheet');
  await page.waitForFunction(() => document.getElementById('command').textContent.includes('sheet.obj'));
  await settled();
  assert.doesNotMatch(await textOf('command'), /wrap/);
  assert.deepEqual(faults, []);
});

test('another count and other options give the native result of the same command line', async () => {
  await visit(`${server.url}#sample=knot&faces=500`);
  await settled();
  sampleFile('knot');
  assert.match(await textOf('command'), /--faces 500$/);
  await settings({ 'count-number': 800, 'option-follow': 0, 'option-adaptive': 0.8 });
  await page.waitForFunction(() => /--faces 800 .*--adaptive 0.8/.test(document.getElementById('command').textContent));
  await settled();
  assert.ok((await download('save-obj')).equals(await nativeResult('obj')));
  const link = await page.evaluate(() => location.hash);
  assert.match(link, /sample=knot&faces=800&follow=0&adaptive=0.8/);
  const before = await textOf('status');
  await visit(`${server.url}${link}`);
  await settled();
  assert.equal((await textOf('status')).split(' in ')[0], before.split(' in ')[0]);
});

test('every option of the library has a control', async () => {
  await visit();
  await settled();
  const { init } = await import('../package/index.js'), { options } = await init();
  const ids = await page.$$eval('[id^="option-"]:not([id$="-help"])', (all) => all.map((one) => one.id.slice(7)));
  const without = ['faces', 'vertices', 'edge_length', 'ratio', 'threads']; // the count has its own control, and there is one thread
  assert.deepEqual(ids.sort(), options.map(({ name }) => name).filter((name) => !without.includes(name)).sort());
});

test('a run is cancelled, and the next one is whole', async () => {
  await visit(`${server.url}#sample=dancer&faces=500`);
  await settled();
  await settings({ 'count-number': 60000 });
  await page.waitForSelector('#progress:not([hidden])');
  await page.click('#cancel');
  await page.waitForSelector('#progress', { state: 'hidden' });
  assert.equal(await textOf('status'), 'cancelled');
  await settings({ 'count-number': 700 });
  await settled();
  sampleFile('dancer');
  assert.ok((await download('save-obj')).equals(await nativeResult('obj')));
});

test('broken, empty and huge files are refused in a sentence, and the page goes on', async () => {
  await visit(`${server.url}?memory=400`);
  await settled();
  const cases = [['empty.obj', '', /empty/], ['broken.off', 'OFF\n3 1 0\n0 0 0\n1 0 0\n', /broken\.off, line 2: the header announces/i], ['text.obj', 'no mesh at all', /format|face/], ['far.obj', 'v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 9\n', /vertex/],
    ['cut.glb', 'glTF\x02\0\0\0\x10\0\0\0', /GLB/], ['huge.stl', Buffer.alloc(120 * 2 ** 20), /memory.*command line.*quadwright huge\.stl/]];
  for (const [name, contents, sentence] of cases) {
    writeFileSync(join(folder, name), contents);
    await page.setInputFiles('#file', join(folder, name));
    await page.waitForFunction(() => !document.getElementById('error').hidden);
    assert.match(await textOf('error'), sentence, name);
    assert.match(await textOf('error'), /^[A-Z].*\S$/);
    await page.selectOption('#sample', 'knot');
    await page.waitForFunction(() => document.getElementById('error').hidden);
    await settled();
    assert.equal(await errorOf(), null);
  }
  await settings({ 'count-number': 200000 });
  await page.waitForFunction(() => !document.getElementById('error').hidden);
  assert.match(await textOf('error'), /memory.*quadwright knot\.obj -o knot-quads\.obj --faces 200000/);
});

test('the page outlives its Worker and says so', async () => {
  await visit(`${server.url}#sample=dancer&faces=500`);
  await settled();
  // The Worker throws at the next message, which begins a run: an error of a Worker at rest would belong to nobody.
  const worker = page.workers().find((each) => !each.url().includes('thread'));
  await worker.evaluate(() => addEventListener('message', () => { throw new Error('broken on purpose'); }));
  await settings({ 'count-number': 60000 });
  await page.waitForFunction(() => !document.getElementById('error').hidden);
  assert.match(await textOf('error'), /Worker crashed.*broken on purpose.*goes on/s);
  await settings({ 'count-number': 600 });
  await settled();
  assert.equal(await errorOf(), null);
  assert.match(await textOf('status'), /^\d+ quads/);
});

test('GLB goes out and comes in again', async () => {
  await visit(`${server.url}#sample=knot&faces=400`);
  await settled();
  const bytes = await download('save-glb');
  assert.equal(bytes.subarray(0, 4).toString(), 'glTF');
  writeFileSync(join(folder, 'knot.glb'), bytes);
  await page.setInputFiles('#file', join(folder, 'knot.glb'));
  await page.waitForFunction(() => document.getElementById('command').textContent.includes('knot.glb'));
  await settled();
  assert.equal(await errorOf(), null);
  assert.match(await textOf('status'), /^\d+ quads/);
});

test('a textured, rigged GLB comes out as the native program writes it', async () => {
  await visit(`${server.url}#sample=knot&faces=400`);
  await settled();
  paint(shape('dancer', 5000), 'painted.glb');
  await page.setInputFiles('#file', join(folder, 'painted.glb'));
  await page.waitForFunction(() => document.getElementById('command').textContent.includes('painted.glb'));
  await settled();
  assert.equal(await errorOf(), null);
  assert.match(await textOf('command'), /^quadwright painted\.glb -o painted-quads\.glb /); // a scene stays one
  assert.ok((await download('save-glb')).equals(await nativeResult('glb')));
});

test('maps are baked, shown, and in the GLB as the native program writes it', async () => {
  await visit(`${server.url}#sample=knot&faces=400`);
  await settled();
  paint(shape('dancer', 5000), 'painted.glb');
  await page.setInputFiles('#file', join(folder, 'painted.glb'));
  await page.waitForFunction(() => document.getElementById('command').textContent.includes('painted.glb'));
  await settled();
  const plain = await page.locator('#canvas').screenshot();
  await settings({ 'count-number': 800 });
  await settled();
  await settings({ texture: '512', bake: true });
  await settled();
  assert.equal(await errorOf(), null);
  assert.match(await textOf('status'), /\d+ charts; the maps' normals are \d+\.\d degrees off, colours \d+\.\d of 255/);
  assert.match(await textOf('command'), /--bake input --texture 512/);
  assert.ok((await download('save-glb')).equals(await nativeResult('glb')));
  await settings({ layout: 'result', wires: false, irregular: false });
  await settled();
  assert.ok(!(await page.locator('#canvas').screenshot({ path: join(folder, 'maps.png') })).equals(plain));
  await settings({ bake: false });
  await settled();
  assert.doesNotMatch(await textOf('status'), /charts/);
  await visit(`${server.url}#sample=knot&faces=400&bake=input&texture=512`);
  await settled();
  assert.ok((await page.isChecked('#bake')) && (await page.isVisible('#texture')));
  assert.match(await textOf('status'), /charts/);
  assert.deepEqual(faults, []);
});

test('two settings are compared, the paper\'s flow among them', async () => {
  await visit(`${server.url}#sample=bracket&faces=400`);
  await settled();
  await page.selectOption('#layout', 'beside');
  await page.selectOption('#against', 'paper');
  await page.waitForFunction(() => document.querySelectorAll('#report > .table-scroll thead th').length === 3);
  await settled();
  const cells = await page.$$eval('#report > .table-scroll tbody tr:nth-child(2) td', (all) => all.map((one) => Number(one.textContent)));
  sampleFile('bracket');
  for (const [i, flow] of ['closed', 'mcf-mr'].entries()) {
    native('bracket.obj', '-o', 'other.obj', '--faces', '400', '--flow', flow);
    const figures = measure('other.obj');
    assert.equal(cells[i], figures.irregular ?? figures.topology.irregular, flow);
  }
  await page.click('#keep');
  await settled();
  assert.equal(await page.inputValue('#against'), 'kept');
});

/* Where the sheet is on the picture while it is drawn on: below the middle of its left half, and a step to each side. */
async function surfacePlace() {
  const box = await page.locator('#canvas').boundingBox();
  return { x: box.x + box.width / 4, y: box.y + box.height * 0.6, step: box.width / 60 };
}

async function drag(points) {
  await page.mouse.move(...points[0]);
  await page.mouse.down();
  for (const point of points.slice(1)) await page.mouse.move(...point, { steps: 4 });
  await page.mouse.up();
}

const hint = () => textOf('steer-hint');
const keep = async (button, name) => writeFileSync(join(folder, name), await download(button));

test('density is painted on the surface, and the quads are those of the command line with the file that is saved', async () => {
  await visit(`${server.url}#sample=sheet&faces=600`);
  await settled();
  sampleFile('sheet');
  const before = await textOf('status');
  await page.check('input[name=tool][value=paint]');
  await settings({ brush: 15, value: 2 });
  const { x, y, step } = await surfacePlace();
  await drag([[x - 4 * step, y], [x - step, y], [x + 2 * step, y + step]]);
  await page.waitForFunction(() => /densities from 1 to 4/.test(document.getElementById('steer-hint').textContent));
  await settled();
  await page.waitForFunction((old) => document.getElementById('status').textContent !== old, before);
  assert.equal(await errorOf(), null);
  await keep('save-density', 'sheet-density.txt');
  const painted = readFileSync(join(folder, 'sheet-density.txt'), 'utf8').trim().split('\n').map(Number);
  assert.ok(painted.filter((d) => d > 2).length > 20 && painted.filter((d) => d === 1).length > 20);
  assert.match(await textOf('command'), /--density sheet-density\.txt/);
  await page.click('#link');
  await page.waitForFunction(() => /The link is in the .* not what is painted: save it as a file\.$/.test(document.getElementById('status').textContent));
  assert.ok((await download('save-obj')).equals(await nativeResult('obj')));
  await page.click('#clear-density');
  await settled();
  assert.match(await hint(), /Painted: nothing/);
  await page.focus('#canvas'); // by keys, in the middle
  await page.keyboard.press(' ');
  await page.waitForFunction(() => /densities from/.test(document.getElementById('steer-hint').textContent));
  await settled();
  assert.equal(await errorOf(), null);
});

test('a guide is drawn on the surface, edges lie on it, and a link carries it', async () => {
  await visit(`${server.url}#sample=sheet&faces=600`);
  await settled();
  sampleFile('sheet');
  await page.check('input[name=tool][value=guide]');
  const { x, y, step } = await surfacePlace();
  await drag([[x - 5 * step, y + step], [x - 3 * step, y], [x - step, y + step / 2], [x + step, y + step]]);
  await page.waitForFunction(() => /Guides: 1/.test(document.getElementById('steer-hint').textContent));
  await settled();
  assert.equal(await errorOf(), null);
  await keep('save-guides', 'sheet-guides.obj');
  assert.match(await textOf('command'), /--guides sheet-guides\.obj/);
  assert.ok((await download('save-obj')).equals(await nativeResult('obj')));
  const report = JSON.parse(await download('save-json'));
  assert.ok(report.report.guide_edges > 5 && report.report.guide_off < 0.3, `${report.report.guide_off}`);
  const link = await page.evaluate(() => location.hash), bytes = await download('save-obj');
  await page.click('#link');
  await page.waitForFunction(() => /The link is in the (clipboard|address bar)\.$/.test(document.getElementById('status').textContent));
  assert.match(link, /guide=loop%2Copen/);
  await page.focus('#canvas');
  await page.keyboard.press('Backspace');
  await page.waitForFunction(() => /Guides: none/.test(document.getElementById('steer-hint').textContent));
  await settled();
  await visit(`${server.url}${link}`);
  await settled();
  assert.ok((await download('save-obj')).equals(bytes));
  assert.deepEqual(faults, []);
});

test('a loop that is drawn with rings has closed rows on both sides', async () => {
  await visit(`${server.url}#sample=sheet&faces=3000`);
  await settled();
  sampleFile('sheet');
  const plain = await download('save-obj');
  await page.check('input[name=tool][value=guide]');
  await page.selectOption('#kind', 'rings');
  await settings({ rings: 4 });
  const { x, y, step } = await surfacePlace();
  await drag(Array.from({ length: 17 }, (_, i) => [x + 2.5 * step * Math.cos(i * Math.PI / 8), y - step + 2.5 * step * Math.sin(i * Math.PI / 8)]));
  await page.waitForFunction(() => /Guides: 1/.test(document.getElementById('steer-hint').textContent));
  await settled();
  assert.equal(await errorOf(), null);
  await keep('save-guides', 'sheet-guides.obj');
  const drawn = read('sheet-guides.obj'), loop = parseObj(drawn).positions, made = await download('save-obj');
  assert.match(drawn.toString(), /^g rings 4$/m);
  assert.ok(made.equals(await nativeResult('obj')));
  assert.equal(ringsAround(plain, loop, 2), 0);
  const inside = ringsAround(made, loop, 0.95), all = ringsAround(made, loop, 2);
  assert.ok(inside >= 2 && all - inside >= 3, `${inside} of ${all}`); // the loop itself is one of these
  assert.deepEqual(faults, []);
});

test('beside the surface a drag turns it, also while a tool is chosen', async () => {
  await visit(`${server.url}#sample=knot&faces=400`);
  await settled();
  await page.check('input[name=tool][value=paint]');
  const box = await page.locator('#canvas').boundingBox(), picture = () => page.evaluate(() => document.getElementById('canvas').toDataURL());
  const still = await picture();
  await drag([[box.x + 10, box.y + 60], [box.x + 60, box.y + 80]]);
  await page.waitForFunction((old) => document.getElementById('canvas').toDataURL() !== old, still);
  assert.match(await hint(), /Painted: nothing/);
});

test('it is painted by touch, on a narrow screen', async () => {
  await visit(`${server.url}#sample=knot&faces=400`, { viewport: { width: 390, height: 844 }, hasTouch: true, isMobile: true });
  await settled();
  await page.check('input[name=tool][value=paint]');
  await page.evaluate(() => scrollTo(0, 0));
  const box = await page.locator('#canvas').boundingBox();
  for (let i = 0; i < 12 && /nothing/.test(await hint()); i++) await page.touchscreen.tap(box.x + box.width * (0.3 + i / 30), box.y + box.height / 2);
  assert.match(await hint(), /densities from/);
  await settled();
  assert.equal(await errorOf(), null);
  assert.match(await textOf('command'), /--density knot-density\.txt/);
});

test('the plane of symmetry is shown', async () => {
  await visit(`${server.url}#sample=bracket&faces=400&symmetry=x`);
  await settled();
  assert.equal(await errorOf(), null);
  assert.equal(await page.getAttribute('#canvas', 'data-plane'), 'shown');
  const picture = () => page.evaluate(() => document.getElementById('canvas').toDataURL()), shown = await picture();
  await settings({ plane: false });
  await page.waitForFunction((old) => document.getElementById('canvas').toDataURL() !== old, shown);
  await settings({ 'option-symmetry': 'none' });
  await page.waitForFunction(() => document.getElementById('canvas').dataset.plane === '');
});

test('a boundary that stays, with the triangle that it keeps where it is odd', async () => {
  writeFileSync(join(folder, 'five.obj'), 'v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nv 0.5 1.4 0\nv 0.5 0.5 0\nf 1 2 6\nf 2 3 6\nf 3 4 6\nf 4 1 6\nf 4 3 5\n');
  await visit();
  await settled();
  await page.setInputFiles('#file', join(folder, 'five.obj'));
  await page.waitForFunction(() => document.getElementById('command').textContent.includes('five.obj'));
  await settled();
  await settings({ 'option-fix_boundary': true });
  await page.waitForFunction(() => document.getElementById('command').textContent.includes('--fix-boundary'));
  await settled();
  assert.equal(await errorOf(), null);
  const bytes = await download('save-obj'), sizes = bytes.toString().split('\n').filter((line) => line.startsWith('f ')).map((line) => line.trim().split(/\s+/).length - 1);
  assert.equal(sizes.filter((n) => n === 3).length, 1);
  assert.ok(bytes.equals(await nativeResult('obj')));
});

test('what steers most is in front: following the shape, density, symmetry, sharp edges', async () => {
  await visit();
  await settled();
  const first = await page.$$eval('#options [id^="option-"]:not([id$="-help"])', (all) => all.map((one) => one.id.slice(7)));
  for (const name of ['follow', 'adaptive', 'symmetry', 'sharp_angle']) assert.ok(first.includes(name), name);
  for (const id of ['irregular', 'base', 'chord', 'wires', 'shaded', 'plane']) assert.ok(await page.isVisible(`#${id}`), id);
  assert.equal(await page.locator('#plots figure').count(), 3);
});

/* How long that takes is measured by tools/web speed: docs/dev/results/web.md. */
test('it takes files and settings before its first quads are there', async () => {
  await visit('about:blank');
  await page.addInitScript(() => {
    new MutationObserver(() => {
      if (document.documentElement?.dataset.ready) window.quadsAtReady ??= document.querySelectorAll('#report table').length;
    }).observe(document, { attributes: true, subtree: true, attributeFilter: ['data-ready'] });
  });
  await page.goto(`${server.url}#sample=knot&faces=400`);
  await settled();
  assert.equal(await page.evaluate(() => window.quadsAtReady), 0);
});

test('irregular vertices are counted in one way', async () => {
  await visit(`${server.url}#sample=sheet&faces=400`);
  await settled();
  const rows = Object.fromEntries(await page.$$eval('#report > .table-scroll tbody tr', (all) => all.map((row) => [row.querySelector('th').textContent, Number(row.querySelector('td').textContent)])));
  const [, inside, edge] = (await textOf('status')).match(/with (\d+) irregular vertices(?: and (\d+) on boundaries)? in/);
  assert.equal(Number(inside), rows['interior vertices of valence other than 4']);
  assert.equal(Number(edge ?? 0), rows['boundary vertices of valence other than 3']);
  assert.ok(Number(edge) >= 4); // the corners of the sheet
});

test('the strip under the pointer is shown', async () => {
  await visit(`${server.url}#sample=knot&faces=400`);
  await settled();
  const box = await page.locator('#canvas').boundingBox();
  let most = 0;
  for (let i = 1; i < 20; i++) {
    await page.mouse.move(box.x + box.width * (0.5 + i / 40), box.y + box.height / 2);
    most = Math.max(most, Number(await page.getAttribute('#canvas', 'data-strip')));
  }
  assert.ok(most >= 4, `${most}`);
});

test('it works offline after the first visit', async () => {
  await visit();
  await settled();
  await page.evaluate(() => navigator.serviceWorker.ready);
  await page.waitForFunction(() => navigator.serviceWorker.controller);
  await context.setOffline(true);
  await page.reload();
  await settled();
  await page.selectOption('#sample', 'sheet');
  await page.waitForFunction(() => document.getElementById('command').textContent.includes('sheet.obj'));
  await settled();
  assert.equal(await errorOf(), null);
  assert.match(await textOf('status'), /^\d+ quads/);
  await download('save-glb');
  await context.setOffline(false);
});

test('all that it is made of fits 1.18 compressed megabytes', async () => {
  const { gzipSync } = await import('node:zlib');
  const files = readdirSync(join(web, 'dist'), { recursive: true, withFileTypes: true }).filter((entry) => entry.isFile());
  const total = files.reduce((sum, entry) => sum + gzipSync(readFileSync(join(entry.parentPath ?? entry.path, entry.name)), { level: 9 }).length, 0);
  const modules = files.filter(({ name }) => name.endsWith('.wasm')).map((entry) => gzipSync(readFileSync(join(entry.parentPath ?? entry.path, entry.name)), { level: 9 }).length);
  assert.ok(files.length > 10);
  assert.equal(modules.length, 2);
  assert.ok(total - Math.min(...modules) <= COMPRESSED_LIMIT, `${total} bytes, modules of ${modules}`);
});

test('axe-core finds nothing serious, light and dark, wide and narrow', async () => {
  const axe = readFileSync(join(web, 'node_modules/axe-core/axe.min.js'), 'utf8');
  for (const [colorScheme, viewport] of [['light', { width: 1400, height: 900 }], ['dark', { width: 390, height: 844 }]]) {
    await visit(server.url, { colorScheme, viewport, bypassCSP: true });
    await settled();
    await page.click('#more summary');
    await page.click('#report summary');
    await page.evaluate(axe);
    const { violations, passes } = await page.evaluate(() => globalThis.axe.run());
    assert.ok(passes.length > 20);
    const serious = violations.filter(({ impact }) => ['serious', 'critical'].includes(impact));
    assert.deepEqual(serious.map(({ id, nodes }) => `${id}: ${nodes[0].html}`), []);
  }
});

test('it is worked by keyboard, and fits a narrow screen', async () => {
  await visit(`${server.url}#sample=knot&faces=400`, { viewport: { width: 360, height: 640 }, hasTouch: true, reducedMotion: 'reduce' });
  await settled();
  assert.ok(await page.evaluate(() => document.documentElement.scrollWidth <= innerWidth));
  const picture = () => page.evaluate(() => document.getElementById('canvas').toDataURL());
  await page.focus('#canvas');
  const still = await picture();
  await page.keyboard.press('ArrowLeft');
  await page.waitForFunction((old) => document.getElementById('canvas').toDataURL() !== old, still);
  await page.focus('#count');
  const command = await textOf('command');
  await page.keyboard.press('ArrowRight');
  await page.keyboard.press('ArrowRight');
  await page.waitForFunction((old) => document.getElementById('command').textContent !== old, command);
  await settled();
  assert.equal(await errorOf(), null);
});
