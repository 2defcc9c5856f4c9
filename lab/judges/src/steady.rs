//! Steady flight with effectors jammed: is there one with everything else inside its bounds?
//!
//! Unknowns are angle of attack, sideslip, bank, climb angle, airspeed, turn rate and the positions of all effectors, each in
//! an interval; a jammed effector's interval is a point. Six accelerations must be zero. For a margin there is a second
//! position of every surface for each axis and sign, inside the travel too, that moves this axis by a part of its authority
//! and the other two not at all: so what is left on one axis is what it is with the others held.
//!
//! The search is least squares with every unknown inside its interval (Levenberg and Marquardt, projected; D. Bertsekas,
//! "Projected Newton methods for optimization problems with simple constraints", SIAM J. Control Optim. 20(2), 1982). It is
//! local: a flight that it finds exists, one that it does not find may exist.

use flight_control::allocation::Column;
use flight_control::allocation::attainable::axis_reach;
use icd::units::STANDARD_GRAVITY_M_S2;
use icd::{Attitude, Body, Effector, EulerAngles, Ned, PerEffector};
use nalgebra::{DMatrix, DVector, Vector3};
use plant_sim::atmosphere::LocalDensity;
use plant_sim::dynamics::Dynamics;
use plant_sim::rigid_body::RigidState;
use plant_sim::start::Start;
use plant_sim::trim::Trim;
use plant_sim::wind::Gust;

/// Unknowns of the flight itself, before the effectors.
const FLIGHT: usize = 6;
/// Accelerations that are zero: three in g, three in rad/s².
const BALANCE: usize = 6;
/// Both signs of three axes.
const MOVES: usize = 6;
/// Largest residual of a steady flight, g and rad/s².
const TOLERANCE: f64 = 1.0e-8;
/// Steps of one search.
const STEPS_MAX: u32 = 400;
/// A search that has not fallen by this factor in [`STALLED_STEPS`] is ended.
const PROGRESS: f64 = 0.8;
const STALLED_STEPS: u32 = 40;
/// Starts of a thorough search beyond the usual ones.
const SPREAD_STARTS: u32 = 40;
/// Step of the differences, of the interval.
const DIFFERENCE: f64 = 1.0e-6;
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Interval {
    pub low: f64,
    pub high: f64,
}

impl Interval {
    /// From one end to the other.
    pub const fn new(low: f64, high: f64) -> Self {
        Self { low, high }
    }

    pub const fn point(value: f64) -> Self {
        Self::new(value, value)
    }

    fn limited(self, value: f64) -> f64 {
        value.max(self.low).min(self.high)
    }
}

#[derive(Debug, Clone, Copy, PartialEq)]
pub struct FlightBounds {
    /// Angle of attack, rad.
    pub alpha: Interval,
    /// Sideslip, rad.
    pub beta: Interval,
    /// Bank, rad.
    pub bank: Interval,
    /// Climb angle, rad.
    pub climb: Interval,
    /// True airspeed, m/s.
    pub airspeed: Interval,
    /// Rate of the heading, rad/s.
    pub turn_rate: Interval,
}

impl FlightBounds {
    fn intervals(&self) -> [Interval; FLIGHT] {
        [self.alpha, self.beta, self.bank, self.climb, self.airspeed, self.turn_rate]
    }
}

#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SteadyFlight {
    /// Angle of attack, rad.
    pub alpha_rad: f64,
    /// Sideslip, rad.
    pub beta_rad: f64,
    /// Bank, rad.
    pub bank_rad: f64,
    /// Climb angle, rad.
    pub climb_rad: f64,
    /// True airspeed, m/s.
    pub airspeed_m_s: f64,
    /// Rate of the heading, rad/s.
    pub turn_rate_rad_s: f64,
    /// Positions of the effectors, rad and N.
    pub positions: PerEffector<f64>,
}

impl SteadyFlight {
    fn of(x: &[f64]) -> Self {
        let positions = PerEffector::from_values(x[FLIGHT..].iter().copied());
        let (alpha_rad, beta_rad, bank_rad) = (x[0], x[1], x[2]);
        let (climb_rad, airspeed_m_s, turn_rate_rad_s) = (x[3], x[4], x[5]);
        Self { alpha_rad, beta_rad, bank_rad, climb_rad, airspeed_m_s, turn_rate_rad_s, positions }
    }

    fn to_unknowns(self, count: usize) -> Vec<f64> {
        let flight = [
            self.alpha_rad,
            self.beta_rad,
            self.bank_rad,
            self.climb_rad,
            self.airspeed_m_s,
            self.turn_rate_rad_s,
        ];
        flight.into_iter().chain(self.positions.first(count).iter().copied()).collect()
    }

    /// Pitch angle of this flight, rad (the rate-of-climb constraint of B. Stevens, F. Lewis, E. Johnson, "Aircraft Control and
    /// Simulation", 3rd edition, section 3.6).
    fn pitch_rad(&self) -> f64 {
        let (sin_alpha, cos_alpha) = libm::sincos(self.alpha_rad);
        let (sin_beta, cos_beta) = libm::sincos(self.beta_rad);
        let (sin_phi, cos_phi) = libm::sincos(self.bank_rad);
        let sin_climb = libm::sin(self.climb_rad);
        let a = cos_alpha * cos_beta;
        let b = sin_phi * sin_beta + cos_phi * sin_alpha * cos_beta;
        let square = a * a - sin_climb * sin_climb;
        let root = (square + b * b).max(0.0).sqrt();
        libm::atan2(a * b + sin_climb * root, square)
    }
}

/// The aircraft at one altitude, and the flights that count.
#[derive(Debug, Clone)]
pub struct Search<'a> {
    dynamics: &'a Dynamics,
    place: Start,
    density: LocalDensity,
    bounds: FlightBounds,
    travel: Vec<Interval>,
    /// The surfaces and the nozzle: what a margin may move.
    movable: Vec<usize>,
    /// Moment that must be left on each axis at the airspeed of the design point, N m; `None`: no margin.
    margin: Option<Vector3<f64>>,
}

impl<'a> Search<'a> {
    /// Nothing is jammed; the altitude is that of the design point, the thrust in this part of the engine's range.
    pub fn new(dynamics: &'a Dynamics, bounds: FlightBounds, thrust_part: [f64; 2]) -> Self {
        let airframe = dynamics.airframe();
        let place = airframe.design_point;
        // On the flat Earth of `Study` the two altitudes are one.
        let density = dynamics.density_around(place.altitude_m);
        let at = density.at(place.altitude_m);
        let engine = dynamics.thrust_range_n(place.airspeed_m_s, at, place.altitude_m);
        let interval = |effector: Effector| {
            let servo = &airframe.servos[effector];
            if airframe.effectors.is_angle(effector) {
                Interval::new(servo.min, servo.max)
            } else {
                let [low, high] =
                    thrust_part.map(|part| engine[0] + part * (engine[1] - engine[0]));
                Interval::new(low, high)
            }
        };
        let all: Vec<Effector> = airframe.effectors.all().collect();
        let movable = (0..all.len()).filter(|i| airframe.effectors.is_angle(all[*i])).collect();
        let travel = all.into_iter().map(interval).collect();
        Self { dynamics, place, density, bounds, travel, movable, margin: None }
    }

    /// The same with effectors (by their place in the list) that stand still, rad and N.
    pub fn jammed(&self, jams: &[(usize, f64)]) -> Self {
        let mut search = self.clone();
        for (place, value) in jams {
            search.travel[*place] = Interval::point(*value);
        }
        search
    }

    /// The same with `part` of the healthy authority on every axis left both ways; see [`Search::authority`].
    pub fn with_margin(&self, part: f64, trim: &Trim) -> Self {
        Self { margin: Some(self.authority(trim) * part), ..self.clone() }
    }

    /// Moment that all surfaces together can add on one axis, the others held, in the smaller direction, at the trim of
    /// the design point, N m.
    pub fn authority(&self, trim: &Trim) -> Vector3<f64> {
        let flight = SteadyFlight {
            alpha_rad: trim.alpha_rad,
            beta_rad: 0.0,
            bank_rad: 0.0,
            climb_rad: 0.0,
            airspeed_m_s: self.place.airspeed_m_s,
            turn_rate_rad_s: 0.0,
            positions: trim.positions,
        };
        let x = flight.to_unknowns(self.travel.len());
        let moment = |place: usize, value: f64| {
            let mut moved = x.clone();
            moved[FLIGHT + place] = value;
            self.accelerations(&moved).1
        };
        let column = |place: &usize| {
            let (at, travel) = (x[FLIGHT + place], self.travel[*place]);
            let step = 1.0e-3;
            let effect = (moment(*place, at + step) - moment(*place, at - step)) / (2.0 * step);
            Column { effect, min: travel.low, max: travel.high, preferred: at, weight: 1.0 }
        };
        let columns: Vec<Column> = self.movable.iter().map(column).collect();
        let at: Vec<f64> = self.movable.iter().map(|place| x[FLIGHT + place]).collect();
        let [roll, pitch, yaw] = axis_reach(&columns, &at).axes();
        Vector3::new(
            roll.negative.min(roll.positive),
            pitch.negative.min(pitch.positive),
            yaw.negative.min(yaw.positive),
        )
    }

    /// A steady flight, searched from these and from fixed starts.
    pub fn find(&self, near: &[SteadyFlight]) -> Option<SteadyFlight> {
        let count = self.travel.len();
        let near = near.iter().map(|flight| flight.to_unknowns(count));
        near.chain(self.starts()).find_map(|start| self.from(&start))
    }

    /// The same from many more starts, spread over all intervals: for the end of a range.
    pub fn find_thoroughly(&self, near: &[SteadyFlight]) -> Option<SteadyFlight> {
        let spread =
            || (1..=SPREAD_STARTS).find_map(|number| self.from(&self.spread_start(number)));
        self.find(near).or_else(spread)
    }

    /// A point of the additive sequence of the golden ratio's kin (M. Roberts, "The unreasonable effectiveness of quasirandom
    /// sequences", 2018), one coordinate for each unknown.
    fn spread_start(&self, number: u32) -> Vec<f64> {
        let flight = self.bounds.intervals();
        let intervals: Vec<Interval> =
            flight.into_iter().chain(self.travel.iter().copied()).collect();
        // A few unknowns.
        let dimensions = intervals.len() as f64;
        // The positive root of g^(d + 1) = g + 1.
        let root = (0..32).fold(1.0_f64, |g, _| libm::pow(1.0 + g, 1.0 / (dimensions + 1.0)));
        let mut part = 1.0;
        let point = intervals.iter().map(|interval| {
            part /= root;
            let at = (0.5 + part * f64::from(number)).fract();
            interval.low + at * (interval.high - interval.low)
        });
        point.collect()
    }

    /// Starts that cover the bounds: level and banked to either side, slow and fast.
    fn starts(&self) -> impl Iterator<Item = Vec<f64>> + '_ {
        let places = [(0.0, 0.5), (0.5, 0.5), (-0.5, 0.5), (0.9, 0.1), (-0.9, 0.1), (0.0, 0.9)];
        places.into_iter().map(|(bank, speed)| {
            let FlightBounds { airspeed, .. } = self.bounds;
            let flight = [
                0.03,
                0.0,
                bank * self.bounds.bank.high,
                0.0,
                airspeed.low + speed * (airspeed.high - airspeed.low),
                0.0,
            ];
            // A surface begins straight, an engine in the middle of its range.
            let middle = |travel: &Interval| match travel.low < 0.0 {
                true => travel.limited(0.0),
                false => 0.5 * (travel.low + travel.high),
            };
            flight.into_iter().chain(self.travel.iter().map(middle)).collect()
        })
    }

    /// Unknowns beyond flight and effectors: a position of every movable effector for each move.
    fn moved(&self, x: &[f64]) -> Vec<f64> {
        let count = if self.margin.is_some() { MOVES } else { 0 };
        (0..count).flat_map(|_| self.movable.iter().map(|place| x[FLIGHT + place])).collect()
    }

    fn intervals(&self) -> Vec<Interval> {
        let flight = self.bounds.intervals();
        let base: Vec<Interval> = flight.into_iter().chain(self.travel.iter().copied()).collect();
        let count = if self.margin.is_some() { MOVES } else { 0 };
        let moved = (0..count).flat_map(|_| self.movable.iter().map(|place| base[FLIGHT + place]));
        base.iter().copied().chain(moved.collect::<Vec<_>>()).collect()
    }

    fn from(&self, start: &[f64]) -> Option<SteadyFlight> {
        let intervals = self.intervals();
        let start = start.iter().copied().chain(self.moved(start));
        let start: Vec<f64> = start.zip(&intervals).map(|(x, i)| i.limited(x)).collect();
        let mut x = DVector::from_vec(start);
        let mut residual = self.residual(x.as_slice());
        let (mut damping, mut mark, mut marked_at) = (1.0e-4, residual.norm(), 0);
        for step in 0..STEPS_MAX {
            if residual.amax() < TOLERANCE {
                return Some(SteadyFlight::of(&x.as_slice()[..FLIGHT + self.travel.len()]));
            }
            let jacobian = self.jacobian(&x, &intervals);
            let Some(next) = bounded_step(&jacobian, &residual, &x, &intervals, damping) else {
                break;
            };
            let then = self.residual(next.as_slice());
            if then.norm() < residual.norm() {
                (x, residual, damping) = (next, then, (damping * 0.3).max(1.0e-12));
            } else {
                damping = (damping * 8.0).min(1.0e6);
            }
            if residual.norm() < PROGRESS * mark {
                (mark, marked_at) = (residual.norm(), step);
            } else if step - marked_at > STALLED_STEPS {
                break;
            }
        }
        None
    }

    /// Accelerations (g and rad/s²) and moment (N m) of a flight.
    fn accelerations(&self, x: &[f64]) -> ([f64; BALANCE], Vector3<f64>) {
        let flight = SteadyFlight::of(&x[..FLIGHT + self.travel.len()]);
        let (theta, phi) = (flight.pitch_rad(), flight.bank_rad);
        let here = self.place.geodetic();
        let attitude = Attitude::from_euler(EulerAngles { phi, theta, psi: 0.0 });
        let earth = self.dynamics.earth();
        let (sin_alpha, cos_alpha) = libm::sincos(flight.alpha_rad);
        let (sin_beta, cos_beta) = libm::sincos(flight.beta_rad);
        let (sin_theta, cos_theta) = libm::sincos(theta);
        let (sin_phi, cos_phi) = libm::sincos(phi);
        let (speed, turn) = (flight.airspeed_m_s, flight.turn_rate_rad_s);
        let rigid = RigidState {
            position: earth.position(&here),
            q_e_from_body: earth.q_e_from_body(&here, &attitude),
            velocity: Body::new(
                speed * cos_alpha * cos_beta,
                speed * sin_beta,
                speed * sin_alpha * cos_beta,
            ),
            rates: Body::new(
                -turn * sin_theta,
                turn * sin_phi * cos_theta,
                turn * cos_phi * cos_theta,
            ),
        };
        let (still, gust) = (Ned::zero(), Gust::none());
        let now = self.dynamics.evaluate(&rigid, &flight.positions, &still, &gust, &self.density);
        let linear = now.motion.derivative.velocity.0 / STANDARD_GRAVITY_M_S2;
        let angular = now.motion.derivative.rates.0;
        let balance = [linear.x, linear.y, linear.z, angular.x, angular.y, angular.z];
        (balance, now.motion.wrench.moment.0)
    }

    fn residual(&self, x: &[f64]) -> DVector<f64> {
        let (balance, moment) = self.accelerations(x);
        let mut residual = balance.to_vec();
        for number in 0..self.moves() {
            residual.extend_from_slice(self.missing(x, number, &moment).as_slice());
        }
        DVector::from_vec(residual)
    }

    fn moves(&self) -> usize {
        if self.margin.is_some() { MOVES } else { 0 }
    }

    /// What a move lacks, of the margin of each axis.
    fn missing(&self, x: &[f64], number: usize, moment: &Vector3<f64>) -> Vector3<f64> {
        let Some(margin) = self.margin else { return Vector3::zeros() };
        // Moments grow with the square of the airspeed, and the margin is that of the design point.
        let faster = x[4] / self.place.airspeed_m_s;
        let margin = margin * (faster * faster);
        let mut moved = x[..FLIGHT + self.travel.len()].to_vec();
        let from = FLIGHT + self.travel.len() + number * self.movable.len();
        for (place, value) in self.movable.iter().zip(&x[from..]) {
            moved[FLIGHT + place] = *value;
        }
        let change = (self.accelerations(&moved).1 - moment).component_div(&margin);
        let mut direction = Vector3::zeros();
        direction[number / 2] = if number.is_multiple_of(2) { 1.0 } else { -1.0 };
        0.1 * (change - direction)
    }

    /// Derivatives by each unknown over its interval.
    fn jacobian(&self, x: &DVector<f64>, intervals: &[Interval]) -> DMatrix<f64> {
        let base = FLIGHT + self.travel.len();
        let mut jacobian = DMatrix::zeros(BALANCE + 3 * self.moves(), x.len());
        let mut at = x.as_slice().to_vec();
        let (_, moment) = self.accelerations(&at);
        for (i, interval) in intervals.iter().enumerate() {
            let width = interval.high - interval.low;
            // What is jammed has no width, and its column stays zero.
            if width <= 0.0 {
                continue;
            }
            let here = at[i];
            let step = DIFFERENCE * width;
            if i < base {
                at[i] = here + step;
                let above = self.residual(&at);
                at[i] = here - step;
                let below = self.residual(&at);
                jacobian.set_column(i, &((above - below) / (2.0 * DIFFERENCE)));
            } else {
                // A position of one move only.
                let number = (i - base) / self.movable.len();
                at[i] = here + step;
                let above = self.missing(&at, number, &moment);
                at[i] = here - step;
                let below = self.missing(&at, number, &moment);
                let slope = (above - below) / (2.0 * DIFFERENCE);
                jacobian.view_mut((BALANCE + 3 * number, i), (3, 1)).copy_from(&slope);
            }
            at[i] = here;
        }
        jacobian
    }
}

/// The damped step of least squares to where the residual is expected to be smallest, every unknown inside its interval. An
/// unknown that would leave it stops at the end, and the others take over what it cannot do.
fn bounded_step(
    jacobian: &DMatrix<f64>,
    residual: &DVector<f64>,
    x: &DVector<f64>,
    intervals: &[Interval],
    damping: f64,
) -> Option<DVector<f64>> {
    let mut free = jacobian.clone();
    let mut rest = residual.clone();
    let mut next = x.clone();
    let mut is_free: Vec<bool> = intervals.iter().map(|i| i.high > i.low).collect();
    for _ in 0..intervals.len() {
        // There are fewer residuals than unknowns, so this is the smaller of the two normal
        // matrices.
        let mut normal = &free * free.transpose();
        let most = normal.diagonal().max();
        for i in 0..normal.nrows() {
            // Where everything stands still the matrix is zero, and has no factors without this.
            normal[(i, i)] += damping * most + 1.0e-14;
        }
        let change = free.tr_mul(&normal.cholesky()?.solve(&rest));
        let mut all_inside = true;
        for (i, interval) in intervals.iter().enumerate() {
            if !is_free[i] {
                continue;
            }
            let width = interval.high - interval.low;
            let unlimited = x[i] - change[i] * width;
            next[i] = interval.limited(unlimited);
            if next[i] != unlimited {
                (is_free[i], all_inside) = (false, false);
                rest += free.column(i) * ((next[i] - x[i]) / width);
                free.column_mut(i).fill(0.0);
            }
        }
        if all_inside {
            break;
        }
    }
    Some(next)
}
