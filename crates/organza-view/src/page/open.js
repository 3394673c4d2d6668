"use strict";
// A data file that is dropped on the page, or chosen, takes the place of the view before.

let isOpening = false;
let openingName = "";

async function openFiles(files) {
  if (!shown || !isOpen) return;
  const file = files[0];
  const most = shown.most_file_bytes;
  const refusal = isOpening
    ? "Another file is being opened; try again after it."
    : most === null
      ? "This view opens no files; start another one with the file."
      : files.length !== 1
        ? `Expected one data file, found ${files.length}. Start \`organza view\` with all of them.`
        : file.size > most
          ? `${file.name}: expected at most ${most} bytes, found ${file.size}. Start \`organza view\` again with a larger --max-memory.`
          : "";
  if (refusal) {
    trouble(refusal);
    return;
  }
  isOpening = true;
  trouble("");
  openingName = file.name;
  sayOpening(`Opening ${file.name} …`);
  try {
    const answer = await fetch(`open?client=${client}&name=${encodeURIComponent(file.name)}`, {
      method: "POST", headers: { "content-type": "application/octet-stream" }, body: file,
    });
    const found = await answer.json();
    if (answer.ok) show(found);
    else trouble(`${sentence(found).replace(/\.?$/, ".")} The view before goes on.`);
  } catch {
    trouble(`${file.name} could not be handed over: a page can open no folder and no file that it may not read, and a file has 90 seconds. Start \`organza view\` with it.`);
  }
  isOpening = false;
  sayOpening("");
}

function sayOpening(text) {
  at("opening").textContent = text;
  at("opening").hidden = text === "";
}

/// Says how far the first picture of a file is.
function showOpening(found) {
  if (isOpening && found.opening && found.opening.stage) sayOpening(`Opening ${openingName}: ${found.opening.stage}`);
}

const hasFiles = (event) => event.dataTransfer && [...event.dataTransfer.types].includes("Files");

document.addEventListener("dragover", (event) => {
  if (!hasFiles(event)) return;
  // A browser would leave the page for the file.
  event.preventDefault();
  if (!isOpening) sayOpening("Drop a data file to open it");
});
document.addEventListener("dragleave", (event) => {
  if (!event.relatedTarget && !isOpening) sayOpening("");
});
document.addEventListener("drop", (event) => {
  if (!hasFiles(event)) return;
  event.preventDefault();
  if (!isOpening) sayOpening("");
  openFiles(event.dataTransfer.files);
});
at("open").addEventListener("click", () => at("file").click());
at("file").addEventListener("change", () => {
  if (at("file").files.length > 0) openFiles([...at("file").files]);
  at("file").value = "";
});
