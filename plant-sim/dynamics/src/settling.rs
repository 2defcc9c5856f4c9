//! The start at rest on the ground: the aircraft settles on its gear before time zero.

use host_io::problem::{Problem, problem};
use icd::{Attitude, Body, EulerAngles, Ned, PerEffector};

use crate::contact::Contacts;
use crate::dynamics::{Dynamics, State, StepInputs};
use crate::earth::Slopes;
use crate::faults::Effects;
use crate::geodesy::Geodetic;
use crate::ground::{GroundSetup, GroundStart, SECTION};
use crate::rigid_body::RigidState;
use crate::start::Start;
use crate::trim::Trim;
use crate::wind::Gust;

/// Longest time to settle, s; the aircraft needs a few.
const SETTLE_MAX_S: f64 = 60.0;
/// The aircraft is at rest when it moves by less than this in every step of a second, m: positions from the centre of the Earth are
/// rounded to 1e-9 m, which shakes the springs a few times as far.
const REST_M: f64 = 1.0e-8;
/// Damping of every motion while it settles, 1/s: about critical for the usual gear.
const DAMPING_PER_S: f64 = 10.0;

/// Settles an aircraft at a place and a heading, its effectors held; `state` has them, and gets the body at rest.
fn settle(
    dynamics: &Dynamics,
    contacts: &mut Contacts,
    setup: &GroundSetup,
    start: &Start,
    inputs: &StepInputs,
    state: &mut State,
) -> Result<(), Problem> {
    let earth = dynamics.earth();
    contacts.set_brakes(1.0);
    let mut here = start.geodetic();
    let level = Attitude::from_euler(EulerAngles { phi: 0.0, theta: 0.0, psi: setup.heading_rad });
    state.rigid.q_e_from_body = earth.q_e_from_body(&here, &level);
    let e_from_body = state.rigid.e_from_body();
    state.rigid.velocity = Body::zero();
    state.rigid.rates = earth.rotation_in(&e_from_body);
    state.rigid.position = earth.position(&here);
    // The lowest point just touches.
    here.altitude_m += contacts.deepest(dynamics, &state.rigid).1;
    state.rigid.position = earth.position(&here);
    let step_s = contacts.step_s();
    let keep = 1.0 / (1.0 + DAMPING_PER_S * step_s);
    let (mut rest_s, mut speed_m_s) = (0.0, 0.0);
    // Bounded: each turn takes a step.
    for _ in 0..(SETTLE_MAX_S / step_s) as u64 {
        let mut present = dynamics.present(state, inputs);
        contacts.solve(dynamics, &state.rigid, &state.positions, &mut present);
        let (mut rates, before) = (Default::default(), state.rigid);
        let held = contacts.held().copied().unwrap_or_default();
        *state = dynamics.step_on_ground(state, &mut rates, &present, inputs, step_s, &held);
        contacts.finish_step(&before, &state.rigid);
        let rigid = &mut state.rigid;
        let earth_rate = earth.rotation_in(&rigid.e_from_body());
        let turning = rigid.rates.0 - earth_rate.0;
        rigid.velocity.0 *= keep;
        rigid.rates.0 = earth_rate.0 + turning * keep;
        speed_m_s = rigid.velocity.0.norm() + turning.norm() * contacts.reach_m();
        if !speed_m_s.is_finite() {
            break;
        }
        rest_s = if speed_m_s * step_s < REST_M { rest_s + step_s } else { 0.0 };
        if rest_s > 1.0 {
            break;
        }
    }
    let place = earth.place(&state.rigid.position);
    let roll_deg = earth.attitude(&place, &state.rigid.q_e_from_body).euler().phi.to_degrees();
    if rest_s > 1.0 {
        contacts.forget_failure();
        return contacts.check_roll(roll_deg);
    }
    let way_m = earth.local_position(&state.rigid.position).0.xy().norm();
    Err(problem!(
        "[{SECTION}] start: the aircraft does not come to rest on its gear in {SETTLE_MAX_S} s: it still moves at {speed_m_s:.3e} m/s, \
         has rolled to {roll_deg:.1} deg and moved by {way_m:.2} m; check friction = {}, wind, thrust and [gear]",
        setup.friction
    ))
}

/// The flight that begins on the runway, surfaces at zero, the engine at idle; `None` if it begins in steady flight.
pub fn on_runway(
    dynamics: &Dynamics,
    contacts: &mut Contacts,
    setup: &GroundSetup,
    start: &Start,
    steady: Ned,
) -> Result<Option<Trim>, Problem> {
    if setup.start == GroundStart::Air {
        return Ok(None);
    }
    let earth = dynamics.earth();
    let position = earth.position(&start.geodetic());
    let place = earth.place(&position);
    let density = dynamics.density_around(place.geopotential_altitude_m);
    let mut positions = PerEffector::default();
    if let Some(engine) = dynamics.jet().engine() {
        let altitude_m = place.geopotential_altitude_m;
        let [idle_n, _] = dynamics.thrust_range_n(0.0, density.at(altitude_m), altitude_m);
        positions[engine] = idle_n.max(0.0);
    }
    let q_e_from_body = earth.q_e_from_body(&start.geodetic(), &Attitude::identity());
    let still = RigidState { position, q_e_from_body, velocity: Body::zero(), rates: Body::zero() };
    let mut state = State { rigid: still, positions };
    let inputs = StepInputs {
        commands: positions,
        wind: steady,
        gust: Gust::none(),
        density,
        slopes: Slopes::at(earth, &position, &place),
        effects: Effects::none(),
    };
    match &setup.start {
        GroundStart::Launched(launch) | GroundStart::Catapult { launch, .. } => {
            let here =
                Geodetic { altitude_m: start.altitude_m + launch.height_m, ..start.geodetic() };
            let attitude =
                EulerAngles { phi: 0.0, theta: launch.pitch_rad, psi: start.heading_rad };
            let rigid = &mut state.rigid;
            rigid.position = earth.position(&here);
            rigid.q_e_from_body = earth.q_e_from_body(&here, &Attitude::from_euler(attitude));
            rigid.rates = earth.rotation_in(&rigid.e_from_body());
            if let GroundStart::Catapult { rail_m, .. } = setup.start {
                let mass_kg = 1.0 / dynamics.mass().per_mass;
                contacts.hold_on_rail(rigid, launch.speed_m_s, rail_m, mass_kg);
            } else {
                rigid.velocity = Body::new(launch.speed_m_s, 0.0, 0.0);
            }
        }
        _ => settle(dynamics, contacts, setup, start, &inputs, &mut state)?,
    }
    let place = earth.place(&state.rigid.position);
    let present = dynamics.present(&state, &inputs);
    Ok(Some(Trim {
        alpha_rad: present.motion.air.alpha_rad,
        theta_rad: earth.attitude(&place, &state.rigid.q_e_from_body).euler().theta,
        elevator_rad: 0.0,
        aileron_rad: 0.0,
        rudder_rad: 0.0,
        thrust_n: present.motion.thrust_n,
        positions,
        turn_rate_rad_s: 0.0,
        beta_rad: present.motion.air.beta_rad,
        rigid: state.rigid,
    }))
}

/// Refuses a start with a contact point in the ground.
pub fn check_clear(
    dynamics: &Dynamics,
    contacts: &Contacts,
    setup: &GroundSetup,
    rigid: &RigidState,
) -> Result<(), Problem> {
    let (name, depth_m) = contacts.deepest(dynamics, rigid);
    let altitude_m = dynamics.earth().place(&rigid.position).altitude_m;
    let (key, is_m) = match &setup.start {
        GroundStart::Parked { .. } | GroundStart::Ready { .. } => return Ok(()),
        GroundStart::Launched(launch) | GroundStart::Catapult { launch, .. } => {
            ("[plant.ground] height_m", launch.height_m)
        }
        GroundStart::Air => ("[plant.start] altitude_m", altitude_m),
    };
    if depth_m <= 0.0 {
        return Ok(());
    }
    let least_m = is_m + depth_m;
    Err(problem!(
        "{key} = {is_m} puts the {name} {depth_m:.3} m into the ground; at least {least_m:.3} is possible there"
    ))
}
