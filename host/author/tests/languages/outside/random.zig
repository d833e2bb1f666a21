//! Asks Zig's library for random numbers.
const std = @import("std");
const class = @import("class.zig");

comptime {
    _ = class; // The exports.
}

pub fn execute(_: class.Scan, inputs: class.Inputs) class.Outputs {
    return .{ .now = 0, .random = if (inputs.random) std.crypto.random.int(u32) else 0 };
}
