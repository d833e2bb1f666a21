//! The reference page and the editor's schema say what the check checks: all come from the same tables.

use std::path::Path;

const MARK: &str = "<!-- The rest is written by";

#[test]
fn the_page_shows_the_keys_that_are_checked() {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../docs/plant-file.md");
    let page = std::fs::read_to_string(&path).expect("docs/plant-file.md");
    let mark = page.find(MARK).expect("the mark after which the page is written");
    let line = page[mark..].find('\n').map_or(page.len(), |n| mark + n + 1);
    let expected = format!("{}\n{}", &page[..line], latchwork_plant::schema::reference_page());
    if std::env::var_os("LATCHWORK_BLESS").is_some() {
        std::fs::write(&path, &expected).expect("docs/plant-file.md is written");
        return;
    }
    assert!(page == expected, "docs/plant-file.md is out of date: run this test with LATCHWORK_BLESS=1");
}

#[test]
fn the_schema_is_the_golden_one() {
    insta::assert_json_snapshot!(latchwork_plant::schema::json_schema());
}
