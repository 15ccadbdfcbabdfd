// Sorting and filtering of the verdicts. Without it the table stands there complete.
(() => {
  "use strict";
  const table = document.getElementById("claims-table");
  const rows = [...table.tBodies[0].rows]; // in the paper’s order
  const choices = [...document.querySelectorAll("#controls button")];
  const source = document.getElementById("source");
  const shown = document.getElementById("shown");
  const filter = { verdict: "", source: "" };
  let order = "in the paper’s order";

  function show(changes) {
    Object.assign(filter, changes);
    for (const row of rows) {
      row.hidden = Object.entries(filter).some(([key, value]) => value && row.dataset[key] !== value);
    }
    for (const choice of choices) {
      choice.setAttribute("aria-pressed", String(choice.dataset.verdict === filter.verdict));
    }
    source.value = filter.source;
    const count = rows.filter((row) => !row.hidden).length;
    shown.textContent = `${count} of ${rows.length} shown, ${order}`;
  }

  AlignmentTables.sortable(table, ["ascending", "descending", "none"], () => rows, (heading, direction) => {
    order = direction === "none" ? "in the paper’s order" : `by ${heading}, ${direction}`;
    show();
  });
  for (const choice of choices) {
    choice.addEventListener("click", () => show({ verdict: choice.dataset.verdict }));
  }
  source.addEventListener("change", () => show({ source: source.value }));

  // A link to a claim finds it, whatever is filtered.
  window.addEventListener("hashchange", () => {
    const row = document.getElementById(decodeURIComponent(location.hash.slice(1)));
    if (!row?.hidden || !rows.includes(row)) return;
    show({ verdict: "", source: "" });
    row.scrollIntoView();
  });

  document.getElementById("controls").hidden = false;
  show();
})();
