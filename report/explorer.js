// Scores the errors of the trials under the setting of the controls, and draws what comes out.
(() => {
  "use strict";
  const { cursor, element, endLabels, frame, line, number, responsive, rule } = AlignmentCharts;
  const { address, roundNumbers, slider } = AlignmentControls;
  const { half, order, pas, quantile, score } = AlignmentScores;
  const data = JSON.parse(document.getElementById("data").textContent);
  const byId = (id) => document.getElementById(id);

  // Where the sliders stop.
  const STOPS = {
    tas: roundNumbers(0.05, 10),
    ras: roundNumbers(0.5, 90),
    quantile: data.quantiles,
    thresholds: [1, 2, 3, 5, 10, 20, 50, 100, 200, 500, 1000, Infinity],
    weight: Array.from({ length: 21 }, (_, k) => k / 20),
  };
  const OUTLIERS = ["counted", "failures", "ignored"];
  const UNIT = { TAS: "d", RAS: "°" };
  const THRESHOLD = { TAS: "tas", RAS: "ras" };
  const SHOWN = { // in a control's output
    tas: (value) => `${number(value)} d`,
    ras: (value) => `${number(value)}°`,
    quantile: (value) => `${number(100 * value)} %`,
    thresholds: (value) => number(value, 4),
    weight: (value) => number(value),
  };
  const within = (stops) => (value) => value >= stops[0] && value <= stops[stops.length - 1];
  const whole = (value) => Number.isInteger(value) && value > 0;
  const PAPER = { ...data.paper, outliers: "counted" };
  const setting = address({
    experiment: [data.experiments[0].name, (name) => data.experiments.some((one) => one.name === name)],
    tas: [PAPER.tas, within(STOPS.tas)],
    ras: [PAPER.ras, within(STOPS.ras)],
    quantile: [PAPER.quantile, (value) => data.quantiles.includes(value)],
    thresholds: [PAPER.thresholds, (value) => whole(value) || value === Infinity],
    weight: [PAPER.weight, within(STOPS.weight)],
    outliers: [PAPER.outliers, (value) => OUTLIERS.includes(value)],
    level: [0, whole], // of the profiles: the first is 1, and 0 stands for the one in the middle
  });
  const state = setting.read();

  // ---- The trials -------------------------------------------------------------------------------

  // Numbers of two bytes each on a logarithmic scale; see `pack` in report/explorer.py.
  function unpack({ low, high, codes }) {
    const bytes = Uint8Array.from(atob(codes), (letter) => letter.charCodeAt(0));
    const view = new DataView(bytes.buffer);
    const step = Math.log(high / low) / 65533;
    return Float64Array.from({ length: bytes.length / 2 }, (_, k) => {
      const code = view.getUint16(2 * k, true);
      return code === 0 ? 0 : code === 65535 ? Infinity : low * Math.exp(step * (code - 1));
    });
  }

  // The trials of an experiment by curve and noise level; unpacked when it is first shown.
  const unpacked = new Map();
  function trialsOf(experiment) {
    if (!unpacked.has(experiment)) {
      const [positions, rotations, units] = [experiment.positions, experiment.rotations, experiment.units].map(unpack);
      const grid = experiment.series.labels.map(() => experiment.levels.labels.map(() => []));
      let [camera, trial] = [0, 0];
      experiment.cells.forEach(([curve, level], cell) => {
        const count = experiment.cameras[cell];
        for (let t = 0; t < experiment.trials; t++, trial++, camera += count) {
          grid[curve][level].push({
            TAS: positions.subarray(camera, camera + count),
            RAS: rotations.subarray(camera, camera + count),
            units: units.subarray(trial * data.quantiles.length, (trial + 1) * data.quantiles.length),
            outliers: experiment.outliers[trial],
          });
        }
      });
      unpacked.set(experiment, grid);
    }
    return unpacked.get(experiment);
  }

  // ---- Their scores -----------------------------------------------------------------------------

  // The errors of a trial that count, in which unit, and under which options.
  function scored(trial, name, chosen) {
    const { thresholds, outliers } = chosen;
    const errors = outliers === "counted" ? trial[name] : trial[name].subarray(trial.outliers);
    const total = outliers === "ignored" ? errors.length : trial[name].length;
    const unit = name === "TAS" ? trial.units[data.quantiles.indexOf(chosen.quantile)] : 1;
    return [errors, unit, { thresholds, total }];
  }

  function scoreOf(trial, name, chosen, maxThreshold = chosen[THRESHOLD[name]]) {
    if (name === "PAS") return pas(scoreOf(trial, "TAS", chosen), scoreOf(trial, "RAS", chosen), chosen.weight);
    const [errors, unit, options] = scored(trial, name, chosen);
    return score(errors, unit, { ...options, maxThreshold });
  }

  // The scores of all trials, by curve and level.
  function scoresOf(experiment, name, chosen, maxThreshold) {
    return trialsOf(experiment).map((curve) =>
      curve.map((trials) => trials.map((trial) => scoreOf(trial, name, chosen, maxThreshold))));
  }

  const mean = (values) => values.reduce((sum, value) => sum + value, 0) / values.length;
  const least = (values) => values.reduce((one, other) => Math.min(one, other), Infinity);
  const most = (values) => values.reduce((one, other) => Math.max(one, other), -Infinity);
  const transposed = (grid) => grid[0].map((_, level) => grid.map((curve) => curve[level]));
  const negated = (levels) => levels.map((trials) => trials.map((value) => -value));

  // The probability of the right order of neighbours along each row, the mean over the rows.
  const orderOf = (rows) => mean(rows.map((levels) => order(negated(levels))));

  // What the order is asked of: the noise along the x axis, and what curves differ in where more of it
  // is worse.
  function ordersOf(experiment, grid) {
    const found = [];
    if (grid[0].length > 1) found.push(["noise", orderOf(grid)]);
    if (grid.length > 1 && experiment.series.worsens) found.push([experiment.series.worsens, orderOf(transposed(grid))]);
    return found;
  }

  // Computed once for each setting that it depends on.
  const remembered = new Map();
  function once(key, compute) {
    if (!remembered.has(key)) {
      if (remembered.size > 60) remembered.clear();
      remembered.set(key, compute());
    }
    return remembered.get(key);
  }

  // ---- The controls -----------------------------------------------------------------------------

  const current = () => data.experiments.find((one) => one.name === state.experiment);

  // Which settings change anything in an experiment, by their names.
  function usedBy(experiment) {
    const has = (name) => experiment.scores.includes(name);
    const outliers = experiment.outliers.some((count) => count > 0);
    return { tas: has("TAS"), ras: has("RAS"), quantile: has("TAS"), thresholds: true, weight: has("PAS"), outliers };
  }

  function isPaper() {
    const used = usedBy(current());
    return Object.keys(PAPER).every((name) => !used[name] || state[name] === PAPER[name]);
  }

  // The noise level of the profiles, from 0.
  function levelOf(experiment) {
    const count = experiment.levels.labels.length;
    return state.level >= 1 && state.level <= count ? state.level - 1 : Math.floor((count - 1) / 2);
  }

  const show = Object.fromEntries(Object.entries(STOPS).map(([name, values]) => [name,
    slider(byId(name), byId(`${name}-value`), { values, describe: SHOWN[name], change: (value) => change({ [name]: value }) })]));

  function showControls() {
    const experiment = current();
    const used = usedBy(experiment);
    for (const name of Object.keys(STOPS)) {
      show[name](state[name]);
      byId(name).parentNode.hidden = !used[name];
      byId(name).parentNode.classList.toggle("changed", state[name] !== PAPER[name]);
    }
    byId("outliers").hidden = !used.outliers;
    for (const radio of document.querySelectorAll('input[type="radio"]')) {
      radio.checked = radio.value === state[radio.name];
    }
    const labels = experiment.levels.labels;
    Object.assign(byId("level"), { min: 1, max: labels.length, value: levelOf(experiment) + 1 });
    byId("level-value").textContent = `${experiment.levels.name} = ${labels[levelOf(experiment)]}`;
    byId("level").setAttribute("aria-valuetext", byId("level-value").textContent);
  }

  // ---- Drawing ----------------------------------------------------------------------------------

  const percent = (value) => `${(100 * value).toFixed(1)} %`;
  const made = (name, attributes = {}, ...children) => {
    const node = document.createElement(name);
    for (const [key, value] of Object.entries(attributes)) node.setAttribute(key, value);
    node.append(...children);
    return node;
  };

  // A table with a name for each row.
  function table(caption, head, rows) {
    const cells = (kind, scope, texts) => texts.map((text) => made(kind, scope ? { scope } : {}, text));
    const box = made("div", { class: "scroll", role: "group", tabindex: 0, "aria-label": caption });
    box.append(made("table", {}, made("caption", {}, caption), made("thead", {}, made("tr", {}, ...cells("th", "col", head))),
      made("tbody", {}, ...rows.map(([name, ...rest]) => made("tr", {}, ...cells("th", "row", [name]), ...cells("td", "", rest))))));
    return box;
  }

  // Hosts of charts, which stay while what they show changes.
  function hosts(parent, names, title) {
    if (parent.dataset.names !== names.join()) {
      parent.dataset.names = names.join();
      parent.replaceChildren(...names.map((name) => {
        const host = made("div", { class: "drawing" });
        parent.hosts = { ...parent.hosts, [name]: host };
        return made("div", { class: "sheet" }, made("h3", {}, ...title(name)), host);
      }));
    }
    return parent.hosts;
  }

  const named = (experiment, curve) => `${experiment.series.name} ${experiment.series.labels[curve]}`;
  const ends = (experiment, values) => experiment.series.labels.map((text, k) =>
    ({ text, colour: experiment.series.colours[k], y: values[k] })).filter(({ y }) => Number.isFinite(y));

  // The scores of all trials against the noise, as the figures of the study have them.
  function drawScores(experiment, name, host, grid, paper) {
    const { levels, series } = experiment;
    const count = levels.labels.length;
    const strip = 13 * series.labels.length;
    const chart = frame(host, {
      label: `${name} against ${levels.name}, a curve for each of ${series.name} ${series.labels.join(", ")}; tables below`,
      x: {
        domain: [-0.5, count - 0.5], label: levels.name, format: (k) => levels.labels[k],
        ticks: [...new Set([0, Math.floor((count - 1) / 2), count - 1])],
      },
      y: { domain: [0, 1], ticks: [0, 0.2, 0.4, 0.6, 0.8, 1] }, height: 250, left: 32, right: strip + 44,
    });
    const pixel = (chart.x(1) - chart.x(0)) * 0.7 / series.labels.length;
    const start = chart.width - strip;
    series.colours.forEach((colour, k) => {
      const hairs = grid[k].map((trials, level) => {
        const x = chart.x(level) + (k + 0.5 - series.labels.length / 2) * pixel;
        return `M${x.toFixed(1)} ${chart.y(least(trials)).toFixed(1)}V${chart.y(most(trials)).toFixed(1)}`;
      });
      chart.plot.append(element("path", { class: "hair", d: hairs.join(""), stroke: colour, opacity: 0.45 }));
      if (!isPaper()) line(chart, paper[k].map((trials, level) => [level, mean(trials)]), { colour, ghost: true });
      line(chart, grid[k].map((trials, level) => [level, mean(trials)]), { colour, dots: true });
      const all = grid[k].flat();
      const [top, bottom] = [chart.y(most(all)), chart.y(least(all))];
      chart.plot.append(element("rect", { x: start + 13 * k + 1, y: top, width: 10, height: Math.max(bottom - top, 1), fill: colour }));
    });
    for (const k of new Set([0, series.labels.length - 1])) {
      chart.plot.append(element("text", { x: start + 13 * k + 6, y: chart.height - chart.bottom + 16, "text-anchor": "middle" }, series.labels[k]));
    }
    chart.plot.append(element("text", { class: "name", x: start + strip / 2, y: chart.height - chart.bottom + 33, "text-anchor": "middle" }, "ranges"));
    chart.plot.append(element("path", { class: "axis", d: `M${start} ${chart.height - chart.bottom}H${chart.width}` }));
    endLabels(chart, ends(experiment, grid.map((curve) => mean(curve[count - 1]))));
    cursor(chart, {
      places: levels.labels.map((_, level) => level), name: `Read the ${name}`,
      describe: (level) => `${levels.name} ${levels.labels[level]}: ${series.labels.map((label, k) => `${label}: ${mean(grid[k][level]).toFixed(3)}`).join(", ")} (by ${series.name})`,
    });
  }

  const scoreTable = (experiment, name, grid) => table(
    `${name}, means by ${experiment.series.name} and ${experiment.levels.name}; range of all trials`,
    [experiment.series.name, ...experiment.levels.labels, "smallest", "largest"],
    grid.map((curve, k) => [experiment.series.labels[k], ...curve.map((trials) => mean(trials).toFixed(3)), least(curve.flat()).toFixed(3), most(curve.flat()).toFixed(3)]));

  // Curves over the largest threshold, with a rule at the one that is set.
  function drawOver(host, name, { label, curves, y, reading }) {
    const stops = curves[0].points.map(([x]) => x);
    const chart = frame(host, {
      label, x: { domain: [stops[0], stops[stops.length - 1]], log: true, label: name === "TAS" ? "largest threshold, units of d" : "largest threshold, degrees" },
      y, height: 250, left: 40, right: 14 + 7 * Math.max(...curves.map(({ text }) => text.length)),
    });
    const threshold = state[THRESHOLD[name]];
    rule(chart, threshold, `${number(threshold)}${name === "TAS" ? " d" : "°"}`);
    curves.forEach(({ points, colour, dash }) => line(chart, points, { colour, dash }));
    endLabels(chart, curves.map(({ text, colour, points }) => ({ text, colour, y: points[points.length - 1][1] })));
    cursor(chart, {
      places: stops, name: `Read the curves of the ${name}`,
      describe: (k) => `up to ${SHOWN[THRESHOLD[name]](stops[k])}: ${curves.map((curve) => reading(curve, curve.points[k][1])).join(", ")}`,
    });
    return chart;
  }

  const every = (stops, step) => stops.filter((_, k) => k % step === 0 || k === stops.length - 1);
  const key = (...names) => [state.experiment, ...names.map((name) => state[name])].join();

  function drawOrders(experiment, bases, kinds) {
    const charts = hosts(byId("order-charts"), bases.map((name) => `${experiment.name} ${name}`), (name) => [`Order by the ${name.split(" ")[1]}`]);
    const tables = [];
    for (const name of bases) {
      const stops = every(STOPS[THRESHOLD[name]], 3);
      const found = once(`order ${name} ${key("quantile", "thresholds", "outliers")}`, () =>
        stops.map((stop) => ordersOf(experiment, scoresOf(experiment, name, state, stop)).map(([, value]) => value)));
      const curves = kinds.map((kind, k) => ({ text: kind, ...[{ colour: "#1d4f91" }, { colour: "#b3411c", dash: "7 3" }][k], points: stops.map((stop, i) => [stop, found[i][k]]) }));
      drawOver(charts[`${experiment.name} ${name}`], name, {
        label: `Probability of the right order by the ${name}, over the largest threshold; a table below`,
        curves, y: { domain: [0.4, 1], format: (value) => `${Math.round(100 * value)} %` },
        reading: ({ text }, value) => `${text} ${percent(value)}`,
      });
      tables.push(table(`Order by the ${name} over its largest threshold`, [UNIT[name] === "d" ? "d" : "degrees", ...kinds],
        stops.map((stop, i) => [number(stop), ...found[i].map(percent)])));
    }
    byId("order-tables").replaceChildren(...tables);
  }

  function drawProfiles(experiment, bases) {
    const charts = hosts(byId("profile-charts"), bases.map((name) => `${experiment.name} ${name}`), (name) => [`${name.split(" ")[1]} over its largest threshold`]);
    const { series, levels } = experiment;
    const tables = [];
    for (const name of bases) {
      const stops = every(STOPS[THRESHOLD[name]], 2);
      const cells = trialsOf(experiment).map((curve) => curve[levelOf(experiment)]);
      const [means, halves] = once(`profile ${name} ${key("quantile", "thresholds", "outliers")} ${levelOf(experiment)}`, () => [
        cells.map((trials) => stops.map((stop) => mean(trials.map((trial) => scoreOf(trial, name, state, stop))))),
        cells.map((trials) => quantile(trials.map((trial) => {
          const [errors, unit, options] = scored(trial, name, state);
          return half(errors, options) / unit;
        }).sort((a, b) => a - b), 0.5)),
      ]);
      const curves = means.map((values, k) => ({ text: series.labels[k], colour: series.colours[k], points: stops.map((stop, i) => [stop, values[i]]) }));
      const chart = drawOver(charts[`${experiment.name} ${name}`], name, {
        label: `Mean ${name} over the largest threshold at ${levels.name} ${levels.labels[levelOf(experiment)]}; a table below`,
        curves, y: { domain: [0, 1], ticks: [0, 0.25, 0.5, 0.75, 1] },
        reading: ({ text }, value) => `${text}: ${value.toFixed(3)}`,
      });
      halves.forEach((value, k) => {
        if (value < stops[0] || value > stops[stops.length - 1]) return;
        chart.plot.append(element("circle", { cx: chart.x(value).toFixed(1), cy: chart.y(0.5), r: 3.5, fill: "#fff", stroke: series.colours[k], "stroke-width": 1.8 }));
      });
      const few = every(stops, 4);
      tables.push(table(`${name} at ${levels.name} ${levels.labels[levelOf(experiment)]} over its largest threshold; one half: where it is reached, the median trial`,
        [series.name, "one half at", ...few.map((stop) => `${number(stop)} ${UNIT[name]}`)],
        series.labels.map((label, k) => [label, `${number(halves[k])} ${UNIT[name]}`, ...few.map((stop) => means[k][stops.indexOf(stop)].toFixed(3))])));
    }
    byId("profile-tables").replaceChildren(...tables);
  }

  function orderTable(rows) {
    const bar = (now, paper) => made("span", { class: "bar", "aria-hidden": "true" },
      made("i", { style: `width: ${Math.max(200 * (now - 0.5), 0).toFixed(1)}%` }), made("b", { style: `left: ${Math.max(200 * (paper - 0.5), 0).toFixed(1)}%` }));
    const box = table("From 50 to 100 %: the bar is now, the stroke the paper’s setting", ["Score", "neighbours in", "now", "paper", ""],
      rows.map(({ name, kind, now, paper }) => [name, kind, percent(now), percent(paper), bar(now, paper)]));
    byId("orders").replaceChildren(box.firstChild);
  }

  // ---- What it says -----------------------------------------------------------------------------

  function sentence(experiment, name, grid, paper) {
    const parts = [];
    if (name !== "RAS") parts.push(`${number(state.tas)} d${state.quantile === PAPER.quantile ? "" : ` (d the ${SHOWN.quantile(state.quantile)} quantile)`}`);
    if (name !== "TAS") parts.push(`${number(state.ras)}°`);
    const others = [];
    if (state.thresholds !== PAPER.thresholds) others.push(`${SHOWN.thresholds(state.thresholds)} ${state.thresholds === 1 ? "threshold" : "thresholds"}`);
    if (name === "PAS" && state.weight !== PAPER.weight) others.push(`weight ${number(state.weight)}`);
    if (usedBy(experiment).outliers && state.outliers !== "counted") others.push(state.outliers === "failures" ? "outliers as failures" : "without the outliers");
    const [ours, theirs] = [grid, paper].map((one) => one.flat(2));
    const [orders, before] = [grid, paper].map((one) => ordersOf(experiment, one));
    const ordered = orders.map(([kind, value], k) => `${kind} ${percent(value)}${isPaper() ? "" : ` (${percent(before[k][1])})`}`);
    return `${name} up to ${parts.join(" and ")}${others.length ? `, ${others.join(", ")}` : ""}${isPaper() ? ", the paper’s setting" : ""}: mean ${mean(ours).toFixed(3)}`
      + `${isPaper() ? "" : ` (in the paper’s setting ${mean(theirs).toFixed(3)})`}, from ${least(ours).toFixed(2)} to ${most(ours).toFixed(2)}`
      + `${ordered.length ? `; neighbours in the right order: ${ordered.join(", ")}` : ""}.`;
  }

  // Seen at once, and spoken when the slider rests.
  const [said, spoken] = [byId("said"), byId("spoken")];
  let resting;
  function say(text) {
    said.textContent = text;
    clearTimeout(resting);
    resting = setTimeout(() => { spoken.textContent = text; }, 700);
  }

  function draw() {
    const experiment = current();
    byId("which").textContent = [experiment.figure, experiment.title, ...experiment.about].filter(Boolean).join(" · ");
    const charts = hosts(byId("panels"), ["PAS", "TAS", "RAS"].filter((name) => experiment.scores.includes(name)).map((name) => `${experiment.name} ${name}`),
      (name) => [name.split(" ")[1], made("span", { class: "small" }, `by ${experiment.series.name} · ↑ higher is better`)]);
    const [tables, rows] = [[], []];
    for (const name of experiment.scores) {
      const grid = scoresOf(experiment, name, state);
      const paper = once(`paper ${experiment.name} ${name}`, () => scoresOf(experiment, name, PAPER));
      drawScores(experiment, name, charts[`${experiment.name} ${name}`], grid, paper);
      tables.push(scoreTable(experiment, name, grid));
      const before = ordersOf(experiment, paper);
      ordersOf(experiment, grid).forEach(([kind, now], k) => rows.push({ name, kind, now, paper: before[k][1] }));
      if (name === experiment.scores[experiment.scores.length - 1]) say(sentence(experiment, name, grid, paper));
    }
    byId("scores-tables").replaceChildren(...tables);
    orderTable(rows);
    const bases = experiment.scores.filter((name) => name !== "PAS");
    const kinds = [...new Set(rows.map(({ kind }) => kind))];
    byId("orders").parentNode.hidden = kinds.length === 0; // one level has no neighbours
    if (kinds.length) drawOrders(experiment, bases, kinds);
    drawProfiles(experiment, bases);
  }

  // ---- Events -----------------------------------------------------------------------------------

  // Drawn once for all changes that come together.
  let waiting = false;
  function update() {
    showControls();
    if (waiting) return;
    waiting = true;
    setTimeout(() => {
      waiting = false;
      draw();
    });
  }

  function change(changes) {
    Object.assign(state, changes);
    setting.write(state);
    update();
  }

  byId("level").addEventListener("input", () => change({ level: Number(byId("level").value) }));
  byId("controls").addEventListener("change", ({ target }) => {
    if (target.type === "radio") change({ [target.name]: target.value });
  });
  byId("reset").addEventListener("click", () => change(PAPER));
  window.addEventListener("hashchange", () => {
    if (document.getElementById(location.hash.slice(1))) return; // a link within the page
    Object.assign(state, setting.read());
    update();
  });

  byId("more").open = matchMedia("(min-width: 64.0625rem)").matches;
  showControls();
  const chosen = document.querySelector('[name="experiment"]:checked').parentNode;
  chosen.parentNode.scrollLeft = chosen.offsetLeft - chosen.parentNode.offsetLeft - 16; // on a phone
  draw();
  responsive(byId("panels"), update);
})();
