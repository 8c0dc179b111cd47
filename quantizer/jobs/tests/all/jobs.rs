//! A whole spec: its plan, its jobs, and their results.

use std::fs;

use crate::common::{Fake, SPEC, files, folder, jobs, run_all};
use actq::pipeline::sweep::knee;
use actq_jobs::job::Work;
use actq_jobs::merged::Merged;
use actq_jobs::order;
use actq_jobs::record::Outcome;
use actq_jobs::run::run;
use actq_jobs::store::Store;

fn merged(dir: &tempfile::TempDir) -> Merged {
    let plan = jobs(dir).expect("a plan");
    let store = dir.path().join("store");
    run_all(&plan, &store, &Fake::default()).expect("all jobs run");
    let last = &plan.last().expect("a merge").address;
    let store = Store::open(&store, &Fake::default()).expect("a store");
    match store.read(last).expect("a result") {
        Outcome::Merged(merged) => merged,
        other => panic!("{other:?}"),
    }
}

#[test]
fn a_plan_has_every_combination_and_survives_text() {
    let dir = folder(SPEC);
    let plan = jobs(&dir).expect("a plan");
    let count = |kind: &str| plan.iter().filter(|job| job.work.kind() == kind).count();
    // 2 methods at 2 budgets, and for distill one more round each.
    assert_eq!((count("quantize"), count("learn"), count("merge")), (4, 2, 1));
    // 5 held-out episodes by 2; 5 episodes by 2, and 3 episodes by 2 to learn from.
    assert_eq!((count("evaluate"), count("drive")), (6 * 3, 6 * 3 + 2 * 2));
    for job in &plan {
        let stages = job.deps.iter().map(|dep| plan.iter().find(|job| job.address == *dep).expect("in the plan").stage);
        assert!(stages.clone().all(|stage| stage < job.stage), "{}", job.title);
        assert!(job.seconds > 0.0 && job.memory_mib > 0 && job.cpus == 1);
    }
    let text = order::text(&plan).expect("text");
    assert_eq!((text.lines().count(), order::read(&text).expect("a plan")), (plan.len(), plan.clone()));
    // The address does not depend on where the files are.
    let elsewhere = jobs(&folder(SPEC)).expect("a plan");
    let addresses = |plan: &[actq_jobs::job::Job]| plan.iter().map(|job| job.address.clone()).collect::<Vec<_>>();
    assert_eq!(addresses(&plan), addresses(&elsewhere));
    // It depends on the content of the policy and of recordings.
    fs::copy(dir.path().join("policy/heldout.npz"), dir.path().join("policy/calib.npz")).expect("copied");
    let changed = addresses(&jobs(&dir).expect("a plan"));
    let same = addresses(&plan).iter().zip(&changed).filter(|(a, b)| a == b).count();
    assert_eq!(same, 2 * (1 + 3 + 3), "only rtn does not read the calibration recording");
}

#[test]
fn results_do_not_depend_on_order_or_interruption() {
    let dir = folder(SPEC);
    let plan = jobs(&dir).expect("a plan");
    let [first, second] = ["one", "two"].map(|name| dir.path().join(name));
    let host = Fake::default();
    assert_eq!(run_all(&plan, &first, &host).expect("all run"), plan.len());
    assert_eq!(run_all(&plan, &first, &host).expect("none runs"), 0, "a job with a result does not run again");
    // By stages, each from its last job on, and with a disk that is full in between.
    let mut by_stage = plan.clone();
    by_stage.reverse();
    by_stage.sort_by_key(|job| job.stage);
    let full = Fake::default();
    for writes in [0, 1, 2, 5, 9] {
        full.writes_left.set(Some(writes));
        let error = run_all(&by_stage, &second, &full).expect_err("a full disk");
        assert!(error.again && error.to_string().len() > 5, "{error}");
    }
    full.writes_left.set(None);
    let ran = run_all(&by_stage, &second, &full).expect("the rest runs");
    assert!((1..plan.len()).contains(&ran), "{ran}");
    assert_eq!(files(&first), files(&second));
}

#[test]
fn counts_of_episodes_add_up() {
    let merged = merged(&folder(SPEC));
    let [policy] = &merged.policies[..] else { panic!("one policy") };
    assert_eq!(policy.images.iter().map(|image| image.round).collect::<Vec<_>>(), [0, 0, 0, 1, 0, 1]);
    assert!(policy.images[0].made.is_none(), "rtn has no image of 1 bit");
    for image in policy.images.iter().filter(|image| image.budget == 20.0) {
        let made = image.made.as_ref().expect("an image");
        let driven = made.driven.as_ref().expect("episodes");
        // Seeds 100 to 104 in three jobs; the mean of the first seeds 100, 102 and 104, by episodes.
        assert_eq!((driven.episodes, driven.successes, made.success()), (5, Some(3), Some(0.6)));
        assert!((driven.numbers["reward"] - (2.0 * 100.0 + 2.0 * 102.0 + 104.0) / 5.0).abs() < 1e-9);
        let [low, high] = made.interval.expect("an interval");
        assert!((low - 0.231).abs() < 1e-3 && (high - 0.882).abs() < 1e-3, "{low} {high}");
        assert_eq!(made.observations, 250);
    }
    let learned = |image: usize| policy.images[image].made.as_ref().map(|made| made.image.frames);
    assert_eq!((learned(4), learned(5)), (Some(250), Some(310)), "round 1 learns from 3 episodes more");
    for (frontier, smaller) in [(&policy.frontier, true), (&policy.success_frontier, true)] {
        let bytes = |i: &usize| policy.images[*i].made.as_ref().map(|made| made.image.bytes);
        assert_eq!(frontier.is_sorted_by_key(bytes), smaller);
    }
    let sweep = policy.sweep();
    let names: Vec<&str> = sweep.curves.iter().map(|curve| curve.method.as_str()).collect();
    assert_eq!((names, &sweep.budgets[..]), (vec!["rtn", "distill", "distill, round 1"], &[1.0, 20.0][..]));
    assert_eq!(knee(&sweep.curves).is_some(), sweep.knee.is_some());
}

#[test]
fn divided_measurements_give_the_whole_error() {
    let whole = merged(&folder(&SPEC.replace("per_job = 2", "per_job = 99")));
    let divided = merged(&folder(SPEC));
    let error = |merged: &Merged| {
        // An image of a later round also depends on the division, by the order of its recordings.
        let first = merged.policies[0].images.iter().filter(|image| image.round == 0);
        let images = first.filter_map(|image| image.made.as_ref());
        images.map(|made| (made.nmse, made.max_abs)).collect::<Vec<_>>()
    };
    for ((a, a_max), (b, b_max)) in error(&whole).into_iter().zip(error(&divided)) {
        assert!((a - b).abs() <= 1e-12 * a && a_max == b_max, "{a} {b}");
    }
}

#[test]
fn changed_and_missing_inputs_stop_a_job() {
    let dir = folder(SPEC);
    let plan = jobs(&dir).expect("a plan");
    let host = Fake::default();
    let store = Store::open(&dir.path().join("store"), &host).expect("a store");
    let run = |job: &actq_jobs::job::Job| run(job, &store, &host, &mut |_, _| ());
    let evaluate = plan.iter().find(|job| matches!(job.work, Work::Evaluate(_))).expect("a job");
    let error = run(evaluate).expect_err("no image yet");
    assert!(error.again && format!("{:#}", error.error).contains("run that job first"), "{:#}", error.error);
    assert!(run(&plan[0]).expect("made"));
    fs::write(dir.path().join("policy/heldout.npz"), "other").expect("written");
    let error = run(evaluate).expect_err("another recording");
    assert!(!error.again && format!("{:#}", error.error).contains("has changed since"), "{:#}", error.error);
    fs::remove_file(dir.path().join("policy/heldout.npz")).expect("removed");
    let error = run(evaluate).expect_err("no recording");
    assert!(!error.again && format!("{:#}", error.error).contains("cannot read the file"), "{:#}", error.error);
    assert_eq!(files(store.folder()).len(), 2, "store.json and the first result");
}
