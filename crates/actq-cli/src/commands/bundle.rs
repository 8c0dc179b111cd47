//! `actq import` of a deploy bundle

use std::collections::{BTreeMap, BTreeSet};
use std::fs;
use std::io::{self, Cursor};
use std::path::{Path, PathBuf};

use actq::data::{DESCRIBED, NpzWriter};
use actq::import::Importer as _;
use actq::text::count;
use actq_deploy::description::Description;
use actq_deploy::{
    Answers, Bundle, DESCRIPTION, Deployment, Plan, Raw, Reading, Reference, Runner, explain, orders, read,
};
use actq_onnx::{Onnx, data_files};
use anyhow::{Context as _, Result, bail, ensure};

use super::import::refuse_existing;
use crate::args::{ImportArgs, ReadingArgs};
use crate::importers::description_checksum;
use crate::outputs::unfinished::OutputFolder;
use crate::questions;
use crate::report::{deployment, notes};
use crate::terminal::{note, print, reserve};

/// Returns `true` if the arguments name a bundle, or have an option that only bundles take.
pub(crate) fn is_bundle(args: &ImportArgs) -> bool {
    let ReadingArgs { answers, ask, accept_profile, profile, reference, limits: _ } = &args.reading;
    let options = answers.is_some() || *ask || *accept_profile || profile.is_some() || reference.is_some();
    options || args.model.is_dir() || args.model.extension().is_some_and(|ending| ending == "kinfer")
}

/// Reads a bundle, checks it, and writes its description with copies of the networks.
pub(crate) fn run(args: &ImportArgs) -> Result<()> {
    let lists = [args.observe.is_empty(), args.prefix.is_empty(), args.state.is_empty()];
    let names = args.output.is_some() || lists.contains(&false);
    ensure!(
        !names && args.rate_hz.is_none() && args.sampler.is_none(),
        "a bundle takes no --output, --state, --observe, --prefix, --rate-hz and --sampler: its description has them"
    );
    ensure!(
        !args.check || args.reading.reference.is_some(),
        "--check of a bundle needs --reference RAW.npz:EXPECT.npz"
    );
    let mut bundle = Bundle::open(&args.model)?;
    if let Some(path) = &args.reading.profile {
        let shown = || format!("{}: cannot read the profile; pass a TOML file to --profile", path.display());
        bundle = bundle.with_profile(&fs::read_to_string(path).with_context(shown)?);
    }
    let mut reading = answered(&bundle, &args.reading)?;
    if let Some(limits) = &args.reading.limits {
        reading.limit(&limits.at(Some(reading.description.rate_hz))?, &bundle)?;
    }
    let plan = Plan::new(&reading.description, &bundle).context(DESCRIPTION)?;
    let checked = match &args.reading.reference {
        Some((raw, expect)) => Some(compare(&reading.description, plan, &bundle, &Reference::read(raw, expect)?)?),
        None => None,
    };
    note(deployment::unread(&reading.unread));
    note(deployment::without_limits(&reading.description));
    note(notes::guards(&bundle.guards()));

    let Gathered { mut files, mut inputs } = Gathered::of(&bundle, &reading)?;
    inputs.extend(args.calib.iter().chain(&args.reading.answers).chain(&args.reading.profile).cloned());
    inputs.extend(args.reading.reference.iter().flat_map(|(raw, expect)| [raw, expect]).cloned());
    if let Some(raw) = &args.calib {
        let written = String::from_utf8_lossy(&files[0].1).into_owned();
        files.push(("calib.npz".to_owned(), calibration(&reading.description, &bundle, raw, &written)?));
    }
    let (names, contents): (Vec<PathBuf>, Vec<Vec<u8>>) =
        files.into_iter().map(|(name, content)| (args.out.join(name), content)).unzip();
    let names: Vec<&Path> = names.iter().map(PathBuf::as_path).collect();
    refuse_existing(args, &names)?;
    let _folder = OutputFolder::new(&args.out)?;
    // The deepest folders come first, so that all those that stay empty can be removed.
    let folders: BTreeSet<&Path> = names.iter().filter_map(|path| path.parent()).collect();
    let _folders: Vec<OutputFolder> = folders.into_iter().rev().map(OutputFolder::new).collect::<Result<_>>()?;
    reserve(&names, &inputs)?.write(&contents)?;
    print(&deployment::summary(&reading))?;
    if let Some(checked) = checked {
        print(&checked)?;
    }
    let written: Vec<String> = names.iter().map(|path| path.display().to_string()).collect();
    print(&format!("written   {}\n", written.join(", ")))
}

/// Checks a description that stays from an import before: its answers must be readable, and it must agree with the
/// reference, if there is one.
pub(crate) fn check_kept(policy: &Path, args: &ReadingArgs) -> Result<()> {
    read_answers(args)?;
    if args.reference.is_none() && args.limits.is_none() {
        return Ok(());
    }
    let kept = Bundle::open(policy)?;
    let mut reading = read(&kept, args.accept_profile, Answers::default())?;
    let description = reading.description.clone();
    if let Some(limits) = &args.limits {
        reading.limit(&limits.at(Some(description.rate_hz))?, &kept)?;
        let is_limited = reading.description == description;
        ensure!(is_limited, "{DESCRIPTION} is kept, and allows more than --limits; edit it, or remove the folder");
    }
    if let Some((raw, expect)) = &args.reference {
        let plan = Plan::new(&description, &kept).context(DESCRIPTION)?;
        print(&compare(&description, plan, &kept, &Reference::read(raw, expect)?)?)?;
    }
    Ok(())
}

fn read_answers(args: &ReadingArgs) -> Result<Answers> {
    match &args.answers {
        Some(path) => {
            let name = path.display();
            let form = "pass a TOML file of lines KEY = VALUE to --answers";
            let text = fs::read_to_string(path).with_context(|| format!("{name}: cannot read the answers; {form}"))?;
            Ok(Answers::parse(&text).with_context(|| format!("{name}: is not TOML; {form}"))?)
        }
        None => Ok(Answers::default()),
    }
}

/// Reads a bundle with the answers of a file and of the terminal.
fn answered(bundle: &Bundle, args: &ReadingArgs) -> Result<Reading> {
    let answers = read_answers(args)?;
    if !args.ask {
        let reading = read(bundle, args.accept_profile, answers)?;
        if !reading.questions.is_empty() {
            print(&deployment::questions(&reading.questions))?;
        }
        refuse_open_questions(&reading)?;
        return Ok(reading);
    }
    let (reading, answers) =
        questions::ask(bundle, args.accept_profile, answers, &mut io::stdin().lock(), &mut io::stderr())?;
    print(&format!("answers, as --answers takes them:\n{answers}\n"))?;
    Ok(reading)
}

/// Fails if there are questions that nothing answers.
pub fn refuse_open_questions(reading: &Reading) -> Result<()> {
    let questions = &reading.questions;
    if questions.is_empty() {
        return Ok(());
    }
    let by_profile = questions.iter().filter(|question| question.profile.is_some()).count();
    let accept = match by_profile {
        0 => String::new(),
        n => format!("pass --accept-profile to accept what the deploy code says to {n} of them; "),
    };
    bail!(
        "the bundle (family {}) leaves {} open; {accept}write answers to a file as KEY = VALUE, and pass it to --answers, or \
         pass --ask. Nothing was written",
        reading.family,
        count(questions.len(), "question")
    )
}

/// Compares the description with the reference, and an image of it with the description; an error names the first
/// difference, and the conventions that explain it.
fn compare(description: &Description, plan: Plan, bundle: &Bundle, reference: &Reference) -> Result<String> {
    let unused: Vec<String> = reference.raw().unused(&plan).map(str::to_owned).collect();
    let comparison = reference.compare(description, bundle)?;
    if let Some(first) = &comparison.first {
        let conventions = explain(description, bundle, reference)?;
        let reasons = match &conventions[..] {
            [] => orders(description, bundle, reference)?.join("; "),
            _ => format!("it agrees if {}", conventions.join(", or if ")),
        };
        let reasons = if reasons.is_empty() { "no single known convention explains it".to_owned() } else { reasons };
        bail!("the reference differs at {first}; {reasons}. Nothing was written");
    }
    let plan = Plan::new(description, bundle).context(DESCRIPTION)?;
    match Deployment::new(&description.name, description.rate_hz as f32, &plan) {
        Ok(deployment) => {
            let raw = reference.raw().frames(plan.inputs())?;
            deployment.verify(&mut Runner::new(plan), &raw).context(DESCRIPTION)?;
        }
        Err(error) => note([format!("no image can be made of the description: {error:#}")]),
    }
    if !unused.is_empty() {
        note([format!("no input has the name of these raw arrays of the reference: {}", unused.join(", "))]);
    }
    note(deployment::held(&comparison));
    Ok(deployment::agreement(&comparison))
}

/// The description of a bundle with copies of its networks, as the files of one folder.
#[derive(Debug)]
pub struct Gathered {
    /// Names and contents; the description is the first.
    pub files: Vec<(String, Vec<u8>)>,
    /// Files of the bundle that were copied.
    pub inputs: Vec<PathBuf>,
}

impl Gathered {
    /// Reads the files that a description names.
    pub fn of(bundle: &Bundle, reading: &Reading) -> Result<Self> {
        let (description, copies) = gathered(&reading.description, bundle)?;
        let inputs: Vec<PathBuf> = copies.keys().map(|file| bundle.path(file)).collect::<actq::error::Result<_>>()?;
        let mut files = vec![(DESCRIPTION.to_owned(), description.to_toml(&reading.sources)?.into_bytes())];
        for (name, path) in copies.into_values().zip(&inputs) {
            let content = fs::read(path).with_context(|| format!("{}: cannot read the file", path.display()))?;
            files.push((name, content));
        }
        Ok(Self { files, inputs })
    }
}

/// Returns the description with its files in one folder, and the names there of all files that it needs, by their paths
/// in the bundle. A network's weights keep their place beside it. If two files would have one name, all keep their paths.
fn gathered(description: &Description, bundle: &Bundle) -> Result<(Description, BTreeMap<String, String>)> {
    let mut moved: Vec<(String, String)> = Vec::new();
    for file in description.files() {
        let folder = file.rsplit_once('/').map_or("", |(folder, _)| folder);
        let name = file.rsplit('/').next().unwrap_or(file);
        moved.push((file.to_owned(), name.to_owned()));
        if Onnx.accepts(Path::new(file)) {
            for data in data_files(&bundle.path(file)?)? {
                let name = data.to_str().with_context(|| format!("{}: the name is not UTF-8", data.display()))?;
                moved.push((joined(folder, name), name.to_owned()));
            }
        }
    }
    let places: BTreeSet<&(String, String)> = moved.iter().collect();
    let [files, names]: [BTreeSet<&String>; 2] =
        [places.iter().map(|(file, _)| file).collect(), places.iter().map(|(_, name)| name).collect()];
    let is_one_to_one = files.len() == places.len() && names.len() == places.len();
    let copies: BTreeMap<String, String> =
        moved.into_iter().map(|(file, name)| if is_one_to_one { (file, name) } else { (file.clone(), file) }).collect();
    let mut description = description.clone();
    let networks = description.networks.iter_mut().map(|network| &mut network.file);
    for file in networks.chain(description.motions.iter_mut().map(|motion| &mut motion.file)) {
        file.clone_from(&copies[file]);
    }
    Ok((description, copies))
}

/// Joins the path of a folder, which may be empty, and a path in it.
fn joined(folder: &str, path: &str) -> String {
    if matches!(folder, "" | ".") { path.to_owned() } else { format!("{folder}/{path}") }
}

/// Returns a recording of what the networks read, made of raw inputs: what they learn from. `written` is the
/// description's text, which the recording names.
fn calibration(description: &Description, bundle: &Bundle, raw: &Path, written: &str) -> Result<Vec<u8>> {
    let plan = Plan::new(description, bundle).context(DESCRIPTION)?;
    let Deployment { columns, .. } = Deployment::new(&description.name, description.rate_hz as f32, &plan)?;
    let ticks = Raw::read(raw)?.run(plan)?;
    let mut npz = NpzWriter::new(Cursor::new(Vec::new()));
    let values = ticks.iter().flat_map(|tick| columns.iter().map(|column| tick.observation[*column] as f32));
    npz.array("obs", &[1, ticks.len(), columns.len()], values)?;
    npz.array(DESCRIBED, &[1], [i64::from(description_checksum(written)?)])?;
    Ok(npz.finish()?.into_inner())
}
