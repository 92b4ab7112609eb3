"use strict";
// the ribbon's surface at some instants, turned by hand, beside z(1/2) against alpha
const data = JSON.parse(document.getElementById("data").textContent);
const bytes = Uint8Array.from(atob(data.points), (c) => c.charCodeAt(0));
// (frames, 2 edges, nodes, 3), little-endian as every browser's processor is
const points = new Float32Array(bytes.buffer);
const nodes = data.nodes;
const canvas = document.getElementById("ribbon");
const slider = document.getElementById("frame");
const button = document.getElementById("play");
const FACE = [0.24, 0.49, 0.65], BACK = [0.91, 0.66, 0.49], CLAMP = [0.45, 0.48, 0.52];
const SECONDS = 8;
const camera = { yaw: -0.26, pitch: 0.31, zoom: 1 };
let frame = 0, playing = false, since = 0, stale = true;

const minus = (a, b) => [a[0] - b[0], a[1] - b[1], a[2] - b[2]];
const along = (a, b, c) => [a[0] + c * b[0], a[1] + c * b[1], a[2] + c * b[2]];
const cross = (a, b) => [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]];
const unit = (a) => { const n = Math.hypot(...a) || 1; return a.map((x) => x / n); };

function edge(side, node) {
  const at = ((frame * 2 + side) * nodes + node) * 3;
  return [points[at], points[at + 1], points[at + 2]];
}

// all triangles of an instant: x, y, z, normal, and 1 where it is a clamp's, for each corner
function mesh() {
  const out = [];
  const corner = (p, n, clamp) => out.push(p[0], p[1], p[2], n[0], n[1], n[2], clamp);
  const quad = (a, b, c, d, na, nb, clamp) => {
    corner(a, na, clamp); corner(b, nb, clamp); corner(c, nb, clamp);
    corner(a, na, clamp); corner(c, nb, clamp); corner(d, na, clamp);
  };
  const low = [], high = [], normal = [];
  for (let k = 0; k < nodes; k++) { low.push(edge(0, k)); high.push(edge(1, k)); }
  for (let k = 0; k < nodes; k++) {
    const a = Math.max(k - 1, 0), b = Math.min(k + 1, nodes - 1);
    const t = minus(along(low[b], high[b], 1), along(low[a], high[a], 1));
    normal.push(unit(cross(minus(high[k], low[k]), t)));
  }
  for (let k = 0; k + 1 < nodes; k++)
    quad(low[k], low[k + 1], high[k + 1], high[k], normal[k], normal[k + 1], 0);
  for (const [k, inner] of [[0, 1], [nodes - 1, nodes - 2]]) {
    const out1 = unit(minus(low[k], low[inner])), n = normal[k], w = unit(minus(high[k], low[k]));
    block(along(low[k], w, -0.01), along(high[k], w, 0.01), out1, n, quad);
  }
  return new Float32Array(out);
}

// a clamp: a block that holds the end, from p to q across, outwards, as thick as can be seen
function block(p, q, outwards, n, quad) {
  const ring = (r) => [
    along(r, n, 0.012), along(along(r, outwards, 0.035), n, 0.012),
    along(along(r, outwards, 0.035), n, -0.012), along(r, n, -0.012),
  ];
  const a = ring(p), b = ring(q);
  const faces = [n, outwards, n, outwards];
  for (let k = 0; k < 4; k++) {
    const next = (k + 1) % 4;
    quad(a[k], a[next], b[next], b[k], faces[k], faces[k], 1);
  }
  const w = unit(minus(q, p));
  quad(...a, w, w, 1);
  quad(...b, w, w, 1);
}

// rows of a camera matrix: clip x, y, z, w of a point
function view() {
  const [cy, sy, cp, sp] = [Math.cos(camera.yaw), Math.sin(camera.yaw), Math.cos(camera.pitch), Math.sin(camera.pitch)];
  const right = [cy, sy, 0], ahead = [-sy * cp, cy * cp, -sp], up = [-sy * sp, cy * sp, cp];
  const far = 4 * data.radius, shape = canvas.width / canvas.height;
  // a narrow canvas shows all of the width
  const lens = camera.zoom * 4.2 * Math.min(1, shape / 1.2);
  const row = (v, scale, more) => [v[0] * scale, v[1] * scale, v[2] * scale,
    more - scale * (v[0] * data.centre[0] + v[1] * data.centre[1] + v[2] * data.centre[2])];
  const r = data.radius;
  // depths between 2 r and 6 r before the camera
  return [row(right, lens / shape, 0), row(up, lens, 0), row(ahead, 2, 2 * far - 6 * r), row(ahead, 1, far)];
}

const dot = (row, p) => row[0] * p[0] + row[1] * p[1] + row[2] * p[2] + row[3];

function withGL(gl) {
  const compile = (kind, text) => {
    const shader = gl.createShader(kind);
    gl.shaderSource(shader, "#version 300 es\nprecision highp float;\n" + text);
    gl.compileShader(shader);
    return shader;
  };
  const program = gl.createProgram();
  gl.attachShader(program, compile(gl.VERTEX_SHADER, `
    in vec3 p; in vec3 n; in float c; uniform mat4 m; out vec3 normal; out float clamped;
    void main() { normal = n; clamped = c; gl_Position = vec4(p, 1.) * m; }`));
  gl.attachShader(program, compile(gl.FRAGMENT_SHADER, `
    in vec3 normal; in float clamped; uniform vec3 light; uniform vec3 face; uniform vec3 back; uniform vec3 clampc;
    out vec4 colour;
    void main() {
      vec3 base = clamped > .5 ? clampc : gl_FrontFacing ? face : back;
      colour = vec4(base * (.5 + .65 * abs(dot(normalize(normal), light))), 1.);
    }`));
  gl.linkProgram(program);
  if (!gl.getProgramParameter(program, gl.LINK_STATUS)) throw new Error(gl.getProgramInfoLog(program));
  gl.useProgram(program);
  gl.bindBuffer(gl.ARRAY_BUFFER, gl.createBuffer());
  for (const [name, size, offset] of [["p", 3, 0], ["n", 3, 12], ["c", 1, 24]]) {
    const place = gl.getAttribLocation(program, name);
    gl.enableVertexAttribArray(place);
    gl.vertexAttribPointer(place, size, gl.FLOAT, false, 28, offset);
  }
  const uniform = (name) => gl.getUniformLocation(program, name);
  gl.uniform3fv(uniform("face"), FACE);
  gl.uniform3fv(uniform("back"), BACK);
  gl.uniform3fv(uniform("clampc"), CLAMP);
  const matrix = uniform("m"), light = uniform("light");
  gl.enable(gl.DEPTH_TEST);
  return () => {
    const corners = mesh();
    gl.viewport(0, 0, canvas.width, canvas.height);
    gl.clear(gl.COLOR_BUFFER_BIT | gl.DEPTH_BUFFER_BIT);
    gl.bufferData(gl.ARRAY_BUFFER, corners, gl.DYNAMIC_DRAW);
    gl.uniformMatrix4fv(matrix, false, view().flat());
    gl.uniform3fv(light, lamp());
    gl.drawArrays(gl.TRIANGLES, 0, corners.length / 7);
  };
}

// light comes from above the shoulder of who looks
function lamp() {
  return unit([0.5 * Math.sin(camera.yaw) + 0.2, -0.5 * Math.cos(camera.yaw), 0.85]);
}

// without WebGL2: the same triangles, the furthest first
function withCanvas(pen) {
  return () => {
    const corners = mesh(), rows = view(), light = lamp(), faces = [];
    for (let at = 0; at < corners.length; at += 21) {
      const seen = [0, 7, 14].map((k) => {
        const p = corners.subarray(at + k, at + k + 3), w = dot(rows[3], p);
        return [(dot(rows[0], p) / w + 1) * 0.5 * canvas.width, (1 - dot(rows[1], p) / w) * 0.5 * canvas.height, w];
      });
      const [a, b, c] = seen, n = corners.subarray(at + 3, at + 6);
      const front = (b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0]) < 0;
      const base = corners[at + 6] ? CLAMP : front ? FACE : BACK;
      const bright = 0.5 + 0.65 * Math.abs(n[0] * light[0] + n[1] * light[1] + n[2] * light[2]);
      faces.push([a[2] + b[2] + c[2], seen, `rgb(${base.map((x) => Math.min(255, Math.round(255 * x * bright)))})`]);
    }
    faces.sort((one, other) => other[0] - one[0]);
    pen.clearRect(0, 0, canvas.width, canvas.height);
    for (const [, seen, colour] of faces) {
      pen.fillStyle = pen.strokeStyle = colour;
      pen.beginPath();
      for (const [x, y] of seen) pen.lineTo(x, y);
      pen.closePath();
      pen.fill();
      pen.stroke();
    }
  };
}

// ?canvas asks for the fallback, to see it
function painter() {
  const gl = location.search === "?canvas" ? null : canvas.getContext("webgl2", { antialias: true });
  canvas.dataset.drawn = gl ? "webgl2" : "canvas";
  return gl ? withGL(gl) : withCanvas(canvas.getContext("2d"));
}

function plot() {
  const [left, right, top, bottom] = [62, 390, 12, 276], [x0, x1, y0, y1] = data.window;
  const x = (a) => left + ((a - x0) / (x1 - x0)) * (right - left);
  const y = (z) => bottom - ((z - y0) / (y1 - y0)) * (bottom - top);
  const line = (rows) => rows.map(([a, z], k) => `${k ? "L" : "M"}${x(a).toFixed(1)},${y(z).toFixed(1)}`).join("");
  const ticks = (low, high) => {
    const rough = (high - low) / 4, ten = 10 ** Math.floor(Math.log10(rough));
    const step = [1, 2, 5, 10].map((m) => m * ten).find((s) => s >= rough);
    const places = Math.max(0, -Math.floor(Math.log10(step) + 1e-9)), marks = [];
    for (let k = Math.ceil(low / step); k * step <= high; k++) marks.push([k * step, (k * step).toFixed(places)]);
    return marks;
  };
  let text = `<clipPath id="in"><rect x="${left}" y="${top}" width="${right - left}" height="${bottom - top}"/></clipPath>`;
  text += `<path d="M${left},${top}V${bottom}H${right}" fill="none" stroke="currentColor"/>`;
  for (const [a, word] of ticks(x0, x1))
    text += `<path d="M${x(a)},${bottom}v5" stroke="currentColor"/><text fill="currentColor" x="${x(a)}" y="${bottom + 18}" text-anchor="middle">${word}</text>`;
  for (const [z, word] of ticks(y0, y1))
    text += `<path d="M${left},${y(z)}h-5" stroke="currentColor"/><text fill="currentColor" x="${left - 8}" y="${y(z) + 4}" text-anchor="end">${word}</text>`;
  text += `<text fill="currentColor" x="${(left + right) / 2}" y="312" text-anchor="middle">${data.name} (${data.unit || 1})</text>`;
  text += `<text fill="currentColor" transform="translate(14 ${(top + bottom) / 2}) rotate(-90)" text-anchor="middle">z(1/2)/L</text><g clip-path="url(#in)" fill="none">`;
  for (const part of data.curve)
    text += `<path d="${line(part.rows)}" stroke="currentColor" stroke-width="1.5" ${part.stable ? "" : 'stroke-dasharray="4 4"'}/>`;
  text += `<path d="${line(data.motion)}" stroke="var(--face)" stroke-width="1.5"/></g><circle r="6" fill="var(--mark)"/>`;
  const svg = document.getElementById("curve");
  svg.innerHTML = text;
  const mark = svg.querySelector("circle");
  return () => {
    mark.setAttribute("cx", x(data.angle[frame]));
    mark.setAttribute("cy", y(data.height[frame]));
  };
}

const paint = painter(), point = plot(), said = document.getElementById("said");

function show() {
  paint();
  point();
  slider.value = frame;
  const state = document.createElement("b");
  state.textContent = data.state[frame] || "level";
  said.replaceChildren(state, ` t = ${data.time[frame].toFixed(3)} s, ${data.name} = ${data.angle[frame].toFixed(4)} ${data.unit}`);
  slider.setAttribute("aria-valuetext", said.textContent);
}

function play(on) {
  playing = on;
  button.textContent = on ? "Pause" : "Play";
  if (on && frame === data.frames - 1) frame = 0;
  since = performance.now() - (frame / data.frames) * SECONDS * 1000;
}

function tick(now) {
  if (playing) {
    const next = Math.floor(((now - since) / 1000 / SECONDS) * data.frames);
    frame = Math.min(Math.max(next, frame), data.frames - 1);
    stale = true;
    if (frame === data.frames - 1) play(false);
  }
  if (stale) { stale = false; show(); }
  requestAnimationFrame(tick);
}

function turn(yaw, pitch) {
  camera.yaw += yaw;
  camera.pitch = Math.min(1.57, Math.max(-1.57, camera.pitch + pitch));
  stale = true;
}

function zoom(factor) {
  camera.zoom = Math.min(4, Math.max(0.4, camera.zoom * factor));
  stale = true;
}

slider.max = data.frames - 1;
slider.addEventListener("input", () => { play(false); frame = Number(slider.value); stale = true; });
button.addEventListener("click", () => play(!playing));
let held = null;
canvas.addEventListener("pointerdown", (event) => {
  if (!event.isPrimary) return;
  canvas.setPointerCapture(event.pointerId);
  held = [event.clientX, event.clientY];
});
canvas.addEventListener("pointermove", (event) => {
  if (!held || !event.isPrimary) return;
  turn(0.008 * (held[0] - event.clientX), 0.008 * (event.clientY - held[1]));
  held = [event.clientX, event.clientY];
});
for (const end of ["pointerup", "pointercancel"]) canvas.addEventListener(end, () => { held = null; });
canvas.addEventListener("wheel", (event) => {
  // a page that is scrolled past the ribbon goes on scrolling
  if (document.activeElement !== canvas) return;
  event.preventDefault();
  zoom(Math.exp(-0.001 * event.deltaY));
}, { passive: false });
const KEYS = {
  ArrowLeft: () => turn(0.08, 0), ArrowRight: () => turn(-0.08, 0), ArrowUp: () => turn(0, 0.08),
  ArrowDown: () => turn(0, -0.08), "+": () => zoom(1.1), "-": () => zoom(1 / 1.1), " ": () => play(!playing),
};
addEventListener("keydown", (event) => {
  // the button has its own space, the slider its own arrows
  const own = event.key === " " ? event.target === button : event.target === slider && event.key.startsWith("Arrow");
  if (own || !KEYS[event.key] || event.ctrlKey || event.metaKey || event.altKey) return;
  event.preventDefault();
  KEYS[event.key]();
});
new ResizeObserver(() => {
  const sharp = Math.min(devicePixelRatio || 1, 2);
  canvas.width = Math.max(1, Math.round(canvas.clientWidth * sharp));
  canvas.height = Math.max(1, Math.round(canvas.clientHeight * sharp));
  stale = true;
}).observe(canvas);
requestAnimationFrame(tick);
