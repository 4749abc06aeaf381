// One instant and one window of time: everything on the page follows them.

const whole = { begin: Number(document.body.dataset.begin), end: Number(document.body.dataset.end) };
const shown = { ...whole };
const SHORTEST_WINDOW_S = 0.05;
const followers = [];
let instant = whole.begin;
let waiting = false;

/** Call `draw` once a frame while anything changes. */
function follow(draw) {
  followers.push(draw);
}

function changed() {
  if (waiting) return;
  waiting = true;
  requestAnimationFrame(() => {
    waiting = false;
    for (const draw of followers) draw();
  });
}

function clamped(value, low, high) {
  return Math.min(Math.max(value, low), high);
}

function setInstant(time) {
  instant = clamped(time, whole.begin, whole.end);
  changed();
}

/** Show this window, moved into the flight where it hangs over. */
function setWindow(begin, end) {
  const longest = whole.end - whole.begin;
  const length = clamped(end - begin, Math.min(SHORTEST_WINDOW_S, longest), longest);
  const middle = (begin + end) / 2;
  shown.begin = clamped(middle - length / 2, whole.begin, whole.end - length);
  shown.end = shown.begin + length;
  changed();
}

/** Make the window `factor` times as long around a time that stays where it is. */
function zoom(factor, time) {
  setWindow(time - (time - shown.begin) * factor, time + (shown.end - time) * factor);
}

/** Move the window by a share of its length. */
function pan(share) {
  const by = (shown.end - shown.begin) * share;
  setWindow(shown.begin + by, shown.end + by);
}

function zoomed() {
  return shown.end - shown.begin < (whole.end - whole.begin) * 0.999;
}

/** Share of the window's width. */
function across(time) {
  return (time - shown.begin) / (shown.end - shown.begin);
}
