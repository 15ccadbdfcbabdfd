// Sorting of the first table by any column. Without it the table stands there complete.
(() => {
  "use strict";
  const table = document.querySelector("table.sortable");
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
