//! Kernel cases with their expected sums, as one stream of little-endian words that the host and the firmware read.
//!
//! A case: width, lanes, rows, cols, group, start (words of padding to put before weights and activations, 0 to 3),
//! then the packed words, the prepared activations, and the sums with those of padding rows. The stream ends with a
//! width of 0.

pub use actq::random::Random;
use actq_kernels::activations::{Plan, Prepared, prepare};
use actq_kernels::layout::{Block, BlockShape, Lanes, Width, pack};

/// Distribution of a case's numbers.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Draw {
    /// Uniform.
    Uniform,
    /// Weights at either end of their range, activations of the largest magnitude.
    Ends,
    /// Every product of the largest magnitude and of one sign: the worst case of the accumulators.
    Worst,
    /// All activations equal, each row's weights at one end of their range: the longest path of one lane and not of
    /// another.
    Aligned,
}

/// A block with activations.
#[derive(Clone, Debug)]
pub struct Case {
    /// Shape of the block.
    pub shape: BlockShape,
    /// Row-major codes.
    pub codes: Vec<u8>,
    /// Row-major group scales.
    pub scales: Vec<u8>,
    /// Activations.
    pub x: Vec<i16>,
}

impl Case {
    /// Draws a case with activations up to `x_max`.
    pub fn draw(random: &mut Random, shape: BlockShape, x_max: i16, draw: Draw) -> Self {
        let mask = (1u32 << shape.width.bits()) - 1;
        let (lowest, highest) = match shape.width {
            Width::W8 => (0x80, 0x7f),
            _ => (0, mask as u8),
        };
        let sign = [x_max, -x_max][random.below(2)];
        let ends = (0..shape.rows).map(|_| [lowest, highest][random.below(2)]).collect::<Vec<_>>();
        let x = (0..shape.cols)
            .map(|_| match draw {
                Draw::Uniform => (random.unit() * f32::from(x_max)) as i16,
                Draw::Ends | Draw::Worst => [x_max, -x_max][random.below(2)],
                Draw::Aligned => sign,
            })
            .collect::<Vec<_>>();
        let codes = (0..shape.rows * shape.cols)
            .map(|i| match draw {
                Draw::Uniform => (random.bits() as u32 & mask) as u8,
                Draw::Ends => [lowest, highest][random.below(2)],
                Draw::Aligned => ends[i / shape.cols],
                Draw::Worst => {
                    [lowest, highest][usize::from((x[i % shape.cols] > 0) == (i / shape.cols).is_multiple_of(2))]
                }
            })
            .collect();
        let scales = (0..shape.rows * shape.groups())
            .map(|_| if draw == Draw::Uniform { random.bits() as u8 } else { 255 })
            .collect();
        Self { shape, codes, scales, x }
    }

    /// Returns the packed words.
    pub fn words(&self) -> Vec<u32> {
        let mut words = vec![0; self.shape.words()];
        assert!(pack(self.shape, &self.codes, &self.scales, &mut words).is_ok(), "the case fits its shape");
        words
    }

    /// Returns the prepared activations.
    pub fn prepared(&self) -> Vec<u32> {
        let plan = self.plan();
        let mut out = vec![!0; plan.words()];
        prepare(&self.x, &plan, &mut out);
        out
    }

    /// Returns the plan that prepares its activations.
    pub fn plan(&self) -> Plan {
        Plan::new(self.shape).expect("the shape is valid")
    }

    /// Computes the sums by the definition, from codes and activations, modulo 2^32; those of padding rows are 0.
    pub fn sums(&self) -> Vec<i32> {
        let shape = self.shape;
        let mut sums = vec![0; shape.padded_rows()];
        for (row, codes) in self.codes.chunks_exact(shape.cols).enumerate() {
            let scale = |col: usize| col.checked_div(shape.group).map_or(1, |g| self.scales[row * shape.groups() + g]);
            let sum = codes.iter().zip(&self.x).enumerate().fold(0i64, |sum, (col, (&code, &x))| {
                sum + i64::from(shape.width.level(code)) * i64::from(scale(col)) * i64::from(x)
            });
            sums[row] = sum as i32;
        }
        sums
    }

    /// Runs `gemv` on the case, with `start` words before the weights and the activations.
    pub fn run(&self, start: usize, gemv: impl Fn(&Block<'_>, &Prepared<'_>, &mut [i32])) -> Vec<i32> {
        let shift = |words: Vec<u32>| [vec![!0; start], words].concat();
        let (words, prepared) = (shift(self.words()), shift(self.prepared()));
        let mut sums = vec![0; self.shape.padded_rows()];
        let block = Block::new(self.shape, &words[start..]);
        let plan = self.plan();
        let x = Prepared::new(&prepared[start..], &plan);
        if let (Some(block), Some(x)) = (block, x) {
            gemv(&block, &x, &mut sums);
        }
        // The sums of padding rows have no meaning.
        sums[self.shape.rows..].fill(0);
        sums
    }

    /// Appends the case to a stream.
    fn write(&self, start: usize, out: &mut Vec<u32>) {
        let shape = self.shape;
        let lanes = u32::from(shape.lanes.code());
        out.extend([shape.width.bits(), lanes, shape.rows as u32, shape.cols as u32, shape.group as u32, start as u32]);
        out.extend(self.words());
        out.extend(self.prepared());
        out.extend(self.sums().iter().map(|&s| s as u32));
    }
}

/// Draws cases of all layouts and groups over all lengths from 1 to 67 and larger ones, with 1 to 17 rows, random and
/// extreme values, and activations up to the layout's limit.
pub fn cases(seed: u64) -> Vec<Case> {
    let mut random = Random::new(seed);
    let mut cases = Vec::new();
    for (width, lanes, group) in layouts() {
        for cols in (1..=67).chain([96, 127, 128, 129, 160, 255, 256, 257, 300, 512, 515, 1024, 2048]) {
            for draw in [Draw::Uniform, Draw::Ends, Draw::Worst, Draw::Aligned] {
                let rows = 1 + random.below(17);
                let x_max = match lanes {
                    Lanes::Single => [127, i16::MAX][random.below(2)],
                    Lanes::Paired | Lanes::Scalar | Lanes::Helium => 127,
                };
                cases.push(Case::draw(&mut random, BlockShape { width, lanes, rows, cols, group }, x_max, draw));
            }
        }
    }
    cases
}

/// Draws the cases of [`cases`] for layouts of the DSP extension.
pub fn dsp_cases(seed: u64) -> Vec<Case> {
    cases(seed).into_iter().filter(|case| Lanes::DSP.contains(&case.shape.lanes)).collect()
}

/// Lists all valid combinations of width, lanes and group.
pub fn layouts() -> impl Iterator<Item = (Width, Lanes, usize)> {
    let of = |(width, lanes)| [0, 32, 64, 128].map(|group| (width, lanes, group));
    let all = Width::ALL.into_iter().flat_map(|width| Lanes::ALL.map(|lanes| (width, lanes)));
    all.flat_map(of).filter(|&(width, lanes, group)| BlockShape { width, lanes, rows: 1, cols: 1, group }.is_valid())
}

/// Returns the cases as the firmware reads them, at every alignment of words in a 16-byte line.
pub fn stream(cases: &[Case]) -> Vec<u8> {
    let mut words = Vec::new();
    for (i, case) in cases.iter().enumerate() {
        case.write(i % 4, &mut words);
    }
    words.push(0);
    words.iter().flat_map(|w| w.to_le_bytes()).collect()
}
