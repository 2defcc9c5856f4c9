//! Gusts, noise, and the sensor values that follow from them.

use super::*;
use crate::wind::{TurbulenceLevel, WindLevel, WindProfile};

#[test]
fn another_run_has_another_gust_and_other_noise() {
    let mut first = flat();
    first.wind.turbulence_m_s = 1.5;
    first.sensors.gyro_noise_rad_s = 0.001;
    let second = PlantSetup { run: 1, ..first.clone() };
    let (mut a, mut b) = (plant(&first), plant(&second));
    assert_ne!(a.sense().gyro.value, b.sense().gyro.value);
    assert_ne!(a.truth().wind, b.truth().wind);
}

#[test]
fn gyro_noise_does_not_touch_the_flight_or_the_gusts() {
    let mut ideal = flat();
    ideal.wind.turbulence_m_s = 1.5;
    let mut noisy = ideal.clone();
    noisy.sensors.gyro_noise_rad_s = 0.01;
    let (mut a, mut b) = (plant(&ideal), plant(&noisy));
    for _ in 0..200 {
        a.sense();
        let sensed = b.sense();
        assert_ne!(sensed.gyro.value, b.truth().body_rates);
        coast(&mut a, 1);
        coast(&mut b, 1);
    }
    assert_eq!(a.truth(), b.truth());
}

#[test]
fn ideal_sensors_report_the_truth_to_the_bit() {
    let mut plant = plant(&setup(EarthModel::Wgs84));
    fly(&mut plant, 300, wiggle);
    let (truth, sensors) = (*plant.truth(), plant.sense());
    assert_eq!(sensors.gyro, Sample::at(truth.time, truth.body_rates));
    assert_eq!(sensors.attitude, Sample::at(truth.time, truth.attitude));
    assert_eq!(sensors.vanes.value.sideslip_rad, truth.beta_rad);
    assert_eq!(sensors.engine_n.value, truth.deflections[tvc_jet::ENGINE]);
    let now = Stamp { time: truth.time, valid: true };
    assert!(sensors.present().all(|sensor| sensors.stamps()[sensor as usize] == now));
}

#[test]
fn gusts_show_in_the_air_data() {
    let mut setup = flat();
    setup.wind.turbulence_m_s = 3.0;
    let mut plant = plant(&setup);
    coast(&mut plant, 2_000);
    let truth = plant.truth();
    let gust = truth.attitude.to_body(truth.wind).0;
    let air = truth.attitude.to_body(truth.velocity).0 - gust;
    assert!(gust.norm() > 0.3, "gust {} m/s", gust.norm());
    // The same sums in another order.
    assert!((truth.airspeed_m_s - air.norm()).abs() < 1e-9);
    assert!((truth.alpha_rad - libm::atan2(air.z, air.x)).abs() < 1e-12);
}

#[test]
fn vanes_and_pitot_tube_feel_the_gust_where_they_are() {
    let mut setup = flat();
    setup.wind.turbulence_m_s = 6.0;
    setup.airframe.air_data.pitot_m = [8.0, 2.0, -1.0];
    let mut plant = plant(&setup);
    let mut largest = [0.0_f64; 3];
    for _ in 0..5_000 {
        coast(&mut plant, 1);
        let (gust, motion) = (plant.inputs.gust, plant.present.motion);
        let (truth, sensors) = (*plant.truth(), plant.sense());
        // Velocity of each place relative to the air there, less what the aircraft's own rotation adds.
        let vanes = motion.velocity.0 - gust.rates.0.cross(&Vector3::new(7.0, 0.0, 0.0));
        let pitot = motion.velocity.0 - gust.rates.0.cross(&Vector3::new(8.0, 2.0, -1.0));
        let expected =
            [pitot.norm(), libm::atan2(vanes.z, vanes.x), libm::asin(vanes.y / vanes.norm())];
        let FlowAngles { angle_of_attack_rad, sideslip_rad } = sensors.vanes.value;
        let sensed = [sensors.pitot.value.airspeed_m_s, angle_of_attack_rad, sideslip_rad];
        let centre = [truth.airspeed_m_s, truth.alpha_rad, truth.beta_rad];
        for i in 0..3 {
            assert!((sensed[i] - expected[i]).abs() < 1e-9, "{i}: {} {}", sensed[i], expected[i]);
            largest[i] = largest[i].max((sensed[i] - centre[i]).abs());
        }
    }
    // 6 m/s: q_g and r_g have some 0.1 rad/s rms, so the vanes are 0.7 m/s off the centre, 0.003 rad; the pitot
    // tube, 2 m to the side, 0.2 m/s.
    assert!(largest[0] > 0.2 && largest[1] > 0.003 && largest[2] > 0.003, "{largest:?}");
}

#[test]
fn damping_sees_the_rates_relative_to_the_gust() {
    let plant = plant(&flat());
    let (state, mut inputs) = (plant.state, plant.inputs);
    let calm = plant.dynamics.present(&state, &inputs).motion;
    let rates = Body::new(0.05, -0.03, 0.02);
    inputs.gust.rates = rates;
    let gusty = plant.dynamics.present(&state, &inputs).motion;
    let mut turning = state;
    turning.rigid.rates = Body(state.rigid.rates.0 - rates.0);
    inputs.gust.rates = Body::zero();
    let against = plant.dynamics.present(&turning, &inputs).motion;
    // Air that turns with +p acts as an aircraft that turns with -p: the same moment, to rounding.
    assert!((gusty.wrench.moment.0 - against.wrench.moment.0).norm() < 1e-6);
    // Damping drags the aircraft along with the air, on each axis.
    let added = gusty.wrench.moment.0 - calm.wrench.moment.0;
    for axis in 0..3 {
        assert!(added[axis] * rates.0[axis] > 0.0, "axis {axis}: {} N m", added[axis]);
    }
    // The air itself does not turn the gyros.
    assert_eq!(plant.truth().body_rates, state.rigid.rates);
}

#[test]
fn a_gust_from_below_lifts_the_aircraft_and_its_vanes_feel_it() {
    let gust = DiscreteGust {
        onset_s: 0.5,
        length_m: 60.0,
        forward_m_s: 0.0,
        right_m_s: 0.0,
        down_m_s: -10.0,
        returns: true,
    };
    let flown = |gusts: Vec<DiscreteGust>| {
        let mut plant = plant(&PlantSetup { gusts, ..flat() });
        let one = |_| {
            coast(&mut plant, 1);
            let truth = plant.truth();
            (truth.time.as_seconds(), truth.alpha_rad, truth.specific_force.0.z)
        };
        (0..1_000).map(one).collect::<Vec<_>>()
    };
    let (calm, gusty) = (flown(Vec::new()), flown(vec![gust]));
    for ((t_s, alpha, force), (_, alpha_gust, force_gust)) in calm.iter().zip(&gusty) {
        if *t_s < 0.499 {
            assert_eq!((alpha, force), (alpha_gust, force_gust));
        }
    }
    // 10 m/s from below at 264 m/s are 2.2 deg.
    let rise = calm.iter().zip(&gusty).map(|(calm, gusty)| gusty.1 - calm.1).fold(0.0, f64::max);
    assert!((0.025..0.042).contains(&rise), "{rise} rad");
    let pull = calm.iter().zip(&gusty).map(|(calm, gusty)| gusty.2 - calm.2).fold(0.0, f64::min);
    assert!(pull < -5.0, "{pull} m/s2");
}

#[test]
fn warm_air_reaches_every_part_of_the_plant() {
    let warm = PlantSetup { temperature_offset_k: 25.0, ..flat() };
    let (standard, mut plant) = (plant(&flat()), plant(&warm));
    let air = Atmosphere::new(25.0).air(plant.truth().altitude_m);
    assert!((plant.truth().density_kg_m3 / air.density - 1.0).abs() < 1e-12);
    assert!(plant.trim().alpha_rad > standard.trim().alpha_rad, "thin air needs more of it");
    let dynamics = plant.dynamics();
    let altitude_m = plant.truth().altitude_m;
    assert_eq!(dynamics.atmosphere().speed_of_sound(altitude_m), air.speed_of_sound);
    let pressure_pa = plant.sense().barometer.value.pressure_pa;
    assert!((pressure_pa / air.pressure - 1.0).abs() < 1e-12, "{pressure_pa} Pa");
    let reached = |setup: PlantSetup| {
        let mut plant = super::plant(&setup);
        coast(&mut plant, 500);
        *plant.truth()
    };
    let truth = reached(warm);
    assert!((truth.altitude_m - altitude_m).abs() < 1.0, "its trim holds: {} m", truth.altitude_m);
    // The step limit knows the density: a light body that is slow enough in thin air.
    assert!(Plant::new(&PlantSetup { temperature_offset_k: f64::NAN, ..flat() }).is_err());
}

#[test]
fn a_flight_begins_steadily_in_a_shear_and_meets_its_wind() {
    let levels = vec![
        WindLevel { altitude_m: 0.0, velocity_ned_m_s: [0.0, 0.0, 0.0] },
        WindLevel { altitude_m: 10_000.0, velocity_ned_m_s: [10.0, 20.0, 0.0] },
    ];
    let profile = WindProfile::new(levels).unwrap();
    let setup = PlantSetup { profile, ..flat() };
    let mut plant = plant(&setup);
    let truth = *plant.truth();
    let part = truth.altitude_m / 10_000.0;
    assert!((truth.wind.0 - Vector3::new(10.0, 20.0, 0.0) * part).norm() < 1e-12);
    assert!((truth.airspeed_m_s - setup.start.airspeed_m_s).abs() < 1e-9);
    assert!(truth.beta_rad.abs() < 1e-12 && truth.angular_acceleration.0.norm() < 1e-9);
    coast(&mut plant, 500);
    assert!((plant.truth().altitude_m - truth.altitude_m).abs() < 1.0);
}

#[test]
fn turbulence_of_a_level_reaches_the_flight_and_grows_with_the_level() {
    let rms = |turbulence| {
        let mut setup = flat();
        setup.wind.turbulence = turbulence;
        let mut plant = plant(&setup);
        let mut sum = 0.0;
        for _ in 0..4_000 {
            coast(&mut plant, 1);
            sum += plant.truth().wind.0.norm_squared() / 4_000.0;
        }
        sum.sqrt()
    };
    use TurbulenceLevel::{Light, Moderate, Severe};
    let [calm, light, moderate, severe] =
        [None, Some(Light), Some(Moderate), Some(Severe)].map(rms);
    assert_eq!(calm, 0.0);
    assert!(light > 0.5 && moderate > 1.2 * light && severe > 1.5 * moderate);
}
