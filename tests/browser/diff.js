// Looks at a page of differences between files of linear light: layers, exposure, values that are no bytes.
(async () => {
  const problems = [];
  const check = (what, is) => { if (!is) problems.push(what); };
  const wait = (ms) => new Promise((done) => setTimeout(done, ms));
  try {
    await wait(500);
    const { viewer, data } = window.animReport;
    const canvas = document.querySelector(".viewer-canvas");
    const layers = document.querySelector(".viewer-tools select");
    check("the layers are not listed", !layers.hidden && [...layers.options].map((option) => option.text).join() === "color,Z");
    check("there is something to accept", document.getElementById("accept").hidden);
    const dark = canvas.toDataURL();
    const exposure = document.querySelectorAll(".viewer-slider input")[2];
    check("there is no exposure", exposure.offsetParent !== null);
    exposure.value = 3;
    exposure.dispatchEvent(new Event("input"));
    check("three stops change nothing", canvas.toDataURL() !== dark);
    layers.value = "1";
    layers.dispatchEvent(new Event("change"));
    await wait(200);
    viewer.place(32, 18);
    const depth = viewer.state.a.value(32, 18, 0);
    const text = document.querySelector(".viewer-readout").textContent;
    check(`the depth ${depth} is not read: ${text}`, depth > 1 && text.includes(`first ${Number(depth.toPrecision(5))}`));
    check("FLIP is offered where there is none", document.querySelectorAll(".viewer-modes button")[6].hidden);
    check("the page is empty", data.items.length === 1);
  } catch (error) {
    problems.push(String(error?.stack ?? error));
  }
  document.title = problems.length ? `WRONG: ${problems.join("; ")}` : "ALL RIGHT";
})();
