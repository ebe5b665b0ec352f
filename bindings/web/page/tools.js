/* The pointer, and the keys, on the surface: painting a density and drawing guides. */
import { densityText, guidesText } from './steer.js';

const SPACING = 1 / 60; // of points that are put between two clicks, in the picture's frame
const CLICK = 4; // CSS pixels that a click may move

const $ = (id) => document.getElementById(id);

/* hooks: steering() gives the Steering, or null; changed() is called after a stroke; save(name, text) saves a file. */
export class Tools {
  constructor(view, hooks) {
    this.view = view;
    this.hooks = hooks;
    this.canvas = view.canvas;
    this.name = 'turn';
    this.stroke = null; // where the pointer went down on the surface, while it is down
    for (const input of document.querySelectorAll('input[name=tool]')) input.addEventListener('change', () => this.choose(input.value));
    // before the camera's own listeners, which must not turn what is painted on
    this.canvas.addEventListener('pointerdown', (event) => this.down(event), { capture: true });
    this.canvas.addEventListener('pointermove', (event) => this.move(event));
    for (const type of ['pointerup', 'pointercancel']) this.canvas.addEventListener(type, (event) => this.up(event));
    this.canvas.addEventListener('keydown', (event) => this.key(event), { capture: true });
    for (const type of ['focus', 'blur', 'keydown', 'pointerdown']) this.canvas.addEventListener(type, (event) => this.showCross(event.type));
    this.bindPanel();
  }

  get steering() {
    return this.hooks.steering();
  }

  get value() {
    return 2 ** Number($('value').value);
  }

  bindPanel() {
    $('brush').addEventListener('input', () => $('brush').setAttribute('aria-valuetext', `${$('brush').value} % of the surface`));
    const words = () => {
      const x = this.value, text = x === 1 ? 'as usual' : x > 1 ? `${Number(x.toFixed(1))} times smaller` : `${Number((1 / x).toFixed(1))} times larger`;
      $('value-text').value = text;
      $('value').setAttribute('aria-valuetext', text);
    };
    $('value').addEventListener('input', words);
    words();
    const act = (id, what) => $(id).addEventListener('click', () => {
      if (!this.steering) return;
      what(this.steering);
      this.show();
      this.hooks.changed();
    });
    act('clear-density', (steering) => steering.clearDensity());
    act('undo-guide', (steering) => steering.undo());
    act('clear-guides', (steering) => steering.clearGuides());
    $('save-density').addEventListener('click', () => this.hooks.save('density.txt', densityText(this.steering.density)));
    $('save-guides').addEventListener('click', () => this.hooks.save('guides.obj', guidesText(this.hooks.given().guides ?? [])));
  }

  choose(name) {
    this.finishGuide();
    this.name = name;
    this.canvas.dataset.tool = name;
    this.view.tool = name !== 'turn';
    $('paint-tools').hidden = name !== 'paint';
    $('guide-tools').hidden = name !== 'guide';
    this.hooks.chosen(name);
    this.show();
    this.showCross('blur');
  }

  /* All that is painted and drawn, and what is said of it. */
  show() {
    const { steering } = this;
    if (!steering) return;
    if (this.view.tool) this.view.showDensity(steering.density);
    this.view.showGuides(steering.guides, steering.draft);
    const painted = steering.isPainted ? `densities from ${Number(Math.min(...steering.density).toFixed(2))} to ${Number(Math.max(...steering.density).toFixed(2))}` : 'nothing';
    const guides = steering.guides.length ? `${steering.guides.length}` : 'none';
    const how = {
      turn: '',
      paint: ' Drag on the surface on the left; beside it the drag turns. Keys: arrows turn, the space bar paints in the middle.',
      guide: ' Drag along the surface on the left, or click point after point and press Enter; one that ends where it began is a loop. Keys: arrows turn, the space bar sets a point in the middle.',
    }[this.name];
    $('steer-hint').textContent = `Painted: ${painted}. Guides: ${guides}.${how}`;
  }

  /* ---- one touch */

  paintAt(hit) {
    this.steering.paint(hit.point, Number($('brush').value) / 100, this.value, hit.corners);
    this.view.showDensity(this.steering.density);
  }

  addPoint(hit) {
    const { steering } = this;
    const last = steering.draft?.points.at(-1), between = last && this.view.trace(last, hit.point, SPACING);
    if (last && !between) steering.end(); // over a hole, or to what lies behind: another guide begins
    if (!steering.draft) steering.begin($('kind').value === 'rings' ? 'loop' : $('kind').value, $('kind').value === 'rings' ? Number($('rings').value) : 0);
    for (const point of between ?? []) steering.add(point);
    steering.add(hit.point);
    this.view.showGuides(steering.guides, steering.draft);
  }

  finishGuide() {
    if (!this.steering?.draft) return;
    this.steering.end();
    this.show();
    this.hooks.changed();
  }

  finishPaint() {
    this.steering.version++;
    this.show();
    this.hooks.changed();
  }

  /* ---- the pointer */

  hitOf(event) {
    const box = this.canvas.getBoundingClientRect();
    return this.view.pickSurface(event.clientX - box.left, event.clientY - box.top);
  }

  down(event) {
    if (this.name === 'turn' || !this.steering || event.button !== 0 || this.stroke) return;
    const hit = this.hitOf(event);
    this.view.controls.enabled = !hit;
    if (!hit) return;
    this.canvas.setPointerCapture(event.pointerId);
    this.stroke = { x: event.clientX, y: event.clientY, dragged: false, continues: Boolean(this.steering.draft) };
    if (this.name === 'paint') this.paintAt(hit);
    else this.addPoint(hit);
  }

  move(event) {
    if (!this.stroke) return;
    if (Math.hypot(event.clientX - this.stroke.x, event.clientY - this.stroke.y) > CLICK) this.stroke.dragged = true;
    const hit = this.stroke.dragged && this.hitOf(event);
    if (!hit) return;
    if (this.name === 'paint') this.paintAt(hit);
    else this.addPoint(hit);
  }

  up() {
    this.view.controls.enabled = true;
    if (!this.stroke) return;
    const { dragged } = this.stroke;
    this.stroke = null;
    if (this.name === 'paint') this.finishPaint();
    else if (dragged) this.finishGuide(); // drawn in one go; clicks go on until Enter
  }

  /* ---- the keys */

  key(event) {
    if (this.name === 'turn' || !this.steering) return;
    const middle = event.key === ' ' && this.view.middle(), hit = middle && this.view.pickSurface(...middle);
    const known = [' ', 'Enter', 'Escape', 'Backspace'].includes(event.key);
    if (!known) return;
    event.preventDefault();
    if (event.key === ' ' && hit && this.name === 'paint') this.paintAt(hit), this.finishPaint();
    if (event.key === ' ' && hit && this.name === 'guide') this.addPoint(hit);
    if (event.key === 'Enter') this.finishGuide();
    if (event.key === 'Escape' || event.key === 'Backspace') {
      if (this.name !== 'guide') return;
      const had = !this.steering.draft;
      this.steering.undo();
      this.show();
      if (had) this.hooks.changed();
    }
  }

  /* Where the space bar works, while keys are used. */
  showCross(type) {
    const middle = this.name !== 'turn' && ['focus', 'keydown'].includes(type) && this.view.middle();
    $('cross').hidden = !middle;
    if (middle) [$('cross').style.left, $('cross').style.top] = middle.map((x) => `${x}px`);
  }
}
