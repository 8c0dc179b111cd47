//! The cores that images are for, and their rates.

pub use super::rates::CORES;
use super::rates::RATES;
use super::{CostItem, Rates, in_1024ths};
use crate::image::Image;
use crate::layout::Lanes;

/// A core that images are for.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Core {
    /// Cortex-M0, M0+.
    M0,
    /// Cortex-M3.
    M3,
    /// RV32IMAC.
    Rv32imac,
    /// RV32IMAC with Zba and Zbb.
    Rv32zb,
    /// Cortex-M4 without FPU.
    M4,
    /// Cortex-M4 with FPU.
    M4f,
    /// Cortex-M7.
    M7,
    /// Cortex-M33 with the DSP extension.
    M33,
    /// Cortex-M55 and M85, with Helium.
    M55,
}

impl Core {
    /// All cores with their names.
    pub const ALL: [(&str, Self); 9] = [
        ("m0", Self::M0),
        ("m3", Self::M3),
        ("rv32imac", Self::Rv32imac),
        ("rv32zb", Self::Rv32zb),
        ("m4", Self::M4),
        ("m4f", Self::M4f),
        ("m7", Self::M7),
        ("m33", Self::M33),
        ("m55", Self::M55),
    ];

    /// Returns the core of this name.
    pub fn of_name(name: &str) -> Option<Self> {
        Self::ALL.into_iter().find_map(|(known, core)| (known == name).then_some(core))
    }

    /// Returns the core's name.
    pub fn name(self) -> &'static str {
        Self::ALL.into_iter().find_map(|(name, core)| (core == self).then_some(name)).unwrap_or("m4f")
    }

    /// Returns how a sentence names the core.
    pub fn title(self) -> &'static str {
        match self {
            Self::M0 => "a Cortex-M0+",
            Self::M3 => "a Cortex-M3",
            Self::Rv32imac => "an RV32IMAC",
            Self::Rv32zb => "an RV32IMAC with Zba and Zbb",
            Self::M4 => "a Cortex-M4 without FPU",
            Self::M4f => "a Cortex-M4 with FPU",
            Self::M7 => "a Cortex-M7",
            Self::M33 => "a Cortex-M33",
            Self::M55 => "a Cortex-M55",
        }
    }

    /// Returns `true` if the core's layouts are the default, those of the DSP extension.
    pub fn has_default_layouts(self) -> bool {
        self.lanes(Lanes::PAIRED_X_MAX, 0) == Lanes::Paired
    }

    /// Returns the lanes of a matrix for the core. Activations of more than 8 bits have only the DSP extension's.
    pub fn lanes(self, x_max: u16, group: usize) -> Lanes {
        match self {
            _ if x_max > Lanes::PAIRED_X_MAX => Lanes::of(x_max, group),
            Self::M55 => Lanes::Helium,
            Self::M0 | Self::M3 | Self::Rv32imac | Self::Rv32zb => Lanes::Scalar,
            Self::M4 | Self::M4f | Self::M7 | Self::M33 => Lanes::of(x_max, group),
        }
    }

    /// Returns `true` if all matrices of an image are in the core's layouts: others run with the same bits, slowly, and
    /// their cost is not known.
    pub fn has_layouts_of(self, image: &Image<'_>) -> bool {
        image.matrices().all(|matrix| {
            let lanes = self.lanes(matrix.x_max, matrix.group);
            matrix.blocks().all(|block| block.block.shape().lanes == lanes)
        })
    }

    /// Returns the cores whose layouts an image has.
    pub fn of_image(image: &Image<'_>) -> impl Iterator<Item = Self> {
        Self::ALL.into_iter().map(|(_, core)| core).filter(|core| core.has_layouts_of(image))
    }

    /// Returns the core whose rates are taken for this one: the core itself, if it was measured. Code of the Cortex-M4 runs
    /// on the M7 and the M33, which take no more cycles.
    pub fn measured(self) -> Self {
        match self {
            Self::M7 | Self::M33 => Self::M4f,
            _ => self,
        }
    }

    /// Returns `true` if the cycles follow the core's own manual; others are estimates.
    pub fn is_modelled(self) -> bool {
        matches!(self, Self::M0 | Self::M3 | Self::M4 | Self::M4f)
    }

    /// Returns the core's rates: those of [`Self::measured`].
    pub fn rates(self) -> Rates {
        let of = |core| match CORES.iter().position(|known| *known == core) {
            Some(core) => Rates { instructions: &INSTRUCTIONS[core], cycles: &CYCLES[core] },
            None => Rates::M4F,
        };
        of(self.measured())
    }
}

/// Instructions and cycles of each item on the cores of [`CORES`], in 1024ths.
static INSTRUCTIONS: [[u32; CostItem::COUNT]; CORES.len()] = columns(0);
static CYCLES: [[u32; CostItem::COUNT]; CORES.len()] = columns(1);

const fn columns(which: usize) -> [[u32; CostItem::COUNT]; CORES.len()] {
    let mut columns = [[0; CostItem::COUNT]; CORES.len()];
    let mut i = 0;
    while i < RATES.len() {
        let mut core = 0;
        // A build without attention has none of its items.
        while core < CORES.len() && RATES[i].0.index() < CostItem::COUNT {
            columns[core][RATES[i].0.index()] = in_1024ths(RATES[i].2[core][which]);
            core += 1;
        }
        i += 1;
    }
    columns
}

/// Returns the rates of an item, as `rates.rs` has them: of a Cortex-M4 with FPU, and of [`CORES`].
pub fn rates_of(item: CostItem) -> ([f64; 3], [[f64; 2]; CORES.len()]) {
    RATES.iter().find(|(known, ..)| *known == item).map(|(_, dsp, others)| (*dsp, *others)).unwrap_or_default()
}
