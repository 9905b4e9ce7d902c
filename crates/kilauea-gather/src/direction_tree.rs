//! A distribution over directions: a quadtree over the octahedral square, finer where more light
//! comes from (Müller, Gross & Novák 2017, "Practical Path Guiding for Efficient Light-Transport
//! Simulation", section 3.2).

use kilauea_math::octahedral::{
    direction_from_square, solid_angle_per_area, square_from_direction,
};
use kilauea_math::{Vec2, Vec3};
use serde::{Deserialize, Serialize};

use crate::record::Arrival;

/// A positive density over all directions, constant per area within the leaves of a quadtree.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct DirectionTree {
    quads: Box<[Quad]>,
}

/// An inner node: how likely each of its quarters is.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
struct Quad {
    /// Probability of the left half.
    left: f32,
    /// Probability of the lower quarter within the left and the right half.
    lower: [f32; 2],
    /// The node of each quarter (lower left, lower right, upper left, upper right); [`LEAF`] where
    /// there is none.
    children: [u16; 4],
}

/// No quarter links to the root.
const LEAF: u16 = 0;
/// Quarters with more than this fraction of all light are divided further (ibid., ρ).
const MAX_LEAF_SHARE: f32 = 0.01;
/// Quarters with fewer records are not.
const MIN_RECORDS: usize = 8;
const MAX_DEPTH: u32 = 8;
/// Records' worth of belief that all quarters of a node are alike: what the few records of a
/// node say is not the whole truth.
const PRIOR_RECORDS: f32 = 2.0;

/// An arrival on the square.
#[derive(Clone, Copy)]
struct Placed {
    /// Of the current node once within the tree.
    at: Vec2,
    irradiance: f32,
    /// Estimates the integral of the squared integrand: `(L cos θ / pdf)² pdf`.
    second_moment: f32,
}

impl DirectionTree {
    /// Fits a distribution to what arrived at one place; none where no light did.
    ///
    /// The density is in proportion to the root of the integrand's second moment, which counts the
    /// noise of what lies behind a direction as well (Rath et al. 2020, "Variance-Aware Path
    /// Guiding").
    pub fn fit<'r>(arrivals: impl IntoIterator<Item = &'r Arrival>) -> Option<Self> {
        let mut arrivals: Vec<Placed> = arrivals
            .into_iter()
            .filter(|arrival| arrival.is_sound() && arrival.irradiance > 0.0)
            .map(|arrival| Placed {
                at: square_from_direction(arrival.wi),
                irradiance: arrival.irradiance,
                second_moment: arrival.irradiance * arrival.irradiance * arrival.pdf,
            })
            .collect();
        let total: f32 = arrivals.iter().map(|a| a.irradiance).sum();
        if !(total > 0.0 && total.is_finite()) {
            return None;
        }
        let mut fit = Fit {
            quads: Vec::new(),
            max_leaf: MAX_LEAF_SHARE * total,
        };
        fit.divide(&mut arrivals, Square::UNIT, 0);
        Some(Self {
            quads: fit.quads.into(),
        })
    }

    /// Draws a direction; `u` is uniform in [0, 1)².
    #[inline]
    pub fn sample(&self, mut u: Vec2) -> Vec3 {
        let mut square = Square::UNIT;
        let mut idx = 0;
        loop {
            let quad = &self.quads[idx];
            let x = split(&mut u.x, quad.left);
            let y = split(&mut u.y, quad.lower[x]);
            square = square.quarter(x, y);
            idx = quad.children[2 * y + x] as usize;
            if idx == LEAF as usize {
                return direction_from_square(square.min + u * square.side);
            }
        }
    }

    /// Density per solid angle with which [`Self::sample`] finds a unit direction.
    #[inline]
    pub fn pdf(&self, wi: Vec3) -> f32 {
        let mut at = square_from_direction(wi);
        let mut per_area = 1.0;
        let mut idx = 0;
        loop {
            let quad = &self.quads[idx];
            let x = usize::from(at.x >= 0.5);
            let y = usize::from(at.y >= 0.5);
            let lower = quad.lower[x];
            let column = if x == 0 { quad.left } else { 1.0 - quad.left };
            let row = if y == 0 { lower } else { 1.0 - lower };
            per_area *= 4.0 * column * row;
            idx = quad.children[2 * y + x] as usize;
            if idx == LEAF as usize {
                return per_area / solid_angle_per_area(wi);
            }
            at = 2.0 * at - Vec2::new(x as f32, y as f32);
        }
    }

    /// Visits squares within which the density per area is the same, each with its probability.
    pub(crate) fn for_each_leaf(&self, visit: &mut impl FnMut(Square, f32)) {
        self.for_each_leaf_below(0, (Square::UNIT, 1.0), visit);
    }

    fn for_each_leaf_below(
        &self,
        idx: usize,
        (square, probability): (Square, f32),
        visit: &mut impl FnMut(Square, f32),
    ) {
        let quad = &self.quads[idx];
        let columns = [quad.left, 1.0 - quad.left];
        for (quarter, square) in square.quarters().into_iter().enumerate() {
            let (x, y) = (quarter % 2, quarter / 2);
            let row = [quad.lower[x], 1.0 - quad.lower[x]][y];
            let probability = probability * columns[x] * row;
            match quad.children[quarter] {
                LEAF => visit(square, probability),
                child => self.for_each_leaf_below(child as usize, (square, probability), visit),
            }
        }
    }

    /// Bytes held.
    pub fn n_bytes(&self) -> usize {
        size_of_val(&*self.quads)
    }
}

/// Chooses the first of two with a probability, and stretches `u` over the choice.
#[inline]
pub(crate) fn split(u: &mut f32, first: f32) -> usize {
    let second = usize::from(*u >= first);
    *u = if second == 0 {
        *u / first
    } else {
        (*u - first) / (1.0 - first)
    };
    *u = u.min(1.0 - 0.5 * f32::EPSILON);
    second
}

/// Part of the unit square.
#[derive(Clone, Copy)]
pub(crate) struct Square {
    min: Vec2,
    pub(crate) side: f32,
}

impl Square {
    const UNIT: Self = Self {
        min: Vec2::ZERO,
        side: 1.0,
    };

    #[inline]
    fn quarter(self, x: usize, y: usize) -> Self {
        let side = 0.5 * self.side;
        Self {
            min: self.min + side * Vec2::new(x as f32, y as f32),
            side,
        }
    }

    /// Lower left, lower right, upper left, upper right.
    pub(crate) fn quarters(self) -> [Self; 4] {
        std::array::from_fn(|quarter| self.quarter(quarter % 2, quarter / 2))
    }

    /// The direction in its middle.
    pub(crate) fn direction(self) -> Vec3 {
        direction_from_square(self.min + 0.5 * self.side)
    }

    pub(crate) fn solid_angle(self) -> f32 {
        solid_angle_per_area(self.direction()) * self.side * self.side
    }
}

/// A tree in the making.
struct Fit {
    quads: Vec<Quad>,
    /// Irradiance above which a quarter is divided.
    max_leaf: f32,
}

impl Fit {
    /// Makes the node of a square, and returns what it weighs.
    fn divide(&mut self, arrivals: &mut [Placed], square: Square, depth: u32) -> f32 {
        let idx = self.quads.len();
        self.quads.push(Quad {
            left: 0.5,
            lower: [0.5; 2],
            children: [LEAF; 4],
        });
        let confidence = effective_number(arrivals);
        let mut weights = [0.0; 4];
        let mut rest = arrivals;
        for (quarter, weight) in weights.iter_mut().enumerate() {
            let (x, y) = (quarter % 2, quarter / 2);
            let n = partition(rest, |a| {
                usize::from(a.at.x >= 0.5) == x && usize::from(a.at.y >= 0.5) == y
            });
            let (inside, others) = rest.split_at_mut(n);
            rest = others;
            let square = square.quarter(x, y);
            let irradiance: f32 = inside.iter().map(|a| a.irradiance).sum();
            let is_divided =
                irradiance > self.max_leaf && inside.len() >= MIN_RECORDS && depth + 1 < MAX_DEPTH;
            *weight = if is_divided {
                for arrival in inside.iter_mut() {
                    arrival.at = 2.0 * arrival.at - Vec2::new(x as f32, y as f32);
                }
                self.quads[idx].children[quarter] = self.quads.len() as u16;
                self.divide(inside, square, depth + 1)
            } else {
                let second_moment: f32 = inside.iter().map(|a| a.second_moment).sum();
                (second_moment * square.solid_angle()).sqrt()
            };
        }
        let total: f32 = weights.iter().sum();
        let quad = &mut self.quads[idx];
        (quad.left, quad.lower) = halves(weights, total, confidence);
        total
    }
}

/// Conditional probabilities of halves, drawn toward even ones where few records speak.
fn halves(weights: [f32; 4], total: f32, confidence: f32) -> (f32, [f32; 2]) {
    let shrunk = weights.map(|weight| {
        let share = if total > 0.0 { weight / total } else { 0.25 };
        (confidence * share + 0.25 * PRIOR_RECORDS) / (confidence + PRIOR_RECORDS)
    });
    let [left, right] = [shrunk[0] + shrunk[2], shrunk[1] + shrunk[3]];
    (left / (left + right), [shrunk[0] / left, shrunk[1] / right])
}

/// How many equal records would say as much (Kish 1965).
fn effective_number(arrivals: &[Placed]) -> f32 {
    let sum: f32 = arrivals.iter().map(|a| a.irradiance).sum();
    let sum_sq: f32 = arrivals.iter().map(|a| a.irradiance * a.irradiance).sum();
    if sum_sq > 0.0 && sum_sq.is_finite() {
        sum * sum / sum_sq
    } else {
        0.0
    }
}

/// Moves those for which `is_first` to the front; returns how many there are.
fn partition(arrivals: &mut [Placed], is_first: impl Fn(&Placed) -> bool) -> usize {
    let mut n = 0;
    for i in 0..arrivals.len() {
        if is_first(&arrivals[i]) {
            arrivals.swap(n, i);
            n += 1;
        }
    }
    n
}
