// The first table is sorted by any column; without this it stands there complete.
(() => {
  "use strict";
  const table = document.querySelector("#overall table");
  const headers = [...table.tHead.rows[0].cells];
  const texts = new Intl.Collator("en", { numeric: true });
  const keyOf = ({ dataset, textContent }) => ("key" in dataset ? Number(dataset.key) : textContent.trim());
  const compare = (one, other) => (typeof one === "string" ? texts.compare(one, other) : one - parseFloat(other));
  headers.forEach((header, column) => {
    const button = document.createElement("button");
    button.type = "button";
    button.append(...header.childNodes);
    header.append(button);
    header.setAttribute("aria-sort", "none");
    button.addEventListener("click", () => {
      const direction = header.getAttribute("aria-sort") === "descending" ? "ascending" : "descending";
      const sign = direction === "ascending" ? 1 : -1;
      headers.forEach((other) => other.setAttribute("aria-sort", other === header ? direction : "none"));
      const keyed = [...table.tBodies[0].rows].map((row) => [keyOf(row.cells[column]), row]);
      keyed.sort(([one], [other]) => sign * compare(one, other));
      table.tBodies[0].append(...keyed.map(([, row]) => row));
    });
  });
})();

// One run of each system on a sequence, on a page in a frame. It is made of its data and of what is around
// the data on all of these pages.
(() => {
  "use strict";
  const at = (id) => document.getElementById(id);
  const sequence = at("trajectory");
  if (!sequence) return; // too large, or no run was scored
  const [before, after] = JSON.parse(at("own-page").textContent);
  function show() {
    const parts = [before, at(`own-${sequence.value}`).textContent, after];
    const address = URL.createObjectURL(new Blob(parts, { type: "text/html" }));
    at("own-tab").href = address;
    // A new frame: another page in the same one would be a step of the browser's history.
    const frame = document.createElement("iframe");
    frame.src = address;
    frame.title = `Trajectories on ${sequence.selectedOptions[0].text}`;
    at("own").replaceChildren(frame);
  }
  sequence.addEventListener("change", show);
  show();
})();
