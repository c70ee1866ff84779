// The page: news from the server, timeline, playing, tools in the picture, comparing, keys.
window.animPreview = (() => {
  const by = (id) => document.getElementById(id);
  const { element } = AnimPanels;
  const { shown } = AnimPicture;
  const local = {
    frame: 1, playing: 0, tool: "select", part: null, camera: null, place: null, drag: null, pinned: 0, painted: 0, asked: 0, moving: null,
  };
  let state = { frames: [] };

  // --- News ---------------------------------------------------------------------------------------------------------

  async function listen() {
    let since = 0;
    for (;;) {
      try {
        const news = await (await AnimServer.get(`/state?since=${since}`)).json();
        by("lost").hidden = true;
        since = news.version;
        if (!news.starting) await take(news);
      } catch (error) {
        by("lost").hidden = false;
        if (error.status === 403) by("lost").textContent = error.message;
        await new Promise((done) => setTimeout(done, 1000));
      }
    }
  }

  async function take(news) {
    const before = state;
    state = news;
    state.frames ??= [];
    const name = news.input.split(/[\\/]/).pop();
    document.title = `${name} - anim preview`;
    by("name").textContent = name;
    by("name").title = news.input;
    // The picture first: it is what is waited for.
    await draw();
    AnimPanels.problems(news.problems);
    AnimPanels.console(news);
    AnimPanels.parameters(news.parameters, define);
    by("undo").disabled = !news.undo;
    by("timeline").hidden = !news.is_sequence;
    by("render").textContent = news.rendering ? "stop" : "render";
    by("progress").hidden = !news.rendering;
    if (news.rendering) [by("progress").value, by("progress").max] = news.rendering;
    if (news.count && news.count !== before.count) {
      for (const id of ["scrub", "frame", "from", "to", "other-frame"]) by(id).max = news.count;
      if (!before.count || Number(by("to").value) === before.count || by("to").value > news.count) by("to").value = news.count;
      if (local.frame > news.count) go(news.count);
    }
    memory(news);
    badge();
    strip();
    fetchView();
    if (local.early && isSettled()) select(local.early);
    if (news.revision !== before.revision || (news.current.kind === "exact" && before.current?.kind !== "exact")) refreshPart();
  }

  function memory({ reuse_bytes, picture_bytes, memory_bytes }) {
    const mib = (bytes) => Math.round((bytes ?? 0) / (1 << 20));
    const text = `memory: ${mib(reuse_bytes + picture_bytes)} of ${mib(memory_bytes)} MiB (${mib(picture_bytes)} of pictures)`;
    if (by("memory").textContent !== text) by("memory").textContent = text;
  }

  // What another view than colours needs, once the picture is exact.
  async function fetchView() {
    const { layer } = shown;
    if (layer === "color" || !isSettled() || local.viewed === `${key()} ${layer}`) return;
    local.viewed = `${key()} ${layer}`;
    const isNoise = layer === "samples" || layer === "noise";
    try {
      if (isNoise) say("counting samples ...");
      await (isNoise ? AnimPicture.fetchNoise(key()) : AnimPicture.fetchLayers(key()));
      if (isNoise) say("\u00a0");
    } catch (error) {
      local.viewed = null;
      say(error.message);
    }
    AnimPicture.repaint();
  }

  // Shows the best picture that there is of the frame.
  async function draw() {
    const { current } = state;
    const row = state.frames[local.frame - 1];
    const isCurrent = current?.frame === local.frame && current.picture;
    const id = isCurrent ? current.picture : row?.[1];
    const kind = isCurrent ? current.kind : "exact";
    if (id && (!isCurrent || current.picture !== shown.id || current.kind !== shown.kind)) {
      if (await AnimPicture.show(id, local.frame, kind)) {
        if (kind === "exact" || kind === "mixed") shown.full = [shown.width, shown.height];
        local.painted = performance.now();
        live.seen();
        defining.seen();
      }
    }
    badge();
  }

  function badge() {
    const { current } = state;
    const words = { sketch: "quick picture", mixed: "mixed from each light's part", refining: "refining", stale: "before the edit" };
    const isCurrent = current?.frame === local.frame;
    by("badge").textContent = isCurrent ? words[current.kind] ?? "" : "";
    const seconds = isCurrent && current.kind === "exact" && current.seconds ? `, ${current.seconds.toFixed(2)} s` : "";
    const kept = isCurrent && current.kept > 0 ? `, ${Math.round(current.kept * 100)} % kept` : "";
    const wrong = (state.problems ?? []).filter((one) => one.severity === "error").length;
    const text = wrong ? `${wrong} mistake${wrong > 1 ? "s" : ""}` : isCurrent ? current.kind === "exact" ? `exact${seconds}${kept}` : words[current.kind] ?? "" : `frame ${local.frame}`;
    if (by("status").textContent !== text) by("status").textContent = text;
    const isExact = isCurrent && current.kind === "exact" && shown.id === current.picture && current.has_file;
    by("save").hidden = !isExact;
    if (isExact) {
      by("save").href = AnimServer.address(`/file/${current.picture}`);
      by("save").download = (state.target ?? "picture.png").split(/[\\/]/).pop();
    }
    const row = state.frames[local.frame - 1];
    if (row) {
      const [word, picture, seconds, changes] = row;
      const parts = [word === "unknown" ? "" : word, picture ? "in memory" : "", seconds ? `${seconds.toFixed(2)} s` : "", changes?.length ? `changes: ${changes.join(", ")}` : ""];
      by("about").textContent = parts.filter(Boolean).join(" \u00b7 ");
    }
  }

  // --- Timeline -----------------------------------------------------------------------------------------------------

  function strip() {
    const canvas = by("strip");
    const rows = state.frames;
    const density = devicePixelRatio || 1;
    canvas.width = Math.max(1, canvas.clientWidth * density);
    canvas.height = Math.max(1, canvas.clientHeight * density);
    const context = canvas.getContext("2d");
    const style = getComputedStyle(document.documentElement);
    const color = (name) => style.getPropertyValue(`--${name}`);
    const colors = { done: color("good"), stale: color("warn"), corrupt: color("warn"), foreign: color("warn"), missing: color("faint"), unknown: color("faint"), wrong: color("bad") };
    const width = canvas.width / Math.max(rows.length, 1);
    rows.forEach(([word, picture], i) => {
      context.fillStyle = colors[word] ?? colors.missing;
      context.fillRect(i * width, 0, Math.max(width - (width > 4 ? density : 0), 1), canvas.height);
      if (picture) {
        context.fillStyle = color("accent");
        context.fillRect(i * width, canvas.height / 2, Math.max(width - (width > 4 ? density : 0), 1), canvas.height / 2);
      }
    });
    context.fillStyle = color("text");
    context.fillRect((local.frame - 0.5) * width - density, 0, 2 * density, canvas.height);
  }

  let lookTimer = null;
  function go(frame) {
    const count = state.count || 1;
    local.frame = Math.min(Math.max(Math.round(frame) || 1, 1), count);
    by("scrub").value = local.frame;
    by("scrub").setAttribute("aria-valuetext", `frame ${local.frame} of ${count}`);
    by("frame").value = local.frame;
    draw();
    strip();
    clearTimeout(lookTimer);
    if (!local.playing) lookTimer = setTimeout(() => AnimServer.post("/look", { frame: local.frame }).catch(() => {}), 40);
  }

  function play(direction) {
    if (!direction && !local.playing) return;
    local.playing = direction;
    by("play").textContent = direction ? "pause" : "play";
    by("play").setAttribute("aria-pressed", String(!!direction));
    if (!direction) { go(local.frame); return; }
    const [start, from] = [performance.now(), local.frame];
    const tick = (now) => {
      if (local.playing !== direction || local.start !== start) return;
      const [a, b] = [Number(by("from").value) || 1, Number(by("to").value) || state.count];
      const length = Math.max(b - a + 1, 1);
      const passed = Math.floor((now - start) / 1000 * (state.fps || 24)) * direction;
      const frame = a + (((from - a + passed) % length) + length) % length;
      if (frame !== local.frame) go(frame);
      requestAnimationFrame(tick);
    };
    local.start = start;
    requestAnimationFrame(tick);
  }

  // Pictures of frames that are in the server's memory are fetched before they are wanted.
  async function prefetch() {
    for (;;) {
      await new Promise((done) => setTimeout(done, 100));
      if (state.count < 2) continue;
      for (let i = 0; i < state.frames.length; i++) {
        const row = state.frames[(local.frame - 1 + i) % state.frames.length];
        if (row?.[1] && !AnimPicture.has(row[1])) {
          await AnimPicture.load(row[1]).catch(() => {});
          break;
        }
      }
    }
  }

  // --- Parameters and fields ----------------------------------------------------------------------------------------

  const defining = newestOnly((message) => AnimServer.post("/define", message), 1000);
  function define(name, value, done) {
    if (done) {
      defining.drop();
      return AnimServer.post("/define", { name, value });
    }
    defining.push({ name, value });
  }

  const live = newestOnly((trials) => AnimServer.post("/try", trials));
  const tried = (...trials) => live.push(trials);
  async function written(assignments) {
    live.drop();
    try {
      return await AnimServer.post("/set", assignments);
    } catch (error) {
      await AnimServer.post("/try", []).catch(() => {});
      throw error;
    }
  }

  async function undo() {
    try { await AnimServer.post("/undo"); } catch (error) { say(error.message); }
  }

  const say = (text) => { by("readout").textContent = text; };

  async function part(kind, index) {
    return (await AnimServer.get(`/part?kind=${kind}&index=${index ?? 0}`)).json();
  }

  async function choose(kind, index) {
    try {
      local.part = await part(kind, index);
      shown.selected = kind === "entity" ? index + 1 : 0;
      by("frame-it").disabled = kind !== "entity";
      AnimPanels.selection(local.part, tried, written);
    } catch (error) {
      local.part = null;
      AnimPanels.selection(null);
      if (error.status !== 409) say(error.message);
    }
    AnimPicture.outline();
  }

  // What is selected is described anew after an edit, unless somebody is typing there.
  let stalePart = false;
  function refreshPart() {
    local.camera = null;
    if (!local.part) return;
    if (by("selection").contains(document.activeElement) && document.activeElement.matches("input")) { stalePart = true; return; }
    stalePart = false;
    const open = [...by("selection").querySelectorAll("details")].map((one) => one.open);
    choose(local.part.kind, local.part.index).then(() => by("selection").querySelectorAll("details").forEach((one, i) => { one.open = open[i] ?? false; }));
  }
  by("selection").addEventListener("focusout", () => setTimeout(() => { if (stalePart) refreshPart(); }, 200));

  // --- The picture --------------------------------------------------------------------------------------------------

  const key = () => `${state.revision}.${local.frame}`;
  const isSettled = () => state.current?.kind === "exact" && state.current.frame === local.frame && !(state.problems ?? []).length;

  async function point(place) {
    local.place = place;
    shown.cursor = place;
    by("focus-here").disabled = true;
    if (!isSettled()) { say(state.problems?.length ? "\u00a0" : "what is here shows when the picture is exact"); return; }
    try {
      await AnimPicture.fetchLayers(key());
      await AnimPicture.fetchLinear(shown.id);
    } catch { return; }
    if (local.place !== place) return;
    readout();
    AnimPicture.outline();
  }

  function readout() {
    const found = local.place && AnimPicture.at(local.place);
    if (!found) return;
    const [w, h] = [shown.width, shown.height];
    const digits = (list) => list.map((x) => Number(x.toPrecision(4))).join(" ");
    const light = AnimPicture.lightAt(local.place);
    const pixel = `pixel ${Math.min(Math.floor(local.place[0] * w), w - 1)}, ${Math.min(Math.floor(local.place[1] * h), h - 1)}`;
    const what = found.entity
      ? `${local.names?.[found.entity] ?? `entity ${found.entity}`}   depth ${digits([found.depth])}   at ${digits(found.position)}   normal ${digits(found.normal)}`
      : "nothing";
    const sampled = AnimPicture.sampledAt(local.place);
    const taken = sampled ? `${sampled[0]} samples, error ${digits([sampled[1]])}   ` : "";
    say(`${pixel}   ${light ? `light ${digits(light)}   ` : ""}${taken}${what}`);
    by("focus-here").disabled = !found.entity;
    if (found.entity && !(local.names ??= {})[found.entity]) name(found.entity);
  }

  async function name(entity) {
    local.names[entity] = `entity ${entity}`;
    const found = await part("entity", entity - 1).catch(() => null);
    if (!found) return;
    local.names[entity] = found.label + (found.material ? `, material ${found.material}` : "");
    readout();
  }

  async function select(place) {
    await point(place);
    // Who clicks too early gets what is there as soon as that is known.
    local.early = isSettled() ? null : place;
    if (local.early) return;
    const found = AnimPicture.at(place);
    if (found?.entity) await choose("entity", found.entity - 1);
    else { local.part = null; shown.selected = 0; AnimPanels.selection(null); AnimPicture.outline(); }
  }

  const placeOf = (event) => {
    const box = by("picture").getBoundingClientRect();
    return [(event.clientX - box.left) / box.width, (event.clientY - box.top) / box.height].map((x) => Math.min(Math.max(x, 0), 0.99999));
  };

  // Vectors.
  const add = (a, b, s = 1) => a.map((x, i) => x + s * b[i]);
  const dot = (a, b) => a.reduce((sum, x, i) => sum + x * b[i], 0);
  const cross = (a, b) => [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]];
  const length = (a) => Math.hypot(...a);
  const unit = (a) => { const l = length(a) || 1; return a.map((x) => x / l); };

  async function camera() {
    if (local.camera) return local.camera;
    const { groups: [group] } = await part("camera");
    const field = (name) => group.fields.find((one) => one.name === name);
    const value = (name) => field(name).value;
    const fixed = ["from", "at"].map(field).find((one) => !one.writable);
    local.camera = {
      from: value("from"), at: value("at"), up: value("up"), fov: value("fov"), focal: value("focal_length"), sensor: value("sensor_width"),
      fixed: fixed ? fixed.by_script ? `the script moves the camera${fixed.line ? ` (${fixed.file}:${fixed.line})` : ""}` : "the camera cannot be written to this scene" : null,
    };
    return local.camera;
  }

  // Half the height of the picture at distance 1.
  function halfHeight(camera) {
    const ratio = (shown.full ?? [shown.width, shown.height])[0] / (shown.full ?? [shown.width, shown.height])[1];
    return { ratio, half: camera.focal ? camera.sensor / (2 * camera.focal) / ratio : Math.tan(camera.fov * Math.PI / 360) };
  }

  function rayThrough(camera, [u, v]) {
    const forward = unit(add(camera.at, camera.from, -1));
    const right = unit(cross(forward, camera.up));
    const up = cross(right, forward);
    const { ratio, half } = halfHeight(camera);
    return add(add(forward, right, (2 * u - 1) * ratio * half), up, (1 - 2 * v) * half);
  }

  // The camera turned around what it looks at, by degrees, and brought nearer by a factor.
  function orbited(camera, yaw, pitch, factor = 1) {
    const up = unit(camera.up);
    const off = add(camera.from, camera.at, -1);
    const distance = length(off) * factor;
    const height = Math.asin(Math.min(Math.max(dot(unit(off), up), -1), 1));
    let flat = add(off, up, -dot(off, up));
    if (length(flat) < 1e-9) flat = Math.abs(up[0]) < 0.9 ? cross(up, [1, 0, 0]) : cross(up, [0, 1, 0]);
    flat = unit(flat);
    const side = cross(up, flat);
    const turn = yaw * Math.PI / 180;
    const around = add(flat.map((x) => x * Math.cos(turn)), side, Math.sin(turn));
    const raised = Math.min(Math.max(height + pitch * Math.PI / 180, -1.55), 1.55);
    return { ...camera, from: add(camera.at, add(around.map((x) => x * Math.cos(raised)), up, Math.sin(raised)), distance) };
  }

  const rounded = (vector) => vector.map((x) => Number(x.toFixed(4)));
  const vector = (list) => `(${rounded(list).map((x) => Number.isInteger(x) ? x.toFixed(1) : x).join(", ")})`;

  function tryCamera(next) {
    const field = (name) => ({ subject: { kind: "camera" }, field: name, value: rounded(next[name]) });
    tried(field("from"), field("at"));
  }

  let wheelTimer = null;
  async function moveCamera(change, isDone) {
    const now = local.moving ?? await camera();
    if (now.fixed) { say(now.fixed); return; }
    const before = await camera();
    local.moving = change(now);
    tryCamera(local.moving);
    clearTimeout(wheelTimer);
    const write = async () => {
      const next = local.moving;
      local.moving = null;
      local.camera = null;
      const list = ["from", "at"].filter((name) => vector(before[name]) !== vector(next[name])).map((name) => ({ path: `camera.${name}`, value: vector(next[name]) }));
      if (list.length) await written(list).catch((error) => say(error.message));
    };
    if (isDone) await write();
    else if (!local.drag) wheelTimer = setTimeout(write, 500);
  }

  async function dragStart(event) {
    const place = placeOf(event);
    local.drag = { x: event.clientX, y: event.clientY, place, moved: false, tool: local.tool };
    by("picture").setPointerCapture(event.pointerId);
    if (local.tool === "orbit") local.drag.camera = await camera().catch(() => null);
    if (local.tool === "move") {
      await select(place);
      const found = AnimPicture.at(place);
      if (!local.drag || !found?.entity || local.part?.kind !== "entity") return;
      if (!local.part.movable) { say(`${local.part.label} is placed by the script, a parent or a file that is not RON`); return; }
      Object.assign(local.drag, { camera: await camera(), start: found.position, part: local.part });
    }
  }

  async function dragMove(event) {
    const drag = local.drag;
    if (!drag) { point(placeOf(event)); return; }
    const [dx, dy] = [event.clientX - drag.x, event.clientY - drag.y];
    drag.moved ||= Math.hypot(dx, dy) > 3;
    if (!drag.moved || !drag.camera) return;
    if (drag.tool === "orbit") {
      if (event.shiftKey) {
        const { half } = halfHeight(drag.camera);
        const scale = 2 * half * length(add(drag.camera.at, drag.camera.from, -1)) / by("picture").clientHeight;
        const forward = unit(add(drag.camera.at, drag.camera.from, -1));
        const right = unit(cross(forward, drag.camera.up));
        const shift = add(right.map((x) => -x * dx * scale), cross(right, forward), dy * scale);
        await moveCamera(() => ({ ...drag.camera, from: add(drag.camera.from, shift), at: add(drag.camera.at, shift) }), false);
      } else await moveCamera(() => orbited(drag.camera, -dx * 0.4, dy * 0.4), false);
    } else if (drag.tool === "move" && drag.start) {
      const next = moved(drag, placeOf(event), event.altKey);
      if (!next) return;
      drag.translation = next;
      tried({ subject: { kind: "entity", index: drag.part.index }, component: "transform", field: "translation", value: next });
    }
  }

  // Along the floor, or with Alt (and where the floor is seen from its edge) along the picture.
  function moved(drag, place, isUpright) {
    const forward = unit(add(drag.camera.at, drag.camera.from, -1));
    const normal = isUpright || Math.abs(dot(forward, unit(drag.camera.up))) < 0.12 ? forward : unit(drag.camera.up);
    const ray = rayThrough(drag.camera, place);
    const t = dot(add(drag.start, drag.camera.from, -1), normal) / dot(ray, normal);
    if (!(t > 0) || t > 1e6) return null;
    return rounded(add(drag.part.translation, add(add(drag.camera.from, ray, t), drag.start, -1)));
  }

  async function dragEnd(event) {
    const drag = local.drag;
    local.drag = null;
    if (!drag) return;
    if (!drag.moved) { await select(drag.place); return; }
    if (drag.tool === "orbit" && local.moving) await moveCamera((now) => now, true);
    if (drag.translation) {
      await written([{ path: `${drag.part.path}.transform.translation`, value: vector(drag.translation) }]).catch((error) => say(error.message));
    }
  }

  async function focusHere() {
    const found = local.place && AnimPicture.at(local.place);
    if (!found?.entity) return;
    const { groups: [group] } = await part("camera");
    const field = group.fields.find((one) => one.name === "focus_distance");
    if (field?.by_script) {
      say(`the script sets the focus${field.line ? ` (${field.file}:${field.line})` : ""}; here it would be ${Number(found.depth.toFixed(4))}`);
      return;
    }
    await written([{ path: "camera.focus_distance", value: String(Number(found.depth.toFixed(4))) }]).catch((error) => say(error.message));
  }

  // The camera looks at the middle of what is selected, from where it fills most of the picture.
  async function frameIt() {
    const layers = AnimPicture.layers();
    if (!layers?.entity || !shown.selected) return;
    const [low, high] = [[Infinity, Infinity, Infinity], [-Infinity, -Infinity, -Infinity]];
    for (let i = 0; i < layers.entity.length; i++) {
      if (layers.entity[i] !== shown.selected) continue;
      for (let c = 0; c < 3; c++) {
        low[c] = Math.min(low[c], layers.position[3 * i + c]);
        high[c] = Math.max(high[c], layers.position[3 * i + c]);
      }
    }
    if (!(low[0] <= high[0])) return;
    await moveCamera((now) => {
      const at = low.map((x, c) => (x + high[c]) / 2);
      const { half, ratio } = halfHeight(now);
      const distance = Math.max(length(add(high, low, -1)) / 2, 1e-3) / (half * Math.min(1, ratio)) * 1.3;
      return { ...now, at, from: add(at, unit(add(now.from, now.at, -1)), distance) };
    }, true);
  }

  // --- Comparing ----------------------------------------------------------------------------------------------------

  let viewer = null;
  async function compare() {
    const others = [["before", "the picture before the last edit", state.current?.before], ["pinned", "the picture that was kept", local.pinned],
      ["frame", "another frame", state.count > 1], ["golden", "the golden frame", state.golden]];
    by("other").replaceChildren(...others.filter(([, , is]) => is).map(([id, label]) => element("option", { value: id }, label)));
    by("other-frame").value = local.frame > 1 ? local.frame - 1 : Math.min(2, state.count || 1);
    by("compare-box").showModal();
    viewer ??= AnimViewer.create(by("viewer"), { names: ["now", "other"] });
    await compared();
  }

  async function compared() {
    const which = by("other").value;
    by("other-frame-box").hidden = which !== "frame";
    const ids = { before: state.current?.before, pinned: local.pinned, frame: state.frames[Number(by("other-frame").value) - 1]?.[1] };
    const source = (path) => ({ png: AnimServer.address(path) });
    const other = which === "golden" ? source(`/golden/${local.frame}`) : ids[which] ? source(`/file/${ids[which]}`) : null;
    const layer = { name: "color", encoding: "srgb", bits: 8, a: source(`/file/${shown.id}`) };
    await viewer.show({ layers: [{ ...layer, b: other }] }).catch(() => viewer.show({ layers: [layer] }));
  }

  // --- Controls -----------------------------------------------------------------------------------------------------

  const TOOLS = [["select", "select", "click selects (key V)"], ["orbit", "orbit", "drag turns the camera, with Shift moves it, the wheel goes nearer (key B)"], ["move", "move", "drag moves an entity along the floor, with Alt along the picture (key M)"]];
  for (const [id, label, title] of TOOLS) {
    const button = element("button", { type: "button", role: "radio", title, id: `tool-${id}` }, label);
    button.addEventListener("click", () => tool(id));
    by("tools").append(button);
  }
  function tool(id) {
    local.tool = id;
    by("stage").dataset.tool = id;
    for (const [other] of TOOLS) by(`tool-${other}`).setAttribute("aria-checked", String(other === id));
  }
  tool("select");

  const picture = by("picture");
  picture.addEventListener("pointerdown", dragStart);
  picture.addEventListener("pointermove", dragMove);
  picture.addEventListener("pointerup", dragEnd);
  picture.addEventListener("wheel", (event) => {
    if (local.tool !== "orbit") return;
    event.preventDefault();
    moveCamera((now) => orbited(now, 0, 0, event.deltaY > 0 ? 1.08 : 1 / 1.08), false);
  }, { passive: false });
  picture.addEventListener("keydown", (event) => {
    const steps = { ArrowLeft: [-1, 0], ArrowRight: [1, 0], ArrowUp: [0, -1], ArrowDown: [0, 1] };
    const step = steps[event.key];
    if (event.key === "Enter" && local.place) select(local.place);
    else if (step && event.shiftKey) {
      const [u, v] = local.place ?? [0.5, 0.5];
      point([u + step[0] / shown.width, v + step[1] / shown.height].map((x) => Math.min(Math.max(x, 0), 0.99999)));
    } else if (step && event.altKey) moveCamera((now) => orbited(now, -5 * step[0], -5 * step[1]), false);
    else if ((event.key === "+" || event.key === "-") && local.tool === "orbit") moveCamera((now) => orbited(now, 0, 0, event.key === "-" ? 1.08 : 1 / 1.08), false);
    else return;
    event.preventDefault();
    event.stopPropagation();
  });

  by("layer").addEventListener("change", () => {
    shown.layer = by("layer").value;
    local.viewed = null;
    AnimPicture.repaint();
    fetchView();
  });
  by("exposure").addEventListener("input", () => {
    shown.exposure = by("exposure").valueAsNumber;
    by("stops").textContent = `${shown.exposure > 0 ? "+" : ""}${shown.exposure}`;
    AnimPicture.repaint();
  });
  by("scrub").addEventListener("input", () => { const frame = by("scrub").valueAsNumber; play(0); go(frame); });
  by("frame").addEventListener("change", () => go(by("frame").valueAsNumber));
  for (const [id, frame] of [["first", () => 1], ["back", () => local.frame - 1], ["ahead", () => local.frame + 1], ["last", () => state.count]]) {
    by(id).addEventListener("click", () => { play(0); go(frame()); });
  }
  by("play").addEventListener("click", () => play(local.playing ? 0 : 1));
  by("undo").addEventListener("click", undo);
  const render = () => AnimServer.post("/render", { wanted: !state.rendering }).catch((error) => say(error.message));
  by("render").addEventListener("click", render);
  by("show-camera").addEventListener("click", () => choose("camera"));
  by("show-render").addEventListener("click", () => choose("render"));
  by("focus-here").addEventListener("click", focusHere);
  by("frame-it").addEventListener("click", frameIt);
  by("compare").addEventListener("click", compare);
  by("other").addEventListener("change", compared);
  by("other-frame").addEventListener("change", compared);
  by("pin").addEventListener("click", () => { local.pinned = shown.id; by("pin").textContent = "kept"; });
  by("close-compare").addEventListener("click", () => by("compare-box").close());
  by("theme").addEventListener("click", theme);
  function theme() {
    const order = ["", "dark", "light"];
    const next = order[(order.indexOf(document.documentElement.dataset.theme ?? "") + 1) % 3];
    if (next) document.documentElement.dataset.theme = next;
    else delete document.documentElement.dataset.theme;
    strip();
  }

  const KEYS = [["\u2190 \u2192", "one frame back, ahead"], ["Home End", "first, last frame"], ["space", "play, pause"], ["J K L", "backwards, pause, forwards"],
    ["I O", "loop from, to this frame"], ["V B M", "select, orbit, move"], ["F", "frame the selection"], ["G", "focus here"], ["C", "compare"], ["R", "render"],
    ["Ctrl+Z", "take the last written edit back"], ["Shift+arrows, Enter", "on the picture: choose a pixel, select what is there"],
    ["Alt+arrows", "on the picture: turn the camera"], ["T", "dark, light"], ["?", "this list"]];
  by("help").append(element("h2", {}, "Keys"), element("table", {}, ...KEYS.map(([keys, what]) => element("tr", {}, element("td", {}, element("kbd", {}, keys)), element("td", {}, what)))),
    element("form", { method: "dialog" }, element("button", {}, "close")));
  by("keys").addEventListener("click", () => by("help").showModal());

  document.addEventListener("keydown", (event) => {
    if (event.target.matches?.("input:not([type=range]):not([type=checkbox]), select, textarea") || document.querySelector("dialog[open]")) return;
    if ((event.ctrlKey || event.metaKey) && event.key.toLowerCase() === "z") { event.preventDefault(); undo(); return; }
    if (event.ctrlKey || event.metaKey || event.altKey) return;
    const isSlider = event.target.matches?.("input[type=range]");
    const isButton = event.target.matches?.("button, summary, a, input[type=checkbox]");
    const actions = {
      j: () => play(-1), k: () => play(0), l: () => play(1), i: () => { by("from").value = local.frame; }, o: () => { by("to").value = local.frame; },
      v: () => tool("select"), b: () => tool("orbit"), m: () => tool("move"), f: frameIt, g: focusHere, c: compare, r: render, t: theme, "?": () => by("help").showModal(),
    };
    if (!isSlider) Object.assign(actions, { ArrowLeft: () => { play(0); go(local.frame - 1); }, ArrowRight: () => { play(0); go(local.frame + 1); }, Home: () => go(1), End: () => go(state.count) });
    if (!isButton) actions[" "] = () => play(local.playing ? 0 : 1);
    const action = actions[event.key.length === 1 ? event.key.toLowerCase() : event.key];
    if (!action) return;
    event.preventDefault();
    action();
  });
  new ResizeObserver(() => { AnimPicture.place(); strip(); }).observe(by("stage"));
  matchMedia("(prefers-color-scheme: dark)").addEventListener("change", strip);

  listen();
  prefetch();
  return { state: () => state, local, go, select, choose, compare, orbited, written };
})();
