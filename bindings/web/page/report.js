/* The report as a table: the figures that say most, then all of them. */

const CHOSEN = [
  ['topology', 'quads'], ['topology', 'irregular'], ['topology', 'irregular_boundary'], ['quality', 'angle_rms'], ['quality', 'area_cv'], ['quality', 'follow'], ['quality', 'simple'],
  ['quality', 'hausdorff'], ['quality', 'patches'], ['topology', 'boundary_loops'], ['report', 'seconds'],
];

const figuresOf = ({ report, result }) => ({ report: report.report, topology: report.report.topology, quality: report.quality, asset: result.asset });

function format(value) {
  if (value === null || value === undefined) return 'none';
  return Number.isInteger(value) ? String(value) : value.toPrecision(3);
}

const cell = (name, text, properties = {}) => Object.assign(document.createElement(name), { textContent: text, ...properties });

function table(rows, fields, all) {
  const node = document.createElement('table'), body = document.createElement('tbody');
  if (all.length > 1) {
    const head = document.createElement('thead'), row = document.createElement('tr');
    row.append(cell('th', 'figure', { scope: 'col' }), cell('th', 'these', { scope: 'col' }), cell('th', 'the others', { scope: 'col' }));
    head.append(row);
    node.append(head);
  }
  for (const [record, name] of rows) {
    const field = fields[record].find((entry) => entry.name === name), row = document.createElement('tr');
    if (!field) continue;
    const unit = field.unit === '-' || ['faces', 'vertices', 'loops', 'patches'].includes(field.unit) ? '' : ` (${field.unit})`;
    row.append(cell('th', `${field.help}${unit}`, { scope: 'row' }), ...all.map((figures) => cell('td', format(figures[record]?.[name]))));
    body.append(row);
  }
  node.append(body);
  const scroll = Object.assign(document.createElement('div'), { className: 'table-scroll' });
  scroll.append(node);
  return scroll;
}

export function showReport(parent, fields, result, compared) {
  const all = [result, compared].filter((one) => one?.report).map(figuresOf);
  const every = Object.entries(fields).filter(([record]) => all.some((figures) => figures[record])).flatMap(([record, rows]) => rows.map(({ name }) => [record, name]));
  const details = document.createElement('details');
  details.open = parent.querySelector('details')?.open ?? false;
  details.append(cell('summary', 'All figures'), table(every, fields, all));
  parent.replaceChildren(table(CHOSEN, fields, all), details);
}
