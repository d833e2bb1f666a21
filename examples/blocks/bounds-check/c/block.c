// Bounds check with hysteresis.
#include "class.h"
#include <math.h>

static Settings current;
static Retained state;

Settings block_defaults(void) {
    return (Settings){ .low_limit = 10, .high_limit = 50, .hysteresis = 1 };
}

const char *block_configure(const Settings *settings) {
    if (!isfinite(settings->low_limit)) return "low-limit must be a finite number";
    if (!isfinite(settings->high_limit)) return "high-limit must be a finite number";
    if (settings->low_limit >= settings->high_limit) return "low-limit must be below high-limit";
    if (!isfinite(settings->hysteresis) || settings->hysteresis < 0) return "hysteresis must be a finite number, 0 or more";
    current = *settings;
    return 0;
}

void block_execute(const Scan *scan, const Inputs *inputs, Outputs *outputs) {
    (void)scan;
    const double signal = inputs->signal;
    outputs->error = isnan(signal);
    if (!outputs->error) {
        const bool above = signal > current.high_limit, below = signal < current.low_limit;
        // Beyond one limit, the other flag goes whatever the hysteresis.
        if (below || signal < current.high_limit - current.hysteresis) state.high = false;
        if (above || signal > current.low_limit + current.hysteresis) state.low = false;
        if (above) state.high = true;
        if (below) state.low = true;
    }
    outputs->high = state.high;
    outputs->low = state.low;
}

Retained block_save(void) {
    return state;
}

void block_restore(const Retained *saved) {
    state = *saved;
}
