/* An asset beside its input by three.js, in headless Chromium: mean difference of the pictures, of 255, and of the normals as they are shaded, in degrees, silhouettes aside; and a picture of input, quads, and quads
 * with maps.
 * usage: node asset.js FOLDER NAME..., after `bench/asset_render.py` or with NAME-input.obj or .glb, NAME-quads.obj and NAME.glb there; writes FOLDER/NAME-three.png */
import { existsSync, readFileSync, writeFileSync } from 'node:fs';
import { join } from 'node:path';
import { openBrowser, web } from './tools.js';
import { serve } from './serve.js';

const PAGE = `<!doctype html><script type="importmap">{ "imports": { "three": "./node_modules/three/build/three.module.js", "three/addons/": "./node_modules/three/examples/jsm/" } }</script>
<script type="module">
import * as three from 'three';
import { GLTFLoader } from 'three/addons/loaders/GLTFLoader.js';
import { OBJLoader } from 'three/addons/loaders/OBJLoader.js';
Object.assign(window, { three, GLTFLoader, OBJLoader, ready: true });
</script>`;

/* Runs in the page. models: {input, quads, asset}, each {name, data: base64}. */
async function compare(models) {
  const { three, GLTFLoader, OBJLoader } = window, SIZE = 512, SHOWN = 320, REACH = 2, JUMP = 0.04;
  const bytesOf = (data) => Uint8Array.from(atob(data), (c) => c.charCodeAt(0));

  /* Without normals: of the faces at each place, by their angles, as Blender has them. */
  function smooth(geometry) {
    const { position } = geometry.attributes, sums = new Map(), p = (i) => new three.Vector3().fromBufferAttribute(position, i);
    const key = (i) => [position.getX(i), position.getY(i), position.getZ(i)].join();
    for (let f = 0; f < position.count; f += 3)
      for (let k = 0; k < 3; k++) {
        const a = p(f + ((k + 1) % 3)).sub(p(f + k)), b = p(f + ((k + 2) % 3)).sub(p(f + k)), n = a.clone().cross(b).normalize();
        if (!sums.has(key(f + k))) sums.set(key(f + k), new three.Vector3());
        sums.get(key(f + k)).addScaledVector(n, a.angleTo(b) || 0);
      }
    const normal = new Float32Array(3 * position.count);
    for (let i = 0; i < position.count; i++) sums.get(key(i)).clone().normalize().toArray(normal, 3 * i);
    geometry.setAttribute('normal', new three.BufferAttribute(normal, 3));
  }

  async function load({ name, data }) {
    const bytes = bytesOf(data), meshes = [];
    const text = name.endsWith('.obj') && new TextDecoder().decode(bytes);
    const root = text ? new OBJLoader().parse(text) : (await new GLTFLoader().parseAsync(bytes.buffer, '')).scene;
    root.updateMatrixWorld(true);
    root.traverse((o) => o.isMesh && meshes.push(o));
    if (text && !/^vn /m.test(text)) for (const m of meshes) smooth(m.geometry);
    return { root, meshes };
  }

  const renderer = new three.WebGLRenderer({ antialias: false, alpha: true, preserveDrawingBuffer: true });
  renderer.setSize(SIZE, SIZE);
  const loaded = {}, box = new three.Box3();
  for (const [what, model] of Object.entries(models)) loaded[what] = await load(model);
  box.setFromObject(loaded.input.root);
  const middle = box.getCenter(new three.Vector3()), radius = box.getSize(new three.Vector3()).length() / 2;
  const away = new three.Vector3(0.5, 0.35, 1).normalize(), camera = new three.PerspectiveCamera(39.6, 1, 0.1 * radius, 10 * radius);
  camera.position.copy(middle).addScaledVector(away, 2.6 * radius), camera.lookAt(middle);
  const first = (material) => (Array.isArray(material) ? material[0] : material), white = new three.Color(0xffffff);
  const isColoured = loaded.input.meshes.some((m) => first(m.material).map || m.geometry.attributes.color || !first(m.material).color.equals(white));
  const depth = new three.ShaderMaterial({
    vertexShader: 'varying float z; void main() { vec4 p = modelViewMatrix * vec4(position, 1.0); z = -p.z; gl_Position = projectionMatrix * p; }',
    fragmentShader: 'varying float z; uniform float from, span; void main() { float d = clamp((z - from) / span, 0.0, 1.0) * 255.0; gl_FragColor = vec4(floor(d) / 255.0, fract(d), 0.0, 1.0); }',
    uniforms: { from: { value: 1.6 * radius }, span: { value: 2 * radius } }, side: three.DoubleSide,
  });

  function shoot(what, kind) {
    const scene = new three.Scene(), sun = new three.DirectionalLight(0xffffff, 2.2);
    sun.position.copy(away).add(new three.Vector3(0.3, 0.6, 0));
    scene.add(loaded[what].root, sun, new three.AmbientLight(0xffffff, 0.9));
    for (const mesh of loaded[what].meshes) {
      const own = (mesh.userData.own ??= first(mesh.material)), normalMap = own.normalMap ?? null, { normalScale } = own;
      const plain = new three.MeshStandardMaterial({ color: isColoured && what !== 'quads' ? own.color : 0xcccccc, map: own.map ?? null, roughness: 1, metalness: 0, side: three.DoubleSide, vertexColors: Boolean(mesh.geometry.attributes.color), normalMap });
      const shaded = new three.MeshNormalMaterial({ side: three.DoubleSide, normalMap });
      if (normalMap) plain.normalScale.copy(normalScale), shaded.normalScale.copy(normalScale);
      mesh.material = { lit: plain, normal: shaded, depth }[kind];
    }
    renderer.outputColorSpace = kind === 'lit' ? three.SRGBColorSpace : three.LinearSRGBColorSpace;
    renderer.render(scene, camera);
    const canvas = new OffscreenCanvas(SIZE, SIZE), context = canvas.getContext('2d', { willReadFrequently: true });
    context.drawImage(renderer.domElement, 0, 0);
    return context.getImageData(0, 0, SIZE, SIZE);
  }

  /* Whether a pixel shows the surface and is not within two of where its depth jumps. */
  function inside(what) {
    const { data } = shoot(what, 'depth'), far = new Float32Array(SIZE * SIZE), good = new Uint8Array(SIZE * SIZE);
    for (let i = 0; i < far.length; i++) far[i] = data[4 * i + 3] ? (data[4 * i] + data[4 * i + 1] / 255) / 255 : 9;
    for (let y = REACH; y < SIZE - REACH; y++)
      for (let x = REACH; x < SIZE - REACH; x++) {
        let least = 9, most = 0;
        for (let dy = -REACH; dy <= REACH; dy++)
          for (let dx = -REACH; dx <= REACH; dx++) (least = Math.min(least, far[(y + dy) * SIZE + x + dx])), (most = Math.max(most, far[(y + dy) * SIZE + x + dx]));
        good[y * SIZE + x] = most < 9 && most - least < JUMP;
      }
    return good;
  }

  const pictures = { input: shoot('input', 'lit'), quads: shoot('quads', 'lit'), asset: shoot('asset', 'lit') };
  const normals = { input: shoot('input', 'normal').data, quads: shoot('quads', 'normal').data, asset: shoot('asset', 'normal').data };
  const mask = { input: inside('input'), quads: inside('quads'), asset: inside('asset') }, told = {};
  const vector = (data, i) => new three.Vector3(data[4 * i] - 127.5, data[4 * i + 1] - 127.5, data[4 * i + 2] - 127.5).normalize();
  for (const what of ['quads', 'asset']) {
    let difference = 0, degrees = 0, count = 0;
    for (let i = 0; i < SIZE * SIZE; i++) {
      if (!mask.input[i] || !mask[what][i]) continue;
      for (let k = 0; k < 3; k++) difference += Math.abs(pictures.input.data[4 * i + k] - pictures[what].data[4 * i + k]) / 3;
      degrees += (vector(normals.input, i).angleTo(vector(normals[what], i)) * 180) / Math.PI;
      count++;
    }
    told[what] = { difference: difference / count, degrees: degrees / count };
  }

  const row = document.createElement('canvas'), context = row.getContext('2d');
  (row.width = 3 * SHOWN), (row.height = SHOWN), (context.fillStyle = 'white'), context.fillRect(0, 0, row.width, SHOWN);
  for (const [i, picture] of Object.values(pictures).entries())
    context.drawImage(await createImageBitmap(picture, { resizeWidth: SHOWN, resizeHeight: SHOWN, resizeQuality: 'high' }), i * SHOWN, 0);
  return { told, png: row.toDataURL('image/png').split(',')[1] };
}

const [folder, ...names] = process.argv.slice(2), server = await serve(web), browser = await openBrowser();
console.log('| mesh | quads | asset | quads: degrees | asset: degrees |\n|---|---|---|---|---|');
for (const name of names) {
  const page = await browser.newPage(), model = (file) => ({ name: file, data: readFileSync(join(folder, file)).toString('base64') });
  page.on('console', (message) => message.type() === 'error' && console.error(message.text()));
  await page.route('**/asset.html', (route) => route.fulfill({ contentType: 'text/html', body: PAGE }));
  await page.goto(`${server.url}asset.html`);
  await page.waitForFunction(() => window.ready);
  const input = existsSync(join(folder, `${name}-input.glb`)) ? `${name}-input.glb` : `${name}-input.obj`;
  const { told, png } = await page.evaluate(compare, { input: model(input), quads: model(`${name}-quads.obj`), asset: model(`${name}.glb`) });
  writeFileSync(join(folder, `${name}-three.png`), Buffer.from(png, 'base64'));
  console.log(`| ${name} | ${told.quads.difference.toFixed(2)} | ${told.asset.difference.toFixed(2)} | ${told.quads.degrees.toFixed(2)} | ${told.asset.degrees.toFixed(2)} |`);
  await page.close();
}
await browser.close();
await server.close();
