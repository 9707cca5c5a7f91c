// The text of the scene: a text area over a highlighted copy of the text, with line numbers and marks of errors.

import {byId, el, newGroup, toast} from './dom.js';
import {store, on, setText, select, isIdle} from './store.js';
import {find, pathAt, stepsOf} from './jsonc.js';
import {reveal} from './controls.js';
import {kLists} from './schema.js';

const area = el('textarea', {id: 'text', spellcheck: false, wrap: 'off', autocapitalize: 'off', autocomplete: 'off', 'aria-label': 'Text of the scene'});
const colours = el('pre', {'aria-hidden': 'true'}), gutter = el('div', {class: 'gutter', 'aria-hidden': 'true'}), band = el('div', {class: 'band', hidden: true});
byId('editor').append(gutter, el('div', {class: 'code'}, band, colours, area));

const kTokens = /("(?:[^"\\\n]|\\.)*")(\s*:)?|(\/\/[^\n]*|\/\*[^]*?(?:\*\/|$))|(-?\d+(?:\.\d+)?(?:[eE][+-]?\d+)?)|\b(true|false|null)\b/g;
const escape = s => s.replace(/[&<>]/g, c => ({'&': '&amp;', '<': '&lt;', '>': '&gt;'}[c]));

function colour() {
  const text = area.value;
  let html = '', from = 0;
  for (const m of text.matchAll(kTokens)) {
    html += escape(text.slice(from, m.index));
    const kind = m[1] ? (m[2] !== undefined ? 'key' : 'string') : m[3] ? 'comment' : m[4] ? 'digits' : 'word';
    html += `<span class="t-${kind}">${escape(m[1] ?? m[0])}</span>${m[2] ?? ''}`;
    from = m.index + m[0].length;
  }
  colours.innerHTML = html + escape(text.slice(from)) + '\n';
  drawGutter();
  area.style.height = '0';  // reset, so that the height can also shrink
  area.style.height = Math.max(area.scrollHeight, byId('editor').clientHeight) + 'px';
  area.style.width = Math.max(colours.scrollWidth + 20, byId('editor').clientWidth - gutter.offsetWidth) + 'px';
}

function drawGutter() {
  const lines = area.value.split('\n').length, bad = new Map();
  for (const p of store.doc?.warnings ?? []) if (p.line) bad.set(p.line, ['warn', p.what]);
  for (const p of store.doc?.errors ?? []) if (p.line) bad.set(p.line, ['bad', p.what]);
  gutter.replaceChildren(...Array.from({length: lines}, (_, i) => el('div', {class: bad.get(i + 1)?.[0], title: bad.get(i + 1)?.[1]}, String(i + 1))));
}

function drawProblems() {
  const errors = store.doc?.errors ?? [], list = byId('problems');
  list.hidden = !errors.length;
  list.replaceChildren(...errors.slice(0, 20).map(p => el('li', {}, el('button', {class: 'problem', onclick: () => { showLine(p.line, p.column); reveal(p.path); }},
    p.line ? el('span', {class: 'where'}, `line ${p.line}`) : null, p.path ? el('code', {}, p.path) : null, ' ' + p.what))));
  byId('text-state').textContent = errors.length ? `${errors.length === 1 ? '1 error' : errors.length + ' errors'}. The film shows the last valid text.` : '';
  byId('text-state').className = errors.length ? 'bad' : '';
  document.body.classList.toggle('has-errors', errors.length > 0);
}

const lineHeight = () => parseFloat(getComputedStyle(area).lineHeight);
export function showLine(line, column = 1) {
  if (!line) return;
  const starts = area.value.split('\n').slice(0, line - 1).reduce((sum, l) => sum + l.length + 1, 0);
  byId('editor').scrollTop = Math.max(0, (line - 5) * lineHeight());
  area.focus({preventScroll: true});
  area.setSelectionRange(starts + column - 1, starts + column - 1);
}

/** Highlights the lines of a value and, if `scroll`, scrolls to them. */
export function markPath(path, scroll = true) {
  const node = path && find(store.root, path);
  band.hidden = !node || !store.textValid;
  if (band.hidden) return;
  const before = area.value.slice(0, node.start).split('\n').length - 1, lines = area.value.slice(node.start, node.end).split('\n').length;
  band.style.top = before * lineHeight() + 8 + 'px';
  band.style.height = lines * lineHeight() + 'px';
  if (scroll) byId('editor').scrollTop = Math.max(0, (before - 4) * lineHeight());
}

let group = newGroup(), lastKey = 0, timer = 0, pending = false, base = 0;  // base: the version on which the edited text is based
area.addEventListener('input', () => {
  if (performance.now() - lastKey > 1500) group = newGroup();
  lastKey = performance.now();
  pending = true;
  colour();
  clearTimeout(timer);
  timer = setTimeout(sendNow, 220);
});
export function sendNow() {
  if (!pending) return;
  clearTimeout(timer);
  pending = false;
  setText(area.value, group, 'text', () => base);
}
on('flush', sendNow);
on('text-taken', id => { base = id; });
on('text-refused', ({text, group}) => toast('The file changed while you were typing.', {label: 'Use what I typed', run: () => setText(text, group)}));
area.addEventListener('keydown', event => {
  if (event.key === 'Tab' && !event.shiftKey && !event.ctrlKey) {
    event.preventDefault();
    area.setRangeText('  ', area.selectionStart, area.selectionEnd, 'end');
    area.dispatchEvent(new Event('input'));
  }
});
const follow = () => {
  if (!store.textValid || pending) return;
  const path = pathAt(store.root, area.selectionStart), steps = stepsOf(path);
  if (!steps.length) return;
  const object = '/' + steps.slice(0, kLists.includes(steps[0]) ? 2 : 1).join('/');
  if (kLists.includes(steps[0]) && steps.length < 2) return;
  if (store.selection.at(-1) !== object) { following = true; select([object]); following = false; }
};
let following = false;
area.addEventListener('click', follow);
area.addEventListener('keyup', event => { if (event.key.startsWith('Arrow')) follow(); });

/** Shows the document's text and keeps the caret and the scroll position. */
function take() {
  if (!store.doc) return;
  if (!pending && area.value !== store.doc.text && (isIdle() || document.activeElement !== area)) {
    const old = area.value, text = store.doc.text, caret = area.selectionStart;
    let same = 0;
    while (same < Math.min(old.length, text.length) && old[same] === text[same]) same++;
    area.value = text;
    const moved = caret > same ? Math.max(same, caret + text.length - old.length) : caret;
    area.setSelectionRange(moved, moved);
    colour();
  }
  if (area.value === store.doc.text) base = store.doc.version.id;
  drawGutter();
  drawProblems();
  markPath(store.selection.at(-1), false);
}
window.tuneIdle = () => isIdle() && !pending;  // for the tests
export const ownText = () => area.value;

on('document idle', take);
on('selection', () => markPath(store.selection.at(-1), !following));
on('show-text', path => { const node = find(store.root, path); if (node) showLine(area.value.slice(0, node.start).split('\n').length); });
new ResizeObserver(() => colour()).observe(byId('editor'));
