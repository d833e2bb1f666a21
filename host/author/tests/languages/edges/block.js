// Whole numbers at their edges.
const least = { b: 0, c: -128, d: 0, e: -32768, f: 0, g: -2147483648, h: 0, i: -9223372036854775808 };
const most = {
  b: 255, c: 127, d: 65535, e: 32767, f: 4294967295, g: 2147483647, h: 18446744073709551615, i: 9223372036854775807,
};
let current = { whole: least };
let kept = least;

export const edges = {
  configure(settings) {
    current = settings;
  },

  execute(scan, inputs) {
    const { b, c, d, e, f, g, h, i } = inputs.whole;
    const upper = {
      b: b > 127,
      c: c < 0,
      d: d > 32767,
      e: e < 0,
      f: f > 2147483647,
      g: g < 0,
      h: h >= 9223372036854775808,
      i: i < 0,
    };
    if (inputs.ask === "echo") kept = inputs.whole;
    // What is kept must not become another number on its way out.
    const made = { least, most, settings: current.whole, "too-much": { ...least, f: 4294967296 }, echo: kept, kept };
    return { whole: Object.freeze(made[inputs.ask]), upper };
  },

  save() {
    return { whole: kept };
  },

  restore(state) {
    kept = state.whole;
  },
};
