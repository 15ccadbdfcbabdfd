// Sorting and filtering of the verdicts. Without it the table stands there complete.
(() => {
  "use strict";
  const table = document.getElementById("claims-table");
  const body = table.tBodies[0];
  const headers = [...table.tHead.rows[0].cells];
  const inPaperOrder = [...body.rows];
  const choices = [...document.querySelectorAll("#controls button")];
  const source = document.getElementById("source");
  const shown = document.getElementById("shown");
  const texts = new Intl.Collator("en", { numeric: true });
  const filter = { verdict: "", source: "" };
  let sorting = { column: -1, direction: "none" };

  // Numbers, the most significant first; null where there is nothing to sort by.
  function keyOf(row, column) {
    const cell = row.cells[column];
    if (cell.dataset.key === undefined) return cell.textContent.trim();
    return cell.dataset.key === "" ? null : cell.dataset.key.split(" ").map(Number);
  }

  function compare(one, other) {
    if (typeof one === "string") return texts.compare(one, other);
    const at = one.findIndex((number, place) => number !== other[place]);
    return at < 0 ? 0 : one[at] - other[at];
  }

  function sort() {
    const { column, direction } = sorting;
    headers.forEach((header, place) =>
      header.setAttribute("aria-sort", place === column ? direction : "none"));
    const rows = [...inPaperOrder];
    if (direction !== "none") {
      const keys = new Map(rows.map((row) => [row, keyOf(row, column)]));
      const sign = direction === "ascending" ? 1 : -1;
      rows.sort((one, other) => {
        const [first, second] = [keys.get(one), keys.get(other)];
        if (first === null || second === null) return (first === null) - (second === null);
        return sign * compare(first, second);
      });
    }
    body.append(...rows);
  }

  function show() {
    for (const row of inPaperOrder) {
      row.hidden = (filter.verdict && row.dataset.verdict !== filter.verdict)
        || (filter.source && row.dataset.source !== filter.source);
    }
    for (const choice of choices) {
      choice.setAttribute("aria-pressed", String(choice.dataset.verdict === filter.verdict));
    }
    source.value = filter.source;
    const count = inPaperOrder.filter((row) => !row.hidden).length;
    const order = sorting.direction === "none" ? "in the paper’s order"
      : `by ${headers[sorting.column].textContent.trim()}, ${sorting.direction}`;
    shown.textContent = `${count} of ${inPaperOrder.length} shown, ${order}`;
  }

  headers.forEach((header, column) => {
    const button = document.createElement("button");
    button.type = "button";
    button.append(...header.childNodes);
    header.append(button);
    button.addEventListener("click", () => {
      const current = sorting.column === column ? sorting.direction : "none";
      const next = { none: "ascending", ascending: "descending", descending: "none" };
      sorting = { column, direction: next[current] };
      sort();
      show();
    });
  });
  for (const choice of choices) {
    choice.addEventListener("click", () => {
      filter.verdict = choice.dataset.verdict;
      show();
    });
  }
  source.addEventListener("change", () => {
    filter.source = source.value;
    show();
  });

  // A link to a claim finds it, whatever is filtered.
  function reveal() {
    const row = document.getElementById(decodeURIComponent(location.hash.slice(1)));
    if (!row || !row.hidden || row.parentNode !== body) return;
    filter.verdict = filter.source = "";
    show();
    row.scrollIntoView();
  }
  window.addEventListener("hashchange", reveal);

  document.getElementById("controls").hidden = false;
  sort();
  show();
})();
