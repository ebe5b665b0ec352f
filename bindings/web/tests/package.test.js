/* The npm package, as a user has it: packed, installed in a folder of its own, and called there in a process of its own. */
import assert from 'node:assert/strict';
import { execFileSync, spawnSync } from 'node:child_process';
import { createHash } from 'node:crypto';
import { cpSync, mkdirSync, readFileSync, readdirSync, writeFileSync } from 'node:fs';
import { join } from 'node:path';
import { before, test } from 'node:test';
import { gzipSync } from 'node:zlib';
import { serve } from './serve.js';
import { folder, native, openBrowser, parseObj, read, ringsAround, root, shape, web } from './tools.js';

const project = join(folder, 'project');
let quadwright;

before(async () => {
  mkdirSync(project);
  writeFileSync(join(project, 'package.json'), '{"private": true, "type": "module"}');
  const packed = join(root, 'out/npm', readdirSync(join(root, 'out/npm')).find((name) => name.endsWith('.tgz')));
  execFileSync('npm', ['install', '--no-audit', '--no-fund', '--no-package-lock', '--offline', '--omit=peer', packed], { cwd: project });
  cpSync(join(web, 'node_modules/three'), join(project, 'node_modules/three'), { recursive: true, filter: (path) => !path.includes('/examples') || path.endsWith('/examples') });
  quadwright = await import(join(project, 'node_modules/quadwright/index.js'));
  await quadwright.init({ threads: Number(process.env.QUADWRIGHT_THREADS ?? 0) }); // for running all of this with several
});

const sha256 = (bytes) => createHash('sha256').update(bytes).digest('hex');

function node(source, ...args) {
  const name = join(project, 'script.js');
  writeFileSync(name, source);
  const { status, stdout, stderr } = spawnSync(process.execPath, [name, ...args], { encoding: 'utf8', timeout: 600000 });
  assert.equal(status, 0, stderr);
  return stdout;
}

test('the lines of the README run as they are', () => {
  const lines = readFileSync(join(project, 'node_modules/quadwright/README.md'), 'utf8').match(/```js\n([^]*?)```/)[1];
  assert.match(node(lines), /^\d+ quads, 8 irregular vertices\n$/);
});

test('CommonJS takes it as the README says, and the modules are as small as it says', () => {
  const text = readFileSync(join(project, 'node_modules/quadwright/README.md'), 'utf8');
  writeFileSync(join(project, 'common.cjs'), text.match(/```cjs\n([^]*?)```/)[1]);
  assert.match(execFileSync(process.execPath, ['common.cjs'], { cwd: project, encoding: 'utf8' }), /^\d+ quads\n$/);
  for (const name of ['quadwright', 'quadwright-threads']) {
    const bytes = readFileSync(join(project, `node_modules/quadwright/${name}.wasm`));
    assert.ok(bytes.length < 2.05e6 && gzipSync(bytes, { level: 9 }).length < 0.85e6);
  }
});

test('the types are those of the library, and programs that use them are checked', () => {
  writeFileSync(join(project, 'right.ts'), `import { init, remesh, Remesher, tables } from 'quadwright';
import { fromGeometry, toGeometry } from 'quadwright/three';
await init();
const result = await remesh(new Float32Array(9), new Uint32Array([0, 1, 2]), { faces: 5, flow: 'mcf-mr', follow: 0.5, relax: true, signal: new AbortController().signal });
const count: number = result.report.topology.irregular + tables().options.length;
console.log(count, fromGeometry, toGeometry, new Remesher());`);
  writeFileSync(join(project, 'wrong.ts'), `import { remesh } from 'quadwright'; remesh([], [], { follow: 'much' });`);
  const check = (file) => {
    const compilerOptions = { noEmit: true, strict: true, module: 'nodenext', target: 'es2022', lib: ['es2022', 'dom'], types: [], skipLibCheck: true };
    writeFileSync(join(project, 'tsconfig.json'), JSON.stringify({ compilerOptions, files: [file] }));
    return spawnSync(join(web, 'node_modules/.bin/tsc'), ['-p', project], { encoding: 'utf8' });
  };
  const right = check('right.ts'), wrong = check('wrong.ts');
  assert.equal(right.status, 0, right.stdout);
  assert.match(wrong.stdout, /follow|'string' is not assignable/);
});

test('every golden result has the bytes of the other platforms', async () => {
  const rows = readFileSync(join(root, 'tests/golden.tsv'), 'utf8').trim().split('\n').slice(1).map((line) => line.split('\t'));
  assert.ok(rows.length >= 12);
  const { options: table } = quadwright.tables(), remesher = new quadwright.Remesher();
  let compared = 0;
  for (const [name, input, switches, expected] of rows) {
    const words = switches.split(' '), options = {};
    for (let i = 0; i < words.length; i++) {
      const option = words[i] === '--sharp' ? 'sharp_angle' : words[i].slice(2).replaceAll('-', '_'), row = table.find((one) => one.name === option);
      if (!row || row.kind === 'flag') break;
      options[option] = row.kind === 'choice' ? words[++i] : Number(words[++i]);
    }
    if (2 * Object.keys(options).length !== words.length) continue; // a switch of the tool's own
    const [what, triangles] = input.split(':');
    await remesher.load(readFileSync(triangles ? shape(what, triangles) : join(root, 'tests/data', input)));
    await remesher.remesh(options);
    assert.equal(sha256(await remesher.save('obj')), expected, name);
    compared++;
  }
  assert.ok(compared >= 12, `${compared} rows`);
  remesher.close();
});

test('arrays, a Worker and the calling thread give the native result', async () => {
  const path = shape('knot', 2000), { positions, indices } = parseObj(readFileSync(path));
  native(path, '-o', 'knot.obj', '--faces', '400');
  const expected = parseObj(read('knot.obj'));
  const options = { faces: 400 };
  const stages = new Set();
  const inWorker = await quadwright.remesh(Float64Array.from(positions), Uint32Array.from(indices), { ...options, progress: (stage, fraction) => stages.add(stage) && assert.ok(fraction >= 0 && fraction <= 1) });
  const here = quadwright.remeshSync(positions, indices, options);
  for (const result of [inWorker, here]) {
    assert.deepEqual([...result.positions], expected.positions);
    assert.deepEqual([...result.quads].length, expected.indices.length);
  }
  assert.deepEqual(here.quads, inWorker.quads);
  assert.ok(stages.size > 1);
  assert.equal(inWorker.report.topology.quads, inWorker.quads.length / 4);
});

test('density, guides and a region steer a run as they do the native one', async () => {
  const path = shape('sheet', 2000), { positions, indices } = parseObj(readFileSync(path)), faces = 300, count = positions.length / 3;
  const density = Float32Array.from({ length: count }, (_, v) => (positions[3 * v] > 0 ? 2 : 1));
  writeFileSync(join(folder, 'density.txt'), Array.from(density).join('\n'));
  native(path, '-o', 'dense.obj', '--faces', `${faces}`, '--density', 'density.txt');
  const dense = await quadwright.remesh(positions, indices, { faces, density });
  assert.deepEqual([...dense.positions], parseObj(read('dense.obj')).positions);
  const nearest = (x, y) => density.reduce((best, _, v) => (Math.hypot(positions[3 * v] - x, positions[3 * v + 1] - y) < Math.hypot(positions[3 * best] - x, positions[3 * best + 1] - y) ? v : best), 0);
  const inner = 3 * Math.floor(indices.length / 6), points = [0, 1].flatMap((i) => positions.slice(3 * indices[inner + i], 3 * indices[inner + i] + 3));
  writeFileSync(join(folder, 'guides.obj'), `v ${points.slice(0, 3).join(' ')}\nv ${points.slice(3).join(' ')}\nl 1 2\n`);
  native(path, '-o', 'guided.obj', '--faces', `${faces}`, '--guides', 'guides.obj');
  const guided = quadwright.remeshSync(positions, indices, { faces, guides: [{ points }] });
  assert.deepEqual([...guided.positions], parseObj(read('guided.obj')).positions);
  assert.ok(guided.report.guide_edges > 0);
  const loop = Array.from({ length: 12 }, (_, i) => i * Math.PI / 6).flatMap((a) => positions.slice(3 * nearest(1.3 + 0.8 * Math.cos(a), 2 + 0.8 * Math.sin(a))).slice(0, 3));
  writeFileSync(join(folder, 'rings.obj'), `g rings 3\n${loop.map((x, i) => (i % 3 ? x : `\nv ${x}`)).join(' ')}\nl 1 2 3 4 5 6 7 8 9 10 11 12 1\n`);
  native(path, '-o', 'ringed.obj', '--faces', '2000', '--guides', 'rings.obj');
  const ringed = quadwright.remeshSync(positions, indices, { faces: 2000, guides: [{ points: loop, closed: true, rings: 3 }] });
  assert.deepEqual([...ringed.positions], parseObj(read('ringed.obj')).positions);
  const rings = [0.95, 2].map((reach) => ringsAround(read('ringed.obj'), loop, reach));
  assert.ok(rings[0] >= 2 && rings[1] - rings[0] >= 3, `${rings}`); // the loop itself is one of these
  const region = Uint8Array.from({ length: indices.length / 3 }, (_, f) => (positions[3 * indices[3 * f]] > 0 ? 1 : 0));
  const partly = await quadwright.remesh(positions, indices, { faces, region });
  const stayed = partly.rest.faceSizes.length, outside = region.filter((x) => x === 0).length;
  assert.ok(stayed === outside || stayed === outside + 1);
  assert.equal(partly.report.kept_faces, stayed);
  assert.equal(partly.report.topology.boundary_loops, dense.report.topology.boundary_loops);
  assert.equal(dense.rest, null);
  await assert.rejects(quadwright.remesh(positions, indices, { faces, density: [1, 2] }), /there are 2 densities for/);
  await assert.rejects(quadwright.remesh(positions, indices, { faces, guides: [{ points: [1e3, 0, 0, 1e3, 1, 0] }] }), /guide 0 is off the surface/);
  await assert.rejects(quadwright.remesh(positions, indices, { faces, guides: [{ points, kind: 'wish' }] }), /guide 0 is of the kind wish/);
  await assert.rejects(quadwright.remesh(positions, indices, { faces, region: [1] }), /the region says something of 1 faces/);
});

test('a lost Worker is given the steering again', async () => {
  const path = shape('sheet', 2000), { positions, indices } = parseObj(readFileSync(path)), remesher = new quadwright.Remesher();
  const density = Array.from({ length: positions.length / 3 }, (_, v) => (positions[3 * v] > 0 ? 3 : 1));
  await remesher.set(positions, indices);
  await remesher.steer({ density });
  const first = await remesher.remesh({ faces: 300 });
  const stop = new AbortController();
  await assert.rejects(remesher.measure({ signal: (setTimeout(() => stop.abort(), 0), stop.signal) }).then(() => stop.signal.throwIfAborted() ?? Promise.reject(new Error('in time'))));
  const second = await remesher.remesh({ faces: 300 });
  assert.deepEqual(second.positions, first.positions);
  await remesher.steer();
  assert.notDeepEqual((await remesher.remesh({ faces: 300 })).positions, first.positions);
  remesher.close();
});

test('one surface, several runs: the results of fresh ones', async () => {
  const path = shape('bracket', 2000), remesher = new quadwright.Remesher();
  const surface = await remesher.load(readFileSync(path));
  assert.equal(surface.faceSize, 3);
  for (const faces of [500, 900, 500]) {
    native(path, '-o', 'native.ply', '--faces', String(faces));
    await remesher.remesh({ faces });
    assert.ok(read('native.ply').equals(await remesher.save('ply')), `${faces} quads`);
  }
  const report = await remesher.measure();
  assert.ok(report.quality.hausdorff > 0);
  remesher.close();
});

test('marks of arrays are sharp, those of files are when asked for, as in the native tool', async () => {
  const path = shape('knot', 2000), text = readFileSync(path).toString(), { positions, indices } = parseObj(text), remesher = new quadwright.Remesher();
  const marks = indices.slice(0, 60).flatMap((v, i) => (i % 3 === 0 ? [v, indices[i + 1]] : []));
  const marked = join(folder, 'marked.obj');
  writeFileSync(marked, text + marks.reduce((all, v, i) => all + (i % 2 ? ` ${v + 1}\n` : `l ${v + 1}`), ''));
  native(marked, '-o', 'unasked.obj', '--faces', '300');
  native(marked, '-o', 'asked.obj', '--faces', '300', '--sharp', 'marks');
  assert.notDeepEqual(read('unasked.obj'), read('asked.obj'));
  await remesher.set(positions, indices, { markedEdges: marks });
  assert.deepEqual([...(await remesher.remesh({ faces: 300 })).positions], parseObj(read('asked.obj')).positions);
  await remesher.load(readFileSync(marked)); // and what was set before counts no more
  assert.deepEqual([...(await remesher.remesh({ faces: 300 })).positions], parseObj(read('unasked.obj')).positions);
  assert.deepEqual([...(await remesher.remesh({ faces: 300, sharp_marks: true })).positions], parseObj(read('asked.obj')).positions);
  remesher.close();
});

test('the module with threads gives the same bytes, stops when told to, and ends', () => {
  const path = shape('dancer', 8000);
  native(path, '-o', 'threads.obj', '--faces', '900');
  const told = node(`import { init, Remesher, remeshSync } from 'quadwright';
    import { createHash } from 'node:crypto';
    import { readFileSync } from 'node:fs';
    await init({ threads: 3 });
    const remesher = new Remesher(), hashes = [];
    await remesher.load(readFileSync(process.argv[2]));
    const end = new AbortController();
    await remesher.remesh({ faces: 800 }, { signal: end.signal, progress: () => end.abort() }).then(() => hashes.push('not stopped'), (error) => hashes.push(error.name));
    for (const outward of [true, false, true]) {
      const { report } = await remesher.remesh({ faces: 900, outward });
      hashes.push(createHash('sha256').update(await remesher.save('obj')).digest('hex'), report.seconds > 0.01 && report.seconds < 100);
    }
    remesher.close();
    const { quads } = remeshSync([0, 0, 0, 1, 0, 0, 1, 1, 0, 0, 1, 0], [0, 1, 2, 0, 2, 3], { faces: 20 });
    console.log(JSON.stringify([hashes, quads.length > 0]));`, path);
  const hash = sha256(read('threads.obj'));
  assert.deepEqual(JSON.parse(told), [['AbortError', hash, true, hash, true, hash, true], true]);
});

test('a run ends by an AbortSignal, at once, and the next one is whole', async () => {
  const path = shape('dancer', 20000), remesher = new quadwright.Remesher();
  await remesher.load(readFileSync(path));
  const stop = new AbortController();
  let begun;
  const run = remesher.remesh({ faces: 20000 }, { signal: stop.signal, progress: () => { begun ??= performance.now(); stop.abort(); } });
  await assert.rejects(run, { name: 'AbortError' });
  assert.ok(performance.now() - begun < 5000);
  const { quads } = await remesher.remesh({ faces: 500 });
  native(path, '-o', 'dancer.obj', '--faces', '500');
  assert.equal(quads.length / 4, parseObj(read('dancer.obj')).indices.length / 4);
  await assert.rejects(remesher.remesh({ faces: 500 }, { signal: AbortSignal.abort() }), { name: 'AbortError' });
  remesher.close();
});

test('a bundler takes the package as it is, without configuration, and the bundle runs in a browser', async () => {
  const app = join(project, 'app');
  mkdirSync(app);
  writeFileSync(join(app, 'index.html'), '<!doctype html><title>app</title><script type="module" src="./main.js"></script>');
  writeFileSync(join(app, 'main.js'), `import { init, remesh } from 'quadwright';
const main = async () => {
  await init();
  const positions = [0, 0, 0, 1, 0, 0, 1, 1, 0, 0, 1, 0, 0, 0, 1, 1, 0, 1, 1, 1, 1, 0, 1, 1];
  const triangles = [0, 2, 1, 0, 3, 2, 4, 5, 6, 4, 6, 7, 0, 1, 5, 0, 5, 4, 1, 2, 6, 1, 6, 5, 2, 3, 7, 2, 7, 6, 3, 0, 4, 3, 4, 7];
  const { quads } = await remesh(positions, triangles, { faces: 150 });
  document.title = String(quads.length / 4);
};
main();`);
  execFileSync(join(web, 'node_modules/.bin/vite'), ['build', '--base', './', '--logLevel', 'error', app], { cwd: app });
  const server = await serve(join(app, 'dist')), browser = await openBrowser();
  try {
    const page = await browser.newPage();
    await page.goto(server.url);
    await page.waitForFunction(() => document.title !== 'app', null, { timeout: 600000 });
    const expected = quadwright.remeshSync([0, 0, 0, 1, 0, 0, 1, 1, 0, 0, 1, 0, 0, 0, 1, 1, 0, 1, 1, 1, 1, 0, 1, 1], [0, 2, 1, 0, 3, 2, 4, 5, 6, 4, 6, 7, 0, 1, 5, 0, 5, 4, 1, 2, 6, 1, 6, 5, 2, 3, 7, 2, 7, 6, 3, 0, 4, 3, 4, 7], { faces: 150 });
    assert.equal(await page.title(), String(expected.quads.length / 4));
  } finally {
    await browser.close();
    await server.close();
  }
});

test('the README\'s lines go through vite build with its defaults', () => {
  const app = freshProject('vite-readme');
  writeFileSync(join(app, 'main.js'), readFileSync(join(app, 'node_modules/quadwright/README.md'), 'utf8').match(/```js\n([^]*?)```/)[1]);
  execFileSync(join(web, 'node_modules/.bin/vite'), ['build', '--base', './', '--logLevel', 'error', app], { cwd: app });
  assert.ok(readdirSync(join(app, 'dist/assets')).some((name) => name.endsWith('.wasm')));
});

test('hooks lie with the options or beside them, functions elsewhere are named, arrays may be nested, and Node loads a path', async () => {
  const corners = [[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1]], faces = [[0, 2, 1], [0, 1, 3], [1, 2, 3], [2, 0, 3]], stages = [[], []];
  const file = join(folder, 'tetrahedron.obj');
  writeFileSync(file, corners.map((at) => `v ${at.join(' ')}\n`).join('') + faces.map((face) => `f ${face.map((v) => v + 1).join(' ')}\n`).join(''));
  const remesher = new quadwright.Remesher();
  try {
    await remesher.set(corners, faces);
    const one = await remesher.remesh({ faces: 60, progress: (stage) => void stages[0].push(stage) });
    await remesher.load(file);
    const other = await remesher.remesh({ faces: 60 }, { progress: (stage) => void stages[1].push(stage) });
    assert.deepEqual(one.quads, other.quads);
    const idle = (await remesher.remesh({ faces: 60, texture: 512, wrap_quads: 2 })).report.warnings;
    assert.deepEqual(idle, ['option wrap_quads has no effect without wrap', 'option texture has no effect without unwrap or bake']);
    assert.ok(stages[0].length > 0 && stages[1].length > 0);
    await assert.rejects(remesher.remesh({ faces: 60, onProgress: () => {} }), /onProgress: there is no hook of that name/);
    assert.equal((await remesher.save('stl')).length, 84 + 50 * 2 * (other.quads.length / 4));
  } finally {
    remesher.close();
  }
  assert.throws(() => quadwright.remeshSync(corners, faces, { faces: () => 60 }), /faces: must be a number, not a function/);
  assert.throws(() => quadwright.remeshSync(corners, faces, { faces: 60 }, { log() {} }), /no fourth argument: signal, progress and log are among the options/);
  await assert.rejects(quadwright.remesh(corners, faces, { faces: 60 }, { progress() {} }), /no fourth argument/);
  await assert.rejects(quadwright.asset(corners, faces, { faces: 60 }, { progress() {} }), /no fourth argument/);
});

const CUBE_APP = `import { init, remesh } from 'quadwright';
const main = async () => {
  await init();
  const positions = [0, 0, 0, 1, 0, 0, 1, 1, 0, 0, 1, 0, 0, 0, 1, 1, 0, 1, 1, 1, 1, 0, 1, 1];
  const triangles = [0, 2, 1, 0, 3, 2, 4, 5, 6, 4, 6, 7, 0, 1, 5, 0, 5, 4, 1, 2, 6, 1, 6, 5, 2, 3, 7, 2, 7, 6, 3, 0, 4, 3, 4, 7];
  const { quads } = await remesh(positions, triangles, { faces: 150 });
  document.title = String(quads.length / 4);
};
main().catch((error) => { document.title = error.message; });`;

/* A project of its own, as a user begins one: a folder with the package installed. */
function freshProject(name) {
  const app = join(folder, name);
  mkdirSync(join(app, 'node_modules'), { recursive: true });
  cpSync(join(project, 'node_modules/quadwright'), join(app, 'node_modules/quadwright'), { recursive: true });
  writeFileSync(join(app, 'package.json'), '{"private": true, "type": "module", "dependencies": {"quadwright": "*"}}');
  writeFileSync(join(app, 'index.html'), '<!doctype html><title>app</title><script type="module" src="./main.js"></script>');
  writeFileSync(join(app, 'main.js'), CUBE_APP);
  return app;
}

async function titleOf(url) {
  const browser = await openBrowser();
  try {
    const page = await browser.newPage();
    await page.goto(url);
    await page.waitForFunction(() => document.title !== 'app', null, { timeout: 600000 }); // ends hangs only
    return await page.title();
  } finally {
    await browser.close();
  }
}

test('Vite\'s dev server with its defaults finds the Worker and the module', async () => {
  const app = freshProject('vite-dev'), { createServer } = await import(join(web, 'node_modules/vite/dist/node/index.js'));
  const server = await createServer({ root: app, configFile: false, logLevel: 'error', server: { port: 0, host: '127.0.0.1' } });
  try {
    await server.listen();
    assert.equal(await titleOf(server.resolvedUrls.local[0]), '150');
    assert.ok(readdirSync(join(app, 'node_modules/.vite/deps')).includes('quadwright.js')); // it was put together, as its defaults have it
  } finally {
    await server.close();
  }
});

test('esbuild\'s bundle, made as the README says, finds them too, and what is missing is said', async () => {
  const app = freshProject('esbuild'), lines = readFileSync(join(app, 'node_modules/quadwright/README.md'), 'utf8').match(/```sh\n([^]*?)```/)[1].trim().split('\n');
  const shell = (line) => execFileSync('sh', ['-c', line], { cwd: app, env: { ...process.env, PATH: `${join(web, 'node_modules/.bin')}:${process.env.PATH}` }, stdio: 'pipe' });
  lines.forEach(shell);
  shell('cp index.html dist/');
  const server = await serve(join(app, 'dist'));
  try {
    assert.equal(await titleOf(server.url), '150');
    shell('rm dist/*.wasm');
    assert.match(await titleOf(server.url), /quadwright.*\.wasm: 404/);
  } finally {
    await server.close();
  }
});

test('what a hook throws is the failure of the run, and nothing else ends', async () => {
  const told = node(`import { init, remesh, remeshSync, Remesher } from 'quadwright';
    await init();
    const own = new Error('mine'), told = [], tell = (name) => (error) => told.push([name, error === own ? 'own' : String(error)]);
    const positions = [0, 0, 0, 1, 0, 0, 1, 1, 0, 0, 1, 0], triangles = [0, 1, 2, 0, 2, 3], throws = () => { throw own; };
    const done = (name) => ({ quads }) => told.push([name, quads.length > 0 ? 'quads' : 'none']);
    await remesh(positions, triangles, { faces: 50, progress: throws }).then(done('progress'), tell('progress'));
    await remesh(positions, triangles, { faces: 50, progress: async () => { throw own; } }).then(done('promise'), tell('promise'));
    const remesher = new Remesher();
    await remesher.set(positions, triangles);
    await remesher.remesh({ faces: 50 }, { progress: throws }).then(done('first'), tell('first'));
    await remesher.remesh({ faces: 50 }, { progress: () => {} }).then(done('second'), tell('second'));
    remesher.close();
    try { remeshSync(positions, triangles, { faces: 50, progress: throws }); } catch (error) { tell('sync')(error); }
    done('sync again')(remeshSync(positions, triangles, { faces: 50 }));
    console.log(JSON.stringify(told));`);
  assert.deepEqual(JSON.parse(told), [['progress', 'own'], ['promise', 'own'], ['first', 'own'], ['second', 'quads'], ['sync', 'own'], ['sync again', 'quads']]);
});

test('words that mean the same at every host: CANCEL, preset, keep, a plane of symmetry, "1G"', async () => {
  const told = node(`import { CANCEL, init, remesh, remeshSync, Remesher, tables } from 'quadwright';
    await init();
    const positions = [0, 0, 0, 1, 0, 0, 1, 1, 0, 0, 1, 0], triangles = [0, 1, 2, 0, 2, 3], told = [], tell = (error) => told.push(error.status);
    const notices = [];
    console.warn = (text) => notices.push(text);
    await remesh(positions, triangles, { faces: 50, progress: () => CANCEL }).then(() => told.push('went on'), tell);
    await remesh(positions, triangles, { faces: 50, progress: async () => CANCEL }).then(() => told.push('went on'), tell);
    for (const answer of [CANCEL, true, undefined, false, 1])
      try { remeshSync(positions, triangles, { faces: 50, progress: () => answer }); told.push('went on'); } catch (error) { tell(error); }
    told.push(notices.length);
    const same = (a, b) => told.push(String(a.positions) === String(b.positions));
    same(remeshSync(positions, triangles, { faces: 50, preset: 'cad', loops: 0.5 }),
      remeshSync(positions, triangles, { faces: 50, sharp_angle: 30, adaptive: 0, evenness: 0.25, around: 12 }));
    same(remeshSync(positions, triangles, { faces: 50, symmetry: [1, 0, 0, 0.5], memoryLimit: '1G' }),
      remeshSync(positions, triangles, { faces: 50, symmetry: 'plane', symmetry_x: 1, symmetry_offset: 0.5 }));
    told.push(tables().presets.length >= 5);
    const remesher = new Remesher(), edges = async (options) => (await remesher.remesh({ faces: 50, ...options })).report.feature_edges;
    await remesher.load(new TextEncoder().encode('v 0 0 0\\nv 1 0 0\\nv 1 1 0\\nv 0 1 0\\ng a\\nf 1 2 3\\ng b\\nf 1 3 4\\n'));
    told.push((await edges({})) < (await edges({ keep: 'groups' })), (await edges({})) < (await edges({ keep: ['groups'] })));
    remesher.close();
    for (const wrong of [{ preset: 'cat' }, { memoryLimit: '4 cows' }, { keep: 'part' }]) try { remeshSync(positions, triangles, wrong); } catch (error) { tell(error); }
    console.log(JSON.stringify(told));`);
  assert.deepEqual(JSON.parse(told), ['CANCELLED', 'CANCELLED', 'CANCELLED', 'CANCELLED', 'went on', 'went on', 'went on', 1, true, true, true, true, true, 'OPTION', 'ARGUMENT', 'ARGUMENT']);
});

test('after warmUp, and from a script without a file, a run gives the same', async () => {
  const { positions, indices } = parseObj(readFileSync(shape('knot', 1000))), { quads } = await quadwright.remesh(positions, indices, { faces: 300 });
  const script = `import { init, remesh, warmUp } from 'quadwright'; await init(); await warmUp();
    const { positions, indices } = JSON.parse(process.argv[1]); console.log((await remesh(positions, indices, { faces: 300 })).quads.length);`;
  const told = execFileSync(process.execPath, ['--input-type=module', '-e', script, JSON.stringify({ positions, indices })], { cwd: project, encoding: 'utf8' });
  assert.equal(Number(told), quads.length);
});

test('arrays can be moved instead of copied', async () => {
  const { positions, indices } = parseObj(readFileSync(shape('knot', 1000)));
  const moved = [Float64Array.from(positions), Uint32Array.from(indices)], kept = [Float64Array.from(positions), Uint32Array.from(indices)];
  const a = await quadwright.remesh(...moved, { faces: 300, transfer: true }), b = await quadwright.remesh(...kept, { faces: 300 });
  assert.equal(moved[0].length, 0);
  assert.equal(kept[0].length, positions.length);
  assert.deepEqual(a.positions, b.positions);
});

test('failures are the library\'s sentences', async () => {
  const { remesh, QuadwrightError } = quadwright, triangle = [0, 0, 0, 1, 0, 0, 0, 1, 0];
  const cases = [
    [[triangle, [0, 1, 5]], 'INDEX_RANGE'], [[triangle, []], 'NO_FACES'], [[triangle, [0, 0, 0]], 'ONLY_DEGENERATE'], [[[NaN, 0, 0, 1, 0, 0, 0, 1, 0], [0, 1, 2]], 'NOT_FINITE'],
    [[triangle, [0, 1, 2], { follow: 7 }], 'OPTION'], [[triangle, [0, 1, 2], { colour: 1 }], 'ARGUMENT'], [[triangle, [0, 1, 2], { follow: 'x' }], 'ARGUMENT'],
    [[triangle, [0, 1]], 'ARGUMENT'], [[[0, 1], [0, 1, 2]], 'ARGUMENT'], [[triangle, [0, 1, -1]], 'ARGUMENT'], [[null, null], 'ARGUMENT'],
  ];
  for (const [args, status] of cases) {
    await assert.rejects(remesh(...args), (error) => error instanceof QuadwrightError && error.status === status && error.message.length > 8, status);
  }
  const remesher = new quadwright.Remesher();
  await assert.rejects(remesher.load(new Uint8Array()), { status: 'FILE_EMPTY' });
  await assert.rejects(remesher.load(Buffer.from('v 0 0\nf 1 2')), QuadwrightError);
  await assert.rejects(remesher.remesh(), { status: 'NOT_READY' });
  remesher.close();
  const small = parseObj(readFileSync(shape('knot', 1000)));
  await assert.rejects(remesh(small.positions, small.indices, { faces: 5000, memoryLimit: 2 ** 20 }), { status: 'MEMORY' });
});

test('attributes are carried over', async () => {
  const { positions, indices } = parseObj(readFileSync(shape('knot', 1000)));
  const color = { values: Float32Array.from(positions, (x) => Math.min(1, Math.abs(x))), components: 3 };
  const side = { values: Int32Array.from({ length: indices.length / 3 }, (_, f) => (positions[3 * indices[3 * f]] > 0 ? 1 : 0)), domain: 'face', kind: 'labels' };
  const { attributes, positions: out, quads } = await quadwright.remesh(positions, indices, { faces: 400, attributes: { color, side } });
  assert.equal(attributes.color.values.length, out.length);
  const off = attributes.color.values.reduce((sum, c, i) => sum + Math.abs(c - Math.min(1, Math.abs(out[i]))), 0) / out.length;
  assert.ok(off < 0.02, `${off}`);
  assert.equal(attributes.side.values.length, quads.length / 4);
  assert.deepEqual([...new Set(attributes.side.values)].sort(), [0, 1]);
});

test('weights steer by themselves, and no more once they are told not to', async () => {
  const around = 64, rows = 48, positions = [0, 0, 3, 0, 0, -3], indices = []; // an egg, with weights at a slant
  for (let i = 0; i < rows; i++)
    for (let k = 0; k < around; k++) {
      const a = (2 * Math.PI * k) / around, b = (Math.PI * (i + 1)) / (rows + 1), of = (j, l) => 2 + j * around + ((k + l) % around);
      positions.push(Math.sin(b) * Math.cos(a), Math.sin(b) * Math.sin(a), 3 * Math.cos(b));
      if (i === 0) indices.push(0, of(0, 0), of(0, 1));
      else indices.push(of(i - 1, 0), of(i, 0), of(i, 1), of(i - 1, 0), of(i, 1), of(i - 1, 1));
      if (i === rows - 1) indices.push(1, of(i, 1), of(i, 0));
    }
  const count = positions.length / 3, values = new Float32Array(2 * count), groups = Uint32Array.from({ length: 2 * count }, (_, i) => i % 2);
  for (let v = 0; v < count; v++) {
    values[2 * v] = Math.min(1, Math.max(0, 0.5 + (0.88 * positions[3 * v + 2] + 0.48 * positions[3 * v + 1]) / 2));
    values[2 * v + 1] = 1 - values[2 * v];
  }
  const attributes = { skin: { values, components: 2, kind: 'weights', groups } };
  const steered = await quadwright.remesh(positions, indices, { faces: 800, attributes });
  const left = await quadwright.remesh(positions, indices, { faces: 800, follow_motion: 0, attributes });
  const plain = await quadwright.remesh(positions, indices, { faces: 800 });
  assert.deepEqual([steered, left, plain].map((result) => result.report.nests), [1, 0, 0]);
  assert.deepEqual(left.quads, plain.quads);
  assert.equal(steered.attributes.skin.groups.length, steered.attributes.skin.values.length);
});

test('faces in closed holes are marked', async () => {
  const positions = [], indices = [], n = 16; // a bowl
  for (let j = 0; j <= n; j++)
    for (let i = 0; i <= n; i++) positions.push(i / n - 0.5, j / n - 0.5, (i / n - 0.5) ** 2);
  for (let j = 0; j < n; j++)
    for (let i = 0; i < n; i++) {
      const a = j * (n + 1) + i, b = a + n + 1;
      if (Math.abs(i - 8) > 1 || Math.abs(j - 8) > 1) indices.push(a, a + 1, b + 1, a, b + 1, b);
    }
  const { attributes, quads } = await quadwright.remesh(positions, indices, { faces: 200, fill_holes: 20 });
  assert.equal(attributes.filled.values.length, quads.length / 4);
  const share = attributes.filled.values.filter((x) => x === 1).length / (quads.length / 4);
  assert.ok(share > 0.005 && share < 0.1, `${share}`);
});

test('points without faces become a surface with wrap, and a value says which gaps it closes', async () => {
  const points = [], count = 3000;
  for (let i = 0; i < count; i++) {
    const z = 1 - (2 * i + 1) / count, r = Math.sqrt(1 - z * z), a = i * 2.399963229728653;
    points.push(r * Math.cos(a), r * Math.sin(a), z);
  }
  const remesher = new quadwright.Remesher();
  try {
    await remesher.setPoints(points);
    await assert.rejects(remesher.remesh({ faces: 200 }), { status: 'NO_FACES' });
    const result = await remesher.remesh({ faces: 200, wrap: 0.1 });
    assert.equal(result.report.euler, 2);
    const text = Array.from({ length: count }, (_, i) => points.slice(3 * i, 3 * i + 3).join(' ')).join('\n');
    assert.equal((await remesher.load(new TextEncoder().encode(text))).points, true);
    assert.equal((await remesher.remesh({ faces: 200, wrap: '2q' })).report.euler, 2);
    await assert.rejects(remesher.remesh({ wrap: 'much' }), { status: 'OPTION' });
  } finally {
    remesher.close?.();
  }
});

test('a BufferGeometry goes in and comes out', async () => {
  const three = await import(join(project, 'node_modules/three/build/three.module.js'));
  const { fromGeometry, toGeometry } = await import(join(project, 'node_modules/quadwright/three.js'));
  const box = new three.BoxGeometry(1, 2, 3, 4, 4, 4);
  const result = await quadwright.remesh(...fromGeometry(box, { faces: 600 }));
  const { geometry, edges } = toGeometry(result);
  geometry.computeBoundingBox();
  assert.ok(geometry.boundingBox.max.distanceTo(new three.Vector3(0.5, 1, 1.5)) < 0.02);
  assert.equal(geometry.index.count, (result.quads.length / 4) * 6);
  assert.equal(edges.index.count, 2 * result.report.topology.edges);
  assert.ok(geometry.attributes.uv && geometry.attributes.normal);
  assert.equal(geometry.groups.length, 6); // a material a side
  const again = await quadwright.remesh(...fromGeometry(geometry, { faces: 300 }));
  assert.ok(again.quads.length > 0);
});

test('assets: texture coordinates, maps and files are those of the native tool', async () => {
  const { asset, Remesher, init } = quadwright;
  const { assetOptions } = await init();
  assert.ok(assetOptions.some(({ name }) => name === 'texture'));
  const source = shape('knot', 1000);
  native('asset', source, '-o', 'asset.glb', '--faces', '200', '--texture', '128', '--json', 'asset.json');
  const remesher = new Remesher();
  const mesh = await remesher.load(readFileSync(source));
  const result = await remesher.remesh({ faces: 200, bake: 'input', texture: 128 });
  assert.deepEqual(Buffer.from(await remesher.save('glb')), read('asset.glb'));
  assert.deepEqual(result.asset, JSON.parse(read('asset.json')).asset);
  assert.deepEqual(Object.keys(result.maps), ['normal']);
  assert.equal(result.maps.normal.pixels.length, 3 * 128 * 128);
  assert.equal(result.attributes.uv.values.length, 2 * result.quads.length);
  const unwrapped = await remesher.remesh({ faces: 200, unwrap: true });
  assert.ok(unwrapped.asset.charts > 1 && !Object.keys(unwrapped.maps).length);
  const stages = [];
  await assert.rejects(remesher.remesh({ faces: 200, bake: 'colour' }, { progress: (stage) => void stages.push(stage) }), { status: 'ARGUMENT', message: /bake must be input, all/ });
  assert.deepEqual(stages, [], 'a map that does not exist is refused before the run');
  await assert.rejects(remesher.remesh({ faces: 200, bake: 'input', texture: 7 }), { status: 'OPTION', message: /texture/ });
  const plain = await remesher.remesh({ faces: 200 });
  assert.ok(!plain.asset && !plain.maps);
  remesher.close();
  const colours = Float32Array.from({ length: mesh.positions.length }, (_, i) => [1, 0.6, 0.2][i % 3]);
  const dressed = await asset(mesh.positions, mesh.indices, { faces: 200, texture: 64, attributes: { color: { values: colours, components: 3 } } });
  assert.deepEqual(Object.keys(dressed.maps), ['color', 'normal']);
  assert.deepEqual([...dressed.maps.color.pixels.subarray(0, 3)], [255, 153, 51]);
});
