//! A whole spec: its plan, its jobs, and their results.

use std::fs;

use crate::common::{Fake, SPEC, files, folder, jobs, run_all};
use actq::budget::{Budget, TimeLimit};
use actq_jobs::order;
use actq_jobs::plan::Jobs;
use actq_jobs::record::Outcome;
use actq_jobs::results::{Merged, MergedImage};
use actq_jobs::run::run;
use actq_jobs::store::Store;
use actq_jobs::work::{Custom, Work};

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
    // By budget, then by method: rtn, distill, and round 1 of distill.
    assert_eq!(policy.images.iter().map(|image| image.round).collect::<Vec<_>>(), [0, 0, 1, 0, 0, 1]);
    assert!(policy.images[0].made.is_none(), "rtn has no image of 1 bit");
    for image in policy.images.iter().filter(|image| image.budget == Budget::BitsPerWeight(20.0)) {
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
    let curves = policy.curves();
    let names: Vec<(&str, usize)> = curves.iter().map(|(name, images)| (name.as_str(), images.len())).collect();
    assert_eq!(names, [("rtn", 2), ("distill", 2), ("distill, round 1", 2)]);
    assert!(policy.knee.is_none(), "two points have no bend");
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

/// The text of a plan's options that say how an image is made.
fn makes(spec: &str) -> Vec<String> {
    let plan = jobs(&folder(spec)).expect("a plan");
    let make = |job: &actq_jobs::job::Job| match &job.work {
        Work::Quantize(make) => Some(format!("{} {} {:?} {:?}", make.method, make.budget, make.effort, make.widths)),
        _ => None,
    };
    plan.iter().filter_map(make).collect()
}

#[test]
fn every_budget_and_option_makes_an_image() {
    let spec = |keys: &str| format!("policies = [\"policy\"]\nmethods = [\"distill\"]\n{keys}\n");
    let keys = "bits = [3]\nbpw = [20]\nflash = [\"2K\", 4096]\nmax_nmse = [0.5]\nsteps = 2\nwidths = { in = 8 }";
    let of = |budget: &str| format!("distill {budget} Default {{\"in\": 8}}");
    let budgets = ["width 3", "20 bits", "NMSE 0.5", "2048 bytes", "4096 bytes"].map(of);
    assert_eq!(makes(&spec(keys)), budgets);
    // Together, every image keeps a size and a time.
    let both = "flash = [\"2K\", \"4K\"]\nms = [1, 2.5]\nclock = \"84M\"\neffort = \"quick\"";
    let of = |budget: &str| format!("distill {budget} Quick {{}}");
    let expected = ["1 ms, 2048 bytes", "1 ms, 4096 bytes", "2.5 ms, 2048 bytes", "2.5 ms, 4096 bytes"].map(of);
    assert_eq!(makes(&spec(both)), expected);

    // All of them run; the impossible ones say why.
    let found = merged(&folder(&spec(&format!("{keys}\nms = [1e-9, 5]\nclock = \"84M\""))));
    assert_eq!(found.clock_hz, 84e6);
    let images = &found.policies[0].images;
    let is_made = |image: &MergedImage| image.made.is_some();
    // A size goes with each time: 1e-9 ms with 2K and 4K, then 5 ms.
    assert_eq!(images.iter().map(is_made).collect::<Vec<_>>(), [true, true, true, false, false, true, true]);
    for image in images {
        let Some(made) = &image.made else { continue };
        match image.budget {
            Budget::ImageBytes(bytes) => assert!(made.image.bytes <= bytes),
            Budget::MaxNmse(nmse) => assert!(made.nmse <= nmse, "{}", made.nmse),
            Budget::Time(TimeLimit { milliseconds, image_bytes, .. }) => {
                assert!(made.milliseconds(found.clock_hz) <= milliseconds);
                assert!(image_bytes.is_none_or(|bytes| made.image.bytes <= bytes));
            }
            Budget::Width(_) | Budget::BitsPerWeight(_) => (),
        }
        if image.budget == Budget::BitsPerWeight(20.0) {
            assert!(made.image.rows[0].keys().all(|bits| [0, 8].contains(bits)), "{:?}", made.image.rows);
        }
    }
}

#[test]
fn every_option_is_part_of_the_address() {
    let address = |more: &str| {
        let spec = format!("policies = [\"policy\"]\nmethods = [\"distill\"]\n{more}\n");
        jobs(&folder(&spec)).expect(more)[0].address.clone()
    };
    let all = [
        "bpw = [3]",
        "bpw = [3.5]",
        "bits = [3]",
        "flash = [4096]",
        "ms = [3]",
        "ms = [3]\nclock = \"84M\"",
        "ms = [3]\nflash = [4096]",
        "max_nmse = [0.1]",
        "bpw = [3]\neffort = \"quick\"",
        "bpw = [3]\nsteps = 2",
        "bpw = [3]\nrelative = true",
        "bpw = [3]\ngroup = 32",
        "bpw = [3]\nactivations = 16",
        "bpw = [3]\nwidths = { in = 4 }",
        "bpw = [3]\nseeds = [2]",
        "bpw = [3]\ncalib = [\"policy/calib.npz\"]",
    ];
    let addresses: std::collections::BTreeSet<String> = all.iter().map(|more| address(more)).collect();
    assert_eq!(addresses.len(), all.len());
    assert_eq!(address("bpw = [3]\nclock = \"84M\"\ncpus = 4"), address("bpw = [3]"), "no image depends on these");
}

#[test]
fn named_recordings_replace_those_of_the_policy() {
    let spec = "policies = [\"policy\"]\nmethods = [\"distill\"]\nbpw = [20]\nsteps = 2\n";
    let own = merged(&folder(spec));
    let named = format!("{spec}calib = [\"other\"]\nheldout = \"h.npz\"\n");
    let dir = folder(&named);
    fs::create_dir(dir.path().join("other")).expect("a folder");
    for (from, to) in [("calib", "other/a"), ("heldout", "other/b"), ("heldout", "h")] {
        fs::copy(dir.path().join(format!("policy/{from}.npz")), dir.path().join(format!("{to}.npz"))).expect("copied");
    }
    fs::remove_file(dir.path().join("policy/calib.npz")).expect("removed");
    let other = merged(&dir);
    let frames = |merged: &Merged| merged.policies[0].images[0].made.as_ref().map(|made| made.image.frames);
    assert_eq!((frames(&own), frames(&other)), (Some(250), Some(500)));
}

#[test]
fn custom_work_reads_the_results_it_needs() {
    let dir = folder(SPEC);
    let mut plan = Jobs::default();
    let work = |name: &str, needs: Vec<String>| {
        Work::Custom(Custom { name: name.to_owned(), options: serde_json::json!({"n": 2}), needs })
    };
    let size = (1, 1, 1.0);
    let first = plan.add("first".into(), work("double", Vec::new()), Vec::new(), size).expect("added");
    let last = plan.add("last".into(), work("double", vec![first]), Vec::new(), size).expect("added");
    let other = plan.add("other".into(), work("unknown", Vec::new()), Vec::new(), size).expect("added");
    let plan = plan.finish().expect("a plan");
    assert_eq!(order::read(&order::text(&plan).expect("text")).expect("a plan"), plan);
    let (path, host) = (dir.path().join("store"), Fake::default());
    assert_eq!(run_all(&plan[..2], &path, &host).expect("both run"), 2);
    let store = Store::open(&path, &host).expect("a store");
    match store.read(&last).expect("a result") {
        Outcome::Custom(found) => assert_eq!(found.value, 8),
        found => panic!("{found:?}"),
    }
    assert_eq!(fs::read(store.file(&last, "txt")).expect("a file"), b"8");
    let error = run_all(&plan[2..], &path, &host).expect_err("no such work");
    assert!(!error.again && format!("{:#}", error.error).contains("unknown"), "{:#}", error.error);
    assert!(!store.has(&other));
}
