// A cursor in the charts, for pointer and keyboard, and the trajectories, which can be rotated.
(() => {
  "use strict";
  const at = (id) => document.getElementById(id);
  const dataIn = (parent) => JSON.parse(parent.querySelector(":scope > script").textContent);
  // Numbers of a kind, such as Float32Array, from the base64 of their bytes.
  const unpacked = (Kind, packed) => new Kind(Uint8Array.from(atob(packed), (letter) => letter.charCodeAt(0)).buffer);
  const limited = (value, low, high) => Math.min(Math.max(value, low), high);

  // What a chart says of a place stands beneath it and is spoken; `moved(index)` hears of each move.
  function addCursor(chart, moved) {
    const { places, texts } = dataIn(chart);
    const line = document.createElement("i");
    const area = document.createElement("div");
    const readout = document.createElement("output");
    const attributes = {
      class: "cursor", tabindex: 0, role: "slider", "aria-label": chart.getAttribute("aria-label"),
      "aria-valuemin": 0, "aria-valuemax": places.length - 1, "aria-valuenow": 0, "aria-valuetext": texts[0],
    };
    for (const [name, value] of Object.entries(attributes)) area.setAttribute(name, value);
    readout.textContent = "Point at the chart, or press the arrow keys in it, to read values.";
    readout.ariaHidden = "true"; // the slider's value says it
    area.append(line);
    chart.querySelector(".rows").append(area);
    chart.append(readout);
    let current = -1;
    function move(index) {
      current = limited(index, 0, places.length - 1);
      line.style.left = `${100 * places[current]}%`;
      readout.textContent = texts[current];
      area.setAttribute("aria-valuenow", current);
      area.setAttribute("aria-valuetext", texts[current]);
      moved(current);
    }
    function point(event) {
      const place = event.offsetX / area.clientWidth;
      const after = places.findIndex((other) => other > place);
      const nearer = after > 0 && place - places[after - 1] < places[after] - place ? after - 1 : after;
      move(after < 0 ? places.length - 1 : nearer);
    }
    area.addEventListener("pointermove", point);
    area.addEventListener("pointerdown", point); // a finger that taps
    area.addEventListener("keydown", (event) => {
      const steps = { ArrowLeft: -1, ArrowDown: -1, ArrowRight: 1, ArrowUp: 1, PageDown: -10, PageUp: 10, Home: -Infinity, End: Infinity };
      if (!(event.key in steps) || event.ctrlKey || event.metaKey || event.altKey) return;
      event.preventDefault();
      move(current + steps[event.key]);
    });
  }

  // The trajectories on the canvas: the reference, then the estimates in the style of the key.
  const scene = at("scene");
  const data = dataIn(scene.parentElement);
  const pen = scene.getContext("2d");
  const [reference, ...estimates] = data.paths.map((path) => unpacked(Float32Array, path));
  const styles = [...document.querySelectorAll(".sheet .key path")].map((path) => {
    const { stroke, strokeDasharray } = getComputedStyle(path);
    return { colour: stroke, dashes: strokeDasharray === "none" ? [] : strokeDasharray.split(",").map(parseFloat) };
  });
  const view = { turn: 0, tilt: 0, near: 1, frame: -1 };

  // Returns where the camera at an index of `path` is on the canvas; undefined where it has no position.
  function projection() {
    const [turn, tilt] = [view.turn, view.tilt].map((degrees) => degrees * Math.PI / 180);
    const [ct, st, cf, sf] = [Math.cos(turn), Math.sin(turn), Math.cos(tilt), Math.sin(tilt)];
    const [width, height] = [scene.clientWidth, scene.clientHeight];
    const zoom = 0.92 * view.near * Math.min(width / data.size[0], height / data.size[1]);
    return (path, index) => {
      const [a, b, c] = path.subarray(3 * index, 3 * index + 3);
      if (!Number.isFinite(a)) return undefined;
      return [width / 2 + zoom * (ct * a - st * b), height / 2 - zoom * ((st * a + ct * b) * cf + c * sf)];
    };
  }

  function draw() {
    const ratio = devicePixelRatio || 1;
    scene.width = scene.clientWidth * ratio;
    scene.height = scene.clientHeight * ratio;
    pen.scale(ratio, ratio);
    const project = projection();
    const { value, dataset } = document.querySelector("[name=colour]:checked");
    const colours = data.colours[value];
    drawPath(project, reference, "#a9adb3", []);
    estimates.forEach((path, index) => {
      if (!colours) drawPath(project, path, styles[index].colour, styles[index].dashes);
      else if (index in colours) drawErrors(project, path, unpacked(Uint8Array, colours[index]));
    });
    at("ramp").hidden = !colours;
    at("ramp").querySelector("output").textContent = dataset.limit;
    if (view.frame < 0) return;
    ring(project(reference, view.frame), "#1d2024");
    estimates.forEach((path, index) => ring(project(path, view.frame), styles[index].colour));
  }
  function drawPath(project, path, colour, dashes) {
    pen.strokeStyle = pen.fillStyle = colour;
    pen.lineWidth = 1.6;
    pen.setLineDash(dashes);
    pen.beginPath();
    let drawn = false;
    for (let index = 0; index < path.length / 3; index++) {
      const place = project(path, index);
      if (place && !data.ordered) pen.fillRect(place[0] - 1.5, place[1] - 1.5, 3, 3);
      else if (place && drawn) pen.lineTo(...place);
      else if (place) pen.moveTo(...place);
      drawn = Boolean(place);
    }
    pen.stroke();
    pen.setLineDash([]);
  }
  function drawErrors(project, path, colours) {
    colours.forEach((colour, index) => {
      const place = project(path, index);
      pen.fillStyle = data.ramp[colour];
      if (place) pen.fillRect(place[0] - 2, place[1] - 2, 4, 4);
    });
  }
  function ring(place, colour) {
    if (!place) return;
    pen.strokeStyle = colour;
    pen.lineWidth = 2;
    pen.beginPath();
    pen.arc(...place, 7, 0, 2 * Math.PI);
    pen.stroke();
  }

  function change(changes) {
    Object.assign(view, changes);
    view.tilt = limited(view.tilt, -90, 90);
    view.near = limited(view.near, 0.25, 64);
    draw();
  }
  let last = null; // the pointer's last event while it is down
  scene.addEventListener("pointerdown", (event) => {
    last = event;
    if (event.isTrusted) scene.setPointerCapture(event.pointerId);
  });
  scene.addEventListener("pointermove", (event) => {
    if (!last) return;
    change({ turn: view.turn + (event.clientX - last.clientX) / 2, tilt: view.tilt + (event.clientY - last.clientY) / 2 });
    last = event;
  });
  for (const end of ["pointerup", "pointercancel"]) scene.addEventListener(end, () => { last = null; });
  function press(key) {
    const { turn, tilt, near } = view;
    const views = {
      ArrowLeft: { turn: turn - 5 }, ArrowRight: { turn: turn + 5 }, ArrowUp: { tilt: tilt - 5 }, ArrowDown: { tilt: tilt + 5 },
      "+": { near: near * 1.5 }, "-": { near: near / 1.5 }, Home: { turn: 0, tilt: 0, near: 1 },
      tilt: { tilt: tilt >= 90 ? 0 : tilt + 30 }, // no key: on a phone a finger scrolls the page
    };
    if (key in views) change(views[key]);
    return key in views;
  }
  scene.addEventListener("keydown", (event) => {
    if (!event.ctrlKey && !event.metaKey && !event.altKey && press(event.key)) event.preventDefault();
  });
  for (const button of document.querySelectorAll("[data-key]")) button.addEventListener("click", () => press(button.dataset.key));
  for (const radio of document.querySelectorAll("[name=colour]")) radio.addEventListener("change", draw);
  new ResizeObserver(draw).observe(scene); // which calls it at once

  for (const chart of document.querySelectorAll(".chart:has(script)")) {
    addCursor(chart, chart.closest("#errors") ? (frame) => change({ frame }) : () => {});
  }
})();
