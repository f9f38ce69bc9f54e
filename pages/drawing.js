"use strict";
// What the page of a session and the page of a view draw with. tpm writes it into both.
const $ = id => document.getElementById(id);
const minus = s => s.replaceAll("-", "\u2212");

// --- canvases ------------------------------------------------------------------------------------
function ready(canvas) {
  const k = window.devicePixelRatio || 1, w = canvas.clientWidth, h = canvas.clientHeight;
  if (canvas.width !== Math.round(w * k) || canvas.height !== Math.round(h * k)) { canvas.width = Math.round(w * k); canvas.height = Math.round(h * k); }
  const g = canvas.getContext("2d");
  g.setTransform(k, 0, 0, k, 0, 0);
  g.clearRect(0, 0, w, h);
  g.font = "11px system-ui, 'DejaVu Sans', sans-serif";
  return [g, w, h];
}
/// A text, or as much of its beginning as fits.
function fitted(g, text, width) {
  if (g.measureText(text).width <= width) return text;
  let n = text.length;
  while (n > 0 && g.measureText(text.slice(0, n) + "\u2026").width > width) --n;
  return text.slice(0, n) + "\u2026";
}
function niceStep(span, count) {
  const raw = span / count, p = Math.pow(10, Math.floor(Math.log10(raw))), m = raw / p;
  return (m < 1.5 ? 1 : m < 3 ? 2 : m < 7 ? 5 : 10) * p;
}

// --- spheres -------------------------------------------------------------------------------------
const RAMP = [[68, 84, 110], [74, 124, 139], [99, 156, 130], [160, 180, 98], [226, 190, 74], [226, 120, 50]];  // small to large
const dot = (a, b) => a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
const cross = (a, b) => [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]];
const unit = a => { const n = Math.hypot(...a) || 1; return a.map(x => x / n); };
function rampAt(x) {
  const p = Math.min(1, Math.max(0, x)) * (RAMP.length - 1), i = Math.min(RAMP.length - 2, Math.floor(p));
  return RAMP[i].map((c, k) => Math.round(c + (p - i) * (RAMP[i + 1][k] - c)));
}
function ball(rgb) {
  const c = document.createElement("canvas"); c.width = c.height = 64;
  const g = c.getContext("2d"), f = g.createRadialGradient(24, 20, 3, 32, 32, 32);
  const tone = k => "rgb(" + rgb.map(v => Math.round(k > 1 ? 255 - (255 - v) * (2 - k) : v * k)).join() + ")";
  f.addColorStop(0, tone(1.55)); f.addColorStop(0.45, tone(1)); f.addColorStop(1, tone(0.5));
  g.fillStyle = f; g.beginPath(); g.arc(32, 32, 31.5, 0, 7); g.fill();
  return c;
}
/// The axes of an eye that looks at a body (ez points to the eye), and the pixels of a metre.
function camera(view, body, w, h) {
  const up = body.push.map(v => -v), ca = Math.cos(view.turn), sa = Math.sin(view.turn), flat = body.a.map((v, k) => ca * v + sa * body.b[k]);
  const ct = Math.cos(view.tilt), st = Math.sin(view.tilt);
  const ez = unit(flat.map((v, k) => ct * v + st * up[k])), ex = unit(cross(up, ez)), ey = cross(ez, ex);
  return {up, ex, ey, ez, pixels: view.zoom * 0.5 * Math.min(w, 1.25 * h) / body.size, far: 5 * body.size};
}
