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

  // Makes sliders of the range inputs with the keys of `fields` as ids: { key: [values, describe] }.
  // What `describe(value)` says stands in the input's output and is spoken. `defaults` has values that
  // a run may have besides; `change({ key: value })` hears of moves. The returned function shows a state.
  function sliders(fields, defaults, change) {
    const shows = Object.entries(fields).map(([key, [values, describe]]) => {
      const all = [...new Set([...values, defaults[key]])].sort((a, b) => a - b);
      return [key, slider(document.getElementById(key), all, describe, (value) => change({ [key]: value }))];
    });
    return (state) => { for (const [key, show] of shows) show(state[key]); };
  }

  function slider(input, all, describe, change) {
    const output = document.querySelector(`output[for="${input.id}"]`);
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
        if (parent !== window) parent.postMessage(location.hash.slice(1), "*"); // whose address can be shared
      }, 200);
    }
    return { defaults, read, write };
  }

  return Object.freeze({ address, roundNumbers, sliders });
})();
