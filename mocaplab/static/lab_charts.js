// The four pictures of the lab. Each takes a canvas and `look`, which lab.js prepares:
// what is shown now, and in which colours.

// Colours of Okabe and Ito on a light and on a dark page, the same as in plotting.py;
// null is the colour of the text. Dashes tell the curves apart without colour.
const ROLES = {
  observed: { light: "#999999", dark: "#9a9a9a", dash: [], width: 1 },
  Gaussian: { light: "#E69F00", dark: "#E69F00", dash: [], width: 2.2 },
  EBF: { light: "#0072B2", dark: "#56B4E9", dash: [9, 3], width: 2 },
  Blend: { light: "#009E73", dark: "#20C997", dash: [2, 2], width: 2.2 },
  clean: { light: null, dark: null, dash: [6, 4], width: 1.6 },
};
const CIVIDIS = [[0, 34, 78], [53, 69, 108], [102, 105, 112], [148, 142, 119], [200, 184, 102], [253, 231, 55]];

function cividis(share) {
  const place = Math.min(0.9999, Math.max(0, share)) * (CIVIDIS.length - 1);
  const i = Math.floor(place);
  return CIVIDIS[i].map((low, k) => low + (place - i) * (CIVIDIS[i + 1][k] - low));
}

/** The curves of one channel over time. Returns a function from pixels to a frame. */
function drawCurves(canvas, look) {
  const { data, curves, shown, seconds } = look;
  const visible = Object.keys(ROLES).filter((role) => shown[role]);
  const [first, last] = shownFrames(look);
  const part = (role) => curves[role].subarray(first, last + 1);
  const paper = axes(canvas, {
    x: [seconds[first], seconds[last] || 1],
    y: span(visible.length ? visible.map(part) : [part("clean")]),
    xLabel: "time, s",
    yLabel: "angle, degrees",
  });
  if (!paper) return null;
  const { pen, x, box, ink } = paper;
  pen.fillStyle = ink;
  pen.globalAlpha = 0.12;
  for (const [channel, start, stop] of data.gaps) {
    if (channel !== look.channel) continue;
    const [left, right] = [start, stop - 1].map((t) => x(seconds[Math.max(first, Math.min(last, t))]));
    pen.fillRect(left, box.top, right - left, box.bottom - box.top);
  }
  pen.globalAlpha = 1;
  for (const role of visible) curve(paper, seconds, curves[role], look.style(role));
  upright(paper, seconds[look.frame]);
  return (px) => nearestFrame(px, box, first, last);
}

/** The first and the last frame of the curves: all, or a second around the present one. */
function shownFrames({ data, frame, zoomed }) {
  const half = Math.round(0.5 / data.frame_time);
  if (!zoomed || 2 * half >= data.frames) return [0, data.frames - 1];
  const first = Math.min(Math.max(0, frame - half), data.frames - 1 - 2 * half);
  return [first, first + 2 * half];
}

function nearestFrame(px, box, first, last) {
  const share = (px - box.left) / (box.right - box.left);
  return first + Math.round(Math.min(1, Math.max(0, share)) * (last - first));
}

/** The error of the Gaussian over its width, and where the networks stand. */
function drawErrorCurve(canvas, look) {
  const { data, errors } = look;
  const widths = data.widths_ms;
  const levels = { observed: errors.observed, EBF: errors.EBF, Blend: errors.Blend };
  const top = Math.max(...errors.curve, ...Object.values(levels)) || 1;
  const paper = axes(canvas, {
    x: [widths[0], widths[widths.length - 1]],
    y: [0, 1.06 * top],
    xTicks: [2, 4, 8, 16, 32, 64, 125],
    log: true,
    xLabel: "width sigma of the Gaussian, ms",
    yLabel: "RMS error, degrees",
  });
  if (!paper) return;
  const { pen, x, y, ink, box } = paper;
  const ends = [widths[0], widths[widths.length - 1]];
  for (const [role, level] of Object.entries(levels)) {
    curve(paper, ends, [level, level], look.style(role));
  }
  curve(paper, widths, errors.curve, look.style("Gaussian"));
  const tuned = widths[data.tuned[look.lookAhead]];
  upright(paper, tuned, [4, 4]);
  pen.fillStyle = ink;
  const right = x(tuned) < (box.left + box.right) / 2;
  pen.textAlign = right ? "left" : "right";
  pen.fillText(`tuned on other clips: ${tuned.toFixed(0)} ms`, x(tuned) + (right ? 5 : -5), box.top + 11);
  const [px, py] = [x(widths[look.width]), y(errors.curve[look.width])];
  pen.fillStyle = look.style("Gaussian").colour;
  pen.strokeStyle = ink;
  pen.lineWidth = 1.5;
  pen.beginPath();
  pen.arc(px, py, 6, 0, 2 * Math.PI);
  pen.fill();
  pen.stroke();
}

/** A bar for every method. */
function drawBars(canvas, look) {
  const paper = fit(canvas);
  if (!paper) return;
  const { pen, width, height } = paper;
  const ink = getComputedStyle(canvas).color;
  const { errors, data } = look;
  const ms = (index) => data.widths_ms[index].toFixed(0);
  const tuned = data.tuned[look.lookAhead];
  const rows = [
    ["observed", "observed", errors.observed],
    [`Gaussian ${ms(look.width)} ms`, "Gaussian", errors.curve[look.width]],
    [`tuned, ${ms(tuned)} ms`, "Gaussian", errors.curve[tuned]],
    ["EBF", "EBF", errors.EBF],
    ["Blend", "Blend", errors.Blend],
  ];
  const [left, right, title] = [112, width - 46, 20];
  const longest = Math.max(...rows.map((row) => row[2])) || 1;
  const step = (height - title - 6) / rows.length;
  pen.font = "12px system-ui, sans-serif";
  pen.fillStyle = ink;
  pen.fillText("RMS error, degrees", left, 13);
  rows.forEach(([label, role, error], i) => {
    const middle = title + (i + 0.5) * step;
    const length = Math.max(1, ((right - left) * error) / longest);
    pen.fillStyle = look.style(role).colour;
    pen.fillRect(left, middle - 0.32 * step, length, 0.64 * step);
    pen.fillStyle = ink;
    pen.textAlign = "right";
    pen.fillText(label, left - 6, middle + 4);
    pen.textAlign = "left";
    pen.fillText(error < 0.995 ? error.toFixed(3) : error.toFixed(2), left + length + 5, middle + 4);
  });
}

/**
 * Paint the widths that EBF chose, a row a joint: its mean over the joint's channels. The
 * picture stays the same until other data come. Returns {image, highest}, in ms.
 */
function paintWidths(data, sigma) {
  const { frames, joints, channels } = data;
  const means = new Float64Array(frames * joints.length);
  const counts = joints.map((_, j) => channels.filter(([joint]) => joint === j).length);
  channels.forEach(([joint], c) => {
    for (let t = 0; t < frames; t++) {
      means[joint * frames + t] += sigma[t * channels.length + c] / counts[joint];
    }
  });
  const sorted = Float64Array.from(means).sort();
  const highest = sorted[Math.floor(0.99 * (sorted.length - 1))] || 1;
  const image = make("canvas", { width: frames, height: joints.length });
  const pen = image.getContext("2d");
  const pixels = pen.createImageData(frames, joints.length);
  means.forEach((value, i) => pixels.data.set([...cividis(value / highest), 255], 4 * i));
  pen.putImageData(pixels, 0, 0);
  return { image, highest };
}

/** The heat map. Returns a function from pixels to {joint, frame}, null outside. */
function drawWidths(canvas, look) {
  const paper = fit(canvas);
  if (!paper) return null;
  const { pen, width, height } = paper;
  const { data, seconds, widths } = look;
  const box = { left: 104, right: width - 62, top: 6, bottom: height - 34 };
  const row = (box.bottom - box.top) / data.joints.length;
  const ink = getComputedStyle(canvas).color;
  const last = seconds[seconds.length - 1] || 1;
  const x = (s) => box.left + (s / last) * (box.right - box.left);
  pen.imageSmoothingEnabled = false;
  pen.drawImage(widths.image, box.left, box.top, box.right - box.left, box.bottom - box.top);
  pen.fillStyle = pen.strokeStyle = ink;
  pen.textAlign = "right";
  data.joints.forEach((name, j) => {
    pen.font = `${j === look.joint ? "bold " : ""}${Math.min(12, row)}px system-ui, sans-serif`;
    pen.fillText(name, box.left - 5, box.top + (j + 0.8) * row);
  });
  pen.font = "12px system-ui, sans-serif";
  pen.textAlign = "center";
  for (const s of ticks(0, last, width / 110)) pen.fillText(String(s), x(s), box.bottom + 14);
  pen.fillText("time, s", (box.left + box.right) / 2, height - 5);
  for (const [channel, start, stop] of data.gaps) {
    const top = box.top + data.channels[channel][0] * row;
    outline(pen, x(seconds[start]), top, x(seconds[stop - 1]) - x(seconds[start]), row, [3, 2]);
  }
  outline(pen, box.left, box.top + look.joint * row, box.right - box.left, row);
  outline(pen, x(seconds[look.frame]) - 1, box.top, 2, box.bottom - box.top);
  drawScale(pen, box, widths.highest, width, ink);
  return (px, py) => {
    const joint = Math.floor((py - box.top) / row);
    if (px < box.left || px > box.right || !data.joints[joint]) return null;
    return { joint, frame: nearestFrame(px, box, 0, data.frames - 1) };
  };
}

/** A line that is seen on every colour: white upon black. */
function outline(pen, x, y, width, height, dash = []) {
  pen.save();
  for (const [colour, lineWidth] of [["#000", 3], ["#fff", 1.2]]) {
    Object.assign(pen, { strokeStyle: colour, lineWidth });
    pen.setLineDash(dash);
    pen.strokeRect(x, y, width, height);
  }
  pen.restore();
}

/** The colours of the heat map, from 0 to the highest width. */
function drawScale(pen, box, highest, width, ink) {
  const [left, height] = [box.right + 10, box.bottom - box.top - 16];
  for (let i = 0; i < height; i += 4) {
    pen.fillStyle = `rgb(${cividis(1 - i / height).map(Math.round)})`;
    pen.fillRect(left, box.top + 16 + i, 12, Math.min(4.5, height - i));
  }
  pen.fillStyle = ink;
  pen.textAlign = "left";
  pen.fillText("ms", left, box.top + 10);
  for (const value of ticks(0, highest, 4)) {
    pen.fillText(String(value), left + 16, box.bottom - (value / highest) * height + 4);
  }
}
