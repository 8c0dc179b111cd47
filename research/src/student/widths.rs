//! Widths of a student's hidden vectors within a budget.

use actq::budget::BudgetTooSmall;
use actq::error::{Result, bail};
use actq::graph::Graph;
use actq::policy::Policy;

use super::form::{Form, Limits, Taken, taken};
use actq::graph::narrow::narrowed;
use actq::graph::ties::Ties;

/// Exponents of the teacher's widths in the student's: in proportion to them, to their roots, and equal.
const EXPONENTS: [f64; 3] = [1.0, 0.5, 0.0];
/// Elements in a step of the width: blocks of rows are padded to four.
const STEP: usize = 4;
/// Teacher's width from which on a student's is a multiple of [`STEP`].
const WIDE: usize = 16;

/// A network that is narrowed to a budget.
#[derive(Clone, Copy, Debug)]
pub struct Narrowing<'a> {
    /// The policy around it.
    pub policy: &'a Policy,
    /// The network.
    pub graph: &'a Graph,
    /// Its groups.
    pub ties: &'a Ties,
    /// Form of the weights.
    pub form: Form,
    /// Budget of the image.
    pub limits: Limits,
}

impl Narrowing<'_> {
    /// Measures the network of these elements of each group.
    ///
    /// # Errors
    ///
    /// As [`taken`].
    pub fn taken(&self, kept: &[Vec<usize>]) -> Result<Taken> {
        taken(self.policy, &narrowed(self.graph, self.ties, kept).graph, self.form)
    }

    /// Returns `true` if the network of these elements keeps the limits.
    ///
    /// # Errors
    ///
    /// As [`Self::taken`].
    pub fn fits(&self, kept: &[Vec<usize>]) -> Result<bool> {
        Ok(self.limits.keep(self.taken(kept)?))
    }

    /// Returns the fewest elements that a student or a pruned network keeps of each group: the first ones.
    ///
    /// # Errors
    ///
    /// [`BudgetTooSmall`], or the fastest time, if even these do not keep the limits.
    pub fn least(&self) -> Result<Vec<Vec<usize>>> {
        let kept = self.first(&step);
        let taken = self.taken(&kept)?;
        let weights = self.policy.weights;
        BudgetTooSmall::check(taken.weights, self.limits.weights, weights)?;
        BudgetTooSmall::check(0, self.limits.image - taken.image as f64, weights).map_err(|small| BudgetTooSmall {
            bytes: taken.image,
            limit: self.limits.image,
            image: true,
            ..small
        })?;
        if !self.limits.keep(taken) {
            bail!("the narrowest network takes {:.3} ms; allow that or more", taken.milliseconds);
        }
        Ok(kept)
    }

    /// Returns the elements of each group for every kind of shape, as wide as the limits permit.
    ///
    /// # Errors
    ///
    /// As [`Self::least`].
    pub fn shapes(&self) -> Result<Vec<Vec<Vec<usize>>>> {
        self.least()?;
        let widest = self.ties.free.iter().map(|&group| self.ties.lens[group]).max().unwrap_or(1);
        let mut shapes: Vec<Vec<Vec<usize>>> = Vec::new();
        for exponent in EXPONENTS {
            let of = |width: usize| {
                self.first(&|len| {
                    let part = width as f64 * (len as f64 / widest as f64).powf(exponent);
                    (part as usize / step(len) * step(len)).clamp(step(len), len)
                })
            };
            let (mut fits, mut exceeds) = (1, widest + 1);
            while exceeds - fits > 1 {
                let middle = fits.midpoint(exceeds);
                if self.fits(&of(middle))? { fits = middle } else { exceeds = middle }
            }
            let shape = self.filled(of(fits))?;
            if !shapes.contains(&shape) {
                shapes.push(shape);
            }
        }
        Ok(shapes)
    }

    /// Widens groups as long as one fits, the narrowest relative to the teacher's first.
    fn filled(&self, mut kept: Vec<Vec<usize>>) -> Result<Vec<Vec<usize>>> {
        loop {
            let share = |group: &usize| kept[*group].len() as f64 / self.ties.lens[*group] as f64;
            let mut groups = self.ties.free.clone();
            groups.sort_by(|a, b| share(a).total_cmp(&share(b)));
            let mut wider = None;
            for group in groups {
                let len = self.ties.lens[group];
                let more = kept[group].len() + step(len);
                if more <= len && wider.is_none() {
                    let mut candidate = kept.clone();
                    candidate[group] = (0..more).collect();
                    wider = self.fits(&candidate)?.then_some(candidate);
                }
            }
            match wider {
                Some(wider) => kept = wider,
                None => return Ok(kept),
            }
        }
    }

    /// Keeps the first elements of each free group: as many as `count` says of its length.
    fn first(&self, count: &dyn Fn(usize) -> usize) -> Vec<Vec<usize>> {
        let mut kept = self.ties.whole();
        self.ties.free.iter().for_each(|&group| kept[group].truncate(count(self.ties.lens[group])));
        kept
    }
}

/// Returns the least elements of a group, and the elements in a step of its width.
fn step(len: usize) -> usize {
    if len < WIDE { 1 } else { STEP }
}

/// Formats the widths of the free groups, as `48-40-32`.
pub fn format_widths(ties: &Ties, kept: &[Vec<usize>]) -> String {
    ties.free.iter().map(|&group| kept[group].len().to_string()).collect::<Vec<_>>().join("-")
}
