// Nests calls with arrays, and keeps data that nothing writes to.
#include "class.h"

static volatile uint32_t kept[2048];

__attribute__((noinline)) static uint32_t deep(uint32_t calls) {
    volatile uint8_t room[2048];
    for (uint32_t i = 0; i < sizeof room; i++) room[i] = (uint8_t)(calls + 1);
    return (calls ? deep(calls - 1) : 0) + room[calls];
}

void block_execute(const Scan *scan, const Inputs *inputs, Outputs *outputs) {
    for (uint32_t i = 0; i < 2048; i++) outputs->random += kept[i];
    outputs->now = deep(inputs->random ? 12 : 4);
}
