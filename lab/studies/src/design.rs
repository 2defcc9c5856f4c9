//! Designs the gains of the linear quadratic regulator from the controller's model: `sitl aircraft design lqr`.
//!
//! The model is linearised at its design point, discretised with a hold over the control period, and the discrete
//! Riccati equation is solved by doubling (E. K.-W. Chu, H.-Y. Fan, W.-W. Lin, C.-S. Wang, "Structure-preserving
//! algorithms for periodic discrete-time algebraic Riccati equations", Int. J. Control 77(8), 2004). Servos and the
//! engine's lag are not in the design model, which is why the gains are modest.

use host_io::print_line;
use std::error::Error;
use std::path::PathBuf;

use aircraft::{DEFAULT_NAME, MODELS};
use autopilot::config;
use flight_control::gains;
use flight_control::main_controller::lqr::{LateralRow, LongitudinalRow, LqrGains};
use flight_control::{AircraftModel, DesignModel, Gains, NavigationState};
use host_io::file;
use icd::ControlPeriod;
use icd::units::STANDARD_GRAVITY_M_S2 as G_M_S2;
use nalgebra::{SMatrix, SVector, Vector3};

use host_io::problem::{Problem, problem};

/// By this line a file of gains is recognised as one of this program, which it may write over.
pub const MARK: &str = "# Written by `sitl aircraft design lqr`";

/// Largest values that are acceptable (Bryson's rule: Q = diag(1/x²), R = diag(1/u²)).
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Weights {
    /// Climb rate, airspeed, pitch angle, pitch rate, altitude, and the integrals of altitude and airspeed error.
    pub longitudinal_states: [f64; 7],
    /// Elevator, thrust per mass.
    pub longitudinal_inputs: [f64; 2],
    /// Sideslip, roll rate, yaw rate, roll angle, its integral.
    pub lateral_states: [f64; 5],
    /// Aileron, rudder.
    pub lateral_inputs: [f64; 2],
    /// Largest altitude error that the regulator sees, m.
    pub error_max_m: f64,
}

impl Weights {
    /// Those of `sitl aircraft design lqr`, chosen for the paper's jet: climb rate 25 m/s, airspeed 5 m/s, pitch angle 0.1 rad, pitch
    /// rate 0.1 rad/s, altitude 60 m, its integral 1000 m s, integral of airspeed 75 m; elevator 0.1 rad, thrust per mass 1.5 m/s²;
    /// sideslip 0.2 rad, roll rate 0.5 rad/s, yaw rate 0.2 rad/s, roll angle 0.15 rad, its integral 10 rad s; aileron 0.2 rad,
    /// rudder 0.1 rad.
    pub const JET: Self = Self {
        longitudinal_states: [25.0, 5.0, 0.1, 0.1, 60.0, 1_000.0, 75.0],
        longitudinal_inputs: [0.1, 1.5],
        lateral_states: [0.2, 0.5, 0.2, 0.15, 10.0],
        lateral_inputs: [0.2, 0.1],
        error_max_m: Gains::REFERENCE.lqr.error_max_m,
    };
}

/// Half width of the differences.
const DIFFERENCE: f64 = 1.0e-4;
/// Doublings of the Riccati equation's horizon: 2^40 control periods.
const DOUBLINGS_MAX: u32 = 40;
/// Digits that are kept.
const DIGITS: usize = 6;

/// Options of `sitl aircraft design lqr`.
#[derive(Debug, clap::Args)]
pub struct DesignArgs {
    #[arg(
        long,
        value_name = "NAME|FILE",
        default_value = DEFAULT_NAME,
        help = format!("The controller's model: {}, or a file", file::names(MODELS))
    )]
    model: PathBuf,
    /// Where the gains go; `--gains FILE` flies them
    #[arg(long, value_name = "FILE")]
    out: PathBuf,
}

/// Designs and writes a file of gains.
pub fn run(args: &DesignArgs) -> Result<(), Box<dyn Error>> {
    let aircraft = config::named_model(&args.model)?.aircraft;
    let text = to_toml(&design(&aircraft, ControlPeriod::DEFAULT, &Weights::JET)?);
    file::write(&args.out, text.as_bytes(), MARK.as_bytes())
        .map_err(|problem| format!("--out {}: {problem}", args.out.display()))?;
    print_line!("wrote {}; fly it with --gains {0} --law lqr", args.out.display());
    if !aircraft.aircraft.starts_with(DEFAULT_NAME) {
        print_line!(
            "Its weights are those of {DEFAULT_NAME}; `sitl aircraft new` scales them to the aircraft."
        );
    }
    Ok(())
}

fn no_solution(motion: &str) -> Problem {
    problem!("the discrete Riccati equation of the {motion} motion has no solution with this model")
}

/// The gains for this model with these weights.
pub fn design(
    aircraft: &AircraftModel,
    period: ControlPeriod,
    weights: &Weights,
) -> Result<LqrGains, Problem> {
    let model = DesignModel::new(*aircraft);
    let h = period.as_seconds();
    let system = discretise(&longitudinal(&model), h);
    let k = regulator(&system, &weights.longitudinal_states, &weights.longitudinal_inputs)
        .ok_or_else(|| no_solution("longitudinal"))?;
    let row = |i: usize| LongitudinalRow {
        climb: k[(i, 0)],
        airspeed: k[(i, 1)],
        theta: k[(i, 2)],
        q: k[(i, 3)],
        altitude: k[(i, 4)],
        altitude_i: k[(i, 5)],
        airspeed_i: k[(i, 6)],
    };
    let (elevator, thrust) = (row(0), row(1));
    let system = discretise(&lateral(&model), h);
    let k = regulator(&system, &weights.lateral_states, &weights.lateral_inputs)
        .ok_or_else(|| no_solution("lateral"))?;
    let row = |i: usize| LateralRow {
        beta: k[(i, 0)],
        p: k[(i, 1)],
        r: k[(i, 2)],
        phi: k[(i, 3)],
        phi_i: k[(i, 4)],
    };
    let (aileron, rudder) = (row(0), row(1));
    let error_max_m = weights.error_max_m;
    let mut gains = Gains {
        lqr: LqrGains { elevator, thrust, aileron, rudder, error_max_m },
        ..Gains::REFERENCE
    };
    // As the file will have them, so that what is designed is what flies.
    for tunable in gains::LQR {
        let value = rounded((tunable.get)(&gains));
        (tunable.set)(&mut gains, value);
    }
    Ok(gains.lqr)
}

/// Gains of the PID's altitude law on climb rate, pitch angle, pitch rate, altitude and its integral, and of its roll law on roll
/// rate, roll angle and its integral: regulators of the same motions with one command each.
pub(crate) fn pid(
    model: &DesignModel,
    period: ControlPeriod,
    weights: &Weights,
) -> Result<([f64; 5], [f64; 3]), Problem> {
    let (h, all) = (period.as_seconds(), weights.longitudinal_states);
    // Without airspeed and its integral, and without thrust.
    let kept = [0, 2, 3, 4, 5];
    let (a, b) = longitudinal(model);
    let a = Square::<5>::from_fn(|i, j| a[(kept[i], kept[j])]);
    let b = SMatrix::<f64, 5, 1>::from_fn(|i, _| b[(kept[i], 0)]);
    let [elevator, _] = weights.longitudinal_inputs;
    let altitude = regulator(&discretise(&(a, b), h), &kept.map(|i| all[i]), &[elevator])
        .ok_or_else(|| no_solution("longitudinal"))?;
    let (all, kept) = (weights.lateral_states, [1, 3, 4]);
    let (a, b) = lateral(model);
    let a = Square::<3>::from_fn(|i, j| a[(kept[i], kept[j])]);
    let b = SMatrix::<f64, 3, 1>::from_fn(|i, _| b[(kept[i], 0)]);
    let [aileron, _] = weights.lateral_inputs;
    let roll = regulator(&discretise(&(a, b), h), &kept.map(|i| all[i]), &[aileron])
        .ok_or_else(|| no_solution("lateral"))?;
    // u = -K x.
    Ok((std::array::from_fn(|i| -altitude[i]), std::array::from_fn(|i| -roll[i])))
}

/// The gains as the file that `--gains` reads.
pub fn to_toml(gains: &LqrGains) -> String {
    let all = Gains { lqr: *gains, ..Gains::REFERENCE };
    let mut text = format!(
        "# Gains of the linear quadratic regulator for one model file; fly them with --gains FILE --law lqr.\n\
         {MARK}; do not edit.\n\n"
    );
    for tunable in gains::LQR {
        text += &format!("{} = {:?}\n", tunable.name, (tunable.get)(&all));
    }
    text
}

fn rounded(value: f64) -> f64 {
    format!("{value:.*e}", DIGITS - 1).parse().unwrap_or(value)
}

/// Terms of the series of the matrix exponential: A h is below 0.1.
const TERMS: u32 = 12;

/// A square matrix.
type Square<const N: usize> = SMatrix<f64, N, N>;
/// A and B of ẋ = A x + B u, or of x(k+1) = A x(k) + B u(k).
type System<const N: usize, const M: usize> = (Square<N>, SMatrix<f64, N, M>);

/// Slope of the model's angular acceleration along a change of the state.
pub(crate) fn slope(
    model: &DesignModel,
    change: impl Fn(&mut NavigationState, f64),
) -> Vector3<f64> {
    let at = |d: f64| {
        let mut state = *model.design_point();
        change(&mut state, d);
        model.bare_airframe(&state, &model.condition(model.design_point()))
    };
    (at(DIFFERENCE) - at(-DIFFERENCE)) / (2.0 * DIFFERENCE)
}

/// Angular acceleration per rad of a command of the main controller.
pub(crate) fn per_command(
    model: &DesignModel,
    of: impl Fn(&mut flight_control::MainCommand, f64),
) -> Vector3<f64> {
    let at = model.condition(model.design_point());
    let mut command = flight_control::MainCommand::default();
    of(&mut command, DIFFERENCE);
    let mixer = flight_control::mixer::Mixer::new(&model.aircraft().effectors);
    let positions = mixer.mix_main_only(&command);
    model.surfaces(&at, &positions) / DIFFERENCE
}

/// States climb rate, airspeed, pitch angle, pitch rate, altitude and the integrals of altitude and airspeed error;
/// inputs elevator and thrust per mass. The model file has no drag: the airspeed changes by thrust and climb.
fn longitudinal(model: &DesignModel) -> System<7, 2> {
    let aircraft = model.aircraft();
    let (at, v) = (model.condition(model.design_point()), aircraft.trim.airspeed_m_s);
    let q_s = at.q_s_c / aircraft.geometry.chord_m;
    let weight = aircraft.mass.mass_kg * G_M_S2;
    let (lift, effectors) = (&aircraft.lift, &aircraft.effectors);
    let c_lift_elevator = effectors.per_command(&effectors.c_lift, |gains| gains.pitch);
    // Vertical acceleration per angle of attack, pitch rate, elevator and airspeed.
    // The thrust turns with the nose and adds to the slope of the lift.
    let g_n_alpha = G_M_S2 * (q_s * lift.c_lift_alpha + aircraft.trim.thrust_n) / weight;
    let g_n_q = G_M_S2 * q_s * lift.c_lift_q * at.chord_time / weight;
    let g_n_e = G_M_S2 * q_s * c_lift_elevator / weight;
    // The lift grows with the square of the airspeed.
    let g_n_v = 2.0 * G_M_S2 / v;
    let m_alpha = slope(model, |state, d| state.alpha += d).y;
    let m_q = slope(model, |state, d| state.rates.y += d).y;
    let m_e = per_command(model, |command, d| command.elevator_rad = d).y;
    #[rustfmt::skip]
    let a = Square::<7>::from_row_slice(&[
        -g_n_alpha / v,   g_n_v, g_n_alpha, g_n_q, 0.0, 0.0, 0.0,
        -G_M_S2 / v,       0.0,  0.0,       0.0,   0.0, 0.0, 0.0,
        0.0,               0.0,  0.0,       1.0,   0.0, 0.0, 0.0,
        -m_alpha / v,      0.0,  m_alpha,   m_q,   0.0, 0.0, 0.0,
        1.0,               0.0,  0.0,       0.0,   0.0, 0.0, 0.0,
        0.0,               0.0,  0.0,       0.0,   1.0, 0.0, 0.0,
        0.0,               1.0,  0.0,       0.0,   0.0, 0.0, 0.0,
    ]);
    let mut b = SMatrix::zeros();
    (b[(0, 0)], b[(3, 0)], b[(1, 1)]) = (g_n_e, m_e, 1.0);
    (a, b)
}

/// States sideslip, roll rate, yaw rate, roll angle and its integral; inputs aileron and rudder. The model file has
/// no side force.
fn lateral(model: &DesignModel) -> System<5, 2> {
    let trim = &model.aircraft().trim;
    let (alpha, v) = (trim.theta_rad, trim.airspeed_m_s);
    let beta = slope(model, |state, d| state.beta += d);
    let p = slope(model, |state, d| state.rates.x += d);
    let r = slope(model, |state, d| state.rates.z += d);
    let a_c = per_command(model, |command, d| command.aileron_rad = d);
    let r_c = per_command(model, |command, d| command.rudder_rad = d);
    #[rustfmt::skip]
    let a = Square::<5>::from_row_slice(&[
        0.0,    alpha, -1.0, G_M_S2 / v,       0.0,
        beta.x, p.x,   r.x,  0.0,              0.0,
        beta.z, p.z,   r.z,  0.0,              0.0,
        0.0,    1.0,   alpha, 0.0,             0.0,
        0.0,    0.0,   0.0,  1.0,              0.0,
    ]);
    let b = SMatrix::from_row_slice(&[0.0, 0.0, a_c.x, r_c.x, a_c.z, r_c.z, 0.0, 0.0, 0.0, 0.0]);
    (a, b)
}

/// x(k+1) = A x(k) + B u(k) for inputs that are held over `h`.
fn discretise<const N: usize, const M: usize>((a, b): &System<N, M>, h: f64) -> System<N, M> {
    // Sums of (A h)^k / k! and of (A h)^k / (k+1)!.
    let (mut power, mut exp, mut integral) =
        (Square::<N>::identity(), Square::<N>::zeros(), Square::<N>::zeros());
    for k in 0..TERMS {
        exp += power;
        integral += power / f64::from(k + 1);
        power = power * a * (h / f64::from(k + 1));
    }
    (exp, integral * b * h)
}

/// K of u = -K x that minimises the sum of xᵀQx + uᵀRu, with the weights of Bryson's rule.
fn regulator<const N: usize, const M: usize>(
    (a, b): &System<N, M>,
    x_max: &[f64; N],
    u_max: &[f64; M],
) -> Option<SMatrix<f64, M, N>> {
    let (q, r) = (weights(x_max), weights(u_max));
    let p = riccati(a, b, &q, &r)?;
    let inverse = (r + b.transpose() * p * b).try_inverse()?;
    Some(inverse * b.transpose() * p * a)
}

fn weights<const N: usize>(largest: &[f64; N]) -> Square<N> {
    Square::<N>::from_diagonal(&SVector::from(largest.map(|x| 1.0 / (x * x))))
}

/// P of the discrete algebraic Riccati equation, by doubling.
fn riccati<const N: usize, const M: usize>(
    a: &Square<N>,
    b: &SMatrix<f64, N, M>,
    q: &Square<N>,
    r: &Square<M>,
) -> Option<Square<N>> {
    let (mut a, mut p) = (*a, *q);
    let mut g = b * r.try_inverse()? * b.transpose();
    for _ in 0..DOUBLINGS_MAX {
        let w = (Square::<N>::identity() + g * p).try_inverse()?;
        let next = p + a.transpose() * p * w * a;
        g += a * w * g * a.transpose();
        a = a * w * a;
        let change = (next - p).norm();
        // Rounding makes P unsymmetrical, and the doublings would make that grow.
        p = (next + next.transpose()) * 0.5;
        if !p.iter().all(|value| value.is_finite()) {
            return None;
        }
        if change <= 1.0e-12 * p.norm() {
            return Some(p);
        }
    }
    None
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_solution_satisfies_the_riccati_equation_and_stabilises() {
        let aircraft = config::aircraft_model("tvc_jet.toml", aircraft::DEFAULT_MODEL).unwrap();
        let model = DesignModel::new(aircraft);
        let system = discretise(&longitudinal(&model), 0.002);
        let k = regulator(
            &system,
            &Weights::JET.longitudinal_states,
            &Weights::JET.longitudinal_inputs,
        )
        .unwrap();
        let poles = (system.0 - system.1 * k).complex_eigenvalues();
        assert!(poles.iter().all(|z| z.re.hypot(z.im) < 1.0), "{poles}");
        let system = discretise(&lateral(&model), 0.002);
        let k =
            regulator(&system, &Weights::JET.lateral_states, &Weights::JET.lateral_inputs).unwrap();
        let poles = (system.0 - system.1 * k).complex_eigenvalues();
        assert!(poles.iter().all(|z| z.re.hypot(z.im) < 1.0), "{poles}");
        // A plant of one state with a known answer: p = 1 + p - p²/(1 + p) is the golden ratio.
        let one = Square::<1>::identity();
        let p = riccati(&one, &one, &one, &one).unwrap()[(0, 0)];
        assert!((p - 0.5 * (1.0 + 5_f64.sqrt())).abs() < 1.0e-12, "{p}");
    }

    #[test]
    fn the_shipped_gains_are_those_of_the_shipped_model() {
        let aircraft = config::aircraft_model("tvc_jet.toml", aircraft::DEFAULT_MODEL).unwrap();
        let designed = design(&aircraft, ControlPeriod::DEFAULT, &Weights::JET).unwrap();
        let (text, shipped) = (to_toml(&designed), to_toml(&LqrGains::REFERENCE));
        assert_eq!(
            text, shipped,
            "`sitl aircraft design lqr` gives the first, main_controller/lqr.rs has the second"
        );
    }

    #[test]
    fn a_model_that_no_gains_make_stable_is_refused() {
        let mut aircraft = config::aircraft_model("tvc_jet.toml", aircraft::DEFAULT_MODEL).unwrap();
        aircraft.effectors.c_pitch = icd::PerEffector::default();
        aircraft.effectors.c_lift = icd::PerEffector::default();
        let refused = design(&aircraft, ControlPeriod::DEFAULT, &Weights::JET);
        assert_eq!(refused, Err(no_solution("longitudinal")));
    }
}
