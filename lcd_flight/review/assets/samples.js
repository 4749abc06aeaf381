// The traces' samples: those that are drawn at first, until the finer ones are unpacked (lcd_flight/review/detail.py).

const NOTHING = 65535;
const LEVELS = 65534;
const groups = [...document.querySelectorAll(".trace")];
const samples = groups.map(drawnSamples);
const byRole = new Map(groups.map((group, number) => [group.dataset.role, number]));

/** Read back from the drawing, by the axis that the chart carries. */
function drawnSamples(group) {
  const svg = group.ownerSVGElement;
  const { width, height } = svg.viewBox.baseVal;
  const low = Number(svg.dataset.low);
  const high = Number(svg.dataset.high);
  const value = (share) => ("log" in svg.dataset ? low * (high / low) ** share : low + (high - low) * share);
  const times = [];
  const values = [];
  for (const line of group.children) {
    for (const point of line.getAttribute("points").split(" ")) {
      const [x, y] = point.split(",").map(Number);
      times.push(whole.begin + (x / width) * (whole.end - whole.begin));
      values.push(value(1 - y / height));
    }
    times.push(times.at(-1));
    values.push(NaN); // a line ends here
  }
  return { times, values };
}

async function unpacked(text) {
  const bytes = Uint8Array.from(atob(text), (letter) => letter.charCodeAt(0));
  const stream = new Blob([bytes]).stream().pipeThrough(new DecompressionStream("deflate"));
  const data = await new Response(stream).arrayBuffer();
  const size = new DataView(data).getUint32(0, true);
  const header = JSON.parse(new TextDecoder().decode(new Uint8Array(data, 4, size)));
  let place = 4 + size;
  const take = (length) => data.slice(place, (place += length));
  const bases = header.counts.map((count) => new Float32Array(take(4 * count)));
  return header.traces.map(({ base, low, high, role }) => {
    const count = header.counts[base];
    return { role, times: bases[base], values: dequantised(new Uint8Array(take(2 * count)), count, low, high) };
  });
}

function dequantised(bytes, count, low, high) {
  const values = new Float64Array(count);
  const step = (high - low) / LEVELS || 1;
  let level = 0;
  for (let n = 0; n < count; n += 1) {
    level = (level + bytes[n] + 256 * bytes[count + n]) & 0xffff;
    values[n] = level === NOTHING ? NaN : low + level * step;
  }
  return values;
}

/** The first place whose time is not before `time`. */
function firstAt(times, time) {
  let first = 0;
  let last = times.length;
  while (first < last) {
    const half = (first + last) >> 1;
    if (times[half] < time) first = half + 1;
    else last = half;
  }
  return first;
}

/** The nearest sample's value; NaN where there is none near. */
function valueAt({ times, values }, time) {
  if (!times.length) return NaN;
  const after = clamped(firstAt(times, time), 0, times.length - 1);
  const before = Math.max(after - 1, 0);
  const nearest = time - times[before] < times[after] - time ? before : after;
  const near = Math.max(0.5, (whole.end - whole.begin) / 100);
  return Math.abs(times[nearest] - time) > near ? NaN : values[nearest];
}

/** Between the two samples around `time`, of the trace with a role; NaN where there are none. */
function smoothAt(role, time) {
  const number = byRole.get(role);
  if (number === undefined) return NaN;
  const { times, values } = samples[number];
  const after = clamped(firstAt(times, time), 1, times.length - 1);
  const share = clamped((time - times[after - 1]) / (times[after] - times[after - 1] || 1), 0, 1);
  return values[after - 1] + share * (values[after] - values[after - 1]);
}

async function refine() {
  if (!("DecompressionStream" in window)) return; // an old browser keeps what is drawn
  const finer = await unpacked(document.getElementById("samples").textContent);
  finer.forEach((trace, number) => {
    samples[number] = trace;
    byRole.set(trace.role, number); // of two with a role the second: evenly sampled, for the path
  });
  document.body.classList.add("fine");
  changed();
}
