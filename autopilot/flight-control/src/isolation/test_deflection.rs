//! Small deflections of two effectors that look alike, such that healthy ones cancel each other.

use icd::{Effector, PerEffector};
use nalgebra::Vector3;

use crate::design_model::{DesignModel, FlightCondition};

/// Columns whose directions agree to this look alike: the square of the cosine between them.
const ALIKE: f64 = 0.98;
/// Duration of one test, s.
const TEST_S: f64 = 0.8;
/// Pause after it, s: the estimate has to answer.
const PAUSE_S: f64 = 0.6;
/// Most tests until the detector has slept again.
const TESTS_MAX: u32 = 6;
/// No test before the fault has been awake this long, us.
const AFTER_US: u32 = 600_000;
/// No test begins with a body rate above this, rad/s.
const RATE_MAX_RAD_S: f64 = 0.2;

/// State of the tests.
#[derive(Debug, Clone, Default)]
pub struct TestDeflection {
    proposed: Option<[Effector; 2]>,
    running: Option<RunningTest>,
    /// Time until the next one may begin, s.
    pause_s: f64,
    tests: u32,
}

#[derive(Debug, Clone, Copy)]
struct RunningTest {
    effectors: [Effector; 2],
    /// Largest deflection of each, rad.
    size_rad: [f64; 2],
    since_s: f64,
    now_rad: f64,
}

impl TestDeflection {
    /// Two hypotheses that cannot be distinguished: both of one effector each.
    pub fn propose(
        &mut self,
        best: [Option<Effector>; 2],
        rival: [Option<Effector>; 2],
        awake_us: u32,
    ) {
        self.proposed = match (best, rival) {
            ([Some(one), None], [Some(other), None]) if awake_us >= AFTER_US => Some([one, other]),
            _ => None,
        };
    }

    /// Deflection of the first effector under test, rad.
    pub fn now_rad(&self) -> f64 {
        self.running.map_or(0.0, |running| running.now_rad)
    }

    /// What is added to the commands, rad. A test begins only where both effectors have the travel for it, the columns
    /// are parallel, and the aircraft is calm.
    pub fn step(
        &mut self,
        commands: &PerEffector<f64>,
        rates: &Vector3<f64>,
        model: &DesignModel,
        at: &FlightCondition,
        size_rad: f64,
        h: f64,
    ) -> PerEffector<f64> {
        let mut added = PerEffector::default();
        self.pause_s = (self.pause_s - h).max(0.0);
        if self.running.is_none() && self.pause_s == 0.0 && self.tests < TESTS_MAX {
            // Taken even if it cannot begin: the next look proposes it again.
            let begins = self.proposed.take().filter(|_| rates.amax() < RATE_MAX_RAD_S);
            self.running = begins.and_then(|effectors| {
                let size_rad = sizes(effectors, commands, model, at, size_rad)?;
                Some(RunningTest { effectors, size_rad, since_s: 0.0, now_rad: 0.0 })
            });
        }
        let Some(running) = &mut self.running else { return added };
        running.since_s += h;
        if running.since_s >= TEST_S {
            self.running = None;
            self.tests += 1;
            self.pause_s = PAUSE_S;
            return added;
        }
        // Its square begins and ends without a step, in angle and in rate.
        let sine = libm::sin(core::f64::consts::PI * running.since_s / TEST_S);
        for (effector, size_rad) in running.effectors.into_iter().zip(running.size_rad) {
            added[effector] = size_rad * sine * sine;
        }
        running.now_rad = added[running.effectors[0]];
        added
    }
}

/// Deflections of the two that cancel each other if both are healthy; `None` where they would not, or leave the travel.
fn sizes(
    [one, other]: [Effector; 2],
    commands: &PerEffector<f64>,
    model: &DesignModel,
    at: &FlightCondition,
    size_rad: f64,
) -> Option<[f64; 2]> {
    let (b_one, b_other) = (model.effect(at, one), model.effect(at, other));
    let (square_one, square_other) = (b_one.norm_squared(), b_other.norm_squared());
    let product = b_one.dot(&b_other);
    if product * product <= ALIKE * square_one * square_other {
        return None;
    }
    // d_one B_one + d_other B_other = 0, the larger of the two as asked for.
    let ratio = -product / square_other;
    let scale = size_rad / ratio.abs().max(1.0);
    let fits = |effector: Effector, size: f64| {
        let servo = &model.aircraft().effectors.servos[effector];
        (servo.min..=servo.max).contains(&(commands[effector] + size))
    };
    // Either way round.
    [scale, -scale]
        .map(|size| [size, size * ratio])
        .into_iter()
        .find(|size| fits(one, size[0]) && fits(other, size[1]))
}
