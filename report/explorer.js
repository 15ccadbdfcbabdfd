// Scores the errors of the trials under the setting of the controls, and draws what comes out.
(() => {
  "use strict";
  const { cursor, curves, element, endLabels, frame, html, line, number, responsive } = AlignmentCharts;
  const { WEIGHTS, at, controls, data, memory, roundNumbers, setting, unpacked } = AlignmentControls;
  const { half, mean, order, pas, quantile, score } = AlignmentScores;

  // Where each slider stops, and what its output says.
  const RANGES = {
    tas: [roundNumbers(0.05, 10), (value) => `${number(value)} d`],
    ras: [roundNumbers(0.5, 90), (value) => `${number(value)}°`],
    quantile: [data.quantiles, (value) => `${number(100 * value)} %`],
    thresholds: [[1, 2, 3, 5, 10, 20, 50, 100, 200, 500, 1000, Infinity], (value) => number(value, 4)],
    weight: [WEIGHTS, (value) => number(value)],
  };
  const KINDS = {
    TAS: { unit: "d", words: "units of d", threshold: "tas" },
    RAS: { unit: "°", words: "degrees", threshold: "ras" },
  };
  const stopsOf = (name) => RANGES[KINDS[name].threshold][0];
  const write = (name, value) => RANGES[name][1](value); // as the slider's output
  const within = (stops) => (value) => value >= stops[0] && value <= stops.at(-1);
  const whole = (value) => Number.isInteger(value) && value > 0;
  const kept = setting({
    experiment: [data.experiments[0].name, (name) => data.experiments.some((one) => one.name === name)],
    tas: [data.paper.tas, within(RANGES.tas[0])],
    ras: [data.paper.ras, within(RANGES.ras[0])],
    quantile: [data.paper.quantile, (value) => data.quantiles.includes(value)],
    thresholds: [data.paper.thresholds, (value) => whole(value) || value === Infinity],
    weight: [data.paper.weight, within(WEIGHTS)],
    outliers: ["counted", (value) => ["counted", "failures", "ignored"].includes(value)],
    level: [0, whole], // of the profiles: the first is 1, and 0 stands for the one in the middle
  }, update);
  const { change, defaults: PAPER, state } = kept;
  const SETTING = [...Object.keys(RANGES), "outliers"];

  // ---- The trials -------------------------------------------------------------------------------

  // Numbers of two bytes each on a logarithmic scale; see `pack` in report/explorer.py.
  function unpack({ low, high, codes }) {
    const step = Math.log(high / low) / 65533;
    return Float64Array.from(unpacked(Uint16Array, codes), (code) =>
      (code === 0 ? 0 : code === 65535 ? Infinity : low * Math.exp(step * (code - 1))));
  }

  // The trials of an experiment by curve and noise level; unpacked when it is first shown.
  const once = memory();
  const trialsOf = (experiment) => once(experiment, () => {
    const [positions, rotations, units] =
      [experiment.positions, experiment.rotations, experiment.units].map(unpack);
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
    return grid;
  });

  // ---- Their scores -----------------------------------------------------------------------------

  // The errors of a trial that count, in which unit, and under which options.
  function scored(trial, name, chosen) {
    const { thresholds, outliers } = chosen;
    const errors = outliers === "counted" ? trial[name] : trial[name].subarray(trial.outliers);
    const total = outliers === "ignored" ? errors.length : trial[name].length;
    const unit = name === "TAS" ? trial.units[data.quantiles.indexOf(chosen.quantile)] : 1;
    return [errors, unit, { thresholds, total }];
  }

  function scoreOf(trial, name, chosen, largest) {
    if (name === "PAS") {
      return pas(scoreOf(trial, "TAS", chosen), scoreOf(trial, "RAS", chosen), chosen.weight);
    }
    const [errors, unit, options] = scored(trial, name, chosen);
    return score(errors, unit, { ...options, maxThreshold: largest ?? chosen[KINDS[name].threshold] });
  }

  // The scores of all trials, by curve and level.
  function scoresOf(experiment, name, chosen, largest) {
    return trialsOf(experiment).map((curve) =>
      curve.map((trials) => trials.map((trial) => scoreOf(trial, name, chosen, largest))));
  }

  const transposed = (grid) => grid[0].map((_, level) => grid.map((curve) => curve[level]));

  // The probability of the right order of neighbours along each row, the mean over the rows: the last
  // level has the lowest scores.
  const orderOf = (rows) => mean(rows.map((levels) => order([...levels].reverse())));

  // What the order is asked of: the noise along the x axis, and what curves differ in where more of it
  // is worse.
  function ordersOf({ levels, series }, grid) {
    const found = [];
    if (grid[0].length > 1) found.push([levels.worsens, orderOf(grid)]);
    if (grid.length > 1 && series.worsens) found.push([series.worsens, orderOf(transposed(grid))]);
    return found;
  }

  // ---- The controls -----------------------------------------------------------------------------

  const current = () => data.experiments.find((one) => one.name === state.experiment);

  // Which settings change anything in an experiment, by their names.
  function usedBy({ scores, outliers }) {
    const [tas, ras, both] = ["TAS", "RAS", "PAS"].map((name) => scores.includes(name));
    return { tas, ras, quantile: tas, thresholds: true, weight: both, outliers: outliers.some(Boolean) };
  }

  function isPaper() {
    const used = usedBy(current());
    return kept.isDefault(SETTING.filter((name) => used[name]));
  }

  // The noise level of the profiles, from 0.
  function levelOf(experiment) {
    const count = experiment.levels.labels.length;
    return state.level >= 1 && state.level <= count ? state.level - 1 : Math.floor((count - 1) / 2);
  }

  const showSetting = controls(RANGES, kept, SETTING);

  function showControls() {
    const experiment = current();
    const used = usedBy(experiment);
    showSetting();
    for (const name of Object.keys(RANGES)) {
      at(name).parentNode.hidden = !used[name];
      at(name).parentNode.classList.toggle("changed", !kept.isDefault([name]));
    }
    at("outliers").hidden = !used.outliers;
    const labels = experiment.levels.labels;
    Object.assign(at("level"), { min: 1, max: labels.length, value: levelOf(experiment) + 1 });
    at("level-value").textContent = `${experiment.levels.name} = ${labels[levelOf(experiment)]}`;
    at("level").setAttribute("aria-valuetext", at("level-value").textContent);
  }

  // ---- Drawing ----------------------------------------------------------------------------------

  const percent = (value) => `${(100 * value).toFixed(1)} %`;

  // A table with a name for each row.
  function table(caption, head, rows) {
    const cells = (kind, scope, texts) => texts.map((text) => html(kind, scope ? { scope } : {}, text));
    const row = ([name, ...rest]) => html("tr", {}, ...cells("th", "row", [name]), ...cells("td", "", rest));
    return html("div", { class: "scroll", role: "group", tabindex: 0, "aria-label": caption },
      html("table", {}, html("caption", {}, caption),
        html("thead", {}, html("tr", {}, ...cells("th", "col", head))),
        html("tbody", {}, ...rows.map(row))));
  }

  // Where charts are drawn, by name; they stay while the experiment does.
  function hosts(parent, experiment, names, title) {
    if (parent.dataset.experiment !== experiment.name) {
      parent.dataset.experiment = experiment.name;
      parent.hosts = Object.fromEntries(names.map((name) => [name, html("div")]));
      parent.replaceChildren(...names.map((name) =>
        html("div", { class: "sheet" }, html("h3", {}, ...title(name)), parent.hosts[name])));
    }
    return parent.hosts;
  }

  const BAR = 13; // width of a range, with the gap beside it

  // The scores of all trials against the noise, as the figures of the study have them.
  function drawScores(experiment, name, host, grid, paper) {
    const { levels, series } = experiment;
    const count = levels.labels.length;
    const strip = BAR * series.labels.length;
    const chart = frame(host, {
      label: `${name} against ${levels.name}, a curve for each of ${series.name} ${series.labels.join(", ")}; tables below`,
      x: {
        domain: [-0.5, count - 0.5], label: levels.name, format: (k) => levels.labels[k],
        ticks: [...new Set([0, Math.floor((count - 1) / 2), count - 1])],
      },
      y: { domain: [0, 1], ticks: [0, 0.2, 0.4, 0.6, 0.8, 1] },
      height: 250, left: 32, right: strip + 44,
    });
    const [means, before] = [grid, paper].map((scores) => scores.map((curve) => curve.map(mean)));
    series.colours.forEach((colour, k) => {
      drawRanges(chart, grid[k], k, series);
      if (!isPaper()) line(chart, [...before[k].entries()], { colour, ghost: true });
      line(chart, [...means[k].entries()], { colour, dots: true });
    });
    const base = chart.height - chart.bottom;
    const start = chart.width - strip;
    const text = (x, y, words) => chart.plot.append(element("text", { x, y: base + y, "text-anchor": "middle" }, words));
    for (const k of new Set([0, series.labels.length - 1])) text(start + BAR * (k + 0.5), 16, series.labels[k]);
    text(start + strip / 2, 33, "ranges");
    chart.plot.append(element("path", { class: "axis", d: `M${start} ${base}H${chart.width}` }));
    endLabels(chart, series.labels.map((label, k) => ({ text: label, colour: series.colours[k], y: means[k][count - 1] })));
    const values = (level) => series.labels.map((label, k) => `${label}: ${means[k][level].toFixed(3)}`).join(", ");
    cursor(chart, {
      places: [...levels.labels.keys()], name: `Read the ${name}`,
      describe: (level) => `${levels.name} ${levels.labels[level]}: ${values(level)} (by ${series.name})`,
    });
  }

  // A hairline from the smallest to the largest trial at each level, and a bar at the right for all.
  function drawRanges(chart, curve, k, { labels, colours }) {
    const apart = (chart.x(1) - chart.x(0)) * 0.7 / labels.length;
    const hairs = curve.map((trials, level) => {
      const x = chart.x(level) + (k + 0.5 - labels.length / 2) * apart;
      return `M${x.toFixed(1)} ${chart.y(Math.min(...trials)).toFixed(1)}V${chart.y(Math.max(...trials)).toFixed(1)}`;
    });
    const all = curve.flat();
    const [top, bottom] = [chart.y(Math.max(...all)), chart.y(Math.min(...all))];
    const bar = { x: chart.width - BAR * (labels.length - k) + 1.5, y: top.toFixed(1), width: BAR - 3 };
    chart.plot.append(
      element("path", { class: "hair", d: hairs.join(""), stroke: colours[k], opacity: 0.45 }),
      element("rect", { ...bar, height: Math.max(bottom - top, 1).toFixed(1), fill: colours[k] }),
    );
  }

  const three = (value) => value.toFixed(3);

  function scoreTable({ levels, series }, name, grid) {
    const rows = grid.map((curve, k) => {
      const all = curve.flat();
      return [series.labels[k], ...[...curve.map(mean), Math.min(...all), Math.max(...all)].map(three)];
    });
    const caption = `${name}, means by ${series.name} and ${levels.name}; range of all trials`;
    return table(caption, [series.name, ...levels.labels, "smallest", "largest"], rows);
  }

  // Curves over the largest threshold, with a rule at the one that is set.
  function drawOver(host, name, { label, stops, lines, y, reading }) {
    const { threshold, words } = KINDS[name];
    const widest = Math.max(...lines.map(({ text }) => text.length));
    const read = (k) => lines.map(({ text, values }) => reading(text, values[k])).join(", ");
    const chart = curves(host, {
      label: `${label}, over the largest threshold; a table below`,
      places: stops, unit: words, lines, y, height: 250, left: 40, right: 14 + 7 * widest,
      at: state[threshold], word: write(threshold, state[threshold]),
      describe: (k) => `up to ${write(threshold, stops[k])}: ${read(k)}`,
      name: `Read the curves of the ${name}`,
    });
    chart.plot.prepend(...chart.plot.querySelectorAll(".rule, .name")); // beneath the curves
    endLabels(chart, lines.map(({ text, colour, values }) => ({ text, colour, y: values.at(-1) })));
    return chart;
  }

  const every = (stops, step) => stops.filter((_, k) => k % step === 0 || k === stops.length - 1);
  // What scores depend on besides their largest threshold.
  const basis = (name) => [state.experiment, name, state.quantile, state.thresholds, state.outliers].join();

  function drawOrders(experiment, names, kinds) {
    const charts = hosts(at("order-charts"), experiment, names, (name) => [`Order by the ${name}`]);
    const look = [{ colour: "#1d4f91" }, { colour: "#b3411c", dash: "7 3" }];
    at("order-tables").replaceChildren(...names.map((name) => {
      const stops = every(stopsOf(name), 3);
      const found = once(`order ${basis(name)}`, () => stops.map((stop) =>
        ordersOf(experiment, scoresOf(experiment, name, state, stop)).map(([, value]) => value)));
      drawOver(charts[name], name, {
        label: `Probability of the right order by the ${name}`,
        stops, lines: kinds.map((text, k) => ({ text, ...look[k], values: found.map((orders) => orders[k]) })),
        y: { domain: [0.4, 1], format: (value) => `${Math.round(100 * value)} %` },
        reading: (text, value) => `${text} ${percent(value)}`,
      });
      return table(`Order by the ${name} over its largest threshold`, [KINDS[name].unit, ...kinds],
        stops.map((stop, i) => [number(stop), ...found[i].map(percent)]));
    }));
  }

  function drawProfiles(experiment, names) {
    const charts = hosts(at("profile-charts"), experiment, names, (name) => [`${name} over its largest threshold`]);
    const { series, levels } = experiment;
    const level = levelOf(experiment);
    const where = `at ${levels.name} ${levels.labels[level]}`;
    at("profile-tables").replaceChildren(...names.map((name) => {
      const stops = every(stopsOf(name), 2);
      const [means, halves] = once(`profile ${basis(name)} ${level}`, () => profilesOf(experiment, name, level, stops));
      const chart = drawOver(charts[name], name, {
        label: `Mean ${name} ${where}`,
        stops, lines: series.labels.map((text, k) => ({ text, colour: series.colours[k], values: means[k] })),
        y: { domain: [0, 1], ticks: [0, 0.25, 0.5, 0.75, 1] },
        reading: (text, value) => `${text}: ${three(value)}`,
      });
      halves.forEach((value, k) => {
        if (!within(stops)(value)) return;
        const circle = { cx: chart.x(value).toFixed(1), cy: chart.y(0.5), r: 3.5, fill: "#fff" };
        chart.plot.append(element("circle", { ...circle, stroke: series.colours[k], "stroke-width": 1.8 }));
      });
      const { unit } = KINDS[name];
      const few = [...stops.keys()].filter((k) => k % 4 === 0);
      return table(`${name} ${where} over its largest threshold; one half: where it is reached, the median trial`,
        [series.name, "one half at", ...few.map((k) => `${number(stops[k])} ${unit}`)],
        series.labels.map((label, k) =>
          [label, `${number(halves[k])} ${unit}`, ...few.map((i) => three(means[k][i]))]));
    }));
  }

  // The mean score of each curve at each largest threshold, and where the median trial reaches one half.
  function profilesOf(experiment, name, level, stops) {
    const cells = trialsOf(experiment).map((curve) => curve[level]);
    const halfOf = (trial) => {
      const [errors, unit, options] = scored(trial, name, state);
      return half(errors, options) / unit;
    };
    return [
      cells.map((trials) => stops.map((stop) => mean(trials.map((trial) => scoreOf(trial, name, state, stop))))),
      cells.map((trials) => quantile(trials.map(halfOf).sort((a, b) => a - b), 0.5)),
    ];
  }

  function orderTable(rows) {
    const share = (value) => `${Math.max(200 * (value - 0.5), 0).toFixed(1)}%`;
    const bar = (now, paper) => html("span", { class: "bar", "aria-hidden": "true" },
      html("i", { style: `width: ${share(now)}` }), html("b", { style: `left: ${share(paper)}` }));
    at("orders").replaceChildren(table("From 50 to 100 %: the bar is now, the stroke the paper’s setting",
      ["Score", "neighbours in", "now", "paper", ""],
      rows.map(({ name, kind, now, paper }) => [name, kind, percent(now), percent(paper), bar(now, paper)])));
  }

  // ---- What it says -----------------------------------------------------------------------------

  // The setting as far as it concerns a score, in words.
  function inWords(experiment, name) {
    const words = [];
    const quantileSaid = state.quantile === PAPER.quantile ? "" : ` (d the ${write("quantile", state.quantile)} quantile)`;
    if (name !== "RAS") words.push(`${write("tas", state.tas)}${quantileSaid}`);
    if (name !== "TAS") words.push(write("ras", state.ras));
    const parts = [`${name} up to ${words.join(" and ")}`];
    if (isPaper()) parts.push("the paper’s setting");
    if (state.thresholds !== PAPER.thresholds) {
      parts.push(`${write("thresholds", state.thresholds)} ${state.thresholds === 1 ? "threshold" : "thresholds"}`);
    }
    if (name === "PAS" && state.weight !== PAPER.weight) parts.push(`weight ${write("weight", state.weight)}`);
    if (usedBy(experiment).outliers && state.outliers !== "counted") {
      parts.push(state.outliers === "failures" ? "outliers as failures" : "without the outliers");
    }
    return parts.join(", ");
  }

  // What came out, with the paper's setting in brackets where it is another.
  function sentence(experiment, name, grid, before, rows) {
    const beside = (text) => (isPaper() ? "" : ` (${text})`);
    const all = grid.flat(2);
    const orders = rows.map(({ kind, now, paper }) => `${kind} ${percent(now)}${beside(percent(paper))}`);
    const average = `mean ${three(mean(all))}${beside(`in the paper’s setting ${three(mean(before.flat(2)))}`)}`;
    const ordered = orders.length ? `; neighbours in the right order: ${orders.join(", ")}` : "";
    return `${inWords(experiment, name)}: ${average}, from ${Math.min(...all).toFixed(2)} to ${Math.max(...all).toFixed(2)}${ordered}.`;
  }

  // Seen at once, and spoken when the slider rests.
  let resting;
  function say(text) {
    at("said").textContent = text;
    clearTimeout(resting);
    resting = setTimeout(() => { at("spoken").textContent = text; }, 700);
  }

  function draw() {
    const experiment = current();
    const { figure, title, about, scores, series } = experiment;
    at("which").textContent = [figure, title, ...about].filter(Boolean).join(" · ");
    const remark = `by ${series.name} · ↑ higher is better`;
    const charts = hosts(at("panels"), experiment, ["PAS", "TAS", "RAS"].filter((name) => scores.includes(name)),
      (name) => [name, html("span", { class: "small" }, remark)]);
    const rows = [];
    at("scores-tables").replaceChildren(...scores.map((name) => {
      const grid = scoresOf(experiment, name, state);
      const before = once(`paper ${experiment.name} ${name}`, () => scoresOf(experiment, name, PAPER));
      drawScores(experiment, name, charts[name], grid, before);
      const paper = ordersOf(experiment, before);
      const own = ordersOf(experiment, grid).map(([kind, now], k) => ({ name, kind, now, paper: paper[k][1] }));
      rows.push(...own);
      if (name === scores.at(-1)) say(sentence(experiment, name, grid, before, own));
      return scoreTable(experiment, name, grid);
    }));
    orderTable(rows);
    const kinds = [...new Set(rows.map(({ kind }) => kind))];
    at("orders").parentNode.hidden = kinds.length === 0; // one level has no neighbours
    const names = scores.filter((name) => name !== "PAS");
    if (kinds.length) drawOrders(experiment, names, kinds);
    drawProfiles(experiment, names);
  }

  // ---- Events -----------------------------------------------------------------------------------

  // Drawn once for all changes that come together.
  let waiting;
  function update() {
    showControls();
    clearTimeout(waiting);
    waiting = setTimeout(draw);
  }

  at("level").addEventListener("input", () => change({ level: Number(at("level").value) }));
  at("more").open = matchMedia("(min-width: 64.0625rem)").matches;
  showControls();
  const chosen = document.querySelector('[name="experiment"]:checked').parentNode;
  chosen.parentNode.scrollLeft = chosen.offsetLeft - chosen.parentNode.offsetLeft - 16; // on a phone
  draw();
  responsive(at("panels"), update);
})();
