//! The covariance of the error state: prediction, scalar updates, and what keeps it positive.

use nalgebra::{Matrix3, Vector3};

/// Number of error states.
pub const STATES: usize = 29;
/// Attitude error, rad, start axes: the true rotation is the estimated one turned by it.
pub const ATTITUDE: usize = 0;
/// Velocity over the ground, m/s, start axes.
pub const VELOCITY: usize = 3;
/// Position, m, start axes.
pub const POSITION: usize = 6;
/// Bias of the gyros, rad/s, body axes.
pub const GYRO_BIAS: usize = 9;
/// Bias of the accelerometers, m/s², body axes.
pub const FORCE_BIAS: usize = 12;
/// Wind with its gusts, m/s, NED.
pub const WIND: usize = 15;
/// Bias of the magnetometer, nT, body axes.
pub const MAGNETIC_BIAS: usize = 18;
/// Offset of the pressure altitude, m.
pub const BAROMETER: usize = 21;
/// Horizontal wind without gusts, m/s, north and east.
pub const STEADY_WIND: usize = 22;
/// Biases of the vanes of angle of attack and sideslip, rad.
pub const VANES: usize = 24;
/// From here on errors that last are only considered: they count in every variance, and nothing corrects them (S. Schmidt,
/// Application of state-space methods to navigation problems, 1966). Without a pitot tube the vanes are among them.
pub const CONSIDERED: usize = 26;
/// Bias of the impact pressure, Pa.
pub const PITOT_BIAS: usize = 26;
/// Error of its scale.
pub const PITOT_SCALE: usize = 27;
/// Error of the lift of the aircraft model, as a part of it.
pub const LIFT: usize = 28;

/// One number of each error state.
pub type States = [f64; STATES];

/// A steeper flow than this shows less of the horizontal wind: square of its level part.
const LEVEL_MIN: f64 = 0.1;
/// Smallest variance of a state as a part of its first one: below it rounding would decide the sign.
const FLOOR: f64 = 1.0e-12;

/// Where three vectors of a sum of states begin, and their factors.
pub type Vectors = [(usize, Vector3<f64>); 3];

/// How the error state changes over a time: identity plus these blocks.
#[derive(Debug, Clone, Copy)]
pub struct Transition {
    /// Time, s.
    pub seconds: f64,
    /// ∫ C dt, s: C turns body axes into start axes.
    pub turned: Matrix3<f64>,
    /// ∫ C f dt, m/s.
    pub force: Vector3<f64>,
    /// Factor of the gusts.
    pub gust: f64,
    /// Factor of the errors that last.
    pub lasting: f64,
}

impl Transition {
    /// Nothing has happened yet.
    pub const NONE: Self = Self {
        seconds: 0.0,
        turned: Matrix3::new(0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0),
        force: Vector3::new(0.0, 0.0, 0.0),
        gust: 1.0,
        lasting: 1.0,
    };

    /// Multiplies a vector of error states.
    #[inline]
    fn apply(&self, x: &mut States) {
        let (m, s, t) = (&self.turned, &self.force, self.seconds);
        let at = |x: &States, from: usize| Vector3::new(x[from], x[from + 1], x[from + 2]);
        let (attitude, velocity) = (at(x, ATTITUDE), at(x, VELOCITY));
        // δv loses S × θ and A b_a, θ loses A b_g, and δp gains δv T.
        let slowed = s.cross(&attitude) + m * at(x, FORCE_BIAS);
        let turned = m * at(x, GYRO_BIAS);
        for axis in 0..3 {
            x[POSITION + axis] += t * velocity[axis];
            x[VELOCITY + axis] -= slowed[axis];
            x[ATTITUDE + axis] -= turned[axis];
        }
        for axis in 0..2 {
            let steady = x[STEADY_WIND + axis];
            x[WIND + axis] = steady + self.gust * (x[WIND + axis] - steady);
        }
        x[WIND + 2] *= self.gust;
        for error in &mut x[CONSIDERED..] {
            *error *= self.lasting;
        }
    }
}

/// One row of a measurement matrix: the states that it has and their factors.
#[derive(Debug, Clone, Copy)]
pub struct Row {
    parts: [(usize, f64); Self::MOST],
    count: usize,
}

impl Row {
    /// Most states of a measurement: attitude, velocity, wind and a bias.
    const MOST: usize = 12;

    /// Without any state.
    pub const fn empty() -> Self {
        Self { parts: [(0, 0.0); Self::MOST], count: 0 }
    }

    /// The same with this factor of a state.
    #[must_use]
    pub fn with(mut self, state: usize, factor: f64) -> Self {
        self.parts[self.count] = (state, factor);
        self.count += 1;
        self
    }

    /// The same with these factors of three states.
    #[must_use]
    pub fn with_vector(self, from: usize, factors: &Vector3<f64>) -> Self {
        self.with(from, factors.x).with(from + 1, factors.y).with(from + 2, factors.z)
    }

    fn parts(&self) -> &[(usize, f64)] {
        &self.parts[..self.count]
    }
}

/// A measurement that was compared with the estimate.
#[derive(Debug, Clone, Copy)]
pub struct Comparison {
    /// P hᵀ.
    product: States,
    /// h P hᵀ + r: variance of the innovation.
    pub variance: f64,
    /// Measured minus expected.
    pub innovation: f64,
}

impl Comparison {
    /// Innovation over its standard deviation.
    pub fn deviations(&self) -> f64 {
        libm::fabs(self.innovation) / libm::sqrt(self.variance)
    }

    /// Optimal gain of a state.
    fn gain(&self, state: usize) -> f64 {
        self.product[state] / self.variance
    }

    /// The part of the optimal gain that corrects the wind along the flow.
    fn wind_along(&self, flow: &Vector3<f64>) -> States {
        let mut along = [0.0; STATES];
        let wind: f64 = (0..3).map(|axis| flow[axis] * self.gain(WIND + axis)).sum();
        for axis in 0..3 {
            along[WIND + axis] = flow[axis] * wind;
        }
        let level = flow.x * flow.x + flow.y * flow.y;
        let steady: f64 = (0..2).map(|axis| flow[axis] * self.gain(STEADY_WIND + axis)).sum();
        for axis in 0..2 {
            along[STEADY_WIND + axis] = flow[axis] * steady / level.max(LEVEL_MIN);
        }
        along
    }
}

/// Covariance of the error state.
#[derive(Debug, Clone)]
pub struct Covariance {
    /// Symmetric.
    p: [States; STATES],
    floor: States,
    /// The states before this one are estimated.
    estimated: usize,
}

impl Covariance {
    /// Independent states with these standard deviations.
    pub fn new(spreads: &States) -> Self {
        let mut p = [[0.0; STATES]; STATES];
        let mut floor = [0.0; STATES];
        for (index, spread) in spreads.iter().enumerate() {
            p[index][index] = spread * spread;
            floor[index] = FLOOR * spread * spread;
        }
        Self { p, floor, estimated: CONSIDERED }
    }

    /// From the next measurement on the biases of the vanes are only considered, or estimated.
    pub fn consider_vanes(&mut self, only: bool) {
        self.estimated = if only { VANES } else { CONSIDERED };
    }

    /// Variance of a state.
    pub fn variance(&self, state: usize) -> f64 {
        self.p[state][state]
    }

    /// Standard deviations of all states.
    pub fn spreads(&self) -> States {
        core::array::from_fn(|index| libm::sqrt(self.variance(index)))
    }

    /// Sum of three variances.
    pub fn sum_of_three(&self, from: usize) -> f64 {
        (from..from + 3).map(|state| self.variance(state)).sum()
    }

    /// Covariance of three states.
    pub fn block(&self, from: usize) -> Matrix3<f64> {
        Matrix3::from_fn(|row, column| self.p[from + row][from + column])
    }

    /// P becomes Φ P Φᵀ + Q.
    pub fn predict(&mut self, transition: &Transition, noise: &States) {
        // Φ P column by column, of which the compiler does several at once, and then times Φᵀ along the rows.
        for column in 0..STATES {
            let mut x = core::array::from_fn(|state| self.p[state][column]);
            transition.apply(&mut x);
            for (row, x) in self.p.iter_mut().zip(x) {
                row[column] = x;
            }
        }
        for row in &mut self.p {
            transition.apply(row);
        }
        for (state, noise) in noise.iter().enumerate() {
            self.p[state][state] += noise;
        }
        self.keep_symmetric();
    }

    fn keep_symmetric(&mut self) {
        // Rounding lets the halves drift apart; the upper one counts.
        for row in 0..STATES {
            for column in 0..row {
                self.p[row][column] = self.p[column][row];
            }
            self.p[row][row] = self.p[row][row].max(self.floor[row]);
        }
    }

    /// Compares a measurement with variance `noise` with the estimate.
    #[inline]
    pub fn compare(&self, row: &Row, innovation: f64, noise: f64) -> Comparison {
        let mut product = [0.0; STATES];
        for (state, factor) in row.parts() {
            for (sum, covariance) in product.iter_mut().zip(&self.p[*state]) {
                *sum += factor * covariance;
            }
        }
        let part: f64 = row.parts().iter().map(|(state, factor)| factor * product[*state]).sum();
        // Of nearly equal terms with both signs, which may end a little below zero.
        Comparison { product, variance: part.max(0.0) + noise, innovation }
    }

    /// Variance of a sum of states: that of [`Self::compare`] to the bit, without what only a correction needs.
    #[inline]
    pub fn variance_of_vectors(&self, vectors: &Vectors) -> f64 {
        let product = |state: usize| {
            vectors.iter().fold(0.0, |sum, (from, by)| {
                (0..3).fold(sum, |sum, axis| sum + by[axis] * self.p[from + axis][state])
            })
        };
        let variance = vectors.iter().fold(0.0, |sum, (from, by)| {
            (0..3).fold(sum, |sum, axis| sum + by[axis] * product(from + axis))
        });
        variance.max(0.0)
    }

    /// Variance of a sum of states if the errors that last were known.
    pub fn variance_of_changing(&self, row: &Row) -> f64 {
        let Comparison { product, variance, .. } = self.compare(row, 0.0, 0.0);
        // These are independent of each other: nothing corrects them.
        let lasting = |state: usize| product[state] * product[state] / self.variance(state);
        (variance - (CONSIDERED..STATES).map(lasting).sum::<f64>()).max(0.0)
    }

    /// Takes the measurement, and returns the correction of the state: P becomes P - K s Kᵀ with the optimal gain K, but in the block of the
    /// errors that are only considered.
    #[inline]
    pub fn take(&mut self, comparison: &Comparison) -> States {
        let Comparison { product, variance, innovation } = comparison;
        let mut correction = [0.0; STATES];
        let lose = |row: &mut [f64], gain: f64| {
            row.iter_mut().zip(product).for_each(|(covariance, part)| *covariance -= gain * part);
        };
        for (index, row) in self.p.iter_mut().enumerate() {
            let gain = product[index] / variance;
            // Between two errors that are only considered nothing changes: that is Schmidt's filter. A whole row has a length that
            // the compiler knows, which is faster.
            if index < self.estimated {
                lose(row, gain);
                correction[index] = gain * innovation;
            } else {
                lose(&mut row[..self.estimated], gain);
            }
            row[index] = row[index].max(self.floor[index]);
        }
        correction
    }

    /// Takes a measurement of a flow angle, which shows nothing of the wind along the flow (a unit vector, NED).
    ///
    /// In straight flight its gradients would seem to, as they swing with the noise of the estimate; likewise below.
    pub fn take_across(&mut self, comparison: &Comparison, flow: &Vector3<f64>) -> States {
        let mut left = comparison.wind_along(flow);
        // Of what is only considered, the whole gain is left out.
        for (state, left) in left.iter_mut().enumerate().skip(self.estimated) {
            *left = comparison.gain(state);
        }
        self.take_without(comparison, &left)
    }

    /// Takes a measurement of the airspeed, which shows the wind along the flow (a unit vector, NED), the velocity along it (start axes),
    /// and nothing else.
    pub fn take_along(
        &mut self,
        comparison: &Comparison,
        flow: &Vector3<f64>,
        start: &Vector3<f64>,
    ) -> States {
        let mut along = comparison.wind_along(flow);
        let velocity: f64 = (0..3).map(|axis| start[axis] * comparison.gain(VELOCITY + axis)).sum();
        for axis in 0..3 {
            along[VELOCITY + axis] = start[axis] * velocity;
        }
        let left = core::array::from_fn(|state| comparison.gain(state) - along[state]);
        self.take_without(comparison, &left)
    }

    /// Takes the measurement with a gain that leaves a part of the optimal one out: P becomes P - K s Kᵀ + l s lᵀ with l that part.
    fn take_without(&mut self, comparison: &Comparison, left: &States) -> States {
        let Comparison { product, variance, innovation } = comparison;
        for (index, row) in self.p.iter_mut().enumerate() {
            let gain = comparison.gain(index);
            let more = left[index] * variance;
            for (covariance, (part, left)) in row.iter_mut().zip(product.iter().zip(left)) {
                *covariance += more * left - gain * part;
            }
            row[index] = row[index].max(self.floor[index]);
        }
        core::array::from_fn(|state| (comparison.gain(state) - left[state]) * innovation)
    }

    /// Turns the errors of the attitude with a correction of it, so that they stay as they are in body axes.
    ///
    /// There a bias of the accelerometers looks like the same tilt before and after. In start axes it would look like another one, and
    /// the two seem to tell bias and tilt apart, which nothing does in straight flight.
    pub fn turn_attitude(&mut self, turned: &Matrix3<f64>) {
        // Right of the diagonal only the block of the attitude with itself is turned from both sides.
        let block = turned * self.block(ATTITUDE).transpose() * turned.transpose();
        for column in ATTITUDE + 3..STATES {
            let attitude = turned * Vector3::from_fn(|axis, _| self.p[ATTITUDE + axis][column]);
            for axis in 0..3 {
                self.p[ATTITUDE + axis][column] = attitude[axis];
            }
        }
        for (axis, row) in block.column_iter().enumerate() {
            self.p[ATTITUDE + axis][ATTITUDE..ATTITUDE + 3].copy_from_slice(row.as_slice());
        }
        self.keep_symmetric();
    }

    /// Forgets a state: this variance, and no correlation with any other.
    pub fn forget(&mut self, state: usize, variance: f64) {
        for other in 0..STATES {
            self.p[state][other] = 0.0;
            self.p[other][state] = 0.0;
        }
        self.p[state][state] = variance;
    }

    /// Makes a state another one plus something independent with this variance.
    pub fn derive(&mut self, state: usize, from: usize, variance: f64) {
        self.p[state] = self.p[from];
        for other in 0..STATES {
            self.p[other][state] = self.p[state][other];
        }
        self.p[state][state] = self.p[from][from] + variance;
        self.p[state][from] = self.p[from][from];
        self.p[from][state] = self.p[from][from];
    }

    /// Raises the variance of a state to this one at least.
    pub fn raise(&mut self, state: usize, variance: f64) {
        self.p[state][state] = self.p[state][state].max(variance);
    }

    /// Lowers the variance of a state to this; its correlations stay.
    pub fn lower(&mut self, state: usize, variance: f64) {
        let factor = libm::sqrt((variance / self.p[state][state]).min(1.0));
        for other in 0..STATES {
            self.p[state][other] *= factor;
            self.p[other][state] *= factor;
        }
    }

    /// Whether every number is finite and every variance positive.
    #[expect(clippy::eq_op, reason = "the difference is zero for finite numbers only")]
    pub fn is_sound(&self) -> bool {
        // ∞ - ∞ and NaN - NaN are NaN, which no sum loses: several numbers at once and no branch.
        let sums = self.p.iter().fold([0.0; STATES], |sums, row| {
            core::array::from_fn(|state| sums[state] + (row[state] - row[state]))
        });
        sums == [0.0; STATES] && (0..STATES).all(|state| self.variance(state) > 0.0)
    }
}

#[cfg(test)]
mod tests;
