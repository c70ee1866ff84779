// Looks at a report in a browser as a person would: presses keys, clicks, reads pixels. What it finds wrong goes into the
// title of the page; `tests/browser/run` puts this script behind the page's own and reads the title.
(async () => {
  const problems = [];
  const check = (what, is) => { if (!is) problems.push(what); };
  const wait = (ms) => new Promise((done) => setTimeout(done, ms));
  const key = (name, on = document.body) => on.dispatchEvent(new KeyboardEvent("keydown", { key: name, bubbles: true, cancelable: true }));
  const by = (id) => document.getElementById(id);
  try {
    await wait(400);
    const { viewer, data } = window.animReport;
    const canvas = document.querySelector(".viewer-canvas");
    const pixel = (x, y) => [...canvas.getContext("2d").getImageData(x, y, 1, 1).data.slice(0, 3)].join();
    const readout = () => document.querySelector(".viewer-readout").textContent;
    const chosen = () => document.querySelector('.viewer-modes [aria-checked="true"]').textContent;
    const first = data.items[0];
    check("the page has no pictures", data.items.length >= 2 && first.layers.length > 0);
    check("the title does not count", /golden frames? (is|are) not as/.test(by("summary").previousElementSibling.textContent));
    check("the list and the data differ", document.querySelectorAll(".item").length === data.items.length);

    // Modes by key, and that each shows another picture.
    const seen = new Map();
    for (const mode of AnimViewer.MODES) {
      key(mode.key);
      await wait(60);
      check(`key ${mode.key} does not choose ${mode.id}`, viewer.mode() === mode.id);
      seen.set(mode.id, canvas.toDataURL());
    }
    check("golden and now look alike", seen.get("a") !== seen.get("b"));
    check("the difference looks like a picture", seen.get("difference") !== seen.get("a") && seen.get("flip") !== seen.get("difference"));
    key("5");
    key("0");
    const middle = () => viewer.state.x + viewer.state.a.width * viewer.state.scale / 2;
    const fitted = middle();
    key("+");
    check("side by side, plus moves the middle of the picture", Math.abs(middle() - fitted) <= 2);
    key("0");
    check("wipe and side by side look alike", seen.get("wipe") !== seen.get("side"));
    key("1");
    key(" ");
    check("space does not turn", viewer.mode() === "b");
    key(" ");
    check("space does not turn back", viewer.mode() === "a" && chosen() === "golden");
    key("3");
    const before = viewer.state.blinkB;
    await wait(700);
    check("blink does not blink", viewer.state.blinkB !== before);
    key("1");
    await wait(600);
    check("blink goes on after it was left", viewer.mode() === "a" && canvas.toDataURL() === seen.get("a"));

    // A pixel by keys: its values are those of the picture, and it is drawn in their colour.
    canvas.focus();
    key("ArrowRight", canvas);
    key("ArrowDown", canvas);
    const [x, y] = viewer.state.cursor;
    const value = [0, 1, 2].map((c) => Math.round(255 * viewer.state.a.value(x, y, c)));
    check(`the readout lacks the values: ${readout()}`, readout().includes(`pixel ${x}, ${y}`) && readout().includes(`golden ${value.join(" ")}`));
    check("the readout lacks FLIP", readout().includes("FLIP ") && readout().includes("difference "));
    for (let i = 0; i < 3; i++) key("+");
    const { scale } = viewer.state;
    const density = devicePixelRatio || 1;
    const at = (offset, n) => Math.round((offset + (n + 0.2) * scale) * density);
    const drawn = pixel(at(viewer.state.x, x), at(viewer.state.y, y));
    check(`pixel ${x}, ${y} is ${value}, and ${drawn} is drawn`, drawn === value.join());
    while (viewer.state.scale < 90) key("+");
    key("0");
    check("0 does not fit", viewer.state.fitted && viewer.state.scale < 90);

    // The list, ticks, and the command.
    key("j");
    check("j does not go on", document.querySelectorAll(".item")[1].getAttribute("aria-current") === "true");
    key("k");
    key("x");
    check("x does not tick", document.querySelector(".item input").checked && by("ticked").textContent === "1 ticked");
    by("all").click();
    await wait(30);
    const command = by("command").textContent;
    check(`the command is ${command}`, /^anim test .*--accept \S+$/.test(command) && !by("copy").disabled);
    check("frames in a row are not put together", data.items.length < 4 || /\.\d+-\d+/.test(command));

    // Names and contrast for those who need them; nothing from elsewhere.
    for (const control of document.querySelectorAll("button, select, input")) {
      const label = control.getAttribute("aria-label") || control.textContent.trim() || control.closest("label")?.textContent.trim();
      check(`a ${control.tagName} has no name`, !!label);
    }
    const luminance = (color) => {
      const [r, g, b] = color.match(/[\d.]+/g).map((c) => { const x = c / 255; return x <= 0.04045 ? x / 12.92 : ((x + 0.055) / 1.055) ** 2.4; });
      return 0.2126 * r + 0.7152 * g + 0.0722 * b;
    };
    for (const theme of ["dark", "light"]) {
      document.documentElement.dataset.theme = theme;
      const page = getComputedStyle(document.body).backgroundColor;
      for (const what of ["h1", "header p", ".status", "aside li"]) {
        const found = document.querySelector(what);
        if (!found) continue;
        const [a, b] = [luminance(getComputedStyle(found).color), luminance(page)].sort((p, q) => q - p);
        check(`${what} is hard to read in the ${theme} theme: ${((a + 0.05) / (b + 0.05)).toFixed(2)}`, (a + 0.05) / (b + 0.05) >= 4.5);
      }
    }
    key("?");
    check("? does not open the keys", by("help").open);
    check("the page asks for something from elsewhere", performance.getEntriesByType("resource").every((entry) => entry.name.startsWith("data:")));
  } catch (error) {
    problems.push(String(error?.stack ?? error));
  }
  document.title = problems.length ? `WRONG: ${problems.join("; ")}` : "ALL RIGHT";
})();
