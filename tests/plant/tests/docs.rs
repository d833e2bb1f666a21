//! "Your first plant" does what it says: the page's own files, and the trace it shows.

use latchwork_tests_plant::{Rig, component_folders};

/// The text of the n-th fenced block of a language, from 0.
fn fenced<'a>(page: &'a str, language: &str, n: usize) -> &'a str {
    let fence = format!("```{language}\n");
    let start = page.match_indices(&fence).nth(n).unwrap_or_else(|| panic!("no {language} block {n}")).0 + fence.len();
    let length = page[start..].find("```").expect("the end of the block");
    &page[start..start + length]
}

#[test]
fn the_first_plant_shows_the_trace_of_its_page() {
    let page = include_str!("../../../docs/first-plant.md");
    let plant = fenced(page, "toml", 0);
    let head = plant.find("[lane.main]").expect("a lane");
    assert!(plant[..head].contains("components = [\"target/components\"]"));
    component_folders();
    let rows = fenced(page, "csv", 0).strip_prefix("time,tag,value\n").expect("the header");
    let ran = Rig::new(&plant[head..]).stimulus(rows).trace(Some("hall.*")).run_for(5_000_000_000);
    let mut trace = String::from("time_ns,lane,tag,value\n");
    for (time, tag, value) in &ran.trace {
        trace += &format!("{time},main,{tag},{value}\n");
    }
    assert_eq!(trace, fenced(page, "csv", 1));
}
