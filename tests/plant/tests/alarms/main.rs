//! Alarms of a whole plant: rules, life, delays, groups, suppression, operators, and what outlives a run.

mod kept;
mod kinds;
mod operators;
mod rules;

use latchwork_record::{Kind, Record};
use latchwork_tests_plant::{Ran, Rig};

pub(crate) const MS: u64 = 1_000_000;

/// Three alarms whose conditions a stimulus makes: `a.alarms.alarm`, `b.alarms.alarm`, `c.alarms.alarm`.
pub(crate) fn plant(rules: &str) -> Rig {
    let block = |name: &str| {
        format!(
            "[block.{name}]\ncomponent = \"digital-alarm\"\nlane = \"main\"\ninputs.input = \"field.{name}\"\n\
             inputs.disable = false\n"
        )
    };
    Rig::new(&format!(
        "[lane.main]\nevery = \"10ms\"\n[driver.field]\nkind = \"sim\"\n[driver.field.points]\n\
         a = {{ type = \"bool\" }}\nb = {{ type = \"bool\" }}\nc = {{ type = \"bool\" }}\noff = {{ type = \"bool\" }}\n\
         {}{}{}{rules}",
        block("a"),
        block("b"),
        block("c"),
    ))
}

/// Alarm records as `time-in-ms source transition previous>current user`.
pub(crate) fn told(ran: &Ran) -> Vec<String> {
    ran.records.iter().filter(|r| r.kind == Kind::Alarm).map(line).collect()
}

pub(crate) fn line(r: &Record) -> String {
    let user = if r.user.is_empty() { String::new() } else { format!(" by {}", r.user) };
    let source = r.source.trim_end_matches(".alarms.alarm");
    format!("{} {source} {} {}>{}{user}", r.time / MS, r.transition, r.previous, r.current)
}
