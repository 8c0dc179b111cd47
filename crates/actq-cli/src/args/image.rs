//! Arguments of the commands that read an image.

use std::num::NonZeroUsize;
use std::path::PathBuf;

use actq::emit::Core;

use super::values::{clock, core, npz, steps};

#[derive(clap::Args)]
pub(crate) struct InspectArgs {
    /// The image
    pub(crate) image: PathBuf,
    /// The core of the predicted time, with the image's layouts: m0, m3, rv32imac, rv32zb, m4, m4f, m7, m33 or m55
    /// [default: m4f]
    #[arg(long, value_name = "CORE", value_parser = core, conflicts_with = "widths")]
    pub(crate) core: Option<Core>,
    /// The processor's clock, in Hz or as 168M
    #[arg(long, value_name = "HZ", default_value = "168M", value_parser = clock, conflicts_with = "widths")]
    pub(crate) clock: f64,
    /// Print the predicted time of every operation and of the step as one JSON object
    #[arg(long, conflicts_with = "widths")]
    pub(crate) json: bool,
    /// Show the width of every row instead
    #[arg(long)]
    pub(crate) widths: bool,
    /// The statistics that --save-stats wrote with this image: adds the reasons for the widths, and the removed rows
    #[arg(long, value_name = "FILE", requires = "widths")]
    pub(crate) stats: Option<PathBuf>,
}

#[derive(clap::Args)]
pub(crate) struct RepackArgs {
    /// The image
    pub(crate) image: PathBuf,
    /// The core: m0, m3, rv32imac, rv32zb, m4, m4f, m7, m33 or m55
    #[arg(long, value_name = "CORE", value_parser = core)]
    pub(crate) core: Core,
    /// The image to write
    #[arg(long, value_name = "FILE")]
    pub(crate) out: PathBuf,
}

#[derive(clap::Args)]
pub(crate) struct EvalArgs {
    /// The image
    pub(crate) image: PathBuf,
    /// The policy folder, with the recordings, or an ONNX file
    #[arg(value_name = "POLICY_DIR", required_unless_present_any = ["heldout", "policy"], conflicts_with = "policy")]
    pub(crate) source: Option<PathBuf>,
    /// As POLICY_DIR
    #[arg(long, value_name = "POLICY_DIR")]
    pub(crate) policy: Option<PathBuf>,
    /// The held-out recording: .npz, .npy or .safetensors [default: the one in POLICY_DIR]
    #[arg(long, value_name = "FILE")]
    pub(crate) heldout: Option<PathBuf>,
    /// A recording of this image's own rollout, by actq serve --record, or a folder of them; and as FILE.json the line
    /// with success and episodes that the simulator printed; may be repeated
    #[arg(long, value_name = "FILE|DIR")]
    pub(crate) driven: Vec<PathBuf>,
    /// Show no progress
    #[arg(long)]
    pub(crate) quiet: bool,
    /// Print one JSON object: nmse, worst_nmse, max_abs, steps, bpw, bytes; with --driven also own_nmse
    #[arg(long)]
    pub(crate) json: bool,
}

#[derive(clap::Args)]
pub(crate) struct ReportArgs {
    /// The image
    pub(crate) image: PathBuf,
    /// The policy that the image was made from: a folder, or an ONNX file
    #[arg(long, value_name = "POLICY_DIR")]
    pub(crate) policy: Option<PathBuf>,
    /// A recording of observations, or a folder of them; may be repeated [default: the held-out recording in POLICY_DIR, or
    /// else its calibration recording]
    #[arg(long, value_name = "FILE|DIR")]
    pub(crate) recordings: Vec<PathBuf>,
    /// A recording of this image's own rollout, by actq serve --record, or a folder of them; and as FILE.json the line
    /// with success and episodes that the simulator printed; may be repeated
    #[arg(long, value_name = "FILE|DIR")]
    pub(crate) driven: Vec<PathBuf>,
    /// The statistics that --save-stats wrote with this image: adds removed rows, names, and how the image was made
    #[arg(long, value_name = "FILE")]
    pub(crate) stats: Option<PathBuf>,
    /// The results of a sweep of the policy: adds its frontier, and the image's success
    #[arg(long, value_name = "DIR")]
    pub(crate) store: Option<PathBuf>,
    /// The processor's clock, in Hz or as 168M
    #[arg(long, value_name = "HZ", default_value = "168M", value_parser = clock)]
    pub(crate) clock: f64,
    /// The file to write
    #[arg(long, value_name = "FILE.html")]
    pub(crate) out: PathBuf,
    /// Show no progress
    #[arg(long)]
    pub(crate) quiet: bool,
}

#[derive(clap::Args)]
pub(crate) struct ServeArgs {
    /// The image
    pub(crate) image: PathBuf,
    /// The network takes this many control periods, as on a slow processor: until then, observations are answered with the
    /// rest of the chunk before (docs/FORMAT.md, Playback), or with the last action again
    #[arg(long, value_name = "PERIODS", default_value_t = 0, conflicts_with = "record")]
    pub(crate) late: usize,
    /// Record the observations; if the file exists, the recording is FILE-2.npz, FILE-3.npz and so on
    #[arg(long, value_name = "FILE.npz", value_parser = npz)]
    pub(crate) record: Option<PathBuf>,
    /// The folder of the policy that the image was made from; that policy labels the recording [default: the image's
    /// folder, if it holds that policy; else the recording has no labels]
    #[arg(long, value_name = "POLICY_DIR", env = "ACTQ_POLICY")]
    pub(crate) policy: Option<PathBuf>,
}

#[derive(clap::Args)]
pub(crate) struct ConstantsArgs {
    /// The image
    pub(crate) image: PathBuf,
    /// The file to write: .rs for a module of Rust, .h for a header of C and C++
    #[arg(long, value_name = "FILE")]
    pub(crate) out: PathBuf,
    /// A deploy.toml, whose [gains] are added
    #[arg(long, value_name = "FILE")]
    pub(crate) gains: Option<PathBuf>,
    /// Replace files that `actq` did not write
    #[arg(long)]
    pub(crate) force: bool,
}

#[derive(clap::Args)]
pub(crate) struct ExportCArgs {
    /// The image
    pub(crate) image: PathBuf,
    /// The folder for the files; created if it does not exist
    #[arg(long, value_name = "DIR")]
    pub(crate) out: PathBuf,
    /// Prefix of the files and of the names in them
    #[arg(long, default_value = "policy")]
    pub(crate) name: String,
    /// A recording: also write NAME_golden.c, its first observations with the bits of this host's actions, which a
    /// board must give too
    #[arg(long, value_name = "FILE")]
    pub(crate) golden: Option<PathBuf>,
    /// Observations of the golden run, at most
    #[arg(long, default_value = "100", value_name = "N", requires = "golden", value_parser = steps)]
    pub(crate) steps: NonZeroUsize,
    /// Replace files that `actq` did not write
    #[arg(long)]
    pub(crate) force: bool,
}
