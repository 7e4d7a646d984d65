"use strict";
// Player of the animated maps: draws image `k` of `data.frames` into each canvas; the maps are stacked in each image.
const data = JSON.parse(document.getElementById("data").textContent);
const [nx, ny] = data.size, slider = document.getElementById("frame"), playButton = document.getElementById("play");
const caption = document.getElementById("caption"), timeMark = document.getElementById("now");
const canvases = [...document.querySelectorAll(".map canvas")].map(canvas => { canvas.width = nx; canvas.height = ny; return canvas.getContext("2d"); });
const images = data.frames.map(uri => { const image = new Image(); image.src = uri; return image; });
slider.max = images.length - 1;
function show(k) {
  slider.value = k;
  caption.textContent = data.captions[k];
  if (timeMark) timeMark.style.left = (data.ends[0] + data.place[k] * (data.ends[1] - data.ends[0])) + "%";
  const draw = () => canvases.forEach((canvas, n) => canvas.drawImage(images[k], 0, n * ny, nx, ny, 0, 0, nx, ny));
  images[k].complete ? draw() : images[k].addEventListener("load", () => { if (+slider.value === k) draw(); });
}
let timer = null;
function play(on) {
  clearInterval(timer);
  timer = on ? setInterval(() => show((+slider.value + 1) % images.length), 140) : null;
  playButton.textContent = on ? "Pause" : "Play";
  playButton.setAttribute("aria-pressed", on);
}
slider.addEventListener("input", () => { play(false); show(+slider.value); });
playButton.addEventListener("click", () => play(timer === null));
show(images.length - 1);
play(images.length > 1 && !matchMedia("(prefers-reduced-motion: reduce)").matches);
