// A viewer of pictures: one, or two that are compared; blink, wipe, side by side, differences, zoom down to the values
// of pixels. It needs nothing but a page, and nothing from elsewhere.
//
//     const viewer = AnimViewer.create(element, { names: ["golden", "now"], palette: "000004..." });
//     await viewer.show({ layers: [{ name: "color", encoding: "srgb", bits: 8, a: source, b: source, flip: source }] });
//
// A source is { png: URL } (8 bits a channel) or { floats: base64 of deflated little-endian f32, plane by plane,
// width, height, planes }. `b` and `flip` may be missing; `flip` is a grey picture of FLIP errors from 0 to 255.
"use strict";
const AnimViewer = (() => {
  const MODES = [
    { id: "a", key: "1", title: "first picture" },
    { id: "b", key: "2", title: "second picture" },
    { id: "blink", key: "3", label: "blink", title: "the two in turns" },
    { id: "wipe", key: "4", label: "wipe", title: "the two, left and right of a line" },
    { id: "side", key: "5", label: "side by side", title: "both, moved and zoomed together" },
    { id: "difference", key: "6", label: "difference", title: "how far each channel is apart, made brighter" },
    { id: "flip", key: "7", label: "FLIP", title: "how different each pixel looks, from 0 (black) to 1 (yellow)" },
  ];
  // Slow enough for people who must not see flashes: less than three a second.
  const BLINK = 450;
  const LARGEST = 96;
  const VALUES_FROM = 40;

  async function inflate(base64) {
    const bytes = Uint8Array.from(atob(base64), (c) => c.charCodeAt(0));
    const stream = new Blob([bytes]).stream().pipeThrough(new DecompressionStream("deflate"));
    return new Float32Array(await new Response(stream).arrayBuffer());
  }

  // A picture with its values: `value(x, y, c)` as stored, `planes` of them, and `levels` that make 1.
  async function load(source, encoding, bits) {
    if (!source) return null;
    if (source.floats !== undefined) {
      const { width, height, planes } = source;
      const data = await inflate(source.floats);
      const value = (x, y, c) => data[(Math.min(c, planes - 1) * height + y) * width + x];
      return { width, height, planes, value, encoding, levels: encoding === "srgb" ? 2 ** bits - 1 : 1 };
    }
    const image = new Image();
    image.src = source.png;
    await image.decode();
    const { naturalWidth: width, naturalHeight: height } = image;
    const canvas = surface(width, height);
    canvas.context.drawImage(image, 0, 0);
    const { data } = canvas.context.getImageData(0, 0, width, height);
    const value = (x, y, c) => data[(y * width + x) * 4 + c] / 255;
    return { width, height, planes: 3, value, encoding, levels: 255, canvas };
  }

  function surface(width, height) {
    const canvas = document.createElement("canvas");
    canvas.width = width;
    canvas.height = height;
    canvas.context = canvas.getContext("2d", { willReadFrequently: true });
    return canvas;
  }

  // Paints a picture whose colours `color(x, y)` gives in 0 to 255.
  function paint(width, height, color) {
    const canvas = surface(width, height);
    const image = canvas.context.createImageData(width, height);
    for (let y = 0, i = 0; y < height; y++) {
      for (let x = 0; x < width; x++, i += 4) {
        const rgb = color(x, y);
        image.data[i] = rgb[0];
        image.data[i + 1] = rgb[1];
        image.data[i + 2] = rgb[2];
        image.data[i + 3] = 255;
      }
    }
    canvas.context.putImageData(image, 0, 0);
    return canvas;
  }

  function encoded(light) {
    if (!(light > 0)) return 0;
    const x = Math.min(light, 1);
    return 255 * (x <= 0.0031308 ? 12.92 * x : 1.055 * x ** (1 / 2.4) - 0.055);
  }

  function element(tag, properties, ...children) {
    const made = document.createElement(tag);
    for (const [name, value] of Object.entries(properties ?? {})) {
      if (name in made && name !== "list") made[name] = value;
      else made.setAttribute(name, value);
    }
    made.append(...children);
    return made;
  }

  function create(host, options) {
    const names = options.names ?? ["picture", "other"];
    const palette = options.palette ?? "";
    const magma = (level) => [0, 2, 4].map((i) => parseInt(palette.substr(level * 6 + i, 2), 16) || 0);
    const state = {
      mode: "a", layer: 0, a: null, b: null, flip: null, blinkB: false, wipe: 0.5, gain: 8, exposure: 0,
      scale: 1, x: 0, y: 0, fitted: true, cursor: null, shown: {},
    };
    let layers = [];
    let generation = 0;
    let timer = null;

    const canvas = element("canvas", {
      className: "viewer-canvas", tabIndex: 0, role: "img",
      "aria-label": "Picture. Arrow keys choose a pixel, plus and minus zoom, 0 fits, 1 to 7 choose what is shown.",
    });
    const readout = element("output", { className: "viewer-readout", "aria-live": "polite" });
    const group = element("div", { className: "viewer-modes", role: "radiogroup", "aria-label": "What is shown" });
    const buttons = new Map();
    for (const mode of MODES) {
      const label = mode.label ?? names[mode.id === "a" ? 0 : 1];
      const button = element("button", { type: "button", role: "radio", title: `${mode.title} (key ${mode.key})` }, label);
      button.addEventListener("click", () => set(mode.id));
      buttons.set(mode.id, button);
      group.append(button);
    }
    const layerChoice = element("select", { "aria-label": "Channels" });
    const gain = slider("amplify", 0, 8, 1, 3, (v) => `x ${2 ** v}`, (v) => { state.gain = 2 ** v; state.shown.difference = null; });
    const exposure = slider("exposure", -10, 10, 0.5, 0, (v) => `${v > 0 ? "+" : ""}${v} stops`, (v) => { state.exposure = v; state.shown = {}; });
    const wipe = slider("line", 0, 1, 0.01, 0.5, (v) => `${Math.round(v * 100)} %`, (v) => { state.wipe = v; });
    const zoomOut = element("button", { type: "button", title: "smaller (key -)", "aria-label": "Zoom out" }, "\u2212");
    const zoomIn = element("button", { type: "button", title: "larger (key +)", "aria-label": "Zoom in" }, "+");
    const fitButton = element("button", { type: "button", title: "the whole picture (key 0)" }, "fit");
    const scaleLabel = element("span", { className: "viewer-scale" });
    const tools = element("div", { className: "viewer-tools" }, layerChoice, wipe.box, gain.box, exposure.box,
      element("span", { className: "viewer-zoom" }, zoomOut, scaleLabel, zoomIn, fitButton));
    const stage = element("div", { className: "viewer-stage" }, canvas);
    host.classList.add("viewer");
    host.replaceChildren(group, tools, stage, readout);

    function slider(label, min, max, step, value, say, change) {
      const input = element("input", { type: "range", min, max, step });
      input.value = value;
      const output = element("output", {}, say(value));
      input.addEventListener("input", () => {
        output.textContent = say(Number(input.value));
        input.setAttribute("aria-valuetext", output.textContent);
        change(Number(input.value));
        draw();
      });
      const set = (value) => { input.value = value; output.textContent = say(value); };
      return { box: element("label", { className: "viewer-slider" }, label, input, output), input, set };
    }

    async function show(content) {
      const mine = ++generation;
      layers = content.layers ?? [];
      layerChoice.replaceChildren(...layers.map((layer, i) => element("option", { value: i }, layer.name || "color")));
      layerChoice.hidden = layers.length < 2;
      await choose(0, mine);
    }

    async function choose(index, mine = ++generation) {
      const layer = layers[index];
      const [a, b, flip] = layer
        ? await Promise.all([load(layer.a, layer.encoding, layer.bits), load(layer.b, layer.encoding, layer.bits), load(layer.flip, "srgb", 8)])
        : [null, null, null];
      // Somebody has chosen another picture meanwhile.
      if (mine !== generation) return;
      const same = state.a && a && state.a.width === a.width && state.a.height === a.height;
      Object.assign(state, { layer: index, a: a ?? b, b: a ? b : null, only: a ? null : b, flip, shown: {} });
      exposure.box.hidden = layer?.encoding !== "linear";
      for (const [id, button] of buttons) button.hidden = !has(id);
      buttons.get("a").textContent = state.only ? names[1] : names[0];
      if (!has(state.mode)) state.mode = "a";
      state.fitted ||= !same;
      state.cursor = null;
      read();
      set(state.mode);
    }

    const has = (mode) => mode === "a" ? !!state.a : mode === "flip" ? !!state.flip : !!state.b;

    function set(mode) {
      if (!has(mode)) mode = "a";
      state.mode = mode;
      clearInterval(timer);
      timer = null;
      if (mode === "blink") {
        timer = setInterval(() => { state.blinkB = !state.blinkB; draw(); }, BLINK);
      }
      for (const [id, button] of buttons) {
        button.setAttribute("aria-checked", String(id === mode));
        button.tabIndex = id === mode ? 0 : -1;
      }
      wipe.box.hidden = mode !== "wipe";
      gain.box.hidden = mode !== "difference";
      if (state.fitted) fit();
      else draw();
      options.onMode?.(mode);
    }

    // What a picture looks like on the screen.
    function shown(which) {
      const picture = state[which];
      if (!picture) return null;
      if (which !== "flip" && picture.canvas) return picture.canvas;
      if (!state.shown[which]) {
        const { width, height, value } = picture;
        const light = 2 ** state.exposure;
        const level = picture.encoding === "srgb" ? (x) => 255 * x : (x) => encoded(x * light);
        state.shown[which] = paint(width, height, which === "flip"
          ? (x, y) => magma(Math.round(255 * value(x, y, 0)))
          : (x, y) => [0, 1, 2].map((c) => level(value(x, y, c))));
      }
      return state.shown[which];
    }

    function difference() {
      if (!state.shown.difference) {
        const { a, b } = state;
        const light = a.encoding === "linear" ? 2 ** state.exposure : 1;
        const level = a.encoding === "linear" ? (x) => encoded(x * light * state.gain) : (x) => 255 * x * state.gain;
        state.shown.difference = paint(Math.min(a.width, b.width), Math.min(a.height, b.height),
          (x, y) => [0, 1, 2].map((c) => level(apart(a.value(x, y, c), b.value(x, y, c)))));
      }
      return state.shown.difference;
    }

    function apart(a, b) {
      if (a === b || (Number.isNaN(a) && Number.isNaN(b))) return 0;
      const distance = Math.abs(a - b);
      return Number.isNaN(distance) ? Infinity : distance;
    }

    // The panes of the canvas: pictures, each with its left end and width.
    function panes(width) {
      const { mode } = state;
      if (mode === "side") {
        const half = Math.floor(width / 2);
        return [{ which: "a", left: 0, width: half - 1 }, { which: "b", left: half + 1, width: width - half - 1 }];
      }
      if (mode === "wipe") {
        const at = Math.round(state.wipe * width);
        return [{ which: "a", left: 0, width: at, from: 0 }, { which: "b", left: at, width: width - at, from: 0 }];
      }
      return [{ which: mode === "blink" ? (state.blinkB ? "b" : "a") : mode, left: 0, width }];
    }

    function draw() {
      const { clientWidth: width, clientHeight: height } = canvas;
      const density = window.devicePixelRatio || 1;
      canvas.width = Math.round(width * density);
      canvas.height = Math.round(height * density);
      if (!width || !state.a) return;
      const context = canvas.getContext("2d");
      context.scale(density, density);
      for (const pane of panes(width)) {
        const image = pane.which === "difference" ? difference() : shown(pane.which);
        if (!image) continue;
        context.save();
        context.beginPath();
        context.rect(pane.left, 0, pane.width, height);
        context.clip();
        context.translate((pane.from ?? pane.left) + state.x, state.y);
        context.imageSmoothingEnabled = state.scale * density < 1;
        context.drawImage(image, 0, 0, image.width * state.scale, image.height * state.scale);
        if (state.scale >= VALUES_FROM) drawValues(context, pane, image);
        drawCursor(context);
        context.restore();
        if (pane.which !== "a" && (state.mode === "wipe" || state.mode === "side")) {
          context.fillStyle = getComputedStyle(host).getPropertyValue("--viewer-accent") || "#888";
          context.fillRect(pane.left - 1, 0, 2, height);
        }
        if (state.mode === "blink") label(context, names[pane.which === "b" ? 1 : 0], 8, 8);
      }
      if (state.mode === "wipe" || state.mode === "side") {
        const [, right] = panes(width);
        label(context, names[0], 8, 8);
        label(context, names[1], Math.min(right.left + 8, width - 60), 8);
      }
      scaleLabel.textContent = `${state.scale >= 1 ? Math.round(state.scale * 100) : (state.scale * 100).toFixed(1)} %`;
    }

    function label(context, text, x, y) {
      context.font = "12px system-ui, sans-serif";
      context.fillStyle = "rgba(0,0,0,.65)";
      context.fillRect(x, y, context.measureText(text).width + 10, 20);
      context.fillStyle = "#fff";
      context.fillText(text, x + 5, y + 14);
    }

    // The numbers of every pixel that can be seen.
    function drawValues(context, pane, image) {
      const { scale } = state;
      const first = (offset) => Math.max(0, Math.floor(-offset / scale));
      const last = (offset, room, most) => Math.min(most - 1, Math.floor((room - offset) / scale));
      const base = pane.from === undefined ? 0 : pane.left;
      context.font = `${Math.min(13, scale / 5)}px ui-monospace, monospace`;
      context.textAlign = "center";
      for (let y = first(state.y); y <= last(state.y, canvas.clientHeight, image.height); y++) {
        for (let x = first(state.x - base); x <= last(state.x, base + pane.width, image.width); x++) {
          const [r, g, b] = image.context.getImageData(x, y, 1, 1).data;
          context.fillStyle = 0.3 * r + 0.6 * g + 0.1 * b > 120 ? "#000" : "#fff";
          valuesOf(pane.which, x, y).forEach((text, i, all) => {
            context.fillText(text, (x + 0.5) * scale, (y + 0.5 + (i - (all.length - 1) / 2) * 0.26) * scale + scale * 0.06);
          });
        }
      }
      context.textAlign = "start";
    }

    function drawCursor(context) {
      if (!state.cursor) return;
      const { scale, cursor: [x, y] } = state;
      context.lineWidth = 1;
      for (const [grow, color] of [[1.5, "#000"], [0.5, "#fff"]]) {
        context.strokeStyle = color;
        context.strokeRect(x * scale - grow, y * scale - grow, scale + 2 * grow, scale + 2 * grow);
      }
    }

    function number(picture, value) {
      if (picture.encoding === "srgb") return String(Math.round(value * picture.levels));
      return Number.isFinite(value) ? String(Number(value.toPrecision(5))) : String(value);
    }

    function channels(picture, x, y) {
      return Array.from({ length: picture.planes }, (_, c) => picture.value(x, y, c));
    }

    function valuesOf(which, x, y) {
      const inside = (p) => p && x < p.width && y < p.height;
      if (which === "flip") return inside(state.flip) ? [state.flip.value(x, y, 0).toFixed(3)] : [];
      if (which !== "difference") return inside(state[which]) ? channels(state[which], x, y).map((v) => number(state[which], v)) : [];
      if (!inside(state.a) || !inside(state.b)) return [];
      const other = channels(state.b, x, y);
      return channels(state.a, x, y).map((v, c) => number(state.a, apart(v, other[c])));
    }

    function read() {
      if (!state.cursor) { readout.textContent = "\u00a0"; return; }
      const [x, y] = state.cursor;
      const part = (name, which) => {
        const values = valuesOf(which, x, y);
        return values.length ? `${name} ${values.join(" ")}` : "";
      };
      const parts = [`pixel ${x}, ${y}`, part(state.only ? names[1] : names[0], "a")];
      if (state.b) parts.push(part(names[1], "b"), part("difference", "difference"), part("FLIP", "flip"));
      readout.textContent = parts.filter(Boolean).join("   ");
    }

    function place(x, y) {
      const { width, height } = state.b && state.mode !== "a" ? extent() : state.a;
      state.cursor = x < 0 || y < 0 || x >= width || y >= height ? null : [x, y];
      read();
      draw();
    }

    function extent() {
      const { a, b } = state;
      return { width: Math.max(a.width, b?.width ?? 0), height: Math.max(a.height, b?.height ?? 0) };
    }

    function fit() {
      if (!state.a) return;
      const { width, height } = extent();
      const across = state.mode === "side" ? panes(canvas.clientWidth)[0].width : canvas.clientWidth;
      const scale = Math.min(across / width, canvas.clientHeight / height);
      // Whole steps keep pixels alike.
      state.scale = scale >= 1 ? Math.min(Math.floor(scale), LARGEST) : scale || 1;
      state.x = Math.round((across - width * state.scale) / 2);
      state.y = Math.round((canvas.clientHeight - height * state.scale) / 2);
      state.fitted = true;
      draw();
    }

    // The next scale, up or down; the point (x, y) of the canvas stays where it is.
    function zoom(up, x, y) {
      const { scale } = state;
      const steps = [1 / 16, 1 / 8, 1 / 4, 1 / 2, 1, 2, 3, 4, 6, 8, 12, 16, 24, 32, 48, 64, LARGEST];
      const next = up ? steps.find((s) => s > scale * 1.001) : steps.findLast((s) => s < scale * 0.999);
      if (!next || !state.a) return;
      state.x = Math.round(x - (x - state.x) * next / scale);
      state.y = Math.round(y - (y - state.y) * next / scale);
      state.scale = next;
      state.fitted = false;
      draw();
    }

    function center() {
      const [x, y] = state.cursor ?? [];
      const across = state.mode === "side" ? panes(canvas.clientWidth)[0].width : canvas.clientWidth;
      if (x === undefined) return [across / 2, canvas.clientHeight / 2];
      return [state.x + (x + 0.5) * state.scale, state.y + (y + 0.5) * state.scale];
    }

    function pixelAt(event) {
      const box = canvas.getBoundingClientRect();
      let x = event.clientX - box.left;
      const [, right] = panes(canvas.clientWidth);
      if (state.mode === "side" && x >= right.left) x -= right.left;
      return [Math.floor((x - state.x) / state.scale), Math.floor((event.clientY - box.top - state.y) / state.scale)];
    }

    let drag = null;
    canvas.addEventListener("pointerdown", (event) => {
      const atLine = state.mode === "wipe" && Math.abs(event.offsetX - state.wipe * canvas.clientWidth) < 12;
      drag = { x: event.clientX, y: event.clientY, atLine };
      canvas.setPointerCapture(event.pointerId);
    });
    canvas.addEventListener("pointermove", (event) => {
      if (drag?.atLine) {
        state.wipe = Math.min(1, Math.max(0, event.offsetX / canvas.clientWidth));
        wipe.set(state.wipe);
      } else if (drag) {
        state.x += event.clientX - drag.x;
        state.y += event.clientY - drag.y;
        Object.assign(drag, { x: event.clientX, y: event.clientY });
        state.fitted = false;
      }
      place(...pixelAt(event));
    });
    canvas.addEventListener("pointerup", () => { drag = null; });
    canvas.addEventListener("pointerleave", () => { if (!drag && document.activeElement !== canvas) place(-1, -1); });
    canvas.addEventListener("wheel", (event) => {
      event.preventDefault();
      const [, right] = panes(canvas.clientWidth);
      const x = state.mode === "side" && event.offsetX >= right.left ? event.offsetX - right.left : event.offsetX;
      zoom(event.deltaY < 0, x, event.offsetY);
    }, { passive: false });
    canvas.addEventListener("keydown", (event) => {
      const step = { ArrowLeft: [-1, 0], ArrowRight: [1, 0], ArrowUp: [0, -1], ArrowDown: [0, 1] }[event.key];
      if (!step || event.ctrlKey || event.metaKey || event.altKey || !state.a) return;
      event.preventDefault();
      event.stopPropagation();
      const { width, height } = extent();
      const by = event.shiftKey ? 10 : 1;
      const [x, y] = state.cursor ?? [Math.floor(width / 2) - step[0], Math.floor(height / 2) - step[1]];
      place(Math.min(width - 1, Math.max(0, x + by * step[0])), Math.min(height - 1, Math.max(0, y + by * step[1])));
      follow();
    });
    group.addEventListener("keydown", (event) => {
      const turn = { ArrowLeft: -1, ArrowRight: 1 }[event.key];
      if (!turn) return;
      event.preventDefault();
      event.stopPropagation();
      const there = MODES.filter((mode) => has(mode.id));
      const at = there.findIndex((mode) => mode.id === state.mode);
      const next = there[(at + turn + there.length) % there.length].id;
      set(next);
      buttons.get(next).focus();
    });

    // Moves the picture so that the chosen pixel is in sight.
    function follow() {
      const [x, y] = center();
      const room = state.mode === "side" ? canvas.clientWidth / 2 : canvas.clientWidth;
      const back = (at, most) => (at < 20 ? 20 - at : at > most - 20 ? most - 20 - at : 0);
      state.x += back(x, room);
      state.y += back(y, canvas.clientHeight);
      draw();
    }

    // Keys of the whole page; gives whether one was meant for the viewer.
    function key(name) {
      const mode = MODES.find((mode) => mode.key === name);
      if (mode) { if (has(mode.id)) set(mode.id); return true; }
      if (name === "+" || name === "=") { zoom(true, ...center()); return true; }
      if (name === "-") { zoom(false, ...center()); return true; }
      if (name === "0") { fit(); return true; }
      if (name === " " && state.b) { set(state.mode === "b" ? "a" : "b"); return true; }
      return false;
    }

    zoomIn.addEventListener("click", () => zoom(true, ...center()));
    zoomOut.addEventListener("click", () => zoom(false, ...center()));
    fitButton.addEventListener("click", fit);
    layerChoice.addEventListener("change", () => choose(Number(layerChoice.value)));
    new ResizeObserver(() => (state.fitted ? fit() : draw())).observe(canvas);

    return { show, set, key, fit, zoom, place, mode: () => state.mode, state };
  }

  return { create, MODES };
})();
