//! A motor with a contactor: started and stopped by command, supervised by its feedback.
const class = @import("class.zig");

comptime {
    _ = class; // The exports.
}

var current: class.Settings = .{ .feedback_timeout = .{ .ns = 0 } };
var retained: class.Retained = .{ .starts = 0, .hours = 0 };
var run = false;
var alarms: class.Alarms = .{};
/// How long the feedback has not been as `run` wants it, ns.
var waiting: u64 = 0;

pub fn configure(settings: class.Settings) ?[]const u8 {
    if (settings.feedback_timeout.ns == 0) return "feedback-timeout must be above 0";
    current = settings;
    return null;
}

pub fn execute(scan: class.Scan, inputs: class.Inputs, commands: class.Commands) class.Result {
    if (commands.reset) alarms = .{};
    const before = run;
    if (commands.stop or !inputs.interlock) {
        run = false;
    } else if (commands.start and !run and !alarms.miss_starting and !alarms.miss_stopping) {
        run = true;
        retained.starts +%= 1;
    }
    waiting = if (run != before or run == inputs.feedback) 0 else waiting +| scan.elapsed;
    if (waiting >= current.feedback_timeout.ns) {
        if (run) alarms.miss_starting = true else alarms.miss_stopping = true;
        run = false;
        waiting = 0;
    }
    const running = run and inputs.feedback;
    if (running) retained.hours += @as(f64, @floatFromInt(scan.elapsed)) / 3.6e12;
    return .{ .outputs = .{ .run = run, .running = running }, .alarms = alarms };
}

pub fn save() class.Retained {
    return retained;
}

pub fn restore(state: class.Retained) void {
    retained = state;
}
