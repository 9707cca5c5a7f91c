// The state of the page, and the events about its changes. Every change of the scene goes to the server and comes back
// as a new document.

import * as jsonc from './jsonc.js';
import {toast} from './dom.js';

export const store = {
  tab: [...crypto.getRandomValues(new Uint8Array(8))].map(b => b.toString(16).padStart(2, '0')).join(''),
  base: location.pathname.replace(/[^/]*$/, ''),
  doc: null,        // the latest document from the server
  root: null,       // tree of the latest text that is valid JSON
  value: {},        // the value of this tree
  selection: [],    // paths of objects; the controls show the last one
  frame: 1, playing: false,
  film: {phase: 'loading', lead_in: 0, simulated: 0, notes: [], statistics: null, message: ''},
  figures: [],      // figures of frame k at index k - 1
  presets: [],
  writer: '',
};
window.tuneStore = store;  // for the tests

const listeners = new Map();
export function on(name, f) {
  for (const one of name.split(' ')) listeners.set(one, [...(listeners.get(one) ?? []), f]);
}
export function emit(name, ...all) {
  for (const f of listeners.get(name) ?? []) f(...all);
}

export async function get(what) {
  const answer = await fetch(store.base + what);
  if (!answer.ok) throw new Error(await answer.text());
  return answer.json();
}

export async function send(what, body = {}) {
  const answer = await fetch(store.base + 'api/' + what, {
    method: 'POST', headers: {'Content-Type': 'application/json', 'X-Tab': store.tab}, body: JSON.stringify(body)});
  return {status: answer.status, body: await answer.json()};
}

export const isWriter = () => store.writer === store.tab;

/**
 * Takes a document from the server. Each arrives twice, as an answer and by the event stream; older ones are ignored.
 */
export function takeDocument(doc) {
  if (store.doc && doc.revision < store.doc.revision) return;
  const before = store.doc;
  store.doc = doc;
  if (!before || before.text !== doc.text) {
    const root = jsonc.parse(doc.text);
    if (root?.type === 'object') {
      const old = store.value;
      store.root = root;
      store.value = jsonc.valueOf(root);
      store.selection = [...new Set(store.selection.map(p => moved(p, old)))];
    }
    store.textValid = root?.type === 'object';
  }
  if (!before || before.film !== doc.film || before.run !== doc.run) {
    if (!before || before.film !== doc.film) {
      store.figures = [];
      store.film = {phase: 'lead_in', lead_in: 0, simulated: 0, notes: [], statistics: null, message: '', ready: doc.ranges ?? []};
    }
    emit('film-changed');
  }
  store.selection = store.selection.filter(p => jsonc.find(store.root, p));
  emit('document', before);
}

/**
 * Returns the current path of an object of an earlier value. Named objects are found again after their list has
 * changed.
 */
function moved(path, old) {
  const [list, index] = jsonc.stepsOf(path), name = old[list]?.[index]?.name;
  if (!name || !Array.isArray(store.value[list]) || store.value[list][index]?.name === name) return path;
  const now = store.value[list].findIndex(o => o?.name === name);
  return now < 0 ? path : `/${list}/${now}`;
}

async function change(what, body) {
  const {status, body: answer} = await send(what, body);
  if (status === 200) {
    if (what === 'text') emit('text-taken', answer.version.id);
    if (answer.version) takeDocument(answer);
    return true;
  }
  if (status === 409 && answer.version) {
    takeDocument(answer);
    if (what === 'text') emit('text-refused', body);
    return false;
  }
  toast(answer.error ?? `The server answered ${status}.`, status === 423 ? {label: 'Edit here', run: () => send('write')} : null);
  if (store.doc) emit('document', store.doc);
  return false;
}

// Changes are sent one at a time. Among waiting changes of one group, only the latest is sent. A body may be a
// function, which is called when the request is sent, so it uses the document that contains all earlier changes.
let busy = false;
const waiting = [];
function enqueue(what, body) {
  if (what !== 'text' && what !== 'view') emit('flush');  // pending typed text is sent first, as a separate step
  return new Promise(done => {
    const last = waiting.at(-1);
    if (what === 'edit' && last?.what === 'edit' && body.group && last.body.group === body.group) {
      last.done(true);
      waiting.pop();
    }
    if (what === 'view' && last?.what === 'view') {  // only the latest view is sent
      last.done(true);
      body = {...waiting.pop().body, ...body};
    }
    waiting.push({what, body, done});
    drain();
  });
}
async function drain() {
  if (busy) return;
  busy = true;
  while (waiting.length) {
    const job = waiting.shift();
    try {
      const body = typeof job.body === 'function' ? job.body() : job.body;
      job.done(body ? await change(job.what, body) : false);
    } catch (error) {
      job.done(false);
      emit('lost', error);
    }
    const starts = job.what === 'edit' || job.body.camera;  // a new run
    if (dragging && starts && !store.doc.errors.length && !store.doc.ranges?.length) await firstPicture();
  }
  busy = false;
  emit('idle');
}

// A new version or camera ends the work on the previous one. During a drag, each change therefore waits until the first
// picture of the previous change is shown, so that the film follows the pointer. The wait is limited, and ends with the drag.
const kLongestWait_ms = 1000;
let dragging = false, endWait = () => {};
const firstPicture = () => new Promise(done => {
  endWait = done;
  setTimeout(done, kLongestWait_ms);
});
on('painted', () => endWait());
addEventListener('pointerdown', () => { dragging = true; }, true);
for (const end of ['pointerup', 'pointercancel']) addEventListener(end, () => { dragging = false; endWait(); }, true);

export const isIdle = () => !busy && waiting.length === 0;

/** ops: [{set: path, value: JSON text} | {remove: path}]. */
export const edit = (ops, label, paths, group = '') => enqueue('edit', {ops, label, paths, group});
/** `make` returns {ops, label, paths} for the document at the time of sending, or null. */
export const editLater = make => enqueue('edit', make);
/** `base()` is the version on which the text is based; the server refuses the text if there is a newer one. */
export const setText = (text, group, label = 'text', base = () => undefined) => enqueue('text', () => ({text, group, label, base: base()}));
export const undo = () => enqueue('undo', {});
export const redo = () => enqueue('redo', {});
export const restore = id => enqueue('restore', {id});
export const save = () => enqueue('save', {});
export const reload = () => enqueue('reload', {});
export const keepOwn = () => enqueue('keep', {});
export const pin = id => enqueue('pin', {id});
export const view = body => enqueue('view', body);

/** Sets a value in all selected objects of the same list as the one shown. */
export function setValue(path, value, label, group = '') {
  const paths = alike(path);
  return edit(paths.map(p => ({set: p, value: jsonc.toText(value, 0, 110)})), label, paths, group);
}
export function removeValue(path, label) {
  const paths = alike(path);
  return edit(paths.map(p => ({remove: p})), label, paths);
}
/** The path of the same key in every selected object of the same list. */
export function alike(path) {
  const shown = store.selection.at(-1);
  if (!shown || store.selection.length < 2 || !path.startsWith(shown + '/')) return [path];
  const list = shown.slice(0, shown.lastIndexOf('/'));
  return store.selection.filter(p => p.startsWith(list + '/')).map(p => p + path.slice(shown.length));
}

export function select(paths) {
  store.selection = paths;
  emit('selection');
}

/** The objects of a list of the scene; empty if the text has another value there. */
export const listOf = list => Array.isArray(store.value[list]) ? store.value[list] : [];

export const frameCount = () => store.doc?.scene?.frames ?? 1;
export const timeOf = frame => (store.doc?.scene?.start ?? 0) + (frame - 1) / (store.doc?.scene?.fps ?? 30);

let viewed = '';
export function reportView() {
  const now = `${store.frame} ${store.playing}`;
  if (now === viewed || !isWriter()) return;
  viewed = now;
  view({frame: store.frame, playing: store.playing});
}

/** Takes the progress of the film. */
export function takeFilm(state) {
  if (!state || state.film !== store.doc?.film) return;
  Object.assign(store.film, state);
  emit('film', state);
}

/** Opens the event stream of the server. */
export function listen(port) {
  const stream = new EventSource(`http://${location.hostname}:${port}${store.base}stream?tab=${store.tab}`);
  const kinds = {
    document: takeDocument,
    frame: f => { if (f.run >= (store.doc?.run ?? 0) && f.film === store.doc?.film) emit('frame', f); },
    other_frame: f => emit('other-frame', f),
    film: takeFilm,
    cell: c => emit('cell', c),
    writer: w => { store.writer = w.writer; emit('writer'); },
    note: n => toast(n.text, {label: 'Undo', run: undo}),
  };
  for (const [kind, take] of Object.entries(kinds)) stream.addEventListener(kind, event => take(JSON.parse(event.data)));
  stream.addEventListener('hello', async () => { emit('connected'); });
  stream.addEventListener('error', () => emit('lost'));
  addEventListener('pagehide', () => stream.close());
  return stream;
}
