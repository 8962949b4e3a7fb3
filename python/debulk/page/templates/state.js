// Opens what a link leads to, and keeps in the address what the reader has switched, so that a copied address shows the same.
"use strict";
(() => {
  const all = (selector, within = document) => Array.from(within.querySelectorAll(selector));

  function open() { // also where a link leads into something that is folded
    const target = location.hash.length > 1 && document.getElementById(decodeURIComponent(location.hash.slice(1)));
    if (!target) return;
    for (let fold = target.closest("details"); fold; fold = fold.parentElement.closest("details")) fold.open = true;
    const card = target.querySelector(":scope > details.card");
    if (card) card.open = true;
    target.scrollIntoView();
  }
  addEventListener("hashchange", open);

  const wanted = new URLSearchParams(location.search);
  const press = one => one?.click();
  const heads = all("table.sortable").flatMap(table => Array.from(table.tHead.rows[0].cells));
  if (wanted.has("layer")) press(document.querySelector(`[data-layer="${CSS.escape(wanted.get("layer"))}"]`));
  for (const verdict of (wanted.get("hide") ?? "").split(",").filter(Boolean)) press(document.querySelector(`.filter [data-verdict="${CSS.escape(verdict)}"]`));
  if (wanted.has("all")) for (const box of all("input.all")) box.checked = true;
  if (wanted.has("sort")) {
    const [column, way] = wanted.get("sort").split("."), head = heads[Number(column)];
    for (let k = 0; k < 2 && head && head.getAttribute("aria-sort") !== way; k++) press(head.querySelector("button"));
  }
  for (const id of (wanted.get("fold") ?? "").split(",").filter(Boolean)) {
    const fold = document.getElementById(id)?.querySelector(":scope > details");
    if (fold) fold.open = !fold.open;
  }
  const folds = all("[id] > details.card, [id] > details.fold"), first = new Map(folds.map(fold => [fold, fold.hasAttribute("data-open")]));
  const sorted = heads.findIndex(head => head.hasAttribute("aria-sort"));
  const start = document.querySelector("table.sortable") && !wanted.has("sort") ? `${sorted}.${heads[sorted]?.getAttribute("aria-sort")}` : "";

  function keep() {
    const now = new URLSearchParams(), column = heads.findIndex(head => head.hasAttribute("aria-sort"));
    const layer = document.querySelector("[data-layer][aria-pressed=true]")?.dataset.layer;
    if (layer && layer !== "heights") now.set("layer", layer);
    const hidden = all(".filter [aria-pressed=false]").map(one => one.dataset.verdict);
    if (hidden.length) now.set("hide", hidden.join());
    if (document.querySelector("input.all:checked")) now.set("all", "1");
    const sort = column < 0 ? "" : `${column}.${heads[column].getAttribute("aria-sort")}`;
    if (sort !== start) now.set("sort", sort);
    const turned = folds.filter(fold => fold.open !== first.get(fold)).map(fold => fold.parentElement.id);
    if (turned.length) now.set("fold", turned.join());
    const query = now.toString().replaceAll("%2C", ",");
    try {
      history.replaceState(null, "", `${location.pathname}${query ? `?${query}` : ""}${location.hash}`);
    } catch { /* a page from some archives has no address that may change */ }
  }
  for (const kind of ["click", "change"]) document.addEventListener(kind, event => {
    if (event.target.closest("button, input, summary")) setTimeout(keep);
  });
  for (const button of all("[data-fold-all]")) button.addEventListener("click", () => {
    const cards = all("details.card"), closed = cards.some(card => !card.open);
    for (const card of cards) card.open = closed;
  });
  open();
})();
