// Says beside the map what lies under the cursor: place in the mold frame, height, pocket. Heights are read from the
// picture's own colours, so they are as exact as these.
"use strict";
(() => {
  const rgb = name => document.currentScript.dataset[name].match(/.{6}/g).map(hex => [0, 2, 4].map(k => parseInt(hex.slice(k, k + 2), 16)));
  const heights = rgb("ramp"), ridges = rgb("ridges");
  const FAR = 12; // a colour further than this from all of the ramp is no height
  const figure = (value, digits) => value.toFixed(digits).replace(/^-(0(\.0+)?)$/, "$1").replace("-", "−");

  function level(colour, ramp) {
    let best = -1, least = FAR + 1;
    ramp.forEach((one, k) => {
      const away = Math.max(...one.map((c, j) => Math.abs(c - colour[j])));
      if (away < least) [best, least] = [k, away];
    });
    return best;
  }

  function reader(image, ramp, none, text) {
    const [left, upper, width, height] = ["x", "y", "width", "height"].map(name => Number(image.getAttribute(name)));
    const canvas = document.createElement("canvas"), source = new Image();
    let pixels = null;
    source.src = image.getAttribute("href");
    const ready = source.decode().then(() => {
      [canvas.width, canvas.height] = [source.naturalWidth, source.naturalHeight];
      pixels = canvas.getContext("2d", { willReadFrequently: true });
      pixels.drawImage(source, 0, 0);
    });
    function say(x, y) {
      const u = Math.floor((x - left) / width * canvas.width), v = Math.floor((y - upper) / height * canvas.height);
      if (!pixels || u < 0 || v < 0 || u >= canvas.width || v >= canvas.height) return "";
      const [r, g, b, a] = pixels.getImageData(u, v, 1, 1).data;
      if (a < 128) return none;
      const found = level([r, g, b], ramp);
      return found < 0 ? "" : text(found);
    }
    return { say, ready };
  }

  function heightText(top) {
    return found => { // the middle of the ramp is 0, before it is below the reference
      const share = Math.abs(found - 255) / 255, mm = top * share * share, side = found < 255 ? "below" : "above";
      if (share === 1) return side === "above" ? `${figure(top, 1)} mm high or more` : `${figure(top, 1)} mm or more below the reference`;
      return `${figure(mm, top * 2 * share / 255 < 0.03 ? 2 : 1)} mm ${side} the reference`;
    };
  }
  const ridgeText = top => found => found === 255 ? `a ridge of ${figure(top, 2)} mm or more` : `a ridge of ${figure(top * found / 255, 2)} mm`;
  const shearText = top => found => `shear of ${figure(top * found / 255, 1)} degrees`;
  const kinds = { // by the layer's name: colours, what no colour means, and what a colour says
    heights: [heights, "not seen, or off the ply", heightText],
    excess: [ridges, "no fibre is too long here", ridgeText],
    shear: [heights.slice(255), "directions not known, or off the ply", shearText],
  };

  for (const map of document.querySelectorAll(".map")) {
    const svg = map.querySelector("svg"), output = map.querySelector("output");
    const outlines = Array.from(svg.querySelectorAll("path.mark")), box = svg.viewBox.baseVal;
    const cross = document.createElementNS(svg.namespaceURI, "path");
    const readers = new Map();
    let at = null, pocket = null, finger = false;
    cross.setAttribute("class", "cross");
    svg.append(cross);
    svg.tabIndex = 0;

    function shown() {
      const name = map.dataset.shows, image = svg.querySelector(`image.${name}`), [ramp, none, text] = kinds[name];
      if (!readers.has(name)) readers.set(name, image ? reader(image, ramp, none, text(Number(image.dataset.top))) : { say: () => "", ready: Promise.resolve() });
      return readers.get(name);
    }

    for (const button of map.querySelectorAll("button[data-layer]")) button.addEventListener("click", () => {
      map.dataset.shows = button.dataset.layer;
      svg.parentElement.classList.toggle("blank", button.dataset.layer === "excess");
      for (const one of map.querySelectorAll("button[data-layer]")) one.setAttribute("aria-pressed", String(one === button));
      if (at) show(...at, false);
    });

    function show(x, y, keyboard) {
      const point = svg.createSVGPoint();
      at = [point.x, point.y] = [x, y].map((c, k) => Math.max(k ? box.y : box.x, Math.min((k ? box.y + box.height : box.x + box.width), c)));
      const reader = shown();
      pocket = outlines.find(outline => outline.isPointInFill(point)) ?? null;
      cross.setAttribute("d", `M${box.x} ${at[1]}h${box.width}M${at[0]} ${box.y}v${box.height}`);
      const said = () => {
        const [px, py] = at, parts = [`x ${figure(px, 0)}, y ${figure(-py, 0)} mm`, reader.say(px, py), pocket?.dataset.says];
        output.setAttribute("aria-live", keyboard ? "polite" : "off"); // a mouse would make a screen reader talk without end
        output.textContent = parts.filter(Boolean).join(" · ");
      };
      said();
      return reader.ready.then(said, () => {});
    }

    function pointed(event) {
      const { x, y } = new DOMPoint(event.clientX, event.clientY).matrixTransform(svg.getScreenCTM().inverse());
      show(x, y, false);
    }
    svg.addEventListener("pointermove", pointed);
    svg.addEventListener("pointerdown", event => { finger = event.pointerType === "touch"; pointed(event); });
    svg.addEventListener("click", event => { // a finger in a pocket reads the height; line and number lead to the card
      if (finger && event.target.closest(".casing")) event.preventDefault();
    });
    svg.addEventListener("pointerleave", event => { if (event.pointerType === "mouse") cross.removeAttribute("d"); });
    svg.addEventListener("focus", () => { if (svg.matches(":focus-visible")) show(...(at ?? [box.x + box.width / 2, box.y + box.height / 2]), true); });
    svg.addEventListener("keydown", event => {
      if (event.target !== svg || event.ctrlKey || event.altKey || event.metaKey) return;
      const step = Math.max(1, Math.round(box.width / 300)) * (event.shiftKey ? 10 : 1);
      const way = { ArrowLeft: [-1, 0], ArrowRight: [1, 0], ArrowUp: [0, -1], ArrowDown: [0, 1] }[event.key];
      const [x, y] = at ?? [box.x + box.width / 2, box.y + box.height / 2];
      if (way) show(x + step * way[0], y + step * way[1], true);
      else if (event.key === "Enter" && pocket?.closest("a").hasAttribute("href")) location.hash = pocket.closest("a").getAttribute("href");
      else return;
      event.preventDefault();
    });
  }
})();
