// A motor with a contactor: started and stopped by command, supervised by its feedback.

let timeout = 0;
let starts = 0;
let hours = 0;
let run = false;
let alarms = { missStarting: false, missStopping: false };
// How long the feedback has not been as `run` wants it, ns.
let waiting = 0;

export const motor = {
  configure(next) {
    if (next.feedbackTimeout.ns === 0) throw "feedback-timeout must be above 0";
    timeout = next.feedbackTimeout.ns;
  },

  execute(scan, inputs, commands) {
    if (commands.reset) alarms = { missStarting: false, missStopping: false };
    const before = run;
    if (commands.stop || !inputs.interlock) {
      run = false;
    } else if (commands.start && !run && !alarms.missStarting && !alarms.missStopping) {
      run = true;
      starts += 1;
    }
    waiting = run !== before || run === inputs.feedback ? 0 : waiting + scan.elapsed;
    if (waiting >= timeout) {
      if (run) alarms.missStarting = true;
      else alarms.missStopping = true;
      run = false;
      waiting = 0;
    }
    const running = run && inputs.feedback;
    if (running) hours += scan.elapsed / 3.6e12;
    return [{ run, running }, alarms];
  },

  save() {
    return { starts, hours };
  },

  restore(state) {
    ({ starts, hours } = state);
  },
};
