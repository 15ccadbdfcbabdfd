// The controls of a page, and its setting in the address, so that a view can be shared.
const AlignmentControls = (() => {
  "use strict";
  const MANTISSAS = [1, 1.1, 1.2, 1.3, 1.4, 1.5, 1.6, 1.8, 2, 2.2, 2.5, 2.8, 3, 3.5, 4, 4.5, 5, 5.5, 6, 7, 8, 9];

  const WEIGHTS = Array.from({ length: 21 }, (_, k) => k / 20);

  const at = (id) => document.getElementById(id);
  const data = JSON.parse(at("data").textContent);
  // Numbers of a kind, such as Float32Array, from the base64 of their bytes.
  const unpacked = (Kind, text) => new Kind(Uint8Array.from(atob(text), (letter) => letter.charCodeAt(0)).buffer);

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

  // The setting of a page, which stands after the # of its address: { key: [default, accepts] }. What is
  // not accepted, or not there, has its default; defaults are left out. `render()` hears of changes.
  function setting(fields, render) {
    const defaults = Object.fromEntries(Object.entries(fields).map(([key, [value]]) => [key, value]));
    const state = {};
    const typed = (key, value) => (typeof defaults[key] === "number" ? Number(value) : value);
    const isDefault = (keys) => keys.every((key) => state[key] === defaults[key]);
    let waiting;

    function read() {
      Object.assign(state, defaults);
      for (const [key, text] of new URLSearchParams(location.hash.slice(1))) {
        if (!Object.hasOwn(fields, key) || text === "") continue;
        const value = typed(key, text);
        if (fields[key][1](value)) state[key] = value;
      }
    }
    function write() {
      clearTimeout(waiting); // browsers refuse too many changes in a short time
      waiting = setTimeout(() => { // a page in a notebook has no address
        const changed = Object.entries(state).filter(([key, value]) => value !== defaults[key]);
        if (location.protocol !== "about:") history.replaceState(null, "", `#${new URLSearchParams(changed)}`);
        if (parent !== window) parent.postMessage(location.hash.slice(1), "*"); // whose address can be shared
      }, 200);
    }
    function change(changes) {
      for (const [key, value] of Object.entries(changes)) state[key] = typed(key, value);
      write();
      render();
    }
    addEventListener("hashchange", () => {
      if (location.hash && !location.hash.includes("=")) return; // a link to a place on the page
      read();
      render();
    });
    read();
    return { change, defaults, isDefault, state, write };
  }

  // Makes sliders of the range inputs with the keys of `ranges` as ids, { key: [values, describe] }. What
  // `describe(value)` says stands in the input's output and is spoken; the default is a value, too. Radio
  // buttons set the key that is their name, and the button `reset` some keys to their defaults. The
  // returned function shows the state.
  function controls(ranges, { change, defaults, state }, keys) {
    const shows = Object.entries(ranges).map(([key, [values, describe]]) => {
      const all = [...new Set([...values, defaults[key]])].sort((a, b) => a - b);
      const show = slider(at(key), all, describe, (value) => change({ [key]: value }));
      return () => show(state[key]);
    });
    for (const radio of document.querySelectorAll('input[type="radio"]')) {
      radio.addEventListener("change", () => change({ [radio.name]: radio.value }));
      shows.push(() => { radio.checked = radio.value === String(state[radio.name]); });
    }
    at("reset").addEventListener("click", () => {
      change(Object.fromEntries(keys.map((key) => [key, defaults[key]])));
    });
    return () => { for (const show of shows) show(); };
  }

  function slider(input, all, describe, change) {
    const output = document.querySelector(`output[for="${input.id}"]`);
    Object.assign(input, { min: 0, max: all.length - 1, step: 1 });
    input.addEventListener("input", () => change(all[Number(input.value)]));
    return (value) => {
      const distances = all.map((one) => Math.abs(one - value));
      input.value = distances.indexOf(Math.min(...distances));
      output.textContent = describe(value);
      input.setAttribute("aria-valuetext", output.textContent);
    };
  }

  return Object.freeze({ WEIGHTS, at, controls, data, roundNumbers, setting, unpacked });
})();
