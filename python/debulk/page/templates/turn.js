// Turns the nets: drag, or arrow keys, + and - for heights, Home to go back. page_net.py draws the same still.
"use strict";
(() => {
  const W = 420, H = 260, EDGE = 12, START = 32, HEIGHTS = [1, 2, 3, 5, 8, 12, 20, 30, 50];
  const palettes = ["palette", "after"].map(name => document.currentScript.dataset[name].split(","));
  const known = new Map();

  function net(box) {
    if (!known.has(box)) {
      const data = JSON.parse(box.dataset.net);
      known.set(box, { data, start: data.heights, turn: 0, tilt: START, heights: data.heights });
    }
    return known.get(box);
  }

  function picture(data, state, turn, tilt, heights) {
    const { cells, loose, kinds, section, radius } = data, flat = data.states[state];
    const top = data.tops[state], palette = palettes[data.after[state]], raise = heights * data.lifts[state];
    const ct = Math.cos(turn * Math.PI / 180), st = Math.sin(turn * Math.PI / 180);
    const ce = Math.cos(tilt * Math.PI / 180), se = Math.sin(tilt * Math.PI / 180);
    let low = Infinity, high = -Infinity; // of both nets, however they are turned
    data.states.forEach((other, s) => {
      for (let k = 0; k < other.length; k += 3) {
        const reach = Math.hypot(other[k], other[k + 1]) * se, h = heights * data.lifts[s] * other[k + 2] * ce;
        low = Math.min(low, h - reach);
        high = Math.max(high, h + reach);
      }
    });
    const scale = Math.min((W - 2 * EDGE) / (2 * radius), (H - 2 * EDGE) / Math.max(high - low, 1e-9));
    const count = kinds.length, at = new Array(count), depth = new Array(count), nearest = new Array(count);
    for (let k = 0; k < count; k++) {
      const a = flat[3 * k], b = flat[3 * k + 1], h = raise * flat[3 * k + 2];
      const x = a * ct - b * st, y = a * st + b * ct;
      const v = H / 2 - scale * (y * se + h * ce - (low + high) / 2);
      at[k] = [(W / 2 + scale * x).toFixed(1), v.toFixed(1)];
      nearest[k] = depth[k] = y * ce - h * se;
    }
    const colour = h => palette[Math.max(0, Math.min(palette.length - 1, Math.floor(h / Math.max(top, 1e-9) * palette.length)))];
    const to = list => "M" + list.map(k => at[k].join(" ")).join("L");
    const parts = [];
    for (let c = 0; c < cells.length; c += 4) {
      const corners = cells.slice(c, c + 4);
      const away = corners.reduce((sum, k) => sum + depth[k], 0) / 4;
      for (const k of corners) nearest[k] = Math.min(nearest[k], away);
      parts.push([away, `<path fill="${colour(corners.reduce((sum, k) => sum + flat[3 * k + 2], 0) / 4)}" d="${to(corners)}Z"/>`]);
    }
    for (let e = 0; e < loose.length; e += 2) {
      parts.push([(depth[loose[e]] + depth[loose[e + 1]]) / 2, `<path d="${to(loose.slice(e, e + 2))}"/>`]);
    }
    for (let k = 0; k < count; k++) {
      const [u, v] = at[k];
      const mark = kinds[k] === "1" ? `<path class="fixed" d="M${u} ${v}m-2 -2h4v4h-4z"/>`
        : kinds[k] === "2" ? `<path class="free" d="M${u} ${v}m0 -4l3.6 6.4h-7.2z"/>`
        : `<circle cx="${u}" cy="${v}" r="2.2" fill="${colour(flat[3 * k + 2])}"/>`;
      parts.push([nearest[k] - 1e-6, mark]);
    }
    parts.sort((a, b) => b[0] - a[0]);
    const drawn = parts.map(part => part[1]).join("");
    return section.length > 1 ? drawn + `<path class="section" d="${to(section)}"/>` : drawn;
  }

  function draw(box) {
    const { data, turn, tilt, heights } = net(box);
    box.querySelectorAll("svg.net").forEach((svg, k) => { svg.innerHTML = picture(data, k, turn, tilt, heights); });
    box.querySelectorAll(".heights").forEach(text => { text.textContent = `, heights × ${heights * text.dataset.lift}`; });
  }

  const waiting = new Set();
  function later(box) { // once a frame, however many events come
    if (!waiting.has(box)) {
      waiting.add(box);
      requestAnimationFrame(() => { waiting.delete(box); draw(box); });
    }
  }

  function turned(box, turn, tilt) {
    const now = net(box);
    now.turn = ((now.turn + turn) % 360 + 360) % 360;
    now.tilt = Math.max(0, Math.min(90, now.tilt + tilt));
    later(box);
  }

  const deeds = {
    left: box => turned(box, -10, 0), right: box => turned(box, 10, 0),
    up: box => turned(box, 0, -5), down: box => turned(box, 0, 5),
    higher: box => { const now = net(box); now.heights = HEIGHTS.find(f => f > now.heights) ?? now.heights; later(box); },
    lower: box => { const now = net(box); now.heights = HEIGHTS.findLast(f => f < now.heights) ?? now.heights; later(box); },
    above: box => { net(box).tilt = 90; later(box); },
    back: box => { const now = net(box); now.turn = 0; now.tilt = START; now.heights = now.start; later(box); },
  };
  const keys = {
    ArrowLeft: "left", ArrowRight: "right", ArrowUp: "up", ArrowDown: "down", "+": "higher", "=": "higher", "-": "lower", Home: "back",
  };

  const unseen = new IntersectionObserver(entries => {
    for (const entry of entries) if (entry.isIntersecting) { unseen.unobserve(entry.target); draw(entry.target); }
  }, { rootMargin: "300px" });

  for (const box of document.querySelectorAll("[data-net]")) {
    let drag = null;
    for (const svg of box.querySelectorAll("svg.net")) {
      svg.tabIndex = 0;
      svg.addEventListener("pointerdown", event => {
        if (event.button !== 0) return;
        drag = [event.clientX, event.clientY];
        svg.setPointerCapture(event.pointerId);
      });
      svg.addEventListener("pointermove", event => {
        if (!drag) return;
        turned(box, 0.5 * (event.clientX - drag[0]), 0.4 * (event.clientY - drag[1]));
        drag = [event.clientX, event.clientY];
      });
      for (const end of ["pointerup", "pointercancel"]) svg.addEventListener(end, () => { drag = null; });
      svg.addEventListener("dblclick", () => deeds.back(box));
      svg.addEventListener("keydown", event => {
        if (event.ctrlKey || event.altKey || event.metaKey || !(event.key in keys)) return;
        event.preventDefault();
        deeds[keys[event.key]](box);
      });
    }
    box.addEventListener("click", event => {
      const deed = event.target.closest("[data-deed]");
      if (deed) deeds[deed.dataset.deed](box);
    });
    if (box.querySelector("svg.net:empty")) unseen.observe(box); // left out of the file to keep it small
  }
  document.documentElement.classList.add("scripted");
})();
