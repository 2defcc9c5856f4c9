//! The sensors of a flight: the truth, with the errors of a grade and the effects of sensor faults.
//!
//! Of the grade `ideal` everything is exact, apart from white noise on the gyros if the scenario has some. Vanes and pitot tube are
//! away from the centre of gravity and measure the gust at their places: the part of p_g, q_g and r_g there remains in
//! the air data. The air data computer of the ideal unit corrects for the rotation of the aircraft itself, exactly and with the true
//! rates; so without turbulence its air data are the truth to the bit. Real vanes and pitot tubes feel that
//! rotation too.

use icd::geomagnetism::field_ned_nt;
use icd::{
    Body, Effector, EffectorKind, FlowAngles, GnssFix, ImpactPressure, Ned, Sample, Sensors,
    SimTime, StaticPressure,
};

use crate::aerodynamics::AirState;
use crate::airframe::{AirData, Airframe};
use crate::atmosphere::{Atmosphere, HEAT_RATIO};
use crate::dynamics::{Evaluation, Motion};
use crate::faults::Faults;
use crate::noise::{Normals, Source};
use crate::truth::Truth;
use crate::wind::Gust;

mod faulty;
pub mod grade;
mod real;

pub use grade::{Grade, GradeName, SensorSettings};

use faulty::FaultySensors;
use real::RealSensors;

/// The field of the Earth is computed anew after this time, µs; at 300 m/s it changes by some 2 nT meanwhile.
const FIELD_EVERY_US: u64 = 1_000_000;

/// The sensors of one flight.
#[derive(Debug, Clone)]
pub struct SensorSet {
    places: AirData,
    atmosphere: Atmosphere,
    engine: Option<Effector>,
    gyro_noise_rad_s: f64,
    gyro: Normals,
    year: f64,
    field: MagneticField,
    fitted: [bool; Sensors::SENSORS],
    real: Option<Box<RealSensors>>,
    faulty: FaultySensors,
}

/// What the sensors of the ground measure.
#[derive(Debug, Clone, Copy, Default)]
pub struct GroundSample {
    /// Of the lowest contact point, m.
    pub height_m: f64,
    /// Of all contact points, N.
    pub load_n: f64,
}

/// Magnetic field of the Earth where the aircraft is, nT, and until when it counts as constant.
#[derive(Debug, Clone, Copy)]
struct MagneticField {
    ned_nt: Ned,
    until: Option<SimTime>,
}

impl SensorSet {
    /// The sensors of an aircraft in this air with these errors; the random streams belong to seed and run.
    pub fn new(
        airframe: &Airframe,
        has_ground: bool,
        atmosphere: Atmosphere,
        settings: &SensorSettings,
        period_us: u32,
        seed: u64,
        run: u64,
    ) -> Self {
        let real =
            settings.grade.as_ref().map(|grade| RealSensors::new(grade, period_us, seed, run));
        Self {
            places: airframe.air_data,
            atmosphere,
            engine: airframe.effectors.only(EffectorKind::Engine),
            gyro_noise_rad_s: settings.gyro_noise_rad_s,
            gyro: Normals::new(seed, run, Source::Gyro),
            year: settings.date.decimal_year(),
            field: MagneticField { ned_nt: Ned::zero(), until: None },
            fitted: settings.of(airframe, has_ground),
            real: real.map(Box::new),
            faulty: FaultySensors::new(period_us, seed, run),
        }
    }

    /// A sample of each sensor, taken now, with the effects of `faults`; draws the noise of this tick. `present` and `gust` are
    /// those of `truth`.
    pub fn sense(
        &mut self,
        truth: &Truth,
        present: &Evaluation,
        gust: &Gust,
        ground: Option<GroundSample>,
        fuel_pct: f64,
        faults: &Faults,
    ) -> Sensors {
        let ground = ground.unwrap_or_default();
        let (AirData { vanes_m, pitot_m }, motion) = (self.places, &present.motion);
        // Taken out for the call, because `exact` borrows the whole set.
        let mut sensors = match self.real.take() {
            // Everything exactly, apart from the noise of the gyros.
            None => {
                let air = [vanes_m, pitot_m].map(|place_m| air_at(place_m, motion, gust));
                let gyro_error = self.gyro_error();
                self.exact(truth, present, &air, (ground, fuel_pct), &gyro_error)
            }
            // Everything exactly where it is measured, then with errors: vanes and pitot tube turn with the aircraft.
            Some(mut real) => {
                let air = [vanes_m, pitot_m].map(|place_m| air_around(place_m, motion));
                // The noise of the scenario is that of ideal gyros; a grade has its own.
                let sensors = real.sense(&self.exact(
                    truth,
                    present,
                    &air,
                    (ground, fuel_pct),
                    &Body::zero(),
                ));
                self.real = Some(real);
                sensors
            }
        };
        // After the errors: a fault is of the sensor that the aircraft has.
        self.faulty.apply(truth.time, faults, &mut sensors);
        // Last, so that nothing gives a sample to a sensor that is not there.
        sensors.keep(&self.fitted);
        sensors
    }

    /// Errors of the gyros without rotation, rad/s, and of the accelerometers in level flight, m/s², without noise: for judges of
    /// an estimator.
    pub fn inertial_biases(&self) -> [Body; 2] {
        self.real.as_deref().map_or([Body::zero(); 2], RealSensors::inertial_biases)
    }

    fn exact(
        &mut self,
        truth: &Truth,
        present: &Evaluation,
        [vanes, pitot]: &[AirState; 2],
        (ground, fuel_pct): (GroundSample, f64),
        gyro_error: &Body,
    ) -> Sensors {
        let time = truth.time;
        let fix = GnssFix {
            velocity: truth.velocity,
            position: truth.position,
            latitude_rad: truth.latitude_rad,
            longitude_rad: truth.longitude_rad,
            altitude_m: truth.altitude_m,
            decimal_year: self.year,
        };
        let angles =
            FlowAngles { angle_of_attack_rad: vanes.alpha_rad, sideslip_rad: vanes.beta_rad };
        let sound_m_s = self.atmosphere.speed_of_sound(present.place.geopotential_altitude_m);
        // a² = κ p/ρ of an ideal gas saves the exponential of the pressure.
        let pressure_pa = present.density * sound_m_s * sound_m_s / HEAT_RATIO;
        let airspeed_m_s = pitot.airspeed_m_s;
        let impact_pa = impact_pressure_pa(pressure_pa, airspeed_m_s / sound_m_s);
        let thrust_n = self.engine.map_or(0.0, |engine| truth.deflections[engine]);
        let field_nt = truth.attitude.to_body(self.field_ned_nt(truth));
        Sensors {
            gyro: Sample::at(time, Body(truth.body_rates.0 + gyro_error.0)),
            accelerometer: Sample::at(time, truth.specific_force),
            attitude: Sample::at(time, truth.attitude),
            gnss: Sample::at(time, fix),
            barometer: Sample::at(
                time,
                StaticPressure { pressure_pa, altitude_m: truth.altitude_m },
            ),
            pitot: Sample::at(time, ImpactPressure { impact_pa, airspeed_m_s }),
            vanes: Sample::at(time, angles),
            engine_n: Sample::at(time, thrust_n),
            magnetometer_nt: Sample::at(time, field_nt),
            radar_altimeter_m: Sample::at(time, ground.height_m),
            weight_on_wheels_n: Sample::at(time, ground.load_n),
            fuel_gauge_pct: Sample::at(time, fuel_pct),
            fitted: [true; Sensors::SENSORS],
        }
    }

    /// Magnetic field where the aircraft is, nT, NED.
    fn field_ned_nt(&mut self, truth: &Truth) -> Ned {
        if self.field.until.is_none_or(|until| until <= truth.time) {
            let Truth { latitude_rad, longitude_rad, altitude_m, time, .. } = *truth;
            self.field = MagneticField {
                ned_nt: field_ned_nt(latitude_rad, longitude_rad, altitude_m, self.year),
                until: Some(SimTime::from_micros(time.as_micros() + FIELD_EVERY_US)),
            };
        }
        self.field.ned_nt
    }

    /// Without noise no random number is drawn: the rates keep their bits.
    fn gyro_error(&mut self) -> Body {
        if self.gyro_noise_rad_s <= 0.0 {
            return Body::zero();
        }
        let mut axis = || self.gyro_noise_rad_s * self.gyro.draw();
        // In this order, which is part of every recorded flight.
        let (p, q, r) = (axis(), axis(), axis());
        Body::new(p, q, r)
    }
}

/// Impact pressure q_c, Pa, of isentropic flow without a shock, from static pressure (Pa) and Mach number:
/// q_c = p ((1 + 0.2 M²)^3.5 − 1).
fn impact_pressure_pa(pressure_pa: f64, mach: f64) -> f64 {
    let ratio = 1.0 + 0.2 * mach * mach;
    pressure_pa * (ratio * ratio * ratio * ratio.sqrt() - 1.0)
}

/// Motion relative to the air at a point, m from the centre of gravity, of an aircraft that does not rotate.
///
/// Where the air does not rotate it is that of the centre of gravity, with its bits.
fn air_at(place_m: [f64; 3], motion: &Motion, gust: &Gust) -> AirState {
    if gust.rates == Body::zero() {
        return motion.air;
    }
    let [x, y, z] = place_m;
    let beyond = gust.at(&Body::new(x, y, z)).0 - gust.velocity.0;
    AirState::new(&Body(motion.velocity.0 - beyond), motion.air.rates)
}

/// Motion relative to the air at a point, m from the centre of gravity. The rates of `motion.air` are those relative to the
/// air, so the rotation of the gust is in them.
fn air_around(place_m: [f64; 3], motion: &Motion) -> AirState {
    let [x, y, z] = place_m;
    let turning = motion.air.rates.0.cross(&Body::new(x, y, z).0);
    AirState::new(&Body(motion.velocity.0 + turning), motion.air.rates)
}
