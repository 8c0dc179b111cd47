//! `actq deploy`

use std::collections::BTreeSet;
use std::fs;
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};

use actq::data::files_of;
use actq::import::Importer as _;
use actq::methods::{Effort, Method};
use actq::runtime::ImageBuffer;
use actq_deploy::description::Description;
use actq_deploy::{Bundle, DESCRIPTION};
use actq_jobs::job::version;
use actq_onnx::{Onnx, data_files};
use anyhow::{Context as _, Result, ensure};

use super::{bundle, check, constants, quantize};
use crate::args::{CheckArgs, ConstantsArgs, DeployArgs, ImportArgs, LearnArgs, QuantizeArgs};
use crate::importers::load;
use crate::terminal::{note, print};

/// Minutes of learning if neither steps nor minutes are given.
const DEFAULT_MINUTES: f64 = 6.0;
/// Folder of the description, and file of what the last image was made with, in the output folder.
const POLICY: &str = "policy";
const MADE_WITH: &str = "policy.actq.txt";
const IMAGE: &str = "policy.actq";
/// Statistics of the image, for its report.
const STATS: &str = "policy.stats.json";
/// Endings of the files of constants.
const CONSTANTS: [&str; 2] = ["rs", "h"];
/// Checksums of the bundle's files at its import.
const IMPORTED: &str = "policy.bundle.txt";
/// Most files that differ and are named.
const MAX_NAMED: usize = 4;

/// Imports a bundle, checks it, quantizes it, checks the image, and builds firmware. Results of an earlier run with the
/// same options are kept.
pub(crate) fn run(args: &DeployArgs) -> Result<()> {
    ensure!(
        !args.recordings.is_empty() || args.reading.reference.is_some(),
        "give --recordings: what the policy observes on its task. `actq import` and `actq quantize --method rtn` make a first image; \
         run it on the robot or in simulation by `actq serve IMAGE --record FILE`, and pass FILE"
    );
    if let (Some(sources), Some(board)) = (&args.sources, &args.board) {
        check_board(sources, board)?;
    }
    let made_with = made_with(args)?;
    let policy = args.out.join(POLICY);
    let description = policy.join(DESCRIPTION);
    step(1, "import")?;
    import_bundle(args, &policy, &description)?;
    step(2, "quantize")?;
    let image = args.out.join(IMAGE);
    quantize_policy(args, &policy, &image, &made_with)?;
    if let Some(reference) = &args.reading.reference {
        step(3, "check the image")?;
        check::run(&CheckArgs { image: image.clone(), reference: reference.clone(), max_nmse: args.max_nmse })?;
    }
    step(4, "constants")?;
    let gains = has_gains(&description)?.then_some(description);
    for ending in CONSTANTS {
        let out = image.with_extension(ending);
        constants::run(&ConstantsArgs { image: image.clone(), out, gains: gains.clone(), force: false })?;
    }
    if let Some(board) = &args.board {
        step(5, "firmware")?;
        firmware(args.sources.as_deref(), board, &image)?;
    }
    Ok(())
}

/// Imports the bundle, or checks the description that an earlier run has written.
fn import_bundle(args: &DeployArgs, policy: &Path, description: &Path) -> Result<()> {
    let only_reference = args.recordings.is_empty();
    let (record, checksums) = (args.out.join(IMPORTED), checksums(&args.bundle)? + &option_checksums(args)?);
    let raw = args.reading.reference.as_ref().map(|(raw, _)| raw.clone());
    if description.exists() {
        // It may have been edited.
        print(&format!("{}: kept; remove the folder to import the bundle again\n", description.display()))?;
        bundle::check_kept(policy, &args.reading)?;
        if let Ok(imported) = fs::read_to_string(&record) {
            check_imported(args, policy, &imported, &checksums)?;
        }
    } else {
        bundle::run(&ImportArgs {
            model: args.bundle.clone(),
            out: policy.to_owned(),
            calib: raw.filter(|_| only_reference),
            output: None,
            state: Vec::new(),
            observe: Vec::new(),
            prefix: Vec::new(),
            sampler: None,
            rate_hz: None,
            check: false,
            reading: args.reading.clone(),
            force: false,
        })?;
        fs::write(&record, checksums).with_context(|| format!("{}: cannot write the file", record.display()))?;
    }
    if only_reference {
        note(["the policy learns from the raw inputs of --reference: too little for a robot; pass recordings of its task by \
               --recordings"
            .to_owned()]);
    }
    Ok(())
}

/// Returns a line with the checksum of each file of a bundle.
fn checksums(bundle: &Path) -> Result<String> {
    let files = Bundle::open(bundle)?;
    let mut text = String::new();
    for file in files.files() {
        let path = files.path(file)?;
        text += &format!("{:08x} {file}\n", checksum(&path)?);
        // A bundle of one file may have weights beside it.
        for data in if bundle.is_file() && Onnx.accepts(&path) { data_files(&path)? } else { Vec::new() } {
            text += &format!("{:08x} {}\n", checksum(&path.with_file_name(&data))?, data.display());
        }
    }
    Ok(text)
}

/// Returns lines like those of [`checksums`] for the options whose files an import reads.
fn option_checksums(args: &DeployArgs) -> Result<String> {
    let raw = args.reading.reference.as_ref().map(|(raw, _)| raw).filter(|_| args.recordings.is_empty());
    let files = [
        ("--answers", args.reading.answers.as_ref()),
        ("--profile", args.reading.profile.as_ref()),
        ("--reference", raw),
    ];
    let line =
        |(option, file): (&str, Option<&PathBuf>)| file.map(|file| Ok(format!("{:08x} {option}\n", checksum(file)?)));
    files.into_iter().filter_map(line).collect()
}

fn checksum(file: &Path) -> Result<u32> {
    let bytes = fs::read(file).with_context(|| format!("{}: cannot read the file", file.display()))?;
    Ok(actq_kernels::image::checksum(&bytes))
}

/// Refuses a bundle of other files than those that the kept description was made of, and other answers, profile or
/// reference to learn from. An option that is no longer given stays as it was.
fn check_imported(args: &DeployArgs, policy: &Path, imported: &str, checksums: &str) -> Result<()> {
    let [before, now]: [BTreeSet<&str>; 2] = [imported, checksums].map(|text| text.lines().collect());
    let name = |line: &&str| line.split_once(' ').map_or("", |(_, name)| name).to_owned();
    let given: BTreeSet<String> = now.iter().map(name).collect();
    let differ = before.symmetric_difference(&now).map(name);
    let names: BTreeSet<String> = differ.filter(|name| !name.starts_with("--") || given.contains(name)).collect();
    let named: Vec<&str> = names.iter().map(String::as_str).take(MAX_NAMED).collect();
    let more = if names.len() > MAX_NAMED { " and others" } else { "" };
    ensure!(
        names.is_empty(),
        "{}: has changed since {} was made of it: {}{more}; remove {1} to import the bundle again, or choose another --out",
        args.bundle.display(),
        policy.display(),
        named.join(", ")
    );
    Ok(())
}

/// Makes the image, unless an earlier run has made it with the same options.
fn quantize_policy(args: &DeployArgs, policy: &Path, image: &Path, made_with: &str) -> Result<()> {
    let record = args.out.join(MADE_WITH);
    if is_made(image, policy, &record, made_with) {
        return print(&format!("{}: made before with the same options\n", image.display()));
    }
    // No record is of an image that an interrupted run has left.
    if record.exists() {
        fs::remove_file(&record).with_context(|| format!("{}: cannot remove the file", record.display()))?;
    }
    quantize::run(&quantize_args(args, policy, image), Some(Method::Distill), |_, _| String::new())?;
    // Those of the image before, should the check of this one fail.
    let firmware = args.board.iter().map(|board| args.out.join(format!("{board}.elf")));
    for stale in CONSTANTS.map(|ending| image.with_extension(ending)).into_iter().chain(firmware) {
        if stale.exists() {
            fs::remove_file(&stale).with_context(|| format!("{}: cannot remove the file", stale.display()))?;
        }
    }
    fs::write(record, recorded(image, made_with)?).context("cannot write the options")
}

/// Returns the text of a record: the options, and the image that they made.
fn recorded(image: &Path, made_with: &str) -> Result<String> {
    Ok(format!("{made_with}image {:08x}\n", checksum(image)?))
}

fn has_gains(description: &Path) -> Result<bool> {
    let read = || -> Result<Description> { Ok(Description::parse(&fs::read_to_string(description)?)?) };
    let description = read().with_context(|| format!("{}: cannot read the description", description.display()))?;
    Ok(description.gains.is_some())
}

fn step(number: usize, what: &str) -> Result<()> {
    print(&format!("\n{number}. {what}\n"))
}

fn quantize_args(args: &DeployArgs, policy: &Path, image: &Path) -> QuantizeArgs {
    let is_limited = args.learn.distill.steps.is_some()
        || args.learn.minutes.is_some()
        || args.learn.distill.effort != Effort::Default;
    QuantizeArgs {
        heldout: None,
        policy_dir: policy.to_owned(),
        out: image.to_owned(),
        calib: args.recordings.clone(),
        budget: args.budget.clone(),
        max_nmse: None,
        width: Vec::new(),
        protect: Vec::new(),
        group: None,
        activations: None,
        core: args.core,
        learn: LearnArgs {
            minutes: if is_limited { args.learn.minutes } else { Some(DEFAULT_MINUTES) },
            ..args.learn.clone()
        },
        run: args.run.clone(),
        save_stats: Some(args.out.join(STATS)),
    }
}

/// Returns what an image depends on beside the policy, as text.
fn made_with(args: &DeployArgs) -> Result<String> {
    let mut text = format!("actq {}\n{:?}, {:?}, seed {}\n", version(), args.budget, args.learn, args.run.seed);
    if let Some(core) = args.core {
        text += &format!("{core:?}\n");
    }
    let files = match args.recordings.is_empty() {
        true => args.reading.reference.iter().map(|(raw, _)| raw.clone()).collect(),
        false => files_of(&args.recordings)?,
    };
    for file in files {
        text += &format!("{} {:08x}\n", file.display(), checksum(&file)?);
    }
    Ok(text)
}

/// Returns `true` if an image of this policy was made with the same options.
fn is_made(image: &Path, policy: &Path, record: &Path, made_with: &str) -> bool {
    let same = fs::read_to_string(record).is_ok_and(|text| recorded(image, made_with).is_ok_and(|own| own == text));
    let digest = || -> Result<[u8; 32]> {
        let buffer = ImageBuffer::read(image)?;
        Ok(buffer.image(image)?.digest())
    };
    same && matches!((digest(), load(policy)), (Ok(digest), Ok(policy)) if policy.digest == digest)
}

/// Starts the command of a checkout of actq that builds firmware.
fn xtask(sources: &Path, board: &str) -> Command {
    let mut command = Command::new("cargo");
    command.current_dir(sources).args(["xtask", "firmware", "--board", board]);
    command
}

/// Refuses a board that the sources have no firmware for.
fn check_board(sources: &Path, board: &str) -> Result<()> {
    let status = xtask(sources, board).arg("--list").stdout(Stdio::null()).status();
    let status = status.with_context(|| format!("cannot start cargo in {}", sources.display()))?;
    ensure!(
        status.success(),
        "--board {board}: the sources in {} have no firmware for it; use another board, or remove --board",
        sources.display()
    );
    Ok(())
}

/// Builds the firmware by the sources' own command; without sources, shows that command.
fn firmware(sources: Option<&Path>, board: &str, image: &Path) -> Result<()> {
    let image = fs::canonicalize(image).with_context(|| image.display().to_string())?;
    let Some(sources) = sources else {
        note([format!(
            "no firmware is built without --sources; in a checkout of actq: cargo xtask firmware --board {board} --image {} --out {board}.elf",
            image.display()
        )]);
        return Ok(());
    };
    let elf = image.with_file_name(format!("{board}.elf"));
    let status = xtask(sources, board).arg("--image").arg(&image).arg("--out").arg(&elf).status();
    let status = status.context("cannot start cargo")?;
    ensure!(
        status.success(),
        "cannot build the firmware for {board}; {} is whole, and the command can be run again",
        image.display()
    );
    Ok(())
}
