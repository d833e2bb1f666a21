// A motor with a contactor: started and stopped by command, supervised by its feedback.
#include "class.h"

static Settings current;
static Retained retained;
static bool run;
static Alarms alarms;
// How long the feedback has not been as `run` wants it, ns.
static uint64_t waiting;

const char *block_configure(const Settings *settings) {
    if (settings->feedback_timeout.ns == 0) return "feedback-timeout must be above 0";
    current = *settings;
    return 0;
}

Alarms block_execute(const Scan *scan, const Inputs *inputs, Commands commands, Outputs *outputs) {
    if (commands & COMMANDS_RESET) alarms = 0;
    const bool before = run;
    if ((commands & COMMANDS_STOP) || !inputs->interlock) {
        run = false;
    } else if ((commands & COMMANDS_START) && !run && !alarms) {
        run = true;
        retained.starts++;
    }
    if (run != before || run == inputs->feedback) {
        waiting = 0;
    } else {
        waiting += scan->elapsed;
    }
    if (waiting >= current.feedback_timeout.ns) {
        alarms |= run ? ALARMS_MISS_STARTING : ALARMS_MISS_STOPPING;
        run = false;
        waiting = 0;
    }
    outputs->run = run;
    outputs->running = run && inputs->feedback;
    if (outputs->running) retained.hours += (double)scan->elapsed / 3.6e12;
    return alarms;
}

Retained block_save(void) {
    return retained;
}

void block_restore(const Retained *state) {
    retained = *state;
}
