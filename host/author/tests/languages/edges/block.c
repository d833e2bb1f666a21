// Whole numbers at their edges, in C and in C++.
#include "class.h"

static const Whole least = {0, INT8_MIN, 0, INT16_MIN, 0, INT32_MIN, 0, INT64_MIN};
static const Whole most = {UINT8_MAX, INT8_MAX, UINT16_MAX, INT16_MAX, UINT32_MAX, INT32_MAX, UINT64_MAX, INT64_MAX};
static Settings current;
static Retained retained;

const char *block_configure(const Settings *settings) {
    current = *settings;
    return 0;
}

void block_execute(const Scan *scan, const Inputs *inputs, Outputs *outputs) {
    const Whole in = inputs->whole;
    outputs->upper.b = in.b > 127;
    outputs->upper.c = in.c < 0;
    outputs->upper.d = in.d > 32767;
    outputs->upper.e = in.e < 0;
    outputs->upper.f = in.f > 2147483647u;
    outputs->upper.g = in.g < 0;
    outputs->upper.h = in.h > 9223372036854775807u;
    outputs->upper.i = in.i < 0;
    switch (inputs->ask) {
    case ASK_LEAST: outputs->whole = least; break;
    case ASK_MOST: outputs->whole = most; break;
    case ASK_SETTINGS: outputs->whole = current.whole; break;
    case ASK_KEPT: outputs->whole = retained.whole; break;
    default: outputs->whole = retained.whole = in;
    }
    (void)scan;
}

Retained block_save(void) { return retained; }

void block_restore(const Retained *state) { retained = *state; }
