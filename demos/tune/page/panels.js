// The panels of the tool bar (versions, add, overlays), and messages about the file and the server.

import {byId, el, popover, toast} from './dom.js';
import {store, on, get, emit, restore, pin, view, send, save, reload, keepOwn, setText, select, isWriter, listOf} from './store.js';
import {stepsOf} from './jsonc.js';
import * as schema from './schema.js';
import {sample} from './controls.js';
import {addTo} from './tree.js';
import {local, drawMarks} from './camera.js';

// --- Versions ---
const clock = ms => new Date(ms).toLocaleTimeString([], {hour: '2-digit', minute: '2-digit', second: '2-digit'});

export async function showVersions(anchor) {
  const list = el('div', {class: 'versions'});
  popover(anchor, 'Versions of this session', list, true);
  const all = (await get('api/versions')).reverse();
  list.append(...all.map(v => {
    const now = v.id === store.doc.version.id, picture = v.film ? el('img', {src: `${store.base}thumb/${v.film}`, alt: '', loading: 'lazy', onerror: event => event.target.replaceWith(el('span', {class: 'no-picture'}))}) : el('span', {class: 'no-picture'});
    const keys = v.paths.length > 3 ? `${v.paths.slice(0, 3).join(', ')} …` : v.paths.join(', ');
    return el('div', {class: 'version' + (now ? ' now' : ''), 'data-id': v.id}, picture,
      el('div', {class: 'what'}, el('strong', {}, v.label), el('code', {}, keys), el('small', {}, clock(v.time_ms) + (now ? ', shown' : ''))),
      el('div', {class: 'inline'}, el('button', {class: 'quiet', disabled: now, onclick: () => restore(v.id).then(() => showVersions(anchor))}, 'Go back'),
        el('button', {class: 'quiet', onclick: () => pin(v.id)}, 'Pin as A')));
  }));
}

export function togglePin() {
  pin(store.doc.pinned ? null : store.doc.version.id);
}

// --- Add ---
/** Removes the code marks from a sentence of the reference. */
const plain = text => text.replace(/`/g, '');

export function showAdd(anchor) {
  const cards = el('div', {class: 'cards'});
  const fill = () => cards.replaceChildren(...store.presets.map(p => el('button', {class: 'card', 'data-preset': p.name, title: plain(p.preset.description ?? ''), onclick: () => { close(); addTo('effects', {preset: p.name, position: [0, 0, 0]}, `add ${p.name}`); }},
    el('img', {src: `page/presets/${p.name}.jpg`, alt: '', onerror: event => event.target.replaceWith(el('span', {class: 'no-picture'}))}), el('strong', {}, p.name.replace(/_/g, ' ')), el('small', {}, plain(p.preset.description ?? '')))));
  fill();
  if (!store.presets.length) on('presets', fill);  // the list may arrive after the first click
  const objects = kNew.map(([text, list, value]) => el('button', {onclick: () => { close(); addTo(list, fresh(list, value), `add ${text.toLowerCase()}`); }}, text));
  const close = popover(anchor, 'Add', el('div', {class: 'stack'}, el('h3', {}, 'Objects'), el('div', {class: 'chips'}, objects), el('h3', {}, 'Effects from presets'), cards), true);
}
const kNew = [
  ['Emitter', 'emitters', {name: 'emitter', rate: 500, speed: {mean: 3, deviation: 0.5}, spread_deg: {mean: 10, deviation: 5}, radius: 0.02, lifespan: 3, surface: {type: 'disc', radius: 0.1}}],
  ['Ball', 'bodies', {name: 'ball', shape: {type: 'sphere', radius: 0.3}, position: [0, 2, 0]}],
  ['Box', 'bodies', {name: 'box', shape: {type: 'box', size: [0.6, 0.6, 0.6]}, position: [0, 2, 0]}],
  ['Ground', 'bodies', {name: 'ground', motion: 'static', shape: {type: 'plane'}}],
  ['Material', 'materials', {name: 'material', color: '#c8c8c8', roughness: 0.5}],
  ['Wind', 'forces', {name: 'wind', type: 'wind', velocity: [3, 0, 0]}],
  ['Sun', 'lights', {type: 'sun', direction: [0.45, 0.75, 0.5], intensity: 3}],
  ['Lamp', 'lights', {type: 'point', position: [2, 3, 2]}],
];
function fresh(list, value) {
  const object = structuredClone(value);
  const description = schema.itemOf(schema.rootKey(list)), known = schema.keysOf(schema.objectFor(description, object));
  for (const k of schema.requiredOf(schema.objectFor(description, object))) if (!(k in object) && k !== 'type') object[k] = sample(known.find(d => d.key === k));
  for (const k of Object.keys(object)) if (k !== 'type' && !known.some(d => d.key === k)) delete object[k];
  return object;
}

// --- Overlays ---
const kOverlays = [
  ['contacts', 'Contacts', 'points where bodies touch, and their normals', () => ({type: 'contacts'})],
  ['velocities', 'Velocities', 'arrows in the direction of motion', () => ({type: 'velocities'})],
  ['joints', 'Joints', 'positions of joints and their free axes', () => ({type: 'joints'})],
  ['islands', 'Islands', 'groups of bodies that touch each other', () => ({type: 'islands'})],
  ['trails', 'Trails', 'paths of bodies', () => ({type: 'trails'})],
  ['cloth', 'Strain of cloth', 'blue at rest, red where it is stretched', () => ({type: 'cloth'})],
  ['tree', 'Bounding tree', 'bounding volumes of the selected body, which must have a mesh', () => { const [list, i] = stepsOf(store.selection.at(-1) ?? ''); const b = list === 'bodies' && listOf('bodies')[i]; return b?.shape?.type === 'mesh' && b.name ? {type: 'tree', body: b.name} : null; }],
];
export function showOverlays(anchor) {
  const on_ = type => (store.doc.overlays ?? []).some(o => o.type === type);
  const toggle = (type, make, box) => {
    const others = (store.doc.overlays ?? []).filter(o => o.type !== type), made = box.checked ? make() : null;
    if (box.checked && !made) { box.checked = false; return toast('Select a body with a mesh first.'); }
    view({overlays: made ? [...others, made] : others});
  };
  const row = (id, text, help, checked, run) => { const box = el('input', {type: 'checkbox', checked, 'data-overlay': id, 'aria-label': text, onchange: () => run(box)}); return el('label', {class: 'option'}, box, el('span', {}, text, el('small', {}, help))); };
  popover(anchor, 'Overlays', el('div', {class: 'menu'}, row('emitters', 'Emitters', 'surfaces and directions of emission', local.emitters, box => { local.emitters = box.checked; drawMarks(); }),
    kOverlays.map(([type, text, help, make]) => row(type, text, help, on_(type), box => toggle(type, make, box))), el('p', {class: 'help'}, 'Overlays belong to the view. They do not change the scene.')));
}

// --- The file ---
export async function saveFile() {
  if (await save() && store.doc.saved) toast('Saved.');
}

function drawBanner() {
  const box = byId('banner'), doc = store.doc, mine = isWriter() || !store.writer;
  const shown = !mine ? 'read-only' : doc?.theirs ? 'file' : '';
  if (box.dataset.shown === shown) return;  // new buttons would lose a click in progress
  box.dataset.shown = shown;
  box.hidden = shown === '';
  if (box.hidden) return;
  if (!mine) {
    box.replaceChildren(el('span', {}, 'Another tab is editing this scene. This tab is read-only.'), el('button', {onclick: () => send('write')}, 'Edit here'));
    return;
  }
  box.replaceChildren(el('span', {}, 'Another program changed the file, and you have unsaved changes. Nothing was overwritten.'),
    el('button', {id: 'reload-theirs', title: 'Your text stays in the list of versions', onclick: reload}, 'Load the file'), el('button', {id: 'show-both', onclick: event => showBoth(event.currentTarget)}, 'Show both'),
    el('button', {id: 'keep-own', title: 'Saving will then replace the file', onclick: keepOwn}, 'Keep mine'));
}

function showBoth(anchor) {
  const mine = store.doc.text.split('\n'), theirs = store.doc.theirs.split('\n');
  const rows = diff(mine, theirs).map(([kind, a, b]) => el('tr', {class: kind}, el('td', {}, a ?? ''), el('td', {}, b ?? '')));
  popover(anchor, 'Your text and the file', el('div', {class: 'scroll'}, el('table', {class: 'both'}, el('tr', {}, el('th', {}, 'Your text'), el('th', {}, 'In the file')), rows)), true);
}
/** Returns the rows of a side-by-side comparison; equal lines are in one row. */
function diff(a, b) {
  let start = 0, end = 0;
  while (start < Math.min(a.length, b.length) && a[start] === b[start]) start++;
  while (end < Math.min(a.length, b.length) - start && a[a.length - 1 - end] === b[b.length - 1 - end]) end++;
  const rows = a.slice(Math.max(0, start - 3), start).map(l => ['same', l, l]), left = a.slice(start, a.length - end), right = b.slice(start, b.length - end);
  for (let i = 0; i < Math.max(left.length, right.length); i++) rows.push(left[i] === right[i] ? ['same', left[i], right[i]] : ['differs', left[i], right[i]]);
  return rows.concat(a.slice(a.length - end, a.length - end + 3).map(l => ['same', l, l]));
}

// --- The server ---
let lostAt = 0;
on('lost', () => {
  if (!lostAt) lostAt = Date.now();
  setTimeout(async () => {
    if (!lostAt || Date.now() - lostAt < 1200) return;
    const box = byId('gone');
    const answer = await fetch(store.base + 'api/state').catch(() => null);
    if (answer?.ok) return;
    const other = answer?.status === 403, text = (await import('./editor.js')).ownText();
    box.hidden = false;
    box.replaceChildren(el('div', {class: 'gone-box'}, el('h2', {}, other ? 'offstage was restarted' : 'offstage has stopped'),
      el('p', {}, other ? 'This page belongs to an earlier session. Open the address that `offstage tune` printed last.' : 'Start `offstage tune` again and open the address that it prints.'),
      store.doc && !store.doc.saved ? el('p', {}, 'The text has unsaved changes. ', el('button', {class: 'primary', onclick: () => navigator.clipboard.writeText(text).then(() => toast('Copied.'))}, 'Copy the text')) : null));
    keepDraft();
  }, 1300);
});
on('connected', () => { lostAt = 0; byId('gone').hidden = true; });

/** Unsaved text is kept when the server ends, and offered in the next session. */
const draftKey = () => 'offstage:' + store.file;
function keepDraft() {
  if (store.doc && !store.doc.saved) localStorage.setItem(draftKey(), store.doc.text);
}
addEventListener('pagehide', keepDraft);
export function offerDraft() {
  const draft = localStorage.getItem(draftKey());
  if (!draft || !isWriter()) return;
  if (draft === store.doc.text || !store.doc.saved) return localStorage.removeItem(draftKey());
  toast('An earlier session ended with unsaved changes.', {label: 'Restore them', run: () => setText(draft, '', 'unsaved text of an earlier session')});
  localStorage.removeItem(draftKey());
}

on('document writer', drawBanner);
