// The skeleton player.
//
// mount(element, data) builds it. It is used by render(), which a notebook with a running
// kernel calls, by mountAll(), which a saved page calls, and by the lab.
// World axes as in BVH files: Y is up. Lengths are in file units until project().

const PLAYER_CSS = `
.mocaplab-player canvas.view { touch-action: none; cursor: grab; }
.mocaplab-player canvas.view:active { cursor: grabbing; }
.mocaplab-player .bar { border-top: 1px solid var(--jp-border-color2, #ccc); }
.mocaplab-player .bar.legend { border-top: 0; border-bottom: 1px solid var(--jp-border-color2, #ccc); }
.mocaplab-player .hint { margin-left: auto; }
.mocaplab-player button.play { min-width: 62px; font-weight: 600; }
`;

// Okabe and Ito's colours; the blue is lighter where the background is dark.
const ON_LIGHT = ["#0072B2", "#D55E00", "#009E73", "#CC79A7"];
const ON_DARK = ["#56B4E9", "#E69F00", "#009E73", "#CC79A7"];
const HOME = { yaw: 0.7, pitch: 0.22, zoom: 1 };
const SPEEDS = [0.25, 0.5, 1, 2];
const GRID_CELLS = 10; // on each side of the figure
const HELP = "drag: turn; click a joint: its curve; wheel after a click: zoom";
const TRAIL_S = 1;
const CLICK_PX = 4; // a pointer that moves further has turned the view
const REACH_PX = 16; // how far from a joint a click still picks it

/** Turn what widgets.py packed into positions. */
async function unpack(meta, bytes) {
  const shapes = meta.motions.map(({ frames, points }) => [frames, 3 * points]);
  const steps = await unpackSteps(bytes, shapes, 2);
  const positions = steps.map((part) =>
    Float32Array.from(part, (v, i) => v * meta.scale + meta.origin[i % 3]));
  return { ...meta, positions };
}

/**
 * Build a player inside an element.
 *
 * data: what unpack() returns. onChange({frame | playing | speed | picked}) is told what
 * the reader did. view: where it is seen from, which a later player may take over.
 * Returns {set(state), remove()}.
 */
export function mount(element, data, onChange = () => {}, view = { ...HOME }) {
  const { step, size, ground } = data;
  const last = Math.ceil(data.frames / step) - 1; // index of the last stored frame
  const state = { frame: 0, playing: false, speed: 1, picked: "" };
  const shown = data.motions.map(() => true);
  let clock = 0; // seconds into the clip
  let drawRequest = 0;
  let tickRequest = 0;
  let tickTime = 0;
  let toldTime = 0;

  // ---- the page elements
  const canvas = make("canvas", {
    tabIndex: 0, className: "view", style: { height: `${data.height}px` },
  });
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
  const trails = make("input", { type: "checkbox", onchange: () => requestDraw() });
  const strip = make("canvas", { style: { height: "110px", cursor: "pointer", display: "none" } });
  const root = make(
    "div",
    { className: "mocaplab-ui mocaplab-player" },
    make("style", { textContent: BASE_CSS + PLAYER_CSS }),
    make("div", { className: "bar legend" }, ...legend,
      make("span", { className: "hint", textContent: HELP })),
    canvas,
    strip,
    make("div", { className: "bar" }, play, slider, readout,
      make("label", {}, "speed", speed),
      make("label", {}, trails, "trails"),
      make("span", { className: "together" },
        button("−", "Zoom out", () => zoomBy(1 / 1.25)),
        button("+", "Zoom in", () => zoomBy(1.25)),
        button("Reset view", "Reset view", resetView))),
  );
  element.replaceChildren(root);
  let pen = null;

  // ---- drawing
  let W = 0;
  let H = 0;
  let target = [0, 0, 0];
  let turn = null; // sines and cosines of the view, and its scale

  /** Point k of motion m; a shorter clip stays in its last pose. */
  function point(m, k, index) {
    const { points, frames } = data.motions[m];
    const start = 3 * (points * Math.min(index, frames - 1) + k);
    return data.positions[m].subarray(start, start + 3);
  }

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
    const { bones, points, joints, names } = data.motions[m];
    const at = (k) => point(m, k, Math.floor(state.frame / step));
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
    const picked = names.indexOf(state.picked);
    if (picked >= 0) mark(...places[picked], thick, ink, m === shown.lastIndexOf(true));
    pen.globalAlpha = 1;
  }

  /** Put a ring around a joint, and its name beside it: once, or names would overlap. */
  function mark(x, y, thick, ink, named) {
    pen.strokeStyle = pen.fillStyle = ink;
    pen.lineWidth = 2;
    pen.beginPath();
    pen.arc(x, y, thick + 4, 0, 2 * Math.PI);
    pen.stroke();
    pen.font = "12px system-ui, sans-serif";
    if (named) pen.fillText(state.picked, x + thick + 8, y - 4);
  }

  /** Draw where the picked joint was in the last second, or the ends of all limbs. */
  function drawTrails(m, colour) {
    const { points, joints, names } = data.motions[m];
    const picked = names.indexOf(state.picked);
    const ends = Array.from({ length: points - joints }, (_, e) => joints + e);
    const now = Math.floor(state.frame / step);
    const first = Math.max(0, now - Math.round(TRAIL_S / (step * data.frame_time)));
    pen.strokeStyle = colour;
    pen.globalAlpha = 0.55;
    pen.lineWidth = 1.5;
    pen.beginPath();
    for (const k of picked >= 0 ? [picked] : ends) {
      for (let i = first; i < now; i++) line(project(...point(m, k, i)), project(...point(m, k, i + 1)));
    }
    pen.stroke();
    pen.globalAlpha = 1;
  }

  /** Draw how high the picked joint is over time, of every figure that is shown. */
  function drawStrip(colours) {
    const found = data.motions.map(({ names }) => names.indexOf(state.picked));
    const visible = found.map((k, m) => shown[m] && k >= 0);
    const wanted = data.strip && visible.some(Boolean);
    strip.style.display = wanted ? "block" : "none";
    if (!wanted) return;
    const seconds = Array.from({ length: last + 1 }, (_, i) => i * step * data.frame_time);
    const heights = found.map((k, m) =>
      visible[m] ? seconds.map((_, i) => point(m, k, i)[1] - ground) : []);
    const paper = axes(strip, {
      x: [0, seconds[last] || 1], y: span(heights),
      xLabel: "time, s", yLabel: "height, units",
    });
    if (!paper) return;
    heights.forEach((ys, m) => curve(paper, seconds, ys, { colour: colours[m], width: 1.6 }));
    upright(paper, state.frame * data.frame_time);
    strip.onclick = ({ offsetX }) => {
      const share = (offsetX - paper.box.left) / (paper.box.right - paper.box.left);
      change({ frame: Math.round(Math.min(1, Math.max(0, share)) * last) * step });
    };
  }

  function draw() {
    drawRequest = 0;
    const paper = fit(canvas);
    if (!paper) return; // hidden; called again when that changes
    ({ pen, width: W, height: H } = paper);
    const ink = getComputedStyle(root).color;
    const palette = isDark(root) ? data.dark || ON_DARK : data.light || ON_LIGHT;
    const colours = palette.map((colour) => colour || ink);

    // Follow the root of the first clip along the ground, not its bobbing.
    const [rootX, , rootZ] = point(0, 0, Math.floor(state.frame / step));
    target = [rootX, data.middle, rootZ];
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
      if (visible && trails.checked) drawTrails(m, colours[m]);
      if (visible) drawFigure(m, colours[m], ink);
    });
    drawStrip(colours);
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

  /** Pick the joint that is nearest to a place on the canvas; none, if none is near. */
  function pick(x, y) {
    let [picked, nearest] = ["", REACH_PX];
    data.motions.forEach(({ joints, names }, m) => {
      if (!shown[m]) return;
      for (let k = 0; k < joints; k++) {
        const [px, py] = project(...point(m, k, Math.floor(state.frame / step)));
        const far = Math.hypot(px - x, py - y);
        if (far < nearest) [picked, nearest] = [names[k], far];
      }
    });
    if (picked !== state.picked) change({ picked });
  }

  // ---- what the reader does
  play.onclick = () => change({ playing: !state.playing });
  slider.oninput = () => change({ frame: Number(slider.value) * step });
  speed.onchange = () => change({ speed: Number(speed.value) });
  let pressed = [0, 0];
  canvas.onpointerdown = (event) => {
    canvas.setPointerCapture(event.pointerId);
    pressed = [event.offsetX, event.offsetY];
  };
  canvas.onpointerup = ({ offsetX, offsetY }) => {
    if (Math.hypot(offsetX - pressed[0], offsetY - pressed[1]) < CLICK_PX) pick(offsetX, offsetY);
  };
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
  keepKeys(root);
  const forget = onNewLook(canvas, requestDraw);
  set({});
  return {
    set,
    remove() {
      cancelAnimationFrame(tickRequest);
      cancelAnimationFrame(drawRequest);
      forget();
    },
  };
}

/** With a kernel: called by anywidget for every place where the player is displayed. */
async function render({ model, el }) {
  const data = await unpack(model.get("_meta"), model.get("_packed"));
  let tell = () => {};
  const player = mount(el, data, (changes) => tell(changes));
  const link = linkModel(model, ["frame", "playing", "speed", "picked"], player.set);
  tell = link[0];
  return () => (link[1](), player.remove());
}

/** Without a kernel: fill every element of a class that has no player yet. */
export async function mountAll(name, meta, base64) {
  const data = await unpack(meta, bytesOf(base64));
  for (const element of unfilled(name)) mount(element, data);
}
