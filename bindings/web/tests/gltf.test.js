/* GLB to GLB with the native program, opened by three.js: the texture in place, the rig and the morph targets alive, quads as they were.
 * PICTURES=FOLDER keeps the pictures of docs/attributes.md that the browser drew. */
import assert from 'node:assert/strict';
import { readFileSync, symlinkSync, writeFileSync } from 'node:fs';
import { join } from 'node:path';
import { after, before, test } from 'node:test';
import { folder, measure, native, openBrowser, paint, root, shape, web } from './tools.js';
import { serve } from './serve.js';

const PAGE = `<!doctype html><link rel="icon" href="data:,"><style>body{margin:0}canvas{display:block}</style>
<script type="importmap">{"imports":{"three":"/node_modules/three/build/three.module.js","three/addons/":"/node_modules/three/examples/jsm/"}}</script>
<script type="module">
import * as THREE from 'three';
import { GLTFLoader } from 'three/addons/loaders/GLTFLoader.js';
const W = 500, H = 800;
const renderer = new THREE.WebGLRenderer({ antialias: true, preserveDrawingBuffer: true });
renderer.setPixelRatio(1);
renderer.autoClear = false;
document.body.append(renderer.domElement);
const load = (url) => new GLTFLoader().loadAsync(url);

/* The edges of the quads: those of the triangles but the diagonals, which both triangles of a pair have in the same order. */
function edges(mesh) {
  const index = mesh.geometry.index.array, out = [];
  for (let i = 0; i < index.length; i += 6) for (const [a, b] of [[0, 1], [1, 2], [4, 5], [5, 3]]) out.push(index[i + a], index[i + b]);
  const geometry = mesh.geometry.clone();
  geometry.setIndex(out);
  const lines = new THREE.LineSegments(geometry, new THREE.LineBasicMaterial({ color: 0, transparent: true, opacity: 0.5 }));
  lines.applyMatrix4(mesh.matrixWorld);
  return lines;
}

/* Draws models side by side from azimuth, degrees; gives the pixels of each. One camera for all, which frames the first: a box that is a
 * hair larger would move and shrink all of the next. */
window.draw = async (urls, azimuth, wire, options = {}) => {
  renderer.setSize(W * urls.length, H);
  renderer.setScissorTest(true);
  const all = [], box = new THREE.Box3();
  let i = 0;
  for (const url of urls) {
    const gltf = await load(url), scene = new THREE.Scene();
    scene.background = new THREE.Color(0xffffff);
    scene.add(gltf.scene, new THREE.AmbientLight(0xffffff, options.lamp ? 0.6 : 3.0));
    if (options.lamp) {
      const lamp = new THREE.DirectionalLight(0xffffff, 3.0);
      lamp.position.set(1, 2, 3);
      scene.add(lamp);
    }
    scene.updateMatrixWorld(true);
    if (options.time) {
      const mixer = new THREE.AnimationMixer(gltf.scene);
      mixer.clipAction(gltf.animations[0]).play();
      mixer.setTime(options.time);
    }
    const meshes = [];
    gltf.scene.traverse((o) => o.isMesh && meshes.push(o));
    for (const m of meshes) {
      if (options.swell) m.morphTargetInfluences[0] = options.swell;
      m.frustumCulled = false;
      m.geometry.computeBoundingBox();
      if (i === 0) box.union(m.geometry.boundingBox);
    }
    const height = box.max.y - box.min.y;
    if (i > 0 && options.wrong === 'place') gltf.scene.position.x += 0.005 * height;
    if (i > 0 && options.wrong === 'size') gltf.scene.scale.multiplyScalar(1.01);
    if (i > 0 && options.wrong === 'texture') for (const m of meshes) m.material.map.offset.x = 0.004;
    if (wire[i]) for (const m of meshes) scene.add(edges(m));
    const centre = box.getCenter(new THREE.Vector3()), size = box.getSize(new THREE.Vector3()), a = (azimuth * Math.PI) / 180;
    const half = Math.max(size.y, ((Math.abs(Math.cos(a)) * size.x + Math.abs(Math.sin(a)) * size.z) * H) / W) * 0.53;
    const camera = new THREE.OrthographicCamera((-half * W) / H, (half * W) / H, half, -half, 0, 100);
    camera.position.set(centre.x + 20 * Math.sin(a), centre.y + 4, centre.z + 20 * Math.cos(a));
    camera.lookAt(centre);
    renderer.setViewport(W * i, 0, W, H);
    renderer.setScissor(W * i, 0, W, H);
    renderer.clear();
    renderer.render(scene, camera);
    const pixels = new Uint8Array(4 * W * H), gl = renderer.getContext();
    gl.readPixels(W * i, 0, W, H, gl.RGBA, gl.UNSIGNED_BYTE, pixels);
    all.push(pixels);
    i++;
  }
  window.pixels = all;
  return all.length;
};

/* Mean difference of colour, 0 to 255, where both show something; and the share of pixels that only one shows. */
window.compare = () => {
  const [a, b] = window.pixels;
  let sum = 0, both = 0, one = 0;
  const shows = (p, i) => p[i] + p[i + 1] + p[i + 2] < 765;
  for (let i = 0; i < a.length; i += 4) {
    if (shows(a, i) !== shows(b, i)) one++;
    if (!shows(a, i) || !shows(b, i)) continue;
    both++;
    for (let k = 0; k < 3; k++) sum += Math.abs(a[i + k] - b[i + k]) / 3;
  }
  return { mean: sum / both, one: one / both, both };
};

window.describe = async (url) => {
  const gltf = await load(url), meshes = [];
  gltf.scene.traverse((o) => o.isMesh && meshes.push(o));
  const m = meshes[0], g = m.geometry;
  return { meshes: meshes.length, skinned: !!m.isSkinnedMesh, bones: m.skeleton?.bones.map((b) => b.name), targets: Object.keys(m.morphTargetDictionary ?? {}),
    animations: gltf.animations.map((c) => c.name), texture: [m.material.map?.image.width, m.material.map?.image.height], material: m.material.name,
    triangles: (g.index ?? g.attributes.position).count / 3, attributes: Object.keys(g.attributes).sort() };
};
window.ready = true;
</script>`;

let browser, server, page;
const errors = [];

before(async () => {
  paint(shape('dancer', 20000), 'painted.glb');
  for (const normals of ['smooth', 'split']) native(shape('bracket', 6000), '-o', `${normals}.glb`, '--faces', '1500', '--normals', normals);
  native(join(root, 'tests/data/io/scene.glb'), '-o', 'scene.glb', '--faces', '60'); // colours, two objects, one of them with a skin
  native('painted.glb', '-o', 'quads.glb', '--faces', '4000');
  writeFileSync(join(folder, 'index.html'), PAGE);
  symlinkSync(join(web, 'node_modules'), join(folder, 'node_modules'));
  server = await serve(folder);
  browser = await openBrowser();
  page = await browser.newPage({ viewport: { width: 1000, height: 800 } });
  page.on('console', (message) => message.type() === 'error' && errors.push(message.text()));
  page.on('pageerror', (error) => errors.push(String(error)));
  await page.goto(server.url);
  await page.waitForFunction('window.ready', undefined, { timeout: 600000 });
});

after(async () => {
  await browser?.close();
  await server?.close();
});

test('three.js finds material, texture, rig, animation and morph target', async () => {
  const [before, after] = [await page.evaluate('describe("/painted.glb")'), await page.evaluate('describe("/quads.glb")')];
  const quads = measure('quads.glb');
  assert.equal(quads.quads, quads.faces); // FB_ngon_encoding
  assert.equal(after.triangles, 2 * quads.quads);
  assert.deepEqual({ ...after, triangles: 0 }, { ...before, triangles: 0 });
  assert.deepEqual(after.texture, [1024, 1024]);
  assert.deepEqual(after.targets, ['Swell']);
  assert.equal(after.bones.length, 5);
});

test('the Khronos validator finds no error', async () => {
  const { default: validator } = await import('gltf-validator');
  for (const name of ['painted.glb', 'quads.glb', 'smooth.glb', 'split.glb', 'scene.glb']) {
    const { issues } = await validator.validateBytes(new Uint8Array(readFileSync(join(folder, name))));
    assert.deepEqual(issues.messages.filter(({ severity }) => severity === 0), [], name);
  }
});

const MOST_COLOUR = 4, MOST_OUTLINE = 0.03; // of 255, and of the pixels that both show

async function differences(azimuth, options) {
  await page.evaluate(`draw(["/painted.glb","/quads.glb"], ${azimuth}, [false,false], ${options})`);
  const { mean, one, both } = await page.evaluate('compare()');
  return { mean, one, both, words: `${options} from ${azimuth}: colours differ by ${mean} of 255, outlines by ${one}, of ${both} pixels` };
}

test('the texture is in place, at rest, swollen and bent', async () => {
  for (const options of ['{}', '{swell:2}', '{time:1}'])
    for (const azimuth of [0, 120, 240]) {
      const { mean, one, both, words } = await differences(azimuth, options);
      assert.ok(both > 40000 && mean < MOST_COLOUR && one < MOST_OUTLINE, words);
    }
});

test('what is out of place is seen: four texels of a thousand, half a percent of the height, one percent of the size', async () => {
  for (const [wrong, sees] of [['texture', ({ mean }) => mean > MOST_COLOUR], ['place', ({ one }) => one > MOST_OUTLINE], ['size', ({ one }) => one > MOST_OUTLINE]])
    for (const azimuth of [0, 120, 240]) {
      const found = await differences(azimuth, `{wrong:"${wrong}"}`);
      assert.ok(sees(found), found.words);
    }
});

test('smooth and split normals are shaded', async () => {
  await page.evaluate('draw(["/smooth.glb","/split.glb"], 30, [false,false], {lamp:true})');
  const { mean } = await page.evaluate('compare()');
  assert.ok(mean > 5, `the shades differ by ${mean} of 255`);
  if (process.env.PICTURES) await page.locator('canvas').screenshot({ path: join(process.env.PICTURES, 'normals.png') });
});

test('nothing was complained of', async () => {
  await page.evaluate('draw(["/painted.glb","/quads.glb"], 20, [false,true])');
  if (process.env.PICTURES) await page.locator('canvas').screenshot({ path: join(process.env.PICTURES, 'gltf-three.png') });
  assert.deepEqual(errors, []);
});
