//! The deterministic generator of all random numbers: the same seed gives the same image on every machine.

use rand_distr::Distribution as _;
use rand_distr::StandardNormal;
use rand_pcg::Pcg64Mcg;
use rand_pcg::rand_core::{Rng as _, SeedableRng as _};

/// PCG XSL RR 128/64 (MCG) (O'Neill: PCG, a family of simple fast space-efficient statistically good algorithms for
/// random number generation, 2014).
#[derive(Clone, Debug)]
pub struct Random(Pcg64Mcg);

impl Random {
    /// Makes a generator; equal seeds give equal sequences.
    pub fn new(seed: u64) -> Self {
        Self(Pcg64Mcg::seed_from_u64(seed))
    }

    /// Draws 64 random bits.
    pub fn bits(&mut self) -> u64 {
        self.0.next_u64()
    }

    /// Draws a number below `n`, which is at least 1.
    pub fn below(&mut self, n: usize) -> usize {
        (self.bits() % n as u64) as usize
    }

    /// Draws a uniform number from -1 to 1, in steps of 2^-23.
    pub fn unit(&mut self) -> f32 {
        (self.bits() >> 40) as f32 / (1u32 << 23) as f32 - 1.0
    }

    /// Draws a uniform number from 0 to 1, in steps of 2^-24.
    pub fn share(&mut self) -> f32 {
        (self.bits() >> 40) as f32 / (1u32 << 24) as f32
    }

    /// Draws a standard normal number.
    pub fn normal(&mut self) -> f32 {
        StandardNormal.sample(&mut self.0)
    }

    /// Draws -1 or 1.
    pub fn sign(&mut self) -> f32 {
        if self.bits() >> 63 == 0 { 1.0 } else { -1.0 }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Guards the sequences that images depend on against releases of a crate.
    #[test]
    fn sequences_stay_the_same() {
        let mut random = Random::new(1);
        let bits = [random.bits(), random.bits(), random.bits()];
        let normals: Vec<u32> = (0..4).map(|_| random.normal().to_bits()).collect();
        assert_eq!(bits, [15_803_641_690_485_367_939, 2_537_432_388_316_380_799, 8_678_483_373_067_562_792]);
        assert_eq!(normals, [1_063_676_658, 3_196_147_547, 1_044_048_389, 3_196_713_147]);
    }

    #[test]
    fn normal_numbers_have_unit_moments() {
        let mut random = Random::new(2);
        let samples: Vec<f64> = (0..20_000).map(|_| f64::from(random.normal())).collect();
        let mean = samples.iter().sum::<f64>() / samples.len() as f64;
        let variance = samples.iter().map(|x| (x - mean).powi(2)).sum::<f64>() / samples.len() as f64;
        assert!(mean.abs() < 0.03 && (variance - 1.0).abs() < 0.05, "{mean} {variance}");
    }
}
