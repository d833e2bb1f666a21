// Asks JavaScript for the time and for random numbers: of 31 bits, above which componentize-qjs returns no u32.
export const asking = {
  execute(scan, inputs) {
    const now = inputs.time ? Date.now() * 1e6 : 0;
    return { now, random: inputs.random ? Math.floor(Math.random() * 2 ** 31) : 0 };
  },
};
