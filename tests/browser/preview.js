// Looks at the page of `anim preview` as a person would. `tests/browser/preview` puts this into the page, edits files
// meanwhile, and asks for one check after the other; each answers "ok" or throws what is wrong.
window.previewChecks = (() => {
  const by = (id) => document.getElementById(id);
  const wait = (ms) => new Promise((done) => setTimeout(done, ms));
  const { shown } = AnimPicture;
  let remembered = null;

  function check(what, is) {
    if (!is) throw new Error(what);
  }

  async function until(what, is, seconds = 40) {
    for (let i = 0; i < seconds * 25; i++) {
      if (await is()) return "ok";
      await wait(40);
    }
    throw new Error(`${what}: ${JSON.stringify({ status: by("status").textContent, current: animPreview.state().current, shown: shown.kind, readout: by("readout").textContent })}`);
  }

  const isExact = () => shown.kind === "exact" && by("status").textContent.startsWith("exact");

  function pixel([u, v]) {
    const canvas = by("picture");
    const { data } = canvas.getContext("2d").getImageData(Math.floor(u * canvas.width), Math.floor(v * canvas.height), 1, 1);
    return [...data.slice(0, 3)].join();
  }

  const all = () => { const c = by("picture"); return c.toDataURL(); };

  async function started() {
    await until("no exact picture", isExact);
    check("the timeline is hidden", !by("timeline").hidden && by("scrub").max === "6");
    await until("the script's words are not in the console", () => by("console").textContent.includes("the cube is at"));
    return until("not all frames are in memory", () => animPreview.state().frames.every((row) => row[1]));
  }

  async function remember() {
    await until("no exact picture", isExact);
    remembered = { picture: all(), revision: animPreview.state().revision };
    return "ok";
  }

  async function changed() {
    await until("the edit is not seen", () => animPreview.state().revision !== remembered.revision);
    await until("no exact picture", isExact);
    return until("the picture is the same", () => all() !== remembered.picture);
  }

  // What a lamp gives is known after a while; then its colour shows before anything is traced.
  const kinds = new Set();
  const show = AnimPicture.show;
  AnimPicture.show = (id, frame, kind) => { kinds.add(kind); return show(id, frame, kind); };
  async function relightable() {
    await remember();
    await until("it is not found out what the lamp gives", () => animPreview.state().can_relight);
    kinds.clear();
    return "ok";
  }
  async function relit() {
    await changed();
    check(`no picture was mixed, only ${[...kinds]}`, kinds.has("mixed"));
    return "ok";
  }

  // How the picture was sampled, in false colours with a scale and numbers.
  async function sampled() {
    const plain = all();
    const layer = by("layer");
    for (const view of ["samples", "noise", "depth"]) {
      const before = all();
      layer.value = view;
      layer.dispatchEvent(new Event("change"));
      await until(`${view} are not shown`, () => all() !== before);
      check(`the scale of ${view}`, (view === "depth") === (by("scale").textContent === ""));
      if (view === "samples") check(`not 4 samples: ${by("scale").textContent}`, by("scale").textContent.startsWith("4 samples"));
    }
    layer.value = "color";
    layer.dispatchEvent(new Event("change"));
    return until("colours do not come back", () => all() === plain);
  }

  const mistaken = (place) => until("no mistake is shown", () => !by("overlay").hidden && by("overlay").textContent.includes(place) && by("overlay").textContent.includes("did you mean"));
  const mended = async () => { await until("the mistake stays", () => by("overlay").hidden); return until("no exact picture", isExact); };

  async function slid() {
    await remember();
    const slider = by("parameters").querySelector("input[type=range]");
    check("the parameter has no slider", slider && slider.max === "2" && by("parameters").textContent.includes("Lift of the cube"));
    slider.value = 1;
    slider.dispatchEvent(new Event("input"));
    await until("dragging shows nothing", () => all() !== remembered.picture);
    slider.dispatchEvent(new Event("change"));
    await changed();
    by("parameters").querySelector("button").click();
    return until("the default does not come back", () => isExact() && all() === remembered.picture);
  }

  async function scrubbed() {
    await until("not all frames are in memory", () => animPreview.state().frames.every((row) => row[1]));
    const seen = new Set();
    for (let frame = 1; frame <= 6; frame++) {
      by("scrub").value = frame;
      by("scrub").dispatchEvent(new Event("input"));
      await until(`frame ${frame} is not shown`, () => shown.frame === frame && shown.kind === "exact");
      seen.add(all());
    }
    check(`of six frames ${seen.size} differ`, seen.size === 6);
    document.body.dispatchEvent(new KeyboardEvent("keydown", { key: "Home", bubbles: true }));
    await until("Home does not lead to the first frame", () => shown.frame === 1);
    by("play").click();
    const frames = new Set();
    for (let i = 0; i < 40; i++) { frames.add(shown.frame); await wait(30); }
    by("play").click();
    check(`while playing ${frames.size} frames are seen`, frames.size >= 4);
    animPreview.go(1);
    return until("no exact picture", () => isExact() && shown.frame === 1);
  }

  async function selected(name) {
    await until(`${name} is not selected`, () => by("selection").textContent.includes(`entity \`${name}\``));
    check("the line is missing", /stage\.ron:10/.test(by("selection").textContent));
    check("no outline", shown.selected > 0);
    return until("the readout lacks depth and place", () => /depth .* at .* normal/.test(by("readout").textContent) && by("readout").textContent.includes(name));
  }

  const tool = (id) => { by(`tool-${id}`).click(); check("the tool is not chosen", by(`tool-${id}`).getAttribute("aria-checked") === "true"); return "ok"; };

  async function undone() {
    const { revision } = animPreview.state();
    check("undo is not offered", !by("undo").disabled);
    by("undo").click();
    await until("nothing is taken back", () => animPreview.state().revision !== revision);
    return until("no exact picture", isExact);
  }

  async function edited() {
    await remember();
    await animPreview.choose("material", 0);
    const field = [...by("selection").querySelectorAll("input[type=number]")].find((input) => input.getAttribute("aria-label").endsWith("specular"));
    check("specular has no field", field && field.value === "0.4");
    field.value = 0.9;
    field.dispatchEvent(new Event("input"));
    field.dispatchEvent(new Event("change"));
    return changed();
  }

  async function compared() {
    by("compare").click();
    await until("the viewer shows nothing", () => document.querySelector(".viewer-canvas")?.width > 10 && !document.querySelectorAll(".viewer-modes button")[1].hidden);
    by("pin").click();
    return "ok";
  }

  const closed = () => { by("close-compare").click(); return "ok"; };

  async function rendered() {
    await until("no exact picture", isExact);
    by("render").click();
    return until("frames are not written", () => animPreview.state().frames.every((row) => row[0] === "done"));
  }

  function accessible() {
    for (const control of document.querySelectorAll("button, select, input, a")) {
      if (control.closest("[hidden]")) continue;
      const label = control.getAttribute("aria-label") || control.textContent.trim() || control.closest("label")?.textContent.trim();
      check(`a ${control.tagName} has no name: ${control.outerHTML}`, !!label);
    }
    const luminance = (color) => {
      const [r, g, b] = color.match(/[\d.]+/g).map((c) => { const x = c / 255; return x <= 0.04045 ? x / 12.92 : ((x + 0.055) / 1.055) ** 2.4; });
      return 0.2126 * r + 0.7152 * g + 0.0722 * b;
    };
    for (const mode of ["dark", "light"]) {
      document.documentElement.dataset.theme = mode;
      for (const [what, on] of [["h1", "body"], ["#status", "body"], [".legend", "body"], ["summary", "body"], ["button", "button"], [".soft", "body"], ['button[aria-checked="true"]', 'button[aria-checked="true"]']]) {
        const [found, ground] = [document.querySelector(what), document.querySelector(on)];
        if (!found || !ground) continue;
        const [a, b] = [luminance(getComputedStyle(found).color), luminance(getComputedStyle(ground).backgroundColor)].sort((p, q) => q - p);
        check(`${what} is hard to read in the ${mode} theme: ${((a + 0.05) / (b + 0.05)).toFixed(2)}`, (a + 0.05) / (b + 0.05) >= 4.5);
      }
    }
    return "ok";
  }

  const theme = (name) => { document.documentElement.dataset.theme = name; return "ok"; };
  const fits = async () => {
    await wait(300);
    check(`the page is ${document.documentElement.scrollWidth} wide in ${innerWidth}`, document.documentElement.scrollWidth <= innerWidth + 1);
    return "ok";
  };
  const alone = () => {
    check("the page asks for something from elsewhere", performance.getEntriesByType("resource").every((entry) => new URL(entry.name).origin === location.origin || entry.name.startsWith("data:") || entry.name.startsWith("blob:")));
    return "ok";
  };

  return { started, remember, changed, relightable, relit, sampled, mistaken, mended, slid, scrubbed, selected, tool, undone, edited, compared, closed, rendered, accessible, theme, fits, alone };
})();
