// Bounds check with hysteresis.
#include "class.h"
#include <cmath>

namespace {

// A flag that one condition sets and another resets; setting wins.
class Flag {
public:
    explicit Flag(bool on = false) : on_(on) {}
    void execute(bool set, bool reset) { on_ = set || (on_ && !reset); }
    bool on() const { return on_; }

private:
    bool on_;
};

Settings current;
Flag high, low;

}  // namespace

Settings block_defaults() {
    return Settings{.low_limit = 10, .high_limit = 50, .hysteresis = 1};
}

const char *block_configure(const Settings *settings) {
    if (!std::isfinite(settings->low_limit)) return "low-limit must be a finite number";
    if (!std::isfinite(settings->high_limit)) return "high-limit must be a finite number";
    if (settings->low_limit >= settings->high_limit) return "low-limit must be below high-limit";
    if (!std::isfinite(settings->hysteresis) || settings->hysteresis < 0) {
        return "hysteresis must be a finite number, 0 or more";
    }
    current = *settings;
    return nullptr;
}

void block_execute(const Scan *, const Inputs *inputs, Outputs *outputs) {
    const double signal = inputs->signal;
    outputs->error = std::isnan(signal);
    if (!outputs->error) {
        const bool above = signal > current.high_limit, below = signal < current.low_limit;
        // Beyond one limit, the other flag goes whatever the hysteresis.
        high.execute(above, below || signal < current.high_limit - current.hysteresis);
        low.execute(below, above || signal > current.low_limit + current.hysteresis);
    }
    outputs->high = high.on();
    outputs->low = low.on();
}

Retained block_save() {
    return Retained{.high = high.on(), .low = low.on()};
}

void block_restore(const Retained *state) {
    high = Flag(state->high);
    low = Flag(state->low);
}
