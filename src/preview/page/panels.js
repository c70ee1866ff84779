// Mistakes, console, parameters, and the fields of what is selected.
const AnimPanels = (() => {
  const by = (id) => document.getElementById(id);

  function element(tag, properties, ...children) {
    const made = document.createElement(tag);
    for (const [name, value] of Object.entries(properties ?? {})) {
      if (value === undefined || value === null) continue;
      if (name in made && name !== "list") made[name] = value;
      else made.setAttribute(name, value);
    }
    made.append(...children.filter((child) => child !== null && child !== undefined));
    return made;
  }

  // Colours are linear light here and the screen's on the page. Light may be brighter than a screen: then its hue is shown.
  const toScreen = (x) => Math.round(255 * (x <= 0.0031308 ? 12.92 * x : 1.055 * x ** (1 / 2.4) - 0.055));
  const toLight = (byte) => { const x = byte / 255; return x <= 0.04045 ? x / 12.92 : ((x + 0.055) / 1.055) ** 2.4; };
  function hex(color) {
    const scale = Math.max(1, ...color);
    return `#${color.map((x) => toScreen(Math.max(x, 0) / scale).toString(16).padStart(2, "0")).join("")}`;
  }
  function light(text, before) {
    const scale = Math.max(1, ...(before ?? [1]));
    return [1, 3, 5].map((i) => Number((toLight(parseInt(text.slice(i, i + 2), 16)) * scale).toPrecision(4)));
  }

  function problems(list) {
    const overlay = by("overlay");
    const errors = (list ?? []).filter((one) => one.severity === "error");
    const key = JSON.stringify(errors);
    if (overlay.dataset.key === key) return;
    overlay.dataset.key = key;
    overlay.hidden = errors.length === 0;
    const title = errors.length === 1 ? "A mistake" : `${errors.length} mistakes`;
    overlay.replaceChildren(element("h2", {}, title), ...errors.slice(0, 20).map((one) => element("pre", {}, one.text)));
  }

  function console_(state) {
    const key = JSON.stringify([state.problems, state.warnings, state.printed]);
    if (by("console").dataset.key === key) return;
    by("console").dataset.key = key;
    const lines = [];
    for (const one of (state.problems ?? []).filter((one) => one.severity === "warning").concat(state.warnings ?? [])) {
      const where = one.file ? `${one.file}${one.line ? `:${one.line}` : ""}` : null;
      lines.push(element("li", { className: one.severity }, element("span", { className: "where" }, where ? `${where} ` : ""),
        `${one.severity}: ${one.message}`, one.help ? element("div", { className: "soft" }, one.help) : null));
    }
    for (const line of state.printed ?? []) {
      const parts = line.match(/^(\S+?:\d+):? ?(.*)$/s);
      lines.push(element("li", {}, element("span", { className: "where" }, parts ? `${parts[1]} ` : ""), element("pre", {}, parts ? parts[2] : line)));
    }
    by("console").replaceChildren(...lines);
    by("count").textContent = lines.length ? `(${lines.length})` : "";
  }

  // One number that is typed or, by its label, dragged.
  function number(value, options, change) {
    const input = element("input", { type: "number", step: options.step ?? "any", min: options.min, max: options.max, "aria-label": options.label });
    input.value = Number(Number(value).toPrecision(7));
    const read = () => input.value === "" || !Number.isFinite(input.valueAsNumber) ? null : input.valueAsNumber;
    input.addEventListener("input", () => { if (read() !== null) change(read(), false); });
    input.addEventListener("change", () => { if (read() !== null) change(read(), true); });
    return input;
  }

  function drags(label, input) {
    label.classList.add("drags");
    label.title += "\ndrag to change";
    label.addEventListener("pointerdown", (event) => {
      const start = { x: event.clientX, value: input.valueAsNumber || 0 };
      const step = Number(input.step) || Math.max(Math.abs(start.value) / 100, 0.01);
      label.setPointerCapture(event.pointerId);
      const move = (event) => {
        const raw = start.value + Math.round((event.clientX - start.x) / 2) * step;
        input.value = Number(Math.min(Math.max(raw, input.min === "" ? -Infinity : input.min), input.max === "" ? Infinity : input.max).toPrecision(7));
        input.dispatchEvent(new Event("input"));
      };
      const end = () => {
        label.removeEventListener("pointermove", move);
        label.removeEventListener("pointerup", end);
        if (input.valueAsNumber !== start.value) input.dispatchEvent(new Event("change"));
      };
      label.addEventListener("pointermove", move);
      label.addEventListener("pointerup", end);
    });
  }

  // The control of a value: `change(value, done)` while it changes and when it has.
  function control(kind, value, options, change) {
    const box = element("span", { className: "value" });
    const text = (list) => list.map((x) => Number(x.toPrecision(7)));
    switch (kind) {
      case "bool": case "switch": {
        const input = element("input", { type: "checkbox", checked: value === true, "aria-label": options.label });
        input.addEventListener("change", () => change(input.checked, true));
        box.append(input);
        break;
      }
      case "whole": case "number": {
        const input = number(value, options, (x, done) => {
          if (slider) slider.value = x;
          change(kind === "whole" ? Math.round(x) : x, done);
        });
        let slider = null;
        if (options.min !== undefined && options.max !== undefined) {
          slider = element("input", { type: "range", min: options.min, max: options.max, step: options.step ?? (kind === "whole" ? 1 : (options.max - options.min) / 200), "aria-label": `${options.label}, slider` });
          slider.value = value;
          slider.addEventListener("input", () => { input.value = Number(slider.valueAsNumber.toPrecision(7)); change(slider.valueAsNumber, false); });
          slider.addEventListener("change", () => change(slider.valueAsNumber, true));
          box.append(slider);
        }
        box.append(input);
        box.drag = input;
        break;
      }
      case "color": case "vector": case "numbers": {
        const now = [...value];
        box.classList.add("several");
        const names = kind === "color" ? ["red", "green", "blue"] : ["x", "y", "z", "w"];
        const inputs = now.map((x, i) => number(x, { label: `${options.label}, ${names[i]}` }, (x, done) => {
          now[i] = x;
          if (swatch) swatch.value = hex(now);
          change(text(now), done);
        }));
        let swatch = null;
        if (kind === "color") {
          swatch = element("input", { type: "color", value: hex(now), "aria-label": options.label });
          const pick = (done) => {
            light(swatch.value, now).forEach((x, i) => { now[i] = x; inputs[i].value = x; });
            change(text(now), done);
          };
          swatch.addEventListener("input", () => pick(false));
          swatch.addEventListener("change", () => pick(true));
          box.append(swatch);
        }
        box.append(...inputs);
        break;
      }
      case "choice": {
        const input = element("select", { "aria-label": options.label }, ...options.choices.map((word) => element("option", {}, word)));
        input.value = value;
        input.addEventListener("change", () => change(input.value, true));
        box.append(input);
        break;
      }
      default: {
        const input = element("input", { type: "text", value: value ?? "", placeholder: value === null ? "none" : "", "aria-label": options.label });
        input.addEventListener("change", () => change(input.value, true));
        box.append(input);
      }
    }
    return box;
  }

  // A place by the file's own name; the whole path when it is pointed at.
  const own = (file) => file.split(/[\\/]/).pop();
  function row(name, doc, box, place) {
    const label = element("span", { className: "label", title: doc ?? "" }, name);
    if (box.drag) drags(label, box.drag);
    return element("div", { className: "field" }, label, box, place ? element("span", { className: "place", title: place.path ?? "" }, place.text ?? place) : null);
  }

  function parameters(list, define) {
    const key = JSON.stringify(list?.map(({ given, ...rest }) => rest));
    by("parameters-box").hidden = !list?.length;
    // What somebody is dragging stays as it is.
    if (by("parameters").dataset.key === key) return;
    by("parameters").dataset.key = key;
    by("parameters").replaceChildren(...(list ?? []).map((one) => {
      const given = (text) => {
        if (text === null || text === undefined) return one.default;
        if (["number", "whole"].includes(one.kind)) return Number(text);
        if (one.kind === "switch") return ["true", "on", "yes", "1"].includes(text);
        if (["color", "vector"].includes(one.kind)) return text.startsWith("#") ? light(text) : text.replace(/[[\]()]/g, "").split(/[, ]+/).map(Number);
        return text;
      };
      const label = one.label ?? one.name;
      const box = control(one.kind, given(one.given), { ...one, label }, (value, done) => define(one.name, String(value), done));
      const back = element("button", { type: "button", title: "back to the script's own value", "aria-label": `${label}: back to the default` }, "\u21ba");
      back.addEventListener("click", () => { delete by("parameters").dataset.key; define(one.name, null, true); });
      box.append(back);
      return row(label, `-D ${one.name}=`, box);
    }));
  }

  // A value as RON says it.
  function ron(kind, value) {
    if (Array.isArray(value)) return `(${value.map((x) => decimal(x)).join(", ")})`;
    if (typeof value === "number") return kind === "whole" ? String(Math.round(value)) : decimal(value);
    if (typeof value === "boolean") return String(value);
    return value;
  }
  const decimal = (x) => Number.isInteger(x) && Math.abs(x) < 1e15 ? x.toFixed(1) : String(x);

  // A number as people read it: the script's own may be fifteen digits long.
  const digits = (one) => typeof one.value === "number" ? String(Number(one.value.toPrecision(7))) : one.text;

  // The fields of a part of the scene; `tried(trial)` while a value changes, `written(path, value)` when it has.
  function selection(part, tried, written) {
    const box = by("selection");
    if (!part) {
      box.replaceChildren(element("p", { className: "soft" }, "Click something in the picture."));
      return;
    }
    const field = (group, one) => {
      const subject = group.subject ?? { kind: part.kind, index: part.index };
      const kind = one.kind === "none" ? "text" : one.kind;
      const place = one.line ? { text: `${own(one.file)}:${one.line}`, path: one.file } : null;
      if (!one.writable) {
        const why = one.by_script ? { text: `set by the script${place ? `, ${place.text}` : ""}`, path: one.file } : place;
        return row(one.name, one.doc, element("span", { className: "value" }, digits(one)), why);
      }
      let made = null;
      const box = control(kind, one.kind === "none" ? null : one.value, { label: `${group.title} ${one.name}` }, (value, done) => {
        const problem = made.querySelector(".problem");
        problem?.remove();
        if (!done) {
          tried({ subject, component: group.component, field: one.name, value });
          return;
        }
        const text = ron(one.kind, value);
        if (text !== "") written([{ path: one.path, value: text }]).catch((error) => made.append(element("div", { className: "problem", role: "alert" }, error.message)));
      });
      made = row(one.name, one.doc, box, one.said ? place : null);
      return made;
    };
    const groups = part.groups.map((group) => {
      const isNear = (one) => one.said || one.by_script;
      const others = group.fields.filter((one) => !isNear(one));
      const near = group.fields.filter(isNear);
      const more = others.length ? element("details", {}, element("summary", {}, near.length ? `${others.length} more field${others.length > 1 ? "s" : ""}` : `all at their defaults`), ...others.map((one) => field(group, one))) : null;
      return element("div", { className: "group" }, element("h3", { title: group.doc }, group.title), ...near.map((one) => field(group, one)), more);
    });
    // A part of one group is called as that is.
    const label = part.groups.length === 1 && part.groups[0].title === part.label ? null : element("p", {}, element("strong", {}, part.label));
    box.replaceChildren(...[label].filter(Boolean), ...groups);
  }

  return { problems, console: console_, parameters, selection, element };
})();
