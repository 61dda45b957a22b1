// The lab: sliders, curves, errors, a map of widths and the 3D player, in step.
//
// What a Gaussian does to one channel is computed here, so that a slider answers at once.
// Another clip, noise or gap is a matter for Python: onWish asks for it, and load() takes
// what comes back, while the old picture stays.

const LAB_CSS = `
.mocaplab-lab .bar { border-bottom: 1px solid var(--jp-border-color2, #ccc); }
.mocaplab-lab .bar label > input[type=range] { width: 140px; flex: 0 1 140px; }
.mocaplab-lab .row { display: flex; flex-wrap: wrap; }
.mocaplab-lab .row > div { flex: 1 1 280px; min-width: 0; }
.mocaplab-lab h4 { margin: 8px 10px 2px; font: inherit; font-weight: 600; }
.mocaplab-lab h4 select { margin-left: 6px; font-weight: 400; }
.mocaplab-lab .note { padding: 6px 10px; }
.mocaplab-lab .note:empty { display: none; }
.mocaplab-lab .computing { opacity: 0; transition: opacity 0.1s; font-weight: 600; }
.mocaplab-lab.busy .computing { opacity: 1; }
.mocaplab-lab .mocaplab-player { border-width: 1px 0 0; border-radius: 0; max-width: none; }
`;
const SCALE = 1e-4; // degrees or milliseconds a step, as in lab/data.py
const WISH_DELAY_MS = 250;
const SIGNALS = ["clean", "observed", "EBF", "Blend"];

/** Turn what lab/data.py packed into data for mountLab. */
async function unpackLab(meta, packed, playerPacked) {
  const shape = [meta.frames, meta.channels.length];
  const arrays = await unpackSteps(packed, [...SIGNALS, "sigma"].map(() => shape), 4);
  const signals = Object.fromEntries(SIGNALS.map((name, i) => [name, arrays[i]]));
  const sigma = Float64Array.from(arrays[4], (v) => v * SCALE);
  return { ...meta, signals, sigma, body: await unpack(meta.player, playerPacked) };
}

/**
 * Build the lab inside an element.
 *
 * onChange({sigma_s | look_ahead_s | channel | frame}) is told what the reader did; onWish
 * asks for another clip or noise, and is null on a page without a kernel. Returns
 * {set(state), load(data), fail(message), remove()}.
 */
function mountLab(element, firstData, onChange = () => {}, onWish = null) {
  let data = firstData;
  let player = null;
  let wishTimer = 0;
  let drawRequest = 0;
  // What a change leaves as it is, is not drawn again.
  let errorsAreOld = true;
  let mapIsOld = true;
  let scope = "channel"; // or "all": what the errors are taken over
  const view = { ...HOME };
  const shown = { observed: true, Gaussian: true, EBF: true, Blend: true, clean: true };
  const look = { width: 0, lookAhead: 0, channel: 0, frame: 0, zoomed: false };

  // ---- the page elements
  const clip = makeSelect(data.choices.clips.map((name) => [name, name]), "Clip");
  const noise = makeSelect(data.choices.noises.map(({ name }) => [name, name]), "Noise");
  const slider = (aria, max, step = 1) =>
    make("input", { type: "range", min: 0, max, step, value: 0, aria });
  const amount = slider("Noise amount", 1, "any");
  const gap = slider("Gap length", data.choices.max_gap_s, 0.05);
  const joint = makeSelect([], "Joint");
  const channel = makeSelect([], "Channel");
  const width = slider("Gaussian sigma", data.widths_ms.length - 1);
  const ahead = slider("Look-ahead", data.look_aheads_ms.length - 1);
  const over = makeSelect([["channel", "of this channel"], ["all", "of all joint angles"]], "Error");
  const zoom = makeSelect([["whole", "whole clip"], ["second", "one second"]], "Shown time");
  const texts = Object.fromEntries(
    ["amount", "gap", "width", "ahead", "noise"].map((name) => [name, make("output")]));
  const computing = make("span", { className: "computing", textContent: "computing …" });
  const note = make("div", { className: "note hint" });
  note.setAttribute("role", "status");
  const swatches = {};
  const legend = Object.keys(ROLES).map((role) => {
    const box = make("input", { type: "checkbox", checked: true });
    box.onchange = () => ((shown[role] = box.checked), requestDraw());
    swatches[role] = make("span", { className: "swatch" });
    return make("label", {}, box, swatches[role], role);
  });
  const chart = (height, aria) => {
    const canvas = make("canvas", { aria, style: { height: `${height}px` } });
    canvas.setAttribute("role", "img");
    return canvas;
  };
  const curves = chart(210, "Curves of the channel over time");
  const errorCurve = chart(190, "Error of the Gaussian over its width");
  const bars = chart(190, "Error of each method");
  const map = chart(340, "Widths that EBF chose, by joint and time");
  const body = make("div");
  const title = make("h4", {});
  const mapTitle = "How widely EBF smooths, ms (click: go to that joint and time)";
  curves.style.cursor = map.style.cursor = "pointer";
  const label = (text, ...children) => make("label", {}, text, ...children);
  const root = make(
    "div",
    { className: "mocaplab-ui mocaplab-lab" },
    make("style", { textContent: BASE_CSS + LAB_CSS }),
    make("div", { className: "bar" }, label("clip", clip), label("noise", noise),
      label("amount", amount, texts.amount), label("gaps", gap, texts.gap), computing),
    make("div", { className: "bar" }, label("joint", joint), label("channel", channel),
      label("sigma", width, texts.width), label("look-ahead", ahead, texts.ahead)),
    note,
    make("div", { className: "bar" }, ...legend, label("show", zoom)),
    title,
    curves,
    make("div", { className: "row" },
      make("div", {}, make("h4", {}, "Error over sigma", over), errorCurve),
      make("div", {}, make("h4", {}, "Error by method", texts.noise), bars)),
    make("div", { className: "row" },
      make("div", {}, make("h4", { textContent: mapTitle }), map),
      body),
  );
  element.replaceChildren(root);

  // ---- what is shown
  const jointOf = () => data.channels[look.channel][0];
  const column = (name) => {
    const all = data.signals[name];
    const n = data.channels.length;
    return Float64Array.from({ length: data.frames }, (_, t) => all[t * n + look.channel] * SCALE);
  };
  const smooth = (index) =>
    gaussianFilter(look.curves.observed, data.widths_ms[index] / 1000 / data.frame_time,
      data.look_ahead_frames[look.lookAhead]);

  /** Another channel: fetch its curves. */
  function takeChannel() {
    look.joint = jointOf();
    look.curves = Object.fromEntries(SIGNALS.map((name) => [name, column(name)]));
    takeErrors();
    takeWidth();
  }

  /** Another channel or look-ahead: the error at every width. */
  function takeErrors() {
    if (scope === "all") {
      look.errors = { ...data.rms, curve: data.gaussian_rms[look.lookAhead] };
      return;
    }
    const { clean } = look.curves;
    const of = (values) => rmsError(values, clean);
    look.errors = {
      curve: data.widths_ms.map((_, index) => of(smooth(index))),
      observed: of(look.curves.observed), EBF: of(look.curves.EBF), Blend: of(look.curves.Blend),
    };
  }

  function takeWidth() {
    look.curves.Gaussian = smooth(look.width);
  }

  function draw() {
    drawRequest = 0;
    if (!root.clientWidth) return; // hidden
    const dark = isDark(root);
    const ink = getComputedStyle(root).color;
    look.style = (role) => ({ ...ROLES[role], colour: ROLES[role][dark ? "dark" : "light"] || ink });
    for (const role of Object.keys(ROLES)) swatches[role].style.background = look.style(role).colour;
    const frameAt = drawCurves(curves, look);
    if (errorsAreOld) {
      drawErrorCurve(errorCurve, look);
      drawBars(bars, look);
      errorsAreOld = false;
    }
    curves.onclick = ({ offsetX }) => frameAt && change({ frame: frameAt(offsetX) });
    if (!mapIsOld) return;
    const placeAt = drawWidths(map, look);
    map.onclick = ({ offsetX, offsetY }) => {
      const place = placeAt && placeAt(offsetX, offsetY);
      if (place) change({ frame: place.frame, channel: firstChannel(place.joint) });
    };
    mapIsOld = false;
  }

  function requestDraw(changes = null) {
    const others = changes && Object.keys(changes).filter((name) => name !== "frame");
    errorsAreOld = errorsAreOld || !changes || others.length > 0;
    mapIsOld = mapIsOld || !changes || "frame" in changes || "channel" in changes;
    if (!drawRequest) drawRequest = requestAnimationFrame(draw);
  }

  function showControls() {
    const [jointIndex, kind, name] = data.channels[look.channel];
    joint.value = jointIndex;
    const own = data.channels.map((c, i) => [i, c[1], c[0]]).filter((c) => c[2] === jointIndex);
    channel.replaceChildren(...makeSelect(own, "").children);
    channel.value = look.channel;
    width.value = look.width;
    ahead.value = look.lookAhead;
    const cut = data.look_aheads_ms[look.lookAhead];
    texts.width.textContent = `${data.widths_ms[look.width].toFixed(1)} ms`;
    texts.ahead.textContent = cut === null ? "whole clip" : `${cut.toFixed(0)} ms`;
    width.setAttribute("aria-valuetext", texts.width.textContent);
    ahead.setAttribute("aria-valuetext", texts.ahead.textContent);
    const at = (look.frame * data.frame_time).toFixed(2);
    title.textContent = `${data.settings.clip}: ${name} (frame ${look.frame}, ${at} s)`;
    texts.noise.textContent = scope === "all"
      ? ` over all joint angles; over those that move, all times ${data.moving_factor.toFixed(2)}`
      : ` over ${name}`;
  }

  function showWish() {
    const chosen = data.choices.noises.find(({ name }) => name === noise.value);
    amount.max = chosen.max;
    texts.amount.textContent = `${Number(amount.value).toPrecision(2)} ${chosen.unit}`;
    noise.title = chosen.summary;
    texts.gap.textContent = gap.value > 0 ? `${Number(gap.value).toFixed(2)} s in 3 joints` : "none";
  }

  function firstChannel(jointIndex) {
    return data.channels.findIndex(([j]) => j === jointIndex);
  }

  // ---- changes
  const told = {
    width: () => ({ sigma_s: data.widths_ms[look.width] / 1000 }),
    lookAhead: () => ({ look_ahead_s: data.look_aheads_s[look.lookAhead] }),
    channel: () => ({ channel: data.channels[look.channel][2] }),
    frame: () => ({ frame: look.frame }),
  };

  /** Take over a change of look; follow it in the player unless it came from there. */
  function apply(changes, fromPlayer = false) {
    Object.assign(look, changes);
    if ("channel" in changes) takeChannel();
    else if ("lookAhead" in changes) (takeErrors(), takeWidth());
    else if ("width" in changes) takeWidth();
    showControls();
    requestDraw(changes);
    if (!player) return;
    if ("channel" in changes) player.set({ picked: data.joints[look.joint] });
    if ("frame" in changes && !fromPlayer) player.set({ frame: look.frame });
  }

  function change(changes, fromPlayer = false) {
    apply(changes, fromPlayer);
    onChange(Object.assign({}, ...Object.keys(changes).map((name) => told[name]())));
  }

  /** Take over state from Python. */
  function set(state) {
    const changes = {};
    if ("sigma_s" in state) changes.width = nearest(data.widths_ms, 1000 * state.sigma_s);
    if ("look_ahead_s" in state) {
      changes.lookAhead = Math.max(0, data.look_aheads_s.indexOf(state.look_ahead_s));
    }
    if ("channel" in state) {
      changes.channel = Math.max(0, data.channels.findIndex((c) => c[2] === state.channel));
    }
    if ("frame" in state) changes.frame = Math.min(state.frame, data.frames - 1);
    apply(changes);
  }

  function fromPlayer(changes) {
    if ("frame" in changes) change({ frame: changes.frame }, true);
    if (changes.picked) {
      const found = firstChannel(data.joints.indexOf(changes.picked));
      if (found >= 0) change({ channel: found });
      else note.textContent = `${changes.picked} does not move in this clip.`;
    }
  }

  /** Show other data. */
  function load(news) {
    data = look.data = news;
    root.classList.remove("busy");
    note.textContent = onWish ? "" : "Saved page: clip, noise and gaps stay; all else moves.";
    const { settings } = data;
    [clip.value, noise.value] = [settings.clip, settings.noise];
    amount.max = 1e9; // or the old limit would cut the new amount
    [amount.value, gap.value] = [settings.amount, settings.gap_s];
    for (const control of [clip, noise, amount, gap]) control.disabled = !onWish;
    showWish();
    joint.replaceChildren(...makeSelect(data.joints.map((name, j) => {
      const hidden = data.gaps.some(([c]) => data.channels[c][0] === j);
      return [j, hidden ? `${name} (gap)` : name];
    }), "").children);
    look.seconds = Array.from({ length: data.frames }, (_, t) => t * data.frame_time);
    look.widths = paintWidths(data, data.sigma);
    if (player) player.remove();
    player = mount(body, data.body, fromPlayer, view);
    set(data.start);
  }

  function wish() {
    showWish();
    clearTimeout(wishTimer);
    wishTimer = setTimeout(() => {
      root.classList.add("busy");
      onWish({ clip: clip.value, noise: noise.value, amount: Number(amount.value), gap_s: Number(gap.value) });
    }, WISH_DELAY_MS);
  }

  clip.onchange = wish;
  amount.oninput = gap.oninput = wish;
  noise.onchange = () => {
    const chosen = data.choices.noises.find(({ name }) => name === noise.value);
    amount.max = chosen.max;
    amount.value = chosen.max / 2;
    wish();
  };
  joint.onchange = () => change({ channel: firstChannel(Number(joint.value)) });
  channel.onchange = () => change({ channel: Number(channel.value) });
  width.oninput = () => change({ width: Number(width.value) });
  ahead.oninput = () => change({ lookAhead: Number(ahead.value) });
  zoom.onchange = () => {
    look.zoomed = zoom.value === "second";
    requestDraw();
  };
  over.onchange = () => {
    scope = over.value;
    takeErrors();
    showControls();
    requestDraw();
  };
  keepKeys(root);
  const forget = onNewLook(curves, () => requestDraw());
  Object.assign(look, { shown });
  load(data);
  return {
    set,
    load,
    fail(message) {
      root.classList.remove("busy");
      note.textContent = message;
    },
    remove() {
      clearTimeout(wishTimer);
      cancelAnimationFrame(drawRequest);
      forget();
      player.remove();
    },
  };
}

function nearest(values, wanted) {
  let best = 0;
  values.forEach((v, i) => {
    if (Math.abs(v - wanted) < Math.abs(values[best] - wanted)) best = i;
  });
  return best;
}

const LAB_STATE = ["sigma_s", "look_ahead_s", "channel", "frame"];

/** With a kernel. */
async function renderLab({ model, el }) {
  const fetched = async () => {
    const [meta, ...packed] = ["_meta", "_packed", "_player_packed"].map((name) => model.get(name));
    const start = Object.fromEntries(LAB_STATE.map((name) => [name, model.get(name)]));
    return unpackLab({ ...meta, start }, ...packed);
  };
  let tell = () => {};
  const lab = mountLab(el, await fetched(), (changes) => tell(changes), (wish) => model.send({ wish }));
  const link = linkModel(model, LAB_STATE, lab.set);
  tell = link[0];
  const reload = async () => lab.load(await fetched());
  const listen = (message) => message.error && lab.fail(message.error);
  model.on("change:_meta", reload);
  model.on("msg:custom", listen);
  return () => {
    model.off("change:_meta", reload);
    model.off("msg:custom", listen);
    link[1]();
    lab.remove();
  };
}

/** Without a kernel. */
export async function mountLabs(name, meta, packed, playerPacked) {
  const data = await unpackLab(meta, bytesOf(packed), bytesOf(playerPacked));
  for (const element of unfilled(name)) mountLab(element, data);
}
