// A motor with a contactor: started and stopped by command, supervised by its feedback.
import { Alarms, Commands, Inputs, Outputs, Retained, Scan, Settings } from "./class";

let current = new Settings();
let starts: u32 = 0;
let hours: f64 = 0;
let run = false;
let alarms: u32 = 0;
// How long the feedback has not been as `run` wants it, ns.
let waiting: u64 = 0;

export function configure(settings: Settings): string | null {
  if (settings.feedbackTimeout.ns == 0) return "feedback-timeout must be above 0";
  current = settings;
  return null;
}

export function execute(scan: Scan, inputs: Inputs, commands: u32, outputs: Outputs): u32 {
  if (commands & Commands.Reset) alarms = 0;
  const before = run;
  if ((commands & Commands.Stop) != 0 || !inputs.interlock) {
    run = false;
  } else if ((commands & Commands.Start) != 0 && !run && alarms == 0) {
    run = true;
    starts++;
  }
  if (run != before || run == inputs.feedback) {
    waiting = 0;
  } else {
    waiting += scan.elapsed;
  }
  if (waiting >= current.feedbackTimeout.ns) {
    alarms |= run ? Alarms.MissStarting : Alarms.MissStopping;
    run = false;
    waiting = 0;
  }
  outputs.run = run;
  outputs.running = run && inputs.feedback;
  if (outputs.running) hours += <f64>scan.elapsed / 3.6e12;
  return alarms;
}

export function save(state: Retained): void {
  state.starts = starts;
  state.hours = hours;
}

export function restore(state: Retained): void {
  starts = state.starts;
  hours = state.hours;
}
