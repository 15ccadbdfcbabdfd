// The page of estimates: their scores at any thresholds, trajectories, and errors over time.
(() => {
  "use strict";
  const { cursor, element, frame, html, line, number, responsive, rule } = AlignmentCharts;
  const { at, controls, roundNumbers } = AlignmentControls;
  const { score, pas } = AlignmentScores;
  const data = JSON.parse(at("data").textContent);
  const run = data.settings;
  const KINDS = { position: { name: "TAS", word: data.unit, unit: run.unit }, rotation: { name: "RAS", word: "deg", unit: 1 } };
  const COLOURS = ["#1d4f91", "#b3411c", "#14613a", "#7a3c93", "#8a6100", "#00707a", "#a8225d", "#555b63"];
  const DASHES = [null, "6 3", "2 3", "8 3 2 3", "12 2"];
  // Dark to light, so that the order survives greyscale and colour blindness.
  const RAMP = ["#000004", "#180c3c", "#440a68", "#6d186e", "#972766", "#c03a51", "#e15635", "#f67e14", "#fcae12"];
  const BEYOND = "#1289c9"; // not a colour of the ramp
  const GREY = "#a9adb3";
  const positive = (value) => value > 0 && value < Infinity;
  const digits = (value) => (Number.isFinite(value) ? value.toFixed(3) : "–");
  const given = (value) => (value === null ? "–" : number(value));
  const text = (id, words) => { at(id).textContent = words; };

  // Numbers of a kind, such as Float32Array, from the base64 of their bytes.
  const unpacked = (Kind, packed) => new Kind(Uint8Array.from(atob(packed), (letter) => letter.charCodeAt(0)).buffer);
  const reference = unpacked(Float32Array, data.positions);
  const stamps = data.cameras.stamps && unpacked(Float64Array, data.cameras.stamps);
  const timeOf = (row) => (stamps ? stamps[row] - stamps[0] : row);
  const nameOf = (row) => (stamps ? `${timeOf(row).toFixed(2)} s` : data.cameras.names[row]);
  const estimates = data.estimates.map((packed, index) => {
    const one = {
      ...packed,
      colour: COLOURS[index % COLOURS.length],
      dash: DASHES[index % DASHES.length],
      rows: unpacked(Uint32Array, packed.rows),
      lost: unpacked(Uint8Array, packed.lost),
      position: unpacked(Float64Array, packed.position),
      rotation: unpacked(Float64Array, packed.rotation),
      positions: unpacked(Float32Array, packed.positions),
    };
    const counted = (errors) => errors.filter((_, camera) => run.missing === "fail" || !one.lost[camera]);
    one.scored = { position: counted(one.position), rotation: counted(one.rotation) };
    one.cameraOf = new Map(Array.from(one.rows, (row, camera) => [row, camera]));
    return one;
  });
  const withErrors = (kind) => estimates.filter((one) => !one[kind].every(Number.isNaN)); // a file may lack rotations
  const hasRotations = withErrors("rotation").length > 0;
  const rows = Array.from(new Set(estimates.flatMap((one) => [...one.rows]))).sort((a, b) => a - b);

  // The sliders, and what the drawings show.
  const state = {
    threshold: run.threshold, degrees: run.degrees, weight: run.weight,
    colour: estimates.length > 1 ? "estimate" : "position", camera: -1, turn: 0, tilt: 0, near: 1,
  };
  const factor = (kind) => (kind === "position" ? state.threshold : state.degrees);
  const largest = (kind) => KINDS[kind].unit * factor(kind);
  const scoreOf = (kind, one) => (!withErrors(kind).includes(one) ? NaN : score(one.scored[kind], KINDS[kind].unit, factor(kind)));

  // The table, of the same columns as the command's: one row an estimate, filled anew.
  const swatch = ({ colour, dash }) => {
    const svg = element("svg", { width: 30, height: 10, "aria-hidden": "true" });
    svg.append(element("path", { d: "M0 5H30", stroke: colour, "stroke-width": 2.5, "stroke-dasharray": dash }));
    return svg;
  };
  const cells = estimates.map((one) => {
    const made = Array.from({ length: 9 }, () => html("td"));
    at("rows").append(html("tr", {}, html("th", { scope: "row" }, swatch(one), ` ${one.name}`), ...made));
    return made;
  });
  function fillTable() {
    estimates.forEach((one, index) => {
      const [tas, ras] = [scoreOf("position", one), scoreOf("rotation", one)];
      const values = [
        ...[tas, ras, pas(tas, ras, state.weight)].map(digits), ...one.half.map(given), ...one.median.map(given),
        given(one.ate), `${(100 * one.tracked).toFixed(1)}%`,
      ];
      cells[index].forEach((cell, column) => { cell.textContent = values[column]; });
    });
    const isRun = ["threshold", "degrees", "weight"].every((key) => state[key] === run[key]);
    const rotations = hasRotations ? ` and ${number(state.degrees)} degrees, weight ${number(state.weight)}` : "";
    text("setting", `Up to ${number(state.threshold)} d${rotations}, lost frames `
      + `${run.missing === "fail" ? "score 0" : "are left out"}: ${isRun ? "as in the run" : "not as in the run"}.`);
    at("reset").disabled = isRun;
    showControls();
  }
  const showControls = controls({
    threshold: [roundNumbers(0.01, 100), (value) => `${number(value)} d = ${number(value * run.unit)} ${data.unit}`],
    degrees: [roundNumbers(0.1, 180), (value) => `${number(value)} degrees`],
    weight: [Array.from({ length: 21 }, (_, k) => k / 20), (value) => `${number(value)} TAS + ${number(1 - value)} RAS`],
  }, state, (changes) => { Object.assign(state, changes); render(); });

  // One frame of the reference that is picked in a chart and marked in the trajectories.
  function pick(row) {
    state.camera = row;
    drawScene();
  }
  const errorOf = (one, kind, row) => one[kind][one.cameraOf.get(row)] ?? NaN;
  const describe = (kind) => (index) => `${nameOf(rows[index])}: ${withErrors(kind).map((one) => {
    const error = errorOf(one, kind, rows[index]);
    return `${one.name} ${Number.isFinite(error) ? `${number(error)} ${KINDS[kind].word}` : "lost"}`;
  }).join(", ")}`;

  // Charts over time, or over images in their order.
  const span = [timeOf(rows[0]), Math.max(timeOf(rows.at(-1)), timeOf(rows[0]) + 1e-9)];
  const across = { domain: span, label: stamps ? "time [s]" : data.ordered ? "frame" : "image" };
  const MARGINS = { left: 56, right: 12 };
  // Whether a camera is the last one, or the last one before a gap of the reference.
  const endsAt = (one, camera) => camera + 1 === one.rows.length || data.breaks.includes(one.rows[camera + 1]);

  function errorChart(kind) {
    return (host) => {
      const values = estimates.flatMap((one) => Array.from(one[kind])).filter(positive).sort((a, b) => a - b);
      const limit = largest(kind);
      const ends = [values[Math.floor(values.length / 100)], values.at(-1), limit].filter(positive);
      const made = frame(host, {
        ...MARGINS, label: `Errors over time, ${kind}s`, x: across,
        y: { domain: [Math.min(...ends) / 1.5, Math.max(...ends) * 1.5], log: true, label: `${kind} error [${KINDS[kind].word}]` },
      });
      const low = Math.min(...ends) / 1.5;
      for (const one of withErrors(kind)) {
        const points = Array.from(one.rows).flatMap((row, camera) => [
          [timeOf(row), Math.max(one[kind][camera], low)], ...(endsAt(one, camera) ? [[NaN, NaN]] : []),
        ]);
        if (data.ordered) line(made, points, { colour: one.colour, dash: one.dash, width: 1.3 });
        else made.plot.append(dots(points.filter(([, y]) => Number.isFinite(y)).map(([x, y]) => [made.x(x), made.y(y)]), one.colour));
      }
      made.plot.append(
        element("path", { class: "rule", d: `M${made.left} ${made.y(limit)}H${made.width - made.right}` }),
        element("text", { class: "name", x: made.width - made.right, y: made.y(limit) - 4, "text-anchor": "end" }, "largest threshold"),
      );
      const index = rows.indexOf(state.camera);
      cursor(made, { places: rows.map(timeOf), describe: describe(kind), name: `${kind} errors`, pick: (k) => pick(rows[k]), at: index });
    };
  }
  const dots = (points, stroke) => element("path", {
    class: "camera", stroke, "stroke-width": 4, d: points.map(([x, y]) => `M${x.toFixed(1)} ${y.toFixed(1)}h0`).join(""),
  });

  // A band for each estimate: tracked, an outlier, or lost.
  function bandChart(host) {
    const width = Math.max(host.clientWidth, 200);
    const svg = element("svg", { class: "chart", width, height: 22 * estimates.length, role: "img", "aria-label": "Tracked and lost frames" });
    const place = (row) => MARGINS.left + (width - MARGINS.left - MARGINS.right) * (timeOf(row) - span[0]) / (span[1] - span[0]);
    estimates.forEach((one, index) => {
      const kindOf = (camera) => (one.position[camera] === Infinity ? "lost"
        : one.position[camera] >= largest("position") || one.rotation[camera] >= largest("rotation") ? "outlier" : "tracked");
      svg.append(element("path", { d: `M4 ${22 * index + 10}H${MARGINS.left - 12}`, stroke: one.colour, "stroke-width": 2.5, "stroke-dasharray": one.dash }));
      for (let start = 0, end = 1; start < one.rows.length; end++) {
        const gap = endsAt(one, end - 1);
        if (!gap && kindOf(end) === kindOf(start)) continue;
        const [x, last] = [place(one.rows[start]), place(one.rows[gap ? end - 1 : end])];
        svg.append(element("rect", { class: kindOf(start), x, y: 22 * index + 4, width: Math.max(last - x, 1), height: 12 }));
        start = end;
      }
    });
    host.replaceChildren(svg);
  }

  function cumulativeChart(kind) {
    return (host) => {
      const limit = largest(kind);
      const made = frame(host, {
        ...MARGINS, label: `Share of the frames below each threshold, ${kind}s`,
        x: { domain: [0, limit], label: `threshold [${KINDS[kind].word}]` },
        y: { domain: [0, 1], format: (value) => `${number(100 * value)} %`, label: "frames below" },
      });
      for (const one of withErrors(kind)) {
        const sorted = one.scored[kind].slice().sort();
        const points = [[0, 0]];
        for (let k = 1, below = 0; k <= 100; k++) {
          while (sorted[below] < limit * k / 100) below += 1;
          points.push([limit * (k - 1) / 100, below / sorted.length], [limit * k / 100, below / sorted.length]);
        }
        if (estimates.length === 1) {
          const outline = points.map(([x, y]) => `L${made.x(x).toFixed(1)} ${made.y(y).toFixed(1)}`).join("");
          made.plot.append(element("path", { class: "fill", d: `M${made.x(0)} ${made.y(0)}${outline}V${made.y(0)}Z` }));
        }
        line(made, points, one);
      }
    };
  }

  function profileChart(kind) {
    const middle = kind === "position" ? run.unit : 10;
    const places = Array.from({ length: 40 }, (_, k) => middle / 30 * 900 ** (k / 39));
    const { name, word } = KINDS[kind];
    return (host) => {
      const lines = withErrors(kind).map((one) => ({ ...one, values: places.map((unit) => score(one.scored[kind], unit)) }));
      const made = frame(host, {
        ...MARGINS, label: `${name} over its largest threshold`,
        x: { domain: [places[0], places.at(-1)], log: true, label: `largest threshold [${word}]` }, y: { domain: [0, 1], label: name },
      });
      for (const one of lines) line(made, one.values.map((value, k) => [places[k], value]), one);
      if (places[0] <= largest(kind) && largest(kind) <= places.at(-1)) rule(made, largest(kind), "here");
      cursor(made, {
        places, name: `${name} over its largest threshold`,
        describe: (index) => `up to ${number(places[index])} ${word}: ${lines.map((one) => `${one.name} ${digits(one.values[index])}`).join(", ")}`,
      });
    };
  }

  // The trajectories from above, the axis along which the reference is thinnest; they can be rotated.
  const scene = at("scene");
  const extents = [0, 1, 2].map((axis) => {
    const values = reference.filter((value, k) => k % 3 === axis && Number.isFinite(value));
    return values.reduce((most, value) => Math.max(most, value), -Infinity) - values.reduce((least, value) => Math.min(least, value), Infinity);
  });
  const thin = extents.indexOf(Math.min(...extents));
  const [first, second] = [0, 1, 2].filter((axis) => axis !== thin);
  const side = thin === 1 ? -1 : 1; // a right-handed frame

  // Returns where the triple of `points` that starts at `start` is on the canvas.
  function projection() {
    const [turn, tilt] = [state.turn, state.tilt].map((degrees) => degrees * Math.PI / 180);
    const [ct, st, cf, sf] = [Math.cos(turn), Math.sin(turn), Math.cos(tilt), Math.sin(tilt)];
    const fits = [scene.clientWidth / extents[first], scene.clientHeight / extents[second]].filter(positive);
    const zoom = 0.92 * state.near * (fits.length ? Math.min(...fits) : 1);
    return (points, start) => {
      const [a, b, c] = [points[start + first], points[start + second], side * points[start + thin]];
      const up = (st * a + ct * b) * cf + c * sf;
      return [scene.clientWidth / 2 + zoom * (ct * a - st * b), scene.clientHeight / 2 - zoom * up];
    };
  }

  function drawScene() {
    const ratio = devicePixelRatio || 1;
    scene.width = scene.clientWidth * ratio;
    scene.height = scene.clientHeight * ratio;
    const pen = scene.getContext("2d");
    pen.scale(ratio, ratio);
    const project = projection();
    drawPath(pen, project, reference, GREY, null);
    for (const one of estimates) {
      if (state.colour === "estimate") drawPath(pen, project, one.positions, one.colour, one.dash);
      else drawErrors(pen, project, one);
    }
    markPicked(pen, project);
    const coloured = state.colour !== "estimate";
    at("ramp").hidden = !coloured;
    if (coloured) text("ramp-end", `${number(largest(state.colour))} ${KINDS[state.colour].word}`);
  }
  function drawPath(pen, project, points, colour, dash) {
    pen.strokeStyle = pen.fillStyle = colour;
    pen.lineWidth = 1.6;
    pen.setLineDash(dash ? dash.split(" ").map(Number) : []);
    pen.beginPath();
    let drawn = false;
    for (let k = 0; k < points.length; k += 3) {
      if (!Number.isFinite(points[k])) { drawn = false; continue; }
      const [x, y] = project(points, k);
      if (!data.ordered) pen.fillRect(x - 1.5, y - 1.5, 3, 3);
      else if (drawn) pen.lineTo(x, y);
      else pen.moveTo(x, y);
      drawn = true;
    }
    pen.stroke();
    pen.setLineDash([]);
  }
  function drawErrors(pen, project, one) {
    const [values, limit] = [one[state.colour], largest(state.colour)];
    for (let camera = 0; camera < one.rows.length; camera++) {
      if (!Number.isFinite(one.positions[3 * camera])) continue;
      const [x, y] = project(one.positions, 3 * camera);
      const share = values[camera] / limit;
      pen.fillStyle = share < 1 ? RAMP[Math.floor(share * RAMP.length)] : BEYOND;
      pen.fillRect(x - 2, y - 2, 4, 4);
    }
  }
  function markPicked(pen, project) {
    if (state.camera < 0) return;
    const ring = (points, start, colour) => {
      const [x, y] = project(points, start);
      pen.strokeStyle = colour;
      pen.lineWidth = 2;
      pen.beginPath();
      pen.arc(x, y, 7, 0, 2 * Math.PI);
      pen.stroke();
    };
    ring(reference, 3 * state.camera, "#1d2024");
    for (const one of estimates) {
      const camera = one.cameraOf.get(state.camera);
      if (camera !== undefined && Number.isFinite(one.positions[3 * camera])) ring(one.positions, 3 * camera, one.colour);
    }
  }

  function view(changes) {
    Object.assign(state, changes);
    state.tilt = Math.min(Math.max(state.tilt, -90), 90);
    state.near = Math.min(Math.max(state.near, 0.25), 64);
    drawScene();
  }
  let held = null; // where the pointer was last, while it is down
  scene.addEventListener("pointerdown", (event) => {
    held = [event.clientX, event.clientY];
    if (event.isTrusted) scene.setPointerCapture(event.pointerId);
  });
  scene.addEventListener("pointermove", (event) => {
    if (!held) return;
    const [dx, dy] = [event.clientX - held[0], event.clientY - held[1]];
    held = [event.clientX, event.clientY];
    view({ turn: state.turn + dx / 2, tilt: state.tilt + dy / 2 });
  });
  for (const end of ["pointerup", "pointercancel"]) scene.addEventListener(end, () => { held = null; });
  function press(key) {
    const { turn, tilt, near } = state;
    const views = {
      ArrowLeft: { turn: turn - 5 }, ArrowRight: { turn: turn + 5 }, ArrowUp: { tilt: tilt - 5 }, ArrowDown: { tilt: tilt + 5 },
      "+": { near: near * 1.5 }, "-": { near: near / 1.5 }, Home: { turn: 0, tilt: 0, near: 1 },
      tilt: { tilt: tilt >= 90 ? 0 : tilt + 30 }, // no key: on a phone a finger scrolls the page
    };
    if (key in views) view(views[key]);
    return key in views;
  }
  scene.addEventListener("keydown", (event) => {
    if (!event.ctrlKey && !event.metaKey && !event.altKey && press(event.key)) event.preventDefault();
  });
  for (const button of document.querySelectorAll("[data-key]")) button.addEventListener("click", () => press(button.dataset.key));

  // What does not change.
  document.title = data.title;
  text("title", data.title);
  text("kicker", `${run.aligned}; d = ${number(run.unit)} ${data.unit}`);
  document.querySelectorAll(".unit").forEach((place) => { place.textContent = `[${data.unit}]`; });
  text("alignment", "At other thresholds the scores keep the run's alignment; the command aligns anew, so its TAS may be slightly higher.");
  at("notes").append(...estimates.flatMap((one) => one.notes).map((note) => html("li", {}, note)));
  text("origin", `alignscores ${data.version}`);
  at("ramp").querySelector(".ramp").style.background = `linear-gradient(90deg, ${RAMP.join(", ")})`;
  document.querySelectorAll(".rotations").forEach((part) => { part.hidden = !hasRotations; });
  const charts = [[scene, drawScene], [at("bands"), () => bandChart(at("bands"))]];
  for (const kind of hasRotations ? Object.keys(KINDS) : ["position"]) {
    for (const [name, made] of [["errors", errorChart(kind)], ["cumulative", cumulativeChart(kind)], ["profile", profileChart(kind)]]) {
      const host = at(`${kind}-${name}`);
      charts.push([host, () => made(host)]);
    }
  }
  for (const [host, draw] of charts) responsive(host, draw);

  function render() {
    fillTable();
    for (const [, draw] of charts) draw();
  }
  render();
})();
