// The controls of the page: sliders, radio buttons, and a button that sets the sliders back.
const AlignmentControls = (() => {
  "use strict";
  const MANTISSAS = [1, 1.1, 1.2, 1.3, 1.4, 1.5, 1.6, 1.8, 2, 2.2, 2.5, 2.8, 3, 3.5, 4, 4.5, 5, 5.5, 6, 7, 8, 9];

  const at = (id) => document.getElementById(id);

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

  // Makes sliders of the range inputs with the keys of `ranges` as ids, { key: [values, describe] }, and
  // buttons of the radio inputs whose name is a key of the state. What `describe(value)` says stands in
  // the slider's output and is spoken. `change(changes)` is called by all of them; the button `reset`
  // sets the sliders back. The returned function shows the state.
  function controls(ranges, state, change) {
    const defaults = Object.fromEntries(Object.keys(ranges).map((key) => [key, state[key]]));
    const shows = Object.entries(ranges).map(([key, [values, describe]]) => {
      const all = [...new Set([...values, defaults[key]])].sort((a, b) => a - b);
      const show = slider(at(key), all, describe, (value) => change({ [key]: value }));
      return () => show(state[key]);
    });
    for (const radio of document.querySelectorAll('input[type="radio"]')) {
      radio.addEventListener("change", () => change({ [radio.name]: radio.value }));
      shows.push(() => { radio.checked = radio.value === state[radio.name]; });
    }
    at("reset").addEventListener("click", () => change(defaults));
    return () => { for (const show of shows) show(); };
  }

  function slider(input, all, describe, change) {
    const output = document.querySelector(`output[for="${input.id}"]`);
    Object.assign(input, { min: 0, max: all.length - 1, step: 1 });
    input.addEventListener("input", () => change(all[Number(input.value)]));
    return (value) => {
      input.value = all.indexOf(value);
      output.textContent = describe(value);
      input.setAttribute("aria-valuetext", output.textContent);
    };
  }

  return Object.freeze({ at, controls, roundNumbers });
})();
