//! How many lanes, chosen when the program runs.

use pulp::{Scalar, Scalar128b, Simd, WithSimd};

/// A number of lanes that this machine has instructions for.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Width {
    /// One number at a time, on any machine.
    One,
    /// Four: SSE2, NEON, or whatever the compiler makes of it.
    Four,
    /// Eight: AVX2.
    Eight,
    /// Sixteen: AVX-512.
    Sixteen,
}

impl Width {
    /// All of them.
    pub const ALL: [Width; 4] = [Width::One, Width::Four, Width::Eight, Width::Sixteen];

    /// Those that this machine has.
    pub fn available() -> impl Iterator<Item = Width> {
        Self::ALL.into_iter().filter(|width| width.is_available())
    }

    /// The widest that this machine has.
    pub fn widest() -> Self {
        Self::available().last().expect("one lane is always there")
    }

    /// How many lanes.
    pub fn lanes(self) -> usize {
        match self {
            Width::One => 1,
            Width::Four => 4,
            Width::Eight => 8,
            Width::Sixteen => 16,
        }
    }

    /// Whether this machine has it.
    pub fn is_available(self) -> bool {
        match self {
            Width::One | Width::Four => true,
            #[cfg(target_arch = "x86_64")]
            Width::Eight => pulp::x86::V3::try_new().is_some(),
            #[cfg(target_arch = "x86_64")]
            Width::Sixteen => pulp::x86::V4::try_new().is_some(),
            #[cfg(not(target_arch = "x86_64"))]
            Width::Eight | Width::Sixteen => false,
        }
    }

    /// Runs a job with so many lanes.
    ///
    /// # Panics
    /// This machine has not so many.
    pub fn run<J: WithSimd>(self, job: J) -> J::Output {
        match self {
            Width::One => Simd::vectorize(Scalar, job),
            Width::Four => four(job),
            #[cfg(target_arch = "x86_64")]
            Width::Eight => {
                let simd = pulp::x86::V3::try_new().expect("this machine has eight lanes");
                Simd::vectorize(simd, job)
            }
            #[cfg(target_arch = "x86_64")]
            Width::Sixteen => {
                let simd = pulp::x86::V4::try_new().expect("this machine has sixteen lanes");
                Simd::vectorize(simd, job)
            }
            #[cfg(not(target_arch = "x86_64"))]
            Width::Eight | Width::Sixteen => panic!("this machine has not so many lanes"),
        }
    }
}

#[cfg(target_arch = "aarch64")]
fn four<J: WithSimd>(job: J) -> J::Output {
    match pulp::aarch64::Neon::try_new() {
        Some(simd) => Simd::vectorize(simd, job),
        None => Simd::vectorize(Scalar128b, job),
    }
}

#[cfg(not(target_arch = "aarch64"))]
fn four<J: WithSimd>(job: J) -> J::Output {
    Simd::vectorize(Scalar128b, job)
}
