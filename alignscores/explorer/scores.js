// The arithmetic of the scores, for the interactive pages: what histogram.py, profile.py, pose.py and
// studies/statistics.py compute, number for number. An error that is Infinity is a failure.
const AlignmentScores = (() => {
  "use strict";

  // Each function that scores takes these options: the number of equal steps to the largest threshold
  // (Infinity: a straight line instead of stairs), the largest threshold in units, and how many
  // cameras count, those without an error as failures.

  // The area under the cumulative frequencies of the errors up to the largest threshold (eq. 3, 4).
  function score(errors, unit, { thresholds = 100, maxThreshold = 1, total = errors.length } = {}) {
    if (!total) return NaN;
    const largest = unit * maxThreshold;
    let area = 0;
    if (thresholds === Infinity) {
      for (const error of errors) if (error < largest) area += 1 - error / largest;
      return area / total;
    }
    for (const error of errors) area += stepsAbove(error, unit, maxThreshold, thresholds);
    return area / (thresholds * total);
  }

  // How many thresholds an error lies strictly below: guessed by division, settled by comparison.
  function stepsAbove(error, unit, maxThreshold, count) {
    const threshold = (k) => unit * (maxThreshold * k / count);
    if (!(error < threshold(count))) return 0;
    let below = Math.floor(error / (unit * maxThreshold) * count); // thresholds at or below the error
    below = Math.min(Math.max(below, 0), count - 1);
    while (below > 0 && error < threshold(below)) below -= 1;
    while (error >= threshold(below + 1)) below += 1;
    return count - below;
  }

  // The ceil(q n)-th smallest of ascending values; q n is freed of its rounding error.
  function quantile(sorted, q) {
    return sorted[Math.max(Math.ceil(Math.round(q * sorted.length * 1e9) / 1e9), 1) - 1];
  }

  function pas(tas, ras, weight = 0.5) {
    return weight * tas + (1 - weight) * ras;
  }

  // The score at each of several units.
  function profile(errors, units, options) {
    return Array.from(units, (unit) => score(errors, unit, options));
  }

  // The smallest unit at which the score reaches one half, or another value; Infinity where it never
  // does. Positive numbers have the order of their bits, so that bisection decides all of them.
  function half(errors, { reach = 0.5, ...options } = {}) {
    const bits = new BigInt64Array(1);
    const number = new Float64Array(bits.buffer);
    const reached = (candidate) => {
      bits[0] = candidate;
      return score(errors, number[0], options) >= reach;
    };
    number[0] = Number.MAX_VALUE;
    let [low, high] = [0n, bits[0]];
    if (!reached(high)) return Infinity;
    while (high - low > 1n) {
      const middle = (low + high) / 2n;
      if (reached(middle)) high = middle;
      else low = middle;
    }
    bits[0] = high;
    return number[0] > 2 ** -1022 ? number[0] : 0;
  }

  // The probability that one trial at each of two neighbouring levels come in the right order: the
  // trials of each level in rising order of the levels, so that larger is worse (a score negated).
  function order(levels) {
    let sum = 0;
    for (let k = 1; k < levels.length; k++) sum += rightOrder(levels[k - 1], levels[k]);
    return sum / (levels.length - 1);
  }

  function rightOrder(better, worse) {
    let right = 0;
    for (const lower of better) {
      for (const upper of worse) right += lower < upper ? 1 : lower > upper ? 0 : 0.5; // NaN: 0.5
    }
    return right / (better.length * worse.length);
  }

  const mean = (values) => values.reduce((sum, value) => sum + value, 0) / values.length;

  return Object.freeze({ score, quantile, pas, profile, half, mean, order });
})();
