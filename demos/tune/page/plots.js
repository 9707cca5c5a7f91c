// Plots of figures over the film's time, and facts about the run.

import {byId, el, clamp, oncePerFrame, atMostEvery, fitCanvas, toast} from './dom.js';
import {find} from './jsonc.js';
import {store, on, emit, get, setValue, frameCount, timeOf, isWriter} from './store.js';
import {seek} from './viewer.js';
import {reveal} from './controls.js';
import {objectPaths, nameOf} from './tree.js';

const kPlots = [
  {name: 'Particles', lines: [{of: f => f.particles, colour: '--plot1'}], digits: 0},
  {name: 'Contacts', lines: [{of: f => f.contacts, colour: '--plot2'}], digits: 0},
  {name: 'Energy', unit: 'J', lines: [{of: f => f.energy?.[0], colour: '--plot1', name: 'kinetic'}, {of: f => f.energy?.[1], colour: '--plot2', name: 'potential'}, {of: f => f.energy?.[2], colour: '--plot3', name: 'elastic'}], digits: 3},
  {name: 'Time per frame', unit: 'ms', lines: [{of: f => f.sim_ms, colour: '--plot1', name: 'simulate'}, {of: f => f.draw_ms, colour: '--plot2', name: 'draw'}], digits: 1},
];

const boxes = kPlots.map(plot => {
  const canvas = el('canvas', {'aria-label': `${plot.name} over time`, role: 'img'}), value = el('span', {class: 'value'});
  const names = plot.lines.filter(l => l.name).map(l => el('span', {class: 'legend', style: `--c:var(${l.colour})`}, l.name));
  const box = el('figure', {}, el('figcaption', {}, el('span', {}, plot.name), names, value), canvas);
  const at = e => { const r = canvas.getBoundingClientRect(); seek(clamp((e.clientX - r.left) / r.width, 0, 1) * (frameCount() - 1) + 1); };
  canvas.addEventListener('pointerdown', e => { at(e); canvas.setPointerCapture(e.pointerId); canvas.onpointermove = at; canvas.onpointerup = () => { canvas.onpointermove = null; }; });
  byId('plots').append(box);
  return {plot, canvas, value};
});

function short(x, digits) {
  if (x === undefined || x === null) return '–';
  const size = Math.abs(x);
  if (size >= 1e6) return (x / 1e6).toFixed(2) + ' M';
  if (size >= 1e4) return (x / 1e3).toFixed(1) + ' k';
  return digits === 0 ? String(x) : digits === 1 ? x.toFixed(1) : Number(x.toPrecision(3)).toString();
}

const draw = oncePerFrame(() => {
  const style = getComputedStyle(document.documentElement), ratio = devicePixelRatio || 1, n = frameCount();
  for (const {plot, canvas, value} of boxes) {
    const size = canvas.getBoundingClientRect();
    if (!size.width) continue;
    fitCanvas(canvas, size);
    const pen = canvas.getContext('2d'), w = canvas.width, h = canvas.height;
    const series = plot.lines.map(l => store.figures.map(f => f && l.of(f)));
    const all = series.flat().filter(Number.isFinite);
    const low = Math.min(0, ...all), high = Math.max(low + 1e-9, ...all);
    pen.lineWidth = 1.4 * ratio;
    series.forEach((values, i) => {
      pen.strokeStyle = style.getPropertyValue(plot.lines[i].colour);
      pen.beginPath();
      let up = true;
      values.forEach((y, f) => {
        if (!Number.isFinite(y)) { up = true; return; }
        const px = n > 1 ? f / (n - 1) * w : 0, py = h - 2 - (y - low) / (high - low) * (h - 6);
        up ? pen.moveTo(px, py) : pen.lineTo(px, py);
        up = false;
      });
      pen.stroke();
    });
    const x = n > 1 ? (store.frame - 1) / (n - 1) * w : 0;
    pen.fillStyle = style.getPropertyValue('--accent');
    pen.fillRect(x - ratio / 2, 0, ratio, h);
    const now = store.figures[store.frame - 1];
    value.textContent = now ? plot.lines.map(l => short(l.of(now), plot.digits)).join(' / ') + (plot.unit ? ' ' + plot.unit : '') : '–';
  }
});

/** Returns the path of the object that a message names in quotes. */
function objectIn(text) {
  const name = /'([^']+)'/.exec(text)?.[1];
  return name && objectPaths().find(p => nameOf(p) === name || name.startsWith(nameOf(p) + '_') || name.startsWith(nameOf(p) + '/'));
}

/** Returns the number of the line in which a value begins. */
function lineOf(path) {
  const node = find(store.root, path);
  return node ? store.doc.text.slice(0, node.start).split('\n').length : '–';
}

function drawFacts() {
  const doc = store.doc;
  if (!doc?.scene) return;
  const now = store.figures[store.frame - 1], film = store.film, last = film.statistics?.state_hash;
  const hash = (text, title) => el('code', {class: 'hash', title: `${title}: ${text}. Click to copy`, onclick: () => navigator.clipboard.writeText(text).then(() => toast('Copied.'))}, text.slice(0, 12));
  const progress = film.phase === 'complete' || last ? 'Film complete' : film.phase === 'failed' ? 'Stopped' : film.phase === 'loading' ? film.message || 'Loading' : Math.max(film.simulated, store.figures.length) ? `Simulated ${Math.max(film.simulated, store.figures.length)} of ${frameCount()}` : `Before frame 1: ${Math.round((film.lead_in ?? 0) * 100)} %`;
  const notes = [...(film.phase === 'failed' ? [{what: film.message, bad: true, path: objectIn(film.message)}] : []), ...(doc.warnings ?? []).map(w => ({what: w.what, path: w.path})), ...(film.notes ?? []).map(t => ({what: t.replace(/^(warning|note): /, ''), path: objectIn(t)}))]
    .map(n => ({...n, line: n.path && lineOf(n.path)}));
  const mine = isWriter();
  // The button comes first, so that facts whose length changes do not move it while the user aims at it.
  seedText.textContent = `Seed ${doc.scene.seed} `;
  seedButton.disabled = !mine;
  const parts = [
    seedFact,
    fact('progress', progress, () => el('span', {class: 'fact', id: 'progress'}, progress)),
    now && fact('state', store.frame + now.state, () => el('span', {class: 'fact'}, 'State ', hash(now.state, `state of frame ${store.frame}`))),
    last && fact('last', last, () => el('span', {class: 'fact', id: 'final-state', 'data-hash': last}, 'Final state ', hash(last, 'state after the last frame, as `offstage simulate` prints it'))),
    film.statistics && fact('statistics', '', () => el('button', {class: 'quiet', onclick: event => showStatistics(event.currentTarget)}, 'Statistics')),
  ];
  keepIn(factsLine, parts.filter(Boolean));
  keepIn(byId('facts'), [factsLine, notes.length ? fact('notes', JSON.stringify(notes), () => el('ul', {class: 'notes'}, notes.map(noteItem))) : null].filter(Boolean));
}
const factsLine = el('div', {class: 'facts-line'});
const seedText = el('span', {});
const seedButton = el('button', {class: 'quiet', id: 'new-seed', title: 'Use another random seed', onclick: () => setValue('/world/seed', Math.floor(Math.random() * 1e6) + 1, 'new seed')}, 'New seed');
const seedFact = el('span', {class: 'fact'}, seedText, seedButton);
const noteItem = n => el('li', {class: n.bad ? 'bad' : ''}, n.path ? el('button', {class: 'problem', title: 'Show it in the controls and in the text', onclick: () => { reveal(n.path); emit('show-text', n.path); }}, el('span', {class: 'where'}, `line ${n.line}`), n.what) : n.what);

// A fact is rebuilt only when it changes. If a button were replaced between press and release, the click would be lost.
const made = new Map();
function fact(key, signature, make) {
  if (made.get(key)?.signature !== signature) made.set(key, {signature, element: make()});
  return made.get(key).element;
}
/** Sets the children of a box; children that are already there are not moved. */
function keepIn(box, children) {
  for (const child of [...box.children]) if (!children.includes(child)) child.remove();
  children.forEach((child, i) => { if (box.children[i] !== child) box.insertBefore(child, box.children[i] ?? null); });
}

async function showStatistics(anchor) {
  const {popover} = await import('./dom.js');
  const rows = [], walk = (value, name) => {
    if (value && typeof value === 'object' && !Array.isArray(value)) for (const [k, v] of Object.entries(value)) walk(v, name ? `${name}.${k}` : k);
    else rows.push(el('tr', {}, el('td', {}, name), el('td', {}, Array.isArray(value) ? value.join(', ') || '–' : typeof value === 'number' ? short(value, 3) : String(value))));
  };
  walk(store.film.statistics, '');
  popover(anchor, 'Statistics of the whole film', el('div', {class: 'scroll'}, el('table', {class: 'statistics'}, rows)), true);
}

const redraw = oncePerFrame(() => { draw(); drawFacts(); });
on('playhead film document', redraw);
on('figures', atMostEvery(300, redraw));
new ResizeObserver(draw).observe(byId('plots'));
matchMedia('(prefers-color-scheme: dark)').addEventListener('change', draw);

// A tab that was too slow to receive some frames loads their figures together.
on('film', () => {
  const known = store.figures.filter(Boolean).length;
  if (store.film.simulated > known + 20 || store.film.phase === 'complete' && store.film.simulated > known) loadFigures().catch(() => {});
});

/** Loads the figures of frames that were drawn before this page was opened. */
export async function loadFigures() {
  for (const f of await get('api/figures')) store.figures[f.frame - 1] = {...f, draw_ms: store.figures[f.frame - 1]?.draw_ms};
  redraw();
}
