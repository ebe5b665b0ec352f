/* The picture: while the surface is painted or drawn on, that and the quads beside it; otherwise a surface or quads on the left, quads on the right, beside one another or wiped, under one camera. Drawn when something has
 * changed, never otherwise. */
import {
  BufferAttribute, BufferGeometry, Color, DataTexture, DirectionalLight, DoubleSide, Group, HemisphereLight, Line, LineBasicMaterial, LineLoop, LineSegments,
  LinearFilter, LinearMipmapLinearFilter, Mesh, MeshBasicMaterial, MeshLambertMaterial, MeshStandardMaterial, PerspectiveCamera, PlaneGeometry, Points, PointsMaterial, Raycaster, Scene, SRGBColorSpace, Vector2, Vector3,
  WebGLRenderer,
} from 'three';
import { OrbitControls } from 'three/addons/controls/OrbitControls.js';
import { baseComplex, irregularVertices, stripThrough } from './structure.js';

const ANGLE = 35; // degrees that are seen
const NARROW = 640; // CSS pixels, below which the surface that is drawn on has the whole picture
const PLANE = 0.9; // side of the square that stands for the plane of symmetry
const FAINT = 0.45; // of the input's edges
const DOT = 8; // CSS pixels across, of an irregular vertex
const GAP = 4; // a line on the surface has no step that is so many times as long as it should be
const TURN = Math.PI / 24, ZOOM = 0.9; // of a key

const colour = (name) => new Color(getComputedStyle(document.documentElement).getPropertyValue(`--${name}`).trim());

function geometryOf(positions, index) {
  const geometry = new BufferGeometry();
  geometry.setAttribute('position', new BufferAttribute(positions, 3));
  if (index) geometry.setIndex(new BufferAttribute(index, 1));
  return geometry;
}

/* Points as discs; of three.js they are squares. */
function discs(parameters) {
  const material = new PointsMaterial({ sizeAttenuation: false, ...parameters });
  material.onBeforeCompile = (shader) => {
    shader.vertexShader = shader.vertexShader.replace('#include <fog_vertex>', '#include <fog_vertex>\n  gl_Position.z -= 0.00005 * gl_Position.w;'); // before the surface
    shader.fragmentShader = shader.fragmentShader.replace('#include <clipping_planes_fragment>', '#include <clipping_planes_fragment>\n  if (length(gl_PointCoord - 0.5) > 0.5) discard;');
  };
  return material;
}

/* A map as three.js has it: four channels, the lower row first. */
function textureOf({ width, height, channels, pixels }, isColour) {
  const data = new Uint8Array(4 * width * height).fill(255);
  for (let y = 0, at = 0; y < height; y++)
    for (let x = 0; x < width; x++, at += channels)
      for (let k = 0; k < channels; k++) data[4 * ((height - 1 - y) * width + x) + k] = pixels[at + k];
  const texture = new DataTexture(data, width, height);
  Object.assign(texture, { magFilter: LinearFilter, minFilter: LinearMipmapLinearFilter, generateMipmaps: true, anisotropy: 4, needsUpdate: true });
  if (isColour) texture.colorSpace = SRGBColorSpace;
  return texture;
}

/* The maps of a result as a material, as its GLB holds them. */
function materialOf({ color, normal, orm, emission }) {
  const material = new MeshStandardMaterial({ side: DoubleSide, roughness: orm ? 1 : 0.8, metalness: orm ? 1 : 0, polygonOffset: true, polygonOffsetFactor: 1, polygonOffsetUnits: 1 });
  if (color) material.map = textureOf(color, true);
  if (normal) material.normalMap = textureOf(normal, false);
  if (orm) material.roughnessMap = material.metalnessMap = textureOf(orm, false);
  if (emission) (material.emissiveMap = textureOf(emission, true)), material.emissive.set(1, 1, 1);
  return material;
}

function emptied(group) {
  group.traverse((object) => {
    object.geometry?.dispose();
    for (const map of ['map', 'normalMap', 'roughnessMap', 'emissiveMap']) object.material?.[map]?.dispose();
    object.material?.dispose();
  });
  group.clear();
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
    this.camera = new PerspectiveCamera(ANGLE, 1, 0.01, 100);
    this.camera.position.set(0.9, 0.6, 2.4);
    this.controls = new OrbitControls(this.camera, canvas);
    this.controls.addEventListener('change', () => this.ask());
    this.layout = 'result';
    this.wipe = 0.5;
    this.shows = { shaded: true, maps: true, wires: true, irregular: true, base: false, plane: true };
    this.panes = { left: this.makePane(), right: this.makePane(), input: this.makePane() };
    this.tool = false; // whether the surface is painted or drawn on
    this.caster = new Raycaster();
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
    const drawn = new Group(), plane = new Group(); // guides; the plane of symmetry
    scene.add(drawn, plane);
    return { scene, group, light, drawn, plane, content: null };
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
    const [wide, deep] = [high[0] - low[0], high[2] - low[2]];
    this.camera.position.set(...(wide < deep ? [1.5, 0.4, 0.5] : [0.5, 0.4, 1.5])); // the broader side
    this.controls.update();
  }

  placed(positions) {
    const out = new Float32Array(positions.length), c = this.center.toArray();
    for (let i = 0; i < out.length; i++) out[i] = (positions[i] - c[i % 3]) * this.scale;
    return out;
  }

  clear(side) {
    const pane = this.panes[side];
    emptied(pane.group), emptied(pane.plane);
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
    this.showPlane(side, result.report);
    const positions = this.placed(result.positions), quads = trianglesOf({ indices: result.quads, faceSize: 4 });
    const others = result.rest ? trianglesOf(result.rest) : [], index = Uint32Array.from([...quads, ...others]);
    this.fill(side, { positions, geometry: geometryOf(positions, index), lines: structure.edges, structure });
    if (result.maps?.normal && !result.rest) this.dress(side, result, index);
  }

  /* The quads as their maps show them, in the place of the plain ones. */
  dress(side, { maps, attributes: { uv, normal } }, index) {
    const { content, group } = this.panes[side], corners = [], geometry = content.mesh.geometry.clone();
    for (let c = 0; c < (index.length / 6) * 4; c += 4) corners.push(c, c + 1, c + 2, c, c + 2, c + 3); // as trianglesOf cuts them
    for (const [name, { values }, size] of [['uv', uv, 2], ['normal', normal, 3]]) {
      const out = new Float32Array(size * corners.length);
      corners.forEach((c, i) => out.set(values.subarray(size * c, size * c + size), size * i));
      geometry.setAttribute(name, new BufferAttribute(out, size));
    }
    content.dressed = new Mesh(geometry, materialOf(maps));
    group.add(content.dressed);
    this.paint();
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
    pane.content = { mesh, structure, positions, wires: part(LineSegments, new LineBasicMaterial(structure ? {} : { transparent: true, opacity: FAINT }), lines) };
    if (structure) {
      const { few, many } = irregularVertices(structure), dots = () => discs({ size: DOT * this.renderer.getPixelRatio() });
      pane.content.few = part(Points, dots(), few);
      pane.content.many = part(Points, dots(), many);
      pane.content.base = part(LineSegments, new LineBasicMaterial(), baseComplex(structure));
      pane.content.strip = new Mesh(new BufferGeometry(), new MeshLambertMaterial({ side: DoubleSide }));
      pane.group.add(pane.content.strip);
    }
    this.paint();
  }

  /* ---- the plane of symmetry */

  showPlane(side, report) {
    const { plane } = this.panes[side];
    emptied(plane);
    this.canvas.dataset.plane = report?.symmetric === 1 ? 'shown' : '';
    if (report?.symmetric !== 1) return;
    const normal = new Vector3(report.plane_x, report.plane_y, report.plane_z), offset = (report.plane_offset - normal.dot(this.center)) * this.scale;
    const square = new PlaneGeometry(PLANE, PLANE), material = { transparent: true, opacity: 0.16, side: DoubleSide, depthWrite: false };
    const border = geometryOf(new Float32Array([-1, -1, 0, 1, -1, 0, 1, 1, 0, -1, 1, 0].map((x) => (x * PLANE) / 2)));
    plane.add(new Mesh(square, new MeshBasicMaterial(material)), new LineLoop(border, new LineBasicMaterial()));
    plane.quaternion.setFromUnitVectors(new Vector3(0, 0, 1), normal);
    plane.position.copy(normal).multiplyScalar(offset);
  }

  /* ---- what is painted and drawn on the surface */

  /* Shows the surface as that which is painted and drawn on. */
  showCanvas(surface) {
    this.showSurface('input', surface);
    const { mesh } = this.panes.input.content;
    this.cornersOf = trianglesOf(surface);
    mesh.geometry.setAttribute('color', new BufferAttribute(new Float32Array(3 * this.cornersOf.length).fill(1), 3));
    mesh.material.vertexColors = true;
    this.paint();
  }

  /* Colours by density: finer is warm, coarser is cold. */
  showDensity(density) {
    const { content } = this.panes.input;
    if (!content || !this.cornersOf) return;
    const plain = colour('mesh'), finer = colour('strip'), coarser = colour('few'), mixed = new Color();
    const attribute = content.mesh.geometry.attributes.color;
    for (let c = 0; c < this.cornersOf.length; c++) {
      const share = Math.max(-1, Math.min(1, Math.log2(density[this.cornersOf[c]]) / 2));
      mixed.copy(plain).lerp(share > 0 ? finer : coarser, Math.abs(share));
      attribute.setXYZ(c, mixed.r, mixed.g, mixed.b);
    }
    attribute.needsUpdate = true;
    this.ask();
  }

  /* Guides and the one that is being drawn (null: none), over the surface and over the quads. */
  showGuides(guides, draft) {
    for (const side of ['input', 'right']) {
      const { drawn } = this.panes[side];
      emptied(drawn);
      for (const guide of [...guides, ...(draft ? [draft] : [])]) {
        if (!guide.points.length) continue;
        const geometry = geometryOf(new Float32Array(guide.points.flat()));
        const material = { color: colour(guide.kind === 'loop' ? 'many' : 'complex'), depthTest: false, transparent: true };
        drawn.add(new (guide.closed ? LineLoop : Line)(geometry, new LineBasicMaterial(material)));
        if (side === 'input') drawn.add(new Points(geometry, discs({ ...material, size: (guide === draft ? 6 : 4) * this.renderer.getPixelRatio() })));
      }
    }
    this.ask();
  }

  /* The point of the surface under a point of the canvas: {point: [x, y, z], corners}, or null. */
  pickSurface(x, y) {
    const { clientWidth: width, clientHeight: height } = this.canvas;
    const part = this.parts(width).find(([side, , , begin, end]) => side === 'input' && x >= begin && x < end);
    if (!part || !this.panes.input.content) return null;
    this.aim(part[2], height);
    return this.cast(new Vector2(((x - part[1]) / part[2]) * 2 - 1, 1 - (y / height) * 2));
  }

  cast(at) {
    this.caster.setFromCamera(at, this.camera);
    const hit = this.caster.intersectObject(this.panes.input.content.mesh)[0];
    return hit ? { point: hit.point.toArray(), corners: [0, 1, 2].map((i) => this.cornersOf[3 * hit.faceIndex + i]) } : null;
  }

  /* The middle of the part of the canvas in which the surface is. */
  middle() {
    const { clientWidth: width, clientHeight: height } = this.canvas, part = this.parts(width).find(([side]) => side === 'input');
    return part ? [(part[3] + part[4]) / 2, height / 2] : null;
  }

  /* Points of the surface between two of them, as the camera sees it, without the two; null where the surface is interrupted. */
  trace(from, to, spacing) {
    const a = new Vector3(...from), b = new Vector3(...to), steps = Math.ceil(a.distanceTo(b) / spacing), points = [];
    let last = a;
    for (let i = 1; i <= steps; i++) {
      const seen = a.clone().lerp(b, i / steps).project(this.camera), hit = i < steps ? this.cast(new Vector2(seen.x, seen.y)) : { point: to };
      if (!hit || last.distanceTo(new Vector3(...hit.point)) > GAP * spacing) return null;
      last = new Vector3(...hit.point);
      if (i < steps) points.push(hit.point);
    }
    return points;
  }

  /* From the picture's frame to the surface's. */
  inSurface(p) {
    const c = this.center.toArray();
    return p.map((x, k) => x / this.scale + c[k]);
  }

  /* Colours and what is shown. */
  paint() {
    for (const { content, plane } of Object.values(this.panes)) {
      plane.visible = this.shows.plane;
      for (const part of plane.children) part.material.color = colour('complex');
      if (!content) continue;
      content.mesh.material.color = content.mesh.material.vertexColors ? new Color(1, 1, 1) : colour(this.shows.shaded ? 'mesh' : 'paper');
      content.mesh.material.emissive = this.shows.shaded || content.mesh.material.vertexColors ? new Color(0) : colour('paper');
      if (content.dressed) (content.dressed.visible = this.shows.maps), (content.mesh.visible = !this.shows.maps);
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

  get isNarrow() {
    return this.canvas.clientWidth < NARROW;
  }

  /* What is drawn where: [side, left edge, width, begin and end of the part that is not cut off], in CSS pixels. */
  parts(width) {
    if (this.tool && this.isNarrow) return [['input', 0, width, 0, width]];
    if (this.tool) return [['input', 0, width / 2, 0, width / 2], ['right', width / 2, width / 2, width / 2, width]];
    if (this.layout === 'beside') return [['left', 0, width / 2, 0, width / 2], ['right', width / 2, width / 2, width / 2, width]];
    if (this.layout === 'wipe') return [['left', 0, width, 0, width * this.wipe], ['right', 0, width, width * this.wipe, width]];
    return [['right', 0, width, 0, width]];
  }

  /* The camera for a part of the picture: as much is seen across as down. */
  aim(across, height) {
    this.camera.aspect = across / height;
    this.camera.fov = (360 / Math.PI) * Math.atan(Math.tan((ANGLE * Math.PI) / 360) / Math.min(1, this.camera.aspect));
    this.camera.updateProjectionMatrix();
  }

  draw() {
    const { clientWidth: width, clientHeight: height } = this.canvas;
    if (!width || !height) return;
    this.renderer.setScissorTest(true);
    for (const [side, left, across, begin, end] of this.parts(width)) {
      const pane = this.panes[side];
      this.aim(across, height);
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
    this.aim(part[2], height);
    const caster = new Raycaster();
    caster.setFromCamera(new Vector2(((x - part[1]) / part[2]) * 2 - 1, 1 - (y / height) * 2), this.camera);
    const hit = caster.intersectObject(pane.content.mesh)[0]; // also where its maps are shown
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
