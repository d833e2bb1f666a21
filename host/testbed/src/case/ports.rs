//! The groups of ports of what is tested.

use super::model::Subject;
use super::values::Group;
use latchwork_block::Class;

fn of<'a>(
    subject: &'a Subject,
    name: &'static str,
    one: &'static str,
    ports: fn(&Class) -> &[latchwork_block::Port],
) -> Group<'a> {
    Group { component: subject.component.name(), name, one, ports: ports(&subject.class) }
}

pub(super) fn inputs(subject: &Subject) -> Group<'_> {
    of(subject, "inputs", "input", |c| &c.inputs)
}

pub(super) fn outputs(subject: &Subject) -> Group<'_> {
    of(subject, "outputs", "output", |c| &c.outputs)
}

pub(super) fn settings(subject: &Subject) -> Group<'_> {
    of(subject, "settings", "setting", |c| &c.settings)
}

pub(super) fn retained(subject: &Subject) -> Group<'_> {
    of(subject, "state", "retained field", |c| &c.retained)
}
