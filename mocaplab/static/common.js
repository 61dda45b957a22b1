// What the player and the lab share. The files of this folder import nothing: Python
// joins those that a widget needs into one module, which fetches nothing either.

const BASE_CSS = `
.mocaplab-ui { color: var(--jp-ui-font-color1, #222); background: var(--jp-layout-color0, #fff);
  border: 1px solid var(--jp-border-color2, #ccc); border-radius: 4px; box-sizing: border-box;
  font: 13px/1.4 var(--jp-ui-font-family, system-ui, sans-serif); width: 100%; max-width: 1000px; }
.mocaplab-ui canvas { display: block; width: 100%; }
.mocaplab-ui .bar { display: flex; flex-wrap: wrap; gap: 6px 10px; align-items: center;
  padding: 6px 10px; }
.mocaplab-ui .bar label { display: inline-flex; gap: 5px; align-items: center; margin: 0; }
.mocaplab-ui .together { display: inline-flex; gap: 6px; }
.mocaplab-ui .swatch { display: inline-block; width: 22px; height: 5px; border-radius: 3px; }
.mocaplab-ui .hint { color: var(--jp-ui-font-color2, #595959); font-size: 12px; }
.mocaplab-ui button, .mocaplab-ui select { font: inherit; color: inherit; cursor: pointer;
  background: var(--jp-layout-color2, #eee); border: 1px solid var(--jp-border-color1, #bbb);
  border-radius: 3px; padding: 2px 9px; min-height: 26px; margin: 0; width: auto; }
.mocaplab-ui option { color: var(--jp-ui-font-color1, #222); background: var(--jp-layout-color2, #eee); }
.mocaplab-ui :is(button, select, input):disabled { opacity: 0.55; cursor: not-allowed; }
.mocaplab-ui input[type=range] { flex: 1 1 160px; min-width: 90px; margin: 0;
  accent-color: var(--jp-brand-color1, #1565c0); }
.mocaplab-ui input[type=checkbox] { margin: 0; }
.mocaplab-ui output { font-variant-numeric: tabular-nums; white-space: nowrap; }
.mocaplab-ui :is(button, select, input, canvas):focus-visible {
  outline: 2px solid var(--jp-brand-color1, #1565c0); outline-offset: 1px; }
`;

function make(tag, properties = {}, ...children) {
  const { style, aria, ...rest } = properties;
  const node = Object.assign(document.createElement(tag), rest);
  Object.assign(node.style, style);
  if (aria) node.setAttribute("aria-label", aria);
  node.append(...children);
  return node;
}

function makeSelect(entries, aria) {
  const options = entries.map(([value, textContent]) => make("option", { value, textContent }));
  return make("select", { aria }, ...options);
}

/**
 * Keep keys from the notebook around a widget. Its single-key shortcuts (arrows, d d, x)
 * must not act on its cells while the widget has the focus. Shift+Enter and Ctrl still do.
 */
function keepKeys(root) {
  root.addEventListener("keydown", (event) => {
    const forNotebook = event.ctrlKey || event.metaKey || event.altKey || event.key === "Escape";
    if (!forNotebook && !(event.shiftKey && event.key === "Enter")) event.stopPropagation();
  });
}

/** Whether an element's own background is dark. */
function isDark(element) {
  const [r, g, b] = getComputedStyle(element).backgroundColor.match(/[\d.]+/g).map(Number);
  return 0.3 * r + 0.59 * g + 0.11 * b < 128;
}

/** Call redraw when the size of an element or the theme of the page changes. */
function onNewLook(element, redraw) {
  const resized = new ResizeObserver(redraw);
  const rethemed = new MutationObserver(redraw);
  resized.observe(element);
  rethemed.observe(document.body, { attributes: true });
  return () => (resized.disconnect(), rethemed.disconnect());
}

/**
 * Undo pack_steps of packing.py: zlib, byte planes, differences from frame to frame.
 *
 * shapes: of every array, [frames, numbers a frame]. size: bytes a number, 2 or 4.
 */
async function unpackSteps(bytes, shapes, size) {
  const stream = new Blob([bytes]).stream().pipeThrough(new DecompressionStream("deflate"));
  const planes = new Uint8Array(await new Response(stream).arrayBuffer());
  const count = planes.length / size;
  const values = new (size === 2 ? Int16Array : Int32Array)(count);
  for (let i = 0; i < count; i++) {
    let value = 0;
    for (let b = 0; b < size; b++) value |= planes[b * count + i] << (8 * b);
    values[i] = value;
  }
  let start = 0;
  return shapes.map(([frames, width]) => {
    const part = values.subarray(start, (start += frames * width));
    for (let i = width; i < part.length; i++) part[i] += part[i - width]; // wraps, as in Python
    return part;
  });
}

function bytesOf(base64) {
  return Uint8Array.from(atob(base64), (c) => c.charCodeAt(0));
}

/** The elements of a class that nothing was put into yet: a page may show one thing twice. */
function unfilled(name) {
  const elements = [...document.querySelectorAll(`.${name}:not([data-mounted])`)];
  for (const element of elements) element.dataset.mounted = "yes";
  return elements;
}

/**
 * Keep a widget and its Python side in step. set(changes) takes news into the widget;
 * returns [tell, stop]: tell(changes) reports what the reader did.
 *
 * model.set() reports our own changes back, so they are remembered and only news is taken.
 */
function linkModel(model, names, set) {
  const current = {};
  const take = () => {
    const news = names.filter((name) => model.get(name) !== current[name]);
    for (const name of news) current[name] = model.get(name);
    if (news.length) set(Object.fromEntries(news.map((name) => [name, current[name]])));
  };
  const tell = (changes) => {
    Object.assign(current, changes);
    model.set(changes);
    model.save_changes();
  };
  for (const name of names) model.on(`change:${name}`, take);
  take();
  return [tell, () => names.forEach((name) => model.off(`change:${name}`, take))];
}
