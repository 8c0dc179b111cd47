//! A plan as an image: one network to quantize, and the operations around it.
//!
//! Networks that feed each other are joined to one, so that the quantizer weighs all of them by the action. What the
//! networks read and what comes of their outputs becomes operations in f32 over buffers.

mod around;
mod chain;
mod clock;
mod joined;
mod operations;

use actq::contract::ActionContract;
use actq::error::{Context as _, Result, ensure};
use actq::graph::without_ignored;
use actq::policy::Policy;

use crate::plan::Plan;
use joined::Joined;

/// A description as an image needs it.
#[derive(Clone, Debug)]
pub struct Deployment {
    /// The joined networks. Its observation is what they read of values, its action all outputs that are used, and what
    /// is around it makes targets of raw values.
    pub policy: Policy,
    /// For each value of the policy's observation its index in [`crate::Tick::observation`].
    pub columns: Vec<usize>,
}

impl Deployment {
    /// Compiles a plan.
    ///
    /// # Errors
    ///
    /// If an image has no operations for a part of it; the error names the value and the operation.
    pub fn new(name: &str, rate_hz: f32, plan: &Plan) -> Result<Self> {
        let joined = Joined::of(plan)?;
        let mut policy = Policy::of(name, without_ignored(&joined.graph));
        policy.around = Some(around::around(plan, &joined)?);
        (policy.rate_hz, policy.has_rate) = (rate_hz, true);
        policy.contract = ActionContract::default();
        policy.check()?;
        let columns = columns(plan, &joined)?;
        Ok(Self { policy, columns })
    }
}

/// Finds the joined observation in that of a tick.
fn columns(plan: &Plan, joined: &Joined) -> Result<Vec<usize>> {
    let mut places = Vec::new();
    let mut from = 0;
    for (n, network) in plan.networks.iter().enumerate() {
        for (feed, (_, len)) in network.feeds.iter().zip(network.compute.inputs()) {
            places.extend(joined::sources(plan, n, feed, from));
            from += len;
        }
    }
    let mut columns = Vec::new();
    for source in &joined.observation {
        let found = places.iter().find(|(other, _)| other == source);
        let at = found.with_context(|| "a network reads a value that no tick reports")?.1;
        columns.extend(at..at + source.len(plan));
    }
    ensure!(!columns.is_empty(), "no network reads a value");
    Ok(columns)
}
