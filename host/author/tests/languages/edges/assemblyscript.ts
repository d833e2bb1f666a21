// Whole numbers at their edges.
import { Ask, Scan, Settings, Inputs, Outputs, Retained, Whole } from "./class";

let current = new Settings();
const kept = new Whole();

function copy(from: Whole, to: Whole): void {
  to.b = from.b;
  to.c = from.c;
  to.d = from.d;
  to.e = from.e;
  to.f = from.f;
  to.g = from.g;
  to.h = from.h;
  to.i = from.i;
}

export function configure(settings: Settings): string | null {
  current = settings;
  return null;
}

export function execute(scan: Scan, inputs: Inputs, outputs: Outputs): void {
  const w = inputs.whole;
  const upper = outputs.upper;
  upper.b = w.b > <u8>i8.MAX_VALUE;
  upper.c = w.c < 0;
  upper.d = w.d > <u16>i16.MAX_VALUE;
  upper.e = w.e < 0;
  upper.f = w.f > <u32>i32.MAX_VALUE;
  upper.g = w.g < 0;
  upper.h = w.h > <u64>i64.MAX_VALUE;
  upper.i = w.i < 0;
  const out = outputs.whole;
  if (inputs.ask == Ask.Least) {
    out.c = i8.MIN_VALUE;
    out.e = i16.MIN_VALUE;
    out.g = i32.MIN_VALUE;
    out.i = i64.MIN_VALUE;
  } else if (inputs.ask == Ask.Most) {
    out.b = u8.MAX_VALUE;
    out.c = i8.MAX_VALUE;
    out.d = u16.MAX_VALUE;
    out.e = i16.MAX_VALUE;
    out.f = u32.MAX_VALUE;
    out.g = i32.MAX_VALUE;
    out.h = u64.MAX_VALUE;
    out.i = i64.MAX_VALUE;
  } else if (inputs.ask == Ask.Settings) {
    copy(current.whole, out);
  } else {
    if (inputs.ask == Ask.Echo) copy(w, kept);
    copy(kept, out);
  }
}

export function save(state: Retained): void {
  copy(kept, state.whole);
}

export function restore(state: Retained): void {
  copy(state.whole, kept);
}
