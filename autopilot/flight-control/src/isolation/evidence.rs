//! How well each hypothesis explains the estimate, from sums that are common to all of them.
//!
//! With B_i the column of effector i, m_i its position by the model of the healthy servos and z the estimate, the
//! hypotheses are linear in their parameters:
//!
//! ```text
//! stuck at θ            z = B_i (θ - m_i)
//! part k remains        z = B_i (k - 1) m_i
//! biased by b           z = B_i b
//! moves by itself       z = B_i s(t)
//! two stuck             z = B_i (θ_i - m_i) + B_j (θ_j - m_j)
//! a pair stuck together z = B_i (θ - m_i) + B_j (±θ - m_j), with both signs
//! air                   z = c ζ on each axis, ζ: z behind a lag
//! errors of sensors     either of these two, and a constant on each axis
//! anything              z = d(t)
//! ```
//!
//! The air is healthy flight in rough air: the compensating effector follows the estimate late, so z moves with
//! its position as it would if a part of its effect were gone. The air resembles what it was just before on every axis.
//!
//! Bayesian linear regression gives the evidence of each in closed form: with the misfit J that the best parameters
//! leave, the prior variance r² of each parameter and the curvature A of J,
//!
//! ```text
//! ln p = ln prior - J / 2 - ln det(1 + r A r) / 2
//! ```
//!
//! so a hypothesis with more parameters has to explain more. C. M. Bishop, Pattern Recognition and Machine Learning,
//! Springer 2006, section 3.5. The design model is not exact: to each hypothesis a small constant acceleration on each
//! axis is allowed, whose value is integrated out ([`Sums::forgiving`]).

use arrayvec::ArrayVec;
use icd::Effector;
use nalgebra::{Matrix2, Vector2, Vector3};
use serde::{Deserialize, Serialize};

/// How an effector behaves that is not healthy.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Behaviour {
    /// Stands at an angle, rad.
    Stuck,
    /// Has a part of its effect, 0 to 1.
    Reduced,
    /// Is off its command by an angle, rad.
    Biased,
    /// Moves by itself.
    Irregular,
}

impl Behaviour {
    /// All of them; the place is the code in logs, from 1.
    pub const ALL: [Self; 4] = [Self::Stuck, Self::Reduced, Self::Biased, Self::Irregular];

    /// Number in logs and telemetry, from 1.
    pub const fn code(self) -> u8 {
        self as u8 + 1
    }
}

/// An effector in the sums.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Column {
    /// Which.
    pub effector: Effector,
    /// Angular acceleration per rad, rad/s² per rad.
    pub effect: Vector3<f64>,
    /// Position by the model of the healthy servos, as late as the estimate, rad.
    pub position: f64,
    /// Ends of the travel, rad.
    pub travel: [f64; 2],
    /// The effector on the other side.
    pub partner: Option<Effector>,
}

/// One hypothesis with its best parameters.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Candidate {
    /// The effectors that are not healthy: none for noise, and for what no effector explains.
    pub effectors: [Option<Effector>; 2],
    /// How they behave; `None` without effectors.
    pub behaviour: Option<Behaviour>,
    /// The parameter of each: rad, or the part that remains.
    pub values: [f64; 2],
    /// ln of prior times evidence.
    pub log_evidence: f64,
}

impl Candidate {
    /// The estimate that this hypothesis has for the present positions, rad/s²; `None` where it may be anything.
    pub fn estimate(&self, columns: &[Column]) -> Option<Vector3<f64>> {
        let mut sum = Vector3::zeros();
        for (effector, value) in self.effectors.into_iter().zip(self.values) {
            let Some(effector) = effector else { continue };
            let column = columns.iter().find(|column| column.effector == effector)?;
            sum += column.effect
                * match self.behaviour? {
                    Behaviour::Stuck => value - column.position,
                    Behaviour::Reduced => (value - 1.0) * column.position,
                    Behaviour::Biased => value,
                    Behaviour::Irregular => return None,
                };
        }
        Some(sum)
    }
}

/// Hypotheses of one effector, of two, and of none.
const CANDIDATES_MAX: usize =
    Behaviour::ALL.len() * Effector::MAX + Effector::MAX * Effector::MAX / 2 + Effector::MAX + 5;

/// All hypotheses.
pub type Candidates = ArrayVec<Candidate, CANDIDATES_MAX>;

/// ln of the prior of each behaviour of one effector, in the order of [`Behaviour::ALL`].
const LOG_PRIOR: [f64; 4] = [0.0, -1.0, -2.0, -3.0];
/// ln of the prior of two that are stuck.
const LOG_PRIOR_TWO: f64 = -4.0;
/// The same for left and right one together, at the same angle or at opposite ones: one cause for both. Both signs, because
/// ailerons at opposite angles do to the estimate what elevators at opposite angles do, and are as probable.
const LOG_PRIOR_PAIR: f64 = -1.0;
/// The same for what no effector explains.
const LOG_PRIOR_ANYTHING: f64 = -4.0;
/// Prior mean and deviation of the part that is lost.
const LOSS: [f64; 2] = [0.5, 0.3];
/// Smallest loss that counts as one.
const LOSS_MIN: f64 = 0.05;
/// The same for the air.
const LOG_PRIOR_AIR: f64 = 0.0;
/// How much of the estimate of just before the air may leave: prior mean, which is also the deviation. It lies between
/// nothing and twice this; more of it is a fault that stays.
const AIR_PERSISTS: f64 = 0.2;
/// What no effector explains may be as large as this, in the deviations that it is compared with.
const ANYTHING: f64 = 30.0;
/// An angle may lie beyond the travel by this part of it: the model of its effect is not exact.
const BEYOND: f64 = 0.15;

/// Weighted sums over time, each with the same fading memory.
#[derive(Debug, Clone, Copy, Default)]
pub struct Sums {
    /// Σ zᵀ W z.
    zz: f64,
    /// Σ W of z z, ζ z, ζ ζ and ζ on each axis.
    air: [Vector3<f64>; 4],
    /// Σ W.
    w: Vector3<f64>,
    /// Σ W z.
    wz: Vector3<f64>,
    /// Σ W B_i times 1 and m_i.
    wb: [[Vector3<f64>; 2]; Effector::MAX],
    /// The same as `zz` and `air` with a constant by errors of the sensors integrated out, and the cost of that.
    offset: (f64, [Vector3<f64>; 4], f64),
    /// Σ of what an arbitrary disturbance costs.
    anything: f64,
    /// Σ B_iᵀ W z times 1 and m_i.
    bz: [[f64; 2]; Effector::MAX],
    /// Σ of misfit and cost of an effector that moves by itself.
    alone: [f64; Effector::MAX],
    /// Σ B_iᵀ W B_j times 1, m_j, m_i and m_i m_j, for i ≤ j.
    bb: [[[f64; 4]; Effector::MAX]; Effector::MAX],
}

impl Sums {
    /// Adds a sample of the estimate `z`, rad/s², of the same behind a lag and of its deviation on each axis, that
    /// counts as `share` of an independent one; all before it fade to the part `keep`.
    pub fn add(
        &mut self,
        columns: &[Column],
        z: &Vector3<f64>,
        lagged: &Vector3<f64>,
        deviation: &Vector3<f64>,
        share: f64,
        keep: f64,
    ) {
        let weight = deviation.map(|deviation| share / (deviation * deviation));
        let weighted = weight.component_mul(z);
        let zz = z.dot(&weighted);
        self.zz = keep * self.zz + zz;
        let lagged_weighted = weight.component_mul(lagged);
        let air = [
            weighted.component_mul(z),
            lagged_weighted.component_mul(z),
            lagged_weighted.component_mul(lagged),
            lagged_weighted,
        ];
        for (sum, now) in self.air.iter_mut().zip(air) {
            *sum = keep * *sum + now;
        }
        self.w = keep * self.w + weight;
        self.wz = keep * self.wz + weighted;
        // On each of three axes a sample has one free number.
        self.anything = keep * self.anything + 3.0 * share * libm::log(1.0 + ANYTHING * ANYTHING);
        for (i, column) in columns.iter().enumerate() {
            let bz = column.effect.dot(&weighted);
            let old = &mut self.bz[i];
            *old = [keep * old[0] + bz, keep * old[1] + bz * column.position];
            let effect = weight.component_mul(&column.effect);
            for (sum, times) in self.wb[i].iter_mut().zip([1.0, column.position]) {
                *sum = keep * *sum + times * effect;
            }
            for (j, other) in columns.iter().enumerate().skip(i) {
                let bb = effect.dot(&other.effect);
                let (m_i, m_j) = (column.position, other.position);
                let now = [bb, bb * m_j, bb * m_i, bb * m_i * m_j];
                for (sum, now) in self.bb[i][j].iter_mut().zip(now) {
                    *sum = keep * *sum + now;
                }
            }
            // The best s(t) of this sample with the prior of an angle inside the travel.
            let bb = effect.dot(&column.effect);
            let prior = 1.0 / square(spread(column));
            // Per sample of full weight: the share stands in front of both terms.
            let (bb_one, bz_one) = (bb / share, bz / share);
            let misfit = zz - share * bz_one * bz_one / (bb_one + prior);
            let cost = share * libm::log(1.0 + bb_one / prior);
            self.alone[i] = keep * self.alone[i] + misfit + cost;
        }
    }

    /// The sums with a constant acceleration of this deviation on each axis, rad/s², integrated out of `count` columns; those of
    /// healthy flight also with one of `offset`, rad/s².
    pub fn forgiving(&self, deviation: &Vector3<f64>, offset: &Vector3<f64>, count: usize) -> Self {
        let mut sums = *self;
        let part_of = |variance: &Vector3<f64>| {
            self.w.zip_map(variance, |w, variance| 1.0 / (w + 1.0 / variance))
        };
        let variance = deviation.component_mul(deviation);
        let more = variance + offset.component_mul(offset);
        let part = part_of(&variance);
        let of = |u: &Vector3<f64>, v: &Vector3<f64>| u.component_mul(v).dot(&part);
        (sums.zz, sums.air) = self.healthy(&part);
        let (zz, air) = self.healthy(&part_of(&more));
        let ratio =
            |axis: usize| (1.0 + self.w[axis] * more[axis]) / (1.0 + self.w[axis] * variance[axis]);
        sums.offset = (zz, air, 0.5 * libm::log(ratio(0) * ratio(1) * ratio(2)));
        for i in 0..count {
            let [b_i, bm_i] = &self.wb[i];
            sums.bz[i][0] -= of(b_i, &self.wz);
            sums.bz[i][1] -= of(bm_i, &self.wz);
            for j in i..count {
                let [b_j, bm_j] = &self.wb[j];
                let now = [of(b_i, b_j), of(b_i, bm_j), of(bm_i, b_j), of(bm_i, bm_j)];
                for (sum, now) in sums.bb[i][j].iter_mut().zip(now) {
                    *sum -= now;
                }
            }
        }
        sums
    }

    /// What healthy flight leaves unexplained, and the sums of the air, with a constant integrated out.
    fn healthy(&self, part: &Vector3<f64>) -> (f64, [Vector3<f64>; 4]) {
        let [zz, lz, ll, l] = &self.air;
        let less = |sum: &Vector3<f64>, u: &Vector3<f64>, v: &Vector3<f64>| {
            sum - u.component_mul(v).component_mul(part)
        };
        let wz = &self.wz;
        let air = [less(zz, wz, wz), less(lz, l, wz), less(ll, l, l), *l];
        (self.zz - wz.component_mul(wz).dot(part), air)
    }

    /// Every hypothesis with its evidence.
    pub fn candidates(&self, columns: &[Column]) -> Candidates {
        let mut all = Candidates::new();
        let none = |log_evidence| Candidate {
            effectors: [None; 2],
            behaviour: None,
            values: [0.0; 2],
            log_evidence,
        };
        // There is room for every hypothesis of sixteen effectors. One too many would be left out, without a panic.
        let mut add = |candidate| _ = all.try_push(candidate);
        add(none(-0.5 * self.zz));
        add(none(LOG_PRIOR_AIR + of_air(&self.air)));
        let (zz, air, cost) = &self.offset;
        add(none(-0.5 * zz - cost));
        add(none(LOG_PRIOR_AIR + of_air(air) - cost));
        add(none(LOG_PRIOR_ANYTHING - 0.5 * self.anything));
        for (i, column) in columns.iter().enumerate() {
            for (behaviour, log_prior) in Behaviour::ALL.into_iter().zip(LOG_PRIOR) {
                if let Some((value, log_evidence)) = self.single(i, column, behaviour) {
                    add(Candidate {
                        effectors: [Some(column.effector), None],
                        behaviour: Some(behaviour),
                        values: [value, 0.0],
                        log_evidence: log_prior + log_evidence,
                    });
                }
            }
            for (j, other) in columns.iter().enumerate().skip(i + 1) {
                let two = self.two(i, column, j, other);
                let [same, opposite] = [1.0, -1.0].map(|way| self.pair(i, column, j, other, way));
                let all =
                    [(LOG_PRIOR_TWO, two), (LOG_PRIOR_PAIR, same), (LOG_PRIOR_PAIR, opposite)];
                for (log_prior, (values, log_evidence)) in
                    all.into_iter().filter_map(|(prior, found)| Some((prior, found?)))
                {
                    add(Candidate {
                        effectors: [Some(column.effector), Some(other.effector)],
                        behaviour: Some(Behaviour::Stuck),
                        values,
                        log_evidence: log_prior + log_evidence,
                    });
                }
            }
        }
        all
    }

    /// Parameter and evidence of one effector; `None` where the parameter is impossible.
    fn single(&self, i: usize, column: &Column, behaviour: Behaviour) -> Option<(f64, f64)> {
        let [bb, bm, _, mm] = self.bb[i][i];
        let [bz, mz] = self.bz[i];
        let width = spread(column);
        match behaviour {
            Behaviour::Stuck => {
                // Of y = z + B m, of which an effector that is stuck leaves B θ.
                let yy = self.zz + 2.0 * mz + mm;
                let (angle, evidence) = regress(yy, bz + bm, bb, width);
                may_stand(angle, column).then_some((angle, evidence))
            }
            Behaviour::Reduced => {
                let [mean, deviation] = LOSS;
                // Of the deviation from the mean loss, which is what the prior is about.
                let yy = self.zz + 2.0 * mean * mz + mean * mean * mm;
                let (more, evidence) = regress(yy, -(mz + mean * mm), mm, deviation);
                let loss = mean + more;
                let range = LOSS_MIN..=1.0 + BEYOND;
                range.contains(&loss).then_some(((1.0 - loss).max(0.0), evidence))
            }
            Behaviour::Biased => {
                let (bias, evidence) = regress(self.zz, bz, bb, 0.5 * width);
                (bias.abs() <= width).then_some((bias, evidence))
            }
            Behaviour::Irregular => Some((0.0, -0.5 * self.alone[i])),
        }
    }

    fn both(&self, i: usize, j: usize) -> Both {
        let ([bb_i, bm_i, _, mm_i], [bb_j, bm_j, _, mm_j]) = (self.bb[i][i], self.bb[j][j]);
        // B_i B_j times 1, m_j, m_i, m_i m_j.
        let [bb, bm, mb, mm] = self.bb[i][j];
        let ([bz_i, mz_i], [bz_j, mz_j]) = (self.bz[i], self.bz[j]);
        Both {
            yy: self.zz + 2.0 * (mz_i + mz_j + mm) + mm_i + mm_j,
            by: [bz_i + bm_i + bm, bz_j + bm_j + mb],
            bb: [bb_i, bb, bb_j],
        }
    }

    /// Angles and evidence of a left and a right effector that are stuck at the same angle (`way` 1) or at opposite ones (-1).
    fn pair(
        &self,
        i: usize,
        column: &Column,
        j: usize,
        other: &Column,
        way: f64,
    ) -> Option<([f64; 2], f64)> {
        column.partner.filter(|partner| *partner == other.effector)?;
        let Both { yy, by: [by_i, by_j], bb: [bb_i, bb, bb_j] } = self.both(i, j);
        let (by, bb) = (by_i + way * by_j, bb_i + 2.0 * way * bb + bb_j);
        let (angle, evidence) = regress(yy, by, bb, spread(column));
        let values = [angle, way * angle];
        let is_possible = may_stand(values[0], column) && may_stand(values[1], other);
        is_possible.then_some((values, evidence))
    }

    /// Angles and evidence of two effectors that are stuck.
    fn two(&self, i: usize, column: &Column, j: usize, other: &Column) -> Option<([f64; 2], f64)> {
        let Both { yy, by: [by_i, by_j], bb: [bb_i, bb, bb_j] } = self.both(i, j);
        let r = [spread(column), spread(other)];
        // In units of the prior deviations.
        let b = Vector2::new(r[0] * by_i, r[1] * by_j);
        let shared = r[0] * r[1] * bb;
        let curvature = Matrix2::new(r[0] * r[0] * bb_i, shared, shared, r[1] * r[1] * bb_j);
        let a = Matrix2::identity() + curvature;
        let determinant = a.determinant();
        let inverse = a.try_inverse()?;
        let best = inverse * b;
        let values = [r[0] * best.x, r[1] * best.y];
        let evidence = -0.5 * (yy - b.dot(&best)) - 0.5 * libm::log(determinant);
        let is_possible = may_stand(values[0], column) && may_stand(values[1], other);
        is_possible.then_some((values, evidence))
    }
}

/// Evidence of air that resembles what it was just before.
fn of_air([zz, lz, ll, _]: &[Vector3<f64>; 4]) -> f64 {
    let prior = 1.0 / square(AIR_PERSISTS);
    let of_axis = |axis: usize| {
        let best = (lz[axis] + prior * AIR_PERSISTS) / (ll[axis] + prior);
        let part = best.clamp(0.0, 2.0 * AIR_PERSISTS);
        let misfit = zz[axis] - 2.0 * part * lz[axis] + part * part * ll[axis];
        let from_prior = prior * square(part - AIR_PERSISTS);
        -0.5 * (misfit + from_prior) - 0.5 * libm::log(1.0 + ll[axis] / prior)
    };
    of_axis(0) + of_axis(1) + of_axis(2)
}

/// Sums of two effectors with y = z + B_i m_i + B_j m_j.
struct Both {
    /// Σ yᵀ W y.
    yy: f64,
    /// Σ B_iᵀ W y, Σ B_jᵀ W y.
    by: [f64; 2],
    /// Σ B_iᵀ W B_i, Σ B_iᵀ W B_j, Σ B_jᵀ W B_j.
    bb: [f64; 3],
}

/// Bayesian regression of y on one column: Σ yy, Σ xy, Σ xx, and the prior deviation of the parameter. Returns the
/// parameter and the evidence.
fn regress(yy: f64, xy: f64, xx: f64, deviation: f64) -> (f64, f64) {
    let prior = 1.0 / square(deviation);
    let best = xy / (xx + prior);
    (best, -0.5 * (yy - xy * best) - 0.5 * libm::log(1.0 + xx / prior))
}

/// Prior deviation of an angle: half the travel.
fn spread(column: &Column) -> f64 {
    let [min, max] = column.travel;
    (0.5 * (max - min)).max(1.0e-3)
}

fn may_stand(angle: f64, column: &Column) -> bool {
    let [min, max] = column.travel;
    let beyond = BEYOND * (max - min);
    (min - beyond..=max + beyond).contains(&angle)
}

fn square(value: f64) -> f64 {
    value * value
}
