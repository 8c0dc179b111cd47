//! A small policy in a folder, and a host without processes.

use std::cell::Cell;
use std::fs;
use std::io::Error as IoError;
use std::path::{Path, PathBuf};

use actq::data::{Dataset, NpzWriter, Sizes};
use actq::error::{Error, Result};
use actq::methods::Method;
use actq::pipeline::driven::DriveOutcome;
use actq::policy::Policy;
use actq::random::Random;
use actq_jobs::error::JobError;
use actq_jobs::host::{Found, Host, Needed, Rolled, Rollout};
use actq_jobs::job::Job;
use actq_jobs::plan;
use actq_jobs::run::run;
use actq_jobs::spec::Spec;
use actq_jobs::store::Store;
use actq_jobs::work::Custom;
use actq_testkit::f32_tensors;
use ndarray::Array3;
use tempfile::TempDir;

const OBS: usize = 4;
const HIDDEN: usize = 32;
const ACT: usize = 2;

/// A spec with everything, for the policy of [`folder`].
pub(crate) const SPEC: &str = r#"
policies = ["policy"]
methods = ["rtn", "distill"]
bpw = [1, 20]
steps = 2

[evaluate]
per_job = 2

[drive]
command = "simulator"
episodes = 5
first_seed = 100
per_job = 2

[learn]
rounds = 1
episodes = 3
first_seed = 10
"#;

/// A folder with a policy, recordings and the spec `sweep.toml`.
pub(crate) fn folder(spec: &str) -> TempDir {
    let dir = TempDir::new().expect("a folder");
    let policy = dir.path().join("policy");
    fs::create_dir(&policy).expect("a folder");
    let ops = r#"[{"op": "linear", "w": "in"}, {"op": "tanh"}, {"op": "linear", "w": "out"}]"#;
    let json = format!(r#"{{"name": "tiny", "obs_dim": {OBS}, "act_dim": {ACT}, "ops": {ops}}}"#);
    fs::write(policy.join("policy.json"), json).expect("written");
    let mut random = Random::new(7);
    let mut values = |n: usize| (0..n).map(|_| random.unit()).collect::<Vec<f32>>();
    let tensors = [("in", [HIDDEN, OBS], values(HIDDEN * OBS)), ("out", [ACT, HIDDEN], values(ACT * HIDDEN))];
    fs::write(policy.join("policy.safetensors"), f32_tensors(tensors)).expect("written");
    for (name, seed) in [("calib.npz", 1), ("heldout.npz", 2)] {
        let mut random = Random::new(seed);
        let obs = Array3::from_shape_simple_fn((5, 50, OBS), || random.unit());
        let file = fs::File::create(policy.join(name)).expect("a file");
        let mut npz = NpzWriter::new(file);
        npz.array("obs", obs.shape(), obs.iter().copied()).expect("written");
        npz.finish().expect("written");
    }
    fs::write(dir.path().join("sweep.toml"), spec).expect("written");
    dir
}

/// A host whose command succeeds for even seeds, and whose disk may be full.
#[derive(Default)]
pub(crate) struct Fake {
    /// Writes that still succeed, if they are limited.
    pub(crate) writes_left: Cell<Option<usize>>,
    /// Jobs of kind drive that ran.
    pub(crate) drives: Cell<usize>,
}

impl Host for Fake {
    fn load(&self, policy: &Path) -> Result<Policy> {
        Policy::load(policy)
    }

    fn files(&self, policy: &Path) -> Vec<PathBuf> {
        ["policy.json", "policy.safetensors"].map(|name| policy.join(name)).into()
    }

    fn recorded(&self, policy: &Policy, recording: &Path) -> Result<Dataset> {
        Dataset::load(recording, Sizes::of(policy))
    }

    fn method(&self, name: &str) -> Result<Method> {
        match name {
            "rtn" => Ok(Method::Rtn),
            "distill" => Ok(Method::Distill),
            _ => Err(Error::input(format!("method {name:?} is unknown"))),
        }
    }

    fn write(&self, path: &Path, bytes: &[u8]) -> Result<()> {
        if let Some(left) = self.writes_left.get() {
            if left == 0 {
                return Err(Error::from(IoError::from(std::io::ErrorKind::StorageFull)));
            }
            self.writes_left.set(Some(left - 1));
        }
        // Whole or absent, as a host must.
        let name = path.file_name().expect("a name").to_string_lossy();
        let part = path.with_file_name(format!(".{name}-{:?}.part", std::thread::current().id()));
        fs::write(&part, bytes)?;
        Ok(fs::rename(part, path)?)
    }

    fn drive(&self, rollout: &Rollout<'_>) -> Result<Rolled, JobError> {
        self.drives.set(self.drives.get() + 1);
        assert!(rollout.image.is_file() && rollout.command == "simulator");
        let seeds = rollout.first..rollout.first + rollout.count;
        let successes = seeds.clone().filter(|seed| seed % 2 == 0).count();
        let line = format!(
            r#"{{"episodes": {}, "success": {}, "reward": {}}}"#,
            rollout.count,
            successes as f64 / rollout.count as f64,
            rollout.first
        );
        let recording = |seed: u64| {
            let mut random = Random::new(seed);
            let obs = Array3::from_shape_simple_fn((1, 20, OBS), || 2.0 * random.unit());
            Dataset { path: "drive.npz".into(), obs, action: None, length: vec![20], state: None }
        };
        let recordings = if rollout.record.is_some() { seeds.map(recording).collect() } else { Vec::new() };
        Ok(Rolled { outcome: DriveOutcome::parse(&line), recordings })
    }

    /// Doubles the number of the options, or of the result that it needs, and writes it into a file.
    fn custom(
        &self,
        _job: &Job,
        work: &Custom,
        needs: &[Needed],
        _watch: &mut dyn FnMut(&str, f64),
    ) -> Result<Found, JobError> {
        if work.name != "double" {
            return Err(JobError::never(Error::input(format!("{} is unknown", work.name))));
        }
        let number = needs.first().map_or(&work.options["n"], |needed| &needed.value).as_u64().expect("a number");
        let text = (2 * number).to_string();
        if let Some(file) = needs.first().and_then(|needed| needed.file.as_ref()) {
            assert_eq!(fs::read_to_string(file).expect("a file"), number.to_string());
        }
        Ok(Found { value: (2 * number).into(), file: Some(("txt", text.into_bytes())) })
    }
}

/// Plans the spec of a folder.
pub(crate) fn jobs(dir: &TempDir) -> Result<Vec<Job>> {
    plan::jobs(&Spec::read(&dir.path().join("sweep.toml"))?, &Fake::default())
}

/// Runs all jobs in their order. Returns the number of those that ran.
pub(crate) fn run_all(jobs: &[Job], store: &Path, host: &Fake) -> Result<usize, JobError> {
    let store = Store::open(store, host)?;
    let mut ran = 0;
    for job in jobs {
        ran += usize::from(run(job, &store, host, &mut |_, _| ())?);
    }
    Ok(ran)
}

/// Names and contents of the files of a store.
pub(crate) fn files(store: &Path) -> Vec<(String, Vec<u8>)> {
    let entries = fs::read_dir(store).expect("a folder").map(|entry| entry.expect("an entry").path());
    let mut files: Vec<(String, Vec<u8>)> = entries
        .map(|path| {
            let name = path.file_name().expect("a name").to_string_lossy().into_owned();
            (name, fs::read(&path).expect("read"))
        })
        .collect();
    files.sort();
    files
}
