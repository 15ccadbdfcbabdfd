// Drawing for the page of estimates: axes, lines, direct labels, and a cursor for pointer and keyboard.
const AlignmentCharts = (() => {
  "use strict";
  const NAMESPACE = "http://www.w3.org/2000/svg";

  // Elements with attributes and children, which may be elements or text: of SVG, and of HTML.
  const maker = (create) => (name, attributes = {}, ...children) => {
    const node = create(name);
    for (const [key, value] of Object.entries(attributes)) {
      if (value !== undefined && value !== null) node.setAttribute(key, value);
    }
    node.append(...children);
    return node;
  };
  const element = maker((name) => document.createElementNS(NAMESPACE, name));
  const html = maker((name) => document.createElement(name));

  // A map from numbers to pixels, linear or logarithmic, that also knows its ticks.
  function scale([low, high], [start, end], { log = false } = {}) {
    const place = log ? Math.log : Number;
    const [first, last] = [place(low), place(high)];
    const map = (value) => start + (end - start) * (place(value) - first) / (last - first);
    map.ticks = (count = 5) => (log ? logTicks(low, high) : linearTicks(low, high, count));
    return Object.assign(map, { range: [start, end] });
  }

  function linearTicks(low, high, count) {
    const rough = (high - low) / count;
    const power = 10 ** Math.floor(Math.log10(rough));
    const step = power * ([1, 2, 5].find((factor) => factor * power >= rough * 0.999) ?? 10);
    const ticks = [];
    for (let k = Math.ceil(low / step - 1e-9); k * step <= high + 1e-9 * step; k++) ticks.push(k * step);
    return ticks;
  }

  function logTicks(low, high) {
    const factors = high / low > 300 ? [1] : [1, 2, 5];
    const ticks = [];
    for (let power = Math.floor(Math.log10(low)); power <= Math.log10(high); power++) {
      for (const factor of factors) {
        const tick = factor * 10 ** power;
        if (tick >= low * (1 - 1e-9) && tick <= high * (1 + 1e-9)) ticks.push(tick);
      }
    }
    return ticks;
  }

  // A number with so many significant digits, without trailing zeros and with a real minus.
  function number(value, digits = 3) {
    if (!Number.isFinite(value)) return value > 0 ? "∞" : "–";
    return String(Number(value.toPrecision(digits))).replace("-", "−");
  }

  // An empty chart in place of what the host holds: grid, axes, and the scales to draw with. An axis
  // is { domain, log, label }, y's has a format; margins are in pixels.
  function frame(host, { label, x, y, height = 220, top = 12, right = 16, bottom = 40, left = 44 }) {
    const width = Math.max(host.clientWidth, 200);
    const svg = element("svg", {
      class: "chart", viewBox: `0 0 ${width} ${height}`, width, height, role: "group", "aria-label": label,
    });
    const across = scale(x.domain, [left, width - right], x);
    const up = scale(y.domain, [height - bottom, top], y);
    const axes = element("g", { "aria-hidden": "true" });
    for (const tick of up.ticks()) {
      axes.append(
        element("path", { class: "grid", d: `M${left} ${up(tick)}H${width - right}` }),
        element("text", { x: left - 6, y: up(tick) + 4, "text-anchor": "end" }, (y.format ?? number)(tick)),
      );
    }
    for (const tick of across.ticks(Math.min(6, width / 80))) {
      axes.append(
        element("path", { class: "axis", d: `M${across(tick)} ${height - bottom}v4` }),
        element("text", { x: across(tick), y: height - bottom + 16, "text-anchor": "middle" }, number(tick)),
      );
    }
    axes.append(element("path", { class: "axis", d: `M${left} ${height - bottom}H${width - right}` }));
    if (x.label) {
      axes.append(element("text", { class: "name", x: (left + width - right) / 2, y: height - bottom + 33, "text-anchor": "middle" }, x.label));
    }
    if (y.label) axes.append(element("text", { class: "name", x: left, y: top - 2 }, y.label));
    const plot = element("g", { "aria-hidden": "true" });
    svg.append(axes, plot);
    host.replaceChildren(svg);
    return { host, svg, plot, x: across, y: up, width, height, left, right, top, bottom };
  }

  // A line through points [x, y]; one that is not finite breaks it.
  function line(chart, points, { colour = "currentColor", dash, width = 1.8 } = {}) {
    let path = "";
    let pen = "M";
    for (const [a, b] of points) {
      if (Number.isFinite(a) && Number.isFinite(b)) {
        path += `${pen}${chart.x(a).toFixed(1)} ${chart.y(b).toFixed(1)}`;
        pen = "L";
      } else pen = "M";
    }
    chart.plot.append(element("path", {
      class: "line", d: path, stroke: colour, "stroke-dasharray": dash, "stroke-width": width,
    }));
  }

  // An upright rule with a word next to it.
  function rule(chart, at, text) {
    const x = chart.x(at);
    const late = x > (chart.x.range[0] + chart.x.range[1]) / 2;
    chart.plot.append(
      element("path", { class: "rule", d: `M${x} ${chart.top}V${chart.height - chart.bottom}` }),
      element("text", { class: "name", x: x + (late ? -5 : 5), y: chart.top + 9, "text-anchor": late ? "end" : "start" }, text),
    );
  }

  // A cursor over places on the x axis, moved by pointer or arrow keys. What `describe(index)` says of
  // a place stands beneath the chart and is spoken; `pick(index)`, if given, hears of each move.
  function cursor(chart, { places, describe, name, pick, at = -1 }) {
    const rule = element("path", { class: "cursor" });
    const area = element("rect", {
      class: "reader", x: chart.left, y: chart.top, width: chart.width - chart.left - chart.right,
      height: chart.height - chart.top - chart.bottom, tabindex: 0, role: "slider", "aria-label": name,
      "aria-valuemin": 0, "aria-valuemax": places.length - 1,
    });
    const readout = html("p", { class: "readout", "aria-hidden": "true" }, // the slider's value says it
      "Point at the chart, or press the arrow keys in it, to read values.");
    chart.svg.append(rule, area);
    chart.host.append(readout);

    function show(index) {
      at = index;
      const x = chart.x(places[index]);
      rule.setAttribute("d", `M${x} ${chart.top}V${chart.height - chart.bottom}`);
      const text = describe(index);
      readout.textContent = text;
      area.setAttribute("aria-valuenow", index);
      area.setAttribute("aria-valuetext", text);
    }
    function move(index) {
      show(Math.min(Math.max(index, 0), places.length - 1));
      pick?.(at);
    }
    area.setAttribute("aria-valuenow", Math.max(at, 0));
    area.setAttribute("aria-valuetext", describe(Math.max(at, 0)));
    if (at >= 0) show(at);
    area.addEventListener("pointermove", (event) => {
      const box = chart.svg.getBoundingClientRect();
      const pixel = (event.clientX - box.left) * chart.width / box.width;
      let nearest = 0;
      for (let k = 1; k < places.length; k++) {
        if (Math.abs(chart.x(places[k]) - pixel) < Math.abs(chart.x(places[nearest]) - pixel)) nearest = k;
      }
      if (nearest !== at) move(nearest);
    });
    area.addEventListener("keydown", (event) => {
      const steps = { ArrowLeft: -1, ArrowDown: -1, ArrowRight: 1, ArrowUp: 1, PageDown: -10, PageUp: 10, Home: -Infinity, End: Infinity };
      if (!(event.key in steps)) return;
      event.preventDefault();
      move(at < 0 ? 0 : at + steps[event.key]);
    });
  }

  // Calls `draw` now, and whenever the width of the host changes.
  function responsive(host, draw) {
    let width = 0;
    const observer = new ResizeObserver(() => {
      if (host.clientWidth && host.clientWidth !== width) {
        width = host.clientWidth;
        requestAnimationFrame(() => { if (host.isConnected) draw(); }); // it changes what is observed now
      }
    });
    observer.observe(host);
  }

  return Object.freeze({ cursor, element, frame, html, line, number, responsive, rule });
})();
