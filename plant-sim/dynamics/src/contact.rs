//! Forces of the ground on the contact points: a spring and a damper across it, friction that sticks and slips along it.
//!
//! The forces of a step are constant in frame E and found at its beginning for its middle, all points together: the spring acts with
//! the mean of its energy over the step, the damper with the velocity in the middle. So the work of a force is exactly the force times
//! the displacement, and what the springs store is never more than what the body has lost (docs/decisions/153-the-ground.md).
//!
//! Along the ground a point is held by a spring that remembers its stretch. At the limit of the friction the point slips and the
//! stretch stays at that of the limit. A wheel that rolls has a limit of its own along its rolling direction.

use std::fmt;

use host_io::problem::{Problem, problem};
use icd::effector_list::Name;
use icd::units::STANDARD_GRAVITY_M_S2;
use icd::{Effector, EffectorList, PerEffector};
use nalgebra::{Matrix3, Vector3};

use crate::dynamics::{Dynamics, Evaluation};
use crate::earth::Place;
use crate::gear::{ContactPoint, Gear};
use crate::ground::{GroundSetup, SECTION, Surface, Under};
use crate::rail::Rail;
use crate::rigid_body::{HeldForces, MassProperties, RigidState};

/// Part of the critical damping of the spring along the ground, at the effective mass of its point.
const GRIP_DAMPING_RATIO: f64 = 0.5;
/// The solution is good enough when a sweep changes the forces by less than this part of them, or this many N.
const CHANGE_MAX: f64 = 1.0e-10;
const CHANGE_MAX_N: f64 = 1.0e-7;
/// Most sweeps over the points in a step; a few are usual.
const SWEEPS_MAX: usize = 40;

/// Slip angle at which a tyre gives all its side force, rad: usual for aircraft tyres are 8 to 10 deg.
const SLIP_FULL_RAD: f64 = 0.15;
/// Slower than this, m/s, a tyre has no slip angle.
const STILL_M_S: f64 = 0.1;

/// The contact points of an aircraft over its ground.
#[derive(Debug, Clone)]
pub struct Contacts {
    surface: Surface,
    points: Vec<ContactState>,
    /// Distance of the farthest point from the centre of gravity of the airframe file, m.
    reach_m: f64,
    sink_max_m_s: f64,
    bank_max_rad: f64,
    idle_n: Option<f64>,
    /// Holds the aircraft until it is launched.
    rail: Option<Rail>,
    /// Length of a step, s.
    step_s: f64,
    /// 0 to 1.
    brakes: f64,
    held: HeldForces,
    /// Whether any point bears a load in the step to come, and did in the last one.
    is_bearing: bool,
    was_bearing: bool,
    failure: Option<ContactFailure>,
}

/// A contact point with its state.
#[derive(Debug, Clone)]
struct ContactState {
    data: ContactPoint,
    steered_by: Option<(Effector, f64)>,
    grip_damper_n_s_m: f64,
    /// Of the spring along the ground: forward and to the right of the point.
    stretch_m: [f64; 2],
    /// Forces of the last step: across the ground, forward, to the right, N. The search begins with them.
    last_n: Vector3<f64>,
    now: Touch,
}

/// A point in the step to come.
#[derive(Debug, Clone, Copy)]
struct Touch {
    is_near: bool,
    /// Where the forces act, from the centre of gravity, m, body axes.
    at: Vector3<f64>,
    /// Columns: out of the ground, forward, to the right; body axes.
    axes: Matrix3<f64>,
    /// Depth of the point in the ground at the beginning of the step, m.
    depth_m: f64,
    /// Velocity in the middle of the step besides that of the centre of gravity and of the rotation, m/s.
    curving: Vector3<f64>,
    /// Change of the velocity in the middle of the step with each force, m/s per N.
    yielding: Vector3<f64>,
    /// Forces on the aircraft: across the ground, forward, to the right, N.
    force_n: Vector3<f64>,
    /// Forward and to the right, it slips.
    slips: [bool; 2],
}

/// Why the flight has ended on the ground.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum ContactFailure {
    Sink { m_s: f64, max_m_s: f64 },
    Bank { rad: f64, max_rad: f64 },
    Load { contact: Name, n: f64, max_n: f64 },
}

impl fmt::Display for ContactFailure {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Sink { m_s, max_m_s } => {
                write!(f, "touchdown at a rate of descent of {m_s:.1} m/s, limit {max_m_s} m/s")
            }
            Self::Bank { rad, max_rad } => {
                let [is, limit] = [rad, max_rad].map(|angle| angle.to_degrees());
                write!(f, "roll angle of {is:.1} deg on the ground, limit {limit:.1} deg")
            }
            Self::Load { contact, n, max_n } => {
                write!(f, "{contact}: load of {n:.0} N, limit {max_n} N")
            }
        }
    }
}

/// Motion of the body in the middle of the step, with the forces found so far.
struct Middle {
    velocity: Vector3<f64>,
    rates: Vector3<f64>,
    half_s: f64,
    mass: MassProperties,
}

impl Middle {
    fn of(&self, touch: &Touch) -> Vector3<f64> {
        self.velocity + self.rates.cross(&touch.at) + touch.curving
    }

    fn push(&mut self, at: &Vector3<f64>, force: &Vector3<f64>) {
        self.velocity += force * (self.half_s * self.mass.per_mass);
        self.rates += self.mass.inertia_inverse * at.cross(force) * self.half_s;
    }
}

/// 1/kg: change of the velocity of a point along a unit vector with an impulse along it; the inverse is its effective mass.
pub fn per_effective_mass(mass: &MassProperties, at: &Vector3<f64>, along: &Vector3<f64>) -> f64 {
    let arm = at.cross(along);
    mass.per_mass + arm.dot(&(mass.inertia_inverse * arm))
}

/// The same along the ground, in the direction in which the point is lightest.
pub fn per_effective_mass_along(mass: &MassProperties, at: &Vector3<f64>) -> f64 {
    per_effective_mass(mass, at, &Vector3::x()).max(per_effective_mass(mass, at, &Vector3::y()))
}

impl ContactState {
    fn new(data: ContactPoint, effectors: &EffectorList, mass: &MassProperties) -> Self {
        let steered_by = data.steering.and_then(|steering| {
            let by = effectors.all().find(|e| effectors.name(*e) == steering.effector.as_str())?;
            Some((by, steering.ratio))
        });
        let per_kg = per_effective_mass_along(mass, &data.at_m.into());
        let critical = 2.0 * (data.grip_spring_n_m / per_kg).sqrt();
        Self {
            data,
            steered_by,
            grip_damper_n_s_m: GRIP_DAMPING_RATIO * critical,
            stretch_m: [0.0; 2],
            last_n: Vector3::zeros(),
            now: Touch::AWAY,
        }
    }

    /// Force across the ground, N, where it would close at `closing` m/s in the middle of the step without this force.
    fn across(&self, closing: f64, step_s: f64) -> f64 {
        let ContactPoint { spring_n_m: k, damper_n_s_m: c, .. } = self.data;
        let Touch { depth_m, yielding, force_n, .. } = self.now;
        let next_m = depth_m + step_s * (closing - yielding.x * force_n.x);
        // The part of the way of this step that is in the ground, and the mean depth over it at rest and its change with the velocity.
        let (part, mean_m, per_velocity) = match (depth_m > 0.0, next_m > 0.0) {
            (true, true) => (1.0, depth_m, 0.5 * step_s),
            (true, false) => (depth_m / (depth_m - next_m), 0.5 * depth_m, 0.0),
            (false, true) => (next_m / (next_m - depth_m), 0.5 * depth_m, 0.5 * step_s),
            (false, false) => return 0.0,
        };
        let rate = part * (k * per_velocity + c);
        // The ground never pulls.
        ((part * k * mean_m + rate * closing) / (1.0 + rate * yielding.x)).max(0.0)
    }

    /// Forces forward and to the right, N, with the force across the ground, where the point would move so in the middle of the step
    /// without them; and which of them slips.
    fn along(&self, moving: [f64; 2], step_s: f64, brakes: f64, wet: f64) -> ([f64; 2], [bool; 2]) {
        let ContactPoint { grip_spring_n_m: k, friction, brake_friction, .. } = self.data;
        let rate = 0.5 * step_s * k + self.grip_damper_n_s_m;
        let yielding = [self.now.yielding.y, self.now.yielding.z];
        let stick =
            |i: usize| -(k * self.stretch_m[i] + rate * moving[i]) / (1.0 + rate * yielding[i]);
        let most = wet * friction * self.now.force_n.x;
        let rolling = self.data.rolling_friction.map_or(f64::INFINITY, |rolling| {
            (rolling + brakes * brake_friction) * self.now.force_n.x
        });
        let (forward, right) = (stick(0), stick(1));
        let rolls = forward.abs() > rolling;
        let forward = forward.max(-rolling).min(rolling);
        // A tyre needs a slip angle for its side force; standing still it holds with all the friction.
        let sideways = match self.data.is_wheel() {
            true => {
                (moving[1].abs() + STILL_M_S) / (SLIP_FULL_RAD * moving[0].abs()).max(STILL_M_S)
            }
            false => 1.0,
        };
        let side = most * sideways.min(1.0);
        let drifts = right.abs() > side;
        let right = right.max(-side).min(side);
        let size = (forward * forward + right * right).sqrt();
        if size <= most {
            return ([forward, right], [rolls, drifts]);
        }
        let scale = most / size;
        ([forward * scale, right * scale], [true, true])
    }

    /// Moves on by this displacement in the ground, m: forward and to the right.
    fn move_on(&mut self, moved: [f64; 2]) {
        let k = self.data.grip_spring_n_m;
        let force = [self.now.force_n.y, self.now.force_n.z];
        let before = self.stretch_m;
        for i in 0..2 {
            self.stretch_m[i] =
                if self.now.slips[i] { -force[i] / k } else { before[i] + moved[i] };
        }
        // The spring stores no more than it had and what the body has lost.
        let squared = |x: [f64; 2]| x[0] * x[0] + x[1] * x[1];
        let work = force[0] * moved[0] + force[1] * moved[1];
        let (most, is) = (squared(before) - 2.0 * work / k, squared(self.stretch_m));
        if is > most {
            let scale = (most.max(0.0) / is).sqrt();
            self.stretch_m = self.stretch_m.map(|stretch| scale * stretch);
        }
    }
}

impl Touch {
    const AWAY: Self = Self {
        is_near: false,
        at: Vector3::new(0.0, 0.0, 0.0),
        axes: Matrix3::new(0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0),
        depth_m: 0.0,
        curving: Vector3::new(0.0, 0.0, 0.0),
        yielding: Vector3::new(0.0, 0.0, 0.0),
        force_n: Vector3::new(0.0, 0.0, 0.0),
        slips: [false; 2],
    };
}

impl Contacts {
    /// Those of an airframe over a ground, for steps of this length, µs. None of them touches.
    pub fn new(gear: &Gear, setup: &GroundSetup, dynamics: &Dynamics, step_us: u32) -> Self {
        let effectors = &dynamics.airframe().effectors;
        let point = |data: &ContactPoint| ContactState::new(*data, effectors, dynamics.mass());
        let distance = |data: &ContactPoint| Vector3::from(data.at_m).norm();
        Self {
            surface: Surface::new(setup, dynamics.earth()),
            points: gear.contacts.iter().map(point).collect(),
            reach_m: gear.contacts.iter().map(distance).fold(0.0, f64::max),
            sink_max_m_s: gear.sink_max_m_s,
            bank_max_rad: gear.bank_max_rad,
            idle_n: gear.idle_n,
            rail: None,
            step_s: f64::from(step_us) * 1.0e-6,
            brakes: 0.0,
            held: HeldForces::default(),
            is_bearing: false,
            was_bearing: false,
            failure: None,
        }
    }

    /// The aircraft may stand with this roll angle.
    pub fn check_roll(&self, roll_deg: f64) -> Result<(), Problem> {
        let most_deg = self.bank_max_rad.to_degrees();
        if roll_deg.abs() <= most_deg {
            return Ok(());
        }
        Err(problem!(
            "[{SECTION}] start: the aircraft falls over and rests with a roll angle of {roll_deg:.0} deg, bank_max_deg is {most_deg:.0}; \
             check wind and [gear]"
        ))
    }

    /// Sets the brakes, 0 to 1.
    pub fn set_brakes(&mut self, brakes: f64) {
        if brakes.is_finite() {
            self.brakes = brakes.clamp(0.0, 1.0);
        }
    }

    /// Holds the aircraft here, until a catapult accelerates it to a speed at the end of its rail.
    pub fn hold_on_rail(&mut self, at: &RigidState, speed_m_s: f64, rail_m: f64, mass_kg: f64) {
        let weight_n = mass_kg * STANDARD_GRAVITY_M_S2;
        self.rail = Some(Rail::new(at, speed_m_s, rail_m, weight_n));
    }

    /// Thrust of the engine at ground idle, N, while anything touches and the engine has one.
    pub fn idle_n(&self) -> Option<f64> {
        self.idle_n.filter(|_| self.is_bearing)
    }

    /// Load of all points across the ground, N; on the rail that of the aircraft.
    pub fn load_n(&self) -> f64 {
        self.rail.as_ref().map_or_else(|| self.loads_n().sum(), Rail::load_n)
    }

    /// The forces of the step to come; `None` if no point touches the ground.
    pub fn held(&self) -> Option<&HeldForces> {
        self.is_bearing.then_some(&self.held)
    }

    /// Whether wheels or skids bear a load.
    pub fn is_bearing(&self) -> bool {
        self.is_bearing
    }

    /// Loads across the ground, N, in the order of the airframe file.
    pub fn loads_n(&self) -> impl Iterator<Item = f64> {
        self.points.iter().map(|point| point.now.force_n.x)
    }

    /// Length of a step, s.
    pub fn step_s(&self) -> f64 {
        self.step_s
    }

    /// Distance of the farthest point from the centre of gravity of the airframe file, m.
    pub fn reach_m(&self) -> f64 {
        self.reach_m
    }

    /// The point that is deepest in the ground and how deep, m; negative above it.
    pub fn deepest(&self, dynamics: &Dynamics, rigid: &RigidState) -> (Name, f64) {
        let deeper = |a: (Name, f64), b: (Name, f64)| if b.1 > a.1 { b } else { a };
        let names = self.points.iter().map(|point| point.data.name);
        let all = names.zip(self.depths_m(dynamics, rigid));
        all.fold((Name::new_const(), f64::NEG_INFINITY), deeper)
    }

    /// Depths of all points in the ground, m.
    fn depths_m(&self, dynamics: &Dynamics, rigid: &RigidState) -> impl Iterator<Item = f64> {
        let under = self.under(&rigid.position, &dynamics.earth().place(&rigid.position));
        let up = rigid.e_from_body().tr_mul(&under.up);
        let shift_m = dynamics.shift_m();
        let depth = move |at_m: Vector3<f64>| -under.height_m - up.dot(&(at_m - shift_m));
        self.points.iter().map(move |point| depth(point.data.at_m.into()))
    }

    /// A new flight begins.
    pub fn forget_failure(&mut self) {
        self.failure = None;
    }

    /// The first limit that was passed.
    pub fn failure(&self) -> Option<ContactFailure> {
        self.failure
    }

    /// The ground under a position, m, frame E, where the Earth is `place`.
    pub fn under(&self, position: &Vector3<f64>, place: &Place) -> Under {
        self.surface.under(position, place)
    }

    /// How far a position is along the runway from its threshold and to the right of its centre line, m.
    pub fn on_runway_m(&self, position: &Vector3<f64>, place: &Place) -> (f64, f64) {
        self.surface.on_runway_m(position, place)
    }

    /// Energy in the springs at a state, J.
    pub fn stored_j(&self, dynamics: &Dynamics, rigid: &RigidState) -> f64 {
        let of = |(point, depth_m): (&ContactState, f64)| {
            let ([x, y], depth_m) = (point.stretch_m, depth_m.max(0.0));
            0.5 * (point.data.spring_n_m * depth_m * depth_m
                + point.data.grip_spring_n_m * (x * x + y * y))
        };
        self.points.iter().zip(self.depths_m(dynamics, rigid)).map(of).sum()
    }

    /// Finds the forces of the step that begins at this state, whose evaluation has none yet, and adds them to it. `positions` are
    /// those of the effectors.
    pub fn solve(
        &mut self,
        dynamics: &Dynamics,
        rigid: &RigidState,
        positions: &PerEffector<f64>,
        e: &mut Evaluation,
    ) {
        let under = self.under(&rigid.position, &e.place);
        let turning = rigid.rates.0 - dynamics.earth().rotation_in(&e.motion.e_from_body).0;
        let shift_m = dynamics.shift_m();
        let reach_m = self.reach_m + shift_m.norm();
        let way_m = self.step_s * (rigid.velocity.0.norm() + turning.norm() * reach_m);
        self.is_bearing = false;
        if let Some(rail) = &mut self.rail {
            match rail.solve(dynamics, rigid, &turning, e, self.step_s) {
                Some(held) => {
                    (self.held, self.is_bearing) = (held, true);
                    dynamics.support(e, &self.held);
                    return;
                }
                None => self.rail = None,
            }
        }
        if under.height_m > reach_m + way_m {
            for point in &mut self.points {
                point.now = Touch::AWAY;
            }
            return;
        }
        let up = e.motion.e_from_body.tr_mul(&under.up);
        let half_s = 0.5 * self.step_s;
        let free = &e.motion.derivative;
        let mut middle = Middle {
            velocity: rigid.velocity.0
                + (free.velocity.0 + turning.cross(&rigid.velocity.0)) * half_s,
            rates: turning + free.rates.0 * half_s,
            half_s,
            mass: *dynamics.mass(),
        };
        for point in &mut self.points {
            let place = Vector3::from(point.data.at_m) - shift_m;
            let depth_m = -under.height_m - up.dot(&place);
            // A wheel whose strut has given in still touches at the ground.
            let at = place + up * depth_m.max(0.0);
            let curving = turning.cross(&turning.cross(&at)) * half_s;
            let mut touch = Touch { at, curving, depth_m, ..Touch::AWAY };
            touch.is_near = touch.depth_m > 0.0
                || touch.depth_m - self.step_s * up.dot(&middle.of(&touch)) > 0.0;
            if touch.is_near {
                let angle = point.steered_by.map_or(0.0, |(by, ratio)| ratio * positions[by]);
                touch.axes = axes(&up, angle);
                for i in 0..3 {
                    let along = touch.axes.column(i).into_owned();
                    touch.yielding[i] = half_s * per_effective_mass(&middle.mass, &at, &along);
                }
                touch.force_n = point.last_n;
                middle.push(&at, &(touch.axes * touch.force_n));
            }
            point.now = touch;
        }
        self.sweep(&mut middle);
        self.hold(&e.motion.e_from_body);
        dynamics.support(e, &self.held);
        self.watch(&up, rigid);
    }

    /// Gauss and Seidel's sweeps over the points until the forces of the middle of the step are found.
    fn sweep(&mut self, middle: &mut Middle) {
        let (step_s, brakes, wet) = (self.step_s, self.brakes, self.surface.friction);
        for _ in 0..SWEEPS_MAX {
            let (mut change, mut size) = (0.0, 0.0);
            for point in self.points.iter_mut().filter(|point| point.now.is_near) {
                let before = point.now.force_n;
                let moving = point.now.axes.tr_mul(&middle.of(&point.now))
                    - point.now.yielding.component_mul(&before);
                point.now.force_n.x = point.across(-moving.x, step_s);
                let (along, slips) = point.along([moving.y, moving.z], step_s, brakes, wet);
                [point.now.force_n.y, point.now.force_n.z] = along;
                point.now.slips = slips;
                let more = point.now.force_n - before;
                middle.push(&point.now.at, &(point.now.axes * more));
                change += more.abs().sum();
                size += point.now.force_n.x;
            }
            if change <= CHANGE_MAX * size + CHANGE_MAX_N {
                break;
            }
        }
    }

    /// Keeps the forces for the step.
    fn hold(&mut self, e_from_body: &Matrix3<f64>) {
        self.held = HeldForces::default();
        for Touch { at, axes, force_n, .. } in self.points.iter().map(|point| point.now) {
            if force_n.x > 0.0 {
                self.is_bearing = true;
                self.held.add(&at, &(e_from_body * (axes * force_n)));
            }
        }
    }

    /// Notes the first limit that is passed.
    fn watch(&mut self, up: &Vector3<f64>, rigid: &RigidState) {
        if !self.is_bearing || self.failure.is_some() {
            return;
        }
        let sink_m_s = -up.dot(&rigid.velocity.0);
        let rad = libm::atan2(-up.y, -up.z);
        let too_much = |point: &&ContactState| point.now.force_n.x > point.data.load_max_n;
        self.failure = if !self.was_bearing && sink_m_s > self.sink_max_m_s {
            Some(ContactFailure::Sink { m_s: sink_m_s, max_m_s: self.sink_max_m_s })
        } else if let Some(point) = self.points.iter().find(too_much) {
            let ContactPoint { name: contact, load_max_n: max_n, .. } = point.data;
            Some(ContactFailure::Load { contact, n: point.now.force_n.x, max_n })
        } else if rad.abs() > self.bank_max_rad {
            Some(ContactFailure::Bank { rad, max_rad: self.bank_max_rad })
        } else {
            None
        };
    }

    /// Moves the springs along the ground on by the step that has been made.
    pub fn finish_step(&mut self, before: &RigidState, after: &RigidState) {
        self.was_bearing = self.is_bearing;
        let [e_from_body, e_from_body_after] = [before, after].map(RigidState::e_from_body);
        for point in &mut self.points {
            point.last_n = point.now.force_n;
            if point.now.force_n.x <= 0.0 {
                point.stretch_m = [0.0; 2];
                continue;
            }
            let at = &point.now.at;
            let moved = (after.position - before.position) + (e_from_body_after - e_from_body) * at;
            let moved = point.now.axes.tr_mul(&e_from_body.tr_mul(&moved));
            point.move_on([moved.y, moved.z]);
        }
    }
}

/// Out of the ground, forward and to the right of a wheel that is turned to the right by an angle, rad; body axes.
fn axes(up: &Vector3<f64>, angle: f64) -> Matrix3<f64> {
    // A point that is not steered, the usual case, needs no trigonometry.
    let ahead = match angle == 0.0 {
        true => Vector3::x(),
        false => Vector3::new(libm::cos(angle), libm::sin(angle), 0.0),
    };
    // With the nose straight down or up, the belly looks forward.
    let ahead = if ahead.dot(up).abs() > 0.999 { Vector3::z() } else { ahead };
    let forward = (ahead - up * up.dot(&ahead)).normalize();
    Matrix3::from_columns(&[*up, forward, forward.cross(up)])
}

#[cfg(test)]
mod tests;
