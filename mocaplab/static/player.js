// The skeleton player: one plain ES module that fetches nothing.
//
// mount(element, data) builds the player. It is used twice: by render(), which a
// notebook with a running kernel calls, and by mountAll(), which a saved page calls.
// World axes as in BVH files: Y is up. Lengths are in file units until project().

const CSS = `
.mocaplab-player { color: var(--jp-ui-font-color1, #222); background: var(--jp-layout-color0, #fff);
  border: 1px solid var(--jp-border-color2, #ccc); border-radius: 4px; box-sizing: border-box;
  font: 13px/1.4 var(--jp-ui-font-family, system-ui, sans-serif); width: 100%; max-width: 1000px; }
.mocaplab-player canvas { display: block; width: 100%; touch-action: none; cursor: grab; }
.mocaplab-player canvas:active { cursor: grabbing; }
.mocaplab-player .bar { display: flex; flex-wrap: wrap; gap: 6px 10px; align-items: center;
  padding: 6px 10px; border-top: 1px solid var(--jp-border-color2, #ccc); }
.mocaplab-player .bar.legend { border-top: 0; border-bottom: 1px solid var(--jp-border-color2, #ccc); }
.mocaplab-player .together { display: inline-flex; gap: 6px; }
.mocaplab-player select { width: auto; }
.mocaplab-player .bar label { display: inline-flex; gap: 5px; align-items: center; margin: 0; }
.mocaplab-player .swatch { display: inline-block; width: 22px; height: 5px; border-radius: 3px; }
.mocaplab-player .hint { margin-left: auto; color: var(--jp-ui-font-color2, #595959); font-size: 12px; }
.mocaplab-player button, .mocaplab-player select { font: inherit; color: inherit; cursor: pointer;
  background: var(--jp-layout-color2, #eee); border: 1px solid var(--jp-border-color1, #bbb);
  border-radius: 3px; padding: 2px 9px; min-height: 26px; margin: 0; }
.mocaplab-player button.play { min-width: 62px; font-weight: 600; }
.mocaplab-player input[type=range] { flex: 1 1 160px; min-width: 90px; margin: 0;
  accent-color: var(--jp-brand-color1, #1565c0); }
.mocaplab-player input[type=checkbox] { margin: 0; }
.mocaplab-player output { font-variant-numeric: tabular-nums; white-space: nowrap; }
.mocaplab-player :is(button, select, input, canvas):focus-visible {
  outline: 2px solid var(--jp-brand-color1, #1565c0); outline-offset: 1px; }
`;

// Okabe and Ito's colours; the blue is lighter where the background is dark.
const ON_LIGHT = ["#0072B2", "#D55E00", "#009E73", "#CC79A7"];
const ON_DARK = ["#56B4E9", "#E69F00", "#009E73", "#CC79A7"];
const HOME = { yaw: 0.7, pitch: 0.22, zoom: 1 };
const SPEEDS = [0.25, 0.5, 1, 2];
const GRID_CELLS = 10; // on each side of the figure

/** Unpack what widgets.py packed: zlib, byte planes, differences from frame to frame. */
async function unpack(meta, bytes) {
  const stream = new Blob([bytes]).stream().pipeThrough(new DecompressionStream("deflate"));
  const planes = new Uint8Array(await new Response(stream).arrayBuffer());
  const half = planes.length / 2;
  const values = new Int16Array(half);
  for (let i = 0; i < half; i++) values[i] = planes[i] | (planes[half + i] << 8);
  let start = 0;
  const positions = meta.motions.map(({ frames, points }) => {
    const width = 3 * points;
    const part = values.subarray(start, (start += frames * width));
    for (let i = width; i < part.length; i++) part[i] += part[i - width]; // wraps, as in Python
    return Float32Array.from(part, (v, i) => v * meta.scale + meta.origin[i % 3]);
  });
  return { ...meta, positions };
}

function make(tag, properties = {}, ...children) {
  const { style, ...rest } = properties;
  const node = Object.assign(document.createElement(tag), rest);
  Object.assign(node.style, style);
  node.append(...children);
  return node;
}

/**
 * Build a player inside an element.
 *
 * data: what unpack() returns. onChange({frame | playing | speed}) is told what the
 * reader did. Returns {set(state), remove()}.
 */
export function mount(element, data, onChange = () => {}) {
  const { step, size, ground } = data;
  const last = Math.ceil(data.frames / step) - 1; // index of the last stored frame
  const state = { frame: 0, playing: false, speed: 1 };
  const view = { ...HOME };
  const shown = data.motions.map(() => true);
  let clock = 0; // seconds into the clip
  let drawRequest = 0;
  let tickRequest = 0;
  let tickTime = 0;
  let toldTime = 0;

  // ---- the page elements
  const canvas = make("canvas", { tabIndex: 0, style: { height: `${data.height}px` } });
  canvas.setAttribute("role", "img");
  canvas.setAttribute(
    "aria-label",
    `3D view of ${data.motions.map((m) => m.label).join(", ")}. ` +
      "Arrow keys turn it, plus and minus zoom, 0 resets the view.",
  );
  const play = make("button", { type: "button", className: "play", textContent: "Play" });
  const slider = make("input", { type: "range", min: 0, max: last, step: 1, value: 0 });
  slider.setAttribute("aria-label", "Frame");
  const readout = make("output");
  const speed = make("select", {}, ...SPEEDS.map((s) => make("option", { value: s, textContent: `${s} ×` })));
  const button = (text, label, onclick) => {
    const node = make("button", { type: "button", textContent: text, title: label, onclick });
    node.setAttribute("aria-label", label);
    return node;
  };
  const swatches = data.motions.map(() => make("span", { className: "swatch" }));
  const legend = data.motions.map((motion, i) => {
    const box = make("input", { type: "checkbox", checked: true });
    box.onchange = () => ((shown[i] = box.checked), requestDraw());
    return make("label", {}, box, swatches[i], motion.label);
  });
  const root = make(
    "div",
    { className: "mocaplab-player" },
    make("style", { textContent: CSS }),
    make("div", { className: "bar legend" }, ...legend,
      make("span", { className: "hint", textContent: "drag to turn; click, then wheel to zoom" })),
    canvas,
    make("div", { className: "bar" }, play, slider, readout,
      make("label", {}, "speed", speed),
      make("span", { className: "together" },
        button("−", "Zoom out", () => zoomBy(1 / 1.25)),
        button("+", "Zoom in", () => zoomBy(1.25)),
        button("Reset view", "Reset view", resetView))),
  );
  element.replaceChildren(root);
  const pen = canvas.getContext("2d");

  // ---- drawing
  let W = 0;
  let H = 0;
  let target = [0, 0, 0];
  let turn = null; // sines and cosines of the view, and its scale

  /** World point to canvas pixels, in perspective. */
  function project(x, y, z) {
    const dx = x - target[0];
    const dy = y - target[1];
    const dz = z - target[2];
    const right = turn.cy * dx - turn.sy * dz;
    const near = turn.sy * dx + turn.cy * dz;
    const up = turn.cp * dy - turn.sp * near;
    const scale = turn.focal / (turn.distance - (turn.sp * dy + turn.cp * near));
    return [W / 2 + right * scale, H / 2 - up * scale];
  }

  function line(a, b) {
    pen.moveTo(a[0], a[1]);
    pen.lineTo(b[0], b[1]);
  }

  function drawGrid(ink) {
    const cell = data.cell;
    const reach = GRID_CELLS * cell;
    const levels = [[], [], [], []]; // segments by how faint they are
    const x0 = Math.round(target[0] / cell) * cell;
    const z0 = Math.round(target[2] / cell) * cell;
    for (let i = -GRID_CELLS; i <= GRID_CELLS; i++) {
      for (let j = -GRID_CELLS; j < GRID_CELLS; j++) {
        const far = Math.hypot(x0 + i * cell - target[0], z0 + (j + 0.5) * cell - target[2]);
        const farOther = Math.hypot(x0 + (j + 0.5) * cell - target[0], z0 + i * cell - target[2]);
        const p = [x0 + i * cell, z0 + j * cell, x0 + i * cell, z0 + (j + 1) * cell];
        const q = [x0 + j * cell, z0 + i * cell, x0 + (j + 1) * cell, z0 + i * cell];
        if (far < reach) levels[Math.floor((4 * far) / reach)].push(p);
        if (farOther < reach) levels[Math.floor((4 * farOther) / reach)].push(q);
      }
    }
    pen.strokeStyle = ink;
    pen.lineWidth = 1;
    levels.forEach((segments, level) => {
      pen.globalAlpha = 0.28 - 0.06 * level;
      pen.beginPath();
      for (const [ax, az, bx, bz] of segments) line(project(ax, ground, az), project(bx, ground, bz));
      pen.stroke();
    });
    pen.globalAlpha = 1;
  }

  function drawFigure(m, colour, ink) {
    const { bones, points, frames, joints } = data.motions[m];
    // A shorter clip stays in its last pose.
    const start = 3 * points * Math.min(Math.floor(state.frame / step), frames - 1);
    const at = (k) => data.positions[m].subarray(start + 3 * k, start + 3 * k + 3);
    const places = Array.from({ length: points }, (_, k) => project(...at(k)));
    const thick = Math.max(1.5, Math.min(7, (turn.focal / turn.distance) * size * 0.011));
    pen.lineCap = "round";
    pen.strokeStyle = ink; // a shadow on the ground tells how high a foot is
    pen.globalAlpha = 0.13;
    pen.lineWidth = thick;
    pen.beginPath();
    for (const [a, b] of bones) {
      const [p, q] = [at(a), at(b)];
      line(project(p[0], ground, p[2]), project(q[0], ground, q[2]));
    }
    pen.stroke();
    pen.globalAlpha = 0.9;
    pen.strokeStyle = pen.fillStyle = colour;
    pen.beginPath();
    for (const [a, b] of bones) line(places[a], places[b]);
    pen.stroke();
    pen.beginPath();
    for (const [x, y] of places.slice(0, joints)) {
      pen.moveTo(x + thick, y);
      pen.arc(x, y, thick, 0, 2 * Math.PI);
    }
    pen.fill();
    pen.globalAlpha = 1;
  }

  function draw() {
    drawRequest = 0;
    const ratio = window.devicePixelRatio || 1;
    [W, H] = [canvas.clientWidth, canvas.clientHeight];
    if (!W || !H) return; // hidden; the resize observer calls again
    if (canvas.width !== Math.round(W * ratio) || canvas.height !== Math.round(H * ratio)) {
      [canvas.width, canvas.height] = [Math.round(W * ratio), Math.round(H * ratio)];
    }
    pen.setTransform(ratio, 0, 0, ratio, 0, 0);
    pen.clearRect(0, 0, W, H);

    const style = getComputedStyle(root);
    const ink = style.color;
    const [r, g, b] = style.backgroundColor.match(/[\d.]+/g).map(Number);
    const colours = 0.3 * r + 0.59 * g + 0.11 * b < 128 ? ON_DARK : ON_LIGHT;

    // Follow the root of the first clip along the ground, not its bobbing.
    const first = data.motions[0];
    const at = 3 * first.points * Math.min(Math.floor(state.frame / step), first.frames - 1);
    target = [data.positions[0][at], data.middle, data.positions[0][at + 2]];
    const distance = 4 * size;
    turn = {
      cy: Math.cos(view.yaw), sy: Math.sin(view.yaw),
      cp: Math.cos(view.pitch), sp: Math.sin(view.pitch),
      distance,
      focal: (distance * 0.8 * Math.min(H, W) * view.zoom) / size,
    };
    drawGrid(ink);
    shown.forEach((visible, m) => {
      swatches[m].style.background = colours[m];
      if (visible) drawFigure(m, colours[m], ink);
    });
  }

  function requestDraw() {
    if (!drawRequest) drawRequest = requestAnimationFrame(draw);
  }

  // ---- state
  function showControls() {
    slider.value = Math.floor(state.frame / step);
    const seconds = (state.frame * data.frame_time).toFixed(2);
    readout.textContent = `frame ${state.frame} of ${data.frames - 1}, ${seconds} s`;
    slider.setAttribute("aria-valuetext", readout.textContent);
    play.textContent = state.playing ? "Pause" : "Play";
    speed.value = state.speed;
  }

  /** Take over state from outside, without telling it back. */
  function set(changes) {
    const started = changes.playing && !state.playing;
    Object.assign(state, changes);
    if ("frame" in changes) clock = state.frame * data.frame_time;
    showControls();
    requestDraw();
    if (started) {
      tickTime = 0;
      cancelAnimationFrame(tickRequest);
      tickRequest = requestAnimationFrame(tick);
    }
  }

  function change(changes) {
    set(changes);
    onChange(changes);
  }

  function tick(now) {
    if (!state.playing) return onChange({ frame: state.frame }); // where it stopped
    // A tab that was hidden must not jump ahead: count at most a tenth of a second.
    if (tickTime) clock += Math.min((now - tickTime) / 1000, 0.1) * state.speed;
    tickTime = now;
    const length = (last + 1) * step * data.frame_time;
    clock %= length;
    const frame = Math.min(Math.floor(clock / (step * data.frame_time) + 1e-6), last) * step;
    if (frame !== state.frame && root.isConnected) {
      state.frame = frame;
      showControls();
      draw();
      if (now - toldTime > 100) {
        toldTime = now; // ten messages a second are enough for the kernel
        onChange({ frame });
      }
    }
    tickRequest = requestAnimationFrame(tick);
  }

  function zoomBy(factor) {
    view.zoom = Math.min(8, Math.max(0.2, view.zoom * factor));
    requestDraw();
  }

  function orbit(yaw, pitch) {
    view.yaw += yaw;
    view.pitch = Math.min(1.5, Math.max(-0.2, view.pitch + pitch));
    requestDraw();
  }

  function resetView() {
    Object.assign(view, HOME);
    requestDraw();
  }

  // ---- what the reader does
  play.onclick = () => change({ playing: !state.playing });
  slider.oninput = () => change({ frame: Number(slider.value) * step });
  speed.onchange = () => change({ speed: Number(speed.value) });
  canvas.onpointerdown = (event) => canvas.setPointerCapture(event.pointerId);
  canvas.onpointermove = (event) => {
    if (event.buttons & 1) orbit(-event.movementX * 0.01, event.movementY * 0.01);
  };
  canvas.addEventListener("wheel", (event) => {
    if (document.activeElement !== canvas) return; // let the page scroll past the player
    event.preventDefault();
    zoomBy(Math.exp(-event.deltaY * 0.0015));
  }, { passive: false });
  canvas.onkeydown = (event) => {
    const action = {
      ArrowLeft: () => orbit(-0.1, 0), ArrowRight: () => orbit(0.1, 0),
      ArrowUp: () => orbit(0, 0.1), ArrowDown: () => orbit(0, -0.1),
      "+": () => zoomBy(1.25), "=": () => zoomBy(1.25), "-": () => zoomBy(1 / 1.25),
      0: resetView, " ": () => play.click(),
    }[event.key];
    if (!action || event.ctrlKey || event.metaKey || event.altKey) return;
    event.preventDefault();
    action();
  };
  root.addEventListener("keydown", (event) => {
    // A notebook's single-key shortcuts (arrows, d d, x) must not act on its cells while
    // the player has the focus. Shift+Enter and the Ctrl shortcuts still do.
    const forNotebook = event.ctrlKey || event.metaKey || event.altKey || event.key === "Escape";
    if (!forNotebook && !(event.shiftKey && event.key === "Enter")) event.stopPropagation();
  });

  const resized = new ResizeObserver(requestDraw);
  resized.observe(canvas);
  const rethemed = new MutationObserver(requestDraw);
  rethemed.observe(document.body, { attributes: true });
  set({});
  return {
    set,
    remove() {
      cancelAnimationFrame(tickRequest);
      resized.disconnect();
      rethemed.disconnect();
    },
  };
}

/** With a kernel: called by anywidget for every place where the player is displayed. */
async function render({ model, el }) {
  const data = await unpack(model.get("_meta"), model.get("_packed"));
  const names = ["frame", "playing", "speed"];
  // model.set() reports our own changes back, so remember them and take over only news:
  // setting the frame anew would hold up the clock of a playing clip.
  const current = {};
  const player = mount(el, data, (changes) => {
    Object.assign(current, changes);
    model.set(changes);
    model.save_changes();
  });
  const take = () => {
    const news = names.filter((name) => model.get(name) !== current[name]);
    for (const name of news) current[name] = model.get(name);
    if (news.length) player.set(Object.fromEntries(news.map((name) => [name, current[name]])));
  };
  take();
  for (const name of names) model.on(`change:${name}`, take);
  return () => {
    for (const name of names) model.off(`change:${name}`, take);
    player.remove();
  };
}

/** Without a kernel: fill every element of a class that has no player yet. */
export async function mountAll(name, meta, base64) {
  const bytes = Uint8Array.from(atob(base64), (c) => c.charCodeAt(0));
  const data = await unpack(meta, bytes);
  for (const element of document.querySelectorAll(`.${name}:not([data-mounted])`)) {
    element.dataset.mounted = "yes"; // a player shown twice on a page has two elements
    mount(element, data);
  }
}

export default { render };
