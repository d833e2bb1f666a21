//! The keys of the plant file, as tables: one source for the check, the reference and the editor's schema.

use latchwork_schema::{Key, Kind, Section};

const MS: u64 = 1_000_000;
const SECOND: u64 = 1_000 * MS;

/// `[plant]`
pub(crate) static PLANT: Section = Section {
    name: "[plant]",
    doc: "The plant as a whole.",
    keys: &[
        Key::required("name", Kind::Text, "Name of the plant, for displays and records."),
        Key::optional(
            "components",
            Kind::List(&Kind::Text),
            "[]",
            "Folders searched for `NAME.wasm`, in order, relative to this file.",
        ),
        Key::optional(
            "watchdog-device",
            Kind::Text,
            "",
            "Hardware watchdog, usually \"/dev/watchdog\": it resets the machine unless the first cyclic lane pets it, which it \
             does only while its scans end before the next is due. An orderly stop disarms it.",
        ),
        Key::optional(
            "watchdog-timeout",
            Kind::Duration { min: 5 * SECOND, max: 3600 * SECOND },
            "\"10s\"",
            "Time without a scan in time after which the hardware watchdog resets the machine, in whole seconds; at least 5 s, \
             because drivers have 3 s for their safe values when the plant stops. A Raspberry Pi takes at most 15 s.",
        ),
    ],
};

/// `[lane.NAME]`, cyclic.
pub(crate) static LANE: Section = Section {
    name: "[lane.NAME]",
    doc: "A cyclic lane: one thread that scans its blocks once per period, in the order of this file.",
    keys: &[
        Key::required("every", Kind::Duration { min: MS / 10, max: 3600 * SECOND }, "Period of the scan."),
        Key::optional(
            "watchdog",
            Kind::Duration { min: MS / 10, max: 24 * 3600 * SECOND },
            "5 × every",
            "A scan longer than this stops the lane with everything safe; longer than `every` is an overrun.",
        ),
        Key::optional(
            "priority",
            Kind::Integer { min: 1, max: 99 },
            "40",
            "SCHED_FIFO priority where it is permitted; a record says where it is not. The kernel's threads that pass edges \
             on have 50: from there up a cyclic lane delays interrupt lanes. Lanes due at the same virtual time run in \
             the order of their priority.",
        ),
        Key::optional("cpu", Kind::Integer { min: 0, max: 1023 }, "", "CPU the lane is pinned to, counted from 0."),
    ],
};

/// `[lane.NAME]`, interrupt.
pub(crate) static INTERRUPT_LANE: Section = Section {
    name: "[lane.NAME] with `on`",
    doc: "An interrupt lane: its blocks execute, in the order of this file, when an input changes. Without `poll` every edge \
          starts it (hardware interrupt), one after the other in the order of their times; with `poll` its inputs are read \
          at that period and it executes when one has changed (cyclic interrupt).",
    keys: &[
        Key::required("on", Kind::List(&Kind::Tag), "Input points that start it. A point can start one lane only."),
        Key::optional(
            "also-with",
            Kind::Text,
            "",
            "Cyclic lane with each scan of which its blocks execute once more, so that commands, timers and settings \
             reach them.",
        ),
        Key::optional(
            "poll",
            Kind::Duration { min: MS / 10, max: 10 * SECOND },
            "",
            "Makes it a cyclic interrupt with this period. Changes shorter than it are not seen; their time is that of the \
             reading.",
        ),
        Key::optional(
            "watchdog",
            Kind::Duration { min: MS / 10, max: 24 * 3600 * SECOND },
            "50ms",
            "An execution of the lane longer than this stops it with everything safe.",
        ),
        Key::optional(
            "storm-limit",
            Kind::Integer { min: 10, max: 1_000_000 },
            "10000",
            "Edges a second that one line may make for longer than a tenth of a second. A line beyond it is followed at 100 \
             edges a second until it has calmed down; a record of kind `lost` says when that begins, and how many edges \
             were left out when it ends.",
        ),
        Key::optional(
            "queue",
            Kind::Integer { min: 16, max: 65_536 },
            "1024",
            "Edges that may wait while others are handled. Beyond it the newest of each line is kept, the rest is counted \
             and recorded as `lost`.",
        ),
        Key::optional(
            "priority",
            Kind::Integer { min: 1, max: 99 },
            "45",
            "SCHED_FIFO priority where it is permitted; above that of the cyclic lanes, or they delay it, and below 50, \
             that of the kernel's threads that pass edges on.",
        ),
        Key::optional("cpu", Kind::Integer { min: 0, max: 1023 }, "", "CPU the lane is pinned to, counted from 0."),
    ],
};

/// Keys of `[lane.NAME]` that make it an interrupt lane.
pub(crate) static INTERRUPT_KEYS: &[&str] = &["on", "also-with", "poll"];

/// `[driver.NAME]`, besides the keys of its kind.
pub(crate) static DRIVER: Section = Section {
    name: "[driver.NAME]",
    doc: "A connection to the field. Its kind decides which further keys it and its points have.",
    keys: &[Key::required("kind", Kind::Text, "Kind of driver.")],
};

/// Keys of every point, besides those of the driver's kind.
pub(crate) static POINT: Section = Section {
    name: "point",
    doc: "What every point may have besides the keys of its driver's kind.",
    keys: &[
        Key::optional("from", Kind::Tag, "", "Makes it an output point, which shows this tag."),
        Key::optional(
            "safe",
            Kind::Constant,
            "0 or false",
            "What an output point gets before its lane runs, when it has stopped and when it has faulted.",
        ),
    ],
};

/// `[block.NAME]`
pub(crate) static BLOCK: Section = Section {
    name: "[block.NAME]",
    doc: "A block: an instance of a component. Its name may have dots: `[block.zone-b.turbo]`.",
    keys: &[
        Key::required(
            "component",
            Kind::Text,
            "Name of the component, a file `NAME.wasm` in the plant's folders; or a path that ends in `.wasm`, relative \
             to this file.",
        ),
        Key::optional(
            "class",
            Kind::Text,
            "the only one",
            "Device class it is used as, with or without version; needed where the component exports several.",
        ),
        Key::required("lane", Kind::Text, "Lane that executes it."),
        Key::optional(
            "inputs",
            Kind::Any,
            "",
            "Source of each input port: a tag, `{ tag = \"…\", not = true }`, or a constant. A port without one reads 0 or \
             false; a signal port has quality bad then.",
        ),
        Key::optional("settings", Kind::Any, "the component's", "Value of each setting."),
        Key::optional("safe", Kind::Any, "0 or false", "Value of each output under `on-fault = \"safe\"`."),
        Key::optional(
            "on-fault",
            Kind::OneOf(&["safe", "hold", "stop-lane"]),
            "\"safe\"",
            "What its outputs do after a fault: take the `safe` values, hold the last ones, or stop the lane with \
             everything safe.",
        ),
        Key::optional(
            "budget",
            Kind::Duration { min: MS / 10, max: 60 * SECOND },
            "every / 2, 1ms to 100ms",
            "Longest time of one execution; 1ms is the default in an interrupt lane.",
        ),
        Key::optional(
            "memory",
            Kind::Size { min: 64 << 10, max: 1 << 30 },
            "\"4MiB\"",
            "Most linear memory it may have.",
        ),
        Key::optional(
            "wasi",
            Kind::OneOf(&["none", "empty"]),
            "\"none\"",
            "Whether imports of WASI are allowed. `empty` is not supported by this version.",
        ),
        Key::optional(
            "retain",
            Kind::Bool,
            "false",
            "Its retained state is to outlive a restart of the plant. This version keeps it over nothing yet.",
        ),
    ],
};

/// `{ tag = "…", not = true }`
pub(crate) static WIRE: Section = Section {
    name: "the source of an input",
    doc: "A tag, as a table.",
    keys: &[
        Key::required("tag", Kind::Tag, "The tag."),
        Key::optional("not", Kind::Bool, "false", "Inverts it; bool only."),
    ],
};

/// `[policy]`; its keys are the rights of [`crate::operate::RIGHTS`].
pub(crate) static POLICY: Section = Section {
    name: "[policy]",
    doc: "Who may do what with the running plant, through its control socket. Each item is \"user:NAME\", \"group:NAME\", \
          \"uid:NUMBER\" or \"everyone\". The user the plant runs as, and root, may always do everything; without this table \
          nobody else may do anything.",
    keys: &[
        Key::optional(
            "view",
            WHOM,
            "[]",
            "Read tags, settings, alarms, forces and records. Whoever has any other right has it too.",
        ),
        Key::optional("alarm", WHOM, "[]", "Acknowledge and reset alarms."),
        Key::optional("command", WHOM, "[]", "Give commands to blocks."),
        Key::optional("shelve", WHOM, "[]", "Shelve alarms, take them out of service, and bring them back."),
        Key::optional("set", WHOM, "[]", "Change settings of blocks, and input points of `sim` drivers."),
        Key::optional("force", WHOM, "[]", "Force tags, and take forces away."),
    ],
};
const WHOM: Kind = Kind::List(&Kind::Text);
/// `[[alarm]]`
pub(crate) static ALARM: Section = Section {
    name: "[[alarm]]",
    doc: "A rule for alarms and commands. Rules are tried in the order of the file on the full name of each variable, the first \
          that matches counts; a rule with a command's code is for commands, any other for alarms.",
    keys: &[
        Key::required(
            "match",
            Kind::Text,
            "Regular expression for the whole name, as in \".*\\.alarms\\.miss-.*\". The plain name of any other bool tag \
             makes that tag an alarm, too.",
        ),
        Key::required(
            "code",
            Kind::Integer { min: 0, max: 0xFFFF },
            "What it is: 0xC000 alarm that resets itself, 0xC800 must be reset, 0xC400 must be acknowledged, 0xCC00 both; \
             0xA000 warning; 0xB000 message; 0x9000 toggle, 0x9080 one-shot, 0xA080 retained command.",
        ),
        Key::optional(
            "priority",
            Kind::Either(&Kind::Integer { min: 0, max: 255 }, &Kind::OneOf(PRIORITIES)),
            "by kind: 128, 96, 32",
            "Priority of the records, 0 to 255; \"low\" is 64, \"medium\" 128, \"high\" 192, \"urgent\" 240. Without it \
             alarms have 128, warnings 96, messages 32.",
        ),
        Key::optional(
            "text",
            Kind::Text,
            "",
            "Sentence for operators: what it means, what to do. `$1` or `${NAME}` is what the regular expression caught.",
        ),
        Key::optional(
            "on-delay",
            Kind::Duration { min: 0, max: 24 * 3600 * SECOND },
            "\"0ms\"",
            "How long the condition must stand before the alarm is raised.",
        ),
        Key::optional(
            "off-delay",
            Kind::Duration { min: 0, max: 24 * 3600 * SECOND },
            "\"0ms\"",
            "How long the condition must be away before the alarm returns to normal.",
        ),
        Key::optional(
            "group",
            Kind::Text,
            "",
            "Group in which the alarm that came first is marked. `$1` as in `text`: one rule may make a group per zone.",
        ),
        Key::optional(
            "suppress-when",
            Kind::Either(&Kind::Tag, &Kind::Table(&WIRE)),
            "",
            "A bool tag: while it is true the alarm means nothing (a pump that is switched off has no flow) and is not \
             raised. `{ tag = \"…\", not = true }` inverts it.",
        ),
    ],
};

/// `[journal]`
pub(crate) static JOURNAL: Section = Section {
    name: "[journal]",
    doc: "The journal that `run --data` keeps.",
    keys: &[
        Key::optional(
            "age",
            Kind::Duration { min: 60 * SECOND, max: 100 * 366 * 24 * 3600 * SECOND },
            "no limit",
            "Records older than this go, as in `\"90d\"`, counted back from the last one; but none that a sink has not had.",
        ),
        Key::optional(
            "size",
            Kind::Size { min: 4 << 20, max: 1 << 50 },
            "\"4GiB\"",
            "Beyond this the oldest records go, also those that a sink has not had: a record of kind `lost` says which sink \
             and how many.",
        ),
        Key::optional(
            "within",
            Kind::Duration { min: MS, max: 60 * SECOND },
            "\"70ms\"",
            "A record is written at most so long after it came to its turn in the order of time, which takes up to 25 ms. \
             Each writing of this kind wears the disk.",
        ),
        Key::optional(
            "queue",
            Kind::Integer { min: 1000, max: 10_000_000 },
            "200000",
            "Records that may wait in memory while the disk takes none; about 200 bytes each.",
        ),
    ],
};

/// `[table.NAME]`
pub(crate) static TABLE: Section = Section {
    name: "[table.NAME]",
    doc: "A status table: the full state of a group of tags, as one record of kind `event` whenever one of them has changed.",
    keys: &[
        Key::required("tags", Kind::List(&Kind::Text), "Tags, or globs of tags, as in \"zone-b.*.outputs.*\"."),
        Key::optional(
            "every",
            Kind::Duration { min: 10 * MS, max: 3600 * SECOND },
            "\"100ms\"",
            "Shortest time between two records of the table; what changes in between is in the next one.",
        ),
    ],
};

/// `[heartbeat]`
pub(crate) static HEARTBEAT: Section = Section {
    name: "[heartbeat]",
    doc: "Signs of life to and from the supervision, as records of kind `heartbeat`.",
    keys: &[
        Key::optional(
            "send",
            Kind::Duration { min: 100 * MS, max: 3600 * SECOND },
            "",
            "Period of the plant's own sign of life, a record `beat` with its number. Without it there is none.",
        ),
        Key::optional(
            "expect",
            Kind::Duration { min: 100 * MS, max: 24 * 3600 * SECOND },
            "",
            "Longest time between two signs of life of the supervision (`latchwork heartbeat`, `POST /v1/heartbeat`). \
             Without one for so long a record says `lost`, and `back` when they come again. Without the key none are expected.",
        ),
    ],
};

/// `[recorder]`
pub(crate) static RECORDER: Section = Section {
    name: "[recorder]",
    doc: "The flight recorder: what chosen blocks get and give at each execution, in a ring, for `latchwork replay`. Under \
          `run --data` it goes on in files.",
    keys: &[
        Key::optional("blocks", Kind::List(&Kind::Text), "[]", "Blocks, or globs of them, as in \"zone-*\"."),
        Key::optional("lanes", Kind::List(&Kind::Text), "[]", "Lanes, or globs of them: all their blocks."),
        Key::optional(
            "memory",
            Kind::Size { min: 64 << 10, max: 4 << 30 },
            "\"8MiB\"",
            "Most memory of the ring; what is older goes.",
        ),
        Key::optional(
            "spill",
            Kind::Size { min: 1 << 20, max: 1 << 40 },
            "\"64MiB\"",
            "Most room of the files in the folder `recorder` of `--data`; the oldest go. Components come on top.",
        ),
        Key::optional(
            "keyframe",
            Kind::Duration { min: 100 * MS, max: 3600 * SECOND },
            "\"10s\"",
            "How often the state of a block is saved into the recording, at most one block per scan: a replay can begin there.",
        ),
    ],
};

/// Words for priorities.
pub(crate) static PRIORITIES: &[&str] = &["low", "medium", "high", "urgent"];

/// `[sim]`
pub(crate) static SIM_KEYS: &[&str] = &["block", "feed", "scan-time"];

/// Virtual time that scans of a lane take.
pub(crate) static SCAN_TIME: Kind = Kind::Either(&SCAN_SPAN, &Kind::List(&SCAN_SPAN));
static SCAN_SPAN: Kind = Kind::Duration { min: 0, max: 3600 * SECOND };

/// Tables of the file.
pub(crate) static TABLES: &[&str] = &[
    "plant",
    "lane",
    "driver",
    "block",
    "sim",
    "alarm",
    "table",
    "heartbeat",
    "sink",
    "journal",
    "policy",
    "recorder",
];
