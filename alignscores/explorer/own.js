// The page of one's own files: scores for any setting, and the errors behind them, camera by camera.
(() => {
  "use strict";
  const { curves, element, frame, html, line, number, responsive } = AlignmentCharts;
  const { STEPS, WEIGHTS, at, controls, data, memory, roundNumbers, setting, unpacked } = AlignmentControls;
  const { score, pas, profile } = AlignmentScores;
  const run = data.settings;
  const QUANTILES = data.quantiles;
  const KINDS = {
    position: { name: "TAS", colour: "#1d4f91", unit: data.unit },
    rotation: { name: "RAS", colour: "#8a3b12", unit: "deg" },
  };
  // Dark to light, so that the order survives greyscale and colour blindness; the light end, which
  // cannot be seen on white, is left out.
  const RAMP = [[0, 0, 4], [24, 12, 60], [68, 10, 104], [109, 24, 110], [151, 39, 102], [192, 58, 81], [225, 86, 53], [246, 126, 20], [252, 174, 18]];
  const SHADES = 48;
  const BEYOND = "#1289c9"; // in no place of the ramp
  const UNITS = 48; // of a profile

  const text = (id, words) => { at(id).textContent = words; };
  const digits = (value) => (Number.isFinite(value) ? value.toFixed(4) : "–");

  // Data.
  const reference = unpacked(Float32Array, data.positions);
  const stamps = data.cameras.stamps && unpacked(Float64Array, data.cameras.stamps);
  const names = data.cameras.names;
  const nameOf = (row) => (stamps ? String(stamps[row]) : names[row]);
  const placeOf = (row) => (stamps ? stamps[row] - stamps[0] : row);
  const isLost = (one, camera) => data.statuses[one.codes[camera]] === "lost";
  const estimates = data.estimates.map((packed) => {
    const one = {
      ...packed,
      rows: unpacked(Uint32Array, packed.rows),
      codes: unpacked(Uint8Array, packed.codes),
      position: unpacked(Float64Array, packed.position),
      rotation: unpacked(Float64Array, packed.rotation),
      positions: unpacked(Float32Array, packed.positions),
    };
    const all = Array.from(one.rows.keys());
    const estimated = all.filter((camera) => !isLost(one, camera));
    one.scored = { fail: of(one, all), ignore: of(one, estimated) };
    one.cameraOf = new Map(all.map((camera) => [one.rows[camera], camera]));
    return one;
  });

  // The cameras that count under a policy, with their errors in the same order, and those ascending.
  function of(one, cameras) {
    const errors = (kind) => Float64Array.from(cameras, (camera) => one[kind][camera]);
    const found = { cameras, position: errors("position"), rotation: errors("rotation") };
    found.sorted = { position: found.position.slice().sort(), rotation: found.rotation.slice().sort() };
    return found;
  }

  const twentieths = Array.from({ length: QUANTILES + 1 }, (_, k) => k / QUANTILES);
  // State. Keys are those of the address.
  const positive = (value) => value > 0 && value < Infinity;
  const kept = setting({
    estimate: [1, (value) => estimates[value - 1] !== undefined],
    threshold: [run.threshold, positive],
    degrees: [run.degrees, positive],
    quantile: [0.75, (value) => run.unit === null && twentieths.indexOf(value) > 0],
    steps: [run.steps, (value) => Number.isInteger(value) && value > 0 && value <= 10000],
    weight: [run.weight, (value) => value >= 0 && value <= 1],
    missing: [run.missing, (value) => value === "fail" || value === "ignore"],
    colour: ["position", (value) => Object.hasOwn(KINDS, value)],
    camera: [-1, (value) => Number.isInteger(value) && value >= 0 && value < reference.length / 3],
    turn: [0, Number.isFinite],
    tilt: [0, (value) => Math.abs(value) <= 180],
    near: [1, positive],
  }, render);
  const { change, state } = kept;
  const SETTING = ["threshold", "degrees", "quantile", "steps", "weight", "missing"];
  const shown = () => estimates[state.estimate - 1];
  const scored = (one = shown()) => one.scored[state.missing];
  const unitOf = (one) => run.unit ?? one.units[Math.round(state.quantile * QUANTILES) - 1] ?? NaN;
  const options = (kind) => ({ thresholds: state.steps, maxThreshold: kind === "position" ? state.threshold : state.degrees });
  const unit = (kind, one = shown()) => (kind === "position" ? unitOf(one) : 1);
  const largest = (kind, one = shown()) => unit(kind, one) * options(kind).maxThreshold;
  const isRun = () => kept.isDefault(SETTING);

  const scoreOf = (kind, one = shown()) => (positive(unit(kind, one)) ? score(scored(one)[kind], unit(kind, one), options(kind)) : NaN);
  function scores(one) {
    const [tas, ras] = Object.keys(KINDS).map((kind) => scoreOf(kind, one));
    return { TAS: tas, RAS: ras, PAS: pas(tas, ras, state.weight) };
  }

  // The table: one row an estimate, made once and filled anew.
  const rows = estimates.map((one, index) => {
    const radio = html("input", { type: "radio", name: "estimate", value: index + 1 });
    const cells = Array.from({ length: 10 }, () => html("td"));
    const head = html("th", { scope: "row" }, html("label", {}, radio, ` ${one.name}`));
    at("rows").append(html("tr", {}, head, ...cells));
    return { one, cells };
  });
  const withSd = ([mean, sd]) => (sd === null ? digits(mean) : `${digits(mean)} ± ${digits(sd)}`);

  function fillTable() {
    for (const { one, cells } of rows) {
      const found = scores(one);
      const errors = scored(one);
      const failed = errors.cameras.filter((camera) => one.position[camera] === Infinity || one.rotation[camera] === Infinity).length;
      const values = [
        digits(found.TAS), digits(found.RAS), digits(found.PAS), number(unitOf(one), 4), errors.cameras.length, failed,
        withSd(one.TAS), withSd(one.PAS), ...one.half.map((value) => (value === null ? "–" : number(value))),
      ];
      cells.forEach((cell, column) => { cell.textContent = values[column]; });
    }
  }

  function fillTexts() {
    const found = scores(shown());
    text("now", `${isRun() ? "As in the run" : "Not as in the run"}: TAS ${digits(found.TAS)}, RAS ${digits(found.RAS)}, PAS ${digits(found.PAS)}`);
    const d = run.unit === null ? `, d the ${number(state.quantile)} quantile` : ", d fixed by the run";
    text("setting", `Up to ${number(state.threshold)} d and ${number(state.degrees)} degrees${d}, ${state.steps} thresholds, `
      + `weight ${number(state.weight)}, cameras without an estimate ${state.missing === "fail" ? "fail" : "are left out"}: `
      + `${isRun() ? "as in the run" : "not as in the run"}.`);
    at("reset").disabled = isRun();
    at("notes").replaceChildren(...shown().notes.map((note) => html("li", {}, note)));
    showControls();
  }

  // Controls.
  const showControls = controls({
    threshold: [roundNumbers(0.01, 100), (value) => `${number(value)} d = ${number(value * unitOf(shown()), 4)} ${data.unit}`],
    degrees: [roundNumbers(0.1, 180), (value) => `${number(value)} degrees`],
    quantile: [twentieths.slice(1), (value) => `${run.unit === null ? `${number(value)}: ` : ""}d = ${number(unitOf(shown()), 4)} `
      + `${data.unit}${run.unit === null ? "" : ", fixed by the run"}`],
    steps: [STEPS, (value) => number(value, 5)],
    weight: [WEIGHTS, (value) => `${number(value)} TAS + ${number(1 - value)} RAS`],
  }, kept, SETTING);
  at("quantile").disabled = run.unit !== null;
  at("missing").disabled = !estimates.some((one) => one.scored.fail.cameras.length > one.scored.ignore.cameras.length);

  // Picking: one camera, a row of the reference, that is marked wherever it is.
  const marks = new Map(); // place -> function that marks the picked camera there
  const picked = () => shown().cameraOf.get(state.camera) ?? -1;

  function pick(camera, aloud = false) {
    const row = camera < 0 ? -1 : shown().rows[camera];
    if (row === state.camera) return;
    state.camera = row;
    kept.write();
    showPicked();
    if (aloud) text("spoken", describe(camera));
  }
  function showPicked() {
    text("picked", state.camera < 0 ? "Point at a camera, anywhere on this page." : describe(picked()));
    for (const mark of marks.values()) mark();
  }
  function describe(camera) {
    if (camera < 0) return `Camera ${nameOf(state.camera)}: not scored in ${shown().name}`;
    const one = shown();
    const errors = Object.entries(KINDS).map(([kind, { unit }]) => (one[kind][camera] === Infinity
      ? `no ${kind} error` : `${kind} error ${number(one[kind][camera])} ${unit}`));
    const d = one.position[camera] / unitOf(one);
    const status = data.statuses[one.codes[camera]];
    return `Camera ${nameOf(one.rows[camera])}: ${errors[0]}${Number.isFinite(d) ? ` (${number(d)} d)` : ""}, ${errors[1]}`
      + `${status === "matched" ? "" : `; ${status}`}${isLost(one, camera) && state.missing === "ignore" ? ", left out" : ""}`;
  }

  // Charts. Each has a host, and is drawn anew when its width or the state changes.
  const draws = [];
  function chart(id, draw) {
    const host = at(id);
    const again = () => {
      marks.delete(id);
      draw(host, id);
      marks.get(id)?.();
    };
    draws.push(again);
    responsive(host, again);
  }
  const DENSE = 400; // cameras from which on crosses would merge
  const dots = (points) => points.map(([x, y]) => `M${x.toFixed(1)} ${y.toFixed(1)}h0`).join("");
  const crosses = (points) => points.map(([x, y]) => `M${(x - 3).toFixed(1)} ${(y - 3).toFixed(1)}l6 6m0-6l-6 6`).join("");

  // Marks the picked camera at the place on a chart that `place(camera)` tells, where it has one.
  function marker(made, id, cursor, indexOf, place) {
    const ring = element("circle", { class: "picked", r: 5, "aria-hidden": "true" });
    made.svg.append(ring);
    marks.set(id, () => {
      const camera = picked();
      const index = camera < 0 ? -1 : indexOf(camera);
      cursor?.show(index);
      const spot = camera < 0 ? null : place(camera, index);
      ring.setAttribute("visibility", spot ? "visible" : "hidden");
      if (spot) {
        ring.setAttribute("cx", spot[0].toFixed(1));
        ring.setAttribute("cy", spot[1].toFixed(1));
      }
    });
  }

  function errorChart(kind) {
    const { name, colour, unit: word } = KINDS[kind];
    return (host, id) => {
      const one = shown();
      const { cameras, sorted } = scored();
      const values = one[kind];
      const finite = sorted[kind].filter((value) => value > 0 && value < Infinity);
      const limit = largest(kind);
      const told = [finite[Math.floor(finite.length / 100)], finite.at(-1), limit].filter(positive);
      const [low, high] = told.length ? [Math.min(...told) / 1.5, Math.max(...told) * 2.5] : [0.1, 10];
      const last = placeOf(one.rows[cameras.at(-1)] ?? 0);
      const first = placeOf(one.rows[cameras[0]] ?? 0);
      const made = frame(host, {
        label: `Error of each camera, ${kind}s`,
        x: { domain: [first, Math.max(last, first + 1)], label: stamps ? "seconds from the reference's start" : data.ordered ? "frame" : "image" },
        y: { domain: [low, high], log: true, label: `${word}, log` },
        left: 52,
      });
      const spot = (camera) => [
        made.x(placeOf(one.rows[camera])),
        values[camera] === Infinity ? made.top + 6 : made.y(Math.max(values[camera], low)),
      ];
      const within = cameras.filter((camera) => values[camera] < limit);
      const beyond = cameras.filter((camera) => !(values[camera] < limit));
      made.plot.append(
        element("path", { class: "camera", d: dots(within.map(spot)), stroke: colour, "stroke-width": cameras.length < DENSE ? 4 : 2.5 }),
        element("path", cameras.length < DENSE
          ? { class: "cross", d: crosses(beyond.map(spot)), stroke: BEYOND }
          : { class: "camera", d: dots(beyond.map(spot)), stroke: BEYOND, "stroke-width": 2.5 }),
        ...(positive(limit) ? [
          element("path", { class: "rule", d: `M${made.left} ${made.y(limit)}H${made.width - made.right}` }),
          element("text", { class: "name", x: made.width - made.right, y: made.y(limit) - 4, "text-anchor": "end" }, "largest threshold"),
        ] : []),
        element("text", { class: "name", x: made.width - made.right, y: made.top - 2, "text-anchor": "end" },
          `${beyond.length} beyond, ${beyond.filter((camera) => values[camera] === Infinity).length} of them failed`),
      );
      const cursor = cameras.length ? AlignmentCharts.cursor(made, {
        places: cameras.map((camera) => placeOf(one.rows[camera])),
        describe: (index) => describe(cameras[index]),
        name: `Cameras in their order, ${name}`,
        pick: (index) => pick(cameras[index]),
      }) : null;
      const index = new Map(cameras.map((camera, number) => [camera, number]));
      marker(made, id, cursor, (camera) => index.get(camera) ?? -1, (camera, number) => (number < 0 ? null : spot(camera)));
    };
  }

  function cumulative(sorted, n, limit, steps) {
    const points = [[0, 0]];
    let below = 0;
    for (let k = 1; k <= steps; k++) {
      const threshold = limit * k / steps;
      while (sorted[below] < threshold) below += 1;
      points.push([threshold * (k - 1) / k, below / n], [threshold, below / n]);
    }
    return points;
  }

  function cumulativeChart(kind) {
    const { name, colour, unit: word } = KINDS[kind];
    return (host, id) => {
      const one = shown();
      const limit = largest(kind);
      if (!positive(limit)) {
        host.replaceChildren(`There is no ${name}, since d is 0.`);
        return;
      }
      const made = frame(host, {
        label: `Share of the cameras below each threshold, ${kind}s`,
        x: { domain: [0, limit], label: `threshold, ${word}` },
        y: { domain: [0, 1], format: (value) => `${number(100 * value)} %`, label: "cameras below" },
        left: 52, right: 20,
      });
      const { cameras, sorted } = scored();
      const points = cumulative(sorted[kind], cameras.length, limit, state.steps);
      const outline = points.map(([x, y]) => `L${made.x(x).toFixed(1)} ${made.y(y).toFixed(1)}`).join("");
      made.plot.append(element("path", { class: "fill", d: `M${made.x(0)} ${made.y(0)}${outline}V${made.y(0)}Z` }));
      for (const other of estimates) {
        if (other === one) continue;
        const { cameras: all, sorted: errors } = scored(other);
        line(made, cumulative(errors[kind], all.length, limit, state.steps), { colour, ghost: true, width: 1.4 });
      }
      line(made, points, { colour });
      const value = scoreOf(kind);
      const high = value >= 0.5;
      made.plot.append(element("text", {
        class: "name big", x: high ? made.width - made.right - 8 : made.left + 8, y: high ? made.height - made.bottom - 12 : made.top + 18,
        "text-anchor": high ? "end" : "start",
      }, `${name} = ${digits(value)}`));
      const values = one[kind];
      const ranked = cameras.filter((camera) => values[camera] < limit).sort((a, b) => values[a] - values[b]);
      const cursor = ranked.length ? AlignmentCharts.cursor(made, {
        places: ranked.map((camera) => values[camera]),
        describe: (index) => `${index + 1} of ${cameras.length}. ${describe(ranked[index])}`,
        name: `Cameras from the least error to the largest threshold, ${name}`,
        pick: (index) => pick(ranked[index]),
      }) : null;
      const index = new Map(ranked.map((camera, number) => [camera, number]));
      marker(made, id, cursor, (camera) => index.get(camera) ?? -1,
        (camera, number) => (number < 0 ? null : [made.x(values[camera]), made.y((number + 1) / cameras.length)]));
    };
  }

  // The units of the profiles, the same for all settings but the policy.
  function profileUnits(kind) {
    if (kind === "rotation") return geometric(0.05, 180);
    const middle = run.unit ?? Math.max(...estimates.map((one) => one.units[0.75 * QUANTILES - 1]).filter(positive));
    return geometric(middle / 30, middle * 100);
  }
  const geometric = (low, high) => Array.from({ length: UNITS }, (_, k) => low * (high / low) ** (k / (UNITS - 1)));

  const once = memory();
  function profileOf(one, kind, units) {
    const key = [kind, state.steps, state.missing, estimates.indexOf(one)].join();
    return once(key, () => profile(scored(one)[kind], units, { thresholds: state.steps }));
  }

  function profileChart(kind) {
    const { name, colour, unit: word } = KINDS[kind];
    const units = profileUnits(kind);
    return (host, id) => {
      if (!positive(units[0])) {
        host.replaceChildren("There is no profile, since d is 0.");
        return;
      }
      const others = estimates.filter((one) => one !== shown());
      const values = profileOf(shown(), kind, units);
      const made = curves(host, {
        label: `${name} over its largest threshold`,
        places: units, unit: word, y: { domain: [0, 1], label: "score" }, at: largest(kind),
        lines: [
          ...others.map((one) => ({ values: profileOf(one, kind, units), colour, ghost: true, width: 1.4 })),
          { values, colour },
        ],
        describe: (index) => `${name} ${digits(values[index])} up to ${number(units[index])} ${word}`,
        name: `${name} over its largest threshold`,
      });
      made.plot.append(element("path", { class: "grid", d: `M${made.left} ${made.y(0.5)}H${made.width - made.right}` }));
      marker(made, id, null, (camera) => camera, (camera) => {
        const error = shown()[kind][camera];
        return error >= units[0] && error <= units.at(-1) ? [made.x(error), made.y(0)] : null;
      });
    };
  }

  // The trajectories, turned by hand: an orthographic view from above, as far as there is an above:
  // the axis along which the reference is thinnest.
  const scene = at("scene");
  const size = extents();
  const [across, up, toward] = axes();
  let spots = new Float32Array(0); // two for each camera of the estimate that is shown: its place there

  function extents() {
    return [0, 1, 2].map((axis) => {
      let [low, high] = [Infinity, -Infinity];
      for (let k = axis; k < reference.length; k += 3) {
        low = Math.min(low, reference[k]);
        high = Math.max(high, reference[k]);
      }
      return high - low;
    });
  }
  function axes() {
    const thin = size.indexOf(Math.min(...size));
    const [first, second] = [0, 1, 2].filter((axis) => axis !== thin);
    // To the right, upwards, and towards the reader: a right-handed frame.
    return [{ axis: first, sign: 1 }, { axis: second, sign: 1 }, { axis: thin, sign: thin === 1 ? -1 : 1 }];
  }

  // Returns where a point is on the canvas: the triple of `points` that starts at `start`.
  function camera3d() {
    const [turn, tilt] = [state.turn, state.tilt].map((degrees) => degrees * Math.PI / 180);
    const [ct, st, cf, sf] = [Math.cos(turn), Math.sin(turn), Math.cos(tilt), Math.sin(tilt)];
    const fits = [[scene.clientWidth, across], [scene.clientHeight, up]].map(([pixels, { axis }]) => pixels / size[axis]).filter(positive);
    const zoom = 0.92 * state.near * (fits.length ? Math.min(...fits) : 1); // none: one place, or nothing to draw on yet
    const [width, height] = [scene.clientWidth / 2, scene.clientHeight / 2];
    const project = (points, start) => {
      const [a, b, c] = [across, up, toward].map(({ axis, sign }) => sign * points[start + axis]);
      const x = ct * a - st * b;
      const y = st * a + ct * b;
      return [x, y * cf + c * sf].map((value) => value * zoom);
    };
    const middle = state.near > 1 && state.camera >= 0 ? project(reference, 3 * state.camera) : [0, 0];
    return (points, start) => {
      const [x, y] = project(points, start);
      return [width + x - middle[0], height - y + middle[1]];
    };
  }
  const shade = (share) => {
    const place = Math.min(Math.max(share, 0), 1) * (RAMP.length - 1);
    const low = Math.min(Math.floor(place), RAMP.length - 2);
    return `rgb(${RAMP[low].map((from, k) => Math.round(from + (RAMP[low + 1][k] - from) * (place - low))).join(" ")})`;
  };
  const COLOURS = Array.from({ length: SHADES }, (_, k) => shade(k / (SHADES - 1)));

  function drawScene() {
    const ratio = devicePixelRatio || 1;
    scene.width = scene.clientWidth * ratio;
    scene.height = scene.clientHeight * ratio;
    const pen = scene.getContext("2d");
    pen.scale(ratio, ratio);
    at("marks").setAttribute("viewBox", `0 0 ${scene.clientWidth} ${scene.clientHeight}`);
    const project = camera3d();
    const one = shown();
    const { cameras } = scored();
    const values = one[state.colour];
    const limit = largest(state.colour);

    pen.strokeStyle = pen.fillStyle = "#a9adb3";
    pen.lineWidth = 1.6;
    pen.beginPath();
    for (let k = 0; k < reference.length; k += 3) {
      const [x, y] = project(reference, k);
      if (data.ordered) pen.lineTo(x, y);
      else pen.rect(x - 1.5, y - 1.5, 3, 3);
    }
    if (data.ordered) pen.stroke();
    else pen.fill();

    spots = new Float32Array(2 * one.rows.length).fill(NaN);
    const groups = Array.from({ length: SHADES + 2 }, () => []); // by shade; beyond; without a position
    for (const camera of cameras) {
      const there = Number.isFinite(one.positions[3 * camera]);
      const [x, y] = there ? project(one.positions, 3 * camera) : project(reference, 3 * one.rows[camera]);
      spots.set([x, y], 2 * camera);
      const share = values[camera] / limit;
      groups[there ? (share < 1 ? Math.floor(share * SHADES) : SHADES) : SHADES + 1].push([x, y]);
    }
    const size = cameras.length > 2000 ? 3 : cameras.length > 200 ? 4 : 6;
    groups.forEach((group, k) => {
      if (k < SHADES) {
        pen.fillStyle = COLOURS[k];
        for (const [x, y] of group) pen.fillRect(x - size / 2, y - size / 2, size, size);
        return;
      }
      pen.strokeStyle = k === SHADES ? BEYOND : "#1d2024";
      pen.lineWidth = 1.3;
      pen.beginPath();
      let last = [-Infinity, -Infinity]; // crosses that would merge into a bar are left out
      for (const [x, y] of group) {
        if (Math.abs(x - last[0]) + Math.abs(y - last[1]) < 8) continue;
        last = [x, y];
        if (k === SHADES) {
          pen.moveTo(x - 3, y - 3);
          pen.lineTo(x + 3, y + 3);
          pen.moveTo(x + 3, y - 3);
          pen.lineTo(x - 3, y + 3);
        } else {
          pen.moveTo(x + 3, y);
          pen.arc(x, y, 3, 0, 2 * Math.PI);
        }
      }
      pen.stroke();
    });
    scene.setAttribute("aria-label", `Reference and ${one.name}, aligned as in the TAS: ${cameras.length} cameras, `
      + `${groups[SHADES].length} with an error beyond the largest threshold, ${groups[SHADES + 1].length} without a position`);
    text("ramp-end", `${number(limit)} ${KINDS[state.colour].unit}`);
    markScene();
  }

  const [link, ring, estimateRing] = at("marks").children;
  function markScene() {
    const camera = picked();
    const there = state.camera >= 0;
    at("marks").setAttribute("visibility", there ? "visible" : "hidden");
    if (!there) return;
    const [x, y] = camera3d()(reference, 3 * state.camera);
    const [u, v] = camera >= 0 && Number.isFinite(spots[2 * camera]) ? spots.subarray(2 * camera, 2 * camera + 2) : [x, y];
    for (const [circle, cx, cy] of [[ring, x, y], [estimateRing, u, v]]) {
      circle.setAttribute("cx", cx);
      circle.setAttribute("cy", cy);
    }
    link.setAttribute("d", `M${x} ${y}L${u} ${v}`);
  }
  marks.set("scene", () => (state.near > 1 ? drawScene() : markScene()));

  function nearest(event, reach) {
    const box = scene.getBoundingClientRect();
    const [x, y] = [event.clientX - box.left, event.clientY - box.top];
    let [found, best] = [-1, reach * reach];
    for (const camera of scored().cameras) {
      const distance = (spots[2 * camera] - x) ** 2 + (spots[2 * camera + 1] - y) ** 2;
      if (distance < best) [found, best] = [camera, distance];
    }
    return found;
  }
  function view(changes) {
    Object.assign(state, changes);
    state.tilt = Math.min(Math.max(state.tilt, -90), 90);
    state.near = Math.min(Math.max(state.near, 0.25), 64);
    state.turn = Math.round(state.turn * 10) / 10;
    state.tilt = Math.round(state.tilt * 10) / 10;
    kept.write();
    drawScene();
  }
  let held = null; // where the pointer went down, and how far it has moved since
  scene.addEventListener("pointerdown", (event) => {
    held = { x: event.clientX, y: event.clientY, moved: 0 };
    if (event.isTrusted) scene.setPointerCapture(event.pointerId);
  });
  scene.addEventListener("pointermove", (event) => {
    if (!held) {
      const camera = nearest(event, 20);
      if (camera >= 0 && state.near <= 1) pick(camera);
      return;
    }
    const [dx, dy] = [event.clientX - held.x, event.clientY - held.y];
    held = { x: event.clientX, y: event.clientY, moved: held.moved + Math.abs(dx) + Math.abs(dy) };
    view({ turn: state.turn + dx / 2, tilt: state.tilt + dy / 2 });
  });
  scene.addEventListener("pointerup", (event) => {
    const clicked = held && held.moved < 4;
    held = null;
    const camera = clicked ? nearest(event, 40) : -1;
    if (camera >= 0) pick(camera, true);
  });
  scene.addEventListener("pointercancel", () => { held = null; });

  function press(key) {
    const { turn, tilt, near } = state;
    const views = {
      ArrowLeft: { turn: turn - 5 }, ArrowRight: { turn: turn + 5 }, ArrowUp: { tilt: tilt - 5 }, ArrowDown: { tilt: tilt + 5 },
      "+": { near: near * 1.5 }, "=": { near: near * 1.5 }, "-": { near: near / 1.5 }, Home: { turn: 0, tilt: 0, near: 1 },
      tilt: { tilt: tilt >= 90 ? 0 : tilt + 30 }, // no key: where a finger's up and down scrolls the page
    };
    const steps = { PageDown: 1, PageUp: -1 };
    if (key in views) view(views[key]);
    else if (key in steps) {
      const { cameras } = scored();
      const now = cameras.indexOf(picked());
      pick(cameras[Math.min(Math.max(now + steps[key], 0), cameras.length - 1)] ?? -1, true);
    } else return false;
    return true;
  }
  scene.addEventListener("keydown", (event) => {
    if (!event.ctrlKey && !event.metaKey && !event.altKey && press(event.key)) event.preventDefault();
  });
  for (const button of document.querySelectorAll("[data-key]")) button.addEventListener("click", () => press(button.dataset.key));

  // What does not change.
  document.title = data.title;
  text("title", data.title);
  text("kicker", `${data.format}, ${estimates.length} ${estimates.length === 1 ? "estimate" : "estimates"}, ${run.aligned}`);
  const metres = data.unit === "m" ? " m" : ""; // of other units the name says nothing
  text("unit-head", `d${metres}`);
  text("half-head", `half${metres}`);
  const others = run.seeds[0] === run.seeds[1] ? "" : ` The run’s are means over the seeds ${run.seeds[0]} to ${run.seeds[1]}.`;
  const aligned = run.registration === "refined"
    ? "The refined registration fits its alignment to the largest threshold: at another one the command aligns anew, and its TAS is as a rule a little higher than here."
    : "The paper’s registration depends neither on d nor on the thresholds, so that these are the command’s numbers for this seed at any of them. Whether missing cameras fail may change the alignment; here it stays.";
  text("alignment", `${run.aligned === "not aligned"
    ? "Nothing is aligned, so that these are the command’s numbers at any thresholds."
    : `Scores here are under the run’s alignment, with seed ${run.seeds[0]}.${others} ${aligned}`} `
    + "half: half-score distance and angle of the run, by the refined registration.");
  text("origin", `alignscores ${data.version}, from ${data.reference} and ${estimates.map((one) => one.file).join(", ")}`);
  document.querySelector(".ramp").style.background = `linear-gradient(90deg, ${RAMP.map((colour) => `rgb(${colour.join(" ")})`).join(", ")})`;

  for (const kind of Object.keys(KINDS)) {
    chart(`${kind}-errors`, errorChart(kind));
    chart(`${kind}-cumulative`, cumulativeChart(kind));
    chart(`${kind}-profile`, profileChart(kind));
  }
  draws.push(drawScene);
  responsive(scene, drawScene);

  function render() {
    fillTable();
    fillTexts();
    for (const draw of draws) draw();
    showPicked();
  }
  render();
})();
