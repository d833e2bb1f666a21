//! The keys of a test file of a plant.

use latchwork_schema::{Key, Kind, Section};
use latchwork_testbed::case::keys::{
    ALLOW_LOSSY, CASE_NAME, CASE_TOLERANCE, LONGEST, NAMES, STEP_NAME, TIME, TOLERANCE,
};

/// Top of the file.
pub static FILE: Section = Section {
    name: "the test file",
    doc: "Which plant is tested, and what all cases have in common.",
    keys: &[
        Key::required("plant", Kind::Text, "The plant file, relative to this one."),
        Key::optional(
            "sim",
            Kind::Bool,
            "true",
            "As `run --sim`: every driver is replaced by `sim` points, `[sim.block]` and `[sim.feed]` count. `false` is for plants that have only `sim` drivers.",
        ),
        Key::optional(
            "components",
            NAMES,
            "",
            "Folders searched for the components of `swap`, relative to this file; the plant's own blocks are found as its file says. Without it: the file's own folder, then `target/components` and `target/test-components` of the nearest folder above.",
        ),
        TOLERANCE,
        Key::optional(
            "inputs",
            Kind::Map(&Kind::Any),
            "",
            "Input points at the start of all cases, by tag: a value, which is good, or `{ value, quality }`.",
        ),
        Key::optional(
            "settings",
            Kind::Map(&Kind::Any),
            "",
            "Settings in the place of those of the plant file, by tag.",
        ),
    ],
};

/// `[[case]]`
pub static CASE: Section = Section {
    name: "[[case]]",
    doc: "One story: the plant started anew, without anything retained, and its steps one after the other.",
    keys: &[
        CASE_NAME,
        CASE_TOLERANCE,
        Key::optional("inputs", Kind::Map(&Kind::Any), "", "Input points at the start, besides those of the file."),
        Key::optional(
            "settings",
            Kind::Map(&Kind::Any),
            "",
            "Settings in the place of those of the plant file, besides those above.",
        ),
    ],
};

/// `[[case.step]]`
pub static STEP: Section = Section {
    name: "[[case.step]]",
    doc: "One moment: what changes, in the order of this table, before everything that is due then; what is expected after it.",
    keys: &[
        STEP_NAME,
        Key::optional(
            "at",
            TIME,
            "",
            "When, since the start of the case. Without it: with the next scan of the first cyclic lane.",
        ),
        Key::optional(
            "restart",
            Kind::Bool,
            "false",
            "The plant stops in order and starts again, with what it has retained and kept; input points keep their values.",
        ),
        Key::optional(
            "inputs",
            Kind::Map(&Kind::Any),
            "",
            "Input points that change, by tag; the others keep their values. A value, which is good, or `{ value, quality }`.",
        ),
        Key::optional(
            "swap",
            Kind::Map(&Kind::Text),
            "",
            "Blocks of one lane and the components of their next versions: a name, or a path that ends in .wasm.",
        ),
        ALLOW_LOSSY,
        Key::optional(
            "probation",
            Kind::Integer { min: 0, max: 1_000_000_000 },
            "1000",
            "Executions after the swap within which a fault puts the old version back.",
        ),
        Key::optional(
            "settings",
            Kind::Map(&Kind::Any),
            "",
            "Settings that are written, by tag; those of a block that is swapped go with the swap.",
        ),
        Key::optional("force", Kind::Map(&Kind::Any), "", "Tags that are held at a value."),
        Key::optional("unforce", NAMES, "", "Tags that are held no longer; globs are allowed."),
        Key::optional(
            "commands",
            Kind::Either(&NAMES, &Kind::Map(&Kind::Bool)),
            "",
            "Commands of blocks, by tag, for one execution; or a table with true and false, for toggle and retained ones.",
        ),
        Key::optional("ack", NAMES, "", "Alarms that are acknowledged; globs are allowed."),
        Key::optional("reset", NAMES, "", "Alarms that are reset; globs are allowed."),
        Key::optional("shelve", Kind::Map(&SHELF), "", "Alarms that are hidden, and for how long."),
        Key::optional("unshelve", NAMES, "", "Alarms that are shown again; globs are allowed."),
        Key::optional("expect", Kind::Table(&EXPECT), "", "What is expected."),
    ],
};

/// `expect` of a step.
pub static EXPECT: Section = Section {
    name: "expect",
    doc: "What is expected after everything that is due up to the time of the step.",
    keys: &[
        Key::optional("outputs", Kind::Map(&Kind::Any), "", "Any tags: a value, or `{ value, within, quality }`."),
        Key::optional(
            "alarms",
            Kind::Either(&NAMES, &Kind::Map(&STATE)),
            "",
            "The alarms that an operator finds in the list, all others not; or a table with the states of some.",
        ),
        Key::optional(
            "records",
            NAMES,
            "",
            "Records since the step before, in this order, others may stand between: \"SOURCE TRANSITION\".",
        ),
        Key::optional(
            "refused",
            Kind::Text,
            "",
            "Something that the step wants is refused, or a swap rolled back, with this in the sentence.",
        ),
        Key::optional(
            "faults",
            NAMES,
            "",
            "Blocks and lanes (`lane.NAME`) that have faulted since the step before; without it none may.",
        ),
    ],
};

/// How long an alarm is shelved.
pub(crate) static SHELF: Kind = Kind::Duration { min: 1, max: LONGEST };
/// States of alarms.
pub(crate) static STATE: Kind = Kind::OneOf(&[
    "normal",
    "unacknowledged",
    "active",
    "returned",
    "awaiting-reset",
    "shelved",
    "suppressed",
    "out-of-service",
]);
