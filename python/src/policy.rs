//! Policies: their import from files, bundles and bytes.

use std::collections::BTreeMap;
use std::fs;
use std::path::{Path, PathBuf};
use std::sync::Arc;

use actq::import::contract::StatedLimits;
use actq::import::json::PolicyJson;
use actq::import::{FILES, Importer as _, PolicySource, Sampler};
use actq::measure::actions::actions;
use actq::measure::size::hex;
use actq_cli::commands::bundle::{Gathered, refuse_open_questions};
use actq_cli::importers::load;
use actq_cli::outputs::unfinished::Scratch;
use actq_cli::probes::probes;
use actq_cli::report::deployment;
use actq_deploy::{Answers, Bundle, DESCRIPTION, DeployFolder, read, targets};
use actq_onnx::{ImportOptions, Imported, Onnx, import, import_bytes};
use anyhow::anyhow;
use numpy::{
    AllowTypeChange, IntoPyArray as _, PyArrayDyn, PyArrayLikeDyn, PyArrayMethods as _, PyUntypedArrayMethods as _,
};
use pyo3::prelude::*;
use pyo3::types::{PyBytes, PyDict, PyTuple};

use crate::arrays::floats;
use crate::error::{OrRaise as _, error, given, raise_of_import};
use crate::work;

/// A policy in f32, as it was trained.
///
/// `actq.import_policy` makes one.
#[pyclass(frozen, module = "actq")]
pub(crate) struct Policy {
    pub(crate) policy: Arc<actq::policy::Policy>,
    /// Its two files, which `pickle` writes; a bundle has more.
    files: Option<[Vec<u8>; 2]>,
    /// Folder of a bundle's description, which recordings of raw values need.
    _folder: Option<Scratch>,
}

impl Policy {
    fn new(policy: actq::policy::Policy, files: Option<[Vec<u8>; 2]>) -> Self {
        Self { policy: Arc::new(policy), files, _folder: None }
    }

    /// Returns the folder of its recordings; `None` if it was not read from files.
    pub(crate) fn folder(&self) -> Option<&Path> {
        Some(&*self.policy.dir).filter(|folder| !folder.as_os_str().is_empty())
    }
}

#[pymethods]
impl Policy {
    /// Name of the policy.
    #[getter]
    fn name(&self) -> &str {
        &self.policy.name
    }

    /// Values of an observation; of a policy from a deploy bundle, raw values.
    #[getter]
    fn obs_len(&self) -> usize {
        self.policy.around.as_ref().map_or(self.policy.graph.obs_len, actq::around::Around::raw_len)
    }

    /// Values of an action.
    #[getter]
    fn act_len(&self) -> usize {
        self.policy.around.as_ref().map_or(self.policy.act_len, actq::around::Around::action_len)
    }

    /// Actions in the network's output; 1 without action chunks.
    #[getter]
    fn chunk(&self) -> usize {
        self.policy.chunk
    }

    /// Actions executed of a chunk.
    #[getter]
    fn execute(&self) -> usize {
        self.policy.execute
    }

    /// Control rate in Hz.
    #[getter]
    fn rate_hz(&self) -> f32 {
        self.policy.rate_hz
    }

    /// Number of trained values.
    #[getter]
    fn parameters(&self) -> usize {
        self.policy.parameters
    }

    /// Values of the recurrent state; 0 without one.
    #[getter]
    fn state_len(&self) -> usize {
        self.policy.graph.state_len()
    }

    /// Inputs and outputs of its source, as `actq import` prints them: what each is, and those that are left out. Empty
    /// for other sources than ONNX and modules.
    #[getter]
    fn ports(&self) -> &str {
        &self.policy.ports
    }

    /// Outputs of its source that are named action but cannot be a part of it, with the reasons.
    #[getter]
    fn refused(&self) -> Vec<String> {
        self.policy.refused.clone()
    }

    /// SHA-256 of the policy's files, as `Image.source` has it.
    #[getter]
    fn digest(&self) -> String {
        hex(&self.policy.digest)
    }

    /// Returns the actions at observations [step, value], one after the other from the start of an episode, or at one
    /// observation [value]; with scale, offset and limits, before what acts on executed actions: step limits, smoothing,
    /// two-state actions, playback. A chunk is one row; a head that denoises takes its noise after the observation. The
    /// policy of a deploy bundle takes raw values and gives its targets.
    fn __call__<'py>(
        &self,
        py: Python<'py>,
        #[pyo3(from_py_with = floats)] observations: PyArrayLikeDyn<'py, f32, AllowTypeChange>,
    ) -> PyResult<Bound<'py, PyArrayDyn<f32>>> {
        let is_bundle = self.policy.around.is_some();
        let (len, values_of) = match is_bundle {
            true => (self.obs_len(), self.act_len()),
            false => (self.policy.graph.input_len(), self.policy.chunk * self.policy.act_len),
        };
        let given = observations.shape().to_vec();
        let shape = match given[..] {
            [values] if values == len => vec![values_of],
            [steps, values] if values == len => vec![steps, values_of],
            _ => {
                let noise = if is_bundle { 0 } else { len - self.policy.graph.obs_len };
                let of = if noise > 0 { format!(" ({noise} of them noise)") } else { String::new() };
                return Err(error!(
                    "the observations have the shape {given:?}; use [{len}]{of} for one, or [steps, {len}]"
                ));
            }
        };
        let observations: Vec<f32> = observations.as_array().iter().copied().collect();
        if let Some(at) = observations.iter().position(|value| !value.is_finite()) {
            let (step, index) = (at / len, at % len);
            return Err(error!("observation value {index} of step {step} is not finite; pass finite observations"));
        }
        let rows: Vec<Vec<f32>> = observations.chunks(len).map(<[f32]>::to_vec).collect();
        let policy = Arc::clone(&self.policy);
        let run = move || if is_bundle { targets(&policy.dir, &rows) } else { Ok(actions(&policy, &rows)) };
        let actions = work::interruptible(py, None, move |_| Ok(run().or_raise()))??;
        if let Some(step) = actions.iter().position(|row| row.iter().any(|value| value.is_nan())) {
            return Err(error!("step {step}: a value inside the network exceeds float32; pass smaller observations"));
        }
        actions.concat().into_pyarray(py).reshape(shape)
    }

    /// Returns the policy itself, because it never changes.
    fn __copy__(slf: Py<Self>) -> Py<Self> {
        slf
    }

    fn __deepcopy__(slf: Py<Self>, _memo: &Bound<'_, PyAny>) -> Py<Self> {
        slf
    }

    /// Returns how `pickle` makes the policy again: from the contents of its files.
    fn __reduce__<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyTuple>> {
        let Some([json, weights]) = &self.files else {
            return Err(error!("a policy of a deploy bundle cannot be pickled; import it in each process"));
        };
        let make = py.import("actq._actq")?.getattr("policy_of_files")?;
        let files = (PyBytes::new(py, json), PyBytes::new(py, weights));
        (make, (files.0, files.1, self.policy.guards.clone(), self.policy.dir.clone())).into_pyobject(py)
    }

    fn __repr__(&self) -> String {
        format!(
            "Policy({:?}, {} observations -> {} actions, {} parameters)",
            self.policy.name,
            self.obs_len(),
            self.act_len(),
            self.policy.parameters
        )
    }
}

/// Reads a policy from the contents of its two files; `dir` is the folder of its recordings.
#[pyfunction]
pub(crate) fn policy_of_files(json: Vec<u8>, weights: Vec<u8>, guards: Vec<String>, dir: PathBuf) -> PyResult<Policy> {
    let name = Path::new("a pickled policy");
    let policy = actq::policy::Policy::of_files(&dir, [name, name], &json, &weights).or_raise()?;
    Ok(Policy::new(actq::policy::Policy { guards, ..policy }, Some([json, weights])))
}

/// Reads a policy folder, an ONNX file, or a deploy bundle.
#[pyfunction]
#[pyo3(signature = (path, *, output, states, observe, prefix, limits, rate_hz, accept_profile, answers, profile, sampler))]
#[expect(clippy::too_many_arguments, reason = "Python passes them by name")]
pub(crate) fn import_path(
    py: Python<'_>,
    #[pyo3(from_py_with = given)] path: PathBuf,
    #[pyo3(from_py_with = given)] output: Option<String>,
    #[pyo3(from_py_with = given)] states: Vec<(String, String)>,
    #[pyo3(from_py_with = given)] observe: Vec<String>,
    #[pyo3(from_py_with = given)] prefix: Vec<String>,
    #[pyo3(from_py_with = given)] limits: [Vec<f64>; 3],
    #[pyo3(from_py_with = given)] rate_hz: Option<f64>,
    #[pyo3(from_py_with = given)] accept_profile: bool,
    #[pyo3(from_py_with = given)] answers: String,
    #[pyo3(from_py_with = given)] profile: Option<String>,
    #[pyo3(from_py_with = given)] sampler: Option<String>,
) -> PyResult<Policy> {
    let import = move || {
        let limits = stated(limits);
        let sampler = sampler.map(|text| Sampler::parse(text.as_bytes())).transpose().or_raise()?;
        let observed = observe;
        let options =
            ImportOptions { output, states, observed, prefix, limits, rate_hz, sampler, ..ImportOptions::default() };
        let is_answered = accept_profile || !answers.is_empty() || profile.is_some();
        let is_onnx = Onnx.accepts(&path);
        if is_onnx && !is_answered {
            let imported = import(&path, &options).map_err(raise_of_import)?;
            let policy = imported.policy(&path, &path).or_raise()?;
            return Ok(Policy::new(policy, Some(imported.source.files().or_raise()?)));
        }
        if options.sampler.is_some() {
            return Err(error!("{}: only an ONNX file takes sampler, without answers of a bundle", path.display()));
        }
        let lists = [options.states.is_empty(), options.observed.is_empty(), options.prefix.is_empty()];
        let names_values = options.output.is_some() || lists.contains(&false);
        if is_onnx && (names_values || options.rate_hz.is_some()) {
            return Err(error!(
                "{}: a bundle takes no output, states, observe, prefix and rate_hz: its description has them",
                path.display()
            ));
        }
        if names_values {
            return Err(error!("{}: only an ONNX file takes output, states, observe and prefix", path.display()));
        }
        let is_policy = DeployFolder.accepts(&path) || path.join(FILES[0]).is_file();
        // Answers make a bundle of an ONNX file, as they do for `actq import`.
        let is_bundle = is_onnx || path.is_dir() || path.extension().is_some_and(|ending| ending == "kinfer");
        if options.rate_hz.is_some() {
            return Err(error!("{}: only an ONNX file takes rate_hz; this source states its rate", path.display()));
        }
        if is_bundle && !is_policy {
            return import_bundle(&path, accept_profile, &answers, profile.as_deref(), &options.limits);
        }
        if !options.limits.is_empty() && DeployFolder.accepts(&path) {
            return Err(error!(
                "{}: was imported already; import its bundle with limits, or set them in deploy.toml",
                path.display()
            ));
        }
        if is_answered {
            return Err(error!("{}: only a deploy bundle takes accept_profile, answers and profile", path.display()));
        }
        let policy = load(&path).or_raise()?;
        let files = FILES.map(|name| fs::read(path.join(name)));
        let own = if let [Ok(json), Ok(weights)] = files { Some([json, weights]) } else { None };
        let Some(own) = own.filter(|_| !DeployFolder.accepts(&path)) else { return Ok(Policy::new(policy, None)) };
        if options.limits.is_empty() {
            return Ok(Policy::new(policy, Some(own)));
        }
        let own =
            limited(own, &options.limits).map_err(|error| error.context(path.display().to_string())).or_raise()?;
        let names = FILES.map(|name| path.join(name));
        let policy = actq::policy::Policy::of_files(&path, [&names[0], &names[1]], &own[0], &own[1]).or_raise()?;
        Ok(Policy::new(policy, Some(own)))
    };
    // The exception of a failed import is the result of the work.
    work::interruptible(py, None, move |_| Ok(import()))?
}

/// Adds limits to the files of a policy folder.
fn limited([json, weights]: [Vec<u8>; 2], limits: &StatedLimits) -> actq::error::Result<[Vec<u8>; 2]> {
    let mut json = PolicyJson::parse(&json)?;
    json.action = Some(json.action.unwrap_or_default().limited(limits, json.act_dim)?);
    let [json, _] = PolicySource { json, about: Vec::new(), tensors: BTreeMap::new() }.files()?;
    Ok([json, weights])
}

/// Imports a bundle into a temporary folder, as `actq import` does into a lasting one.
fn import_bundle(
    path: &Path,
    accept_profile: bool,
    answers: &str,
    profile: Option<&str>,
    limits: &StatedLimits,
) -> PyResult<Policy> {
    let mut bundle = Bundle::open(path).or_raise()?;
    if let Some(profile) = profile {
        bundle = bundle.with_profile(profile);
    }
    let mut reading = read(&bundle, accept_profile, Answers::parse(answers).or_raise()?).or_raise()?;
    refuse_open_questions(&reading)
        .map_err(|error| anyhow!("{}{error:#}", deployment::questions(&reading.questions)))
        .or_raise()?;
    if !limits.is_empty() {
        reading.limit(limits, &bundle).or_raise()?;
    }
    let folder = Scratch::new().or_raise()?;
    for (name, content) in Gathered::of(&bundle, &reading).or_raise()?.files {
        let place = folder.path().join(name);
        fs::create_dir_all(place.parent().unwrap_or(folder.path())).or_raise()?;
        fs::write(place, content).or_raise()?;
    }
    let mut policy = load(folder.path()).map_err(|error| error.context(DESCRIPTION)).or_raise()?;
    policy.dir = folder.path().to_owned();
    Ok(Policy { policy: Arc::new(policy), files: None, _folder: Some(folder) })
}

/// Returns the lowest and highest values and the largest steps that a caller passes.
fn stated([low, high, max_step]: [Vec<f64>; 3]) -> StatedLimits {
    StatedLimits { low, high, max_step }
}

/// Largest magnitudes of the observations that a module is compared on, and the number of them for each: so different
/// that the branches of a module are met.
const MAGNITUDES: [f32; 7] = [2.0, 0.002, 0.02, 0.2, 20.0, 200.0, 2000.0];
const FRAMES: usize = 32;

/// Reads the bytes of an ONNX file; `parts` are the names and lengths of the parts of its only input, if it has some.
/// Returns the policy, and how to compare its source with it: observed inputs, pairs of
/// states, the output, drawn observations [block, frame, value], and the policy's actions on them without the limits of
/// the caller.
#[pyfunction]
#[pyo3(signature = (bytes, *, name, output, states, observe, limits, rate_hz, parts))]
#[expect(clippy::too_many_arguments, reason = "Python passes them by name")]
pub(crate) fn import_onnx<'py>(
    py: Python<'py>,
    bytes: Vec<u8>,
    #[pyo3(from_py_with = given)] name: String,
    #[pyo3(from_py_with = given)] output: Option<String>,
    #[pyo3(from_py_with = given)] states: Vec<(String, String)>,
    #[pyo3(from_py_with = given)] observe: Vec<String>,
    #[pyo3(from_py_with = given)] limits: [Vec<f64>; 3],
    #[pyo3(from_py_with = given)] rate_hz: Option<f64>,
    #[pyo3(from_py_with = given)] parts: Vec<(String, usize)>,
) -> PyResult<(Policy, Bound<'py, PyDict>)> {
    let import = move || {
        let limits = stated(limits);
        let options = ImportOptions { output, states, observed: observe, rate_hz, ..ImportOptions::default() };
        let import = |options: &ImportOptions| {
            let imported = import_bytes(bytes.clone(), Path::new(""), &name, options);
            let imported = imported.map_err(|error| raise_of_import(error.context(name.clone())))?;
            let policy = imported.policy(Path::new(""), Path::new(&name)).or_raise()?;
            PyResult::Ok((imported, policy))
        };
        let (imported, policy) = import(&options)?;
        let probes = probes(&imported, &policy, &MAGNITUDES, FRAMES);
        let actions = actions(&policy, &probes);
        let (source, mut policy) = match limits.is_empty() {
            true => (imported.source.clone(), policy),
            false => {
                let (limited, policy) = import(&ImportOptions { limits, ..options })?;
                (limited.source, policy)
            }
        };
        let files = source.files().or_raise()?;
        if let [(_, len)] = imported.inputs[..]
            && len == parts.iter().map(|(_, len)| len).sum::<usize>()
        {
            policy.ports = Imported { inputs: parts, ..imported.clone() }.described();
        }
        PyResult::Ok((imported, Policy::new(policy, Some(files)), probes, actions))
    };
    let (imported, policy, probes, actions) = work::interruptible(py, None, move |_| Ok(import()))??;
    let plan = PyDict::new(py);
    plan.set_item("inputs", imported.inputs)?;
    plan.set_item("states", imported.states.into_iter().map(|(from, to, _)| (from, to)).collect::<Vec<_>>())?;
    plan.set_item("output", imported.output.0)?;
    for (key, rows) in [("probes", probes), ("actions", actions)] {
        let shape = [rows.len() / FRAMES, FRAMES, rows.first().map_or(0, Vec::len)];
        plan.set_item(key, rows.concat().into_pyarray(py).reshape(shape)?)?;
    }
    Ok((policy, plan))
}
