/* The picture: a surface or quads on the left, quads on the right, beside one another or wiped, under one camera. Drawn when something has
 * changed, never otherwise. */
import {
  BufferAttribute, BufferGeometry, Color, DirectionalLight, DoubleSide, Group, HemisphereLight, LineBasicMaterial, LineSegments, Mesh,
  MeshLambertMaterial, PerspectiveCamera, Points, PointsMaterial, Raycaster, Scene, Vector2, Vector3, WebGLRenderer,
} from 'three';
import { OrbitControls } from 'three/addons/controls/OrbitControls.js';
import { baseComplex, irregularVertices, stripThrough } from './structure.js';

const TURN = Math.PI / 24, ZOOM = 0.9; // of a key

const colour = (name) => new Color(getComputedStyle(document.documentElement).getPropertyValue(`--${name}`).trim());

function geometryOf(positions, index) {
  const geometry = new BufferGeometry();
  geometry.setAttribute('position', new BufferAttribute(positions, 3));
  if (index) geometry.setIndex(new BufferAttribute(index, 1));
  return geometry;
}

/* Triangles of polygons, fans from their first corners. */
export function trianglesOf({ indices, faceSize, faceSizes }) {
  if (!faceSizes && faceSize === 3) return indices;
  const out = [];
  for (let at = 0, f = 0; at < indices.length; f++) {
    const size = faceSizes ? faceSizes[f] : faceSize;
    for (let i = 1; i + 1 < size; i++) out.push(indices[at], indices[at + i], indices[at + i + 1]);
    at += size;
  }
  return Uint32Array.from(out);
}

export class View {
  constructor(canvas) {
    this.canvas = canvas;
    this.renderer = new WebGLRenderer({ canvas, antialias: true, alpha: true, preserveDrawingBuffer: true });
    this.camera = new PerspectiveCamera(35, 1, 0.01, 100);
    this.camera.position.set(0.9, 0.6, 2.4);
    this.controls = new OrbitControls(this.camera, canvas);
    this.controls.addEventListener('change', () => this.ask());
    this.layout = 'result';
    this.wipe = 0.5;
    this.shows = { shaded: true, wires: true, irregular: true, base: false };
    this.panes = { left: this.makePane(), right: this.makePane() };
    this.center = new Vector3();
    this.scale = 1;
    new ResizeObserver(() => this.resize()).observe(canvas.parentElement);
    matchMedia('(prefers-color-scheme: dark)').addEventListener('change', () => this.paint());
    canvas.addEventListener('keydown', (event) => this.key(event));
    this.paint();
  }

  makePane() {
    const scene = new Scene(), group = new Group();
    scene.add(group, new HemisphereLight(0xffffff, 0x777777, 1.4));
    const light = new DirectionalLight(0xffffff, 1.2);
    scene.add(light);
    return { scene, group, light, content: null };
  }

  ask() {
    this.asked ??= requestAnimationFrame(() => {
      this.asked = null;
      this.draw();
    });
  }

  resize() {
    const { clientWidth: width, clientHeight: height } = this.canvas.parentElement;
    if (!width || !height) return;
    this.renderer.setPixelRatio(Math.min(devicePixelRatio, 2));
    this.renderer.setSize(width, height, false);
    this.ask();
  }

  /* The surface's box becomes one of unit size around the origin. */
  frame(positions) {
    const low = [Infinity, Infinity, Infinity], high = [-Infinity, -Infinity, -Infinity];
    for (let i = 0; i < positions.length; i++) (low[i % 3] = Math.min(low[i % 3], positions[i])), (high[i % 3] = Math.max(high[i % 3], positions[i]));
    this.center.set(...low.map((x, k) => (x + high[k]) / 2));
    this.scale = 1 / (Math.hypot(...low.map((x, k) => high[k] - x)) || 1);
    this.controls.target.set(0, 0, 0);
    this.camera.position.set(0.6, 0.45, 1.75);
    this.controls.update();
  }

  placed(positions) {
    const out = new Float32Array(positions.length), c = this.center.toArray();
    for (let i = 0; i < out.length; i++) out[i] = (positions[i] - c[i % 3]) * this.scale;
    return out;
  }

  clear(side) {
    const pane = this.panes[side];
    pane.group.traverse((object) => {
      object.geometry?.dispose();
      object.material?.dispose();
    });
    pane.group.clear();
    pane.content = null;
    this.ask();
  }

  showSurface(side, surface) {
    this.clear(side);
    const positions = this.placed(surface.positions), geometry = geometryOf(positions, trianglesOf(surface));
    const lines = [];
    for (let at = 0, f = 0; at < surface.indices.length; f++) {
      const size = surface.faceSizes ? surface.faceSizes[f] : surface.faceSize;
      for (let i = 0; i < size; i++) {
        const a = surface.indices[at + i], b = surface.indices[at + ((i + 1) % size)];
        if (a < b) lines.push(a, b); // edges of boundaries that run the other way are left out, which is hardly seen
      }
      at += size;
    }
    this.fill(side, { positions, geometry, lines: Uint32Array.from(lines) });
  }

  showQuads(side, result, structure) {
    this.clear(side);
    const positions = this.placed(result.positions), index = trianglesOf({ indices: result.quads, faceSize: 4 });
    this.fill(side, { positions, geometry: geometryOf(positions, index), lines: structure.edges, structure });
  }

  fill(side, { positions, geometry, lines, structure }) {
    const pane = this.panes[side], attribute = new BufferAttribute(positions, 3);
    const part = (type, material, index) => {
      const own = new BufferGeometry();
      own.setAttribute('position', attribute);
      own.setIndex(new BufferAttribute(Uint32Array.from(index), 1));
      const object = new type(own, material);
      pane.group.add(object);
      return object;
    };
    const flat = geometry.toNonIndexed();
    flat.computeVertexNormals();
    const mesh = new Mesh(flat, new MeshLambertMaterial({ side: DoubleSide, polygonOffset: true, polygonOffsetFactor: 1, polygonOffsetUnits: 1 }));
    pane.group.add(mesh);
    pane.content = { mesh, structure, positions, wires: part(LineSegments, new LineBasicMaterial(), lines) };
    if (structure) {
      const { few, many } = irregularVertices(structure), dots = () => new PointsMaterial({ size: 7, sizeAttenuation: false });
      pane.content.few = part(Points, dots(), few);
      pane.content.many = part(Points, dots(), many);
      pane.content.base = part(LineSegments, new LineBasicMaterial(), baseComplex(structure));
      pane.content.strip = new Mesh(new BufferGeometry(), new MeshLambertMaterial({ side: DoubleSide }));
      pane.group.add(pane.content.strip);
    }
    this.paint();
  }

  /* Colours and what is shown. */
  paint() {
    for (const { content } of Object.values(this.panes)) {
      if (!content) continue;
      content.mesh.material.color = colour(this.shows.shaded ? 'mesh' : 'paper');
      content.mesh.material.emissive = this.shows.shaded ? new Color(0) : colour('paper');
      content.wires.material.color = colour(this.shows.shaded ? 'wire' : 'ink');
      content.wires.visible = this.shows.wires;
      if (!content.structure) continue;
      content.few.material.color = colour('few');
      content.many.material.color = colour('many');
      content.few.visible = content.many.visible = this.shows.irregular;
      content.base.material.color = colour('complex');
      content.base.visible = this.shows.base;
      content.strip.material.color = colour('strip');
    }
    this.ask();
  }

  /* What is drawn where: [side, left edge, width, begin and end of the part that is not cut off], in CSS pixels. */
  parts(width) {
    if (this.layout === 'beside') return [['left', 0, width / 2, 0, width / 2], ['right', width / 2, width / 2, width / 2, width]];
    if (this.layout === 'wipe') return [['left', 0, width, 0, width * this.wipe], ['right', 0, width, width * this.wipe, width]];
    return [['right', 0, width, 0, width]];
  }

  draw() {
    const { clientWidth: width, clientHeight: height } = this.canvas;
    if (!width || !height) return;
    this.renderer.setScissorTest(true);
    for (const [side, left, across, begin, end] of this.parts(width)) {
      const pane = this.panes[side];
      this.camera.aspect = across / height;
      this.camera.updateProjectionMatrix();
      pane.light.position.copy(this.camera.position).add(new Vector3(0.4, 0.6, 0));
      this.renderer.setViewport(left, 0, across, height);
      this.renderer.setScissor(begin, 0, Math.max(0, end - begin), height);
      if (end - begin >= 1) this.renderer.render(pane.scene, this.camera);
    }
  }

  /* The half-edge of quads that is nearest to a point of the canvas, with its pane; or null. */
  pick(x, y) {
    const { clientWidth: width, clientHeight: height } = this.canvas;
    const part = this.parts(width).find(([, , , begin, end]) => x >= begin && x < end), pane = part && this.panes[part[0]];
    if (!pane?.content?.structure) return null;
    this.camera.aspect = part[2] / height;
    this.camera.updateProjectionMatrix();
    const caster = new Raycaster();
    caster.setFromCamera(new Vector2(((x - part[1]) / part[2]) * 2 - 1, 1 - (y / height) * 2), this.camera);
    const hit = caster.intersectObject(pane.content.mesh)[0];
    if (!hit) return null;
    const { quads } = pane.content.structure, quad = Math.floor(hit.faceIndex / 2), p = pane.content.positions;
    const at = (c) => new Vector3().fromArray(p, 3 * quads[c]);
    let best = null, least = Infinity;
    for (let i = 0; i < 4; i++) {
      const h = 4 * quad + i, a = at(h), b = at(4 * quad + ((i + 1) % 4)), along = b.clone().sub(a);
      const t = Math.min(1, Math.max(0, hit.point.clone().sub(a).dot(along) / along.lengthSq()));
      const distance = a.addScaledVector(along, t).distanceTo(hit.point);
      if (distance < least) (least = distance), (best = h);
    }
    return { pane, halfEdge: best };
  }

  /* Shows the strip that crosses the nearest edge. Gives the number of its quads; 0: nothing is there. */
  showStrip(x, y) {
    const found = x === undefined ? null : this.pick(x, y), strip = found ? stripThrough(found.pane.content.structure, found.halfEdge) : [];
    for (const pane of Object.values(this.panes)) {
      if (!pane.content?.strip) continue;
      const own = pane === found?.pane ? strip : [], { quads } = pane.content.structure;
      const corners = own.flatMap((q) => [0, 1, 2, 0, 2, 3].map((i) => quads[4 * q + i]));
      pane.content.strip.geometry.dispose();
      const geometry = geometryOf(pane.content.positions, Uint32Array.from(corners)).toNonIndexed();
      geometry.computeVertexNormals();
      pane.content.strip.geometry = geometry;
      pane.content.strip.visible = own.length > 0;
    }
    this.ask();
    return strip.length;
  }

  key(event) {
    const turns = { ArrowLeft: [-TURN, 0], ArrowRight: [TURN, 0], ArrowUp: [0, -TURN], ArrowDown: [0, TURN] }[event.key];
    const zoom = { '+': ZOOM, '=': ZOOM, '-': 1 / ZOOM }[event.key];
    if (!turns && !zoom) return;
    event.preventDefault();
    const offset = this.camera.position.clone().sub(this.controls.target), up = new Vector3(0, 1, 0);
    if (zoom) offset.multiplyScalar(zoom);
    else {
      const polar = offset.angleTo(up), turn = Math.min(Math.PI - 0.05, Math.max(0.05, polar + turns[1])) - polar;
      offset.applyAxisAngle(up, turns[0]);
      offset.applyAxisAngle(new Vector3().crossVectors(up, offset).normalize(), turn);
    }
    this.camera.position.copy(this.controls.target).add(offset);
    this.controls.update();
    this.ask();
  }
}
