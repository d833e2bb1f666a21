//! The keys of a test file. Those that a plant's has, too, are constants.

use latchwork_schema::{Key, Kind, Section};

/// Longest time within a case, ns: a hundred years.
pub const LONGEST: u64 = 3_155_760_000_000_000_000;
/// Longest period, ns.
const HOUR: u64 = 3_600_000_000_000;

/// Longest executions that a file can give, ns.
pub const BUDGET: std::ops::RangeInclusive<u64> = 1_000_000..=60_000_000_000;
/// Most memory that a file can give, bytes.
pub const MEMORY: std::ops::RangeInclusive<u64> = 64 << 10..=1 << 30;

/// A time within a case.
pub const TIME: Kind = Kind::Duration { min: 0, max: LONGEST };
/// Names.
pub const NAMES: Kind = Kind::List(&Kind::Text);
/// Of a file.
pub const TOLERANCE: Key =
    Key::optional("tolerance", Kind::Constant, "0", "How far a real output may be off what is expected.");
/// Of a case.
pub const CASE_NAME: Key = Key::required("name", Kind::Text, "What it shows, in a sentence.");
/// Of a case.
pub const CASE_TOLERANCE: Key = Key::optional("tolerance", Kind::Constant, "", "As above, for this case.");
/// Of a step.
pub const STEP_NAME: Key = Key::optional("name", Kind::Text, "", "What it is, for the report.");
/// Of a step.
pub const ALLOW_LOSSY: Key =
    Key::optional("allow-lossy", Kind::Bool, "false", "Whether the swap may clamp state that does not fit.");
const EVERY: Kind = Kind::Duration { min: 0, max: HOUR };

/// Top of the file.
pub static FILE: Section = Section {
    name: "the test file",
    doc: "Which component is tested, and what all cases have in common.",
    keys: &[
        Key::required(
            "component",
            Kind::Text,
            "Component: a name, found in the folders of `components`, or a path that ends in .wasm.",
        ),
        Key::optional("class", Kind::Text, "", "Device class; only where the component exports several."),
        Key::optional(
            "components",
            NAMES,
            "",
            "Folders searched for NAME.wasm, relative to this file. Without it: the file's own folder, then `target/components` and `target/test-components` of the nearest folder above.",
        ),
        Key::optional(
            "every",
            EVERY,
            "\"10ms\"",
            "The block is executed once in this time, also between steps; \"0ms\": only at steps.",
        ),
        TOLERANCE,
        Key::optional(
            "budget",
            Kind::Duration { min: *BUDGET.start(), max: *BUDGET.end() },
            "\"1s\"",
            "Longest execution, by the machine's clock; longer is the fault `budget`.",
        ),
        Key::optional(
            "memory",
            Kind::Size { min: *MEMORY.start(), max: *MEMORY.end() },
            "\"4MiB\"",
            "Most memory of the block.",
        ),
        Key::optional(
            "settings",
            Kind::Map(&Kind::Constant),
            "",
            "Settings of all cases; those not given are the component's defaults, or 0.",
        ),
        Key::optional(
            "inputs",
            Kind::Map(&Kind::Any),
            "",
            "Inputs at the start of all cases; those not given are 0, false, of good quality.",
        ),
    ],
};

/// `[[case]]`
pub static CASE: Section = Section {
    name: "[[case]]",
    doc: "One story: a new instance, plant time from `start`, its steps one after the other.",
    keys: &[
        CASE_NAME,
        Key::optional("every", EVERY, "", "As above, for this case."),
        Key::optional("start", TIME, "\"0ms\"", "Plant time at the beginning; the times of steps count from it."),
        Key::optional(
            "first",
            Kind::Bool,
            "",
            "Whether the first execution is one after a cold start. Without it: true, or false with `state`.",
        ),
        Key::optional("elapsed", TIME, "\"0ms\"", "What the first execution is told as time since the one before."),
        CASE_TOLERANCE,
        Key::optional("settings", Kind::Map(&Kind::Constant), "", "Settings of this case, besides those of the file."),
        Key::optional("inputs", Kind::Map(&Kind::Any), "", "Inputs at the start."),
        Key::optional("state", Kind::Map(&Kind::Constant), "", "Retained state that the block goes on from."),
        Key::optional("expect", Kind::Table(&START), "", "What is expected of the start itself."),
    ],
};

/// `expect` of a case.
pub static START: Section = Section {
    name: "expect",
    doc: "What is expected of the start.",
    keys: &[
        Key::optional("refused", Kind::Text, "", "The block refuses its settings, with this in its sentence."),
        Key::optional("fault", FAULT, "", "The block has this fault."),
    ],
};

/// `[[case.step]]`
pub static STEP: Section = Section {
    name: "[[case.step]]",
    doc: "One execution: what changes before it, what is expected after it.",
    keys: &[
        STEP_NAME,
        Key::optional(
            "at",
            TIME,
            "",
            "When, since the start. Without it: at the next execution after the step before.",
        ),
        Key::optional(
            "inputs",
            Kind::Map(&Kind::Any),
            "",
            "Inputs that change; the others keep their values. A signal: a value, which is good, or `{ value, quality }`.",
        ),
        Key::optional("commands", NAMES, "", "Commands, for this one execution."),
        Key::optional("settings", Kind::Map(&Kind::Constant), "", "Settings that are written before the execution."),
        Key::optional(
            "restart",
            Kind::Bool,
            "false",
            "State saved, a new instance, state restored. After a fault: a cold start.",
        ),
        Key::optional("swap", Kind::Text, "", "Another version takes over, with state, settings and inputs by name."),
        ALLOW_LOSSY,
        Key::optional("expect", Kind::Table(&EXPECT), "", "What is expected."),
    ],
};

/// `expect` of a step.
pub static EXPECT: Section = Section {
    name: "expect",
    doc: "What is expected after the execution.",
    keys: &[
        Key::optional("outputs", Kind::Map(&Kind::Any), "", "Outputs: a value, or `{ value, within, quality }`."),
        Key::optional("alarms", NAMES, "", "The alarms that are on; all others are off."),
        Key::optional("state", Kind::Map(&Kind::Any), "", "Retained state: a value, or `{ value, within }`."),
        Key::optional(
            "refused",
            Kind::Text,
            "",
            "The settings of this step, or its swap, are refused, with this in the sentence.",
        ),
        Key::optional(
            "fault",
            FAULT,
            "",
            "The execution ends in this fault; a step after it begins with `restart = true`.",
        ),
    ],
};

const FAULT: Kind = Kind::OneOf(&["trap", "budget", "memory", "stack", "result", "instantiate"]);

/// `[[case.table]]`
pub static TABLE: Section = Section {
    name: "[[case.table]]",
    doc: "Steps as rows: columns are `at`, `name`, `inputs.PORT`, `settings.PORT`, `commands`, `outputs.PORT`, `alarms`, `alarms.NAME`, `state.FIELD`, and `.quality` behind a signal. An empty cell says nothing.",
    keys: &[
        Key::optional("file", Kind::Text, "", "CSV file, relative to this one; its first row names the columns."),
        Key::optional("columns", NAMES, "", "Names of the columns."),
        Key::optional("rows", Kind::List(&Kind::List(&Kind::Any)), "", "Rows, one list each."),
    ],
};

/// A signal as an input.
pub(super) static SIGNAL: Section = Section {
    name: "a signal",
    doc: "Value and quality of a signal.",
    keys: &[
        Key::optional("value", Kind::Constant, "", "Value; without it, as before."),
        Key::optional("quality", QUALITY, "\"good\"", "Quality."),
    ],
};

/// An expected value.
pub(super) static EXPECTED: Section = Section {
    name: "an expected value",
    doc: "What an output or a field of the state is to be.",
    keys: &[
        Key::optional("value", Kind::Constant, "", "Value."),
        Key::optional("within", Kind::Constant, "", "How far it may be off, in its own unit."),
        Key::optional("quality", QUALITY, "", "Quality of a signal."),
    ],
};

const QUALITY: Kind = Kind::OneOf(&["good", "uncertain", "bad"]);
