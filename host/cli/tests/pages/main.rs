//! The pages of languages do what they say: each command of them, from an empty folder to a swap in a running plant.
//!
//! How the tools are installed is not tried here, and a component that was built of the same files by the same tools before is not
//! built again. A language whose tools are not here is passed over; `LATCHWORK_LANGUAGES=c,zig` restricts the tests to some.

#[path = "../../../author/tests/languages/kept.rs"]
#[allow(dead_code, reason = "the figures are of no use here")]
mod kept;
mod page;
mod reader;

use latchwork_author::Language;
use reader::Reader;

/// Follows the page of a language as its reader would.
fn follow(language: Language) {
    if !kept::wanted(language) {
        return;
    }
    let mut reader = Reader::new(language);
    for step in page::steps(language) {
        if let Err(missing) = reader.take(&step) {
            return kept::skip(&format!("docs/blocks-in-{}.md: {missing}", language.name()));
        }
    }
    reader.has_done_everything();
}

#[test]
fn the_page_of_rust_leads_from_an_empty_folder_to_a_swap() {
    follow(Language::Rust);
}

#[test]
fn the_page_of_c_leads_from_an_empty_folder_to_a_swap() {
    follow(Language::C);
}

#[test]
fn the_page_of_cpp_leads_from_an_empty_folder_to_a_swap() {
    follow(Language::Cpp);
}

#[test]
fn the_page_of_python_leads_from_an_empty_folder_to_a_swap() {
    follow(Language::Python);
}

#[test]
fn the_page_of_javascript_leads_from_an_empty_folder_to_a_swap() {
    follow(Language::JavaScript);
}

#[test]
fn the_page_of_typescript_leads_from_an_empty_folder_to_a_swap() {
    follow(Language::TypeScript);
}

#[test]
fn the_page_of_go_leads_from_an_empty_folder_to_a_swap() {
    follow(Language::Go);
}

#[test]
fn the_page_of_zig_leads_from_an_empty_folder_to_a_swap() {
    follow(Language::Zig);
}

#[test]
fn the_page_of_assemblyscript_leads_from_an_empty_folder_to_a_swap() {
    follow(Language::AssemblyScript);
}
