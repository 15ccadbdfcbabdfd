// The arithmetic of the scores: what histogram.py, profile.py and pose.py compute, number for number. An error that is Infinity is a failure.
const AlignmentScores = (() => {
  "use strict";

  const N_THRESHOLDS = 100;

  // The area under the cumulative frequencies of the errors up to the largest threshold, which is given in
  // units (eq. 3, 4).
  function score(errors, unit, largest = 1) {
    let area = 0;
    for (const error of errors) area += stepsAbove(error, unit, largest);
    return area / (N_THRESHOLDS * errors.length);
  }

  // How many thresholds an error lies strictly below: guessed by division, settled by comparison.
  function stepsAbove(error, unit, largest) {
    const threshold = (k) => unit * (largest * k / N_THRESHOLDS);
    if (!(error < threshold(N_THRESHOLDS))) return 0;
    let below = Math.floor(error / (unit * largest) * N_THRESHOLDS); // thresholds at or below the error
    below = Math.min(Math.max(below, 0), N_THRESHOLDS - 1);
    while (below > 0 && error < threshold(below)) below -= 1;
    while (error >= threshold(below + 1)) below += 1;
    return N_THRESHOLDS - below;
  }

  const pas = (tas, ras, weight) => weight * tas + (1 - weight) * ras;

  return Object.freeze({ pas, score });
})();
