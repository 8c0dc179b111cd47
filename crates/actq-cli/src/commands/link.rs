//! `actq link`

mod log;
mod table;

use std::io;
use std::path::Path;
use std::time::Duration;

use actq::data::{Dataset, Sizes};
use actq::runtime::{ImageBuffer, prefix_len, prefix_of_row};
use actq::text::count;
use actq_client::client::Client;
use actq_client::connection::Connection;
use actq_client::keys::Signed;
use actq_client::log::Log;
use actq_client::push::{Package, Prefix, axes_note, push};
use actq_client::stream::{BEFORE_ARMING, LIFETIME, Pace, stream};
use actq_client::{port, serve};
use actq_kernels::Image;
use anyhow::{Context as _, Result, ensure};
use indicatif::{ProgressBar, ProgressStyle};

use crate::args::link::{LinkArgs, LinkCommand, PortArgs, PushArgs, StreamArgs};
use crate::ending::{self, EndsItself, Input};
use crate::report::notes;
use crate::terminal::{Progress, note, print, reserve};

/// Time between two tables of `watch`.
const REFRESH: Duration = Duration::from_millis(200);

/// Runs a subcommand of `actq link`.
pub(crate) fn run(args: &LinkArgs) -> Result<()> {
    match &args.command {
        LinkCommand::Ports => {
            let ports = port::list()?;
            if ports.is_empty() {
                note(["no serial port found".to_owned()]);
            }
            ports.into_iter().try_for_each(|(name, about)| print(&format!("{name}  {about}\n")))
        }
        LinkCommand::Watch { port, once } => watch(port, *once),
        LinkCommand::Arm(port) => connect(port)?.arm(),
        LinkCommand::Disarm(port) => connect(port)?.disarm(),
        LinkCommand::Get(args) => {
            let (parameter, axis) = args.checked()?;
            let value = connect(&args.port)?.get(parameter, axis)?;
            print(&format!("{value}\n"))
        }
        LinkCommand::Set { of, value } => {
            let (parameter, axis) = of.checked()?;
            connect(&of.port)?.set(parameter, axis, *value)
        }
        LinkCommand::Stream(args) => run_stream(args),
        LinkCommand::Serve { port, arm } => run_serve(port, *arm),
        LinkCommand::Push(args) => run_push(args),
    }
}

fn connect(args: &PortArgs) -> Result<Client> {
    let named = || format!("{}", args.port);
    let mut client = Client::new(Connection::open(args.port.clone(), args.timeout)?, args.timeout);
    client.status().with_context(named)?;
    Ok(client)
}

fn watch(port: &PortArgs, once: bool) -> Result<()> {
    let mut client = connect(port)?;
    let mut shown = || -> Result<String> {
        let (status, timing, breadcrumb) = (client.status()?, client.timing()?, client.breadcrumb()?);
        let reopened = client.connection().reopened();
        Ok(table::table(&status, &timing, &breadcrumb, &client.connection().counters(), reopened).to_string())
    };
    if once {
        return print(&(shown()? + "\n"));
    }
    let bar = ProgressBar::new_spinner().with_style(ProgressStyle::with_template("{msg}").context("table")?);
    loop {
        let table = shown().inspect_err(|_| bar.abandon())?;
        if bar.is_hidden() {
            print(&(table + "\n"))?;
        } else {
            bar.set_message(table);
            bar.tick();
        }
        std::thread::sleep(REFRESH);
    }
}

/// A signal ends the input, after which the controller is disarmed.
fn run_serve(port: &PortArgs, arm: bool) -> Result<()> {
    let mut input = Input::stdin();
    serve::serve(&mut connect(port)?, arm, &mut input, io::stdout().lock())
}

fn run_stream(args: &StreamArgs) -> Result<()> {
    let outputs = reserve(&args.log, [&args.image, &args.recording])?;
    let buffer = ImageBuffer::read(&args.image)?;
    let image = buffer.image(&args.image)?;
    let recording = Dataset::load(&args.recording, Sizes::of_image(&image))?;
    let frames = recording.frames();
    ensure!(
        !args.arm || frames > BEFORE_ARMING,
        "{}: has {}, and --arm arms after {BEFORE_ARMING}; record more, or stream without --arm",
        args.recording.display(),
        count(frames, "observation")
    );
    let (prefixes, of_frame) = prefixes(&image, &recording)?;
    let mut client = connect(&args.port)?;
    let runs = client.status()?.image;
    ensure!(
        runs == image.crc(),
        "the controller runs another image (checksum {runs:08x}) than {} ({:08x}); send it by actq link push",
        args.image.display(),
        image.crc()
    );
    let rate = args.rate.unwrap_or(f64::from(image.rate_hz()));
    let pace = Pace { period: Duration::from_secs_f64(1.0 / rate), arm: args.arm };
    // A signal ends the observations: the controller is disarmed, and the log written.
    let _ends_itself = EndsItself::begin();
    let lifetime = if prefixes.is_empty() { 0 } else { lifetime(&mut client)? };
    let prefix = |frame: usize| {
        let bytes = prefixes.get(*of_frame.get(frame)?)?;
        Some(Prefix { bytes, image: image.crc(), lifetime })
    };
    let (progress, mut log) = (Progress::new(false, "streaming")?, Log::default());
    let observations =
        recording.observations().take_while(|_| ending::stop_signal().is_none()).enumerate().map(|(i, observation)| {
            progress.set_share(i as f64 / frames as f64);
            // Prefix and noise follow the observation; the controller makes its own noise.
            observation.iter().take(image.obs_len()).copied().collect()
        });
    let outcome = stream(&mut client, observations, prefix, &pace, &mut log, |status| {
        progress.set_work(&status.state.to_string())
    });
    drop(progress);
    // After an error the log shows what came before it.
    if args.log.is_some() {
        outputs.write(&[log::npz(log.rows())?])?;
    }
    let mut latencies = log.latencies();
    latencies.sort_by(f64::total_cmp);
    let at = |share: f64| latencies.get((share * latencies.len() as f64) as usize).map_or(f64::NAN, |s| s * 1e3);
    print(&format!(
        "{}, {}; from observation to action {:.1} ms in the median, {:.1} ms at the 99th percentile\n",
        count(log.rows().len(), "observation"),
        count(latencies.len(), "action"),
        at(0.5),
        at(0.99)
    ))?;
    outcome
}

/// Returns the ticks of the longest lifetime of a prefix.
fn lifetime(client: &mut Client) -> Result<u32> {
    let ticks = LIFETIME.as_nanos() / u128::from(client.timing()?.period.max(1));
    Ok(u32::try_from(ticks).unwrap_or(u32::MAX))
}

/// Returns the prefixes in a recording, each once as long as it does not change, and the number of each frame's; nothing for an
/// image that reads none.
fn prefixes(image: &Image<'_>, recording: &Dataset) -> Result<(Vec<Vec<u8>>, Vec<usize>)> {
    let (mut prefixes, mut of_frame, mut last) = (Vec::new(), Vec::new(), Vec::new());
    let len = prefix_len(image);
    for observation in recording.observations().filter(|_| len > 0) {
        let row: Vec<f32> = observation.iter().skip(image.obs_len()).take(len).copied().collect();
        if row != last {
            prefixes.push(prefix_of_row(image, &row)?);
            last = row;
        }
        of_frame.push(prefixes.len() - 1);
    }
    Ok((prefixes, of_frame))
}

fn run_push(args: &PushArgs) -> Result<()> {
    let buffer = ImageBuffer::read(&args.image)?;
    // An image that the kernels refuse is not sent.
    let image = buffer.image(&args.image)?;
    let signed = args.signature.as_deref().map(|path| read_signature(path, buffer.bytes())).transpose()?;
    let version = signed.map_or(args.version.unwrap_or(0), |(version, _)| version);
    let signature = signed.map(|(_, signature)| signature);
    note(notes::without_limits((0..image.act_len()).map(|i| image.limits(i))));
    let mut client = connect(&args.port)?;
    note(axes_note(&mut client)?);
    let package = Package { image: buffer.bytes(), version, signature: signature.as_ref() };
    let progress = Progress::new(false, "erasing")?;
    let outcome = push(&mut client, &package, |taken| {
        let work = if taken < buffer.bytes().len() { "sending" } else { "checking" };
        progress.set(work, taken as f64 / buffer.bytes().len() as f64);
    });
    drop(progress);
    outcome?;
    print(&format!("{} runs, version {version}, {} bytes\n", image.name(), buffer.bytes().len()))
}

/// Reads and checks an image's version and signature from a signature file.
fn read_signature(path: &Path, image: &[u8]) -> Result<(u32, [u8; 64])> {
    let name = path.display();
    let form = "pass a file that `actq sign` wrote to --signature";
    let text = std::fs::read_to_string(path).with_context(|| format!("{name}: cannot read the signature; {form}"))?;
    let signed: Signed = serde_json::from_str(&text).with_context(|| format!("{name}: is not a signature; {form}"))?;
    Ok((signed.version, signed.check(image).with_context(|| name.to_string())?))
}
