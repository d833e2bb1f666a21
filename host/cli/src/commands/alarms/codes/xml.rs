//! The alarms for an HMI.
//!
//! The 16-bit word of an alarm is what an HMI knows of it: bit 0 active, 1 to acknowledge, 4 was active, 5 acknowledged. Its
//! actions say which bit a panel changes when the operator acknowledges or resets.

use super::super::printable;
use super::rule;
use anyhow::Result;
use latchwork_alarm::CodeKind;
use latchwork_plant::model::Model;
use quick_xml::Writer;
use quick_xml::events::{BytesDecl, BytesText, Event};

/// What an operator does, the bit that it changes, and to what.
const ACKNOWLEDGE: (&str, &str, &str) = ("ack", "5", "1");
const RESET: (&str, &str, &str) = ("reset", "4", "0");

/// The document: an element per alarm variable with a code.
pub(super) fn document(model: &Model) -> Result<String> {
    let mut xml = Writer::new_with_indent(Vec::new(), b' ', 2);
    xml.write_event(Event::Decl(BytesDecl::new("1.0", Some("UTF-8"), None)))?;
    xml.create_element("alarms").with_attribute(("plant", &*printable(&model.name))).write_inner_content(|xml| {
        for (id, variable) in (1..).zip(&model.variables) {
            let Some(rule) = rule(model, variable).filter(|r| r.code.is_alarm()) else { continue };
            let code = rule.code;
            let (ack, reset) = (code.must_be_acknowledged(), code.must_be_reset());
            let (id, name) = (format!("{id}"), printable(&variable.name));
            let (bits, priority) = (code.bits().to_string(), rule.priority.to_string());
            let mut alarm = xml.create_element("alarm").with_attributes([
                ("id", id.as_str()),
                ("tag", &name),
                ("kind", kind(code)),
                ("code", &bits),
                ("priority", &priority),
                ("requireAck", word(ack)),
                ("requireReset", word(reset)),
                // A text blinks as long as somebody must look at it.
                ("blinkTxt", word(ack)),
            ]);
            if let Some(group) = &variable.group {
                alarm = alarm.with_attribute(("group", &*printable(group)));
            }
            alarm.write_inner_content(|xml| {
                let text = if variable.text.is_empty() { &variable.name } else { &variable.text };
                xml.create_element("text").write_text_content(BytesText::new(&printable(text)))?;
                for (on, bit, value) in [(ack, ACKNOWLEDGE), (reset, RESET)].iter().filter(|a| a.0).map(|a| a.1) {
                    let does = [("on", on), ("do", "set-bit"), ("tag", &name), ("bit", bit), ("to", value)];
                    xml.create_element("action").with_attributes(does).write_empty()?;
                }
                Ok(())
            })?;
        }
        Ok(())
    })?;
    Ok(String::from_utf8(xml.into_inner())? + "\n")
}

fn kind(code: CodeKind) -> &'static str {
    match code {
        CodeKind::Warning => "warning",
        CodeKind::Message => "message",
        _ => "alarm",
    }
}

fn word(yes: bool) -> &'static str {
    if yes { "true" } else { "false" }
}
