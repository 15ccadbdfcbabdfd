// The arithmetic of the scores, for the interactive pages: what histogram.py, profile.py and
// pose.py compute, number for number. An error that is Infinity is a failure.
const AlignmentScores = (() => {
  "use strict";

  // Each function that scores takes these options: the number of equal steps to the largest threshold,
  // and the largest threshold in units.

  // The area under the cumulative frequencies of the errors up to the largest threshold (eq. 3, 4).
  function score(errors, unit, { thresholds = 100, maxThreshold = 1 } = {}) {
    if (!errors.length) return NaN;
    let area = 0;
    for (const error of errors) area += stepsAbove(error, unit, maxThreshold, thresholds);
    return area / (thresholds * errors.length);
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

  function pas(tas, ras, weight = 0.5) {
    return weight * tas + (1 - weight) * ras;
  }

  const mean = (values) => values.reduce((sum, value) => sum + value, 0) / values.length;

  return Object.freeze({ score, pas, mean });
})();
