/* What the tests share: the native programs, a folder of their own, a browser. */
import { execFileSync } from 'node:child_process';
import { mkdtempSync, readFileSync } from 'node:fs';
import { tmpdir } from 'node:os';
import { dirname, join } from 'node:path';
import { fileURLToPath } from 'node:url';

export const root = fileURLToPath(new URL('../../../', import.meta.url));
export const web = join(root, 'bindings/web');
const tool = process.env.QUADWRIGHT_TOOL ?? join(root, 'build/quadwright');
const shapes = process.env.QUADWRIGHT_SHAPES ?? join(root, 'build/quadwright-shapes');

export const folder = mkdtempSync(join(tmpdir(), 'quadwright-web-'));

/* Runs the native program in the folder. */
export const native = (...switches) => execFileSync(tool, [...switches, '--threads', '1', '--quiet'], { cwd: folder });
export const measure = (...switches) => JSON.parse(execFileSync(tool, ['measure', ...switches, '--json'], { cwd: folder }));

/* A shape as a file of the folder: its path. */
export function shape(name, triangles) {
  const path = join(folder, `${name}-${triangles}.obj`);
  execFileSync(shapes, [name, String(triangles), path]);
  return path;
}

/* A textured, rigged character out of a surface. */
export const paint = (path, name) =>
  execFileSync(join(dirname(shapes), 'quadwright-painted'), [path, join(folder, name), join(folder, `${name}.png`)]);

export const read = (name) => readFileSync(join(folder, name));

/* Vertices and triangles of an OBJ file of triangles. */
export function parseObj(text) {
  const positions = [], indices = [];
  for (const line of text.toString().split('\n')) {
    const words = line.trim().split(/\s+/);
    if (words[0] === 'v') positions.push(...words.slice(1, 4).map(Number));
    if (words[0] === 'f') indices.push(...words.slice(1).map((word) => parseInt(word, 10) - 1));
  }
  return { positions, indices };
}

/* How many loops of edges that go straight on and close, on a surface seen along z, wind once around the middle of a guide, no farther from it than so
 * many of its radii. quads: an OBJ file; loop: three numbers a point. */
export function ringsAround(quads, loop, reach) {
  const lines = quads.toString().split('\n'), points = lines.filter((l) => l.startsWith('v ')).map((l) => l.split(' ').slice(1, 3).map(Number));
  const ahead = new Map(), degree = new Map(), key = (a, b) => a * points.length + b;
  for (const f of lines.filter((l) => l.startsWith('f ')).map((l) => l.split(' ').slice(1).map((w) => parseInt(w, 10) - 1))) {
    f.forEach((a, i) => {
      ahead.set(key(a, f[(i + 1) % 4]), [f[(i + 1) % 4], f[(i + 2) % 4]]);
      degree.set(a, (degree.get(a) ?? 0) + 1);
    });
  }
  const n = loop.length / 3, middle = [0, 1].map((k) => loop.filter((_, i) => i % 3 === k).reduce((a, b) => a + b) / n);
  const off = ([x, y]) => [x - middle[0], y - middle[1]], radius = Math.max(...Array.from({ length: n }, (_, i) => Math.hypot(...off(loop.slice(3 * i, 3 * i + 2)))));
  const seen = new Set();
  let rings = 0;
  for (const start of ahead.keys()) {
    let at = start, turn = 0, near = true;
    while (at !== undefined && !seen.has(at)) {
      seen.add(at);
      const b = at % points.length, a = (at - b) / points.length, [p, q] = [off(points[a]), off(points[b])];
      turn += Math.atan2(p[0] * q[1] - p[1] * q[0], p[0] * q[0] + p[1] * q[1]);
      near &&= Math.hypot(...p) < reach * radius;
      const [c, d] = ahead.get(at);
      at = degree.get(b) === 4 ? ahead.get(key(d, c)) && key(...ahead.get(key(d, c))) : undefined;
    }
    if (at === start && near && Math.abs(turn - 2 * Math.PI) < 1e-6) rings++; // each is walked both ways
  }
  return rings;
}

export async function openBrowser() {
  const { chromium } = await import('playwright-core');
  const executablePath = process.env.CHROMIUM ?? '/usr/bin/chromium';
  return chromium.launch({ executablePath, args: ['--no-sandbox', '--use-angle=swiftshader', '--enable-unsafe-swiftshader'] });
}
