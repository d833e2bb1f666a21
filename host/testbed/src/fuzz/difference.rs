//! What a failure is: growth, a late execution, or two instances that differ, and why.

use super::report::Kind;
use super::sequence::Sequence;
use super::trial::{Failure, Trial, Twin};
use super::write;

/// What the last execution of a sequence took, ns; `None` when it never ended.
pub(super) fn last_execution(probe: &mut Trial<'_>, sequence: &Sequence) -> Option<u64> {
    let last = sequence.steps.len() - 1;
    probe.watched = Some((last, sequence.steps[last].repeat - 1));
    let ran = probe.run(sequence, Twin::default());
    probe.watched = None;
    match ran {
        Err(failure) if failure.kind == Kind::Budget => None,
        _ => Some(probe.watched_ns),
    }
}

/// Memory grew in each of the last `periods` doublings of the executions.
pub(super) fn grows(memory: &[u64], power: u32, periods: u32) -> bool {
    let at = |power: u32| memory.get(power as usize);
    (power - periods + 1..=power).all(|p| at(p).zip(at(p - 1)).is_some_and(|(now, before)| now > before))
}

/// Two instances differ: whether by themselves, or because one was disturbed.
pub(super) fn classify(probe: &mut Trial<'_>, sequence: &Sequence, failure: &Failure) -> (Kind, Twin) {
    if failure.kind != Kind::NotDeterministic {
        return (failure.kind, Twin::default());
    }
    let mut differ = |told| matches!(probe.run(sequence, told), Err(f) if f.kind == Kind::NotDeterministic);
    let all = Twin { saves: true, refusals: true };
    if differ(all) {
        return (Kind::NotDeterministic, all);
    }
    let (saves, refusals) = (Twin { refusals: false, ..all }, Twin { saves: false, ..all });
    if differ(saves) {
        return (Kind::RefusalDisturbs, saves);
    }
    let told = if differ(refusals) { refusals } else { Twin::default() };
    // What cannot be had again was never the same.
    let kind = if differ(told) { Kind::SaveDisturbs } else { Kind::NotDeterministic };
    (kind, told)
}

/// Outputs differ, in a sentence.
pub(super) fn differs(probe: &Trial<'_>, failure: &Failure, kind: Kind) -> String {
    let names = write::output_names(probe.class());
    let list: Vec<_> = probe.differing(failure).into_iter().map(|i| names[i].as_str()).collect();
    let (list, one) = (list.join(", "), list.len() == 1);
    let verb = if one { "is" } else { "are" };
    match kind {
        Kind::NotRestored => {
            format!(
                "after a restart {list} {verb} not what it would be without: `retained` lacks something, or restore forgets it"
            )
        }
        Kind::SaveDisturbs => format!("{list} {verb} otherwise once its state was saved: `save` must change nothing"),
        Kind::RefusalDisturbs => {
            format!("{list} {verb} otherwise once it refused settings: those before must stay in force as they were")
        }
        _ => format!("{list} {verb} not the same in two instances that were told the same"),
    }
}

#[cfg(test)]
mod tests {
    use super::grows;

    #[test]
    fn memory_grows_for_ever_only_if_it_grew_in_every_doubling() {
        assert!(grows(&[1, 1, 2, 4], 3, 2));
        assert!(!grows(&[1, 2, 4, 4], 3, 2));
        assert!(!grows(&[1, 2, 2, 4], 3, 2));
        assert!(!grows(&[1, 2], 3, 2), "too short to tell");
    }
}
