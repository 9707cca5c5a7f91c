// The time bar below the film: available frames and the playhead.

import {byId, clamp, drag, oncePerFrame, atMostEvery, fitCanvas} from './dom.js';
import {store, on, frameCount} from './store.js';
import {availability, seek} from './viewer.js';

const bar = byId('scrub'), canvas = byId('scrub-canvas'), pen = canvas.getContext('2d');

const draw = oncePerFrame(() => {
  const box = bar.getBoundingClientRect(), ratio = devicePixelRatio || 1, style = getComputedStyle(document.documentElement);
  fitCanvas(canvas, box);
  const w = canvas.width, h = canvas.height, n = frameCount(), have = availability(), colour = name => style.getPropertyValue(name);
  pen.fillStyle = colour('--track');
  pen.fillRect(0, h * 0.35, w, h * 0.3);
  pen.fillStyle = colour('--ready');
  for (let f = 1; f <= n;) {
    if (!have[f]) { f++; continue; }
    let g = f;
    while (g < n && have[g + 1]) g++;
    pen.fillRect((f - 1) / n * w, h * 0.35, (g - f + 1) / n * w, h * 0.3);
    f = g + 1;
  }
  const x = (store.frame - 0.5) / n * w;
  pen.fillStyle = colour('--accent');
  pen.fillRect(x - 1.5 * ratio, h * 0.12, 3 * ratio, h * 0.76);
  pen.beginPath();
  pen.arc(x, h / 2, 6 * ratio, 0, 7);
  pen.fill();
  bar.setAttribute('aria-valuemin', 1);
  bar.setAttribute('aria-valuemax', n);
  bar.setAttribute('aria-valuenow', store.frame);
});

bar.addEventListener('pointerdown', event => {
  const at = e => { const box = bar.getBoundingClientRect(); seek(clamp((e.clientX - box.left) / box.width, 0, 1) * frameCount() + 0.5); };
  bar.focus();
  at(event);
  drag(event, at);
});

on('playhead document', draw);
on('frame', atMostEvery(300, draw));
new ResizeObserver(draw).observe(bar);
matchMedia('(prefers-color-scheme: dark)').addEventListener('change', draw);
