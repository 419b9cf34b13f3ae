//! Numbers with their derivatives by a few unknowns (forward automatic differentiation).
//!
//! A corner of a thing depends on a handful of the unknowns of an adjustment, so the derivatives
//! are a short list. They are exact to rounding: no step width has to be chosen.

use std::ops::{Add, Mul, Neg, Sub};

use glam::DVec3;

/// A value and its derivatives.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Jet {
    /// The number itself.
    pub value: f64,
    /// Unknown and derivative by it, in ascending order of the unknowns. Others are zero.
    pub slopes: Vec<(usize, f64)>,
}

/// A position, by its coordinates.
pub type Jet3 = [Jet; 3];

impl Jet {
    /// A number that depends on nothing.
    pub fn constant(value: f64) -> Self {
        Self { value, slopes: Vec::new() }
    }

    /// The unknown of that index itself.
    pub fn unknown(value: f64, index: usize) -> Self {
        Self { value, slopes: vec![(index, 1.0)] }
    }

    /// Sine and cosine of an angle in radians.
    pub fn sin_cos(&self) -> (Self, Self) {
        let (sin, cos) = self.value.sin_cos();
        (self.chain(sin, cos), self.chain(cos, -sin))
    }

    /// The square root of a positive number.
    pub fn sqrt(&self) -> Self {
        let root = self.value.sqrt();
        self.chain(root, 0.5 / root)
    }

    /// 1 / x for x that is not zero.
    pub fn recip(&self) -> Self {
        let inverse = 1.0 / self.value;
        self.chain(inverse, -inverse * inverse)
    }

    /// f(x) from its value and derivative at x.
    fn chain(&self, value: f64, slope: f64) -> Self {
        let slopes = self.slopes.iter().map(|&(index, own)| (index, slope * own)).collect();
        Self { value, slopes }
    }

    /// a · self + b · other, with `value` as its value.
    fn combined(&self, a: f64, other: &Self, b: f64, value: f64) -> Self {
        let mut slopes = Vec::with_capacity(self.slopes.len() + other.slopes.len());
        let (mut own, mut others) = (self.slopes.as_slice(), other.slopes.as_slice());
        loop {
            match (own, others) {
                ([(i, x), rest @ ..], [(j, y), tail @ ..]) if i == j => {
                    slopes.push((*i, a * x + b * y));
                    (own, others) = (rest, tail);
                }
                ([(i, x), rest @ ..], [(j, _), ..]) if i < j => {
                    slopes.push((*i, a * x));
                    own = rest;
                }
                (_, [(j, y), tail @ ..]) => {
                    slopes.push((*j, b * y));
                    others = tail;
                }
                ([(i, x), rest @ ..], []) => {
                    slopes.push((*i, a * x));
                    own = rest;
                }
                ([], []) => return Self { value, slopes },
            }
        }
    }
}

impl Add for &Jet {
    type Output = Jet;

    fn add(self, other: &Jet) -> Jet {
        self.combined(1.0, other, 1.0, self.value + other.value)
    }
}

impl Sub for &Jet {
    type Output = Jet;

    fn sub(self, other: &Jet) -> Jet {
        self.combined(1.0, other, -1.0, self.value - other.value)
    }
}

impl Mul for &Jet {
    type Output = Jet;

    fn mul(self, other: &Jet) -> Jet {
        self.combined(other.value, other, self.value, self.value * other.value)
    }
}

impl Mul<f64> for &Jet {
    type Output = Jet;

    fn mul(self, factor: f64) -> Jet {
        self.chain(self.value * factor, factor)
    }
}

impl Neg for &Jet {
    type Output = Jet;

    fn neg(self) -> Jet {
        self.chain(-self.value, -1.0)
    }
}

/// The position alone.
pub fn position([x, y, z]: &Jet3) -> DVec3 {
    DVec3::new(x.value, y.value, z.value)
}

/// The derivative of a position by each unknown that it depends on, in ascending order.
pub fn slopes(point: &Jet3) -> Vec<(usize, DVec3)> {
    let mut all: Vec<(usize, DVec3)> = Vec::new();
    for (axis, jet) in point.iter().enumerate() {
        for &(index, slope) in &jet.slopes {
            match all.iter_mut().find(|(own, _)| *own == index) {
                Some((_, vector)) => vector[axis] = slope,
                None => {
                    let mut vector = DVec3::ZERO;
                    vector[axis] = slope;
                    all.push((index, vector));
                }
            }
        }
    }
    all.sort_unstable_by_key(|(index, _)| *index);
    all
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn derivatives_are_those_of_the_formula() {
        // f = a sin(b) − sqrt(a) / b; by hand: f_a = sin b − 1 / (2 sqrt(a) b), and
        // f_b = a cos b + sqrt(a) / b².
        let (a, b) = (2.3_f64, 0.7_f64);
        let (ja, jb) = (Jet::unknown(a, 4), Jet::unknown(b, 1));
        let f = &(&ja * &jb.sin_cos().0) - &(&ja.sqrt() * &jb.recip());
        assert!((f.value - (a * b.sin() - a.sqrt() / b)).abs() < 1e-15);
        let by_b = a * b.cos() + a.sqrt() / (b * b);
        let by_a = b.sin() - 0.5 / (a.sqrt() * b);
        assert_eq!(f.slopes.iter().map(|slope| slope.0).collect::<Vec<_>>(), [1, 4]);
        assert!((f.slopes[0].1 - by_b).abs() < 1e-14 && (f.slopes[1].1 - by_a).abs() < 1e-14);
    }
}
