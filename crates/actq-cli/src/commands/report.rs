//! `actq report`

use std::fs;
use std::path::{Path, PathBuf};

use actq::data::{Dataset, Recording, Sizes, driven_by, files_of, joined};
use actq::measure::size::hex;
use actq::measure::time::CLOCK;
use actq::measure::{eval, own};
use actq::pipeline::stats::Stats;
use actq::policy::Policy;
use actq::runtime::{ImageBuffer, refuse_prefix};
use actq::text::printable;
use actq_deploy::Raw;
use actq_jobs::record::Outcome;
use actq_jobs::results::MergedPolicy;
use actq_jobs::store::Store;
use actq_kernels::{Image, PortKind};
use anyhow::{Context as _, Result, ensure};
use ndarray::Array3;

use crate::args::ReportArgs;
use crate::importers::{load, policy_files};
use crate::report::export::sha256;
use crate::report::notes::{targets_without_limits, useless, without_limits};
use crate::report::page::facts::Facts;
use crate::report::page::parts::PARTS;
use crate::report::page::runs::{self, HeadData, Reference};
use crate::report::page::{Page, Success, Sweep, html, success_of};
use crate::terminal::{Progress, print, reserve};

/// Most MACs of the run that gives the printed error.
const MAX_MACS: usize = 4_000_000_000;

/// Writes the report of an image.
pub(crate) fn run(args: &ReportArgs) -> Result<()> {
    let recordings = files_of(&args.recordings)?;
    let driven = files_of(&args.driven)?;
    let inputs = [&args.image].into_iter().chain(&recordings).chain(&driven).chain(&args.stats).cloned();
    let outputs = reserve([&args.out], inputs.chain(args.policy.iter().flat_map(|dir| policy_files(dir))))?;
    let _progress = Progress::new(args.quiet, "running the image over the recordings")?;
    let buffer = ImageBuffer::read(&args.image)?;
    let image = buffer.image(&args.image)?;
    let policy = args.policy.as_deref().map(|dir| source_of(dir, &image)).transpose()?;
    let stats = args.stats.as_deref().map(|path| Stats::read(path, &image)).transpose()?;
    let (outcomes, driven): (Vec<_>, Vec<_>) =
        driven.into_iter().partition(|file| file.extension().is_some_and(|ending| ending == "json"));
    ensure!(outcomes.len() <= 1, "--driven: more than one .json file; name the one with the outcome of all episodes");
    let success = outcomes.first().map(|file| outcome_of(file, &driven)).transpose()?;
    driven.iter().try_for_each(|file| refuse_unnamed(file))?;
    let own = (!driven.is_empty()).then(|| own::own_path(image, &driven, policy.as_ref())).transpose()?;
    let dataset = dataset_of(&image, &recordings, args.policy.as_deref())?;
    let mut facts = Facts::new(&image, buffer.bytes(), stats.as_ref(), policy.as_ref(), args.clock)?;
    for file in recordings.iter().chain(dataset.iter().map(|dataset| &dataset.path).filter(|_| recordings.is_empty())) {
        let name = file.file_name().unwrap_or_default().to_string_lossy();
        facts.made.push(("recording compared on, SHA-256", format!("{} {}", digest(file)?, printable(&name))));
    }
    let sweep = args.store.as_deref().map(|store| sweep_of(store, &facts, args.clock)).transpose()?;
    let mut page = page(image, buffer.bytes(), facts, policy.as_ref(), dataset)?;
    if let Some(warning) = own.as_ref().and_then(|own| useless(own.nmse)) {
        page.warnings.push(format!("on the image's own path {warning}"));
    }
    page.own_path = own.map(|own| (own.nmse, own.steps));
    if let Some(sweep) = sweep {
        page.add(sweep);
    }
    page.success = success.or(page.success);
    let html = html(&page)?;
    let (shown, bytes) = (args.out.display(), html.len());
    outputs.write(&[html])?;
    print(&format!("{shown}: the report of {}, {bytes} bytes\n", args.image.display()))
}

/// Makes the report of an image; errors call it `name`. With the policy that it was made from, and recordings or the
/// ones in the policy's folder, it compares both.
///
/// # Errors
///
/// If policy or recordings do not match the image, or it cannot run on them.
pub fn of_image(buffer: &ImageBuffer, name: &Path, policy: Option<&Policy>, files: &[PathBuf]) -> Result<String> {
    let image = buffer.image(name)?;
    policy.map(|policy| of_policy(policy, &image)).transpose()?;
    let facts = Facts::new(&image, buffer.bytes(), None, policy, CLOCK)?;
    let folder = policy.map(|policy| &*policy.dir).filter(|dir| !dir.as_os_str().is_empty());
    let dataset = dataset_of(&image, files, folder)?;
    html(&page(image, buffer.bytes(), facts, policy, dataset)?)
}

fn page(
    image: Image<'_>,
    bytes: &[u8],
    facts: Facts,
    policy: Option<&Policy>,
    mut dataset: Option<Dataset>,
) -> Result<Page> {
    refuse_prefix(&image, "a page")?;
    let reference = policy.map(Reference::of).transpose()?;
    let mut nmse = None;
    if let (Some(dataset), Some(policy), false) = (&mut dataset, policy, image.has_around()) {
        let most = (MAX_MACS / runs::macs(&image).max(1)).max(200);
        let mut part = dataset.thinned(most, image.state().len > 0).into_owned();
        eval::fill_actions(&mut part, Some(policy))?;
        nmse = Some((eval::evaluate(image, &part)?.nmse, part.frames()));
    }
    let pair = dataset.as_ref().zip(reference.as_ref());
    let runs = pair.map(|(dataset, reference)| runs::compare(image, reference, dataset, nmse)).transpose()?;
    let head = HeadData::new(image, bytes, dataset.as_ref(), reference.as_ref())?;
    let error = runs.as_ref().and_then(|runs| runs.error);
    let limits = (0..image.act_len()).map(|i| image.limits(i));
    let limits = if image.has_around() { targets_without_limits(limits) } else { without_limits(limits) };
    let warnings = error.and_then(useless).into_iter().chain(limits).collect();
    let has_policy = policy.is_some();
    Ok(Page { facts, warnings, has_policy, own_path: None, success: None, sweep: None, runs, head, parts: PARTS })
}

/// Reads the success that a simulator printed of the rollouts in `driven`, which name the image: it does not.
fn outcome_of(file: &Path, driven: &[PathBuf]) -> Result<Success> {
    let name = || file.display().to_string();
    ensure!(
        !driven.is_empty(),
        "{}: does not say of which image it is; add the recording of its rollouts: --driven FILE.npz, by actq serve --record",
        name()
    );
    let text = fs::read_to_string(file).context("cannot read the file").with_context(name)?;
    success_of(&text).with_context(name)
}

/// Refuses a recording that names no image: its error would be that of an unknown controller's path.
fn refuse_unnamed(file: &Path) -> Result<()> {
    ensure!(
        driven_by(file)?.is_some(),
        "{}: names no image, so it may be the rollout of another policy; record this image with actq serve --record",
        file.display()
    );
    Ok(())
}

fn digest(file: &Path) -> Result<String> {
    let bytes = fs::read(file).with_context(|| format!("{}: cannot read the file", file.display()))?;
    Ok(sha256(&bytes))
}

/// Reads the policy of a folder; refuses another than that of the image.
fn source_of(dir: &Path, image: &Image<'_>) -> Result<Policy> {
    let policy = load(dir)?;
    of_policy(&policy, image).with_context(|| dir.display().to_string())?;
    Ok(policy)
}

/// Refuses another policy than that of the image.
fn of_policy(policy: &Policy, image: &Image<'_>) -> Result<()> {
    let is_own = policy.digest == image.digest();
    ensure!(is_own, "the image was made from another policy; name that one, or make the image again");
    Ok(())
}

/// Reads the recordings in `files`, or without any the one in a policy's folder.
fn dataset_of(image: &Image<'_>, files: &[PathBuf], folder: Option<&Path>) -> Result<Option<Dataset>> {
    let parts = files.iter().map(|file| recorded(image, file)).collect::<Result<Vec<_>>>()?;
    match &parts[..] {
        [] => Ok(folder.map(|dir| recording_of(dir, image)).transpose()?.flatten()),
        [one] => Ok(Some(one.clone())),
        many => Ok(Some(joined(many, image.state().len)?)),
    }
}

/// Reads the held-out recording of a folder, or else its calibration recording. A bundle's are of the network's values,
/// not of raw ones.
fn recording_of(dir: &Path, image: &Image<'_>) -> Result<Option<Dataset>> {
    if image.has_around() {
        return Ok(None);
    }
    let of = |recording: Recording| recording.load(Some(dir), None, Sizes::of_image(image));
    Ok(match of(Recording::Heldout)? {
        Some(dataset) => Some(dataset),
        None => of(Recording::Calib)?,
    })
}

/// Reads a recording of an image's observations: "obs", or for a bundle an array for each raw input.
fn recorded(image: &Image<'_>, file: &Path) -> Result<Dataset> {
    if !image.has_around() {
        return Ok(Dataset::load(file, Sizes::of_image(image))?);
    }
    let inputs = image.ports().filter(|port| port.kind == PortKind::Input);
    let inputs: Vec<(String, usize)> = inputs.map(|port| (port.name.to_owned(), port.len)).collect();
    let frames = match Raw::read(file).and_then(|raw| raw.frames(&inputs)) {
        Ok(frames) => frames,
        Err(by_name) => {
            let sizes = Sizes { obs: image.obs_len(), noise: 0, out: image.act_len(), state: 0 };
            return Dataset::load(file, sizes).map_err(|_| by_name.into());
        }
    };
    let values: Vec<f32> = frames.iter().flatten().flatten().map(|value| *value as f32).collect();
    let obs =
        Array3::from_shape_vec((1, frames.len(), image.obs_len()), values).context("the raw inputs do not fit")?;
    Ok(Dataset { path: file.to_owned(), obs, action: None, length: vec![frames.len()], state: None })
}

/// Finds the sweep of an image in a store: one with the image, or else one of the same policy.
fn sweep_of(folder: &Path, facts: &Facts, clock_hz: f64) -> Result<Sweep> {
    let shown = folder.display();
    let store = Store::open_existing(folder)?;
    let (mut of_policy, mut of_name) = (None, false);
    for result in store.all()? {
        let Outcome::Merged(merged) = result else { continue };
        for policy in merged.policies {
            let sweep = Sweep::new(&policy, clock_hz, &facts.sha256);
            if sweep.own().is_some() {
                return Ok(sweep);
            }
            // A policy's digest covers its name: of another name, no image need be read.
            let has_name = policy.policy == facts.name;
            of_name |= has_name;
            if has_name && sources(&store, &policy).any(|source| source == facts.source) {
                of_policy = Some(sweep);
            }
        }
    }
    of_policy.with_context(|| match of_name {
        true => format!(
            "{shown}: its images of {} were made from another policy of this name; name the store of this image's policy, or \
             leave --store out",
            facts.name
        ),
        false => format!("{shown}: it has no merged result of {}; run its sweep to the end, or leave --store out", facts.name),
    })
}

/// Returns the digests of the policies that the images of a sweep were made from.
fn sources(store: &Store, policy: &MergedPolicy) -> impl Iterator<Item = String> {
    let made = policy.images.iter().filter(|image| image.made.is_some());
    made.filter_map(|image| {
        let path = store.image(&image.address);
        let buffer = ImageBuffer::read(&path).ok()?;
        Some(hex(&buffer.image(&path).ok()?.digest()))
    })
}
