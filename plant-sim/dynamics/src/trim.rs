//! Steady level flight, the start of every flight; and the trim of an initial state: pitch angle, elevator and thrust for a given
//! velocity, roll and yaw.

use host_io::problem::{Problem, problem};
use icd::units::DEG_PER_RAD;
use icd::{Attitude, Body, EulerAngles, Ned, PerEffector};
use nalgebra::{SMatrix, SVector, Vector3};

use crate::airframe::Airframe;
use crate::atmosphere::LocalDensity;
use crate::dynamics::{Dynamics, Evaluation, State};
use crate::range::check_range;
use crate::release::{Controls, InitialState};
use crate::rigid_body::RigidState;
use crate::start::Start;
use crate::wind::Gust;

/// Newton steps before the search gives up; it needs five.
const STEPS_MAX: u32 = 40;

/// Largest accepted residual, m/s² and rad/s²: a thousand roundings of one g.
const TOLERANCE: f64 = 1.0e-11;

/// Slopes and singular values below this count as zero, as for a missing control.
const SINGULAR: f64 = 1.0e-9;

/// Smallest singular value of lateral slopes of unit length below which they depend on each other: sine of half a degree.
const DEPENDENT: f64 = 1.0e-2;

/// Longest Newton step in angle of attack, rad: the bent aerodynamics must not make the search diverge.
const ALPHA_STEP_MAX_RAD: f64 = 0.1;

/// Steps of the search for the nearest flight.
const NEAREST_STEPS_MAX: u32 = 200;

/// Largest turn rate in that search, rad/s: a trim balances a Coriolis force.
const TURN_RATE_MAX_RAD_S: f64 = 0.1;

/// Names and units of the unknowns, and the number of units in one SI unit.
const QUANTITIES: [(&str, &str, f64); UNKNOWNS] = [
    ("angle of attack", "deg", DEG_PER_RAD),
    ("elevator command", "deg", DEG_PER_RAD),
    ("thrust", "N", 1.0),
    ("aileron command", "deg", DEG_PER_RAD),
    ("rudder command", "deg", DEG_PER_RAD),
    ("turn rate", "deg/s", DEG_PER_RAD),
    ("sideslip", "deg", DEG_PER_RAD),
];

/// Names and units of the accelerations that should be zero.
const ACCELERATIONS: [(&str, &str); 6] = [
    ("u'", "m/s2"),
    ("v'", "m/s2"),
    ("w'", "m/s2"),
    ("p'", "rad/s2"),
    ("q'", "rad/s2"),
    ("r'", "rad/s2"),
];

/// Steady flight at constant altitude: wings level, still nozzle, and no sideslip unless the aircraft lacks an effector that
/// would prevent it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Trim {
    /// Angle of attack, rad.
    pub alpha_rad: f64,
    /// Pitch angle, rad; the angle of attack unless the air rises or sinks.
    pub theta_rad: f64,
    /// Main command to the elevators, rad.
    pub elevator_rad: f64,
    /// Main command to the ailerons, rad. Zero on the flat Earth.
    pub aileron_rad: f64,
    /// Main command to the rudder, rad. Zero on the flat Earth.
    pub rudder_rad: f64,
    /// Thrust, N.
    pub thrust_n: f64,
    /// The effectors in this flight, rad and N.
    pub positions: PerEffector<f64>,
    /// Rate of the heading, rad/s: on a rotating Earth the turn that balances the Coriolis force. Zero on the
    /// flat Earth.
    pub turn_rate_rad_s: f64,
    /// Sideslip, rad: zero, except where roll and yaw cannot both be balanced by effectors.
    pub beta_rad: f64,
    /// The body in this flight.
    pub rigid: RigidState,
}

impl Trim {
    /// The effectors in this flight, rad and N.
    pub fn positions(&self) -> PerEffector<f64> {
        self.positions
    }

    /// Body and effectors together.
    pub fn state(&self) -> State {
        State { rigid: self.rigid, positions: self.positions() }
    }
}

/// Angle of attack, elevator, thrust, aileron, rudder, turn rate, sideslip.
const UNKNOWNS: usize = 7;
/// Accelerations, in the order of [`ACCELERATIONS`].
const EQUATIONS: usize = 6;
/// Index of the sideslip, which is an unknown only where the others are not enough.
const SIDESLIP: usize = 6;

type Unknowns = SVector<f64, UNKNOWNS>;
type Residual = SVector<f64, EQUATIONS>;
type Jacobian = SMatrix<f64, EQUATIONS, UNKNOWNS>;

/// Inputs of the search besides the aircraft.
struct LevelSearch<'a> {
    dynamics: &'a Dynamics,
    start: &'a Start,
    /// Steady wind without that of the levels, m/s, and with it.
    wind: &'a Ned,
    total_wind: Ned,
    /// Slope of the flight path through the air, rad: against a vertical wind.
    climb_rad: f64,
    density: LocalDensity,
    /// Geopotential altitude, m.
    altitude_m: f64,
    /// Largest sideslip of the search, rad; zero where it is no unknown.
    sideslip_max_rad: f64,
}

/// Searches steady level flight at the start, in this steady wind (m/s, where it blows to).
///
/// Airspeed and heading are those of the aircraft in the air; over the ground the wind is added. Newton's
/// method with a numerical Jacobian. On the flat Earth the lateral unknowns come out exactly zero, because
/// mirrored flights have mirrored bits. Where the effectors cannot balance roll and yaw independently, the sideslip becomes an
/// unknown as well, and each step is the one of minimum norm.
pub fn solve(dynamics: &Dynamics, start: &Start, wind: &Ned) -> Result<Trim, Problem> {
    let earth = dynamics.earth();
    let place = earth.place(&earth.position(&start.geodetic()));
    let altitude_m = place.geopotential_altitude_m;
    let total_wind = dynamics.wind(wind, altitude_m);
    // A NaN would hide behind many words what the search can say: nothing there is level.
    let sine = (total_wind.0.z / start.airspeed_m_s).clamp(-1.0, 1.0);
    let density = dynamics.density_around(altitude_m);
    // Newton needs slopes, and a thrust at its limit has none. `held` checks the limits at the end.
    let (dynamics, climb_rad) = (&dynamics.with_any_thrust(), libm::asin(sine));
    let mut search = LevelSearch {
        dynamics,
        start,
        wind,
        total_wind,
        climb_rad,
        density,
        altitude_m,
        sideslip_max_rad: 0.0,
    };
    let mut x = Unknowns::zeros();
    // An ordinary angle of attack inside the linear range.
    x[0] = 0.03;
    if let Some(engine) = dynamics.jet().engine() {
        let engine = &dynamics.airframe().servos[engine];
        x[2] = 0.5 * (engine.min + engine.max);
    }
    if !search.balances_roll_and_yaw(&x) {
        search.sideslip_max_rad = dynamics.airframe().limits.beta_rad;
    }
    let mut residual = search.residual(&x);
    for _ in 0..STEPS_MAX {
        if residual.amax() < TOLERANCE {
            return search.held(&x);
        }
        let Some(step) = search.step(&search.jacobian(&x), &residual) else { break };
        let scale = (ALPHA_STEP_MAX_RAD / step[0].abs()).min(1.0);
        x -= step * scale;
        residual = search.residual(&x);
    }
    // Near the edge of what the aircraft can do Newton's method may leave the flight that the
    // bounded search still finds.
    let (x, residual, nearest) = search.nearest();
    if residual.amax() < TOLERANCE {
        return search.held(&x);
    }
    let Start { airspeed_m_s, altitude_m, .. } = *start;
    let lacks = search.lacks(&x);
    Err(problem!(
        "no steady level flight found at {airspeed_m_s} m/s and {altitude_m} m: {lacks}{nearest}"
    ))
}

/// An effector cannot hold a steady flight that exists.
fn out_of_reach(airspeed_m_s: f64, altitude_m: f64, source: &Problem) -> Problem {
    problem!(
        "steady level flight at {airspeed_m_s} m/s and {altitude_m} m needs more than the aircraft has: {source}"
    )
}

impl LevelSearch<'_> {
    /// The trim, if the effectors of the aircraft can reach its positions.
    fn held(&self, x: &Unknowns) -> Result<Trim, Problem> {
        let trim = self.trim(x);
        let (thrust_range_n, pressure_pa) = (self.thrust_range_n(), self.pressure_pa());
        let airframe = self.dynamics.airframe();
        check_reach(airframe, &trim.positions, thrust_range_n, pressure_pa, trim.alpha_rad)
            .map_err(|source| {
                out_of_reach(self.start.airspeed_m_s, self.start.altitude_m, &source)
            })?;
        Ok(trim)
    }

    /// Dynamic pressure, Pa.
    fn pressure_pa(&self) -> f64 {
        0.5 * self.density.at(self.altitude_m) * self.start.airspeed_m_s * self.start.airspeed_m_s
    }

    fn thrust_range_n(&self) -> [f64; 2] {
        let altitude_m = self.altitude_m;
        let density = self.density.at(altitude_m);
        self.dynamics.thrust_range_n(self.start.airspeed_m_s, density, altitude_m)
    }

    fn trim(&self, x: &Unknowns) -> Trim {
        let theta_rad = self.theta_rad(x);
        let (rigid, _) = self.rigid(x);
        Trim {
            alpha_rad: x[0],
            theta_rad,
            elevator_rad: x[1],
            aileron_rad: x[3],
            rudder_rad: x[4],
            thrust_n: x[2],
            positions: self.dynamics.airframe().follow([x[3], x[1], x[4], x[2]]),
            turn_rate_rad_s: x[5],
            beta_rad: x[SIDESLIP],
            rigid,
        }
    }

    /// Pitch angle at which the velocity through the air has the slope of the flight path: with sideslip only part of the airspeed
    /// is in the plane of symmetry.
    fn theta_rad(&self, x: &Unknowns) -> f64 {
        if x[SIDESLIP] == 0.0 {
            return x[0] + self.climb_rad;
        }
        let sine = libm::sin(self.climb_rad) / libm::cos(x[SIDESLIP]);
        x[0] + libm::asin(sine.clamp(-1.0, 1.0))
    }

    /// The body in this flight, and its rates relative to the local NED axes.
    fn rigid(&self, x: &Unknowns) -> (RigidState, Vector3<f64>) {
        let (alpha_rad, turn_rate) = (x[0], x[5]);
        let (start, earth) = (self.start, self.dynamics.earth());
        let here = start.geodetic();
        let attitude = Attitude::from_euler(EulerAngles {
            phi: 0.0,
            theta: self.theta_rad(x),
            psi: start.heading_rad,
        });
        let (sin_alpha, cos_alpha) = libm::sincos(alpha_rad);
        let (sin_beta, cos_beta) = libm::sincos(x[SIDESLIP]);
        let in_plane = start.airspeed_m_s * cos_beta;
        let across = start.airspeed_m_s * sin_beta;
        let air = Vector3::new(in_plane * cos_alpha, across, in_plane * sin_alpha);
        let wind = attitude.to_body(self.total_wind).0;
        let velocity = Body(air + wind);
        let ground = attitude.to_ned(velocity).0;
        let relative = attitude.to_body(Ned::new(0.0, 0.0, turn_rate)).0;
        let q_e_from_body = earth.q_e_from_body(&here, &attitude);
        let position = earth.position(&here);
        let e_from_ned = earth.place(&position).e_from_ned;
        // The local NED axes turn with the Earth and over its curvature; a steady flight turns with
        // them.
        let frame =
            e_from_ned.tr_mul(&earth.rotation()) + earth.transport_rate(&here, &Ned(ground));
        let rates = Body(attitude.to_body(Ned(frame)).0 + relative);
        (RigidState { position, q_e_from_body, velocity, rates }, relative)
    }

    /// Accelerations that are zero in steady flight: of the air-relative velocity, because a steady wind
    /// is constant in NED and so rotates in body axes; and of the rates.
    fn residual(&self, x: &Unknowns) -> Residual {
        let (rigid, relative) = self.rigid(x);
        let positions = self.trim(x).positions();
        let e = self.dynamics.evaluate(&rigid, &positions, self.wind, &Gust::none(), &self.density);
        let wind_body = e.motion.e_from_body.tr_mul(&(e.place.e_from_ned * self.total_wind.0));
        let linear = e.motion.derivative.velocity.0 + relative.cross(&wind_body);
        let angular = e.motion.derivative.rates.0;
        Residual::new(linear.x, linear.y, linear.z, angular.x, angular.y, angular.z)
    }

    /// A column of zeros for the sideslip where it is no unknown.
    fn jacobian(&self, x: &Unknowns) -> Jacobian {
        // The thrust counts in newton, and a smaller step of it would drown in rounding.
        let steps = [1.0e-5, 1.0e-5, 1.0, 1.0e-5, 1.0e-5, 1.0e-6, 1.0e-5];
        let mut slopes = jacobian(x, steps, |x| self.residual(x));
        if self.sideslip_max_rad == 0.0 {
            slopes.column_mut(SIDESLIP).fill(0.0);
        }
        slopes
    }

    /// Newton's step; the shortest one where several solve the equations.
    fn step(&self, slopes: &Jacobian, residual: &Residual) -> Option<Unknowns> {
        let shortest = || {
            let mut step = slopes.svd(true, true).solve(residual, SINGULAR).ok()?;
            // What moves nothing stays where it is, without the rounding of the decomposition.
            for (i, column) in slopes.column_iter().enumerate() {
                step[i] *= f64::from(u8::from(column.amax() > 0.0));
            }
            Some(step)
        };
        if self.sideslip_max_rad > 0.0 {
            return shortest();
        }
        let square: SMatrix<f64, EQUATIONS, EQUATIONS> = slopes.fixed_columns::<6>(0).into();
        square.lu().solve(residual).map(|step| step.push(0.0)).or_else(shortest)
    }

    /// Whether aileron, rudder and turn rate can make the accelerations sideways, in roll and in yaw zero at once.
    fn balances_roll_and_yaw(&self, x: &Unknowns) -> bool {
        let slopes = self.jacobian(x);
        let [v, p, r] = [1, 3, 5];
        let lateral = SMatrix::<f64, 3, 3>::from_fn(|i, j| slopes[([v, p, r][i], 3 + j)]);
        let mut unit = lateral;
        for mut column in unit.column_iter_mut() {
            column /= column.norm().max(f64::MIN_POSITIVE);
        }
        unit.singular_values().min() > DEPENDENT
    }

    /// What the aircraft lacks for a steady flight, in words; empty if it has all.
    fn lacks(&self, x: &Unknowns) -> String {
        let slopes = self.jacobian(x);
        let has =
            |acceleration: usize, unknown: usize| slopes[(acceleration, unknown)].abs() > SINGULAR;
        let mut lacks = Vec::new();
        if !has(4, 1) {
            lacks.push("no effector pitches");
        }
        if !has(3, 3) && !has(3, 4) {
            lacks.push("no effector rolls");
        }
        if self.dynamics.jet().engine().is_none() {
            lacks.push("no engine");
        }
        lacks.into_iter().map(|what| format!("{what}, ")).collect()
    }

    /// If there is no steady level flight: the flight that comes closest to it, its residual, and what prevents a steady one in words.
    ///
    /// Least squares of the residuals with every unknown inside its range (Levenberg and Marquardt, projected).
    fn nearest(&self) -> (Unknowns, Residual, String) {
        let [low, high] = self.ranges();
        let inside = |x: Unknowns| x.zip_zip_map(&low, &high, |x, low, high| x.max(low).min(high));
        let mut x = Unknowns::zeros();
        (x[0], x[2]) = (0.05, 0.5 * (low[2] + high[2]));
        let mut x = inside(x);
        let mut residual = self.residual(&x);
        let mut damping = 1.0e-3;
        for _ in 0..NEAREST_STEPS_MAX {
            if residual.amax() < TOLERANCE {
                break;
            }
            let mut jacobian = self.jacobian(&x);
            let gradient = jacobian.tr_mul(&residual);
            for (i, mut column) in jacobian.column_iter_mut().enumerate() {
                // The unknown is at an end of its range, and the residual would decrease beyond it.
                let is_held =
                    (x[i] <= low[i] && gradient[i] > 0.0) || (x[i] >= high[i] && gradient[i] < 0.0);
                if is_held {
                    column.fill(0.0);
                }
            }
            let mut normal = jacobian.tr_mul(&jacobian);
            for i in 0..UNKNOWNS {
                // A control that the aircraft lacks has a zero here, which would make the matrix
                // singular.
                normal[(i, i)] += damping * normal[(i, i)].max(1.0e-12);
            }
            let Some(step) = normal.lu().solve(&jacobian.tr_mul(&residual)) else { break };
            let next = inside(x - step);
            let then = self.residual(&next);
            if then.norm() < residual.norm() {
                (x, residual, damping) = (next, then, (damping / 3.0).max(1.0e-12));
            } else {
                damping *= 4.0;
            }
        }
        let mut text = String::new();
        for (i, (quantity, unit, per_si)) in QUANTITIES.into_iter().enumerate() {
            // A control that the aircraft lacks limits nothing.
            if (x[i] <= low[i] || x[i] >= high[i]) && low[i] < high[i] {
                // An angle of a file was converted through radians.
                let limit = libm::round(x[i] * per_si * 1.0e9) / 1.0e9;
                text += &format!("the {quantity} is at its limit of {limit} {unit}, ");
            }
        }
        let left = residual.iter().zip(ACCELERATIONS);
        let left = left.map(|(value, (name, unit))| format!("{name} = {value:.3e} {unit}"));
        text += &format!("and {} are left", left.collect::<Vec<_>>().join(", "));
        (x, residual, text)
    }

    /// Smallest and largest of each unknown.
    fn ranges(&self) -> [Unknowns; 2] {
        let (airframe, pressure_pa) = (self.dynamics.airframe(), self.pressure_pa());
        let command = |command: usize| {
            let ends = airframe.effectors.all().filter_map(|effector| {
                let gains = &airframe.gains[effector];
                let gain = [gains.roll, gains.pitch, gains.yaw][command];
                let [low, high] = airframe.servos[effector].travel_at(pressure_pa);
                // A gain of zero has infinite ends, which are thrown away below.
                let ends = [low / gain, high / gain];
                (gain != 0.0).then_some([ends[0].min(ends[1]), ends[0].max(ends[1])])
            });
            // The trim has to be inside the travel of each effector that it uses.
            ends.reduce(|a, b| [a[0].max(b[0]), a[1].min(b[1])]).unwrap_or([0.0; 2])
        };
        let alpha = airframe.limits.alpha_rad;
        let [aileron, elevator, rudder] = [0, 1, 2].map(command);
        let turn = [-TURN_RATE_MAX_RAD_S, TURN_RATE_MAX_RAD_S];
        let sideslip = [-self.sideslip_max_rad, self.sideslip_max_rad];
        let thrust = self.thrust_range_n();
        let all = [[-alpha, alpha], elevator, thrust, aileron, rudder, turn, sideslip];
        [0, 1].map(|end| Unknowns::from(all.map(|range| range[end])))
    }
}

/// Slopes of the residuals by central differences. The steps of the unknowns are large enough to be above rounding, and small against
/// the curvature.
fn jacobian<const M: usize, const N: usize>(
    x: &SVector<f64, N>,
    steps: [f64; N],
    residual: impl Fn(&SVector<f64, N>) -> SVector<f64, M>,
) -> SMatrix<f64, M, N> {
    let mut jacobian = SMatrix::<f64, M, N>::zeros();
    for (i, step) in steps.into_iter().enumerate() {
        let (mut above, mut below) = (*x, *x);
        above[i] += step;
        below[i] -= step;
        jacobian.set_column(i, &((residual(&above) - residual(&below)) / (2.0 * step)));
    }
    jacobian
}

/// Checks that effectors and angle of attack (rad) are inside their limits; `thrust_range` is that of the engine, N,
/// and the dynamic pressure (Pa) that of the flight, whose hinge moments may limit the travel.
fn check_reach(
    airframe: &Airframe,
    positions: &PerEffector<f64>,
    thrust_range: [f64; 2],
    pressure_pa: f64,
    alpha_rad: f64,
) -> Result<(), Problem> {
    let list = &airframe.effectors;
    for effector in list.all() {
        let servo = &airframe.servos[effector];
        let (key, unit, [min, max]) = if list.is_angle(effector) {
            ("deflection_deg", 1.0_f64.to_degrees(), servo.travel_at(pressure_pa))
        } else {
            ("thrust_n", 1.0, thrust_range)
        };
        let value = positions[effector] * unit;
        check_range(list.key(effector), key, value, min * unit, max * unit)?;
    }
    let most = airframe.limits.alpha_rad.to_degrees();
    check_range("limits", "angle_of_attack_deg", alpha_rad.to_degrees(), -most, most)
}

#[derive(Debug, Clone, Copy, PartialEq)]
pub struct LongitudinalTrim {
    /// Pitch angle, rad.
    pub theta_rad: f64,
    /// Main command to the elevators, rad.
    pub elevator_rad: f64,
    /// The controls, with those that were given.
    pub controls: Controls,
}

struct LongitudinalSearch<'a> {
    dynamics: &'a Dynamics,
    initial: &'a InitialState,
    given: &'a Controls,
    wind: &'a Ned,
    density: LocalDensity,
}

/// Searches the pitch angle, the elevator and the thrust with which the acceleration along the track, the one downwards and the
/// pitch acceleration are zero. Roll, yaw, velocity in NED and rates are those of `initial`; `given` holds the other controls.
///
/// Definition of the NESC check cases (NASA/TM-2015-218675): the accelerations are those of the velocity in local NED axes, and on a
/// rotating Earth the one across the track, and those in roll and yaw, are left as they are.
pub fn solve_longitudinal(
    dynamics: &Dynamics,
    initial: &InitialState,
    given: &Controls,
    wind: &Ned,
) -> Result<LongitudinalTrim, Problem> {
    // As in `solve`: a thrust at its limit has no slope.
    let free = dynamics.with_any_thrust();
    let place = dynamics.earth().place(&initial.place(dynamics.earth()));
    let density = dynamics.density_around(place.geopotential_altitude_m);
    let search = LongitudinalSearch { dynamics: &free, initial, given, wind, density };
    let thrust_n = dynamics.jet().engine().map_or(0.0, |engine| {
        let servo = &dynamics.airframe().servos[engine];
        0.5 * (servo.min + servo.max)
    });
    let mut x = Vector3::new(0.03, 0.0, thrust_n);
    let (mut residual, mut present) = search.residual(&x);
    for _ in 0..STEPS_MAX {
        if residual.amax() < TOLERANCE {
            return search.held(dynamics, &x, &present);
        }
        let jacobian = jacobian(&x, [1.0e-5, 1.0e-5, 1.0], |x| search.residual(x).0);
        let Some(step) = jacobian.lu().solve(&residual) else { break };
        x -= step * (ALPHA_STEP_MAX_RAD / step.x.abs()).min(1.0);
        (residual, present) = search.residual(&x);
    }
    Err(problem!(
        "no pitch angle, elevator and thrust make the initial state steady: the nearest one still has {:.3e} m/s2 along \
         the track, {:.3e} m/s2 down and {:.3e} rad/s2 in pitch",
        residual.x,
        residual.y,
        residual.z
    ))
}

impl LongitudinalSearch<'_> {
    fn controls(&self, x: &Vector3<f64>) -> Controls {
        let followed = self.dynamics.airframe().follow([0.0, x.y, 0.0, x.z]);
        // Only what the main commands move is searched; other controls stay as they are given.
        let positions = PerEffector::from_fn(|e| self.given.positions[e] + followed[e]);
        Controls { positions, lever: None }
    }

    fn residual(&self, x: &Vector3<f64>) -> (Vector3<f64>, Evaluation) {
        let rigid = self.initial.rigid(self.dynamics.earth(), x.x);
        let positions = self.controls(x).positions;
        let e = self.dynamics.evaluate(&rigid, &positions, self.wind, &Gust::none(), &self.density);
        let ned = |body: &Body| e.place.e_from_ned.tr_mul(&(e.motion.e_from_body * body.0));
        let velocity = ned(&rigid.velocity);
        let earth = self.dynamics.earth();
        let transport = earth.transport_rate(&earth.geodetic(&rigid.position), &Ned(velocity));
        let frame = earth.rotation() + e.place.e_from_ned * transport;
        // Rates of the body relative to the local NED axes.
        let turning = rigid.rates.0 - e.motion.e_from_body.tr_mul(&frame);
        let acceleration =
            ned(&Body(e.motion.derivative.velocity.0 + turning.cross(&rigid.velocity.0)));
        let track = Vector3::new(velocity.x, velocity.y, 0.0);
        let along = match track.norm() {
            speed if speed > 0.0 => acceleration.dot(&track) / speed,
            // A body that moves straight up or down has no track; north stands in for it.
            _ => acceleration.x,
        };
        (Vector3::new(along, acceleration.z, e.motion.derivative.rates.0.y), e)
    }

    /// The trim, if the aircraft (`dynamics`, with the limits of its thrust) can hold it.
    fn held(
        &self,
        dynamics: &Dynamics,
        x: &Vector3<f64>,
        present: &Evaluation,
    ) -> Result<LongitudinalTrim, Problem> {
        let mut controls = self.controls(x);
        let airspeed_m_s = present.motion.air.airspeed_m_s;
        let altitude_m = present.place.geopotential_altitude_m;
        let thrust_range = dynamics.thrust_range_n(airspeed_m_s, present.density, altitude_m);
        check_reach(
            dynamics.airframe(),
            &controls.positions,
            thrust_range,
            0.5 * present.density * airspeed_m_s * airspeed_m_s,
            present.motion.air.alpha_rad,
        )
        .map_err(|source| out_of_reach(airspeed_m_s, present.place.altitude_m, &source))?;
        let air = dynamics.engine_air(airspeed_m_s, present.density, altitude_m);
        controls.lever = dynamics.jet().lever_at(x.z, &air);
        Ok(LongitudinalTrim { theta_rad: x.x, elevator_rad: x.y, controls })
    }
}

#[cfg(test)]
mod tests;
