/* What the visitor says on the surface: a density that is painted, guides that are drawn. Points are those of the picture's frame, in which
 * the surface's box has a diagonal of 1. */

const LEAST = 1 / 8, MOST = 8; // densities
const SPACING = 1 / 90; // of the points of a guide
const MOST_RINGS = 1000;
const CLOSES = 0.03; // ends of a guide that are nearer than this are joined
const FEWEST_OF_LOOP = 8; // points
const SHORT = (x) => Number(x.toPrecision(4));

const distance = (p, i, q) => Math.hypot(p[i] - q[0], p[i + 1] - q[1], p[i + 2] - q[2]);
const between = (a, b) => Math.hypot(a[0] - b[0], a[1] - b[1], a[2] - b[2]);

export class Steering {
  /* positions: three a vertex, of the picture. */
  constructor(positions) {
    this.positions = positions;
    this.density = new Float32Array(positions.length / 3).fill(1);
    this.isPainted = false;
    this.guides = []; // {kind, closed, rings, points: [[x, y, z], ...]}
    this.draft = null; // the guide that is being drawn
    this.version = 0; // of what a run is given
  }

  get isEmpty() {
    return !this.isPainted && this.guides.length === 0;
  }

  /* One touch of the brush: towards `value` within the radius, fully in its middle. corners: the triangle that is touched, whose nearest vertex
   * counts even where the radius holds none. Gives the vertices that changed. */
  paint(center, radius, value, corners) {
    const changed = [], goal = Math.log2(value);
    const touch = (v, share) => {
      const now = Math.log2(this.density[v]), next = Math.min(MOST, Math.max(LEAST, 2 ** (now + (goal - now) * share)));
      if (Math.abs(next - this.density[v]) < 1e-4) return;
      this.density[v] = next;
      changed.push(v);
    };
    let held = 0;
    for (let v = 0; v < this.density.length; v++) {
      const d = distance(this.positions, 3 * v, center);
      if (d >= radius) continue;
      held++;
      const t = d / radius;
      touch(v, t < 0.5 ? 1 : 2 * (1 - t));
    }
    if (held === 0) {
      const nearest = corners.reduce((best, v) => (distance(this.positions, 3 * v, center) < distance(this.positions, 3 * best, center) ? v : best));
      touch(nearest, 1);
    }
    if (changed.length) this.isPainted = this.density.some((x) => x !== this.density[0]);
    return changed;
  }

  clearDensity() {
    this.density.fill(1);
    this.isPainted = false;
    this.version++;
  }

  /* ---- guides */

  begin(kind, rings = 0) {
    this.draft = { kind, closed: false, rings, points: [] };
  }

  /* Adds a point of the surface, unless it is next to the last one. */
  add(point) {
    const { points } = this.draft;
    if (points.length && between(points.at(-1), point) < SPACING) return false;
    points.push(point);
    return true;
  }

  /* The draft becomes a guide if it has a length. Gives whether it did. */
  end() {
    const { draft } = this;
    this.draft = null;
    if (!draft || draft.points.length < 2) return false;
    const { points } = draft;
    if (points.length >= FEWEST_OF_LOOP && between(points[0], points.at(-1)) < CLOSES) {
      draft.closed = true;
      if (between(points[0], points.at(-1)) < SPACING) points.pop();
    }
    if (!draft.closed) draft.rings = 0;
    draft.points = smooth(points, draft.closed).map((p) => p.map(SHORT)); // as a link holds them
    this.guides.push(draft);
    this.version++;
    return true;
  }

  undo() {
    if (this.draft) this.draft = null;
    else if (this.guides.pop()) this.version++;
  }

  clearGuides() {
    this.draft = null;
    this.guides = [];
    this.version++;
  }

  /* What Remesher.steer takes. place: from the picture's frame to the surface's. */
  arguments(place) {
    return {
      density: this.isPainted ? this.density : null,
      guides: this.guides.length ? this.guides.map(({ kind, closed, rings, points }) => ({ kind, closed, rings, points: points.flatMap((p) => place(p).map(printed)) })) : null,
    };
  }
}

/* A hand is less steady than a line should be. */
function smooth(points, closed) {
  const n = points.length, at = (i) => points[closed ? (i + n) % n : Math.min(n - 1, Math.max(0, i))];
  return points.map((p, i) => (!closed && (i === 0 || i === n - 1) ? p : p.map((x, k) => (at(i - 1)[k] + 2 * x + at(i + 1)[k]) / 4)));
}

/* Numbers as files hold them, so that the command line is given the very same. */
export const printed = (x) => Number(x.toPrecision(9));

export const densityText = (density) => `${Array.from(density, (x) => String(x)).join('\n')}\n`;

export function guidesText(guides) {
  let text = '', count = 0;
  for (const { kind, closed, rings, points } of guides) {
    const n = points.length / 3;
    text += `g ${rings ? `rings ${rings}` : kind}\n`;
    for (let i = 0; i < n; i++) text += `v ${points[3 * i]} ${points[3 * i + 1]} ${points[3 * i + 2]}\n`;
    const numbers = Array.from({ length: n }, (_, i) => count + i + 1);
    text += `l ${[...numbers, ...(closed ? [count + 1] : [])].join(' ')}\n`;
    count += n;
  }
  return text;
}

/* Guides in a link: loop, direction, or rings with their number, closed or open, and the points. */
export const guideOfLink = ({ kind, closed, rings, points }) => [rings ? `rings${rings}` : kind, closed ? 'closed' : 'open', ...points.flat()].join(',');

/* A guide out of a link, or null where it is none. */
export function linkedGuide(text) {
  const [name, ends, ...numbers] = text.split(','), values = numbers.map(Number);
  const rings = ends === 'closed' ? Math.min(Number(/^rings(\d+)$/.exec(name)?.[1] ?? 0), MOST_RINGS) : 0, kind = rings ? 'loop' : name;
  const known = ['loop', 'direction'].includes(kind) && ['closed', 'open'].includes(ends);
  if (!known || values.length < 6 || values.length % 3 || !values.every((x) => Math.abs(x) <= 1)) return null;
  const points = Array.from({ length: values.length / 3 }, (_, i) => values.slice(3 * i, 3 * i + 3));
  return { kind, closed: ends === 'closed', rings, points };
}
