/* Run time and starts of a pump: version 2's class in C, without a library.
 *
 * A class's functions are exported by their full names. Records come flat, as parameters, in the order of their fields; a
 * record that is returned stands in memory, each field at a multiple of its size. */

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#define EXPORT(name) __attribute__((export_name("waterworks:pump/pump-hours@0.2.0#" name)))

enum { COMMAND_SERVICED = 1 };
enum { ALARM_SERVICE_DUE = 1 };

struct settings { uint64_t service_after; uint32_t service_starts; };
struct retained { uint64_t run_time; uint32_t starts; bool running; uint64_t last_run; };
struct outputs  { uint64_t run_time; uint32_t starts; uint64_t last_run; };
struct result   { struct outputs outputs; uint8_t alarms; };
struct refusal  { uint8_t refused; const char *text; size_t length; };

static struct settings settings = { 500ull * 3600 * 1000000000, 0 };
static struct retained state;

EXPORT("defaults")
const struct settings *defaults(void) {
    static const struct settings defaults = { 500ull * 3600 * 1000000000, 0 };
    return &defaults;
}

EXPORT("configure")
const struct refusal *configure(uint64_t service_after, uint32_t service_starts) {
    static const struct refusal agreed;
    settings = (struct settings){ service_after, service_starts };
    return &agreed;
}

static uint64_t sum(uint64_t a, uint64_t b) {
    return a + b < a ? UINT64_MAX : a + b;
}

EXPORT("execute")
const struct result *execute(uint64_t now, uint64_t elapsed, uint32_t first, uint32_t running, uint32_t commands) {
    static struct result result;
    (void)now;
    (void)first;
    if (commands & COMMAND_SERVICED) {
        state.run_time = 0;
        state.starts = 0;
    }
    /* The time since the last execution belongs to what the pump did then. */
    if (state.running) {
        state.run_time = sum(state.run_time, elapsed);
        state.last_run = sum(state.last_run, elapsed);
    } else if (running) {
        state.last_run = 0;
        state.starts += state.starts < UINT32_MAX;
    }
    state.running = running;
    bool due = (settings.service_after > 0 && state.run_time >= settings.service_after)
        || (settings.service_starts > 0 && state.starts >= settings.service_starts);
    result.outputs = (struct outputs){ state.run_time, state.starts, state.last_run };
    result.alarms = due ? ALARM_SERVICE_DUE : 0;
    return &result;
}

EXPORT("save")
const struct retained *save(void) {
    return &state;
}

EXPORT("restore")
void restore(uint64_t run_time, uint32_t starts, uint32_t running, uint64_t last_run) {
    state = (struct retained){ run_time, starts, running, last_run };
}
