const viewer = document.getElementById("viewer");
const stage = document.getElementById("stage");
const split = document.getElementById("split");
const shown = document.getElementById("shown");
const buttons = [...viewer.querySelectorAll("button")];

function show(mode) {
  viewer.dataset.mode = mode;
  for (const button of buttons) {
    button.setAttribute("aria-pressed", button.dataset.mode === mode);
  }
  name();
}

function name() {
  const isFlip = viewer.dataset.mode === "flip";
  shown.textContent = isFlip ? (viewer.classList.contains("other") ? "reference" : "ours") : "";
}

function flip() {
  viewer.classList.toggle("other");
  name();
}

function moveSplit(percent) {
  split.value = percent;
  stage.style.setProperty("--split", `${split.value}%`);
}

for (const button of buttons) {
  button.addEventListener("click", () => show(button.dataset.mode));
}
split.addEventListener("input", () => moveSplit(split.value));
stage.addEventListener("pointermove", (event) => {
  const box = stage.getBoundingClientRect();
  moveSplit((100 * (event.clientX - box.left)) / box.width);
});
stage.addEventListener("click", () => viewer.dataset.mode === "flip" && flip());
document.addEventListener("keydown", (event) => {
  if (event.key === " " && viewer.dataset.mode === "flip" && event.target === document.body) {
    event.preventDefault();
    flip();
  }
});
const asked = location.hash.slice(1);
show(buttons.some((button) => button.dataset.mode === asked) ? asked : "flip");
