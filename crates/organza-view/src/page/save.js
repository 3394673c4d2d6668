"use strict";
// What is taken away: a turn of the scene as pictures in a ZIP file, and the address of a view.

// ---- one turn ----

const FRAMES = 36;
let isTurning = false;

/// Waits until the page has the whole picture of a state behind `before`; false where there is none.
async function wholePicture(before) {
  while (isOpen && isTurning) {
    if (shown.generation > before && shown.failure) return false;
    if (shown.generation > before && shown.is_whole) return true;
    await pause(30);
  }
  return false;
}

async function turntable() {
  const button = at("turntable");
  if (isTurning) {
    isTurning = false;
    return;
  }
  if (!shown) return;
  isTurning = true;
  const eye = shown.viewpoint;
  const files = [];
  for (let frame = 0; frame < FRAMES && isTurning && isOpen; frame += 1) {
    button.textContent = `Stop (${frame + 1} of ${FRAMES})`;
    const before = shown.generation;
    const azimuth = ((eye.azimuth + (360 * frame) / FRAMES + 180) % 360) - 180;
    look_from({ ...eye, azimuth });
    if (!(await wholePicture(before))) break;
    const answer = await fetch(`save/picture.png?client=${client}`);
    // Another page may have changed the scene meanwhile.
    if (!answer.ok) break;
    files.push({ name: `turn_${String(frame).padStart(2, "0")}.png`, bytes: new Uint8Array(await answer.arrayBuffer()) });
  }
  look_from(eye);
  if (files.length === FRAMES) download(zip(files), `${stemOfTitle()}_turn.zip`);
  else if (isOpen) trouble(isTurning ? "The turn broke off: a picture of it could not be drawn." : "");
  isTurning = false;
  button.textContent = "Turntable";
}

function look_from(eye) {
  add({ do: "look_from", azimuth: eye.azimuth, elevation: eye.elevation, distance: eye.distance, centre: eye.centre });
}

/// Files in a ZIP, stored as they are: PNG is compressed already.
function zip(files) {
  const parts = [];
  const listed = [];
  let offset = 0;
  const bytes = (size, fill) => {
    const view = new DataView(new ArrayBuffer(size));
    fill(view);
    return new Uint8Array(view.buffer);
  };
  for (const file of files) {
    const name = new TextEncoder().encode(file.name);
    const sum = crc32(file.bytes);
    // Version, flags, method, time and date (1 January 1980), checksum, sizes, length of the name.
    const common = (view, start) => {
      view.setUint16(start, 20, true);
      view.setUint16(start + 8, 0x21, true);
      view.setUint32(start + 10, sum, true);
      view.setUint32(start + 14, file.bytes.length, true);
      view.setUint32(start + 18, file.bytes.length, true);
      view.setUint16(start + 22, name.length, true);
    };
    const head = bytes(30, (view) => {
      view.setUint32(0, 0x04034b50, true);
      common(view, 4);
    });
    const entry = bytes(46, (view) => {
      view.setUint32(0, 0x02014b50, true);
      view.setUint16(4, 20, true);
      common(view, 6);
      view.setUint32(42, offset, true);
    });
    parts.push(head, name, file.bytes);
    listed.push(entry, name);
    offset += head.length + name.length + file.bytes.length;
  }
  const size = listed.reduce((sum, part) => sum + part.length, 0);
  const end = bytes(22, (view) => {
    view.setUint32(0, 0x06054b50, true);
    view.setUint16(8, files.length, true);
    view.setUint16(10, files.length, true);
    view.setUint32(12, size, true);
    view.setUint32(16, offset, true);
  });
  return new Blob([...parts, ...listed, end], { type: "application/zip" });
}

const CRC = Uint32Array.from({ length: 256 }, (_, byte) => {
  let sum = byte;
  for (let bit = 0; bit < 8; bit += 1) sum = sum & 1 ? (sum >>> 1) ^ 0xedb88320 : sum >>> 1;
  return sum;
});

function crc32(bytes) {
  let sum = 0xffffffff;
  for (const byte of bytes) sum = CRC[(sum ^ byte) & 255] ^ (sum >>> 8);
  return (sum ^ 0xffffffff) >>> 0;
}

at("turntable").addEventListener("click", turntable);

// ---- the address of a view ----

/// What an address may do: events that say how the scene is seen, and change nothing of it.
const OF_VIEW = ["look_from", "exposure", "layer", "technique", "accuracy"];

function copyView() {
  if (!shown) return;
  const eye = shown.viewpoint;
  const events = [
    { do: "look_from", azimuth: eye.azimuth, elevation: eye.elevation, distance: eye.distance, centre: eye.centre },
    { do: "exposure", stops: shown.exposure },
    { do: "layer", layer: shown.layer },
    { do: "technique", technique: shown.technique },
  ];
  if (shown.accuracy) events.push({ do: "accuracy", step: shown.accuracy.step, set: shown.accuracy.set });
  history.replaceState(null, "", `#${encodeURIComponent(JSON.stringify(events))}`);
  const done = () => {
    at("copy-view").textContent = "Copied";
    setTimeout(() => (at("copy-view").textContent = "Copy view"), 2000);
  };
  // Without a clipboard the address stands in the line of the browser.
  if (navigator.clipboard) navigator.clipboard.writeText(location.href).then(done, () => {});
}
at("copy-view").addEventListener("click", copyView);

/// Shows the scene as the address says.
function takeView() {
  if (location.hash.length < 2) return;
  try {
    const events = JSON.parse(decodeURIComponent(location.hash.slice(1)));
    for (const event of events) {
      if (OF_VIEW.includes(event.do)) add(event);
    }
  } catch {
    trouble("The address ends in a view that cannot be read; the scene is shown as it is.");
  }
}
window.addEventListener("hashchange", takeView);
takeView();

// All that shows what comes is there.
follow("state", () => (shown ? shown.version : 0), async (answer) => show(await answer.json()));
follow("picture", () => number, takePicture);
