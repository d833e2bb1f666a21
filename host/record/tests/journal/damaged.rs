//! A damaged file is set aside: what can be saved of it is, and no number comes twice.

use super::{all, begun, kept, next_notice, open, record, state_of};
use latchwork_record::journal::{Notice, Reader};
use tempfile::TempDir;

#[test]
fn a_damaged_file_is_set_aside_and_no_number_comes_twice() {
    let folder = TempDir::new().unwrap();
    let (mut journal, first) = open(folder.path());
    assert_eq!(first.journal.len(), 32);
    assert_ne!(first.journal, open(TempDir::new().unwrap().path()).1.journal);
    (1..=5000).for_each(|n| journal.push(&record(n, "before")));
    journal.close();
    let path = folder.path().join("journal.db");
    let mut bytes = std::fs::read(&path).unwrap();
    bytes[..100].fill(0x5a);
    std::fs::write(&path, bytes).unwrap();
    let (mut journal, opening) = open(folder.path());
    let aside = opening.set_aside.expect("the damaged file");
    assert!(aside.exists() && opening.last >= 5000, "{}", opening.last);
    journal.push(&record(opening.last + 1, "after"));
    journal.close();
    assert_eq!(all(folder.path()).len(), 1);
    // And once more: the first stays what it is.
    std::fs::write(&path, b"no database at all, and long enough to be looked at as one").unwrap();
    let (_, again) = open(folder.path());
    assert!(aside.exists() && again.set_aside.as_ref() != Some(&aside) && again.last > opening.last);
    // Numbers go on: it is the same journal.
    assert_eq!((&opening.journal, &again.journal), (&first.journal, &first.journal));
}

#[test]
fn state_comes_out_of_a_damaged_file_as_far_as_it_can_be_read() {
    let folder = TempDir::new().unwrap();
    let (mut journal, _) = open(folder.path());
    journal.watch().moved("file", 4000);
    (1..=5000).for_each(|n| journal.push_with(&record(n, "before"), state_of(n)));
    journal.close();
    let state = kept(folder.path());
    assert!(!state.is_empty());
    // The pages with the records, which come after those of the tables' roots, are overwritten.
    let path = folder.path().join("journal.db");
    let mut bytes = std::fs::read(&path).unwrap();
    let end = bytes.len();
    bytes[10 * 4096..end].fill(0x5a);
    std::fs::write(&path, bytes).unwrap();
    let (mut journal, opening) = open(folder.path());
    if opening.set_aside.is_none() {
        // Nothing that is read at the opening was hit: it is seen as soon as something is written.
        (opening.last + 1..=opening.last + 10).for_each(|n| journal.push(&record(n, "after")));
        journal.close();
    }
    assert_eq!(kept(folder.path()), state);
    let cursors = Reader::open(folder.path()).unwrap().cursors().unwrap();
    assert_eq!(cursors.get("file"), Some(&4000));
}

#[test]
fn an_empty_file_in_place_of_the_one_set_aside_gets_its_state_and_no_number_comes_twice() {
    let folder = TempDir::new().unwrap();
    let (journal, state) = begun(folder.path());
    journal.close();
    let file = |name: &str| folder.path().join(name);
    std::fs::rename(file("journal.db"), file("journal.damaged-1.db")).unwrap();
    std::fs::write(file("journal.db"), "").unwrap();
    for _ in 0..2 {
        let (_, opening) = open(folder.path());
        assert!(opening.last >= 50, "{}", opening.last);
        assert_eq!((opening.kept, opening.set_aside), (state.clone(), None));
    }
}

#[test]
fn damage_that_a_reader_meets_begins_a_new_file_and_tells_what_sinks_lack() {
    let folder = TempDir::new().unwrap();
    let (mut journal, state) = begun(folder.path());
    let watch = journal.watch();
    watch.damaged(watch.files() + 1, "that was another file");
    watch.damaged(watch.files(), "a page is malformed");
    assert!(matches!(next_notice(&journal), Notice::SetAside(aside) if aside.exists()));
    assert_eq!(next_notice(&journal), Notice::Dropped { sink: "slow".into(), count: 30 });
    assert_eq!((watch.files(), kept(folder.path())), (1, state));
    journal.push(&record(51, ""));
    journal.close();
    assert_eq!(all(folder.path()).iter().map(|r| r.seq).collect::<Vec<_>>(), [51]);
    // No record has told of it yet.
    let (journal, _) = open(folder.path());
    assert_eq!(next_notice(&journal), Notice::Dropped { sink: "slow".into(), count: 30 });
}
