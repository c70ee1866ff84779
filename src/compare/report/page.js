// The page of a report: a list of pictures, the viewer, what differs and why, and the command that accepts what is ticked.
"use strict";
(() => {
  const data = JSON.parse(document.getElementById("data").textContent);
  const by = (id) => document.getElementById(id);
  const rows = [...document.querySelectorAll(".item")];
  const ticked = new Set();
  let current = -1;
  let filter = "all";

  const viewer = AnimViewer.create(by("picture"), { names: data.names, palette: data.palette });

  // Which statuses there are, and how many of each.
  const counts = new Map();
  for (const item of data.items) counts.set(item.status, (counts.get(item.status) ?? 0) + 1);
  const choices = [["all", data.items.length], ...counts];
  for (const [status, count] of choices.length > 2 ? choices : []) {
    const button = document.createElement("button");
    button.type = "button";
    button.textContent = `${status} ${count}`;
    button.dataset.status = status;
    button.addEventListener("click", () => list(status));
    by("filter").append(button);
  }

  const visible = () => rows.filter((row) => !row.hidden);

  function list(status) {
    filter = status;
    rows.forEach((row, i) => { row.hidden = status !== "all" && data.items[i].status !== status; });
    for (const button of by("filter").children) button.setAttribute("aria-pressed", String(button.dataset.status === status));
    const there = visible();
    if (there.length && (current < 0 || rows[current].hidden)) choose(rows.indexOf(there[0]));
    accept();
  }

  function choose(index) {
    if (index < 0 || index >= rows.length) return;
    current = index;
    const item = data.items[index];
    rows.forEach((row, i) => row.setAttribute("aria-current", String(i === index)));
    rows[index].scrollIntoView({ block: "nearest" });
    viewer.show({ layers: item.layers });
    details(item);
    history.replaceState(null, "", `#${encodeURIComponent(item.id)}`);
  }

  function add(parent, tag, text, properties) {
    const made = Object.assign(document.createElement(tag), properties);
    if (text !== undefined) made.textContent = text;
    parent.append(made);
    return made;
  }

  function details(item) {
    const box = by("details");
    box.replaceChildren();
    add(box, "h2", item.id);
    add(box, "p", item.status, { className: `status ${item.status}` });
    if (item.lines.length) {
      const lines = add(box, "ul");
      for (const line of item.lines) add(lines, "li", line);
    }
    if (item.message) add(box, "pre", item.message);
    if (item.why.length) {
      add(box, "h3", "Why");
      const why = add(box, "ul");
      for (const change of item.why) {
        const entry = add(why, "li");
        if (change.what) add(entry, "span", `${change.what} `);
        if (change.before !== undefined) add(entry, "del", change.before);
        if (change.before !== undefined && change.after !== undefined) entry.append(" \u2192 ");
        if (change.after !== undefined) add(entry, "ins", change.after);
      }
    }
    const files = [[data.names[0], item.a], [data.names[1], item.b]].filter(([, file]) => file);
    if (files.length) {
      add(box, "h3", "Files");
      const list = add(box, "ul");
      for (const [name, file] of files) {
        const entry = add(list, "li", `${name} `);
        add(entry, "code", file);
      }
    }
  }

  // `show.3`, `show.4`, `show.5` become `show.3-5`.
  function patterns(ids) {
    const frames = new Map();
    const others = [];
    for (const id of ids) {
      const [, name, frame] = /^(.*)\.(\d+)$/.exec(id) ?? [];
      if (name === undefined) others.push(id);
      else frames.set(name, [...(frames.get(name) ?? []), Number(frame)]);
    }
    const grouped = [...frames].flatMap(([name, numbers]) => {
      numbers.sort((a, b) => a - b);
      const runs = [];
      for (const n of numbers) {
        const last = runs.at(-1);
        if (last && last[1] + 1 === n) last[1] = n;
        else runs.push([n, n]);
      }
      return runs.map(([from, to]) => `${name}.${from === to ? from : `${from}-${to}`}`);
    });
    return [...others, ...grouped].join(",");
  }

  const quoted = (text) => (/^[\w@%+=:,./-]+$/.test(text) ? text : `'${text.replaceAll("'", "'\\''")}'`);

  function accept() {
    by("accept").hidden = !data.command || !data.items.some((item) => item.acceptable);
    const ids = data.items.filter((item) => ticked.has(item.id)).map((item) => item.id);
    by("ticked").textContent = `${ids.length} ticked`;
    by("command").textContent = ids.length ? `${data.command} --accept ${quoted(patterns(ids))}` : "tick what is right, then copy one command";
    by("copy").disabled = !ids.length;
    const there = visible().map((row) => data.items[rows.indexOf(row)]).filter((item) => item.acceptable);
    by("all").checked = there.length > 0 && there.every((item) => ticked.has(item.id));
    by("all").indeterminate = !by("all").checked && there.some((item) => ticked.has(item.id));
  }

  function tick(index, on = !ticked.has(data.items[index].id)) {
    const item = data.items[index];
    if (!item.acceptable) return;
    if (on) ticked.add(item.id);
    else ticked.delete(item.id);
    const box = rows[index].querySelector("input");
    if (box) box.checked = on;
    accept();
  }

  rows.forEach((row, index) => {
    row.querySelector("a").addEventListener("click", (event) => { event.preventDefault(); choose(index); });
    row.addEventListener("click", (event) => { if (!event.target.closest("input, a")) choose(index); });
    row.querySelector("input")?.addEventListener("change", (event) => tick(index, event.target.checked));
  });
  by("all").addEventListener("change", () => {
    // Each tick looks at the box for all again.
    const on = by("all").checked;
    for (const row of visible()) tick(rows.indexOf(row), on);
  });

  by("copy").addEventListener("click", async () => {
    const text = by("command").textContent;
    try {
      await navigator.clipboard.writeText(text);
    } catch {
      // A page from a file may not use the clipboard everywhere: choose the text, so that it can be copied by hand.
      getSelection().selectAllChildren(by("command"));
      document.execCommand?.("copy");
    }
    by("copy").textContent = "copied";
    setTimeout(() => { by("copy").textContent = "copy command"; }, 1500);
  });

  const THEMES = ["system", "dark", "light"];
  let theme = 0;
  function nextTheme() {
    theme = (theme + 1) % THEMES.length;
    if (theme) document.documentElement.dataset.theme = THEMES[theme];
    else delete document.documentElement.dataset.theme;
    by("theme").textContent = `theme: ${THEMES[theme]}`;
  }
  by("theme").addEventListener("click", nextTheme);

  const KEYS = [
    ["j, n, page down", "next picture"], ["k, p, page up", "picture before"], ["x", "tick, or take the tick away"],
    ...AnimViewer.MODES.map((mode) => [mode.key, mode.label ?? data.names[mode.id === "a" ? 0 : 1]]),
    ["space", `${data.names[0]} and ${data.names[1]} in turns, by hand`], ["+, -, 0", "zoom, and fit"],
    ["arrows", "choose a pixel (in the picture)"], ["t", "theme"], ["?", "this list"],
  ];
  const table = add(by("help"), "table");
  for (const [key, what] of KEYS) {
    const row = add(table, "tr");
    add(add(row, "td"), "kbd", key);
    add(row, "td", what);
  }
  const form = add(by("help"), "form", undefined, { method: "dialog" });
  add(form, "button", "close");
  by("keys").addEventListener("click", () => by("help").showModal());

  function step(by) {
    const there = visible();
    const at = there.indexOf(rows[current]);
    const next = there[Math.min(there.length - 1, Math.max(0, at + by))];
    if (next) choose(rows.indexOf(next));
  }

  document.addEventListener("keydown", (event) => {
    if (event.ctrlKey || event.metaKey || event.altKey || by("help").open) return;
    const { target } = event;
    // Where a key already means something, it keeps its meaning.
    if (target.matches("select, input[type=range]")) return;
    if (event.key === " " && target.matches("button, input, a")) return;
    const actions = {
      j: () => step(1), n: () => step(1), PageDown: () => step(1), k: () => step(-1), p: () => step(-1), PageUp: () => step(-1),
      x: () => tick(current), t: nextTheme, "?": () => by("help").showModal(),
    };
    const action = actions[event.key];
    if (action) action();
    if (action || viewer.key(event.key)) event.preventDefault();
  });

  list("all");
  const asked = data.items.findIndex((item) => `#${encodeURIComponent(item.id)}` === location.hash);
  if (rows.length) choose(Math.max(0, asked));
  window.animReport = { viewer, data, choose, tick };
})();
