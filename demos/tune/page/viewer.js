// The film: the picture on the canvas, playback, and comparison with a pinned version.

import {byId, el, clamp, drag, oncePerFrame} from './dom.js';
import {store, on, emit, reportView, frameCount, timeOf} from './store.js';
import {picture, load, forget} from './frames.js';

const canvas = byId('film'), pen = canvas.getContext('2d');
let have = new Uint8Array(2);         // frames of which the server has a draft, by number
let havePinned = new Uint8Array(2);
let film = '', shown = {film: '', frame: -1, detail: ''}, wantedBetter = null;
let compare = 'off', wipeAt = 0.5, turn = false;
let latest = null, latestA = null;    // pictures that are on the canvas
export const view = {camera: null, shownFrame: 0};

export const hasFrame = f => have[f] === 1;
export const availability = () => have;

function mark(array, ranges) {
  for (const [a, b] of ranges ?? []) array.fill(1, a, b + 1);
  return array;
}

on('document', before => {
  const doc = store.doc;
  if (!doc.scene) return;
  if (doc.film !== film || have.length !== frameCount() + 1) {
    if (doc.film !== film) wantedBetter = null;
    film = doc.film;
    have = new Uint8Array(frameCount() + 1);
    canvas.parentElement.classList.add('stale');
  }
  mark(have, doc.ranges);
  store.frame = clamp(store.frame, 1, frameCount());
  if (before?.pinned?.film !== doc.pinned?.film) pinnedChanged();
  mark(havePinned, doc.pinned?.ranges);
  present();
  emit('playhead');
});

function pinnedChanged() {
  havePinned = new Uint8Array((store.doc.pinned?.frames ?? 1) + 1);
  latestA = null;
  compare = store.doc.pinned ? compare === 'off' ? 'wipe' : compare : 'off';
  drawCompareTools();
}

on('frame', event => {
  if (event.film !== film) return;
  if (event.frame > 0 && event.detail === 'draft') {
    mark(have, event.ranges);
    if (event.figures) store.figures[event.frame - 1] = {...event.figures, draw_ms: event.draw_ms};
    emit('figures');
  }
  if (event.frame === 0) { forget(film, 0, 'draft'); if (!hasFrame(store.frame)) glimpse(0, event.time); return; }
  if (event.frame === store.frame) {
    if (event.detail !== 'draft') wantedBetter = event.detail;
    present();
  } else if (!hasFrame(store.frame) && event.frame < store.frame) glimpse(event.frame, event.time);
});
on('other-frame', event => {
  if (event.film !== store.doc?.pinned?.film) return;
  mark(havePinned, event.ranges);
  if (event.frame === store.frame) present();
});

let glimpsing = false, nextGlimpse = null;
/** Shows an intermediate frame until the requested one is available, if the page is not busy. */
async function glimpse(frame, time) {
  if (glimpsing) { nextGlimpse = [frame, time]; return; }
  glimpsing = true;
  const of = film, found = await picture(of, frame, 'draft').catch(() => null);
  if (found && of === film && !hasFrame(store.frame)) {
    paint(found, frame, 'draft');
    badge(frame === 0 ? `${time.toFixed(2)} s, before frame 1` : `frame ${frame}`);
  }
  glimpsing = false;
  if (nextGlimpse) { const next = nextGlimpse; nextGlimpse = null; glimpse(...next); }
}

function badge(text) {
  byId('badge').textContent = text;
}

let presenting = false, again = false;
/** Draws the frame at the playhead. */
export async function present() {
  if (presenting) { again = true; return; }
  presenting = true;
  do {
    again = false;
    await presentOnce().catch(() => {});
  } while (again);
  presenting = false;
}
async function presentOnce() {
  const frame = store.frame, of = film;
  if (!of) return;
  if (compare !== 'off' && store.doc.pinned) {
    const other = Math.min(frame, store.doc.pinned.frames);
    if (havePinned[other]) latestA = await picture(store.doc.pinned.film, other, 'draft') ?? latestA;
  }
  if (!hasFrame(frame)) { repaint(); return; }
  const detail = !store.playing && wantedBetter ? wantedBetter : 'draft';
  if (shown.film === of && shown.frame === frame && shown.detail === detail && compare === 'off') return;
  let found = await picture(of, frame, detail);
  if (of !== film || frame !== store.frame) { again = true; return; }
  if (!found) { have[frame] = 0; return; }
  paint(found, frame, detail);
  badge('');
}

function paint(found, frame, detail) {
  latest = found;
  shown = {film, frame, detail};
  view.camera = found.camera ?? view.camera;
  view.shownFrame = frame;
  byId('waiting').hidden = true;
  canvas.parentElement.classList.remove('stale');
  canvas.dataset.detail = detail;
  canvas.dataset.frame = frame;
  canvas.dataset.film = film;
  repaint();
  emit('painted');
}

function repaint() {
  if (!latest) return;
  const b = latest.bitmap;
  if (b.width === 0) { latest = null; shown.frame = -1; present(); return; }  // the cache has closed the bitmap
  const size = compare === 'side' ? [b.width * 2, b.height] : [b.width, b.height];
  if (canvas.width !== size[0] || canvas.height !== size[1]) { [canvas.width, canvas.height] = size; fit(); }
  const a = compare !== 'off' && latestA?.bitmap.width ? latestA.bitmap : null;
  pen.drawImage(b, compare === 'side' ? b.width : 0, 0);
  if (!a) return;
  if (compare === 'side') pen.drawImage(a, 0, 0, b.width, b.height);
  if (compare === 'turns' && turn) pen.drawImage(a, 0, 0, b.width, b.height);
  if (compare === 'wipe') {
    const x = wipeAt * b.width;
    pen.save();
    pen.beginPath();
    pen.rect(0, 0, x, b.height);
    pen.clip();
    pen.drawImage(a, 0, 0, b.width, b.height);
    pen.restore();
  }
}

/** Fits the picture into the available space. */
export function fit() {
  const stage = byId('stage'), room = stage.getBoundingClientRect(), shape = canvas.width / canvas.height;
  const width = Math.min(room.width, room.height * shape);
  canvas.style.width = Math.floor(width) + 'px';
  canvas.style.height = Math.floor(width / shape) + 'px';
  const box = canvas.getBoundingClientRect(), marks = byId('marks'), wipe = byId('wipe');
  for (const over of [marks]) Object.assign(over.style, {left: box.left - room.left + 'px', top: box.top - room.top + 'px', width: box.width + 'px', height: box.height + 'px'});
  Object.assign(wipe.style, {left: box.left - room.left + wipeAt * box.width + 'px', top: box.top - room.top + 'px', height: box.height + 'px'});
  wipe.hidden = compare !== 'wipe';
  emit('painted');
}
new ResizeObserver(() => fit()).observe(byId('stage'));

byId('wipe').addEventListener('pointerdown', event => {
  event.stopPropagation();
  drag(event, e => {
    const box = canvas.getBoundingClientRect();
    wipeAt = clamp((e.clientX - box.left) / box.width, 0, 1);
    fit();
    repaint();
  });
});

export function setCompare(mode) {
  compare = mode;
  shown.frame = -1;
  drawCompareTools();
  fit();
  present();
}
export const comparing = () => compare;
function drawCompareTools() {
  const box = byId('compare-tools'), pinned = store.doc?.pinned;
  box.hidden = !pinned;
  byId('pin').textContent = pinned ? 'Unpin A' : 'Pin as A';
  if (!pinned) { compare = 'off'; fit(); return; }
  const choice = (mode, text) => el('button', {class: 'choice' + (compare === mode ? ' on' : ''), 'data-mode': mode, onclick: () => setCompare(mode)}, text);
  box.replaceChildren(el('span', {class: 'ab'}, compare === 'turns' ? (turn ? 'A' : 'B') : 'A | B'), choice('off', 'B only'), choice('wipe', 'Wipe'), choice('side', 'Side by side'), choice('turns', 'Alternate'));
  fit();
}
setInterval(() => {
  if (compare !== 'turns') return;
  turn = !turn;
  repaint();
  const label = byId('compare-tools').querySelector('.ab');
  if (label) label.textContent = turn ? 'A' : 'B';
}, 700);

// --- Time ---

export function seek(frame, keepPlaying = false) {
  const next = clamp(Math.round(frame), 1, frameCount());
  if (!keepPlaying && store.playing) setPlaying(false);
  if (next !== store.frame) { store.frame = next; wantedBetter = null; }
  present();
  emit('playhead');
  report();
}
const report = oncePerFrame(() => reportView());

let started = 0, startFrame = 1;
export function setPlaying(playing) {
  if (playing === store.playing) return;
  store.playing = playing;
  byId('play').textContent = playing ? '❚❚' : '▶';
  byId('play').setAttribute('aria-label', playing ? 'Pause' : 'Play');
  if (playing) {
    if (store.frame >= frameCount()) store.frame = 1;
    started = performance.now();
    startFrame = store.frame;
    requestAnimationFrame(tick);
  } else present();
  emit('playhead');
  report();
}
/** Plays the film; waits for frames that are not available yet. */
function tick(now) {
  if (!store.playing) return;
  const due = startFrame + Math.floor((now - started) / 1000 * (store.doc?.scene?.fps ?? 30));
  let next = store.frame;
  while (next < due && next < frameCount() && hasFrame(next + 1)) next++;
  if (next < Math.min(due, frameCount())) { started = now; startFrame = next; }
  if (next !== store.frame) { store.frame = next; wantedBetter = null; present(); emit('playhead'); }
  for (let f = next + 1; f < next + 6 && hasFrame(f); f++) load(film, f, 'draft').catch(() => {});
  if (next >= frameCount() && due > frameCount() + 3) { store.frame = startFrame = 1; started = now; }
  requestAnimationFrame(tick);
}

on('film', () => { if (store.film.phase === 'failed') badge(''); });
on('playhead', () => {
  byId('time').textContent = `${timeOf(store.frame).toFixed(2)} s   ${store.frame} / ${frameCount()}`;
});
