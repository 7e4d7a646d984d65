"use strict";
const data = JSON.parse(document.getElementById("data").textContent);
const [nx, ny] = data.size, at = document.getElementById("at"), play = document.getElementById("play");
const words = document.getElementById("words"), now = document.getElementById("now");
const fields = [...document.querySelectorAll(".map canvas")].map(canvas => { canvas.width = nx; canvas.height = ny; return canvas.getContext("2d"); });
const pictures = data.frames.map(uri => { const image = new Image(); image.src = uri; return image; });
at.max = pictures.length - 1;
function show(k) {
  at.value = k;
  words.textContent = data.words[k];
  if (now) now.style.left = (data.ends[0] + data.place[k] * (data.ends[1] - data.ends[0])) + "%";
  const draw = () => fields.forEach((field, n) => field.drawImage(pictures[k], 0, n * ny, nx, ny, 0, 0, nx, ny));
  pictures[k].complete ? draw() : pictures[k].addEventListener("load", () => { if (+at.value === k) draw(); });
}
let timer = null;
function run(wanted) {
  clearInterval(timer);
  timer = wanted ? setInterval(() => show((+at.value + 1) % pictures.length), 140) : null;
  play.textContent = wanted ? "Pause" : "Play";
  play.setAttribute("aria-pressed", wanted);
}
at.addEventListener("input", () => { run(false); show(+at.value); });
play.addEventListener("click", () => run(timer === null));
show(pictures.length - 1);
run(pictures.length > 1 && !matchMedia("(prefers-reduced-motion: reduce)").matches);
