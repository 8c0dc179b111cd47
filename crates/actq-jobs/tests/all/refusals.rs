//! Plans and stores that are refused. Specs that are, are cases of the command.

use std::cell::RefCell;
use std::collections::BTreeSet;
use std::fs;
use std::path::Path;
use std::slice;

use crate::common::{Fake, SPEC, files, folder, jobs, run_all};
use actq_jobs::job::Job;
use actq_jobs::order;
use actq_jobs::run::run;
use actq_jobs::schedule::{Counts, Ended, Schedule};
use actq_jobs::store::Store;

#[test]
fn one_policy_has_one_address() {
    let twice = SPEC.replace("policies = [\"policy\"]", "policies = [\"policy\", \"./policy\"]");
    let error = jobs(&folder(&twice)).expect_err("two jobs of one address");
    assert!(format!("{error:#}").contains("have one address"), "{error:#}");
}

#[test]
fn damaged_plans_are_refused() {
    let plan = jobs(&folder(SPEC)).expect("a plan");
    let refused = |text: &str, expected: &str| {
        let error = format!("{:#}", order::read(text).expect_err(expected));
        assert!(error.contains(expected), "{expected}: {error}");
    };
    let text = order::text(&plan).expect("text");
    refused("", "has no job");
    refused("{}", "line 1");
    let (first, rest) = text.split_once('\n').expect("lines");
    refused(&format!("{text}{first}"), "have one address");
    refused(rest, "which is not in the plan");
    // The first image waits for the merge, which waits for all.
    let waits = first.replace("\"deps\":[]", &format!("\"deps\":[\"{}\"]", plan.last().expect("a job").address));
    refused(&format!("{waits}\n{rest}"), "\"deps\" are not the addresses in its options");
    refused(&text.replacen("\"seed\":1", "\"seed\":2", 1), "must not be edited");
    refused(&text.replacen("\"steps\":null", "\"steps\":null,\"minutes\":1.0", 1), "has the option minutes");
    refused(&text.replacen("\"steps\":null", "\"steps\":null,\"pace\":1", 1), "unknown field `pace`");
    refused(&text.replacen("\"version\":\"", "\"version\":\"9", 1), "was planned by version 9");
}

#[test]
fn other_folders_are_no_stores() {
    let (dir, host) = (folder(SPEC), Fake::default());
    let refused = |expected: &str| {
        let error = Store::open(dir.path(), &host).expect_err(expected);
        assert!(!error.again && format!("{:#}", error.error).contains(expected), "{:#}", error.error);
    };
    refused("is not empty, and has no store.json");
    fs::write(dir.path().join("store.json"), "{\"format\":\"actq-store\",\"version\":1}").expect("written");
    refused("is a store of version 1, and this is actq with stores of version 2");
    fs::write(dir.path().join("store.json"), "{}").expect("written");
    refused("is not that of a store");
}

#[test]
fn workers_can_open_one_new_store_together() {
    let dir = tempfile::tempdir().expect("a folder");
    for round in 0..50 {
        let path = dir.path().join(round.to_string());
        std::thread::scope(|scope| {
            for worker in 0..4 {
                let path = &path;
                scope.spawn(move || {
                    Store::open(path, &Fake::default()).expect("a store");
                    fs::write(path.join(format!("{worker}.json")), "{}").expect("a result");
                });
            }
        });
    }
}

#[test]
fn reading_makes_no_store() {
    let dir = folder(SPEC);
    let (typo, empty) = (dir.path().join("typo"), dir.path().join("empty"));
    fs::create_dir(&empty).expect("a folder");
    let refused = |path: &Path, expected: &str| {
        let error = Store::open_existing(path).expect_err(expected);
        assert!(!error.again && format!("{:#}", error.error).contains(expected), "{:#}", error.error);
    };
    refused(&typo, "typo: there is no such folder; name the folder of the results");
    refused(dir.path(), "is not empty, and has no store.json");
    assert!(!typo.exists());
    let store = Store::open_existing(&empty).expect("an empty store");
    assert!(!store.has(&"0".repeat(64)) && files(&empty).is_empty());
}

#[test]
fn damaged_results_are_not_used() {
    let (dir, host) = (folder(SPEC), Fake::default());
    let plan = jobs(&dir).expect("a plan");
    let store = Store::open(&dir.path().join("store"), &host).expect("a store");
    let quantize = plan.iter().find(|job| job.title.contains("rtn at 20")).expect("a job");
    let evaluate = plan.iter().find(|job| job.deps == [quantize.address.clone()]).expect("a job");
    let run = |job: &Job| run(job, &store, &host, &mut |_, _| ());
    assert!(run(quantize).expect("made"));
    let before = files(store.folder());
    fs::write(store.image(&quantize.address), "other").expect("written");
    let error = run(evaluate).expect_err("a damaged image");
    assert!(!error.again && format!("{:#}", error.error).contains("is damaged (its checksum"), "{:#}", error.error);
    fs::remove_file(store.image(&quantize.address)).expect("removed");
    let error = run(evaluate).expect_err("a missing image");
    assert!(!error.again && format!("{:#}", error.error).contains(".actq: is missing"), "{:#}", error.error);
    fs::write(store.folder().join(format!("{}.json", quantize.address)), "{\"format\":1").expect("written");
    let error = run(evaluate).expect_err("a damaged result");
    assert!(format!("{:#}", error.error).contains(".json: is damaged"), "{:#}", error.error);
    // As the errors say: the job runs again.
    assert!(run(quantize).expect("made again"));
    assert_eq!(files(store.folder()), before);
}

#[test]
fn any_changed_byte_of_a_store_is_noticed() {
    let (dir, host) = (folder(SPEC), Fake::default());
    let plan = jobs(&dir).expect("a plan");
    let path = dir.path().join("store");
    run_all(&plan, &path, &host).expect("they run");
    let store = Store::open_existing(&path).expect("a store");
    let kinds: BTreeSet<&str> = plan.iter().map(|job| job.work.kind()).collect();
    for kind in kinds {
        let job = plan.iter().find(|job| job.work.kind() == kind && store.has(&job.address)).expect(kind);
        for ending in ["json", "actq", "npz"] {
            let file = store.file(&job.address, ending);
            let Ok(whole) = fs::read(&file) else { continue };
            let noticed = |bytes: &[u8], what: &str| {
                fs::write(&file, bytes).expect("written");
                let damage = store.results(slice::from_ref(job)).damaged.first().map(|damage| format!("{damage:#}"));
                let named = damage.as_ref().is_some_and(|text| text.contains(&*file.to_string_lossy()));
                assert!(named && !store.has(&job.address), "{kind}, {ending}, {what}: {damage:?}");
            };
            // A recording has thousands of bytes, all under one digest.
            for place in (0..whole.len()).step_by(1 + whole.len() / 1000) {
                let mut other = whole.clone();
                other[place] ^= 1;
                noticed(&other, &format!("byte {place}"));
            }
            (0..whole.len()).step_by(1 + whole.len() / 50).for_each(|cut| noticed(&whole[..cut], "cut"));
            noticed(&[&whole[..], b"\n"].concat(), "longer");
            fs::write(&file, &whole).expect("written");
            assert!(store.has(&job.address) && store.results(slice::from_ref(job)).damaged.is_empty());
        }
    }
}

#[test]
fn failed_jobs_retry_or_skip_their_dependents() {
    let plan = jobs(&folder(SPEC)).expect("a plan");
    let mut schedule = Schedule::new(&plan, |_| false, 2);
    let first = schedule.start(1).expect("a job");
    assert!(plan[first].title.contains("distill"), "the longest job is first: {}", plan[first].title);
    assert!(schedule.end(first, Ended::Again), "a first failure is tried again");
    assert_eq!(schedule.start(1), Some(first));
    assert!(!schedule.end(first, Ended::Again), "a second one is not");
    // Its measurements, its round, the round's measurements, and the merge.
    let Counts { failed, skipped, .. } = schedule.counts();
    assert_eq!((failed, skipped), (1, 6 + 2 + 1 + 6 + 1));
    let mut left = 0;
    while let Some(job) = schedule.start(1) {
        assert!(plan[job].deps.iter().all(|dep| *dep != plan[first].address));
        schedule.end(job, Ended::Done);
        left += 1;
    }
    let Counts { done, running, all, .. } = schedule.counts();
    assert_eq!((done, running, all), (left, 0, left + 17));
    // A job that takes more cores than are free waits, and runs if it is alone.
    let mut wide = plan.clone();
    wide.iter_mut().for_each(|job| job.cpus = 4);
    let mut schedule = Schedule::new(&wide, |_| false, 1);
    let alone = schedule.start(2).expect("it runs alone");
    assert_eq!(schedule.start(2), None);
    schedule.end(alone, Ended::Never);
    assert!(schedule.start(2).is_some());
}

/// Jobs of a sweep that was killed may still run, and write results while the next one begins.
#[test]
fn no_job_starts_before_its_dependencies_end() {
    let plan = jobs(&folder(SPEC)).expect("a plan");
    let asked = RefCell::new(BTreeSet::new());
    let mut schedule = Schedule::new(&plan, |job| !asked.borrow_mut().insert(job.address.clone()), 1);
    let mut ended = BTreeSet::new();
    while let Some(job) = schedule.start(1) {
        assert!(plan[job].deps.iter().all(|dep| ended.contains(dep)), "{}", plan[job].title);
        schedule.end(job, Ended::Done);
        ended.insert(plan[job].address.clone());
    }
    assert_eq!(ended.len(), plan.len());
}
