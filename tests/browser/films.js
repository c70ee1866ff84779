// Decodes a film as the browser does and holds its frames against the PNG files that it was made of. `tests/browser/films`
// puts the files into the page, asks for one format after the other, and gets "ok: what was found" or what is wrong.
const FIELD = 32;
const FRAME_SECONDS = 1001 / 24000;

const bytesOf = (name) => Uint8Array.from(atob(files[name]), (c) => c.charCodeAt(0));

// Colours in the middles of the fields of a picture.
function fieldsOf(picture, width, height) {
  const canvas = new OffscreenCanvas(width, height);
  const context = canvas.getContext("2d", { willReadFrequently: true });
  context.drawImage(picture, 0, 0);
  const fields = [];
  for (let y = FIELD / 2; y < height; y += FIELD) {
    for (let x = FIELD / 2; x < width; x += FIELD) fields.push([...context.getImageData(x, y, 1, 1).data.slice(0, 3)]);
  }
  return fields;
}

async function frames() {
  const names = Object.keys(files).filter((name) => /^card\.\d+\.png$/.test(name)).sort();
  return Promise.all(names.map(async (name) => {
    const picture = await createImageBitmap(new Blob([bytesOf(name)], { type: "image/png" }));
    return fieldsOf(picture, picture.width, picture.height);
  }));
}

// Largest differences between frames: of greys, of red and green in colours, and of blue in colours. Where no graphics card
// converts a video, Chromium does so by factors of seven bits, and that of blue in BT.709 (2.11) is too large for them:
// pure blue comes back as 243, and pure green with a blue of 11.
function apart(film, wanted) {
  const most = { grey: 0, color: 0, blue: 0, worst: "" };
  wanted.forEach((frame, k) => frame.forEach((color, i) => color.forEach((value, c) => {
    const isGrey = color.every((x) => x === color[0]);
    const kind = isGrey ? "grey" : c === 2 ? "blue" : "color";
    const found = Math.abs(value - film[k][i][c]);
    if (found <= most[kind]) return;
    most[kind] = found;
    most.worst += ` frame ${k + 1}: ${film[k][i]} instead of ${color};`;
  })));
  return most;
}

// Frames and seconds of an animated picture.
async function ofPicture(name, type) {
  const decoder = new ImageDecoder({ data: bytesOf(name), type, preferAnimation: true });
  await Promise.all([decoder.tracks.ready, decoder.completed]);
  const film = [];
  let seconds = 0;
  for (let frameIndex = 0; frameIndex < decoder.tracks.selectedTrack.frameCount; frameIndex++) {
    const { image } = await decoder.decode({ frameIndex });
    film.push(fieldsOf(image, image.displayWidth, image.displayHeight));
    seconds += image.duration / 1e6;
    image.close();
  }
  return { film, seconds, repeats: decoder.tracks.selectedTrack.repetitionCount };
}

// Frames and seconds of a video, which is stopped in the middle of where each frame should be.
async function ofVideo(name, type, count) {
  const video = document.createElement("video");
  video.muted = true;
  const event = (what) => new Promise((done, fail) => {
    video.addEventListener(what, done, { once: true });
    video.addEventListener("error", () => fail(new Error(video.error.message)), { once: true });
  });
  const loaded = event("loadeddata");
  video.src = URL.createObjectURL(new Blob([bytesOf(name)], { type }));
  await loaded;
  const film = [];
  for (let k = 0; k < count; k++) {
    const there = event("seeked");
    video.currentTime = (k + 0.5) * FRAME_SECONDS;
    await there;
    film.push(fieldsOf(video, video.videoWidth, video.videoHeight));
  }
  return { film, seconds: video.duration };
}

async function filmChecks(format) {
  const wanted = await frames();
  const check = (what, is) => { if (!is) throw new Error(what); };
  check(`there are ${wanted.length} frames`, wanted.length === 6);
  check("frames do not differ", new Set(wanted.map(String)).size === 6);
  check("the card lacks its grey", wanted[0].some((c) => c.join() === "128,128,128"));
  const types = { apng: "image/png", webp: "image/webp", gif: "image/gif", mp4: "video/mp4", webm: "video/webm" };
  const isVideo = types[format].startsWith("video");
  if (format === "mp4" && document.createElement("video").canPlayType('video/mp4; codecs="avc1.640028"') === "") return "ok: mp4: not run (this browser has no H.264)";
  const found = await (isVideo ? ofVideo(`card.${format}`, types[format], wanted.length) : ofPicture(`card.${format}`, types[format]));
  check(`${found.film.length} frames`, found.film.length === wanted.length);
  // GIF counts in hundredths and APNG, in browsers, in thousandths of a second; containers of video in thousandths, too.
  const whole = wanted.length * FRAME_SECONDS;
  const slack = format === "gif" ? 0.006 : 0.0011;
  check(`${found.seconds} seconds instead of ${whole}`, Math.abs(found.seconds - whole) <= slack);
  if (!isVideo) check(`it plays ${found.repeats} times`, found.repeats === Infinity);
  const most = apart(found.film, wanted);
  const allowed = isVideo ? { grey: 1, color: 3, blue: 13 } : { grey: 0, color: 0, blue: 0 };
  for (const kind in allowed) check(`${kind} is off by ${most[kind]}:${most.worst}`, most[kind] <= allowed[kind]);
  return `ok: ${format}: ${found.film.length} frames, ${found.seconds.toFixed(4)} s, greys within ${most.grey}, colours within ${most.color}, their blue within ${most.blue} of 255`;
}
