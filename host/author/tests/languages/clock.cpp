// Asks for the time, for random numbers, for the environment.
#include "class.h"
#include <cstdio>
#include <cstdlib>
#include <ctime>
#include <unistd.h>

void block_execute(const Scan *, Outputs *outputs) {
    timespec time;
    clock_gettime(CLOCK_MONOTONIC, &time);
    outputs->now = (uint64_t)time.tv_sec * 1000000000u + (uint64_t)time.tv_nsec;
    getentropy(&outputs->random, sizeof outputs->random);
    outputs->variables = getenv("PATH") ? 1 : 0;
    std::puts("nobody reads this");
}
