/* BufferGeometry of three.js to quads and back.
 *
 *     const result = await remesh(...fromGeometry(mesh.geometry, { faces: 5000 }));
 *     const { geometry, edges } = toGeometry(result);
 *     scene.add(new Mesh(geometry, material), new LineSegments(edges, lineMaterial)); */
import { BufferAttribute, BufferGeometry } from 'three';

const KIND_OF = { normal: 'normals', uv: 'uvs', uv1: 'uvs', uv2: 'uvs', uv3: 'uvs' };
const SKIPPED = ['position', 'tangent', 'skinIndex', 'skinWeight']; // tangents are made anew; skins come as pairs

const floatsOf = (attribute) => {
  const size = attribute.itemSize, values = new Float32Array(attribute.count * size);
  for (let i = 0; i < attribute.count; i++)
    for (let k = 0; k < size; k++) values[size * i + k] = attribute.getComponent(i, k); // of any layout, normalized ones as numbers
  return values;
};

function weightsOf({ skinIndex, skinWeight }) {
  return { kind: 'weights', components: skinWeight.itemSize, values: floatsOf(skinWeight), groups: Uint32Array.from(floatsOf(skinIndex)) };
}

/* The arguments of remesh() for a geometry, with its attributes: [positions, indices, options]. Groups become the label "group". */
export function fromGeometry(geometry, options = {}) {
  const attributes = {};
  for (const [name, attribute] of Object.entries(geometry.attributes))
    if (!SKIPPED.includes(name))
      attributes[name] = { kind: KIND_OF[name] ?? 'values', components: attribute.itemSize, values: floatsOf(attribute) };
  if (geometry.attributes.skinWeight && geometry.attributes.skinIndex) attributes.skin = weightsOf(geometry.attributes);
  const positions = floatsOf(geometry.attributes.position);
  const indices = geometry.index ? Uint32Array.from(geometry.index.array) : Uint32Array.from({ length: positions.length / 3 }, (_, i) => i);
  if (geometry.groups.length) {
    const values = new Int32Array(indices.length / 3);
    for (const { start, count, materialIndex } of geometry.groups)
      values.fill(materialIndex ?? 0, start / 3, Math.min((start + count) / 3, values.length));
    attributes.group = { kind: 'labels', domain: 'face', values };
  }
  return [positions, indices, { ...options, attributes: { ...attributes, ...options.attributes } }];
}

/* Whether an attribute differs between the corners of some vertex: then corners cannot share vertices. */
const isPerCorner = (attributes) => Object.values(attributes).some(({ domain }) => domain === 'corner');

function addAttributes(geometry, attributes, vertexOf, cornerOf, count) {
  for (const [name, { values, components, domain, kind, groups }] of Object.entries(attributes)) {
    if (domain === 'face') continue;
    const from = domain === 'corner' ? cornerOf : vertexOf, out = new Float32Array(count * components);
    const rows = (source, target) => {
      for (let i = 0; i < count; i++)
        for (let k = 0; k < components; k++) target[components * i + k] = source[components * from(i) + k];
      return target;
    };
    if (kind === 'weights') {
      geometry.setAttribute('skinWeight', new BufferAttribute(rows(values, out), components));
      geometry.setAttribute('skinIndex', new BufferAttribute(rows(groups, new Uint16Array(count * components)), components));
    } else {
      geometry.setAttribute(name, new BufferAttribute(rows(values, out), components));
    }
  }
}

/* Triangles sorted by a label of faces, as groups. */
function addGroups(geometry, { values }, index) {
  const order = Array.from(values.keys()).sort((a, b) => values[a] - values[b] || a - b), sorted = new index.constructor(index.length);
  order.forEach((face, i) => sorted.set(index.subarray(6 * face, 6 * face + 6), 6 * i));
  for (let begin = 0; begin < order.length; ) {
    let end = begin;
    while (end < order.length && values[order[end]] === values[order[begin]]) end++;
    geometry.addGroup(6 * begin, 6 * (end - begin), Math.max(values[order[begin]], 0));
    begin = end;
  }
  return sorted;
}

/* geometry: each quad as two triangles, cut from its first corner, with the attributes of the result; edges: those of the quads, for
 * LineSegments, on the same positions where no attribute comes by corners. */
export function toGeometry({ positions, quads, attributes = {} }) {
  const geometry = new BufferGeometry(), edges = new BufferGeometry(), perCorner = isPerCorner(attributes);
  const count = perCorner ? quads.length : positions.length / 3, vertexOf = perCorner ? (i) => quads[i] : (i) => i;
  const place = new Float32Array(3 * count);
  for (let i = 0; i < count; i++) for (let k = 0; k < 3; k++) place[3 * i + k] = positions[3 * vertexOf(i) + k];
  const corner = perCorner ? (c) => c : (c) => quads[c];
  let index = new Uint32Array((quads.length / 4) * 6);
  for (let q = 0; q < quads.length / 4; q++)
    index.set([0, 1, 2, 0, 2, 3].map((i) => corner(4 * q + i)), 6 * q);
  geometry.setAttribute('position', new BufferAttribute(place, 3));
  addAttributes(geometry, attributes, vertexOf, (i) => i, count);
  if (attributes.group?.domain === 'face') index = addGroups(geometry, attributes.group, index);
  geometry.setIndex(new BufferAttribute(index, 1));
  if (!geometry.attributes.normal) geometry.computeVertexNormals();
  const seen = new Set(), lines = [], vertices = positions.length / 3;
  for (let c = 0; c < quads.length; c++) {
    const a = quads[c], b = quads[c % 4 === 3 ? c - 3 : c + 1], key = Math.min(a, b) * vertices + Math.max(a, b);
    if (!seen.has(key)) seen.add(key), lines.push(a, b);
  }
  edges.setAttribute('position', perCorner ? new BufferAttribute(Float32Array.from(positions), 3) : geometry.attributes.position);
  edges.setIndex(new BufferAttribute(Uint32Array.from(lines), 1));
  return { geometry, edges };
}
