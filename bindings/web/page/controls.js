/* Controls for the options, made of the library's table: an option that the library gets appears here by itself. */

/* The count has a control of its own, and there is one thread. */
const WITHOUT = ['faces', 'vertices', 'edge_length', 'ratio', 'threads'];
/* Shown first, in this order, where the library has them; the others are under "More options". */
const FIRST = ['follow', 'density', 'symmetry', 'adaptive', 'sharp_angle', 'smoothness', 'loops', 'wrap'];
/* Values that mean something else than a number. */
const WORDS = { sharp_angle: { '-1': 'auto', 180: 'none' } };
/* The step of sliders: from here in reals; counts go by one, and get a number field where they have a wide range, or a default that no step of a slider meets. */
const REAL_STEPS = 100, MOST_OF_SLIDER = 1000;

/* Names that say more than the option's own. */
const TITLES = { adaptive: 'Adaptive density', sharp_angle: 'Sharp above', fix_boundary: 'Keep the boundary', follow: 'Follow the shape' };

const titleOf = (name) => TITLES[name] ?? name.replaceAll('_', ' ').replace(/^./, (c) => c.toUpperCase());

function element(name, properties = {}, ...children) {
  const node = Object.assign(document.createElement(name), properties);
  node.append(...children);
  return node;
}

function numeric(row, value) {
  const whole = row.kind === 'count', step = whole || row.name === 'sharp_angle' ? 1 : Number(((row.most - row.least) / REAL_STEPS).toPrecision(1));
  const steps = (row.initial - row.least) / step; // a slider would move a default that lies between two of its steps
  const wide = row.most - row.least > MOST_OF_SLIDER || Math.abs(steps - Math.round(steps)) > 1e-6;
  return element('input', { type: wide ? 'number' : 'range', min: row.least, max: row.most, step: wide && !whole ? 'any' : step, value });
}

function inputOf(row, value) {
  if (row.kind === 'flag') return element('input', { type: 'checkbox', checked: value });
  if (row.kind !== 'choice') return numeric(row, value);
  return element('select', {}, ...row.choices.map((choice) => element('option', { value: choice, textContent: choice, selected: choice === value })));
}

const valueOf = (row, input) => (row.kind === 'flag' ? input.checked : row.kind === 'choice' ? input.value : Number(input.value));

export const initialOf = ({ kind, initial, choices }) => (kind === 'flag' ? initial !== 0 : kind === 'choice' ? choices[initial] : initial);

/* table: the library's options; first, more: where they go; change: called with nothing when the user has changed one. */
export class Controls {
  constructor(table, first, more, change) {
    this.rows = new Map();
    const shown = table.filter(({ name }) => !WITHOUT.includes(name));
    const rank = ({ name }) => (FIRST.includes(name) ? FIRST.indexOf(name) : FIRST.length);
    for (const row of [...shown].sort((a, b) => rank(a) - rank(b))) (FIRST.includes(row.name) ? first : more).append(this.make(row, change));
  }

  make(row, change) {
    const input = inputOf(row, initialOf(row)), id = `option-${row.name}`, help = element('p', { id: `${id}-help`, className: 'hint', textContent: `${row.help}.` });
    const output = element('output', { htmlFor: id });
    input.id = id;
    input.setAttribute('aria-describedby', help.id);
    if (input.type === 'range') input.classList.add('grow');
    const show = () => {
      if (input.type !== 'range') return;
      output.value = WORDS[row.name]?.[input.value] ?? input.value;
      input.setAttribute('aria-valuetext', output.value);
    };
    input.addEventListener('input', show);
    input.addEventListener('change', () => input.checkValidity() ? change() : input.reportValidity());
    show();
    this.rows.set(row.name, { row, input, show });
    const label = element('label', { htmlFor: id, textContent: titleOf(row.name) });
    const about = element('button', { type: 'button', className: 'about', textContent: '?' });
    help.hidden = true;
    about.setAttribute('aria-label', `About ${titleOf(row.name)}`);
    about.setAttribute('aria-expanded', 'false');
    about.setAttribute('aria-controls', help.id);
    about.addEventListener('click', () => {
      help.hidden = !help.hidden;
      about.setAttribute('aria-expanded', String(!help.hidden));
    });
    return element('div', { className: 'option' }, element('div', { className: 'row' }, label, input, ...(input.type === 'range' ? [output] : []), about), help);
  }

  /* Those that differ from the library's own. */
  get values() {
    const values = {};
    for (const [name, { row, input }] of this.rows) {
      const value = valueOf(row, input);
      if (value !== initialOf(row)) values[name] = value;
    }
    return values;
  }

  /* Options that are not given get the library's own values. */
  set values(given) {
    for (const [name, { row, input, show }] of this.rows) {
      const value = given[name] ?? initialOf(row);
      if (row.kind === 'flag') input.checked = value;
      else input.value = value;
      show();
    }
  }

  /* Those of a preset, "wrap=on adaptive=0.8". */
  parsed(settings) {
    return Object.fromEntries(settings.split(' ').filter(Boolean).map((setting) => setting.split('=')).map(([name, text]) => [name, this.parse(name, text)]));
  }

  /* A value out of a link, or undefined where it is none for this option. */
  parse(name, text) {
    const known = this.rows.get(name);
    if (!known) return undefined;
    const { row } = known;
    if (row.kind === 'flag') return text === 'on' ? true : text === 'off' ? false : undefined;
    if (row.kind === 'choice') return row.choices.includes(text) ? text : undefined;
    const value = Number(text);
    return text !== '' && value >= row.least && value <= row.most ? value : undefined;
  }
}

/* Options as the command line takes them. */
export const asSwitches = (options) =>
  Object.entries(options).map(([name, value]) => {
    const flag = name.replaceAll('_', '-');
    return typeof value === 'boolean' ? (value ? `--${flag}` : `--no-${flag}`) : `--${flag} ${value}`;
  });
