// Sorting of the first table by any column. Without it the table stands there complete.
(() => {
  "use strict";
  const table = document.querySelector("#overall table");
  const body = table.tBodies[0];
  const headers = [...table.tHead.rows[0].cells];
  const names = new Intl.Collator("en", { numeric: true });
  const keyOf = (row, column) => row.cells[column].dataset.key;

  function compare(one, other, column) {
    const [first, second] = [keyOf(one, column), keyOf(other, column)];
    if (first === undefined) return names.compare(one.cells[column].textContent, other.cells[column].textContent);
    return first === second ? 0 : Number(first) - Number(second);
  }

  headers.forEach((header, column) => {
    const button = document.createElement("button");
    button.type = "button";
    button.textContent = header.textContent;
    header.replaceChildren(button);
    header.setAttribute("aria-sort", "none");
    button.addEventListener("click", () => {
      const direction = header.getAttribute("aria-sort") === "descending" ? "ascending" : "descending";
      headers.forEach((other) => other.setAttribute("aria-sort", other === header ? direction : "none"));
      const sign = direction === "ascending" ? 1 : -1;
      body.append(...[...body.rows].sort((one, other) => sign * compare(one, other, column)));
    });
  });
})();

// The scores of all systems at any thresholds, from errors that stand for those of all runs.
(() => {
  "use strict";
  const { cursor, frame, line, number, responsive, rule } = AlignmentCharts;
  const { address, roundNumbers, sliders } = AlignmentControls;
  const { score, pas } = AlignmentScores;
  const at = (id) => document.getElementById(id);
  const data = JSON.parse(at("data").textContent);
  const KINDS = { position: { name: "TAS", unit: "d" }, rotation: { name: "RAS", unit: "degrees" } };
  const UNITS = { position: geometric(0.02, 100), rotation: geometric(0.05, 180) };
  const unpacked = (text) => new Float32Array(Uint8Array.from(atob(text), (letter) => letter.charCodeAt(0)).buffer);
  const errors = data.errors.map((systems) => systems.map((one) => one && { position: unpacked(one.position), rotation: unpacked(one.rotation) }));
  const everything = data.sequences.map((_, index) => index);

  function geometric(low, high) {
    return Array.from({ length: 40 }, (_, k) => low * (high / low) ** (k / 39));
  }

  const positive = (value) => value > 0 && value < Infinity;
  const kept = address({
    sequence: [-1, (value) => value in data.sequences],
    trajectory: [0, (value) => at(`own-${value}`) !== null],
    view: ["", () => true],
    threshold: [data.setting.threshold, positive],
    degrees: [data.setting.degrees, positive],
    steps: [100, (value) => Number.isInteger(value) && value > 0 && value <= 10000],
    weight: [data.setting.weight, (value) => value >= 0 && value <= 1],
  });
  const SETTING = ["threshold", "degrees", "steps", "weight"];
  let state = kept.read();
  const largest = (kind) => (kind === "position" ? state.threshold : state.degrees);
  const chosen = () => (state.sequence < 0 ? everything : [state.sequence]);
  const mean = (values) => values.reduce((sum, value) => sum + value, 0) / values.length;

  // Over the sequences that the system was tried on; not a number where there are none.
  function scoreOf(system, kind, unit) {
    const tried = chosen().map((sequence) => errors[sequence][system]).filter(Boolean);
    return mean(tried.map((one) => score(one[kind], unit, { thresholds: state.steps })));
  }
  const write = (value) => (Number.isNaN(value) ? "not tried" : value.toFixed(3));
  const remembered = new Map(); // profiles depend on two of the settings alone
  function profileOf(system, kind) {
    const key = [system, kind, state.sequence, state.steps].join();
    if (!remembered.has(key)) remembered.set(key, UNITS[kind].map((unit) => scoreOf(system, kind, unit)));
    return remembered.get(key);
  }

  function change(changes) {
    Object.assign(state, changes);
    kept.write(state);
    render();
  }
  const showSliders = sliders({
    threshold: [roundNumbers(0.02, 100), (value) => `${number(value)} d`],
    degrees: [roundNumbers(0.1, 180), (value) => `${number(value)} degrees`],
    steps: [[1, 2, 5, 10, 20, 50, 100, 200, 500, 1000], (value) => number(value, 5)],
    weight: [Array.from({ length: 21 }, (_, k) => k / 20), (value) => `${number(value)} TAS + ${number(1 - value)} RAS`],
  }, kept.defaults, change);
  data.sequences.forEach((name, index) => at("sequence").add(new Option(name, index)));
  at("sequence").addEventListener("change", (event) => change({ sequence: Number(event.target.value) }));
  at("reset").addEventListener("click", () => change(Object.fromEntries(SETTING.map((key) => [key, kept.defaults[key]]))));
  addEventListener("hashchange", () => {
    if (!location.hash.includes("=")) return; // a link to a section
    state = kept.read();
    render();
  });

  // The page of one's own files on a sequence, in a frame; it is made of its data and what is around
  // the data in all of them. `view` is what stands after the # of its address.
  const pages = new Map();
  let framed;
  function pageOf(sequence) {
    if (!pages.has(sequence)) {
      const [before, after] = JSON.parse(at("own-page").textContent);
      pages.set(sequence, URL.createObjectURL(new Blob([before, at(`own-${sequence}`).textContent, after], { type: "text/html" })));
    }
    return pages.get(sequence);
  }
  // Tells whether that is another address than before.
  function addressFrame() {
    const before = framed;
    framed = `${pageOf(state.trajectory)}#${state.view}`;
    at("own-tab").href = framed;
    return framed !== before;
  }
  function showTrajectory() {
    if (!at("trajectory") || !addressFrame()) return;
    at("trajectory").value = state.trajectory;
    const name = at("trajectory").selectedOptions[0].text;
    // Each is a new frame: another page in the same one would be a step of the browser's history.
    at("own").replaceChildren(Object.assign(document.createElement("iframe"), { src: framed, title: `Trajectories on ${name}` }));
  }
  at("trajectory")?.addEventListener("change", (event) => change({ trajectory: Number(event.target.value), view: "" }));
  addEventListener("message", (event) => {
    if (event.source !== document.querySelector("#own iframe")?.contentWindow || typeof event.data !== "string") return;
    state.view = event.data;
    addressFrame();
    kept.write(state);
  });

  const rows = data.systems.map((name) => {
    const row = at("scores").insertRow();
    const head = Object.assign(document.createElement("th"), { scope: "row", textContent: name });
    row.append(head);
    return [0, 1, 2].map(() => row.insertCell());
  });

  const draws = Object.entries(KINDS).map(([kind, { name, unit }]) => {
    const host = at(`${kind}-profile`);
    const draw = () => {
      const made = frame(host, {
        label: `${name} of all systems over its largest threshold`,
        x: { domain: [UNITS[kind][0], UNITS[kind].at(-1)], log: true, label: `largest threshold, ${unit}` },
        y: { domain: [0, 1], label: name },
      });
      const profiles = data.systems.map((_, system) => profileOf(system, kind));
      profiles.forEach((values, system) => {
        const [colour, dash] = data.lines[system];
        line(made, values.map((value, k) => [UNITS[kind][k], value]), { colour, dash });
      });
      const limit = largest(kind);
      if (limit >= UNITS[kind][0] && limit <= UNITS[kind].at(-1)) rule(made, limit, "here");
      cursor(made, {
        places: UNITS[kind],
        describe: (index) => `${number(UNITS[kind][index])} ${unit}: ${data.systems.map((system, k) => `${system} ${write(profiles[k][index])}`).join(", ")}`,
        name: `${name} over its largest threshold`,
      });
    };
    responsive(host, draw);
    return draw;
  });

  function render() {
    rows.forEach((cells, system) => {
      const [tas, ras] = Object.keys(KINDS).map((kind) => scoreOf(system, kind, largest(kind)));
      [tas, ras, pas(tas, ras, state.weight)].forEach((value, column) => { cells[column].textContent = write(value); });
    });
    showSliders(state);
    at("sequence").value = state.sequence;
    const isRun = SETTING.every((key) => state[key] === kept.defaults[key]);
    at("setting").textContent = `${state.sequence < 0 ? "Over all sequences" : data.sequences[state.sequence]}, up to ${number(state.threshold)} d and `
      + `${number(state.degrees)} degrees, ${state.steps} thresholds, weight ${number(state.weight)}: ${isRun ? "as in the run" : "not as in the run"}.`;
    at("reset").disabled = isRun;
    for (const draw of draws) draw();
    showTrajectory();
  }
  render();
})();
