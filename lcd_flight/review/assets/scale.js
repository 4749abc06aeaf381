// Round numbers of an axis and how they are said, as lcd_flight/drawing/scale.py has them.

/** Round values between low and high: about `count`, or on a logarithmic axis 1, 2 and 5 times powers of ten. */
function ticks(low, high, log, count) {
  if (log) {
    const powers = range(Math.floor(Math.log10(low)), Math.ceil(Math.log10(high))).map((power) => 10 ** power);
    const tens = powers.filter((value) => value >= low * 0.999 && value <= high * 1.001);
    if (tens.length > 1) return tens;
    return powers.flatMap((ten) => [1, 2, 5].map((n) => n * ten)).filter((value) => value >= low && value <= high);
  }
  const rough = (high - low) / count;
  const power = 10 ** Math.floor(Math.log10(rough));
  const step = [1, 2, 2.5, 5, 10].map((n) => n * power).find((value) => value >= rough * 0.999999);
  return range(Math.ceil(low / step - 1e-9), Math.floor(high / step + 1e-9)).map((n) => n * step);
}

function range(first, last) {
  return Array.from({ length: Math.max(0, last - first + 1) }, (_, n) => first + n);
}

function label(value) {
  return Math.abs(value) < 1e-12 ? "0" : Number(value.toPrecision(6)).toString().replace("-", "−");
}
