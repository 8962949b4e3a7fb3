"use strict";
// The state comes as events, each of them whole. What was not heard of for SILENCE_MS is not shown as if it were so.
const SILENCE_MS = 6000, OLD_S = 600, MOST_DEEDS = 5;
const root = document.documentElement, at = id => document.getElementById(id);
let state = null, heard = 0, heardAt = null;

const say = (id, text) => { if (at(id).textContent !== text) at(id).textContent = text; };
const make = (tag, text, kind) => {
  const made = document.createElement(tag);
  made.textContent = text;
  if (kind) made.className = kind;
  return made;
};
const sayWord = word => {
  say("word", word);
  at("word").style.setProperty("--letters", word.length);
};
const named = one => [one.part, one.ply && `ply ${one.ply}`].filter(Boolean).join(", ");
const clock = time => time.toLocaleTimeString("en-GB");

function age(seconds) {
  if (seconds < 60) return `${Math.floor(seconds)} s ago`;
  if (seconds < 7200) return `${Math.floor(seconds / 60)} min ago`;
  return `${Math.floor(seconds / 3600)} h ago`;
}

function drawMap(newest, count) {
  const map = at("map"), svg = (tag, values) => {
    const made = document.createElementNS("http://www.w3.org/2000/svg", tag);
    for (const [name, value] of Object.entries(values)) made.setAttribute(name, value);
    map.append(made);
    return made;
  };
  map.replaceChildren();
  const places = newest.do.map((deed, k) => [deed, k < count]).filter(([deed]) => deed.place_mm);
  if (newest.outline_mm.length < 3 || !places.length) return;
  const all = [...newest.outline_mm, ...places.map(([deed]) => deed.place_mm)];
  const [x, y] = [0, 1].map(k => all.map(point => k ? -point[k] : point[k]));  // a screen's y points downwards
  const [left, top] = [Math.min(...x), Math.min(...y)], [width, height] = [Math.max(...x) - left, Math.max(...y) - top];
  const mark = 0.055 * Math.max(width, height);
  map.setAttribute("viewBox", `${left - mark} ${top - mark} ${width + 2 * mark} ${height + 2 * mark}`);
  for (const ring of [newest.outline_mm, ...newest.cut_outs_mm])
    svg("polygon", { points: ring.map(([a, b]) => `${a},${-b}`).join(" ") });
  for (const [deed, listed] of places.reverse()) {  // the first on top
    const [a, b] = deed.place_mm;
    for (const way of listed ? deed.ways_deg : []) {
      const [c, s] = [Math.cos(way * Math.PI / 180), -Math.sin(way * Math.PI / 180)];
      const tip = t => [a + 3.2 * mark * c - t * mark * (c + s), -b + 3.2 * mark * s - t * mark * (s - c)];
      const barb = [a + 3.2 * mark * c - 0.6 * mark * (c - s), -b + 3.2 * mark * s - 0.6 * mark * (s + c)];
      svg("polyline", { points: [[a, -b], tip(0), tip(0.6), tip(0), barb].join(" ") });
    }
    svg("circle", { cx: a, cy: -b, r: mark, class: deed.verdict });
    svg("text", { x: a, y: -b, "font-size": 1.3 * mark }).textContent = deed.pocket ?? "";
  }
}

function drawDeeds(newest, count) {
  const deeds = newest.do.slice(0, count).map(deed => {
    const line = make("li", ""), text = make("span", deed.do);
    const place = deed.place_mm ? ` at (${deed.place_mm.map(v => Math.round(v)).join(", ")}) mm` : "";
    const more = [deed.at + place, deed.amount].filter(Boolean).join(": ");
    if (more) text.append(make("small", more));
    line.append(text);
    return line;
  });
  if (newest.do.length > count) deeds.push(make("li", `and ${newest.do.length - count} more`));
  at("do").replaceChildren(...deeds);
  return at("do").scrollHeight <= at("do").clientHeight;
}

function draw() {
  const { newest, running } = state;
  at("last").replaceChildren(...state.last.map(one => {
    const line = make("li", "");
    const time = one.finished_utc ? clock(new Date(one.finished_utc)).slice(0, 5) : "";
    for (const [text, kind] of [[time], [one.sign, one.verdict], [one.verdict, one.verdict], [named(one)]])
      line.append(make("span", text, kind));
    return line;
  }));
  if (running) {
    sayWord("INSPECTING");
    say("sign", "");
    say("what", named(running));
    say("reason", newest ? `before: ${newest.verdict}${named(newest) && `, ${named(newest)}`}` : "");
  } else if (newest) {
    sayWord(newest.verdict);
    say("sign", newest.sign);
    say("what", named(newest));
    say("reason", newest.reason);
  } else {
    const notReady = Object.entries(state.inspectors).filter(([, what]) => what !== "ready");
    sayWord("NO SCAN YET");
    say("sign", "");
    say("what", "");
    say("reason", notReady.map(([name, what]) => `${name}: ${what}`).join("; "));
  }
  if (newest && !running) {
    let count = Math.min(MOST_DEEDS, newest.do.length);
    drawMap(newest, count);  // first: it takes its width; all places are on it, with the ways of those in the list
    while (!drawDeeds(newest, count) && count > 1) count -= 1;
    drawMap(newest, count);
  } else {
    at("do").replaceChildren();
    at("map").replaceChildren();
  }
}

function tick() {
  say("clock", clock(new Date()));
  if (state === null) return;
  const silent = performance.now() - heard, lost = silent > SILENCE_MS;
  const { newest, running } = state, shown = newest && !running;
  const seconds = shown ? (new Date(state.now_utc) - new Date(newest.finished_utc) + silent) / 1000 : 0;
  root.dataset.state = lost ? "lost" : running ? "running" : newest ? newest.verdict : "nothing";
  root.toggleAttribute("data-known", true);
  root.toggleAttribute("data-old", Boolean(shown && seconds > OLD_S));
  say("age", shown ? age(Math.max(seconds, 0)) : "");
  if (lost) say("since", `no word from the inspector since ${clock(heardAt)}: do not go by what stands below`);
}

function listen() {
  const source = new EventSource("events");
  source.onmessage = event => {
    [state, heard, heardAt] = [JSON.parse(event.data), performance.now(), new Date()];
    draw();
    tick();
  };
  // The browser tries again by itself, but not where the service has answered that it has too many listeners.
  source.onerror = () => { if (source.readyState === EventSource.CLOSED) setTimeout(listen, 2000); };
}
listen();
setInterval(tick, 500);
