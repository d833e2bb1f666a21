//! Whole numbers at their edges.
const std = @import("std");
const class = @import("class.zig");

comptime {
    _ = class; // The exports.
}

const least: class.Whole = .{
    .b = 0,
    .c = std.math.minInt(i8),
    .d = 0,
    .e = std.math.minInt(i16),
    .f = 0,
    .g = std.math.minInt(i32),
    .h = 0,
    .i = std.math.minInt(i64),
};
const most: class.Whole = .{
    .b = std.math.maxInt(u8),
    .c = std.math.maxInt(i8),
    .d = std.math.maxInt(u16),
    .e = std.math.maxInt(i16),
    .f = std.math.maxInt(u32),
    .g = std.math.maxInt(i32),
    .h = std.math.maxInt(u64),
    .i = std.math.maxInt(i64),
};
var current: class.Settings = .{ .whole = least };
var retained: class.Retained = .{ .whole = least };

pub fn configure(settings: class.Settings) ?[]const u8 {
    current = settings;
    return null;
}

pub fn execute(_: class.Scan, inputs: class.Inputs) class.Outputs {
    const w = inputs.whole;
    if (inputs.ask == .echo) retained.whole = w;
    return .{
        .whole = switch (inputs.ask) {
            .least => least,
            .most => most,
            .settings => current.whole,
            else => retained.whole,
        },
        .upper = .{
            .b = w.b > std.math.maxInt(i8),
            .c = w.c < 0,
            .d = w.d > std.math.maxInt(i16),
            .e = w.e < 0,
            .f = w.f > std.math.maxInt(i32),
            .g = w.g < 0,
            .h = w.h > std.math.maxInt(i64),
            .i = w.i < 0,
        },
    };
}

pub fn save() class.Retained {
    return retained;
}

pub fn restore(state: class.Retained) void {
    retained = state;
}
