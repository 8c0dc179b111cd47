//! `actq import`

use std::fs;
use std::path::Path;

use actq::data::{Dataset, Recording, Sizes};
use actq::import::contract::StatedLimits;
use actq::import::{FILES, Importer as _, Sampler};
use actq_deploy::DESCRIPTION;
use actq_onnx::{ImportOptions, Onnx, import};
use anyhow::{Context as _, Result, ensure};

use crate::args::ImportArgs;
use crate::check::check;
use crate::outputs::unfinished::OutputFolder;
use crate::report::{imported, notes};
use crate::terminal::{note, print, reserve};

/// Converts an ONNX file to a policy folder and prints a summary.
pub(crate) fn run(args: &ImportArgs) -> Result<()> {
    let limits = args.reading.limits.as_ref().map(|limits| limits.at(args.rate_hz)).transpose()?;
    let options = ImportOptions {
        limits: limits.unwrap_or_default(),
        rate_hz: args.rate_hz,
        output: args.output.clone(),
        states: args.state.clone(),
        observed: args.observe.clone(),
        prefix: args.prefix.clone(),
        sampler: args.sampler.as_deref().map(sampler).transpose()?,
        ..ImportOptions::default()
    };
    let imported = import(&args.model, &options)?;
    let [json, weights] = FILES.map(|name| args.out.join(name));
    let policy = imported.policy(&args.out, &args.model)?;
    if let Some(fault) = imported.faults.first() {
        let remedy = "export it with a lower opset_version (torch declares 18 for 26 and above)";
        let invalid = format!("{}: the file is invalid: {fault}; {remedy}", args.model.display());
        ensure!(!args.check, "{invalid}. No other program can run it for --check");
        note([invalid + ". Its network is read by the operator's definition"]);
    }
    let calib = args.calib.as_ref().map(|path| Dataset::load(path, Sizes::of(&policy))).transpose()?;
    note(calib.as_ref().and_then(notes::of_axes));
    note(policy.refused.iter().cloned());
    note(notes::default_rate(&policy));
    note(notes::without_effect(&policy));
    note(notes::without_limits((0..policy.act_len).map(|i| policy.contract.limits(i))));
    let [calib_npz, others @ ..] = Recording::Calib.paths(&args.out);
    let names: Vec<&Path> =
        [&json, &weights].into_iter().chain(calib.is_some().then_some(&calib_npz)).map(|p| &**p).collect();
    refuse_existing(args, &names)?;
    let other = others.iter().find(|path| calib.is_some() && path.exists());
    ensure!(
        other.is_none(),
        "{}: exists, and a policy folder takes one calibration recording; remove it or omit --calib",
        other.map_or("".into(), |p| p.display().to_string())
    );
    let _folder = OutputFolder::new(&args.out)?;
    let is_scaled = options.sampler.as_ref().is_some_and(|sampler| sampler.action.is_some());
    let outputs = reserve(&names, Onnx.files(&args.model).into_iter().chain(args.calib.clone()))?;
    let checked = match args.check {
        // Another program runs the file without the limits and scales that the caller adds.
        true if !options.limits.is_empty() || is_scaled => {
            let sampler = options.sampler.map(|sampler| Sampler { action: None, ..sampler });
            let own = import(&args.model, &ImportOptions { limits: StatedLimits::default(), sampler, ..options })?;
            Some(check(&args.model, &own, &own.policy(&args.out, &args.model)?, calib.as_ref())?)
        }
        true => Some(check(&args.model, &imported, &policy, calib.as_ref())?),
        false => None,
    };
    let mut contents = imported.source.files()?.to_vec();
    if let Some(calib) = &calib {
        contents.push(calib.npz(Sizes::of(&policy))?);
    }
    outputs.write(&contents)?;
    print(&imported::summary(&imported, &policy))?;
    if let Some(checked) = checked {
        print(&format!("checked   {checked}\n"))?;
    }
    print(&format!(
        "written   {}\n",
        names.iter().map(|path| path.display().to_string()).collect::<Vec<_>>().join(", ")
    ))
}

/// Reads the steps of a flow or a diffusion policy.
fn sampler(path: &Path) -> Result<Sampler> {
    let bytes = fs::read(path).with_context(|| format!("{}: cannot read the file", path.display()))?;
    Sampler::parse(&bytes).with_context(|| path.display().to_string())
}

/// Refuses to replace files without --force, and a folder with a policy in the other form, which would be read instead.
pub(super) fn refuse_existing(args: &ImportArgs, files: &[&Path]) -> Result<()> {
    for form in [DESCRIPTION, FILES[0]] {
        let path = args.out.join(form);
        ensure!(
            !path.exists() || files.contains(&&*path),
            "{}: is of another policy in this folder; remove it, or choose another --out",
            path.display()
        );
    }
    for path in files {
        ensure!(args.force || !path.exists(), "{}: already exists; use --force to overwrite", path.display());
    }
    Ok(())
}
