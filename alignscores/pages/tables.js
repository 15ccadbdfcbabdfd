// Tables that are sorted by any column. Without it they stand there complete.
const AlignmentTables = (() => {
  "use strict";
  const texts = new Intl.Collator("en", { numeric: true });

  // Numbers, the most significant first, or a text; null where there is nothing to sort by.
  function keyOf(cell) {
    const { key } = cell.dataset;
    if (key === undefined) return cell.textContent.trim();
    return key === "" ? null : key.split(" ").map(Number);
  }

  function compare(one, other) {
    if (typeof one === "string") return texts.compare(one, other);
    const at = one.findIndex((number, place) => number !== other[place]);
    return at < 0 ? 0 : one[at] - other[at];
  }

  function sorted(rows, column, sign) {
    const keys = new Map(rows.map((row) => [row, keyOf(row.cells[column])]));
    return rows.sort((one, other) => {
      const [first, second] = [keys.get(one), keys.get(other)];
      if (first === null || second === null) return (first === null) - (second === null);
      return sign * compare(first, second);
    });
  }

  // Makes a button of each header, which leads through directions; rows that tie, and all in the
  // direction "none", stay as `rows()` has them. `show(column, direction)` hears of it.
  function sortable(table, directions, rows, show) {
    const headers = [...table.tHead.rows[0].cells];
    headers.forEach((header, column) => {
      const button = document.createElement("button");
      button.type = "button";
      button.append(...header.childNodes);
      header.append(button);
      header.setAttribute("aria-sort", "none");
      button.addEventListener("click", () => {
        const place = directions.indexOf(header.getAttribute("aria-sort")) + 1;
        const direction = directions[place % directions.length];
        headers.forEach((other) => other.setAttribute("aria-sort", other === header ? direction : "none"));
        const sign = { ascending: 1, descending: -1, none: 0 }[direction];
        table.tBodies[0].append(...(sign ? sorted([...rows()], column, sign) : rows()));
        show?.(header.textContent.trim(), direction);
      });
    });
  }

  return Object.freeze({ sortable });
})();
