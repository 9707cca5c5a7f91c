// Cache of the pictures of films: compressed pictures up to a memory limit, and a few decoded ones for the canvas.

import {store} from './store.js';

const kMostBytes = 96 << 20, kMostDecoded = 12;

const blobs = new Map();    // "film/frame/detail" -> {blob, camera}, the most recently used last
const decoded = new Map();  // the same keys -> {bitmap, camera}
let bytes = 0;

const keyOf = (film, frame, detail) => `${film}/${frame}/${detail}`;
window.tuneMemory = () => ({bytes, most: kMostBytes, decoded: decoded.size});

function remember(key, entry) {
  blobs.set(key, entry);
  bytes += entry.blob.size;
  for (const [old, {blob}] of blobs) {
    if (bytes <= kMostBytes) break;
    blobs.delete(old);
    bytes -= blob.size;
  }
}

export function forget(film, frame, detail) {
  const key = keyOf(film, frame, detail), known = blobs.get(key);
  if (known) { bytes -= known.blob.size; blobs.delete(key); }
  decoded.get(key)?.bitmap.close();
  decoded.delete(key);
}

/** Returns the compressed picture from the cache or the server; null if neither has it. */
export async function load(film, frame, detail) {
  const key = keyOf(film, frame, detail), known = blobs.get(key);
  if (known) { blobs.delete(key); blobs.set(key, known); return known; }
  const answer = await fetch(`${store.base}frame/${film}/${frame}?d=${detail}`);
  if (!answer.ok) return null;
  const c = (answer.headers.get('X-Camera') ?? '').split(' ').map(Number);
  const entry = {blob: await answer.blob(), camera: c.length === 7 ? {eye: c.slice(0, 3), target: c.slice(3, 6), fov: c[6]} : null};
  if (!blobs.has(key)) remember(key, entry);
  return entry;
}

/** Returns the decoded picture, or null. It is closed when it is removed from the cache. */
export async function picture(film, frame, detail) {
  const key = keyOf(film, frame, detail), known = decoded.get(key);
  if (known) { decoded.delete(key); decoded.set(key, known); return known; }
  const entry = await load(film, frame, detail);
  if (!entry) return null;
  const made = {bitmap: await createImageBitmap(entry.blob), camera: entry.camera};
  decoded.get(key)?.bitmap.close();
  decoded.set(key, made);
  for (const [old, {bitmap}] of decoded) {
    if (decoded.size <= kMostDecoded) break;
    bitmap.close();
    decoded.delete(old);
  }
  return made;
}
