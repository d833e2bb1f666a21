// A motor with a contactor: started and stopped by command, supervised by its feedback.
#include "class.h"
#include <chrono>

namespace {

using std::chrono::nanoseconds;

nanoseconds timeout;
// How long the feedback has not been as `run` wants it.
nanoseconds waiting;
Retained retained;
bool run;
Alarms alarms;

}  // namespace

const char *block_configure(const Settings *settings) {
    if (settings->feedback_timeout.ns == 0) return "feedback-timeout must be above 0";
    timeout = nanoseconds(settings->feedback_timeout.ns);
    return nullptr;
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
    const nanoseconds elapsed(scan->elapsed);
    waiting = run != before || run == inputs->feedback ? nanoseconds::zero() : waiting + elapsed;
    if (waiting >= timeout) {
        alarms |= run ? ALARMS_MISS_STARTING : ALARMS_MISS_STOPPING;
        run = false;
        waiting = nanoseconds::zero();
    }
    outputs->run = run;
    outputs->running = run && inputs->feedback;
    if (outputs->running) retained.hours += std::chrono::duration<double, std::ratio<3600>>(elapsed).count();
    return alarms;
}

Retained block_save() {
    return retained;
}

void block_restore(const Retained *state) {
    retained = *state;
}
