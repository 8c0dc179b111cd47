//! Columns that weigh alike: what matrices read of the observation is scaled so that no column's weights and no
//! column's values stand out.
//!
//! Observations come in units of people's choice. A row has one scale, so an error of its weights has the same size in
//! every column: a column whose weights are small is rounded to nothing or to much more than it was, and one whose
//! values are large multiplies what it was rounded by. Activations have one scale a vector, with the same consequence
//! the other way round. With a factor `d_c` on what column `c` reads and its reciprocal on its weights, the network
//! computes what it did, and the expected error of the matrices behind is proportional to
//!
//! `sum_c a_c / d_c^2 * sum_c h_c d_c^2` with `a_c = sum_r g_r w_rc^2`,
//!
//! `h` and `g` the importance of columns and rows, each column in a unit of its own (`columns.rs`). It is least,
//! `(sum_c sqrt(a_c h_c))^2` by Cauchy and Schwarz, for `d_c = (a_c / h_c)^(1/4)`, which is also what SmoothQuant (arXiv
//! 2211.10438, eq. 4) does to activations' and weights' maxima with alpha 1/2. The values' means go into the biases.
//!
//! Where nothing but matrices reads a normalization without a limit, factors and means go into its own and cost
//! nothing; elsewhere they are an operation [`Balance`], whose bytes count. It scales the columns that need it
//! (`part.rs`), and is added where it saves more bits: an error that falls to a share `s` is worth `log2(1 / s) / 2` bits
//! for each weight of the matrices behind. Matrices that read the observation beside a hidden vector read it through the
//! same operation (`sites.rs`); the others are named ([`mixed_units`]) where units are far apart.

mod columns;
mod mixed;
mod part;
mod sites;

use nalgebra::{DMatrix, DVector};

use super::compact::add_to_bias;
use crate::calibrate::moments::Moments;
use crate::error::Result;
use crate::graph::ops::{Balance, Normalize};
use crate::graph::{Graph, NodeKind};
use columns::{Columns, deviations, lost_bits};
pub use mixed::{MixedUnits, mixed_units};
use part::Part;
use sites::{Reading, Site, sites};

/// What an operation more has to save, in bits a weight of the whole policy: 1.4% of the error.
const WORTH: f64 = 0.01;
/// Beyond so many bits a weight of the matrices alone, units would ruin what they compute, however small their share of
/// the policy is.
const RUINOUS: f64 = 1.0;
/// A weight has no more bits to save.
const MOST_BITS: f64 = 8.0;

/// The network with balanced columns; `moments` of the matrices' inputs become those of its inputs. `outputs` is the
/// importance of the matrices' rows.
///
/// # Errors
///
/// None for a network that its builder has accepted.
pub fn balance(graph: &Graph, moments: &mut [Moments], outputs: &[Vec<f64>]) -> Result<Graph> {
    let mut balanced = graph.clone();
    // From the last on: what is inserted moves only what stands behind it.
    for site in sites(graph).into_iter().rev() {
        let columns = Columns::of(graph, &site, moments, outputs);
        let own = own_normalize(graph, &site);
        let part = if own { Part::whole(&columns) } else { part(graph, &site, &columns, moments) };
        if !own && !pays(graph, &site, &columns, &part, moments) {
            continue;
        }
        let Some(factors) = part.factors(&columns) else { continue };
        let mean = part.means(&columns.mean);
        for reading in &site.readings {
            let (m, mean, factors) = (reading.matrix, reading.spread(&mean, 0.0), reading.spread(&factors, 1.0));
            let shift = scale(&mut balanced, m, &mean, &factors);
            add_to_bias(&mut balanced, m, &shift);
            moments[m].balance(&mean, &factors);
        }
        if own {
            if let NodeKind::Normalize(normalize) = &mut balanced.nodes[site.value - 1].kind {
                fold(normalize, &mean, &factors);
            }
        } else {
            let [mean, scale]: [Vec<f32>; 2] = [&mean, &factors].map(|of| of.iter().map(|v| *v as f32).collect());
            let balance = Balance::of_runs(part.has_means.then_some(mean), scale, part.runs);
            balanced.insert(balance, site.value, &site.readers)?;
        }
    }
    Ok(balanced)
}

/// Bytes of what [`balance`] has added to a network.
pub fn balance_bytes(graph: &Graph) -> usize {
    let bytes = |kind: &NodeKind| if let NodeKind::Balance(balance) = kind { balance.constant_bytes() } else { 0 };
    graph.nodes.iter().map(|node| bytes(&node.kind)).sum()
}

/// What an operation is to scale: the part that saves most, or all columns where only that keeps the policy whole.
fn part(graph: &Graph, site: &Site, columns: &Columns, moments: &[Moments]) -> Part {
    let part = Part::best(columns, weights_behind(graph, site), graph.weights());
    let keeps_whole = |factors: Vec<f64>| {
        part.takes(&factors) && !site.readings.iter().any(|r| is_apart(graph, r, moments, &factors))
    };
    let usable = !columns.are_far() && part.factors(columns).is_some_and(keeps_whole);
    if usable { part } else { Part::whole(columns) }
}

/// Whether an operation is worth its bytes, or nothing but it keeps the policy whole. Where units do not ruin the
/// policy, one on all columns has to be worth them: a few columns always gain a little.
fn pays(graph: &Graph, site: &Site, columns: &Columns, part: &Part, moments: &[Moments]) -> bool {
    let saved = |part: &Part| saved_bits(graph, site, columns, part);
    let as_they_are = vec![1.0; columns.mean.len()];
    saved(&Part::whole(columns)) >= WORTH * graph.weights() as f64
        || (columns.saved_bits() >= RUINOUS && saved(part) >= 0.0)
        || columns.are_far()
        || site.readings.iter().any(|reading| is_apart(graph, reading, moments, &as_they_are))
}

/// Bits that an operation saves, those of its own bytes taken off.
fn saved_bits(graph: &Graph, site: &Site, columns: &Columns, part: &Part) -> f64 {
    let bits = columns.saved_bits().min(MOST_BITS) - part.lost_bits;
    weights_behind(graph, site) as f64 * bits - 8.0 * part.bytes() as f64
}

/// Weights that read the value.
fn weights_behind(graph: &Graph, site: &Site) -> usize {
    site.readings.iter().map(|reading| graph.matrices[reading.matrix].rows * reading.columns().count()).sum()
}

/// Whether a matrix that also reads another value would be ruined by the unit that all elements of this one share, once
/// they have these factors.
fn is_apart(graph: &Graph, reading: &Reading, moments: &[Moments], factors: &[f64]) -> bool {
    let squares: Vec<f64> = reading.spread(factors, 1.0).into_iter().map(|d| d * d).collect();
    let deviations = deviations(&moments[reading.matrix]);
    let values: Vec<f64> = deviations.into_iter().zip(&squares).map(|(d, square)| d * d * square).collect();
    let energies = graph.matrices[reading.matrix].column_energies();
    let energies: Vec<f64> = energies.into_iter().zip(&squares).map(|(energy, square)| energy / square).collect();
    reading.is_partial() && lost_bits(&energies, &values) >= RUINOUS
}

/// Whether the value is that of a normalization without a limit behind it that nothing else reads.
fn own_normalize(graph: &Graph, site: &Site) -> bool {
    let node = site.value.checked_sub(1).map(|n| &graph.nodes[n].kind);
    matches!(node, Some(NodeKind::Normalize(normalize)) if normalize.clip == f32::INFINITY)
        && site.value != graph.output()
        && graph.readers(site.value) == site.readers
}

/// Divides a matrix's columns by the factors, and gives what it makes of the mean.
fn scale(graph: &mut Graph, matrix: usize, mean: &[f64], factors: &[f64]) -> Vec<f32> {
    let matrix = &mut graph.matrices[matrix];
    let rows = matrix.data.chunks_exact_mut(matrix.cols);
    rows.map(|row| {
        let of_mean: f64 = row.iter().zip(mean).map(|(w, mean)| f64::from(*w) * mean).sum();
        row.iter_mut().zip(factors).for_each(|(w, d)| *w = (f64::from(*w) / d) as f32);
        of_mean as f32
    })
    .collect()
}

/// `((x - mean) * scale - m) * d` as one.
fn fold(normalize: &mut Normalize, mean: &[f64], factors: &[f64]) {
    let Normalize { mean: own, scale, .. } = normalize;
    for ((own, scale), (m, d)) in own.iter_mut().zip(scale).zip(mean.iter().zip(factors)) {
        // Of a scale of 0 the mean is 0, too.
        if *scale != 0.0 {
            *own = (f64::from(*own) + m / f64::from(*scale)) as f32;
        }
        *scale = (f64::from(*scale) * d) as f32;
    }
}

impl Moments {
    /// Of `(x - mean) * factors`.
    fn balance(&mut self, mean: &[f64], factors: &[f64]) {
        let centred = self.centred();
        self.mean.iter_mut().zip(mean).zip(factors).for_each(|((own, mean), d)| *own = (*own - mean) * d);
        let factors = DMatrix::from_diagonal(&DVector::from_column_slice(factors));
        let own = DVector::from_column_slice(&self.mean);
        self.second = &factors * centred * &factors + &own * own.transpose();
    }
}

#[cfg(test)]
mod tests {
    use actq_kernels::math::Function;

    use super::*;
    use crate::graph::ops::{Add, Concat, Linear, Lstm, Pointwise, Span};
    use crate::graph::{Evaluator, ValueId, WeightMatrix};
    use crate::random::Random;

    const COLS: usize = 6;
    /// So many that a balance takes a small share of the weights' bytes.
    const ROWS: usize = 800;

    /// A linear layer behind what `before` builds, over observations that `COLS` different powers of three scale, and
    /// weights that powers of two do.
    fn linear(before: impl FnOnce(&mut Graph) -> ValueId) -> Graph {
        let mut graph = Graph::new(COLS);
        let value = before(&mut graph);
        let mut random = Random::new(3);
        let data = (0..ROWS * COLS).map(|i| random.normal() * 2f32.powi((i % COLS) as i32)).collect();
        let matrix =
            graph.add_matrix(WeightMatrix { name: "w".into(), rows: ROWS, cols: COLS, data }).expect("a matrix");
        graph.add(Linear { matrix, bias: vec![0.5; ROWS] }, &[value]).expect("it fits");
        graph
    }

    /// Observations about a mean of 2; the last but one never moves, the last follows the first.
    fn observations(count: usize) -> Vec<Vec<f32>> {
        let mut random = Random::new(4);
        let mut one = || {
            let mut x: Vec<f32> = (0..COLS).map(|c| 2.0 + random.normal() * 3f32.powi(c as i32 - 4)).collect();
            (x[4], x[5]) = (7.0, x[0]);
            x
        };
        (0..count).map(|_| one()).collect()
    }

    fn run(graph: &Graph, observation: &[f32], see: &mut dyn FnMut(usize, &[f32])) -> Vec<f32> {
        Evaluator::new(graph).step(observation, see)
    }

    /// Moments of every matrix's input.
    fn moments(graph: &Graph, observations: &[Vec<f32>]) -> Vec<Moments> {
        let zero =
            |m: &WeightMatrix| Moments { second: DMatrix::zeros(m.cols, m.cols), mean: vec![0.0; m.cols], count: 0 };
        let mut sums: Vec<Moments> = graph.matrices.iter().map(zero).collect();
        for observation in observations {
            run(graph, observation, &mut |m, x| {
                let x = DVector::from_iterator(x.len(), x.iter().map(|v| f64::from(*v)));
                sums[m].second += &x * x.transpose();
                sums[m].mean.iter_mut().zip(&x).for_each(|(sum, v)| *sum += v);
                sums[m].count += 1;
            });
        }
        for Moments { second, mean, count } in &mut sums {
            *second /= *count as f64;
            mean.iter_mut().for_each(|sum| *sum /= *count as f64);
        }
        sums
    }

    fn close(a: f64, b: f64, share: f64) -> bool {
        (a - b).abs() <= share * (1.0 + a.abs().max(b.abs()))
    }

    /// The balanced network and what its matrices read, which computes what `graph` does.
    fn balanced(graph: &Graph) -> (Graph, Vec<Moments>) {
        let observations = observations(400);
        let mut told = moments(graph, &observations);
        let outputs: Vec<Vec<f64>> = graph.matrices.iter().map(|m| vec![1.0; m.rows]).collect();
        let balanced = balance(graph, &mut told, &outputs).expect("balanced");
        for observation in &observations[..20] {
            let (a, b) = (run(graph, observation, &mut |_, _| {}), run(&balanced, observation, &mut |_, _| {}));
            assert!(a.iter().zip(&b).all(|(a, b)| close((*a).into(), (*b).into(), 1e-4)), "{a:?} {b:?}");
        }
        for (told, seen) in told.iter().zip(moments(&balanced, &observations)) {
            assert!(told.mean.iter().zip(&seen.mean).all(|(a, b)| close(*a, *b, 1e-4)));
            assert!(told.second.iter().zip(&seen.second).all(|(a, b)| close(*a, *b, 1e-3)));
        }
        (balanced, told)
    }

    fn added(graph: &Graph) -> usize {
        graph.nodes.iter().filter(|node| matches!(node.kind, NodeKind::Balance(_))).count()
    }

    fn unit(clip: f32) -> Normalize {
        Normalize { mean: vec![2.0; COLS], scale: vec![1.0; COLS], pre_clip: 9.0, clip }
    }

    #[test]
    fn columns_weigh_what_their_values_do() {
        let graph = linear(|_| 0);
        let (balanced, moments) = balanced(&graph);
        assert_eq!((added(&balanced), balance_bytes(&balanced)), (1, 4 * (2 * COLS + 2)));
        let of = |graph: &Graph, moments: &[Moments]| Columns::of(graph, &sites(graph)[0], moments, &[vec![1.0; ROWS]]);
        // Squares of weights and of deviations are in one proportion wherever values move by themselves.
        let columns = of(&balanced, &moments);
        let share = |c: usize| columns.weights[c].sqrt() / columns.deviation[c];
        for c in 2..4 {
            assert!((share(c) / share(1) - 1.0).abs() < 0.2, "{c}: {} {}", share(c), share(1));
        }
        let before = of(&graph, &self::moments(&graph, &observations(400)));
        assert!(before.saved_bits() > 0.3, "{}", before.saved_bits());
        assert!(columns.saved_bits() < 0.2 * before.saved_bits(), "{}", columns.saved_bits());
        // What did not move reads 0, and its factor is no other than theirs.
        let NodeKind::Balance(balance) = &balanced.nodes[0].kind else { panic!("not before the matrix") };
        let Normalize { mean, scale, .. } = balance.normalize();
        assert_eq!((mean[4], columns.deviation[4]), (7.0, 0.0));
        let (least, most) = scale.iter().fold((f32::MAX, 0f32), |(a, b), v| (a.min(*v), b.max(*v)));
        assert!(least < scale[4] && scale[4] < most, "{scale:?}");
    }

    #[test]
    fn a_normalization_of_the_policys_own_takes_the_factors() {
        let own = |clip| linear(|graph| graph.add(unit(clip), &[0]).expect("it fits"));
        let (free, _) = balanced(&own(f32::INFINITY));
        assert_eq!((added(&free), free.nodes.len()), (0, 2));
        assert!(
            matches!(&free.nodes[0].kind, NodeKind::Normalize(n) if n.scale.iter().any(|s| *s != 1.0) && n.pre_clip == 9.0)
        );
        // One with a limit, or that others read, stays as it is.
        let (limited, _) = balanced(&own(5.0));
        assert_eq!((added(&limited), limited.nodes[2].inputs[0]), (1, 2));
        let shared = linear(|graph| {
            let value = graph.add(unit(f32::INFINITY), &[0]).expect("it fits");
            graph.add(Add, &[value, value]).expect("it fits");
            value
        });
        let (shared, _) = balanced(&shared);
        assert_eq!((added(&shared), &shared.nodes[2].inputs[..]), (1, &[1, 1][..]));
    }

    #[test]
    fn what_gains_nothing_or_cannot_be_stays() {
        // Once balanced, nothing is left to win.
        let (once, _) = balanced(&linear(|_| 0));
        let (twice, _) = balanced(&once);
        assert_eq!(added(&twice), 1);
        // A matrix that also reads something else has one set of columns.
        let mut shared = linear(|_| 0);
        let part =
            shared.add(Concat(vec![Span { from: 0, len: 4 }, Span { from: 0, len: 2 }]), &[1, 0]).expect("it fits");
        shared.add(Linear { matrix: 0, bias: vec![0.0; ROWS] }, &[part]).expect("it fits");
        assert_eq!(added(&balanced(&shared).0), 0);
    }

    fn set_column(graph: &mut Graph, column: usize, change: impl Fn(&mut f32)) {
        graph.matrices[0].data.iter_mut().skip(column).step_by(COLS).for_each(change);
    }

    #[test]
    fn a_column_without_weights_leaves_the_others_balanced() {
        let mut graph = linear(|_| 0);
        set_column(&mut graph, 2, |w| *w = 0.0);
        let (balanced, moments) = balanced(&graph);
        let columns = Columns::of(&balanced, &sites(&balanced)[0], &moments, &[vec![1.0; ROWS]]);
        let share = |c: usize| columns.weights[c].sqrt() / columns.deviation[c];
        assert!((share(3) / share(1) - 1.0).abs() < 0.2, "{} {}", share(3), share(1));
    }

    #[test]
    fn a_small_matrix_is_balanced_where_units_would_ruin_it() {
        const FEW: usize = 16;
        let small = |factor: f32| {
            let mut graph = linear(|_| 0);
            set_column(&mut graph, 0, |w| *w *= factor);
            graph.matrices[0].data.truncate(FEW * COLS);
            graph.matrices[0].rows = FEW;
            graph.nodes.clear();
            let data = (0..3000 * FEW).map(|i| (i as f32).sin()).collect();
            let large = WeightMatrix { name: "large".into(), rows: 3000, cols: FEW, data };
            let large = graph.add_matrix(large).expect("a matrix");
            let hidden = graph.add(Linear { matrix: 0, bias: vec![0.0; FEW] }, &[0]).expect("it fits");
            let hidden = graph.add(Pointwise(Function::Tanh), &[hidden]).expect("it fits");
            graph.add(Linear { matrix: large, bias: vec![0.0; 3000] }, &[hidden]).expect("it fits");
            added(&balanced(&graph).0)
        };
        assert_eq!([small(1.0), small(1e4)], [0, 1]);
    }

    /// [observation, tanh of its product] -> sum of products, and what else reads both.
    fn beside_a_hidden_vector(others: impl FnOnce(&mut Graph, ValueId)) -> Graph {
        let mut graph = linear(|_| 0);
        let hidden = graph.add(Pointwise(Function::Tanh), &[1]).expect("it fits");
        let spans = vec![Span { from: 0, len: COLS }, Span { from: 0, len: ROWS }];
        let both = graph.add(Concat(spans), &[0, hidden]).expect("it fits");
        let data = (0..7 * (COLS + ROWS)).map(|i| (0.7 * i as f32).sin()).collect();
        let second = WeightMatrix { name: "second".into(), rows: 7, cols: COLS + ROWS, data };
        let second = graph.add_matrix(second).expect("a matrix");
        others(&mut graph, both);
        graph.add(Linear { matrix: second, bias: vec![0.1; 7] }, &[both]).expect("it fits");
        graph
    }

    #[test]
    fn one_operation_balances_all_that_reads_the_observation() {
        let (all, _) = balanced(&beside_a_hidden_vector(|_, _| ()));
        assert_eq!((added(&all), &all.nodes[1].inputs[..], &all.nodes[3].inputs[..]), (1, &[1][..], &[1, 3][..]));
        // What others read stays as it is.
        let read = |graph: &mut Graph, both| _ = graph.add(Add, &[both, both]).expect("it fits");
        let (part, _) = balanced(&beside_a_hidden_vector(read));
        assert_eq!((added(&part), &part.nodes[1].inputs[..], &part.nodes[3].inputs[..]), (1, &[1][..], &[0, 3][..]));
    }

    #[test]
    fn a_matrix_that_cannot_be_balanced_is_named() {
        let shared = |factor: f32| {
            let mut graph = linear(|_| 0);
            set_column(&mut graph, 0, |w| *w *= factor);
            let turned = Concat(vec![Span { from: 3, len: 3 }, Span { from: 0, len: 3 }]);
            let turned = graph.add(turned, &[0, 0]).expect("it fits");
            graph.add(Linear { matrix: 0, bias: vec![0.5; ROWS] }, &[turned]).expect("it fits");
            let (balanced, moments) = balanced(&graph);
            assert_eq!(added(&balanced), 0);
            mixed_units(&balanced, &moments)
        };
        assert_eq!(shared(1.0), []);
        let [MixedUnits { matrix, observations, bits }] = &shared(1e9)[..] else { panic!("one matrix") };
        assert!(matrix == "w" && observations.contains(&0) && *bits > 3.0, "{observations:?} {bits}");
    }

    /// A linear layer of `rows` that undoes the units of the observation, whose mean is 2 unless `mean` is 0.
    fn small(rows: usize, units: [f32; COLS], mean: f32) -> (Graph, Vec<Moments>) {
        let mut random = Random::new(6);
        let mut graph = Graph::new(COLS);
        let data = (0..rows * COLS).map(|i| random.normal() / units[i % COLS]).collect();
        let matrix = graph.add_matrix(WeightMatrix { name: "w".into(), rows, cols: COLS, data }).expect("a matrix");
        graph.add(Linear { matrix, bias: vec![0.5; rows] }, &[0]).expect("it fits");
        let mut one = || units.map(|unit| unit * (mean + random.normal())).to_vec();
        let observations: Vec<Vec<f32>> = (0..400).map(|_| one()).collect();
        let moments = moments(&graph, &observations);
        (graph, moments)
    }

    /// The factors of an operation in a layer of `rows`, and the bytes of its constants.
    fn scaled(rows: usize, units: [f32; COLS], mean: f32) -> Option<(Vec<f32>, usize)> {
        let (graph, mut moments) = small(rows, units, mean);
        let balanced = balance(&graph, &mut moments, &[vec![1.0; rows]]).expect("balanced");
        let NodeKind::Balance(balance) = &balanced.nodes[0].kind else { return None };
        Some((balance.normalize().scale.clone(), balance.constant_bytes()))
    }

    #[test]
    fn only_columns_in_other_units_are_scaled() {
        for (unit, rows) in [(1e3, 500), (1e-5, 500), (1e3, 1000)] {
            let (scale, bytes) = scaled(rows, [1.0, 1.0, unit, 1.0, 1.0, 1.0], 0.0).expect("one unit is another");
            assert_eq!((scale[1], scale[3], bytes), (1.0, 1.0, Balance::bytes(1)), "{unit}");
            assert!((scale[2] * unit - 1.0).abs() < 0.2, "{unit}: {scale:?}");
        }
        // As few as there are: of two units the one that fewer columns have.
        let (scale, bytes) = scaled(500, [1e4, 1.0, 1e4, 1e4, 1e4, 1e4], 0.0).expect("one unit is another");
        assert!((scale[1] / 1e4 - 1.0).abs() < 0.2 && scale[0] == 1.0 && bytes == Balance::bytes(1), "{scale:?}");
        assert_eq!(scaled(500, [1e4; COLS], 0.0), None);
    }

    #[test]
    fn means_are_stored_where_their_bytes_are_few_or_they_matter() {
        let units = [1.0, 1e3, 1e6, 1e-3, 1e2, 1e-5];
        let bytes = |rows, mean| scaled(rows, units, mean).map(|(_, bytes)| bytes);
        assert_eq!(bytes(50, 0.0), Some(Balance::bytes_without_means(COLS)));
        assert_eq!(bytes(20_000, 0.0), Some(Balance::bytes(COLS)));
        assert_eq!(bytes(50, 1000.0), Some(Balance::bytes(COLS)));
    }

    #[test]
    fn the_gates_of_a_cell_read_balanced_columns() {
        let mut graph = linear(|_| 0);
        let mut random = Random::new(5);
        let data = (0..ROWS * ROWS / 4).map(|_| 0.1 * random.normal()).collect();
        let state =
            graph.add_matrix(WeightMatrix { name: "s".into(), rows: ROWS, cols: ROWS / 4, data }).expect("a matrix");
        graph.matrices[0].data.iter_mut().for_each(|w| *w *= 0.01);
        graph.nodes.clear();
        graph.add(Lstm { hidden: ROWS / 4, input: 0, state, bias: vec![0.1; ROWS] }, &[0]).expect("it fits");
        let (balanced, _) = balanced(&graph);
        assert_eq!((added(&balanced), &balanced.nodes[1].inputs[..]), (1, &[1][..]));
    }
}
