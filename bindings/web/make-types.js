/* Writes the types of the package: index.d.in.ts, with the options and figures of the library's own tables put into it.
 * usage: node make-types.js PACKAGE-FOLDER */
import { readFileSync, writeFileSync } from 'node:fs';
import { join, resolve } from 'node:path';
import { pathToFileURL } from 'node:url';

const folder = resolve(process.argv[2]);
const { init } = await import(pathToFileURL(join(folder, 'index.js')).href);
const { options, assetOptions, presets, fields, statuses } = await init();

const comment = (text) => `  /** ${text.replaceAll('*/', '* /')} */\n`;
const unit = (row) => (row.unit && row.unit !== '-' ? ` (${row.unit})` : '');
const typeOf = ({ name, kind, choices }) => ({ flag: name === 'wrap' ? 'boolean | number | string' : 'boolean', choice: (choices ?? []).map((c) => `'${c}'`).join(' | ') + (name === 'symmetry' ? ' | number[]' : '') })[kind] ?? 'number';
const initial = ({ kind, initial: value, choices }) => ({ flag: String(value !== 0), choice: choices?.[value] })[kind] ?? String(value);

const optionRows = [...options, ...assetOptions].map((o) => `${comment(`${o.help}${unit(o)}; default: ${initial(o)}`)}  ${o.name}?: ${typeOf(o)};\n`);
const figureRows = (rows) => rows.map((f) => `${comment(`${f.help}${unit(f)}`)}  ${f.name}: number${f.optional ? ' | null' : ''};\n`).join('');

const text = readFileSync(new URL('./index.d.in.ts', import.meta.url), 'utf8')
  .replace('  /* OPTIONS */\n', () => optionRows.join(''))
  .replace('/* PRESETS */', () => presets.map((p) => `'${p.name}'`).join(' | '))
  .replace('  /* REPORT */\n', () => figureRows(fields.report))
  .replace('  /* TOPOLOGY */\n', () => figureRows(fields.topology))
  .replace('  /* QUALITY */\n', () => figureRows(fields.quality))
  .replace('  /* ASSET */\n', () => figureRows(fields.asset))
  .replace('/* STATUSES */', () => statuses.filter((s) => s.status !== 'OK').map((s) => `'${s.status}'`).join(' | '));
writeFileSync(join(folder, 'index.d.ts'), text);
