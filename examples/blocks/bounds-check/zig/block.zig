//! Bounds check with hysteresis.
const std = @import("std");
const class = @import("class.zig");

comptime {
    _ = class; // The exports.
}

var current: class.Settings = defaults();
var state: class.Retained = .{ .high = false, .low = false };

pub fn defaults() class.Settings {
    return .{ .low_limit = 10, .high_limit = 50, .hysteresis = 1 };
}

pub fn configure(settings: class.Settings) ?[]const u8 {
    if (!std.math.isFinite(settings.low_limit)) return "low-limit must be a finite number";
    if (!std.math.isFinite(settings.high_limit)) return "high-limit must be a finite number";
    if (settings.low_limit >= settings.high_limit) return "low-limit must be below high-limit";
    if (!std.math.isFinite(settings.hysteresis) or settings.hysteresis < 0) return "hysteresis must be a finite number, 0 or more";
    current = settings;
    return null;
}

pub fn execute(_: class.Scan, inputs: class.Inputs) class.Outputs {
    const signal = inputs.signal;
    const nan = std.math.isNan(signal);
    if (!nan) {
        const above = signal > current.high_limit;
        const below = signal < current.low_limit;
        // Beyond one limit, the other flag goes whatever the hysteresis.
        if (below or signal < current.high_limit - current.hysteresis) state.high = false;
        if (above or signal > current.low_limit + current.hysteresis) state.low = false;
        if (above) state.high = true;
        if (below) state.low = true;
    }
    return .{ .high = state.high, .low = state.low, .@"error" = nan };
}

pub fn save() class.Retained {
    return state;
}

pub fn restore(saved: class.Retained) void {
    state = saved;
}
