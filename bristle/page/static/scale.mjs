// Ranges and round marks of axes.

/** Returns marks of an axis that are round numbers. */
export function marks(low, high, wanted) {
  const rough = (high - low) / wanted;
  if (!(rough > 0) || !Number.isFinite(rough)) return [];
  const power = 10 ** Math.floor(Math.log10(rough));
  const step = [1, 2, 5, 10].map((k) => k * power).find((one) => one >= rough * 0.999);
  const found = [];
  for (let k = Math.ceil(low / step - 1e-9); k * step <= high + 1e-9 * step; k++) found.push(k * step);
  return found;
}

/** Returns [low, high] of arrays with some room around. */
export function extent(arrays, room = 0.05, factor = 1) {
  let low = Infinity;
  let high = -Infinity;
  for (const array of arrays) {
    for (let k = 0; k < array.length; k++) {
      const value = array[k];
      if (value < low) low = value;
      if (value > high) high = value;
    }
  }
  if (!Number.isFinite(low)) return [-1, 1];
  low *= factor;
  high *= factor;
  if (!(high > low)) return [low - 1, high + 1];
  return [low - room * (high - low), high + room * (high - low)];
}

/** Returns marks of a logarithmic axis as powers of ten: 1, 2 and 5 of each decade, or 1 alone. */
export function decades(low, high, wanted) {
  const found = (digits) => {
    const all = [];
    for (let power = Math.floor(low); power <= Math.ceil(high); power++) {
      for (const digit of digits) {
        const at = power + Math.log10(digit);
        if (at >= low - 1e-9 && at <= high + 1e-9) all.push(at);
      }
    }
    return all;
  };
  const fine = found([1, 2, 5]);
  if (fine.length <= 2 * wanted) return fine;
  const whole = found([1]);
  const every = Math.max(1, Math.ceil(whole.length / wanted));
  return whole.filter((_, k) => k % every === 0);
}
