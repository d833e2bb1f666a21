//! What the checker says of tables, where it says it, and that schema and reference come from the same keys.

use latchwork_schema::check::parse;
use latchwork_schema::{Checker, Key, Kind, Section, Values, json_schema, reference};
use serde_json::json;

static POINT: Section = Section {
    name: "point",
    doc: "One point.",
    keys: &[
        Key::required("register", Kind::Integer { min: 0, max: 65535 }, "Address."),
        Key::optional("from", Kind::Tag, "", "Source."),
    ],
};

static LANE: Section = Section {
    name: "[lane]",
    doc: "A lane.",
    keys: &[
        Key::required("every", Kind::Duration { min: 100_000, max: 3_600_000_000_000 }, "Period."),
        Key::optional("memory", Kind::Size { min: 65536, max: 1 << 30 }, "\"4MiB\"", "Most memory."),
        Key::optional("mode", Kind::OneOf(&["safe", "hold"]), "\"safe\"", "What a | means."),
        Key::optional("on", Kind::Bool, "", "Switch."),
        Key::optional("level", Kind::Constant, "", "Anything that is one value."),
        Key::optional("folders", Kind::List(&Kind::Text), "[]", "Folders."),
        Key::optional("point", Kind::Table(&POINT), "", "A point."),
        Key::optional("points", Kind::Map(&Kind::Table(&POINT)), "", "Points."),
        Key::optional("cpu", Kind::Either(&Kind::Integer { min: 0, max: 7 }, &Kind::Bool), "", "One, or any."),
    ],
};

/// The values, and every finding as `what it points at: message | help`.
fn read(text: &str) -> (Values, Vec<String>) {
    let (table, syntax) = parse(text);
    let mut checker = Checker { findings: syntax, ..Checker::default() };
    let values = checker.table(&[&LANE], table.get_ref(), 0..0);
    let line = |f: &latchwork_schema::Finding| {
        let at = f.span.clone().map_or("", |s| &text[s]);
        format!("{at}: {}{}", f.message, f.help.as_ref().map_or(String::new(), |h| format!(" | {h}")))
    };
    (values, checker.findings.iter().map(line).collect())
}

#[test]
fn what_fits_is_read() {
    let (values, said) = read(
        "every = \"10ms\"\nmemory = \"64 KiB\"\nmode = \"hold\"\non = true\nlevel = -1.5\nfolders = [\"a\", \"b\"]\n\
         point = { register = 0x10 }\npoints.a.register = 1_000\ncpu = true\n",
    );
    assert_eq!(said, Vec::<String>::new());
    assert_eq!(values.duration("every"), Some(10_000_000));
    assert_eq!(values.size("memory"), Some(65536));
    assert_eq!(values.text("mode"), Some("hold"));
    assert_eq!(values.table("point").and_then(|p| p.integer("register")), Some(16));
    assert_eq!(values.bool("cpu"), Some(true));
}

#[test]
fn each_thing_that_does_not_fit_is_told_at_its_place_with_what_would() {
    for (text, expected) in [
        ("evry = \"10ms\"", "evry: [lane] has no key `evry` | did you mean `every`?"),
        (
            "every = 5",
            "5: `every` is the bare number 5; expected a duration with its unit | write `every = \"5ms\"`, or with another unit: h, m, s, ms, us, ns",
        ),
        (
            "every = true",
            "true: `every` is true; expected a duration with its unit (h, m, s, ms, us, ns) | as in `every = \"10ms\"`",
        ),
        ("every = \"2h\"", "\"2h\": `every` is 2h; expected 100µs to 1h"),
        ("every = \"1s\"\nmemory = \"1KiB\"", "\"1KiB\": `memory` is \"1KiB\"; expected 64KiB to 1GiB"),
        (
            "every = \"1s\"\nmemory = \"4MB\"",
            "\"4MB\": `memory` is the string \"4MB\"; expected a size with its unit (B, KiB, MiB, GiB) | as in `memory = \"1MiB\"`",
        ),
        (
            "every = \"1s\"\nmemory = \"99999999999GiB\"",
            "\"99999999999GiB\": `memory` is the string \"99999999999GiB\"; expected a size with its unit (B, KiB, MiB, GiB) | as in `memory = \"1MiB\"`",
        ),
        (
            "every = \"1s\"\nmode = \"hodl\"",
            "\"hodl\": `mode` is \"hodl\"; expected one of \"safe\", \"hold\" | did you mean \"hold\"?",
        ),
        ("every = \"1s\"\non = 1", "1: `on` is the whole number 1; expected true or false | as in `on = true`"),
        ("every = \"1s\"\nlevel = [1]", "[1]: `level` is a list; expected a constant | as in `level = 0`"),
        (
            "every = \"1s\"\nlevel = 1979-05-27",
            "1979-05-27: `level` is a date; expected a constant | as in `level = 0`",
        ),
        (
            "every = \"1s\"\nlevel = 9223372036854775808",
            "9223372036854775808: `level` is the whole number 9223372036854775808, which does not fit into 64 bits; expected a constant | as in `level = 0`",
        ),
        (
            "every = \"1s\"\nfolders = [\"a\", 2]",
            "2: `folders` is the whole number 2; expected a string | as in `folders = \"text\"`",
        ),
        ("every = \"1s\"\npoint = {}", "{}: `point` has no `register` | add `register = 0`: Address."),
        ("every = \"1s\"\npoints.a = { register = 70000 }", "70000: `register` is 70000; expected 0 to 65535"),
        ("every = \"1s\"\ncpu = 8", "8: `cpu` is 8; expected 0 to 7"),
        (
            "every = \"1s\"\ncpu = \"x\"",
            "\"x\": `cpu` is the string \"x\"; expected a whole number 0 to 7, or true or false | as in `cpu = 0`",
        ),
    ] {
        let (_, said) = read(text);
        assert_eq!(said, [expected], "{text}");
    }
}

#[test]
fn all_are_told_at_once() {
    let (_, said) = read("mode = 1\non = 2\ncolour = 3\nlevel = []\n");
    assert_eq!(said.len(), 5, "{said:#?}");
    assert!(said[4].contains("has no `every`"), "{said:#?}");
}

#[test]
fn broken_text_is_told_at_its_place() {
    for (text, expected) in [
        ("every = \"1s\nmode = \"safe\"", "this is no TOML: invalid basic string, expected `\"`"),
        ("mode = safe", "safe: `safe` is no value; a string stands in quotes | write \"safe\""),
        ("[x", "this is no TOML: unclosed table, expected `]`"),
        ("a = 1\na = 2", "a: `a` stands here for the second time"),
    ] {
        let (_, said) = read(text);
        assert!(said[0].contains(expected), "{text}: {said:#?}");
    }
}

#[test]
fn a_table_that_stands_twice_is_one_finding() {
    let text = "[a]\nx = 1\ny = 2\n[b]\nz = 1\n[a]\nx = 3\ny = 4\n[b]\nz = 2\n";
    let (_, findings) = parse(text);
    let at: Vec<_> = findings.iter().filter_map(|f| f.span.clone()).map(|s| (s.start, &text[s])).collect();
    assert_eq!(at, [(27, "a"), (43, "b")]);
}

#[test]
fn the_reference_shows_every_key_and_stays_a_table() {
    let page = reference(&LANE);
    for key in LANE.keys {
        assert!(page.contains(&format!("| `{}` |", key.name)), "{page}");
    }
    assert!(page.contains("| `every` | duration, 100µs to 1h | required | Period. |"), "{page}");
    assert!(page.contains("What a \\| means."), "{page}");
}

#[test]
fn the_schema_says_what_the_checker_checks() {
    let schema = json_schema(&[&LANE]);
    assert_eq!(schema["additionalProperties"], json!(false));
    assert_eq!(schema["required"], json!(["every"]));
    let properties = &schema["properties"];
    assert_eq!(properties["mode"]["enum"], json!(["safe", "hold"]));
    assert_eq!(properties["point"]["properties"]["register"]["maximum"], json!(65535));
    assert_eq!(properties["points"]["additionalProperties"]["required"], json!(["register"]));
    assert_eq!(properties["cpu"]["anyOf"][1]["type"], json!("boolean"));
}
