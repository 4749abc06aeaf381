// The bar at the foot: plays the flight, zooms, and says which phase it is and what was found.

const bar = document.querySelector(".player");
const slider = bar.querySelector("input");
const clock = bar.querySelector(".clock");
const story = bar.querySelector(".story");
const speed = bar.querySelector(".speed");
const stripWindow = bar.querySelector(".window");
const phases = [...bar.querySelectorAll(".strip > span")];
const flags = [...bar.querySelectorAll(".strip > .flag")];
const FLAG_SHOWN_S = 0.5; // longer than a finding lasted, so that one can be read
const ZOOM_STEP = 0.6;
let playing = false;
let before = 0;

function shareOfWhole(time) {
  return (time - whole.begin) / (whole.end - whole.begin);
}

function step(now) {
  if (!playing) return;
  const next = instant + ((now - before) / 1000) * Number(speed.value);
  before = now;
  const end = zoomed() ? shown.end : whole.end;
  setInstant(Math.min(next, end));
  if (next >= end) play(false);
  else requestAnimationFrame(step);
}

function play(on) {
  const [begin, end] = zoomed() ? [shown.begin, shown.end] : [whole.begin, whole.end];
  if (on && (instant >= end - 1e-6 || instant < begin)) setInstant(begin);
  playing = on;
  bar.querySelector("[data-do=play]").textContent = on ? "❚❚" : "▶";
  if (!on) return;
  before = performance.now();
  requestAnimationFrame(step);
}

function fit() {
  fitted = !fitted;
  bar.querySelector("[data-do=fit]").setAttribute("aria-pressed", fitted);
  changed();
}

/** Zoom around the instant where it is shown, else around the middle. */
function zoomHere(factor) {
  const inside = instant >= shown.begin && instant <= shown.end;
  zoom(factor, inside ? instant : (shown.begin + shown.end) / 2);
}

const actions = {
  play: () => play(!playing),
  in: () => zoomHere(ZOOM_STEP),
  out: () => zoomHere(1 / ZOOM_STEP),
  earlier: () => pan(-0.3),
  later: () => pan(0.3),
  whole: () => setWindow(whole.begin, whole.end),
  fit,
  "space-in": () => approach(1.3),
  "space-out": () => approach(1 / 1.3),
  "space-top": () => look({ elevation: Math.PI / 2, azimuth: 0, right: 0, down: 0 }),
  "space-side": () => look({ elevation: 0, azimuth: 0, right: 0, down: 0 }),
  "space-home": () => look(home),
};
for (const button of document.querySelectorAll("[data-do]")) {
  button.addEventListener("click", actions[button.dataset.do]);
}

const keys = { " ": "play", "+": "in", "-": "out", 0: "whole", f: "fit" };

addEventListener("keydown", (event) => {
  const taken = event.target.closest("select, button, summary") || (event.target === slider && event.key.startsWith("Arrow"));
  if (taken || event.ctrlKey || event.metaKey || event.altKey) return;
  if (event.key === "ArrowLeft" || event.key === "ArrowRight") {
    const sign = event.key === "ArrowLeft" ? -1 : 1;
    if (event.shiftKey) pan(sign * 0.3);
    else setInstant(instant + sign * 0.01);
  } else if (keys[event.key]) actions[keys[event.key]]();
  else return;
  event.preventDefault();
});

// Rows and tiles lead to their time: a phase is zoomed to, a finding or a largest error is gone to.
for (const row of document.querySelectorAll(":is(tr, .tile)[data-begin]")) {
  const [begin, end] = [Number(row.dataset.begin), Number(row.dataset.end)];
  row.addEventListener("click", () => {
    setInstant(begin);
    if (row.dataset.zoom !== undefined) setWindow(begin, end);
    else if (zoomed()) setWindow(begin - (shown.end - shown.begin) / 2, begin + (shown.end - shown.begin) / 2);
  });
}

function isNow(element, longer = 0) {
  return Number(element.dataset.begin) <= instant && instant < Number(element.dataset.end) + longer;
}

function tellStory() {
  const phase = phases.find((span) => isNow(span)) ?? phases.at(phases.length && instant < Number(phases[0].dataset.begin) ? 0 : -1);
  const found = flags.filter((flag) => isNow(flag, FLAG_SHOWN_S));
  story.replaceChildren(...(phase ? [mark(phase.title, "")] : []));
  for (const flag of found) {
    const words = mark(flag.title, "");
    words.className = flag.classList[1];
    story.append(" ", words);
  }
}

function showNames() {
  for (const span of phases) showName(span, span.clientWidth);
}

follow(() => {
  slider.value = instant;
  clock.textContent = `${instant.toFixed(2).replace("-", "−")} s`;
  stripWindow.style.left = `${100 * shareOfWhole(shown.begin)}%`;
  stripWindow.style.width = `${100 * (shareOfWhole(shown.end) - shareOfWhole(shown.begin))}%`;
  stripWindow.hidden = !zoomed();
  tellStory();
});

slider.addEventListener("input", () => {
  play(false);
  setInstant(Number(slider.value));
});
bar.querySelector(".strip").addEventListener("dblclick", (event) => {
  const box = bar.querySelector(".strip").getBoundingClientRect();
  const time = whole.begin + ((event.clientX - box.left) / box.width) * (whole.end - whole.begin);
  const phase = phases.find((span) => Number(span.dataset.begin) <= time && time < Number(span.dataset.end));
  if (phase) setWindow(Number(phase.dataset.begin), Number(phase.dataset.end));
});
document.body.classList.add("live");
showNames();
addEventListener("resize", showNames);
changed();
refine();
