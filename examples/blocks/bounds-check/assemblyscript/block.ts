// Bounds check with hysteresis.
import { Scan, Settings, Inputs, Outputs, Retained } from "./class";

let current = new Settings();
let high = false;
let low = false;

export function defaults(settings: Settings): void {
  settings.lowLimit = 10;
  settings.highLimit = 50;
  settings.hysteresis = 1;
}

export function configure(settings: Settings): string | null {
  if (!isFinite(settings.lowLimit)) return "low-limit must be a finite number";
  if (!isFinite(settings.highLimit)) return "high-limit must be a finite number";
  if (settings.lowLimit >= settings.highLimit) return "low-limit must be below high-limit";
  if (!isFinite(settings.hysteresis) || settings.hysteresis < 0) return "hysteresis must be a finite number, 0 or more";
  current = settings;
  return null;
}

export function execute(scan: Scan, inputs: Inputs, outputs: Outputs): void {
  const signal = inputs.signal;
  outputs.error = isNaN(signal);
  if (!outputs.error) {
    const above = signal > current.highLimit;
    const below = signal < current.lowLimit;
    // Beyond one limit, the other flag goes whatever the hysteresis.
    high = above || (high && !below && signal >= current.highLimit - current.hysteresis);
    low = below || (low && !above && signal <= current.lowLimit + current.hysteresis);
  }
  outputs.high = high;
  outputs.low = low;
}

export function save(state: Retained): void {
  state.high = high;
  state.low = low;
}

export function restore(state: Retained): void {
  high = state.high;
  low = state.low;
}
