/* The other half of module.c: what the module imports, and sessions on what it exports. Everything runs on the calling
 * thread; worker.js calls it in a Worker. */

const STDOUT = 1, STDERR = 2;
const WASI_SUCCESS = 0, WASI_BADF = 8;
const NO_SUCH_CALL = -52; // -ENOSYS of emscripten's C library
const MODE_IN_STAT = 12, REGULAR_FILE = 0o100600; // bytes into `struct stat`, which begins with 4 + 4 + 4 others; st_mode
const WARNING = 2; // qw_log_level
const PAGE = 65536, LEAST_PAGES = 256, MOST_PAGES = 65536; // of memory; the least that the module with threads begins with, and 4 GiB
const THREAD_STACK = 1 << 20; // bytes

/* A failure of the library. status: its name, as "NO_FACES"; exitCode: that of the command line tool. */
export class QuadwrightError extends Error {
  constructor(message, status, exitCode) {
    super(message);
    this.name = 'QuadwrightError';
    this.status = status;
    this.exitCode = exitCode;
  }
}

const crash = (cause) => new QuadwrightError(`the module crashed (${cause}); please report this input`, 'CRASHED', 21);

class Longjmp extends Error {}

/* What the module asks of its surroundings. There are no files: calls that want one find none. */
function makeImports(module) {
  const invoke = (index, ...rest) => {
    const { stackSave, stackRestore, setThrew, __indirect_function_table: table } = module.exports;
    const stack = stackSave();
    try {
      return table.get(index)(...rest);
    } catch (error) {
      if (!(error instanceof Longjmp)) throw error;
      stackRestore(stack);
      setThrew(1, 0);
    }
  };
  const write = (descriptor, vectors, count, written) => {
    if (descriptor !== STDOUT && descriptor !== STDERR) return WASI_BADF;
    let total = 0;
    const view = new DataView(module.memory.buffer);
    for (let i = 0; i < count; i++) {
      const at = view.getUint32(vectors + 8 * i, true), size = view.getUint32(vectors + 8 * i + 4, true);
      module.take(descriptor, new Uint8Array(module.memory.buffer, at, size).slice());
      total += size;
    }
    view.setUint32(written, total, true);
    return WASI_SUCCESS;
  };
  const known = {
    progress: (stage, fraction) => (module.progress(stage, fraction) ? 1 : 0),
    note: (level, text) => module.note(level, module.text(text)),
    fd_write: write,
    __syscall_fstat64: (descriptor, stat) => {
      new DataView(module.memory.buffer).setUint32(stat + MODE_IN_STAT, REGULAR_FILE, true);
      return WASI_SUCCESS;
    },
    clock_time_get: (clock, precision, at) => {
      new DataView(module.memory.buffer).setBigUint64(at, BigInt(Math.round(performance.now() * 1e6)), true);
      return WASI_SUCCESS;
    },
    proc_exit: (code) => {
      throw crash(`exit ${code}`);
    },
    emscripten_notify_memory_growth: () => {},
    /* the rest is of the module with threads */
    emscripten_get_now: () => performance.now(),
    clock_gettime: (clock, at) => {
      const now = clock === 0 ? Date.now() : performance.now(), view = new DataView(module.memory.buffer);
      view.setInt32(at, now / 1000, true), view.setInt32(at + 4, (now % 1000) * 1e6, true);
      return 0;
    },
    emscripten_memcpy_big: (to, from, size) => void new Uint8Array(module.memory.buffer).copyWithin(to >>> 0, from >>> 0, (from >>> 0) + (size >>> 0)),
    emscripten_resize_heap: (size) => module.grow(size >>> 0),
    __emscripten_init_main_thread_js: (block) => module.exports._emscripten_thread_init(block, 0, 1, 1, 0),
    abort: () => {
      throw crash('abort');
    },
    setTempRet0: (value) => void (module.high = value),
    getTempRet0: () => module.high,
    _emscripten_throw_longjmp: () => {
      throw new Longjmp();
    },
  };
  const importOf = ({ module: from, name }) =>
    known[name] ?? (name.startsWith('invoke_') ? invoke : () => (from === 'env' ? NO_SUCH_CALL : WASI_BADF));
  return (list) => {
    const imports = {};
    for (const entry of list) (imports[entry.module] ??= {})[entry.name] = importOf(entry);
    return imports;
  };
}

const encoder = new TextEncoder(), decoder = new TextDecoder();

const DOMAINS = ['vertex', 'corner', 'face'], KINDS = ['values', 'normals', 'uvs', 'weights', 'labels'];
const OPTION_KINDS = ['count', 'real', 'flag', 'choice'];
const GUIDES = ['direction', 'loop']; // qw_guide_kind
const FORMATS = { obj: 1, ply: 2, off: 3, stl: 4, glb: 5, gltf: 6 }; // qw_format

/* Whether a compiled module is the one with threads: its memory comes from outside. */
export const isThreaded = (compiled) => WebAssembly.Module.imports(compiled).some(({ kind }) => kind === 'memory');

/* An instance of the module. After a crash it must not be used any more. thread: {memory, block, stack} where it is one more thread of an
 * instance that runs already. */
export class Module {
  constructor(compiled, thread = null) {
    this.high = 0;
    this.progress = this.note = () => 0;
    this.written = [];
    this.threaded = isThreaded(compiled);
    const imports = makeImports(this)(WebAssembly.Module.imports(compiled));
    if (this.threaded) {
      this.memory = thread?.memory ?? new WebAssembly.Memory({ initial: LEAST_PAGES, maximum: MOST_PAGES, shared: true });
      imports.env.memory = this.memory;
    }
    this.exports = new WebAssembly.Instance(compiled, imports).exports;
    this.memory ??= this.exports.memory;
    if (thread) return this.begin(thread);
    if (this.threaded) this.exports.emscripten_tls_init();
    (this.exports._initialize ?? this.exports.__wasm_call_ctors)();
    this.tables = readTables(this);
  }

  begin({ block, stack }) {
    const e = this.exports;
    e._emscripten_thread_init(block, 0, 0, 1, 0);
    e.emscripten_stack_set_limits(stack + THREAD_STACK, stack);
    e.stackRestore(stack + THREAD_STACK);
    e.emscripten_tls_init();
  }

  /* What another Worker needs to be a thread of this instance. */
  makeThread() {
    return { memory: this.memory, block: this.exports.web_thread_block() >>> 0, stack: this.allocate(THREAD_STACK) };
  }

  /* Returns whether the memory has so many bytes then. Somewhat more are taken where they are to be had, as each step costs. */
  grow(size) {
    const now = this.memory.buffer.byteLength, pages = (bytes) => Math.min(Math.ceil((bytes - now) / PAGE), MOST_PAGES - now / PAGE);
    if (size <= now) return 1;
    if (size > MOST_PAGES * PAGE) return 0;
    for (const wanted of [Math.max(size, 1.2 * now), size])
      try {
        this.memory.grow(pages(wanted));
        return 1;
      } catch {
        continue;
      }
    return 0;
  }

  take(descriptor, bytes) {
    if (descriptor === STDOUT) this.written.push(bytes);
    else console.warn(decoder.decode(bytes));
  }

  /* The bytes that were written since the last call. */
  takeWritten() {
    const all = new Uint8Array(this.written.reduce((sum, part) => sum + part.length, 0));
    let at = 0;
    for (const part of this.written) all.set(part, at), (at += part.length);
    this.written = [];
    return all;
  }

  text(pointer) {
    if (!pointer) return null;
    const bytes = new Uint8Array(this.memory.buffer), end = bytes.indexOf(0, pointer);
    return decoder.decode(bytes.slice(pointer, end));
  }

  allocate(size) {
    const pointer = this.exports.web_alloc(size) >>> 0;
    if (pointer) return pointer;
    const { status, exitCode, text } = this.tables.statuses.find((row) => row.status === 'MEMORY');
    throw new QuadwrightError(text, status, exitCode);
  }

  /* A copy in the module's memory, which whoever takes it releases. type: that of the array there. */
  put(values, type) {
    const pointer = this.allocate(values.length * type.BYTES_PER_ELEMENT);
    new type(this.memory.buffer, pointer, values.length).set(values);
    return pointer;
  }

  putText(text) {
    return this.put(encoder.encode(`${text}\0`), Uint8Array);
  }

  copy(pointer, count, type) {
    return pointer ? new type(this.memory.buffer, pointer >>> 0, count).slice() : null;
  }

  withText(text, use) {
    const pointer = this.putText(text);
    try {
      return use(pointer);
    } finally {
      this.exports.web_free(pointer);
    }
  }
}

function readTables(m) {
  const e = m.exports, count = (n, row) => Array.from({ length: n }, (_, i) => row(i));
  const fieldsOf = (record) => {
    const rows = [];
    for (let i = 0; e.web_field_text(record, i, 0); i++)
      rows.push({
        name: m.text(e.web_field_text(record, i, 0)),
        unit: m.text(e.web_field_text(record, i, 1)),
        help: m.text(e.web_field_text(record, i, 2)),
        whole: e.web_field_number(record, i, 0) === 0,
        optional: e.web_field_number(record, i, 1) !== 0,
      });
    return rows;
  };
  const [report, topology, quality, asset] = [0, 1, 2, 3].map(fieldsOf);
  const optionAt = (i) => ({
    name: m.text(e.web_option_text(i, 0)),
    kind: OPTION_KINDS[e.web_option_number(i, 0)],
    initial: e.web_option_number(i, 1),
    least: e.web_option_number(i, 2),
    most: e.web_option_number(i, 3),
    unit: m.text(e.web_option_text(i, 1)),
    choices: m.text(e.web_option_text(i, 2))?.split('|') ?? null,
    help: m.text(e.web_option_text(i, 3)),
  });
  return {
    version: m.text(e.web_version()),
    statuses: count(e.web_status_count(), (i) => ({
      status: m.text(e.web_status_name(i)),
      text: m.text(e.web_status_text(i)),
      exitCode: e.web_status_exit_code(i),
    })),
    options: count(e.web_option_count(0), optionAt),
    assetOptions: count(e.web_option_count(1), (i) => optionAt(i + e.web_option_count(0))),
    presets: count(e.web_preset_count(), (i) => ({
      name: m.text(e.web_preset_text(i, 0)),
      settings: m.text(e.web_preset_text(i, 1)),
      help: m.text(e.web_preset_text(i, 2)),
    })),
    fields: { report, topology, quality, asset },
  };
}

/* ---- arguments */

const argument = (message) => new QuadwrightError(message, 'ARGUMENT', 2);

/* Arrays may be nested, as [[x, y, z], ...]. */
const flat = (values) => (Array.isArray(values) && values.some(Array.isArray) ? values.flat() : values);

function numbers(name, values, type) {
  if (!ArrayBuffer.isView(values) && !Array.isArray(values)) throw argument(`${name}: must be an array of numbers`);
  if (values instanceof BigInt64Array || values instanceof BigUint64Array || values instanceof DataView)
    throw argument(`${name}: must be an array of numbers`);
  if (type === Float64Array || type === Float32Array) return values;
  for (let i = 0; i < values.length; i++)
    if (!(values[i] >= 0 && values[i] <= 0xffffffff && Number.isInteger(values[i])))
      throw argument(`${name}: entry ${i} must be a whole number from 0, not ${values[i]}`);
  return values;
}

function multiple(name, values, of) {
  if (values.length % of) throw argument(`${name}: the length must be a multiple of ${of}, not ${values.length}`);
  return values;
}

/* Old names and what stands for others: attributes by what their borders are called. */
const BORDERS = { seams: 'uv', materials: 'material', groups: 'group', objects: 'object' };

/* What a progress function returns to cancel a run; anything else goes on. */
export const CANCEL = 'cancel';

let hasNoticed = false;

/* true, which cancelled before there was CANCEL, still does, with a notice. */
function cancels(answer) {
  if (answer === true && !hasNoticed) console.warn('quadwright: progress returns CANCEL to cancel; true does so for now');
  hasNoticed ||= answer === true;
  return answer === true || answer === CANCEL;
}

function optionText({ name, kind }, value) {
  if (name === 'symmetry' && Array.isArray(value)) return value.join(','); // a plane: x, y, z, offset
  if (name === 'wrap' && ['number', 'string'].includes(typeof value)) return String(value); // a share of the diagonal, or quads: '0.5q'
  const wanted = { flag: 'boolean', choice: 'string', count: 'number', real: 'number' }[kind];
  if (typeof value === 'function') throw argument(`${name}: must be a ${wanted}, not a function`);
  if (typeof value !== wanted) throw argument(`${name}: must be a ${wanted}, not ${String(value)}`);
  return kind === 'flag' ? (value ? 'on' : 'off') : String(value);
}

/* Corners of quads, and those of the polygons of the input that stayed, which come last; rest is null where all are quads. */
function parted(indices, faceSizes, stayed) {
  if (!faceSizes) return { quads: indices, rest: null };
  const count = faceSizes.length - stayed;
  return { quads: indices.slice(0, 4 * count), rest: { indices: indices.slice(4 * count), faceSizes: faceSizes.slice(count) } };
}

/* ---- sessions */

/* A surface and its results. */
export class Session {
  constructor(module, memoryLimit = 0) {
    this.module = module;
    const bytes = typeof memoryLimit === 'string' ? module.withText(memoryLimit, (text) => module.exports.web_memory_size(text)) : memoryLimit;
    if (!(bytes >= 0)) throw argument(`memoryLimit: must be a number of bytes, or a text such as "4G", not ${memoryLimit}`);
    this.pointer = module.exports.web_open(bytes) >>> 0;
    if (!this.pointer) module.allocate(0xffffffff);
  }

  close() {
    this.module.exports.web_close(this.pointer);
  }

  /* Calls an export; a status other than 0 becomes an error, a trap a crash. */
  call(name, ...rest) {
    let status;
    try {
      status = this.module.exports[name](this.pointer, ...rest);
    } catch (error) {
      throw error instanceof QuadwrightError ? error : crash(error.message);
    }
    if (status) {
      const row = this.module.tables.statuses[status];
      throw new QuadwrightError(this.module.text(this.module.exports.web_message(this.pointer)) || row.text, row.status, row.exitCode);
    }
  }

  /* Reads a file of any format that the library knows, judged by its contents. */
  takeFile(bytes) {
    this.call('web_take_file', this.module.put(bytes, Uint8Array), bytes.length);
    this.marked = false; // what a file marks counts when asked for, as in the command line tool
    return this.surface();
  }

  /* Points without faces, three numbers a point, and attributes of theirs: option wrap makes a surface of them. */
  takePoints(positions, { attributes = {} } = {}) {
    const m = this.module;
    positions = flat(positions);
    multiple('positions', numbers('positions', positions, Float64Array), 3);
    this.call('web_take_points', m.put(positions, Float64Array), positions.length / 3);
    for (const [name, attribute] of Object.entries(attributes)) this.addAttribute(name, attribute);
    this.marked = false;
    return this.surface();
  }

  takeArrays(positions, indices, { faceSize = 3, faceSizes = null, markedEdges = null, attributes = {} } = {}) {
    const m = this.module;
    positions = flat(positions);
    multiple('positions', numbers('positions', positions, Float64Array), 3);
    const corners = flat(indices) ?? Uint32Array.from({ length: positions.length / 3 }, (_, i) => i);
    numbers('indices', corners, Uint32Array);
    markedEdges = flat(markedEdges);
    if (faceSizes) numbers('faceSizes', faceSizes, Uint32Array);
    if (markedEdges) multiple('markedEdges', numbers('markedEdges', markedEdges, Uint32Array), 2);
    if (faceSizes && faceSizes.reduce((sum, size) => sum + size, 0) !== corners.length)
      throw argument('faceSizes: the sizes do not sum to the number of indices');
    if (!faceSizes && faceSize !== 3 && faceSize !== 4) throw argument('faceSize: must be 3 or 4; give faceSizes for others');
    if (!faceSizes) multiple('indices', corners, faceSize);
    this.call('web_take_arrays', m.put(positions, Float64Array), positions.length / 3, m.put(corners, Uint32Array),
      faceSizes ? faceSizes.length : corners.length / faceSize, faceSize, faceSizes ? m.put(faceSizes, Uint32Array) : 0,
      markedEdges ? m.put(markedEdges, Uint32Array) : 0, markedEdges ? markedEdges.length / 2 : 0);
    for (const [name, attribute] of Object.entries(attributes)) this.addAttribute(name, attribute);
    this.marked = Boolean(markedEdges?.length);
    return this.surface();
  }

  addAttribute(name, { values, components = 1, domain = 'vertex', kind = 'values', groups = null }) {
    const m = this.module, which = [DOMAINS.indexOf(domain), KINDS.indexOf(kind)];
    if (which.includes(-1)) throw argument(`attributes: ${name} has the domain ${domain} and the kind ${kind}`);
    values = flat(values);
    groups = flat(groups);
    numbers(`attributes: ${name}`, values, Float32Array);
    const perElement = kind === 'labels' ? 1 : components;
    multiple(`attributes: ${name}`, values, perElement);
    if ((kind === 'weights') !== Boolean(groups)) throw argument(`attributes: ${name}: weights, and they alone, have groups`);
    if (groups && groups.length !== values.length) throw argument(`attributes: ${name}: as many groups as values are needed`);
    this.call('web_add_attribute', m.putText(name), ...which, perElement, values.length / perElement,
      m.put(values, kind === 'labels' ? Int32Array : Float32Array), groups ? m.put(groups, Uint32Array) : 0);
  }

  /* density: a number for each vertex; guides: [{points, kind, closed, rings}]; region: 1 or 0 for each face. What is null or missing is taken
   * away. */
  steer({ density = null, guides = null, region = null } = {}) {
    const m = this.module;
    if (density) numbers('density', density, Float32Array);
    this.call('web_set_density', density ? m.put(density, Float32Array) : 0, density?.length ?? 0);
    const heads = [], points = [];
    for (const [i, guide] of (guides ?? []).entries()) {
      const kind = GUIDES.indexOf(guide.kind ?? 'loop');
      if (kind < 0) throw argument(`guides: guide ${i} is of the kind ${guide.kind}; it must be loop or direction`);
      const path = flat(guide.points);
      multiple(`guides: points of guide ${i}`, numbers(`guides: points of guide ${i}`, path, Float64Array), 3);
      const rings = guide.rings ?? 0;
      if (!Number.isInteger(rings) || rings < 0 || rings > 1000) throw argument(`guides: guide ${i} is to have ${rings} rings; it must be a number from 0 to 1000`);
      heads.push(kind, guide.closed ? 1 : 0, path.length / 3, rings);
      for (const x of path) points.push(x);
    }
    this.call('web_set_guides', m.put(heads, Uint32Array), heads.length / 4, m.put(points, Float64Array));
    if (region) numbers('region', region, Uint8Array);
    this.call('web_set_region', region ? m.put(Uint8Array.from(region, (x) => Math.min(x, 2)), Uint8Array) : 0, region?.length ?? 0);
  }

  mark(names) {
    this.module.withText(names, (text) => this.call('web_mark', text));
  }

  mesh(ofInput) {
    const m = this.module, e = m.exports, s = this.pointer, count = e.web_vertex_count(s, ofInput) >>> 0,
      faces = e.web_face_count(s, ofInput) >>> 0, size = e.web_face_size(s, ofInput);
    const faceSizes = m.copy(e.web_face_sizes(s, ofInput), faces, Uint32Array);
    const corners = faceSizes ? faceSizes.reduce((sum, n) => sum + n, 0) : faces * size;
    return {
      positions: m.copy(e.web_positions(s, ofInput), 3 * count, Float64Array) ?? new Float64Array(),
      indices: m.copy(e.web_corners(s, ofInput), corners, Uint32Array) ?? new Uint32Array(),
      faceSize: size,
      faceSizes,
    };
  }

  surface() {
    return { ...this.mesh(1), points: Boolean(this.module.exports.web_is_points(this.pointer)) };
  }

  attributes(ofInput) {
    const m = this.module, e = m.exports, s = this.pointer, all = {};
    for (let i = 0; i < e.web_attribute_count(s, ofInput); i++) {
      const [domain, kind, components, count, names] = [0, 1, 2, 3, 4].map((k) => e.web_attribute_number(s, ofInput, i, k) >>> 0);
      const labels = KINDS[kind] === 'labels';
      all[m.text(e.web_attribute_name(s, ofInput, i))] = {
        values: m.copy(e.web_attribute_data(s, ofInput, i), count * components, labels ? Int32Array : Float32Array),
        components,
        domain: DOMAINS[domain],
        kind: KINDS[kind],
        ...(KINDS[kind] === 'weights' && { groups: m.copy(e.web_attribute_group(s, ofInput, i), count * components, Uint32Array) }),
        ...(names && { names: Array.from({ length: names }, (_, k) => m.text(e.web_attribute_label(s, ofInput, i, k))) }),
      };
    }
    return all;
  }

  setOptions(options) {
    const { tables, exports } = this.module;
    exports.web_reset_options(this.pointer);
    const { preset, keep, ...rest } = options;
    if (preset !== undefined && preset !== null) this.module.withText(String(preset), (n) => this.call('web_set_preset', n));
    if (keep) this.mark([keep].flat().join(',').split(',').map((word) => BORDERS[word.trim()] ?? word.trim()).join(','));
    const own = { ...(this.marked && { sharp_marks: true }), ...(keep && { keep_marks: true }) };
    for (const [name, value] of Object.entries({ ...own, ...rest })) {
      const ofAsset = tables.assetOptions.find((option) => option.name === name), row = ofAsset ?? tables.options.find((option) => option.name === name);
      if (!row && typeof value === 'function') throw argument(`there is no option or hook ${name}, which is a function; hooks are progress and log`);
      if (!row) throw argument(`there is no option ${name}`);
      if (value === undefined || value === null) continue;
      const set = ofAsset ? 'web_set_asset_option' : 'web_set_option';
      this.module.withText(name, (n) => this.module.withText(optionText(row, value), (v) => this.call(set, n, v)));
    }
  }

  /* Texture coordinates of the result's own, and maps where bake names some. */
  unwrap(bake) {
    if (!bake) return void this.call('web_unwrap', 0);
    const names = [bake].flat().join(',');
    this.module.withText(names, (text) => this.call('web_unwrap', text));
  }

  /* {name: {width, height, channels, bits, pixels}}, the upper row first; of tile 1 and so on "color.1002". */
  maps() {
    const m = this.module, e = m.exports, all = {};
    for (let i = 0; i < e.web_image_count(this.pointer); i++) {
      const [tile, width, height, channels, bits] = [0, 1, 2, 3, 4].map((k) => e.web_image_number(this.pointer, i, k) >>> 0);
      const pixels = m.copy(e.web_image_pixels(this.pointer, i), width * height * channels, bits === 16 ? Uint16Array : Uint8Array);
      all[m.text(e.web_image_name(this.pointer, i)) + (tile ? `.${1001 + tile}` : '')] = { width, height, channels, bits, pixels };
    }
    return all;
  }

  /* progress(stage, fraction) returns CANCEL to cancel. */
  run({ unwrap = false, bake = null, ...options } = {}, { progress = null, log = null } = {}) {
    const m = this.module;
    this.setOptions(options);
    if (bake) this.module.withText([bake].flat().join(','), (text) => this.call('web_check_maps', text)); // before the run, not after it
    let thrown = null; // of a hook: the module is left as it is left by a run that was cancelled, not in the middle
    const safely = (hook) => {
      try {
        return hook();
      } catch (error) {
        thrown ??= { error };
      }
    };
    m.progress = (stage, fraction) => Boolean(thrown || (progress && safely(() => cancels(progress(m.text(m.exports.web_stage_title(stage)), fraction)))) || thrown);
    m.note = log ? (level, text) => level >= WARNING && safely(() => log(text)) : () => {};
    try {
      this.call('web_run');
      this.call('web_carry');
      this.call('web_mark_filled');
      if (unwrap || bake) this.unwrap(bake);
    } catch (error) {
      throw thrown ? thrown.error : error;
    } finally {
      m.progress = m.note = () => 0;
    }
    if (thrown) throw thrown.error;
    const { positions, indices, faceSizes } = this.mesh(0), report = this.report();
    const idle = unwrap || bake ? [] : m.tables.assetOptions.filter(({ name }) => (options[name] ?? null) !== null);
    report.warnings.push(...idle.map(({ name }) => `option ${name} has no effect without unwrap or bake`));
    report.warning_count += idle.length;
    return { positions, ...parted(indices, faceSizes, report.kept_faces), report, attributes: this.attributes(0), ...this.assetOf(unwrap || bake) };
  }

  assetOf(isThere) {
    return isThere ? { asset: JSON.parse(this.module.text(this.module.exports.web_asset_report(this.pointer))), maps: this.maps() } : {};
  }

  report() {
    return JSON.parse(this.module.text(this.module.exports.web_report(this.pointer)));
  }

  /* What the command line tool writes with --json, as text. */
  measuredReport(input = null, output = null) {
    const m = this.module, pointers = [input, output].map((name) => (name === null ? 0 : m.putText(name)));
    let text;
    try {
      text = m.exports.web_measured_report(this.pointer, ...pointers);
    } catch (error) {
      throw crash(error.message);
    }
    pointers.forEach((pointer) => pointer && m.exports.web_free(pointer));
    if (!text) throw new QuadwrightError(m.text(m.exports.web_message(this.pointer)), 'INTERNAL', 21);
    return m.text(text);
  }

  /* The result as a file of the command line tool, byte for byte. format: "obj", "ply", "off", "stl", "glb" or "gltf". */
  save(format, { bare = false } = {}) {
    if (!(format in FORMATS)) throw argument(`format: must be obj, ply, off, stl, glb or gltf, not ${format}`);
    this.module.takeWritten();
    this.call('web_save', FORMATS[format], bare ? 1 : 0);
    return this.module.takeWritten();
  }
}
