//! Goldens of every message an author may get from the macro, with the code each points to.

use crate::bind;
use proc_macro2::TokenStream;
use std::fmt::Write;

const TON: &str = r#""latchwork:device/ton""#;
const SCALE: &str = r#""latchwork:device/scale""#;

/// Every message for an attribute's arguments and the item below it, with the code it points to.
fn messages(args: &str, item: &str) -> String {
    let parse = |text: &str| text.parse::<TokenStream>().expect("Rust tokens");
    let errors = match bind::expand(parse(args), parse(item)) {
        Ok((_, errors)) => errors,
        Err(e) => e.into_iter().collect(),
    };
    assert!(!errors.is_empty(), "the macro accepted it");
    let mut out = format!("#[block({args})]\n{}\n", item.trim());
    for error in errors {
        let code = error.span().source_text().unwrap_or_default();
        let code = code.lines().next().unwrap_or("the attribute").to_owned();
        write!(out, "\nat {code}\n{}\n", shortened(&error.to_string())).expect("a String takes all");
    }
    out
}

/// A message without the rest of the list of our own classes: a new class changes no golden.
fn shortened(message: &str) -> String {
    const FIRST: &str = "(it has: alarm-unit, ";
    match message.split_once(FIRST).and_then(|(before, list)| Some((before, list.split_once(')')?))) {
        Some((before, (list, after))) => {
            assert!(list.split(", ").is_sorted() && list.split(", ").any(|c| c == "ton"), "{list}");
            format!("{before}{FIRST}…){after}")
        }
        None => message.to_owned(),
    }
}

/// A ton with one function replaced.
fn ton(execute: &str) -> String {
    format!(
        "impl Ton {{\n    {execute}\n    fn save(&self) -> Retained {{}}\n    fn restore(&mut self, state: Retained) {{}}\n}}"
    )
}

macro_rules! golden {
    ($($name:ident: $args:expr, $item:expr;)*) => {$(
        #[test]
        fn $name() {
            insta::with_settings!({ omit_expression => true, prepend_module_to_snapshot => false }, {
                insta::assert_snapshot!(stringify!($name), messages($args, &$item));
            });
        }
    )*};
}

golden! {
    no_class: "", "impl Ton {}";
    class_is_no_name: r#""ton""#, "impl Ton {}";
    unknown_argument: r#""latchwork:device/ton", path = "wit""#, "impl Ton {}";
    unknown_class: r#""latchwork:device/tonn""#, "impl Ton {}";
    unknown_package: r#""my:pumps/pump""#, "impl Pump {}";
    package_misspelt: r#""latchwork:devices/ton""#, "impl Ton {}";
    unknown_version: r#""latchwork:device/ton@0.2.0""#, "impl Ton {}";
    on_a_struct: TON, "struct Ton;";
    on_a_function: TON, "fn execute() {}";
    on_a_trait_impl: TON, "impl Default for Ton { fn default() -> Self { Self } }";
    generic: TON, ton("fn execute(&mut self, scan: Scan, inputs: Inputs) -> Outputs {}").replace("impl Ton", "impl<T> Ton<T>");
    nothing_written: TON, "impl Ton {}";
    execute_missing: TON, ton("");
    configure_missing: SCALE, "impl Scale {\n    fn defaults() -> Settings {}\n    fn execute(&mut self, scan: Scan, inputs: Inputs) -> Outputs {}\n}";
    save_and_restore_missing: TON, "impl Ton {\n    fn execute(&mut self, scan: Scan, inputs: Inputs) -> Outputs {}\n}";
    unknown_function: TON, ton("fn exceute(&mut self, scan: Scan, inputs: Inputs) -> Outputs {}");
    helper_among_the_functions: TON, ton("fn execute(&mut self, scan: Scan, inputs: Inputs) -> Outputs {}\n    fn advance(&mut self, by: u64) {}");
    parameter_missing: TON, ton("fn execute(&mut self, inputs: Inputs) -> Outputs {}");
    parameter_too_many: TON, ton("fn execute(&mut self, scan: Scan, inputs: Inputs, commands: Commands) -> Outputs {}");
    parameter_of_another_type: TON, ton("fn execute(&mut self, scan: Scan, inputs: &Inputs) -> Outputs {}");
    no_self: TON, ton("fn execute(scan: Scan, inputs: Inputs) -> Outputs {}");
    wrong_result: TON, ton("fn execute(&mut self, scan: Scan, inputs: Inputs) -> (Outputs, Alarms) {}");
    no_result: TON, ton("fn execute(&mut self, scan: Scan, inputs: Inputs) {}");
    alarms_forgotten: r#""latchwork:device/motor""#, "impl Motor {\n    fn configure(&mut self, settings: Settings) -> bool {}\n    fn execute(&mut self, scan: Scan, inputs: Inputs, commands: Commands) -> Outputs {}\n    fn save(&self) -> Retained {}\n    fn restore(&mut self, state: Retained) {}\n}";
    package_not_in_the_folder: r#""workshop:drive/conveyor", wit = "../../../tests/guests/small-user-class/wit""#, "impl Conveyor {}";
    no_wit_folder: r#""my:pumps/pump", wit = "wits""#, "impl Pump {}";
}

/// A folder of WIT files below this crate's, for the time of a test.
fn with_wit(text: &str, check: impl FnOnce(&str)) {
    let root = env!("CARGO_MANIFEST_DIR");
    let folder = tempfile::Builder::new().prefix("wit-").tempdir_in(root).expect("a folder");
    std::fs::write(folder.path().join("pump.wit"), text).expect("a file");
    check(folder.path().file_name().and_then(|n| n.to_str()).expect("a name"));
}

macro_rules! wit_golden {
    ($($name:ident: $wit:expr;)*) => {$(
        #[test]
        fn $name() {
            with_wit($wit, |folder| {
                let found = messages(&format!("\"my:pumps/pump\", wit = {folder:?}"), "impl Pump {}");
                let shown = format!("{}\n---\n{}", $wit, found.replace(folder, "wit"));
                insta::with_settings!({ omit_expression => true, prepend_module_to_snapshot => false }, {
                    insta::assert_snapshot!(stringify!($name), shown);
                });
            });
        }
    )*};
}

wit_golden! {
    wit_syntax_error: "package my:pumps;\ninterface pump {\n    record inputs { level f64 }\n}";
    wit_type_unknown: "package my:pumps;\ninterface pump {\n    use latchwork:block/types@0.1.0.{scan, span};\n    execute: func(scan: scan);\n}";
    wit_version_of_block_forgotten: "package my:pumps;\ninterface pump {\n    use latchwork:block/types.{scan};\n    execute: func(scan: scan);\n}";
    wit_class_without_execute: "package my:pumps;\ninterface pump {\n    record inputs { level: f64 }\n}";
    wit_function_unknown: "package my:pumps;\ninterface pump {\n    use latchwork:block/types@0.1.0.{scan};\n    execute: func(scan: scan);\n    calibrate: func();\n}";
    wit_execute_without_inputs: "package my:pumps;\ninterface pump {\n    use latchwork:block/types@0.1.0.{scan};\n    record inputs { level: f64 }\n    execute: func(scan: scan);\n}";
    wit_port_of_text: "package my:pumps;\ninterface pump {\n    use latchwork:block/types@0.1.0.{scan};\n    record plate { name: string }\n    record inputs { level: f64, plate: plate }\n    execute: func(scan: scan, inputs: inputs);\n}";
    wit_settings_without_configure: "package my:pumps;\ninterface pump {\n    use latchwork:block/types@0.1.0.{scan};\n    record settings { level: f64 }\n    execute: func(scan: scan);\n}";
}

#[test]
fn a_package_with_its_own_copy_of_the_shared_types_is_taken_as_it_is() {
    let wit = "package my:pumps;\ninterface pump {\n    use latchwork:block/types@0.1.0.{scan};\n    execute: func(scan: scan);\n}";
    with_wit(wit, |folder| {
        let deps = std::path::Path::new(env!("CARGO_MANIFEST_DIR")).join(folder).join("deps/block");
        std::fs::create_dir_all(&deps).expect("a folder");
        for (path, text) in latchwork_wit::BLOCK.files {
            let name = std::path::Path::new(path).file_name().expect("a name");
            std::fs::write(deps.join(name), text).expect("a file");
        }
        let args = format!("\"my:pumps/pump\", wit = {folder:?}").parse().expect("tokens");
        let item = "impl Pump { fn execute(&mut self, scan: Scan) {} }".parse().expect("tokens");
        let (_, errors) = bind::expand(args, item).expect("the class is found");
        assert!(errors.is_empty(), "{errors:?}");
    });
}
