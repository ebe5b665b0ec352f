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

export async function openBrowser() {
  const { chromium } = await import('playwright-core');
  const executablePath = process.env.CHROMIUM ?? '/usr/bin/chromium';
  return chromium.launch({ executablePath, args: ['--no-sandbox', '--use-angle=swiftshader', '--enable-unsafe-swiftshader'] });
}
