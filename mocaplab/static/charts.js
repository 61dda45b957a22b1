// Small charts on a canvas: axes with round numbers, curves, a moment in time.

/** Fit a canvas to its place on the page, in the screen's own pixels; null while hidden. */
function fit(canvas) {
  const ratio = window.devicePixelRatio || 1;
  const [width, height] = [canvas.clientWidth, canvas.clientHeight];
  if (!width || !height) return null;
  const [w, h] = [Math.round(width * ratio), Math.round(height * ratio)];
  if (canvas.width !== w || canvas.height !== h) [canvas.width, canvas.height] = [w, h];
  const pen = canvas.getContext("2d");
  pen.setTransform(ratio, 0, 0, ratio, 0, 0);
  pen.clearRect(0, 0, width, height);
  return { pen, width, height };
}

/** About n round numbers between low and high. */
function ticks(low, high, n) {
  const rough = (high - low) / n || 1;
  const power = 10 ** Math.floor(Math.log10(rough));
  const step = [1, 2, 5, 10].map((f) => f * power).find((s) => s >= rough * 0.999);
  const first = Math.ceil(low / step - 1e-9);
  const last = Math.floor(high / step + 1e-9);
  const found = [];
  for (let i = first; i <= last; i++) found.push(Number((i * step).toPrecision(10)));
  return found;
}

/** The smallest and the largest of some arrays, with a little room; never of width 0. */
function span(arrays, floor) {
  let [low, high] = [Infinity, -Infinity];
  for (const values of arrays) {
    for (const v of values) {
      if (v < low) low = v;
      if (v > high) high = v;
    }
  }
  if (floor !== undefined) low = floor;
  const room = 0.06 * (high - low) || 1;
  return [floor === undefined ? low - room : low, high + room];
}

/**
 * Clear a canvas and draw axes. Returns {pen, x, y, box}: x and y turn numbers into
 * pixels, box is where the curves go; null while the canvas is hidden.
 */
function axes(canvas, { x: [x0, x1], y: [y0, y1], xLabel, yLabel, xTicks, log = false }) {
  const paper = fit(canvas);
  if (!paper) return null;
  const { pen, width, height } = paper;
  const box = { left: 52, right: width - 12, top: 10, bottom: height - 34 };
  const scale = log ? Math.log : (v) => v;
  const x = (v) =>
    box.left + ((scale(v) - scale(x0)) / (scale(x1) - scale(x0))) * (box.right - box.left);
  const y = (v) => box.bottom - ((v - y0) / (y1 - y0)) * (box.bottom - box.top);
  const ink = getComputedStyle(canvas).color;
  Object.assign(pen, { font: "12px system-ui, sans-serif", lineWidth: 1 });
  pen.strokeStyle = pen.fillStyle = ink;
  pen.textAlign = "center";
  for (const v of xTicks || ticks(x0, x1, width / 90)) {
    rule(pen, x(v), box.top, x(v), box.bottom, 0.13);
    pen.fillText(String(v), x(v), box.bottom + 14);
  }
  pen.fillText(xLabel, (box.left + box.right) / 2, height - 5);
  pen.textAlign = "right";
  for (const v of ticks(y0, y1, height / 45)) {
    rule(pen, box.left, y(v), box.right, y(v), 0.13);
    pen.fillText(String(v), box.left - 5, y(v) + 4);
  }
  rule(pen, box.left, box.bottom, box.right, box.bottom, 0.6);
  rule(pen, box.left, box.top, box.left, box.bottom, 0.6);
  pen.save();
  pen.translate(13, (box.top + box.bottom) / 2);
  pen.rotate(-Math.PI / 2);
  pen.textAlign = "center";
  pen.fillText(yLabel, 0, 0);
  pen.restore();
  return { pen, x, y, box, ink };
}

function rule(pen, ax, ay, bx, by, alpha = 1) {
  pen.globalAlpha = alpha;
  pen.beginPath();
  pen.moveTo(ax, ay);
  pen.lineTo(bx, by);
  pen.stroke();
  pen.globalAlpha = 1;
}

/** Draw a curve; dash tells curves apart where colour does not. */
function curve({ pen, x, y, box }, xs, ys, { colour, width = 2, dash = [], alpha = 1 }) {
  pen.save();
  pen.beginPath();
  pen.rect(box.left, box.top, box.right - box.left, box.bottom - box.top);
  pen.clip();
  Object.assign(pen, { strokeStyle: colour, lineWidth: width, globalAlpha: alpha, lineJoin: "round" });
  pen.setLineDash(dash);
  pen.beginPath();
  for (let i = 0; i < ys.length; i++) pen.lineTo(x(xs[i]), y(ys[i]));
  pen.stroke();
  pen.restore();
}

/** Mark a place on the x axis with a line from top to bottom. */
function upright({ pen, x, box, ink }, at, dash = []) {
  pen.save();
  Object.assign(pen, { strokeStyle: ink, lineWidth: 1.2 });
  pen.setLineDash(dash);
  rule(pen, x(at), box.top, x(at), box.bottom, 0.8);
  pen.restore();
}
