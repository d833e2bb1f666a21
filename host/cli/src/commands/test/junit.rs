//! The report that build servers read: JUnit XML, a suite per file.

use super::{Round, Tested, Timed};
use crate::commands::alarms::printable;
use anyhow::Result;
use latchwork_image::{format_duration, plain};
use quick_xml::Writer;
use quick_xml::events::{BytesDecl, BytesText, Event};
use std::io;
use std::time::Duration;

type Xml = Writer<Vec<u8>>;

/// The whole document.
pub(super) fn document(round: &Round) -> Result<Vec<u8>> {
    let mut xml = Writer::new_with_indent(Vec::new(), b' ', 2);
    xml.write_event(Event::Decl(BytesDecl::new("1.0", Some("UTF-8"), None)))?;
    xml.create_element("testsuites")
        .with_attribute(("name", "latchwork"))
        .with_attribute(("tests", (round.cases().count() + round.wrong()).to_string().as_str()))
        .with_attribute(("failures", round.failed().to_string().as_str()))
        .with_attribute(("errors", round.wrong().to_string().as_str()))
        .with_attribute(("time", seconds(round.took).as_str()))
        .write_inner_content(|xml| round.files.iter().try_for_each(|f| suite(xml, f)))?;
    let mut bytes = xml.into_inner();
    bytes.push(b'\n');
    Ok(bytes)
}

fn suite(xml: &mut Xml, tested: &Tested) -> io::Result<()> {
    let path = plain(&tested.checked.path.display().to_string());
    let failed = tested.cases.iter().filter(|c| !c.report.passed).count();
    let wrong = usize::from(tested.checked.tests.is_none());
    xml.create_element("testsuite")
        .with_attribute(("name", printable(&path).as_ref()))
        .with_attribute(("tests", (tested.cases.len() + wrong).to_string().as_str()))
        .with_attribute(("failures", failed.to_string().as_str()))
        .with_attribute(("errors", wrong.to_string().as_str()))
        .with_attribute(("time", seconds(tested.cases.iter().map(|c| c.took).sum()).as_str()))
        .write_inner_content(|xml| {
            if wrong > 0 {
                let text = tested.checked.render(false);
                xml.create_element("testcase")
                    .with_attribute(("name", "the test file"))
                    .with_attribute(("classname", printable(&path).as_ref()))
                    .write_inner_content(|xml| told(xml, "error", "the file is wrong", &text))?;
            }
            tested.cases.iter().try_for_each(|c| case(xml, &path, c))
        })
        .map(drop)
}

fn case(xml: &mut Xml, path: &str, case: &Timed) -> io::Result<()> {
    // Two names that differ in what may not stand in XML are two.
    let name = plain(&case.report.name);
    let name = printable(&name);
    let time = seconds(case.took);
    let path = printable(path);
    let element = xml
        .create_element("testcase")
        .with_attribute(("name", name.as_ref()))
        .with_attribute(("classname", path.as_ref()))
        .with_attribute(("time", time.as_str()));
    let Some(first) = case.report.failures.first() else { return element.write_empty().map(drop) };
    let what = first
        .mismatches
        .first()
        .map_or(String::new(), |m| format!(": {} expected {}, got {}", m.what, m.expected, m.got));
    let message = format!("{} at {}{what}", first.step, format_duration(first.at_ns));
    let text = case.report.failures.iter().map(|f| f.render(0)).collect::<Vec<_>>().join("\n");
    element.write_inner_content(|xml| told(xml, "failure", &plain(&message), &text)).map(drop)
}

/// What went wrong, in a line and in full.
fn told(xml: &mut Xml, element: &str, message: &str, text: &str) -> io::Result<()> {
    // Whatever a block or a file says, the document stays well-formed.
    xml.create_element(element)
        .with_attribute(("message", printable(message).as_ref()))
        .write_text_content(BytesText::new(&printable(text)))
        .map(drop)
}

fn seconds(time: Duration) -> String {
    format!("{:.6}", time.as_secs_f64())
}
