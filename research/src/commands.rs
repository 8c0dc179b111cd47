//! The commands of `actq` that quantize, with method actquant.

use actq::budget::Rate;
use actq::methods::Method;
use actq::pipeline::{QuantizedPolicy, Quantizer};
use actq_cli::args::jobs::JobArgs;
use actq_cli::args::{QuantizeArgs, SweepArgs};
use actq_cli::commands::jobs::job;
use actq_cli::commands::{quantize, sweep};
use actq_cli::report::table::table;
use anyhow::{Result, ensure};
use clap::{Args, ValueEnum};

use crate::actquant::choices::Choices;
use crate::actquant::{ActQuant, ActionStatistics};
use crate::host::Research;

#[derive(Clone, Copy, Debug, ValueEnum)]
enum MethodArg {
    /// Round to nearest
    Rtn,
    /// Column-wise error feedback with the inputs' second moment (needs a recording)
    Gptq,
    /// Widths by HSIC scores, scales by the Fisher information of the actions (needs a recording with actions); its
    /// default group is 32
    Actquant,
    /// A width for every row, pruning, and distillation on the recorded observations (needs a recording)
    #[value(alias = "best")]
    Distill,
}

/// The methods that a sweep compares by default.
const ALL: [MethodArg; 4] = [MethodArg::Rtn, MethodArg::Gptq, MethodArg::Actquant, MethodArg::Distill];

/// The choices that the paper of ActQuant leaves open.
#[derive(Args, Debug)]
struct ActQuantArgs {
    /// Choices of method actquant: KEY=VALUE,KEY=VALUE, or authors for its authors' choices
    ///
    /// Keys after authors change single choices. Defaults are in brackets; (authors) marks the
    /// authors' choice.
    ///
    /// bandwidth=[median]|squared(authors): the Gaussian kernels' sigma^2, or sigma, is the median
    ///   squared distance.
    /// frames=N|all(authors) [512]: frames that HSIC is computed over, at most 8192.
    /// score=[gain](authors)|output: a matrix's score is its gain, F(output) - F(input), or
    ///   F(output).
    /// noise=[codes]|format(authors): a width's expected error is 2^(-2 bits), with the bits of a
    ///   code or with all bits that a weight takes.
    /// widest=2|3|4(authors)|[8]: the widest codes of the allocation.
    /// head=[free]|2|3|4|8(authors): the width of the matrices that give the action. (The authors
    ///   keep them at 16 bits.)
    /// samples=N|all(authors) [4096]: frames that the Fisher information is computed over,
    ///   approximately.
    /// batch=N [1] (authors: 8): frames whose gradients are averaged before they are squared.
    /// signs=[random]|loss(authors): the loss's derivative if the recorded action is the policy's
    ///   own: a random sign, or the sign of the remaining difference.
    /// alpha=N [1]: the share of L1 in the action loss, 0 to 1; the rest is the likelihood of the action
    ///   under a Gaussian.
    /// magnitude=[no]|yes(authors): fits of scales weigh by the importance, or by it times
    ///   sqrt(mean of the row's w^2 + w^2).
    ///
    /// With one width for all (--bits) there is no bit allocation, and only the last five keys have
    /// an effect. research/README.md gives sources and reasons.
    ///
    /// Example: --method actquant --actquant authors,head=free
    #[arg(long, value_name = "CHOICES", verbatim_doc_comment)]
    actquant: Option<Choices>,
}

impl ActQuantArgs {
    /// Returns the methods, with the choices of `--actquant` in method actquant.
    fn methods(&self, names: &[MethodArg]) -> Result<Vec<Method>> {
        let method = |name: &MethodArg| match name {
            MethodArg::Rtn => Method::Rtn,
            MethodArg::Gptq => Method::Gptq,
            MethodArg::Actquant => Method::custom(ActQuant(self.actquant.unwrap_or_default())),
            MethodArg::Distill => Method::Distill,
        };
        let methods: Vec<Method> = names.iter().map(method).collect();
        ensure!(
            self.actquant.is_none() || names.iter().any(|name| matches!(name, MethodArg::Actquant)),
            "--actquant has no effect on {}; add actquant to the methods, or remove the option",
            methods.iter().map(Method::to_string).collect::<Vec<_>>().join(", ")
        );
        Ok(methods)
    }
}

/// `actq quantize` with actquant among the methods.
#[derive(Args, Debug)]
pub struct Quantize {
    #[command(flatten)]
    quantize: QuantizeArgs,
    /// The method that chooses the codes [default: distill if there is a calibration recording, else rtn]
    #[arg(long)]
    method: Option<MethodArg>,
    #[command(flatten)]
    choices: ActQuantArgs,
}

impl Quantize {
    /// Quantizes a policy, writes the image and prints a report.
    pub fn run(&self) -> Result<()> {
        // Without a method, the default one; refuse choices that it does not have.
        let name = self.method.or(self.choices.actquant.map(|_| MethodArg::Distill));
        let method = self.choices.methods(name.as_slice())?.pop();
        quantize::run(&self.quantize, method, scores)
    }
}

/// `actq sweep` with actquant among the methods.
#[derive(Args, Debug)]
pub struct Sweep {
    #[command(flatten)]
    sweep: SweepArgs,
    /// Methods to compare [default: rtn,gptq,actquant,distill]
    #[arg(long, value_name = "LIST", value_delimiter = ',')]
    methods: Vec<MethodArg>,
    #[command(flatten)]
    choices: ActQuantArgs,
}

impl Sweep {
    /// Quantizes policies by several methods at several budgets and compares the errors.
    pub fn run(&self) -> Result<()> {
        // A spec names its methods itself.
        let methods = match (&self.methods[..], self.sweep.has_spec()) {
            ([], true) => Vec::new(),
            ([], false) => self.choices.methods(&ALL)?,
            (named, _) => self.choices.methods(named)?,
        };
        sweep::run(&self.sweep, &methods.iter().map(Method::to_string).collect::<Vec<_>>(), &Research)
    }
}

/// `actq job` with the methods and comparisons of this crate.
#[derive(Args, Debug)]
pub struct Job {
    #[command(flatten)]
    job: JobArgs,
}

impl Job {
    /// Runs one job, and puts its result into a store.
    pub fn run(&self) -> Result<()> {
        job::run(&self.job, &Research)
    }
}

/// Formats ActQuant's scores, and the bits that follow from them; nothing for other methods.
fn scores(quantizer: &Quantizer<'_>, quantized: &QuantizedPolicy) -> String {
    let Some(statistics) = quantizer.method().custom::<ActionStatistics>() else { return String::new() };
    let (_, equal) = statistics.effective_scores();
    let mut rows = table(&["matrix", "HSIC score", "bits"]);
    let matrices = quantizer.method().graph().matrices.iter();
    for ((matrix, score), outcome) in matrices.zip(&statistics.scores).zip(&quantized.outcomes) {
        let bits = outcome.quantized.width_counts();
        rows.add_row([matrix.name.clone(), format!("{:.4}", score.of(statistics.choices.score)), bits]);
    }
    let note = match quantized.rate {
        Rate::Width(_) => "One width for all rows: the scores have no effect.",
        _ if equal => "No score is above 0: all matrices have equal weight.",
        _ => "Scores below 0 count as 0.",
    };
    format!("{rows}\n{note}\n\n")
}
