// The first table is sorted by any column; without this it stands there complete.
(() => {
  "use strict";
  const table = document.querySelector("#overall table");
  const headers = [...table.tHead.rows[0].cells];
  const texts = new Intl.Collator("en", { numeric: true });
  const keyOf = ({ dataset, textContent }) => ("key" in dataset ? Number(dataset.key) : textContent.trim());
  const compare = (one, other) => (typeof one === "string" ? texts.compare(one, other) : one - parseFloat(other));
  headers.forEach((header, column) => {
    const button = document.createElement("button");
    button.type = "button";
    button.append(...header.childNodes);
    header.append(button);
    header.setAttribute("aria-sort", "none");
    button.addEventListener("click", () => {
      const direction = header.getAttribute("aria-sort") === "descending" ? "ascending" : "descending";
      const sign = direction === "ascending" ? 1 : -1;
      headers.forEach((other) => other.setAttribute("aria-sort", other === header ? direction : "none"));
      const keyed = [...table.tBodies[0].rows].map((row) => [keyOf(row.cells[column]), row]);
      keyed.sort(([one], [other]) => sign * compare(one, other));
      table.tBodies[0].append(...keyed.map(([, row]) => row));
    });
  });
})();

// The scores of all systems at any thresholds, from quantiles of the errors of all runs.
(() => {
  "use strict";
  const { curves, html, number, responsive } = AlignmentCharts;
  const { WEIGHTS, at, controls, data, roundNumbers, setting, unpacked } = AlignmentControls;
  const { mean, pas, score } = AlignmentScores;
  const KINDS = { position: { name: "TAS", unit: "d" }, rotation: { name: "RAS", unit: "degrees" } };
  const UNITS = { position: geometric(0.02, 100), rotation: geometric(0.05, 180) };
  const numbers = (text) => unpacked(Float32Array, text);
  const errors = data.errors.map((systems) => systems.map((one) => one && { position: numbers(one.position), rotation: numbers(one.rotation) }));
  const everything = data.sequences.map((_, index) => index);

  function geometric(low, high) {
    return Array.from({ length: 40 }, (_, k) => low * (high / low) ** (k / 39));
  }

  const positive = (value) => value > 0 && value < Infinity;
  const saved = setting({
    sequence: [-1, (value) => value in data.sequences],
    trajectory: [0, (value) => at(`own-${value}`) !== null],
    view: ["", () => true],
    threshold: [data.setting.threshold, positive],
    degrees: [data.setting.degrees, positive],
    weight: [data.setting.weight, (value) => value >= 0 && value <= 1],
  }, render);
  const { change, state } = saved;
  const SETTING = ["threshold", "degrees", "weight"];
  const largest = (kind) => (kind === "position" ? state.threshold : state.degrees);
  const chosen = () => (state.sequence < 0 ? everything : [state.sequence]);

  // Over the sequences that the system was tried on; not a number where there are none.
  function scoreOf(system, kind, unit) {
    const tried = chosen().map((sequence) => errors[sequence][system]).filter(Boolean);
    return mean(tried.map((one) => score(one[kind], unit)));
  }
  const write = (value) => (Number.isNaN(value) ? "not tried" : value.toFixed(3));
  const known = new Map(); // profiles, which depend on two of the settings alone
  function profileOf(system, kind) {
    const key = [system, kind, state.sequence].join();
    if (!known.has(key)) known.set(key, UNITS[kind].map((unit) => scoreOf(system, kind, unit)));
    return known.get(key);
  }

  const showControls = controls({
    threshold: [roundNumbers(0.02, 100), (value) => `${number(value)} d`],
    degrees: [roundNumbers(0.1, 180), (value) => `${number(value)} degrees`],
    weight: [WEIGHTS, (value) => `${number(value)} TAS + ${number(1 - value)} RAS`],
  }, saved, SETTING);
  data.sequences.forEach((name, index) => at("sequence").add(new Option(name, index)));
  at("sequence").addEventListener("change", (event) => change({ sequence: event.target.value }));

  // The page of the runs on a sequence, in a frame; it is made of its data and what is around
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
    framed = pageOf(state.trajectory) + (state.view && `#${state.view}`); // an empty fragment would scroll there
    at("own-tab").href = framed;
    return framed !== before;
  }
  function showTrajectory() {
    if (!at("trajectory") || !addressFrame()) return;
    at("trajectory").value = state.trajectory;
    const name = at("trajectory").selectedOptions[0].text;
    // Each is a new frame: another page in the same one would be a step of the browser's history.
    at("own").replaceChildren(html("iframe", { src: framed, title: `Trajectories on ${name}` }));
  }
  at("trajectory")?.addEventListener("change", (event) => change({ trajectory: event.target.value, view: "" }));
  addEventListener("message", (event) => {
    if (event.source !== document.querySelector("#own iframe")?.contentWindow || typeof event.data !== "string") return;
    state.view = event.data;
    addressFrame();
    saved.write();
  });

  const rows = data.systems.map((name) => {
    const cells = [0, 1, 2].map(() => html("td"));
    at("scores").append(html("tr", {}, html("th", { scope: "row" }, name), ...cells));
    return cells;
  });

  const draws = Object.entries(KINDS).map(([kind, { name, unit }]) => {
    const host = at(`${kind}-profile`);
    const draw = () => {
      const profiles = data.systems.map((_, system) => profileOf(system, kind));
      const read = (index) => data.systems.map((system, k) => `${system} ${write(profiles[k][index])}`).join(", ");
      curves(host, {
        label: `${name} of all systems over its largest threshold`,
        places: UNITS[kind], unit, y: { domain: [0, 1], label: name }, at: largest(kind),
        lines: data.lines.map(([colour, dash], system) => ({ values: profiles[system], colour, dash })),
        describe: (index) => `${number(UNITS[kind][index])} ${unit}: ${read(index)}`,
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
    showControls();
    at("sequence").value = state.sequence;
    const isRun = saved.isDefault(SETTING);
    at("setting").textContent = `${state.sequence < 0 ? "Over all sequences" : data.sequences[state.sequence]}, up to ${number(state.threshold)} d and `
      + `${number(state.degrees)} degrees, weight ${number(state.weight)}: ${isRun ? "as in the run" : "not as in the run"}.`;
    at("reset").disabled = isRun;
    for (const draw of draws) draw();
    showTrajectory();
  }
  render();
})();
