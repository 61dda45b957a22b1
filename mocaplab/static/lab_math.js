// The Gaussian filter of one channel: the same numbers as filters.py and
// live/filters.py, which are the truth. It is here too because asking Python takes
// longer than a slider may.

/**
 * Smooth a channel. sigma and lookAhead are in frames.
 *
 * With a lookAhead of null the window is whole, and at its ends the channel is continued by
 * its mirror image. Otherwise the window ends there, and what it lacks at the ends of the
 * channel is left out.
 */
export function gaussianFilter(values, sigma, lookAhead = null) {
  const n = values.length;
  const radius = Math.ceil(4 * sigma);
  const ahead = lookAhead === null ? radius : lookAhead;
  const weights = new Float64Array(radius + ahead + 1);
  for (let k = 0; k < weights.length; k++) weights[k] = Math.exp(-0.5 * ((k - radius) / sigma) ** 2);
  const result = new Float64Array(n);
  for (let i = 0; i < n; i++) {
    let [total, sum] = [0, 0];
    for (let k = 0; k < weights.length; k++) {
      let place = i + k - radius;
      if (place < 0 || place >= n) {
        if (lookAhead !== null) continue;
        place = ((place % (2 * n)) + 2 * n) % (2 * n); // there and back again
        if (place >= n) place = 2 * n - 1 - place;
      }
      total += weights[k] * values[place];
      sum += weights[k];
    }
    result[i] = total / sum;
  }
  return result;
}

/** Root mean square difference of two channels. */
export function rmsError(a, b) {
  let total = 0;
  for (let i = 0; i < a.length; i++) total += (a[i] - b[i]) ** 2;
  return Math.sqrt(total / a.length);
}
