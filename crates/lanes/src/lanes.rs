//! The vector and its mask.

use std::ops::{Add, AddAssign, BitAnd, BitOr, Div, Mul, Neg, Not, Sub, SubAssign};

use pulp::{Scalar, Simd};

/// A number in every lane. A line of the cache to itself: a vector that lies across two costs half as
/// much again, and memory comes aligned to 16 bytes only.
#[derive(Clone, Copy, Debug)]
#[repr(C, align(64))]
pub struct Lanes<S: Simd>(S, S::f32s);

/// Yes or no in every lane.
#[derive(Clone, Copy, Debug)]
pub struct Mask<S: Simd>(S, S::m32s);

impl<S: Simd> Lanes<S> {
    /// How many lanes there are.
    pub const WIDTH: usize = S::F32_LANES;

    /// The same in every lane.
    #[inline(always)]
    pub fn splat(simd: S, value: f32) -> Self {
        Self(simd, simd.splat_f32s(value))
    }

    /// 0 in every lane.
    #[inline(always)]
    pub fn zero(simd: S) -> Self {
        Self::splat(simd, 0.0)
    }

    /// From a number for each lane; 0 where there are not enough.
    #[inline(always)]
    pub fn load(simd: S, values: &[f32]) -> Self {
        let many = values.len().min(Self::WIDTH);
        Self(simd, simd.partial_load_f32s(&values[..many]))
    }

    /// From a function of the lane.
    pub fn from_fn(simd: S, value: impl FnMut(usize) -> f32) -> Self {
        let values: Vec<f32> = (0..Self::WIDTH).map(value).collect();
        Self::load(simd, &values)
    }

    /// Writes the first lanes.
    #[inline(always)]
    pub fn store(self, into: &mut [f32]) {
        let many = into.len().min(Self::WIDTH);
        self.0.partial_store_f32s(&mut into[..many], self.1);
    }

    /// One lane's number.
    ///
    /// # Panics
    /// There is no such lane.
    pub fn lane(self, lane: usize) -> f32 {
        let mut values = [0.0; 16];
        self.store(&mut values[..Self::WIDTH]);
        values[..Self::WIDTH][lane]
    }

    /// Another vector with the same instructions.
    #[inline(always)]
    pub fn like(self, value: f32) -> Self {
        Self::splat(self.0, value)
    }

    /// Another vector with the same instructions, from a number for each lane.
    #[inline(always)]
    pub fn load_like(self, values: &[f32]) -> Self {
        Self::load(self.0, values)
    }

    /// Square root.
    #[inline(always)]
    pub fn sqrt(self) -> Self {
        Self(self.0, self.0.sqrt_f32s(self.1))
    }

    /// Without its sign.
    #[inline(always)]
    pub fn abs(self) -> Self {
        Self(self.0, self.0.abs_f32s(self.1))
    }

    /// The lesser one; the other if either is not a number.
    #[inline(always)]
    pub fn min(self, other: Self) -> Self {
        self.less(other).choose(self, other)
    }

    /// The greater one; the other if either is not a number.
    #[inline(always)]
    pub fn max(self, other: Self) -> Self {
        self.greater(other).choose(self, other)
    }

    /// Held within bounds.
    #[inline(always)]
    pub fn clamp(self, low: Self, high: Self) -> Self {
        self.max(low).min(high)
    }

    /// Where it is less; nowhere if either is not a number.
    #[inline(always)]
    pub fn less(self, other: Self) -> Mask<S> {
        Mask(self.0, self.0.less_than_f32s(self.1, other.1))
    }

    /// Where it is a finite number.
    #[inline(always)]
    pub fn finite(self) -> Mask<S> {
        self.abs().less(self.like(f32::INFINITY))
    }

    /// Where it is greater; nowhere if either is not a number.
    #[inline(always)]
    pub fn greater(self, other: Self) -> Mask<S> {
        other.less(self)
    }
}

impl Lanes<Scalar> {
    /// The only lane's number.
    #[inline(always)]
    pub fn value(self) -> f32 {
        self.1
    }
}

impl From<f32> for Lanes<Scalar> {
    #[inline(always)]
    fn from(value: f32) -> Self {
        Self(Scalar, value)
    }
}

impl From<bool> for Mask<Scalar> {
    #[inline(always)]
    fn from(yes: bool) -> Self {
        Self(Scalar, yes)
    }
}

impl<S: Simd> Mask<S> {
    /// `yes` where it is so, `no` elsewhere.
    #[inline(always)]
    pub fn choose(self, yes: Lanes<S>, no: Lanes<S>) -> Lanes<S> {
        Lanes(self.0, self.0.select_f32s(self.1, yes.1, no.1))
    }

    /// `yes` where it is so, 0 elsewhere.
    #[inline(always)]
    pub fn keep(self, yes: Lanes<S>) -> Lanes<S> {
        self.choose(yes, yes.like(0.0))
    }

    /// 1 where it is so, 0 elsewhere.
    #[inline(always)]
    pub fn one(self) -> Lanes<S> {
        self.keep(Lanes::splat(self.0, 1.0))
    }

    /// Whether it is so in any lane.
    #[inline(always)]
    pub fn any(self) -> bool {
        self.0.first_true_m32s(self.1) < Lanes::<S>::WIDTH
    }

    /// Nowhere.
    #[inline(always)]
    pub fn never(simd: S) -> Self {
        let zero = Lanes::zero(simd);
        zero.less(zero)
    }

    /// Whether it is so in a lane.
    pub fn lane(self, lane: usize) -> bool {
        self.one().lane(lane) != 0.0
    }
}

macro_rules! operator {
    ($trait:ident, $method:ident, $intrinsic:ident) => {
        impl<S: Simd> $trait for Lanes<S> {
            type Output = Self;
            #[inline(always)]
            fn $method(self, other: Self) -> Self {
                Self(self.0, self.0.$intrinsic(self.1, other.1))
            }
        }

        impl<S: Simd> $trait<f32> for Lanes<S> {
            type Output = Self;
            #[inline(always)]
            fn $method(self, other: f32) -> Self {
                self.$method(self.like(other))
            }
        }
    };
}

operator!(Add, add, add_f32s);
operator!(Sub, sub, sub_f32s);
operator!(Mul, mul, mul_f32s);
operator!(Div, div, div_f32s);

impl<S: Simd> AddAssign for Lanes<S> {
    #[inline(always)]
    fn add_assign(&mut self, other: Self) {
        *self = *self + other;
    }
}

impl<S: Simd> SubAssign for Lanes<S> {
    #[inline(always)]
    fn sub_assign(&mut self, other: Self) {
        *self = *self - other;
    }
}

impl<S: Simd> Neg for Lanes<S> {
    type Output = Self;
    #[inline(always)]
    fn neg(self) -> Self {
        Self(self.0, self.0.neg_f32s(self.1))
    }
}

impl<S: Simd> BitAnd for Mask<S> {
    type Output = Self;
    #[inline(always)]
    fn bitand(self, other: Self) -> Self {
        Self(self.0, self.0.and_m32s(self.1, other.1))
    }
}

impl<S: Simd> BitOr for Mask<S> {
    type Output = Self;
    #[inline(always)]
    fn bitor(self, other: Self) -> Self {
        Self(self.0, self.0.or_m32s(self.1, other.1))
    }
}

impl<S: Simd> Not for Mask<S> {
    type Output = Self;
    #[inline(always)]
    fn not(self) -> Self {
        Self(self.0, self.0.not_m32s(self.1))
    }
}
