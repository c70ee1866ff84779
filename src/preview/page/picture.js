// Asking the server: the token of the page's own address goes with everything.
const AnimServer = (() => {
  const token = new URLSearchParams(location.search).get("token") ?? "";
  const headers = { "x-anim-token": token };

  async function get(path, signal) {
    const answer = await fetch(path, { headers, signal });
    if (!answer.ok) throw Object.assign(new Error(await answer.text()), { status: answer.status });
    return answer;
  }

  async function post(path, message) {
    const answer = await fetch(path, { method: "POST", headers, body: JSON.stringify(message ?? {}) });
    if (!answer.ok) throw new Error(await answer.text());
    return answer.json();
  }

  const address = (path) => `${path}?token=${token}`;
  return { get, post, address };
})();

// What changes while somebody drags: only the last value counts, and the next one goes when the one before is seen.
function newestOnly(send, patience = 400) {
  let [waiting, busy, timer] = [null, false, null];
  function go() {
    if (busy || !waiting) return;
    const value = waiting;
    waiting = null;
    busy = true;
    timer = setTimeout(seen, patience);
    send(value).catch(seen);
  }
  function seen() {
    clearTimeout(timer);
    busy = false;
    go();
  }
  return { push(value) { waiting = value; go(); }, seen, drop() { waiting = null; } };
}

// The picture: pixels by number, other views of it, the outline of what is selected, and what is under the pointer.
const AnimPicture = (() => {
  const BYTES = 600 << 20;
  const by = (id) => document.getElementById(id);
  const cache = new Map();
  let bytes = 0;
  const shown = { id: 0, frame: 0, kind: "", width: 0, height: 0, cursor: null, selected: 0, layer: "color", exposure: 0 };
  let layers = null;
  let linear = null;

  async function load(id) {
    if (cache.has(id)) {
      const found = cache.get(id);
      cache.delete(id);
      cache.set(id, found);
      return found;
    }
    const buffer = await (await AnimServer.get(`/picture/${id}`)).arrayBuffer();
    const [width, height] = new Uint32Array(buffer, 0, 2);
    const rgb = new Uint8Array(buffer, 8);
    const image = new ImageData(width, height);
    const pixels = new Uint32Array(image.data.buffer);
    for (let i = 0, at = 0; i < pixels.length; i++, at += 3) {
      pixels[i] = 0xff000000 | rgb[at + 2] << 16 | rgb[at + 1] << 8 | rgb[at];
    }
    const made = { id, width, height, image };
    cache.set(id, made);
    bytes += image.data.length;
    for (const [old, picture] of cache) {
      if (bytes <= BYTES || old === id) break;
      cache.delete(old);
      bytes -= picture.image.data.length;
    }
    return made;
  }

  // Draws a picture; false if it is not the one that is wanted any more, or has given way on the server.
  let wanted = 0;
  async function show(id, frame, kind) {
    wanted = id;
    if (shown.id === id) {
      Object.assign(shown, { frame, kind });
      return true;
    }
    let picture;
    try {
      picture = await load(id);
    } catch {
      return false;
    }
    if (wanted !== id) return false;
    Object.assign(shown, { id, frame, kind, width: picture.width, height: picture.height });
    linear = null;
    paint(picture);
    return true;
  }

  function paint(picture) {
    const canvas = by("picture");
    scale(null);
    const view = shown.layer === "color" ? exposed(picture) : layerView();
    const image = view ?? picture.image;
    if (canvas.width !== image.width || canvas.height !== image.height) {
      canvas.width = image.width;
      canvas.height = image.height;
    }
    canvas.getContext("2d").putImageData(image, 0, 0);
    canvas.style.imageRendering = shown.kind === "exact" || shown.kind === "mixed" || shown.layer !== "color" ? "auto" : "pixelated";
    place();
  }

  function repaint() {
    const picture = cache.get(shown.id);
    if (picture) paint(picture);
  }

  // The canvas fills the stage as far as its sides allow.
  function place() {
    const stage = by("stage");
    const [w, h] = [stage.clientWidth, stage.clientHeight];
    const ratio = shown.full ? shown.full[0] / shown.full[1] : shown.width / shown.height || 16 / 9;
    const width = Math.min(w, h * ratio);
    for (const id of ["picture", "outline"]) {
      Object.assign(by(id).style, {
        width: `${width}px`, height: `${width / ratio}px`, left: `${(w - width) / 2}px`, top: `${(h - width / ratio) / 2}px`,
      });
    }
    outline();
  }

  function encoded(light) {
    const x = Math.min(Math.max(light, 0), 1);
    return 255 * (x <= 0.0031308 ? 12.92 * x : 1.055 * x ** (1 / 2.4) - 0.055);
  }

  // Another exposure of the linear light, without tracing anything.
  function exposed(picture) {
    if (!shown.exposure) return null;
    if (linear?.id !== picture.id) {
      fetchLinear(picture.id).then((found) => { if (found) repaint(); });
      return null;
    }
    const gain = 2 ** shown.exposure;
    const image = new ImageData(linear.width, linear.height);
    for (let i = 0, at = 0; i < image.data.length; i += 4, at += 3) {
      for (let c = 0; c < 3; c++) image.data[i + c] = encoded(linear.data[at + c] * gain);
      image.data[i + 3] = 255;
    }
    return image;
  }

  async function fetchLinear(id) {
    if (linear?.id === id) return linear;
    try {
      const buffer = await (await AnimServer.get(`/linear/${id}`)).arrayBuffer();
      const [width, height] = new Uint32Array(buffer, 0, 2);
      if (shown.id === id) linear = { id, width, height, data: new Float32Array(buffer, 8) };
    } catch { return null; }
    return linear;
  }

  // What the pixels show is asked for once for each picture, when somebody points at it.
  async function fetchLayers(key) {
    if (layers?.key === key) return layers;
    if (layers?.asked === key) return layers.promise;
    const promise = (async () => {
      const buffer = await (await AnimServer.get("/layers")).arrayBuffer();
      const [width, height] = new Uint32Array(buffer, 0, 2);
      const n = width * height;
      let at = 8;
      const take = (type, count) => { const part = new type(buffer, at, count); at += 4 * count; return part; };
      const made = {
        key, width, height,
        entity: take(Uint32Array, n), material: take(Uint32Array, n), depth: take(Float32Array, n),
        normal: take(Float32Array, 3 * n), position: take(Float32Array, 3 * n),
      };
      if (layers?.asked === key) layers = made;
      return made;
    })();
    layers = { asked: key, promise };
    promise.catch(() => { if (layers?.asked === key) layers = null; });
    return promise;
  }

  // How the picture was sampled is asked for when somebody wants to see it: it is traced for that.
  let noise = null;
  async function fetchNoise(key) {
    if (noise?.key === key) return noise;
    if (noise?.asked === key) return noise.promise;
    const promise = (async () => {
      const buffer = await (await AnimServer.get("/noise")).arrayBuffer();
      const [width, height] = new Uint32Array(buffer, 0, 2);
      const n = width * height;
      const made = { key, width, height, samples: new Uint32Array(buffer, 8, n), noise: new Float32Array(buffer, 8 + 4 * n, n) };
      if (noise?.asked === key) noise = made;
      return made;
    })();
    noise = { asked: key, promise };
    promise.catch(() => { if (noise?.asked === key) noise = null; });
    return promise;
  }

  // From dark blue over green to yellow, brighter all the way: also who does not see hues can tell.
  const HEAT = [[0.02, 0.02, 0.2], [0.1, 0.2, 0.5], [0.1, 0.45, 0.5], [0.35, 0.7, 0.35], [0.95, 0.9, 0.3]];
  function heat(t) {
    const at = Math.min(Math.max(t, 0), 1) * (HEAT.length - 1);
    const i = Math.min(Math.floor(at), HEAT.length - 2);
    return [0, 1, 2].map((c) => 255 * (HEAT[i][c] + (at - i) * (HEAT[i + 1][c] - HEAT[i][c])));
  }

  // Noise from a thousandth to half of the screen's white; samples from the fewest to the most.
  const NOISE = [0.001, 0.5];
  function noiseView() {
    if (!noise?.samples) return null;
    const { width, height } = noise;
    const image = new ImageData(width, height);
    let [few, many] = [Infinity, 0];
    for (const count of noise.samples) {
      few = Math.min(few, count);
      many = Math.max(many, count);
    }
    const of = shown.layer === "samples" ? (i) => many > few ? (noise.samples[i] - few) / (many - few) : 0.5
      : (i) => Math.log(noise.noise[i] / NOISE[0]) / Math.log(NOISE[1] / NOISE[0]);
    for (let i = 0; i < width * height; i++) image.data.set([...heat(of(i)), 255], 4 * i);
    scale(shown.layer === "samples" ? [`${few} samples`, many] : [`error ${NOISE[0]}`, NOISE[1]]);
    return image;
  }

  function scale(ends) {
    if (!ends) { by("scale").replaceChildren(); return; }
    const canvas = Object.assign(document.createElement("canvas"), { width: 64, height: 1 });
    const image = new ImageData(64, 1);
    for (let i = 0; i < 64; i++) image.data.set([...heat(i / 63), 255], 4 * i);
    canvas.getContext("2d").putImageData(image, 0, 0);
    by("scale").replaceChildren(String(ends[0]), canvas, String(ends[1]));
  }

  function layerView() {
    if (shown.layer === "samples" || shown.layer === "noise") return noiseView();
    if (!layers?.entity) return null;
    const { width, height } = layers;
    const image = new ImageData(width, height);
    let [near, far] = [Infinity, 0];
    for (const depth of layers.depth) {
      if (depth >= 1e9) continue;
      near = Math.min(near, depth);
      far = Math.max(far, depth);
    }
    for (let i = 0; i < width * height; i++) {
      let color = [0, 0, 0];
      if (shown.layer === "depth" && layers.depth[i] < 1e9) {
        // Nearness, so that what is close differs most.
        const level = 255 * (1 / layers.depth[i] - 1 / far) / (1 / near - 1 / far || 1);
        color = [level, level, level];
      } else if (shown.layer === "normal") {
        color = [0, 1, 2].map((c) => layers.entity[i] ? 127.5 + 127.5 * layers.normal[3 * i + c] : 0);
      } else if (shown.layer === "entity" || shown.layer === "material") {
        const number = layers[shown.layer][i];
        const hash = Math.imul(number, 0x9e3779b1);
        color = number ? [hash >>> 24, hash >>> 16 & 255, hash >>> 8 & 255].map((x) => 60 + x * 0.75) : [0, 0, 0];
      }
      image.data.set([...color, 255], 4 * i);
    }
    return image;
  }

  // The rim of what is selected, and the pixel that was chosen.
  function outline() {
    const canvas = by("outline");
    const context = canvas.getContext("2d");
    if (!layers?.entity) {
      context.clearRect(0, 0, canvas.width, canvas.height);
      return;
    }
    const { width, height, entity } = layers;
    Object.assign(canvas, { width, height });
    if (shown.selected) {
      const image = context.createImageData(width, height);
      const is = (x, y) => x >= 0 && y >= 0 && x < width && y < height && entity[y * width + x] === shown.selected;
      for (let y = 0; y < height; y++) {
        for (let x = 0; x < width; x++) {
          const here = is(x, y);
          const rim = here !== is(x + 1, y) || here !== is(x, y + 1) || here !== is(x - 1, y) || here !== is(x, y - 1);
          if (rim) image.data.set(here ? [255, 170, 40, 255] : [0, 0, 0, 255], 4 * (y * width + x));
        }
      }
      context.putImageData(image, 0, 0);
    }
    if (shown.cursor) {
      const [x, y] = shown.cursor.map((t, i) => Math.floor(t * [width, height][i]) + 0.5);
      const size = Math.max(1, width / 160);
      for (const [color, line] of [["#000", size * 0.75], ["#fff", size * 0.25]]) {
        context.strokeStyle = color;
        context.lineWidth = line;
        context.strokeRect(x - size, y - size, 2 * size, 2 * size);
      }
    }
  }

  // What is at a place, 0 to 1 across and down.
  function at([u, v]) {
    if (!layers?.entity) return null;
    const { width, height } = layers;
    const i = Math.min(Math.floor(v * height), height - 1) * width + Math.min(Math.floor(u * width), width - 1);
    const three = (column) => [...column.slice(3 * i, 3 * i + 3)];
    return {
      entity: layers.entity[i], material: layers.material[i], depth: layers.depth[i], normal: three(layers.normal),
      position: three(layers.position),
    };
  }

  function lightAt([u, v]) {
    if (linear?.id !== shown.id || !linear) return null;
    const { width, height, data } = linear;
    const i = Math.min(Math.floor(v * height), height - 1) * width + Math.min(Math.floor(u * width), width - 1);
    return [...data.slice(3 * i, 3 * i + 3)];
  }

  // How a place was sampled, if that is known.
  function sampledAt([u, v]) {
    if (!noise?.samples || (shown.layer !== "samples" && shown.layer !== "noise")) return null;
    const { width, height } = noise;
    const i = Math.min(Math.floor(v * height), height - 1) * width + Math.min(Math.floor(u * width), width - 1);
    return [noise.samples[i], noise.noise[i]];
  }

  return { shown, show, load, repaint, place, outline, at, lightAt, sampledAt, fetchLayers, fetchLinear, fetchNoise, has: (id) => cache.has(id), layers: () => layers };
})();
