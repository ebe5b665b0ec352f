/* The page: a surface, its settings, the quads that were made of them, and what they are compared with. */
import { init, Remesher } from 'quadwright';
import { asSwitches, Controls } from './controls.js';
import { memoryOfFile, memoryOfRun, memoryOfTab, refusal } from './limits.js';
import { showPlots } from './plots.js';
import { showReport } from './report.js';
import { guideOfLink, linkedGuide, Steering } from './steer.js';
import { histograms, structureOf } from './structure.js';

const SAMPLES = { bracket: 'a bracket', knot: 'a knot', dancer: 'a figure on a plinth', hand: 'a hand', star: 'a ball with spikes', sheet: 'a sheet with holes' };
const FEWEST = 20, MOST = 200000, STEPS = 1000; // of the count's slider, which is logarithmic
const LEAST_DEFAULT = 100, MOST_DEFAULT = 20000, TRIANGLES_A_QUAD = 4; // as the library chooses the count
const PAPER = { flow: 'mcf-mr' };

const $ = (id) => document.getElementById(id);
const state = {
  tables: null, controls: null, view: null,
  remesher: null, other: null, // Remeshers; of what is compared with: made when it is needed
  surface: null, // {name, file: Uint8Array or null, mesh, triangles}
  result: null, // {result, structure, options, histograms, report}
  compared: null, // likewise, or null
  kept: null, // options
  wrapsPoints: false, // whether the option wrap was set for points
  steering: null, // what is painted and drawn on the surface
  steered: new Map(), // Remesher -> version of what it was given
  tools: null, canvasOf: null, // the surface that the view shows to be drawn on
  abort: null, // of the run at work
};

/* ---- words */

function say(text) {
  $('status').textContent = text;
}

function complain(error) {
  const crashed = error.status === 'CRASHED', memory = error.status === 'MEMORY';
  const more = crashed ? ' The page goes on: change a setting or open another mesh.' : memory ? ` The command line may hold more: ${commandLine()}` : '';
  $('error').textContent = sentence(error.message) + more;
  $('error').hidden = false;
  say('');
}

const sentence = (text) => text.replace(/^./, (c) => c.toUpperCase()).replace(/[^.!?]$/, '$&.');

function forgive() {
  $('error').hidden = true;
  $('error').textContent = '';
}

/* ---- the count */

const countOf = (step) => Math.round(FEWEST * (MOST / FEWEST) ** (step / STEPS));
const stepOf = (count) => Math.round((STEPS * Math.log(Math.max(count, FEWEST) / FEWEST)) / Math.log(MOST / FEWEST));
const roundly = (count) => Number(count.toPrecision(count < 1000 ? 2 : 3)) | 0;

function setCount(count, fromSlider = false) {
  $('count-number').value = count;
  if (!fromSlider) $('count').value = stepOf(count); // else steps smaller than what is rounded would hold it fast
  $('count').setAttribute('aria-valuetext', `${count} quads`);
}

/* ---- settings */

const ofMaps = () => ($('bake').checked ? { bake: 'input', texture: Number($('texture').value) } : {});
const options = () => ({ faces: Number($('count-number').value), ...state.controls.values, ...ofMaps() });

function setMaps({ bake, texture }) {
  $('bake').checked = Boolean(bake);
  if ([...$('texture').options].some(({ value }) => value === String(texture))) $('texture').value = texture;
  $('texture-label').hidden = $('maps-hint').hidden = !bake;
}

const fileName = () => state.surface?.name ?? 'mesh.obj';
const baseName = () => fileName().replace(/\.[^.]*$/, '');

/* Of glTF the scene comes along, and of nothing else. */
const endingOf = (name) => (/\.gl(b|tf)$/i.test(name) ? 'glb' : 'obj');

const quoted = (name) => (/^[\w.-]+$/.test(name) ? name : `'${name.replaceAll("'", "'\\''")}'`);

function commandLine(given = options()) {
  const base = baseName(), files = [];
  if (state.steering?.isPainted) files.push(`--density ${quoted(`${base}-density.txt`)}`);
  if (state.steering?.guides.length) files.push(`--guides ${quoted(`${base}-guides.obj`)}`);
  return ['quadwright', quoted(fileName()), '-o', quoted(`${base}-quads.${endingOf(fileName())}`), ...asSwitches(given), ...files].join(' ');
}

function showSettings() {
  $('command').textContent = commandLine();
  const parameters = new URLSearchParams();
  if (state.surface?.sample) parameters.set('sample', state.surface.sample);
  for (const [name, value] of Object.entries(options())) parameters.set(name, typeof value === 'boolean' ? (value ? 'on' : 'off') : value);
  if (state.surface?.sample) for (const guide of state.steering?.guides ?? []) parameters.append('guide', guideOfLink(guide));
  history.replaceState(null, '', `${location.pathname}${location.search}#${parameters}`);
}

/* A link carries settings, and of a sample its guides; a file stays with the visitor, and paint is a number for each vertex. */
function whatALinkLacks() {
  const { steering, surface } = state, lacks = [];
  if (!surface?.sample) lacks.push('your file');
  if (!surface?.sample && steering?.guides.length) lacks.push('the guides drawn on it');
  if (steering?.isPainted) lacks.push('what is painted: save it as a file');
  return lacks.length ? ` It carries the settings, but not ${lacks.join(', nor ')}.` : '';
}

/* What a link says: {sample, faces, options}; what it gets wrong is left out. */
function settingsOfLink() {
  const parameters = new URLSearchParams(location.hash.slice(1)), given = {};
  for (const [name, text] of parameters) {
    const value = state.controls.parse(name, text);
    if (value !== undefined) given[name] = value;
  }
  const faces = Number(parameters.get('faces')), sample = parameters.get('sample');
  const guides = parameters.getAll('guide').map(linkedGuide).filter(Boolean);
  const maps = { bake: parameters.get('bake') === 'input', texture: Number(parameters.get('texture')) };
  return { sample: sample in SAMPLES ? sample : null, guides, maps, faces: Number.isInteger(faces) && faces >= 4 && faces <= MOST ? faces : 0, given };
}

/* ---- surfaces */

function take(name, file, mesh, more = {}) {
  const corners = mesh.indices.length, faces = mesh.faceSizes ? mesh.faceSizes.length : corners / mesh.faceSize;
  state.surface = { name, file, mesh, triangles: corners - 2 * faces, ...more };
  state.result = state.compared = null;
  state.view?.frame(mesh.positions);
  state.view?.showSurface('left', mesh);
  state.view?.showSurface('right', mesh);
  state.steering = state.view ? new Steering(state.view.placed(mesh.positions)) : null;
  state.steered.clear();
  state.canvasOf = null;
  showTool();
  for (const format of ['obj', 'ply', 'glb', 'json']) $(`save-${format}`).disabled = true;
}

async function openBytes(name, bytes, more) {
  const mesh = await state.remesher.load(bytes);
  return take(name, bytes, mesh, more);
}

/* Says to the outside that something is at work until the function has ended. */
const whileBusy = (work) => async (...rest) => {
  const { dataset } = document.documentElement;
  dataset.busy = Number(dataset.busy ?? 0) + 1;
  try {
    return await work(...rest);
  } finally {
    dataset.busy -= 1;
  }
};

/* Points are no surface before they are wrapped; a surface that is opened after points is not wrapped for them. */
function wrapPoints() {
  const { points } = state.surface.mesh;
  if (points !== state.wrapsPoints) state.controls.values = { ...state.controls.values, wrap: points };
  state.wrapsPoints = points;
}

/* Opens what `fetchBytes` gives and makes quads of it. faces: 0 for the usual number. */
const open = whileBusy(async (name, size, fetchBytes, more = {}, faces = 0) => {
  await stop();
  forgive();
  const tooLarge = refusal(name, memoryOfFile(size), `quadwright ${name} -o quads.${endingOf(name)}`);
  if (tooLarge) return complain(new Error(tooLarge));
  say(`reading ${name}`);
  try {
    await openBytes(name, await fetchBytes(), more);
  } catch (error) {
    error.message = error.message.replace(/^memory(?=[,:])/, name); // what the library calls a file that has no name
    return complain(error);
  }
  if (more.sample && state.linkedGuides?.length && state.steering) (state.steering.guides = state.linkedGuides), state.steering.version++;
  state.linkedGuides = null;
  wrapPoints();
  state.tools?.show();
  $('sample').value = more.sample ?? '';
  setCount(faces || Math.min(MOST_DEFAULT, Math.max(LEAST_DEFAULT, roundly(state.surface.triangles / TRIANGLES_A_QUAD))));
  return run();
});

const openFile = (file) => open(file.name, file.size, async () => new Uint8Array(await file.arrayBuffer()));

function openSample(sample, faces) {
  const fetchBytes = async () => {
    const response = await fetch(`./samples/${sample}.obj`);
    if (!response.ok) throw new Error(`the sample cannot be had: ${response.status} ${response.statusText}`);
    return new Uint8Array(await response.arrayBuffer());
  };
  return open(`${sample}.obj`, 0, fetchBytes, { sample }, faces);
}

/* ---- runs */

async function stop() {
  state.abort?.abort();
  while (state.abort) await state.running;
}

function showProgress(text, fraction) {
  $('progress').hidden = false;
  $('progress-text').textContent = text;
  $('bar').value = fraction;
}

const hooks = (what) => ({ signal: state.abort.signal, progress: (stage, fraction) => showProgress(`${what}: ${stage}`, fraction) });

/* Gives the remesher what is painted and drawn, if that is not what it was given last. */
async function steer(remesher) {
  const { steering } = state, version = steering?.isEmpty ? 0 : steering?.version;
  if (!steering || (state.steered.get(remesher) ?? 0) === version) return;
  await remesher.steer(givenSteering());
  state.steered.set(remesher, version);
}

const givenSteering = () => state.steering?.arguments((point) => state.view.inSurface(point)) ?? {};

/* What a result is made of, to tell whether it is the one that is wanted. */
const recipe = (given) => JSON.stringify([given, state.steering && !state.steering.isEmpty ? state.steering.version : 0]);

async function make(remesher, given, what) {
  const made = recipe(given);
  await steer(remesher);
  const result = await remesher.remesh(given, hooks(what));
  const structure = structureOf(result.quads, result.positions.length / 3);
  return { result, structure, options: given, recipe: made, histograms: histograms(result.positions, structure) };
}

/* The options of what the quads are compared with, or null where it is the input. */
function otherOptions() {
  if ($('layout').value === 'result' || $('against').value === 'input') return null;
  const { bake, texture, ...given } = $('against').value === 'paper' ? { ...options(), ...PAPER } : (state.kept ?? options());
  return given; // quads are compared, without maps
}

async function surfaceInto(remesher) {
  await remesher.load(state.surface.file);
}

async function compare() {
  const given = otherOptions();
  if (!given) {
    state.other?.close();
    state.other = state.compared = null;
    state.view?.showSurface('left', state.surface.mesh);
    state.view?.showPlane('left', state.result.result.report);
    return;
  }
  if (state.compared?.recipe === recipe(given)) return;
  if (!state.other) {
    state.other = new Remesher({ memoryLimit: memoryOfTab() });
    await surfaceInto(state.other);
  }
  state.compared = null;
  const compared = await make(state.other, given, 'to compare with');
  compared.report = await state.other.measure({ input: fileName() });
  state.compared = compared;
  state.view?.showQuads('left', state.compared.result, state.compared.structure);
}

async function work(signal) {
  const given = options(), tooLarge = refusal(fileName(), memoryOfRun(state.surface.triangles, given.faces), commandLine());
  if (tooLarge) throw new Error(tooLarge);
  const begun = performance.now();
  if (state.result?.recipe !== recipe(given)) {
    const isFirst = !state.result;
    state.result = null;
    if (isFirst && (given.fast ?? 'no') === 'no') await showDraft(given);
    state.result = await make(state.remesher, given, 'making quads');
    showResult(performance.now() - begun);
  }
  state.result.report ??= await state.remesher.measure({ input: fileName() });
  signal.throwIfAborted();
  await compare();
  showFigures();
}

/* Something to look at while the first quads of a surface are made. */
async function showDraft(given) {
  const draft = await make(state.remesher, { ...given, fast: 'draft', bake: null }, 'making a draft');
  state.view?.showQuads('right', draft.result, draft.structure);
}

function showResult(milliseconds) {
  const { result, structure } = state.result, { topology } = result.report, count = result.quads.length / 4;
  state.view?.showQuads('right', result, structure);
  for (const format of ['obj', 'ply', 'glb', 'json']) $(`save-${format}`).disabled = false;
  const { asset } = result, off = asset?.color_error === null ? '' : `, colours ${asset?.color_error.toFixed(1)} of 255`;
  const maps = asset ? ` ${asset.charts} charts; the maps' normals are ${asset.normal_error.toFixed(1)} degrees off${off}.` : '';
  const warnings = result.report.warnings.map((text) => sentence(text)).join(' ');
  const edge = topology.irregular_boundary ? ` and ${topology.irregular_boundary} on boundaries` : ''; // as the report counts them
  say(`${count} quads with ${topology.irregular} irregular vertices${edge} in ${(milliseconds / 1000).toFixed(1)}\u00a0s.${maps} ${warnings}`);
}

function showFigures() {
  if (!state.result?.report) return;
  showPlots($('plots'), state.result.histograms, state.compared?.histograms);
  showReport($('report'), state.tables.fields, state.result, state.compared);
}

const run = whileBusy(async () => {
  if (!state.surface) return;
  await stop();
  forgive();
  if (!$('count-number').checkValidity()) return $('count-number').reportValidity();
  showSettings();
  state.abort = new AbortController();
  showProgress('making quads', 0);
  const { signal } = state.abort;
  state.running = work(signal)
    .catch((error) => {
      if (signal.aborted) say('cancelled');
      else if (error.status === 'CRASHED') recover(error);
      else complain(error);
    })
    .finally(() => {
      state.abort = null;
      $('progress').hidden = true;
      showCaptions();
    });
  await state.running;
});

function recover(error) {
  state.other?.close();
  state.other = state.compared = null;
  complain(error);
}

/* ---- the picture */

/* The line between what is beside one another in the picture. */
function showDivider() {
  const { view } = state, share = view?.tool ? (view.isNarrow ? 0 : 0.5) : { wipe: $('wipe').value / 100, beside: 0.5 }[$('layout').value];
  $('divider').hidden = !share;
  $('divider').style.left = `${100 * (share ?? 0)}%`;
}

function showCaptions() {
  const drawing = Boolean(state.view?.tool), layout = drawing ? 'beside' : $('layout').value, other = { input: 'the input', paper: "the paper's flow", kept: 'settings kept' }[$('against').value];
  $('left-caption').hidden = layout === 'result' || !state.surface;
  $('right-caption').hidden = !state.surface;
  if (drawing) $('left-caption').textContent = state.tools.name === 'paint' ? 'the surface: paint here' : 'the surface: draw here';
  else $('left-caption').textContent = state.compared || $('against').value === 'input' ? other : 'the input';
  $('right-caption').textContent = state.result ? `${state.result.result.quads.length / 4} quads` : 'the input';
  $('wipe').hidden = layout !== 'wipe';
  showDivider();
  $('against-label').hidden = layout === 'result';
}

/* While the surface is drawn on, that is what the picture shows on the left. */
function showTool() {
  const { view, tools, surface, steering } = state;
  if (!tools) return;
  if (view.tool && surface && state.canvasOf !== surface) {
    view.showCanvas(surface.mesh);
    state.canvasOf = surface;
  }
  if (steering) tools.show();
  $('layout').disabled = $('against').disabled = view.tool;
  view.ask();
  showCaptions();
}

function bindTools(Tools) {
  state.tools = new Tools(state.view, {
    steering: () => state.steering,
    given: givenSteering,
    chosen: showTool,
    changed: run,
    save: (name, text) => download(`${baseName()}-${name}`, text, 'text/plain'),
  });
}

function changeLayout() {
  if (state.view) state.view.layout = $('layout').value;
  state.view?.ask();
  showCaptions();
  if (state.surface) run();
}

function bindPicture() {
  const { view } = state;
  view.layout = $('layout').value;
  $('wipe').addEventListener('input', () => {
    view.wipe = $('wipe').value / 100;
    showDivider();
    view.ask();
  });
  for (const what of ['shaded', 'maps', 'wires', 'irregular', 'base', 'plane'])
    $(what).addEventListener('change', () => {
      view.shows[what] = $(what).checked;
      view.paint();
    });
  const point = (event) => {
    if ((event.buttons && event.type === 'pointermove') || view.tool) return;
    const box = $('canvas').getBoundingClientRect();
    if ($('chord').checked) $('canvas').dataset.strip = view.showStrip(event.clientX - box.left, event.clientY - box.top);
  };
  $('canvas').addEventListener('pointermove', point);
  $('canvas').addEventListener('click', point); // touch
  $('canvas').addEventListener('pointerleave', () => view.showStrip());
  $('chord').addEventListener('change', () => view.showStrip());
}

/* ---- files out */

function download(name, bytes, type) {
  const link = document.createElement('a');
  link.href = URL.createObjectURL(new Blob([bytes], { type }));
  link.download = name;
  link.click();
  setTimeout(() => URL.revokeObjectURL(link.href), 10000);
}

async function save(format) {
  try {
    const name = `${baseName()}-quads.${format}`;
    if (format === 'json') return download(name, JSON.stringify(state.result.report, null, 2), 'application/json');
    return download(name, await state.remesher.save(format), format === 'glb' ? 'model/gltf-binary' : 'application/octet-stream');
  } catch (error) {
    return complain(error);
  }
}

/* ---- the page */

function bindFiles() {
  $('open').addEventListener('click', () => $('file').click());
  $('file').addEventListener('change', () => {
    if ($('file').files[0]) openFile($('file').files[0]);
    $('file').value = '';
  });
  const over = (event) => {
    if (![...event.dataTransfer.types].includes('Files')) return;
    event.preventDefault();
    $('drop-hint').hidden = event.type !== 'dragover';
  };
  addEventListener('dragover', over);
  addEventListener('dragleave', (event) => !event.relatedTarget && ($('drop-hint').hidden = true));
  addEventListener('drop', (event) => {
    over(event);
    if (event.dataTransfer.files[0]) openFile(event.dataTransfer.files[0]);
  });
  $('sample').append(new Option('choose', ''), ...Object.entries(SAMPLES).map(([name, text]) => new Option(text, name)));
  $('sample').addEventListener('change', () => $('sample').value && openSample($('sample').value));
  for (const format of ['obj', 'ply', 'glb', 'json']) $(`save-${format}`).addEventListener('click', () => save(format));
}

function bindSettings() {
  $('count').addEventListener('input', () => setCount(roundly(countOf(Number($('count').value))), true));
  $('count').addEventListener('change', run);
  $('count-number').addEventListener('change', () => {
    setCount(Number($('count-number').value));
    run();
  });
  $('run').addEventListener('click', run);
  $('cancel').addEventListener('click', () => state.abort?.abort());
  for (const name of ['bake', 'texture'])
    $(name).addEventListener('change', () => {
      setMaps({ bake: $('bake').checked, texture: $('texture').value });
      run();
    });
  $('preset').addEventListener('change', () => {
    const preset = state.tables.presets.find(({ name }) => name === $('preset').value);
    state.controls.values = { wrap: state.wrapsPoints, ...state.controls.parsed(preset?.settings ?? '') };
    $('preset-help').textContent = preset?.help ?? '';
    run();
  });
  $('reset').addEventListener('click', () => {
    $('preset').value = $('preset-help').textContent = '';
    state.controls.values = { wrap: state.wrapsPoints };
    setMaps({});
    run();
  });
  $('keep').addEventListener('click', () => {
    state.kept = options();
    $('against').value = 'kept';
    if ($('layout').value === 'result') $('layout').value = 'wipe';
    say(`kept: ${asSwitches(state.kept).join(' ')}`);
    changeLayout();
  });
  $('layout').addEventListener('change', changeLayout);
  $('against').addEventListener('change', changeLayout);
  $('link').addEventListener('click', async () => {
    showSettings();
    let where = 'clipboard';
    try {
      await navigator.clipboard.writeText(location.href);
    } catch {
      where = 'address bar';
    }
    say(`The link is in the ${where}.${whatALinkLacks()}`);
  });
}

async function startPicture() {
  try {
    const [{ View }, { Tools }] = await Promise.all([import('./view.js'), import('./tools.js')]);
    state.view = new View($('canvas'));
    bindPicture();
    bindTools(Tools);
  } catch (error) {
    complain(new Error(`there is no picture, as the browser gives no WebGL (${error.message}); quads can be made and saved all the same`));
  }
}

async function startSettings() {
  state.tables = await init();
  state.controls = new Controls(state.tables.options, $('options'), $('more-options'), run);
  $('preset').append(...state.tables.presets.map(({ name }) => new Option(name)));
  state.remesher = new Remesher({ memoryLimit: memoryOfTab() });
}

async function start() {
  bindFiles();
  bindSettings();
  await Promise.all([startSettings(), startPicture()]);
  document.documentElement.dataset.ready = Math.round(performance.now());
  const link = settingsOfLink();
  state.controls.values = link.given;
  setMaps(link.maps);
  if ('serviceWorker' in navigator && import.meta.env.PROD) navigator.serviceWorker.register('./sw.js');
  state.linkedGuides = link.guides;
  await openSample(link.sample ?? 'bracket', link.faces);
}

addEventListener('unhandledrejection', (event) => complain(event.reason ?? new Error('something failed')));
start().catch(complain);
