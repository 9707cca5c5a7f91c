// The entry point of the page: the tool bar, the keyboard, and the connection to the server.

import {byId, el} from './dom.js';
import {store, on, emit, get, listen, takeDocument, takeFilm, undo, redo, isWriter, reportView, frameCount} from './store.js';
import {setSchema} from './schema.js';
import {present, seek, setPlaying, fit} from './viewer.js';
import './scrub.js';
import './editor.js';
import {loadFigures} from './plots.js';
import {showVersions, togglePin, showAdd, showOverlays, saveFile, offerDraft} from './panels.js';
import './controls.js';

function drawBar() {
  const doc = store.doc, mine = isWriter();
  document.body.classList.toggle('read-only', !mine);
  byId('scene-name').textContent = doc.scene?.name ?? 'scene';
  byId('file-name').textContent = store.file;
  byId('dirty').hidden = doc.saved;
  document.title = (doc.saved ? '' : '• ') + (doc.scene?.name ?? 'scene') + ' – offstage tune';
  byId('save').disabled = doc.saved || !mine;
  byId('undo').disabled = doc.undo === null || !mine;
  byId('redo').disabled = doc.redo === null || !mine;
  byId('undo').title = doc.undo === null ? 'Nothing to undo' : `Undo: ${doc.undo} (Ctrl+Z)`;
  byId('redo').title = doc.redo === null ? 'Nothing to redo' : `Redo: ${doc.redo} (Ctrl+Shift+Z)`;
  for (const id of ['pin', 'add-button', 'overlays-button']) byId(id).disabled = !mine;
}

function drawFilmState() {
  const film = store.film, waiting = byId('waiting'), text = waiting.querySelector('span');
  if (film.phase === 'loading') text.textContent = film.message || 'Loading the scene';
  if (film.phase === 'lead_in') text.textContent = 'Simulating';
  if (film.phase === 'failed') {
    waiting.hidden = false;
    waiting.classList.add('failed');
    text.textContent = film.message;
  } else if (waiting.classList.contains('failed')) {
    waiting.classList.remove('failed');
    waiting.hidden = !!byId('film').dataset.film;
  }
  if (!store.doc?.scene) { text.textContent = 'The text is not a valid scene yet. Its errors are listed below the text.'; waiting.classList.add('failed'); }
}

function bind() {
  const click = (id, run) => byId(id).addEventListener('click', event => run(event.currentTarget));
  click('undo', undo);
  click('redo', redo);
  click('save', saveFile);
  click('versions-button', showVersions);
  click('pin', togglePin);
  click('add-button', showAdd);
  click('overlays-button', showOverlays);
  click('play', () => setPlaying(!store.playing));
  click('step-back', () => seek(store.frame - 1));
  click('step-on', () => seek(store.frame + 1));
  click('text-hide', () => { document.body.classList.toggle('no-text'); fit(); });
  for (const button of byId('tabs').children) button.addEventListener('click', () => { document.body.dataset.tab = button.dataset.show; fit(); });
  const split = byId('split');
  split.addEventListener('pointerdown', event => {
    split.setPointerCapture(event.pointerId);
    split.onpointermove = e => byId('tree').style.setProperty('flex-basis', Math.max(60, e.clientY - byId('tree').getBoundingClientRect().top) + 'px');
    split.onpointerup = () => { split.onpointermove = null; };
  });
}

/** Applies a typed value before an undo. The text keeps its caret. */
function commitField() {
  if (document.activeElement?.id !== 'text') document.activeElement?.blur?.();
}

const isTyping = target => target.closest?.('input:not([type=checkbox]):not([type=color]), textarea, select');
addEventListener('keydown', event => {
  const command = event.ctrlKey || event.metaKey, key = event.key.toLowerCase();
  if (command && key === 's') { event.preventDefault(); saveFile(); return; }
  if (command && key === 'z') { event.preventDefault(); commitField(); event.shiftKey ? redo() : undo(); return; }
  if (command && key === 'y') { event.preventDefault(); commitField(); redo(); return; }
  if (command || event.altKey || isTyping(event.target)) return;
  if (event.key === ' ' && !event.target.closest?.('button')) { event.preventDefault(); setPlaying(!store.playing); }
  if (event.target.closest?.('[role=slider]:not(#scrub), [role=tree], .curve, .ramp')) return;
  if (event.key === 'ArrowRight') { event.preventDefault(); seek(store.frame + (event.shiftKey ? 10 : 1)); }
  if (event.key === 'ArrowLeft') { event.preventDefault(); seek(store.frame - (event.shiftKey ? 10 : 1)); }
  if (event.key === 'Home') seek(1);
  if (event.key === 'End') seek(frameCount());
  if (event.key === '/') { event.preventDefault(); byId('search').focus(); }
});

on('document writer', () => { if (store.doc) drawBar(); });
on('document film film-changed', drawFilmState);
on('writer', () => { if (isWriter()) reportView(); });

async function start() {
  bind();
  const [schema, state] = await Promise.all([get('api/schema'), get('api/state')]);
  setSchema(schema);
  store.file = state.file;
  store.writer = state.writer;
  takeDocument(state);
  takeFilm(state.film_state);
  let greeted = false;
  on('connected', async () => {
    const now = await get('api/state');
    store.writer = now.writer;
    takeDocument(now);
    takeFilm(now.film_state);
    emit('writer');
    if (!greeted) offerDraft();
    greeted = true;
    reportView();
  });
  const stream = listen(state.stream);
  stream.addEventListener('error', () => { if (stream.readyState === EventSource.CLOSED) emit('lost'); });
  loadFigures();
  get('api/presets').then(presets => { store.presets = presets; emit('presets'); });
  present();
  document.body.dataset.ready = 'yes';
}
start().catch(error => { byId('waiting').querySelector('span').textContent = 'The page could not be loaded: ' + error.message; });
