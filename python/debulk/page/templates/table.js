// Sorts the tables of pockets by a click on a heading, and hides the rows of verdicts that are switched off.
"use strict";
(() => {
  const values = (row, column) => {
    const cell = row.cells[column], text = (cell.dataset.value ?? cell.textContent.trim()).replace(/^−(?=\d)/, "-"); // the page's minus is no hyphen
    return text === "" || text === "–" ? null : Number.isNaN(Number(text)) ? text : Number(text);
  };

  function compare(a, b) { // what is not known comes last, whichever way
    return typeof a === typeof b ? (a < b ? -1 : a > b ? 1 : 0) : typeof a === "number" ? -1 : 1;
  }

  for (const table of document.querySelectorAll("table.sortable")) {
    const heads = Array.from(table.tHead.rows[0].cells), body = table.tBodies[0];
    heads.forEach((head, column) => {
      if (!head.textContent.trim()) return;
      const button = document.createElement("button");
      button.type = "button";
      button.append(...head.childNodes);
      head.append(button);
      button.addEventListener("click", () => {
        const down = head.getAttribute("aria-sort") === "ascending" || (!head.hasAttribute("aria-sort") && "down" in head.dataset);
        heads.forEach(other => other.removeAttribute("aria-sort"));
        head.setAttribute("aria-sort", down ? "descending" : "ascending");
        const rows = Array.from(body.rows, row => [row, values(row, column)]);
        const [known, unknown] = [rows.filter(([, value]) => value !== null), rows.filter(([, value]) => value === null)];
        known.sort(([, a], [, b]) => (down ? -1 : 1) * compare(a, b));
        body.append(...[...known, ...unknown].map(([row]) => row));
      });
    });

    const filter = table.closest("section").querySelector(".filter"), status = filter?.querySelector("output");
    filter?.addEventListener("click", event => {
      const button = event.target.closest("[data-verdict]");
      if (!button) return;
      button.setAttribute("aria-pressed", String(button.getAttribute("aria-pressed") !== "true"));
      const shown = new Set(Array.from(filter.querySelectorAll("[aria-pressed=true]"), one => one.dataset.verdict));
      for (const row of body.rows) row.hidden = !shown.has(row.dataset.verdict);
      const count = Array.from(body.rows).filter(row => !row.hidden).length;
      status.textContent = count === body.rows.length ? "" : `${count} of ${body.rows.length} shown`;
    });
  }
})();
