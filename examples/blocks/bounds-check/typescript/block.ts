// Bounds check with hysteresis.
import type { Inputs, Outputs, Retained, Scan, Settings } from "./class";

let settings: Settings = { lowLimit: 10, highLimit: 50, hysteresis: 1 };
let high = false;
let low = false;

export const boundsCheck = {
  defaults(): Settings {
    return { lowLimit: 10, highLimit: 50, hysteresis: 1 };
  },

  configure(next: Settings): void {
    if (!Number.isFinite(next.lowLimit)) throw "low-limit must be a finite number";
    if (!Number.isFinite(next.highLimit)) throw "high-limit must be a finite number";
    if (next.lowLimit >= next.highLimit) throw "low-limit must be below high-limit";
    if (!Number.isFinite(next.hysteresis) || next.hysteresis < 0) throw "hysteresis must be a finite number, 0 or more";
    settings = next;
  },

  execute(scan: Scan, inputs: Inputs): Outputs {
    const { signal } = inputs;
    const error = Number.isNaN(signal);
    if (!error) {
      const above = signal > settings.highLimit;
      const below = signal < settings.lowLimit;
      // Beyond one limit, the other flag goes whatever the hysteresis.
      high = above || (high && !below && signal >= settings.highLimit - settings.hysteresis);
      low = below || (low && !above && signal <= settings.lowLimit + settings.hysteresis);
    }
    return { high, low, error };
  },

  save(): Retained {
    return { high, low };
  },

  restore(state: Retained): void {
    ({ high, low } = state);
  },
};
