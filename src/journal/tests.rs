use std::time::Duration;

use super::*;

type Runs = Journal<(usize, (i64, i64), usize), Vec<f64>>;

fn answer(p: f64) -> Vec<f64> {
    vec![p, 1.0 / 3.0, -0.1 * p]
}

#[test]
fn a_torn_line_and_a_broken_one_are_runs_not_done() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("deep/a.journal");
    let journal = Runs::open(&path, "k", &()).unwrap();
    for i in 0..3 {
        journal.keep((0, (i, 1), 0), &answer(0.1 * i as f64));
    }
    drop(journal);
    let text = std::fs::read_to_string(&path).unwrap();
    let broken = text.replacen("\"id\":[0,[1,1],0]", "\"id\":[0,[1],0]", 1);
    std::fs::write(&path, &broken[..broken.len() - 5]).unwrap();
    let journal = Runs::open(&path, "k", &()).unwrap();
    assert_eq!(journal.outcome(&(0, (0, 1), 0)), Some(&answer(0.0)));
    assert_eq!(journal.outcome(&(0, (1, 1), 0)), None);
    assert_eq!(journal.outcome(&(0, (2, 1), 0)), None);
    journal.keep((0, (2, 1), 0), &answer(0.7));
    drop(journal);
    let journal = Runs::open(&path, "k", &()).unwrap();
    assert_eq!(journal.outcome(&(0, (2, 1), 0)), Some(&answer(0.7)));
    assert_eq!(journal.remove(), None);
    assert!(!path.exists());
}

#[test]
fn a_changed_number_is_no_result_and_neither_is_one_of_another_key() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("a.journal");
    let journal = Runs::open(&path, "one", &()).unwrap();
    journal.keep((0, (0, 0), 0), &answer(0.5));
    journal.keep((0, (1, 0), 0), &answer(0.5));
    drop(journal);
    let text = std::fs::read_to_string(&path).unwrap();
    // Still JSON, and a number that might have been computed.
    let changed = text.replacen("[0.5,", "[0.6,", 1);
    assert_ne!(changed, text);
    std::fs::write(&path, &changed).unwrap();
    let journal = Runs::open(&path, "one", &()).unwrap();
    assert_eq!(journal.outcome(&(0, (0, 0), 0)), None);
    assert_eq!(journal.outcome(&(0, (1, 0), 0)), Some(&answer(0.5)));
    assert_eq!(journal.damaged(), Some((path.as_path(), 1)));
    drop(journal);
    // The lines of one table under the key of another.
    std::fs::write(&path, text.replace("\"key\":\"one\"", "\"key\":\"two\"")).unwrap();
    let journal = Runs::open(&path, "two", &()).unwrap();
    assert_eq!(journal.damaged(), Some((path.as_path(), 2)));
}

#[test]
fn who_waits_for_another_process_is_told_and_may_stop() {
    struct Impatient(std::sync::atomic::AtomicUsize);
    impl Progress for Impatient {
        fn waiting(&self, path: &Path, _: Duration) {
            assert!(path.ends_with("a.journal"));
            self.0.fetch_add(1, std::sync::atomic::Ordering::Relaxed);
        }
        fn stop_asked(&self) -> bool {
            self.0.load(std::sync::atomic::Ordering::Relaxed) > 0
        }
    }
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("a.journal");
    let first = Runs::open(&path, "k", &()).unwrap();
    let second = Runs::open(&path, "k", &Impatient(0.into())).err().unwrap();
    assert!(matches!(second, JournalError::Stopped { .. }), "{second}");
    drop(first);
    Runs::open(&path, "k", &Impatient(0.into())).unwrap();
}

#[test]
fn journals_of_parts_are_joined_and_go_with_the_whole() {
    let folder = tempfile::tempdir().unwrap();
    let [a, b, other, whole] = ["a", "b", "other", "whole"].map(|n| folder.path().join(n));
    for (i, (path, key)) in [(&a, "k"), (&b, "k"), (&other, "x")]
        .into_iter()
        .enumerate()
    {
        let part = Runs::open(path, key, &()).unwrap();
        part.keep((0, (i as i64, 0), 0), &answer(i as f64));
        assert_eq!(part.trouble(), None);
    }
    // The last line of a part that still runs, or was killed, is not whole.
    let text = std::fs::read_to_string(&b).unwrap();
    std::fs::write(&b, format!("{text}{{\"id")).unwrap();
    let mut journal = Runs::open(&whole, "k", &()).unwrap();
    for part in [&a, &b, &other, &folder.path().join("none")] {
        journal.join(part, "k");
    }
    assert_eq!(journal.outcome(&(0, (0, 0), 0)), Some(&answer(0.0)));
    assert_eq!(journal.outcome(&(0, (1, 0), 0)), Some(&answer(1.0)));
    assert_eq!(journal.outcome(&(0, (2, 0), 0)), None);
    journal.remove();
    assert!(!a.exists() && !b.exists() && !whole.exists() && other.exists());
}

#[test]
fn another_tables_journal_is_begun_anew() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("a.journal");
    let journal = Runs::open(&path, "one", &()).unwrap();
    journal.keep((0, (0, 0), 0), &answer(0.5));
    drop(journal);
    let journal = Runs::open(&path, "two", &()).unwrap();
    assert_eq!(journal.outcome(&(0, (0, 0), 0)), None);
}
