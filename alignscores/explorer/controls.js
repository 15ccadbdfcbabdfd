// Sliders over the values of a setting, and the settings in the address, so that a view can be shared.
const AlignmentControls = (() => {
  "use strict";
  const MANTISSAS = [1, 1.1, 1.2, 1.3, 1.4, 1.5, 1.6, 1.8, 2, 2.2, 2.5, 2.8, 3, 3.5, 4, 4.5, 5, 5.5, 6, 7, 8, 9];

  // Round numbers from one to another, some 22 for each power of ten.
  function roundNumbers(low, high) {
    const found = [];
    for (let power = Math.floor(Math.log10(low)); power <= Math.log10(high); power++) {
      for (const mantissa of MANTISSAS) {
        const value = Number(`${mantissa}e${power}`);
        if (value >= low && value <= high) found.push(value);
      }
    }
    return found;
  }

  // Makes a slider of a range input: over `values` in ascending order, and those of `more`, which a
  // run may have. What `describe(value)` says stands in `output` and is spoken; `change(value)` hears
  // of moves. The returned function shows another value.
  function slider(input, output, { values, more = [], describe, change }) {
    const all = [...new Set([...values, ...more])].sort((a, b) => a - b);
    Object.assign(input, { min: 0, max: all.length - 1, step: 1 });
    input.addEventListener("input", () => change(all[Number(input.value)]));
    return (value) => {
      const distances = all.map((one) => (one === value ? 0 : Math.abs(one - value))); // of infinities, too
      input.value = distances.indexOf(Math.min(...distances));
      output.textContent = describe(value);
      input.setAttribute("aria-valuetext", output.textContent);
    };
  }

  // The state after the # of the address: { key: [default, accepts] }. What is not accepted, or not
  // there, has its default; defaults are left out.
  function address(fields) {
    const defaults = Object.fromEntries(Object.entries(fields).map(([key, [value]]) => [key, value]));
    let waiting;

    function read() {
      const state = { ...defaults };
      for (const [key, text] of new URLSearchParams(location.hash.slice(1))) {
        if (!Object.hasOwn(fields, key) || text === "") continue;
        const value = typeof defaults[key] === "number" ? Number(text) : text;
        if (fields[key][1](value)) state[key] = value;
      }
      return state;
    }
    function write(state) {
      clearTimeout(waiting); // browsers refuse too many changes in a short time
      waiting = setTimeout(() => {
        const changed = Object.entries(state).filter(([key, value]) => value !== defaults[key]);
        history.replaceState(null, "", `#${new URLSearchParams(changed)}`);
      }, 200);
    }
    return { defaults, read, write };
  }

  return Object.freeze({ address, roundNumbers, slider });
})();
