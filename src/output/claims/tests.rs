use std::io::Write;

use super::*;

const QUICK: Lease = Lease { beat: Duration::from_millis(5), patience: Duration::from_millis(60) };

fn join(folder: &Path) -> Claims {
    Claims::join(folder, WorkerHeader::default(), QUICK).unwrap()
}

/// Makes a worker one of another machine, of which only its record tells.
fn send_away(folder: &Path, claims: &Claims) {
    let path = folder.join(FOLDER).join(format!("{}{RECORD}", claims.header.worker));
    let text = std::fs::read_to_string(&path).unwrap();
    std::fs::write(&path, text.replace(&claims.header.machine, "elsewhere")).unwrap();
}

#[test]
fn a_frame_has_one_owner_until_it_is_given_back() {
    let folder = tempfile::tempdir().unwrap();
    let (mut a, mut b) = (join(folder.path()), join(folder.path()));
    assert_eq!(a.take(7).unwrap(), Claim::Taken);
    assert_eq!(a.take(7).unwrap(), Claim::Taken);
    assert_eq!(b.take(7).unwrap(), Claim::Held(a.header.worker.clone()));
    assert_eq!(b.take(8).unwrap(), Claim::Taken);
    a.release(7);
    assert_eq!(b.take(7).unwrap(), Claim::Taken);
    b.end(1.0, "done");
    assert!(claims_in(&folder.path().join(FOLDER)).is_empty());
}

#[test]
fn who_dies_on_this_machine_is_followed_at_once() {
    let folder = tempfile::tempdir().unwrap();
    let (mut a, mut b) = (join(folder.path()), join(folder.path()));
    a.take(1).unwrap();
    drop(a);
    assert_eq!(b.take(1).unwrap(), Claim::Taken);
    assert_eq!(b.mine[&1], 2);
    let mut c = join(folder.path());
    assert_eq!(c.take(1).unwrap(), Claim::Held(b.header.worker.clone()));
    b.release(1);
    assert_eq!(c.take(1).unwrap(), Claim::Taken);
    assert_eq!(c.mine[&1], 1);
}

#[test]
fn who_is_silent_elsewhere_is_followed_after_the_lease_and_who_beats_is_not() {
    let folder = tempfile::tempdir().unwrap();
    let (mut a, mut b) = (join(folder.path()), join(folder.path()));
    a.take(1).unwrap();
    send_away(folder.path(), &a);
    let path = folder.path().join(FOLDER).join(format!("{}{RECORD}", a.header.worker));
    let mut beats = OpenOptions::new().append(true).open(path).unwrap();
    let start = Instant::now();
    while start.elapsed() < 3 * QUICK.patience {
        writeln!(beats, "{{}}").unwrap();
        assert_eq!(b.take(1).unwrap(), Claim::Held(a.header.worker.clone()));
        std::thread::sleep(QUICK.beat);
    }
    std::thread::sleep(2 * QUICK.patience);
    assert_eq!(b.take(1).unwrap(), Claim::Taken);
}

#[test]
fn many_who_follow_one_that_died_do_not_follow_together() {
    let folder = tempfile::tempdir().unwrap();
    for _ in 0..20 {
        let mut dead = join(folder.path());
        dead.take(5).unwrap();
        drop(dead);
        let barrier = std::sync::Barrier::new(6);
        let taken = std::sync::atomic::AtomicUsize::new(0);
        std::thread::scope(|scope| {
            for _ in 0..6 {
                scope.spawn(|| {
                    let mut claims = join(folder.path());
                    barrier.wait();
                    let is_ours = claims.take(5).unwrap() == Claim::Taken;
                    taken.fetch_add(usize::from(is_ours), std::sync::atomic::Ordering::Relaxed);
                    // Nobody leaves before all have tried.
                    barrier.wait();
                    claims.end(0.0, "done");
                });
            }
        });
        assert_eq!(taken.into_inner(), 1);
    }
}

#[test]
fn records_tell_what_happened_and_go_with_their_plan() {
    let folder = tempfile::tempdir().unwrap();
    let header = |plan: &str| WorkerHeader { plan: plan.into(), frames: "1-9".into(), ..WorkerHeader::default() };
    let mut a = Claims::join(folder.path(), header("one"), QUICK).unwrap();
    a.note(&WorkerEvent::Done { frame: 3, at: 2.0, seconds: 1.5, cost: 7.0 });
    a.end(3.0, "done");
    let seen = workers_in(&folder.path().join(FOLDER));
    assert_eq!((seen.len(), seen[0].ended(), seen[0].events.len()), (1, Some("done"), 2));
    assert_eq!(seen[0].header.frames, "1-9");
    drop(a);
    let _b = Claims::join(folder.path(), header("two"), QUICK).unwrap();
    let seen = workers_in(&folder.path().join(FOLDER));
    assert_eq!(seen.iter().map(|record| record.header.plan.as_str()).collect::<Vec<_>>(), ["two"]);
}
