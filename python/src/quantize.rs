//! Quantization, and the errors of an image.

use std::path::Path;
use std::sync::Arc;

use actq::budget::{Budget, TimeLimit};
use actq::data::{Recording, Recordings, Sizes, joined};
use actq::emit::{Core, repack};
use actq::graph::Graph;
use actq::measure::{check, eval, recorded};
use actq::methods::{Activations, Effort, MAX_MINUTES, Method, Options};
use actq::pipeline::{Quantizer, check_budget, minutes_of_image};
use actq::runtime::ImageBuffer;
use actq::units;
use actq_cli::importers::{learned, learned_from, recorded_sizes};
use actq_cli::report::notes;
use actq_kernels::Width;
use anyhow::bail;
use pyo3::prelude::*;
use pyo3::types::PyDict;

use crate::error::{OrRaise as _, error, given};
use crate::image::{Image, core_of, positive};
use crate::policy::Policy;
use crate::recordings::{Passed, passed};
use crate::work;

/// The options that Python passed, with the names of the arguments.
#[derive(FromPyObject)]
#[pyo3(from_item_all)]
pub(crate) struct Request {
    bits: Option<u32>,
    bpw: Option<f64>,
    flash: Option<usize>,
    ms: Option<f64>,
    max_nmse: Option<f64>,
    clock: f64,
    method: Option<String>,
    group: Option<usize>,
    activations: Option<u32>,
    core: Option<String>,
    widths: Vec<(String, u32)>,
    steps: Option<usize>,
    minutes: Option<f64>,
    effort: Option<String>,
    relative: bool,
    seed: u64,
}

impl Request {
    /// Returns the budget; without one, the method's default.
    fn budget(&self, graph: &Graph, method: &Method) -> PyResult<Budget> {
        let budgets = [
            self.bits.map(|bits| Ok(Budget::Width(width("bits", bits)?))),
            self.bpw.map(|bits| Ok(Budget::BitsPerWeight(positive("bpw", bits)?))),
            self.flash.filter(|_| self.ms.is_none()).map(|bytes| Ok(Budget::ImageBytes(bytes))),
            self.ms.map(|milliseconds| {
                let (milliseconds, clock_hz) = (positive("ms", milliseconds)?, positive("clock", self.clock)?);
                let core = self.core()?.unwrap_or(Core::M4f);
                Ok(Budget::Time(TimeLimit { milliseconds, core, clock_hz, image_bytes: self.flash }))
            }),
            self.max_nmse.map(|limit| Ok(Budget::MaxNmse(positive("max_nmse", limit)?))),
        ];
        let mut given = budgets.into_iter().flatten();
        let group = self.group.unwrap_or(method.default_group());
        let budget = given.next().unwrap_or_else(|| Ok(method.default_budget(graph, group, !self.widths.is_empty())));
        if given.next().is_some() {
            return Err(error!(
                "more than one budget is given; pass one of bits, bpw, flash, ms and max_nmse, or flash and ms"
            ));
        }
        budget
    }

    /// Returns the core; `None` for the default layouts.
    fn core(&self) -> PyResult<Option<Core>> {
        core_of(self.core.as_deref())
    }

    /// Returns the method; `None` for the default, which depends on the recordings.
    fn method(&self) -> PyResult<Option<Method>> {
        Ok(match self.method.as_deref() {
            None => None,
            Some("rtn") => Some(Method::Rtn),
            Some("gptq") => Some(Method::Gptq),
            Some("distill") => Some(Method::Distill),
            Some(other) => return Err(error!("method is {other:?}; use \"rtn\", \"gptq\" or \"distill\"")),
        })
    }

    /// Returns the options of a quantization by `method`.
    pub(crate) fn options(&self, graph: &Graph, method: Method) -> PyResult<Options> {
        let forced = self.widths.iter().map(|(name, bits)| Ok((name.clone(), width(name, *bits)?)));
        let minutes = self.minutes.map(|minutes| positive("minutes", minutes)).transpose()?;
        if minutes.is_some_and(|minutes| minutes > MAX_MINUTES) {
            return Err(error!("minutes is {}; use at most {MAX_MINUTES}, a week", minutes.unwrap_or_default()));
        }
        let budget = self.budget(graph, &method)?;
        let options = Options {
            group: self.group.unwrap_or(method.default_group()),
            activations: match self.activations {
                None => Activations::Auto,
                Some(bits) => {
                    Activations::of_bits(bits).ok_or_else(|| error!("activations is {bits}; use 8 or 16 bits"))?
                }
            },
            steps: self.steps,
            minutes,
            effort: match self.effort.as_deref() {
                None => Effort::Default,
                Some(name) => Effort::of_name(name)
                    .ok_or_else(|| error!("effort is {name:?}; use \"quick\", \"default\" or \"thorough\""))?,
            },
            relative: self.relative,
            seed: self.seed,
            forced: forced.collect::<PyResult<_>>()?,
            ..Options::new(method, budget)
        };
        options.check().and_then(|()| options.check_length()).or_raise()?;
        Ok(options)
    }
}

fn width(name: &str, bits: u32) -> PyResult<Width> {
    Width::from_bits(bits).ok_or_else(|| error!("{name} is {bits}; use 2, 3, 4 or 8 bits"))
}

/// An image, its error on frames that it did not learn from, or else on its recordings, warnings, and notes that matter
/// on a motor controller only.
type Quantized = (Image, Option<f64>, Vec<String>, Vec<String>);

/// Quantizes a policy.
#[pyfunction]
#[pyo3(signature = (policy, recordings, heldout, request, progress))]
pub(crate) fn quantize(
    py: Python<'_>,
    #[pyo3(from_py_with = given)] policy: PyRef<'_, Policy>,
    recordings: Option<&Bound<'_, PyAny>>,
    heldout: Option<&Bound<'_, PyAny>>,
    #[pyo3(from_py_with = given)] request: Request,
    progress: Option<&Bound<'_, PyAny>>,
) -> PyResult<Quantized> {
    let (calib, heldout) = (passed(recordings, "recordings")?, passed(heldout, "heldout")?);
    let folder = policy.folder();
    let found = folder.map(|folder| Recording::Calib.find(folder)).transpose().or_raise()?.flatten();
    let has_calib = !calib.is_empty() || found.is_some();
    let method = request.method()?;
    if !has_calib && method != Some(Method::Rtn) && folder.is_none_or(Path::is_file) {
        return Err(error!("{}", notes::how_to_record(&policy.policy)));
    }
    let core = request.core()?;
    let options = request
        .options(&policy.policy.graph, method.unwrap_or(if has_calib { Method::Distill } else { Method::Rtn }))?;
    let (mut options, policy, in_folder) = (options, policy.policy.clone(), folder.is_some());
    let (bytes, nmse, warnings, notes) = work::run(py, progress, move |worker| {
        check_budget(&policy, &options)?;
        let mut recordings = read(&policy, calib, heldout, in_folder)?;
        let mut warnings = notes::of_recordings(&recordings);
        warnings.extend(recorded::use_policy(&mut recordings, &policy.graph).iter().map(ToString::to_string));
        options.minutes = minutes_of_image(&policy, &recordings, &options);
        let calibrating = |share| worker.report("calibrating", share);
        let quantizer = Quantizer::new(&policy, &recordings, options.method.clone(), options.minutes, calibrating)?;
        warnings.extend(notes::mixed_units(quantizer.method().mixed_units()));
        let mut found = quantizer.quantize(&options, |work: &str, share| worker.report(work, share))?;
        warnings.extend(notes::unused_budget(&found, &options));
        let measuring = |share| worker.report("measuring the error", share);
        let held_out = match found.held_out.take() {
            Some(held_out) => Some(held_out),
            None => quantizer.held_out_error(&found, &options, measuring)?,
        };
        let alone = found.buffer();
        let image = alone.image(Path::new("image"))?;
        let mut notes = notes::of_policy(&policy);
        notes.extend(notes::one_width(&options));
        let check = check::check(&policy, image, &recordings, &options.method, held_out)?;
        if let Some(check) = &check {
            notes.push(notes::errors(check).trim_end().to_owned());
            warnings.extend(notes::of_check(check, &options));
        }
        let image = found.whole_image()?;
        let bytes = core.map_or(Ok(image.clone()), |core| repack(&image, core))?;
        Ok((bytes, check.and_then(|check| check.nmse()), warnings, notes))
    })?;
    Ok((Image::of(ImageBuffer::new(&bytes), Path::new("image"))?, nmse, warnings, notes))
}

/// Reads what was passed, or else what is in the policy's folder.
fn read(
    policy: &actq::policy::Policy,
    calib: Vec<Passed>,
    heldout: Vec<Passed>,
    in_folder: bool,
) -> anyhow::Result<Recordings> {
    let parts = |passed: Vec<Passed>| {
        let sizes = recorded_sizes(policy);
        passed.into_iter().map(|passed| passed.load(sizes)).collect::<Result<Vec<_>, _>>()
    };
    let calib = match calib.is_empty() {
        false => Some(learned_from(policy, parts(calib)?)?),
        true if in_folder => learned(policy, &[])?,
        true => None,
    };
    let heldout = match heldout.is_empty() {
        false => Some(learned_from(policy, parts(heldout)?)?.dataset),
        true if in_folder => Recording::Heldout.load(Some(&policy.dir), None, Sizes::of(policy))?,
        true => None,
    };
    Ok(Recordings { calib: calib.map(|learned| learned.dataset), heldout })
}

/// Runs an image over recordings; returns its errors against the f32 policy as a dict, and a warning if the recorded
/// actions are not the policy's.
#[pyfunction]
#[pyo3(signature = (image, recordings, policy, progress))]
pub(crate) fn evaluate<'py>(
    py: Python<'py>,
    #[pyo3(from_py_with = given)] image: Py<Image>,
    recordings: &Bound<'py, PyAny>,
    #[pyo3(from_py_with = given)] policy: Option<PyRef<'_, Policy>>,
    progress: Option<&Bound<'py, PyAny>>,
) -> PyResult<(Bound<'py, PyDict>, Option<String>)> {
    let passed = passed(Some(recordings), "recordings")?;
    let (buffer, policy) = (image.get().buffer().clone(), policy.map(|policy| Arc::clone(&policy.policy)));
    let (report, difference) = work::run(py, progress, move |worker| {
        let image = buffer.image(Path::new("image"))?;
        if image.has_around() {
            bail!("image: it takes raw inputs; compare it with a reference by `actq check`");
        }
        let source = policy.as_deref();
        if let Some(policy) = source.filter(|policy| policy.digest != image.digest()) {
            bail!("the image was made from another policy than {:?}; pass that one, or none", policy.name);
        }
        let parts: Vec<_> =
            passed.into_iter().map(|passed| passed.load(Sizes::of_image(&image))).collect::<Result<_, _>>()?;
        let mut dataset = match <[_; 1]>::try_from(parts) {
            Ok([one]) => one,
            Err(parts) => joined(&parts, image.state().len)?,
        };
        let difference = eval::fill_actions(&mut dataset, source)?;
        worker.report("running the image over the recordings", 0.0);
        Ok((eval::evaluate(image, &dataset)?, difference))
    })?;
    let errors = PyDict::new(py);
    errors.set_item("nmse", report.nmse)?;
    errors.set_item("worst_nmse", report.worst_nmse)?;
    errors.set_item("max_abs", report.max_abs)?;
    errors.set_item("steps", report.steps)?;
    errors.set_item("bpw", report.bpw)?;
    errors.set_item("bytes", report.bytes)?;
    Ok((errors, difference.map(|difference| difference.to_string())))
}

/// Returns the bytes of a text such as "96K".
#[pyfunction]
pub(crate) fn bytes_of(text: &str) -> PyResult<usize> {
    units::bytes(text).map_err(|error| error!("flash: {error}"))
}
