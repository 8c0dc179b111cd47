//! Denoising steps of a flow or a diffusion policy in `policy.json`.

use actq_kernels::image::Kind;
use actq_kernels::ops::denoise::Coefficients;
use serde::{Deserialize, Serialize};
use serde_json::Value;

use crate::error::{Context, Result, bail, ensure};
use crate::graph::Denoising;
use crate::import::contract::JsonContract;
use crate::numbers::positive;
use crate::numbers::square;
use crate::strict_json;

/// Most steps of a policy; an image has room for 65535.
const MAX_STEPS: usize = 1000;

/// Keys of `policy.json` for the kinds flow and diffusion.
#[derive(Clone, Debug, Default, Deserialize, Serialize)]
pub struct JsonDenoising {
    #[serde(skip_serializing_if = "Option::is_none")]
    euler_steps: Option<usize>,
    #[serde(skip_serializing_if = "Option::is_none")]
    steps: Option<usize>,
    #[serde(skip_serializing_if = "Option::is_none")]
    solver: Option<String>,
    #[serde(skip_serializing_if = "Option::is_none")]
    schedule: Option<String>,
    #[serde(skip_serializing_if = "Option::is_none")]
    train_steps: Option<usize>,
    #[serde(skip_serializing_if = "Option::is_none")]
    prediction: Option<String>,
    #[serde(skip_serializing_if = "Option::is_none")]
    clip_sample: Option<f64>,
    #[serde(skip_serializing_if = "Option::is_none")]
    pub(super) clip_iterate: Option<f64>,
    #[serde(skip_serializing_if = "Option::is_none")]
    variance: Option<String>,
    #[serde(skip_serializing_if = "Option::is_none")]
    beta: Option<[f64; 2]>,
    #[serde(skip_serializing_if = "Option::is_none")]
    pub(super) time: Option<JsonTime>,
    #[serde(skip_serializing_if = "Option::is_none")]
    pub(super) obs_norm: Option<JsonNorm>,
}

/// Value of `time.order` of a network that reads the time itself.
const PLAIN: &str = "time";

/// Keys of [`JsonDenoising`].
pub(super) const KEYS: [&str; 12] = [
    "euler_steps",
    "steps",
    "solver",
    "schedule",
    "train_steps",
    "prediction",
    "clip_sample",
    "clip_iterate",
    "variance",
    "beta",
    "time",
    "obs_norm",
];

/// Keys of the network's time input.
#[derive(Clone, Debug, Default, Deserialize, Serialize)]
#[serde(deny_unknown_fields)]
pub(super) struct JsonTime {
    #[serde(skip_serializing_if = "Option::is_none")]
    freq: Option<String>,
    #[serde(skip_serializing_if = "Option::is_none")]
    order: Option<String>,
    #[serde(skip_serializing_if = "Option::is_none")]
    turns: Option<bool>,
    #[serde(skip_serializing_if = "Option::is_none")]
    from: Option<f64>,
    #[serde(skip_serializing_if = "Option::is_none")]
    to: Option<f64>,
}

/// Keys of the normalization of observations before the ops.
#[derive(Clone, Debug, Deserialize, Serialize)]
#[serde(deny_unknown_fields)]
pub(super) struct JsonNorm {
    pub(super) mean: String,
    pub(super) scale: String,
    #[serde(skip_serializing_if = "Option::is_none")]
    pub(super) clip: Option<f64>,
}

impl JsonTime {
    /// Returns the name of the tensor of the frequencies.
    pub(super) fn freq(&self) -> &str {
        self.freq.as_deref().unwrap_or("time.freq")
    }

    /// Returns `true` if the network reads the time itself.
    pub(super) fn is_plain(&self) -> bool {
        self.order.as_deref() == Some(PLAIN)
    }

    /// Returns the network's input at a time: cosine and sine of it at each frequency, or the time itself.
    pub(super) fn features(&self, time: f64, freq: &[f32]) -> Result<Vec<f32>> {
        let unit = if self.turns.unwrap_or(true) { std::f64::consts::TAU } else { 1.0 };
        let of =
            |f: &dyn Fn(f64) -> f64| freq.iter().map(|w| f(unit * time * f64::from(*w)) as f32).collect::<Vec<f32>>();
        Ok(match self.order.as_deref() {
            None | Some("cos,sin") => [of(&libm::cos), of(&libm::sin)].concat(),
            Some("sin,cos") => [of(&libm::sin), of(&libm::cos)].concat(),
            Some(PLAIN) => {
                ensure!(
                    self.freq.is_none() && self.turns.is_none(),
                    "time.order is {PLAIN:?}, the time itself, which takes no freq and no turns"
                );
                vec![time as f32]
            }
            Some(other) => bail!("time.order is {other:?}; it must be cos,sin or sin,cos or {PLAIN}"),
        })
    }
}

/// The steps, and the network's time input in each.
pub(super) struct Schedule {
    pub(super) denoising: Denoising,
    pub(super) times: Vec<f64>,
}

/// The sampler of a network in another file: its denoising steps, in the keys of `policy.json`, and the names of its inputs.
#[derive(Clone, Debug)]
pub struct Sampler {
    /// `flow` or `diffusion`.
    pub kind: String,
    /// Actions of a chunk that are executed; `None` for all.
    pub execute: Option<usize>,
    /// Actions that fade from one chunk to the next.
    pub overlap: Option<usize>,
    /// Input that is the iterate; `None` for the only one with the output's shape.
    pub iterate: Option<String>,
    /// Input that is the time; `None` for the only one of a single value.
    pub time: Option<String>,
    /// From the network's actions to the robot's, which packages keep beside the network.
    pub action: Option<JsonContract>,
    /// The steps, for a network that reads the time itself.
    pub steps: JsonDenoising,
}

impl Sampler {
    /// Reads a JSON object.
    ///
    /// # Errors
    ///
    /// For another kind, an unknown key, one of the wrong type, or without a key in which packages differ.
    pub fn parse(bytes: &[u8]) -> Result<Self> {
        /// Keys beside those of denoising steps. The network itself has the time's features and the normalization.
        const OWN: [&str; 6] = ["kind", "execute", "overlap", "iterate_input", "time_input", "action"];
        /// Keys without a default, by kind.
        const STATED: [(&str, &[&str]); 2] = [
            ("flow", &["steps", "time"]),
            ("diffusion", &["train_steps", "schedule", "solver", "prediction", "clip_sample"]),
        ];
        let Value::Object(mut object) = strict_json::parse(bytes).context("not a JSON object")? else {
            bail!("not a JSON object");
        };
        let known = || OWN.iter().chain(&KEYS).copied().filter(|key| *key != "obs_norm");
        if let Some(key) = object.keys().find(|key| !known().any(|known| known == *key)) {
            bail!("the key {key:?} is not known; the keys are {}", known().collect::<Vec<_>>().join(", "));
        }
        for (of_kind, keys) in STATED {
            let missing =
                |key: &&&str| object.get("kind").is_some_and(|kind| kind == of_kind) && !object.contains_key(**key);
            if let Some(key) = keys.iter().find(missing) {
                bail!("the key {key:?} is missing, in which packages differ (null: none)");
            }
        }
        object.retain(|_, value| !value.is_null());
        let [of_kind, execute, overlap, iterate, time, action] = OWN.map(|key| object.remove(key));
        let text = |key: &str, value: Option<Value>| match value {
            None => Ok(None),
            Some(Value::String(text)) => Ok(Some(text)),
            Some(other) => bail!("{key} is {other}; it must be a text"),
        };
        let of_kind = text(OWN[0], of_kind)?.unwrap_or_default();
        ensure!(["flow", "diffusion"].contains(&&*of_kind), "kind is {of_kind:?}; it must be flow or diffusion");
        let mut steps: JsonDenoising = serde_json::from_value(Value::Object(object))?;
        let of_time = steps.time.take().unwrap_or_default();
        ensure!(
            of_kind != "flow" || of_time.from.is_some() && of_time.to.is_some(),
            "time needs from and to, as packages differ: the time at the noise, and at the actions"
        );
        ensure!(
            of_time.freq.is_none() && of_time.order.is_none() && of_time.turns.is_none(),
            "time takes from and to alone: the network computes its features of the time"
        );
        steps.time = Some(JsonTime { order: Some(PLAIN.to_owned()), ..of_time });
        Ok(Self {
            kind: of_kind,
            execute: execute.map(serde_json::from_value).transpose().context("execute")?,
            overlap: overlap.map(serde_json::from_value).transpose().context("overlap")?,
            iterate: text("iterate_input", iterate)?,
            time: text("time_input", time)?,
            action: action.map(serde_json::from_value).transpose().context("action")?,
            steps,
        })
    }

    /// Returns the times at which the network runs.
    ///
    /// # Errors
    ///
    /// If keys are missing, contradict each other or have wrong values.
    pub fn times(&self) -> Result<Vec<f64>> {
        let kind = if self.kind == "flow" { Kind::Flow } else { Kind::Diffusion };
        Ok(self.steps.schedule(kind, 0)?.times)
    }

    /// Returns the limit of the network's iterate, if it has one.
    pub fn clip_iterate(&self) -> Option<f64> {
        self.steps.clip_iterate
    }
}

impl JsonDenoising {
    /// Returns the schedule of an iterative kind over `len` values.
    pub(super) fn schedule(&self, kind: Kind, len: usize) -> Result<Schedule> {
        if kind == Kind::Flow { self.flow(len) } else { self.diffusion(len) }
    }

    /// Returns the schedule of a flow over `len` values: Euler's or the midpoint method from the first time to the
    /// last.
    fn flow(&self, len: usize) -> Result<Schedule> {
        for (key, given) in [
            ("schedule", self.schedule.is_some()),
            ("train_steps", self.train_steps.is_some()),
            ("prediction", self.prediction.is_some()),
            ("clip_sample", self.clip_sample.is_some()),
            ("clip_iterate", self.clip_iterate.is_some()),
            ("variance", self.variance.is_some()),
            ("beta", self.beta.is_some()),
        ] {
            ensure!(!given, "the key {key:?} is for kind diffusion, not for flow; remove it");
        }
        let steps = self.step_count()?;
        let time = self.time.as_ref();
        let (from, to) = (time.and_then(|t| t.from).unwrap_or(0.0), time.and_then(|t| t.to).unwrap_or(1.0));
        ensure!(
            from.is_finite() && to.is_finite() && from != to,
            "time runs from {from} to {to}; the ends must be finite and different"
        );
        let h = (to - from) / steps as f64;
        let at = |k: f64| from + h * k;
        let keep = Coefficients { keep: 1.0, ..Coefficients::default() };
        let (mut by, mut times) = (Vec::new(), Vec::new());
        for k in 0..steps {
            match self.solver.as_deref() {
                None | Some("euler") => {
                    by.push(Coefficients { direct: h as f32, ..keep });
                    times.push(at(k as f64));
                }
                // Evaluate the network half a step ahead, and take the whole step with its result.
                Some("midpoint") => {
                    by.push(Coefficients { ahead: (0.5 * h) as f32, ..keep });
                    by.push(Coefficients { direct: h as f32, ..keep });
                    times.extend([at(k as f64), at(k as f64 + 0.5)]);
                }
                Some(other) => bail!("solver is {other:?}; a flow takes euler or midpoint"),
            }
        }
        Ok(Schedule { denoising: Denoising { first: 0, len, limit: f32::INFINITY, steps: by }, times })
    }

    /// Returns the schedule of a diffusion process: Ho et al., arXiv 2006.11239, or Song et al., arXiv 2010.02502, with
    /// eta 0. The cosine schedule is that of Nichol and Dhariwal, arXiv 2102.09672, equation 17.
    fn diffusion(&self, len: usize) -> Result<Schedule> {
        let train = self.train_steps.context("kind diffusion needs the key train_steps")?;
        ensure!((1..=MAX_STEPS).contains(&train), "train_steps is {train}; it must be 1 to {MAX_STEPS}");
        let steps = if self.steps.or(self.euler_steps).is_some() { self.step_count()? } else { train };
        ensure!(steps <= train, "steps is {steps}, but train_steps is only {train}");
        let remaining = self.remaining(train)?;
        // Evenly spaced, beginning with the noisiest; the last is 0.
        let chosen: Vec<usize> = (0..steps).rev().map(|k| k * (train / steps)).collect();
        let limit = match (self.clip_sample, self.clip_iterate) {
            (None, None) => f32::INFINITY,
            (Some(clip), None) => positive(clip, "clip_sample")?,
            (None, Some(clip)) => positive(clip, "clip_iterate")?,
            (Some(_), Some(_)) => bail!("clip_sample and clip_iterate share one limit; remove one of them"),
        };
        let mut by = Vec::new();
        for (i, &t) in chosen.iter().enumerate() {
            let (ab, before) = (remaining[t], chosen.get(i + 1).map_or(1.0, |&t| remaining[t]));
            by.push(self.step(ab, before)?);
        }
        let times = chosen.iter().map(|&t| t as f64).collect();
        Ok(Schedule { denoising: Denoising { first: 0, len, limit, steps: by }, times })
    }

    fn step_count(&self) -> Result<usize> {
        let steps = match (self.steps, self.euler_steps) {
            (Some(_), Some(_)) => bail!("steps and euler_steps are synonyms; remove one of them"),
            (steps, euler) => steps.or(euler).context("kind flow needs the key steps")?,
        };
        ensure!((1..=MAX_STEPS).contains(&steps), "steps is {steps}; it must be 1 to {MAX_STEPS}");
        Ok(steps)
    }

    /// Returns the share of the signal's power that remains after each step of training (alpha bar).
    fn remaining(&self, train: usize) -> Result<Vec<f64>> {
        let betas: Vec<f64> = match self.schedule.as_deref() {
            Some("cosine" | "squaredcos_cap_v2") => {
                let power = |i: usize| {
                    let angle = (i as f64 / train as f64 + 0.008) / 1.008 * std::f64::consts::FRAC_PI_2;
                    square(libm::cos(angle))
                };
                (0..train).map(|i| (1.0 - power(i + 1) / power(i)).min(0.999)).collect()
            }
            Some("linear") => {
                let [first, last] = self.beta.unwrap_or([1e-4, 0.02]);
                let share = |i: usize| if train > 1 { i as f64 / (train - 1) as f64 } else { 0.0 };
                (0..train).map(|i| first + (last - first) * share(i)).collect()
            }
            Some(other) => bail!("schedule is {other:?}; it must be cosine or linear"),
            None => bail!("kind diffusion needs the key schedule: cosine or linear"),
        };
        // Each step of training must add noise.
        ensure!(betas.iter().all(|b| *b > 0.0 && *b < 1.0), "the schedule's betas must lie between 0 and 1");
        Ok(betas
            .iter()
            .scan(1.0, |product, beta| {
                *product *= 1.0 - beta;
                Some(*product)
            })
            .collect())
    }

    /// Returns the step from the signal's share `ab` to `before`.
    fn step(&self, ab: f64, before: f64) -> Result<Coefficients> {
        let (signal, noise) = (ab.sqrt(), (1.0 - ab).sqrt());
        // Sample and noise that the output represents, as coefficients of the iterate and the output.
        let (sample, eps) = match self.prediction.as_deref() {
            None | Some("epsilon") => ([1.0 / signal, -noise / signal], [0.0, 1.0]),
            Some("sample") => ([0.0, 1.0], [1.0 / noise, -signal / noise]),
            Some("v") => ([signal, -noise], [noise, signal]),
            Some(other) => bail!("prediction is {other:?}; it must be epsilon, sample or v"),
        };
        let numbers = match self.solver.as_deref() {
            Some("ddim") => {
                ensure!(self.variance.is_none(), "the key \"variance\" is for the solver ddpm only; remove it");
                let left = (1.0 - before).sqrt();
                [sample[0], sample[1], left * eps[0], left * eps[1], before.sqrt(), 0.0, 0.0]
            }
            None | Some("ddpm") => {
                let alpha = ab / before;
                let keep = alpha.sqrt() * (1.0 - before) / (1.0 - ab);
                let variance = match self.variance.as_deref() {
                    None | Some("small") => (1.0 - before) / (1.0 - ab) * (1.0 - alpha),
                    // The last step adds none.
                    Some("large") => {
                        if before < 1.0 {
                            1.0 - alpha
                        } else {
                            0.0
                        }
                    }
                    Some(other) => bail!("variance is {other:?}; it must be small or large"),
                };
                [sample[0], sample[1], keep, 0.0, before.sqrt() * (1.0 - alpha) / (1.0 - ab), variance.sqrt(), 0.0]
            }
            Some(other) => bail!("solver is {other:?}; a diffusion policy takes ddpm or ddim"),
        };
        // A sample without a limit is a sum like the others, and its place can hold the iterate's limit.
        let [sample_x, sample_v, keep, direct, sample, sigma, ahead] = numbers;
        let (by_x, by_v) = (keep + sample * sample_x, direct + sample * sample_v);
        let numbers = match (self.clip_sample, self.clip_iterate) {
            (Some(_), _) => numbers,
            (None, Some(_)) => [1.0, 0.0, 0.0, by_v, by_x, sigma, ahead],
            (None, None) => [0.0, 0.0, by_x, by_v, 0.0, sigma, ahead],
        };
        Ok(Coefficients::from_array(numbers.map(|number| number as f32)))
    }
}
