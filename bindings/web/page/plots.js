/* Small plots of the report: bars of the result, and the outline of what it is compared with. */
const WIDTH = 180, HEIGHT = 88, GROUND = 66;
const NAMESPACE = 'http://www.w3.org/2000/svg';

function add(parent, name, attributes, text) {
  const element = document.createElementNS(NAMESPACE, name);
  for (const [key, value] of Object.entries(attributes)) element.setAttribute(key, value);
  if (text) element.textContent = text;
  parent.append(element);
  return element;
}

function plot(title, labels, bars, others, describe) {
  const figure = document.createElement('figure'), svg = add(figure, 'svg', { viewBox: `0 0 ${WIDTH} ${HEIGHT}`, role: 'img', 'aria-label': describe });
  const most = Math.max(...bars, ...(others ?? []), 1e-9), width = WIDTH / bars.length, y = (value) => GROUND - (value / most) * (GROUND - 4);
  bars.forEach((value, i) => add(svg, 'rect', { x: i * width + 0.5, y: y(value), width: width - 1, height: GROUND - y(value), fill: 'var(--accent)' }));
  if (others) {
    const points = others.flatMap((value, i) => [`${i * width},${y(value)}`, `${(i + 1) * width},${y(value)}`]);
    add(svg, 'polyline', { points: points.join(' '), fill: 'none', stroke: 'var(--other)', 'stroke-width': 1.5 });
  }
  add(svg, 'line', { x1: 0, x2: WIDTH, y1: GROUND, y2: GROUND, stroke: 'var(--line)' });
  labels.forEach(([at, text]) =>
    add(svg, 'text', { x: at * WIDTH, y: HEIGHT - 3, 'font-size': 16, fill: 'var(--quiet)', 'text-anchor': at <= 0 ? 'start' : at >= 1 ? 'end' : 'middle' }, text));
  const caption = document.createElement('figcaption');
  caption.textContent = title;
  figure.append(caption);
  return figure;
}

const percent = (x) => `${(100 * x).toFixed(0)} %`;

export function showPlots(parent, { angles, areas, valences }, other) {
  const near = angles.slice(12, 18).reduce((sum, x) => sum + x, 0), even = areas.slice(7, 13).reduce((sum, x) => sum + x, 0);
  const shown = [...valences].slice(2, 8), all = valences.reduce((sum, x) => sum + x, 0) || 1, rooted = (list) => list.map((x) => Math.sqrt(x));
  parent.replaceChildren(
    plot('angles of the corners', [[0, '0°'], [0.5, '90°'], [1, '180°']], [...angles], other && [...other.angles],
      `Angles of the corners: ${percent(near)} lie between 72 and 108 degrees`),
    plot('areas of the quads', [[0, '0'], [1 / 3, 'mean'], [2 / 3, '2'], [1, '3']], [...areas], other && [...other.areas],
      `Areas of the quads: ${percent(even)} lie between 0.7 and 1.3 times the mean`),
    plot('vertices by valence (root scale)', shown.map((_, i) => [(i + 0.5) / 6, `${i + 2}`]), rooted(shown), other && rooted([...other.valences].slice(2, 8)),
      `Vertices by valence: ${percent(valences[4] / all)} have four edges`),
  );
}
