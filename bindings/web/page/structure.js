/* What the page shows of quads, from their corners alone: edges, valences, strips, the lines of the base complex, angles, areas.
 * Half-edge 4 q + i of quad q goes from corner i to corner i + 1; an edge that more than two quads share has no twins. */

const next = (h) => (h % 4 === 3 ? h - 3 : h + 1);
const previous = (h) => (h % 4 === 0 ? h + 3 : h - 1);
const opposite = (h) => next(next(h));

/* twin: Int32Array, the half-edge the other way, or -1. */
export function structureOf(quads, vertexCount) {
  const twin = new Int32Array(quads.length).fill(-1), first = new Map();
  for (let h = 0; h < quads.length; h++) {
    const a = quads[h], b = quads[next(h)], other = first.get(b * vertexCount + a);
    if (other !== undefined && twin[other] < 0) (twin[h] = other), (twin[other] = h);
    else first.set(a * vertexCount + b, h);
  }
  const valence = new Uint16Array(vertexCount), boundary = new Uint8Array(vertexCount), edges = [];
  for (let h = 0; h < quads.length; h++) {
    if (twin[h] >= 0 && twin[h] < h) continue;
    const a = quads[h], b = quads[next(h)];
    valence[a]++, valence[b]++;
    edges.push(a, b);
    if (twin[h] < 0) boundary[a] = boundary[b] = 1;
  }
  return { quads, twin, valence, boundary, edges: Uint32Array.from(edges) };
}

const isRegular = (s, v) => s.valence[v] === (s.boundary[v] ? 3 : 4);

/* Vertices with fewer and with more edges than regular ones; at boundaries 2 is a corner and no fault. */
export function irregularVertices(s) {
  const few = [], many = [];
  for (let v = 0; v < s.valence.length; v++) {
    if (!s.valence[v] || isRegular(s, v) || (s.boundary[v] && s.valence[v] === 2)) continue;
    (s.valence[v] < (s.boundary[v] ? 3 : 4) ? few : many).push(v);
  }
  return { few, many };
}

/* The quads of the strip that is entered through half-edge h, once each, in their order. */
export function stripThrough(s, h) {
  const strip = [], seen = new Set();
  const walk = (from, add) => {
    for (let at = from; at >= 0; at = s.twin[opposite(at)]) {
      const key = Math.min(at, opposite(at));
      if (seen.has(key)) return true;
      seen.add(key);
      add(at >> 2);
    }
    return false;
  };
  const closes = walk(h, (q) => strip.push(q));
  if (!closes && s.twin[h] >= 0) walk(s.twin[h], (q) => strip.unshift(q));
  return [...new Set(strip)];
}

/* The lines that leave irregular vertices along every edge and go straight on, as pairs of vertices. */
export function baseComplex(s) {
  const drawn = new Uint8Array(s.quads.length), lines = [];
  const draw = (h) => {
    const other = s.twin[h];
    if (drawn[h] || (other >= 0 && drawn[other])) return false;
    drawn[h] = 1;
    lines.push(s.quads[h], s.quads[next(h)]);
    return true;
  };
  const follow = (from) => {
    for (let h = from; draw(h); ) {
      const end = s.quads[next(h)];
      if (s.boundary[end] || !isRegular(s, end)) return;
      const across = s.twin[next(h)]; // at a regular vertex: over the next edge of this quad, and on
      if (across < 0) return;
      h = next(across);
    }
  };
  for (let h = 0; h < s.quads.length; h++) if (!isRegular(s, s.quads[h])) follow(h);
  for (let h = 0; h < s.quads.length; h++) if (s.twin[h] < 0) draw(h);
  return Uint32Array.from(lines);
}

const BINS = 30;

const difference = (p, a, b) => [p[3 * b] - p[3 * a], p[3 * b + 1] - p[3 * a + 1], p[3 * b + 2] - p[3 * a + 2]];
const dot = (a, b) => a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
const cross = (a, b) => [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]];
const length = (a) => Math.hypot(a[0], a[1], a[2]);

/* Shares of the corners by angle (0 to 180 degrees) and of the quads by area (0 to 3 times the mean), and vertices by valence. */
export function histograms(positions, s) {
  const angles = new Float64Array(BINS), areas = new Float64Array(BINS), count = s.quads.length / 4, area = new Float64Array(count);
  for (let h = 0; h < s.quads.length; h++) {
    const a = difference(positions, s.quads[h], s.quads[next(h)]), b = difference(positions, s.quads[h], s.quads[previous(h)]);
    const angle = Math.atan2(length(cross(a, b)), dot(a, b));
    angles[Math.min(BINS - 1, Math.floor((angle / Math.PI) * BINS))] += 1 / s.quads.length;
    if (h % 4 === 0 || h % 4 === 2) area[h >> 2] += length(cross(a, b)) / 2;
  }
  const mean = area.reduce((sum, x) => sum + x, 0) / count;
  for (const x of area) areas[Math.min(BINS - 1, Math.floor((x / mean / 3) * BINS))] += 1 / count;
  const valences = new Float64Array(10);
  for (let v = 0; v < s.valence.length; v++) if (!s.boundary[v]) valences[Math.min(9, s.valence[v])]++;
  return { angles, areas, valences };
}
